#include <cstdint>
#include <string>

#include "kinematics/geometry/input_error.h"
#include "tools/io/yaml_map.h"

namespace {

// Asks for every key in every way, as a reader with a mistaken idea of the file would.
void visit(const hexcal::YamlMap& map) {
  for (const std::string& key : map.keys()) {
    const auto attempt = [](const auto& read) {
      try {
        (void)read();
      } catch (const hexcal::InputError&) {
      }
    };
    attempt([&] { return map.number(key); });
    attempt([&] { return map.integer(key); });
    attempt([&] { return map.text(key); });
    attempt([&] { return map.boolean_or(key, false); });
    attempt([&] { return map.numbers(key); });
    attempt([&] { return map.numbers_or_one(key, 6); });
    attempt([&] { return map.vectors3(key); });
    attempt([&] { return map.texts(key); });
    attempt([&] { return map.rigid3(key); });
    if (map.is_map(key)) visit(map.map(key));
    if (map.is_sequence(key)) {
      try {
        for (const hexcal::YamlMap& entry : map.maps(key)) visit(entry);
      } catch (const hexcal::InputError&) {
      }
    }
  }
  map.finish();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    visit(hexcal::YamlMap::parse(std::string(reinterpret_cast<const char*>(data), size), "fuzz.yaml"));
  } catch (const hexcal::InputError&) {
  }
  return 0;
}
