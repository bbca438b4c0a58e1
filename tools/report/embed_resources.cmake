# cmake -DOUTPUT=file.cc -DNAMES="a;b" -DFILES="x;y" -P embed_resources.cmake
# Writes a source file that holds each file's text as `extern const std::string_view kEmbedded_<name>`.
set(out "// Made by embed_resources.cmake.\n#include <string_view>\nnamespace hexcal {\n")
file(WRITE ${OUTPUT} "${out}")
list(LENGTH NAMES count)
math(EXPR last "${count} - 1")
foreach(i RANGE ${last})
  list(GET NAMES ${i} name)
  list(GET FILES ${i} file)
  file(READ "${file}" text)
  # "</script" inside a script would end it in a page.
  string(REPLACE "</script" "<\\/script" text "${text}")
  file(APPEND ${OUTPUT} "extern const std::string_view kEmbedded_${name};\n")
  file(APPEND ${OUTPUT} "const std::string_view kEmbedded_${name} = R\"HEXCAL~(")
  file(APPEND ${OUTPUT} "${text}")
  file(APPEND ${OUTPUT} ")HEXCAL~\";\n")
endforeach()
file(APPEND ${OUTPUT} "}  // namespace hexcal\n")
