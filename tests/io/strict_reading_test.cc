#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <functional>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "tests/support/temporary_folder.h"
#include "tools/io/csv_table.h"
#include "tools/io/number_range.h"
#include "tools/io/row_stream.h"
#include "tools/io/yaml_map.h"

namespace hexcal {
namespace {

using ::testing::HasSubstr;

std::string words_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string fault_of(std::string_view name, double value) {
  std::string fault;
  (void)ranged_number(name, value, fault);
  return fault;
}

TEST(NumberRange, IsToldByTheEndingOfTheName) {
  for (const char* name : {"x_mm", "roll_deg", "rms_px", "--max-mm", "gd_mm"}) {
    EXPECT_EQ(fault_of(name, 1e6), "") << name;
    EXPECT_EQ(fault_of(name, -500), "") << name;
    EXPECT_THAT(fault_of(name, 1e200), HasSubstr("wanted at most 1e+06")) << name;
    EXPECT_THAT(fault_of(name, -1e308), HasSubstr("found -1e+308")) << name;
  }
  EXPECT_EQ(fault_of("q1", 1e9), "");  // an encoder's counts
  EXPECT_THAT(fault_of("q1", 1e13), HasSubstr("wanted at most 1e+12"));
  for (const char* name : {"sigma_mm", "sigma_roll_deg", "print_scale_sigma"}) {
    EXPECT_EQ(fault_of(name, 0), "") << name;
    EXPECT_EQ(fault_of(name, 1e-4), "") << name;
    EXPECT_THAT(fault_of(name, -1e-4), HasSubstr("wanted 0 or more")) << name;
    EXPECT_THAT(fault_of(name, 1e-20), HasSubstr("wanted at least 1e-15")) << name;
  }
  EXPECT_THAT(fault_of("mm_per_unit", 1e-300), HasSubstr("wanted at least 1e-09"));
  EXPECT_EQ(fault_of("mm_per_unit", 1e-5), "");
  std::string fault;
  EXPECT_EQ(ranged_number("c12", 1e-300, fault), 0);
  EXPECT_EQ(fault, "");
}

TEST(PrintableText, LeavesNoControlCharacterAndAllElse) {
  EXPECT_EQ(printable_text("p001 \xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80 'x', #"),
            "p001 \xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80 'x', #");
  EXPECT_EQ(printable_text("a\x1b[31mb\n\t\r\x7f"), "a\\x1B[31mb\\x0A\\x09\\x0D\\x7F");
  EXPECT_EQ(printable_text("\x9b"
                           "31m \xC2\x9B"
                           "31m"),
            "\\x9B31m \\xC2\\x9B31m");                // C1: raw and as UTF-8
  EXPECT_EQ(printable_text("\xFF\xC3"), "\xFF\xC3");  // a name of another encoding
  EXPECT_EQ(printable_lines("a\n\tb\r"), "a\n\tb\\x0D");
}

TEST(StrictTables, WhatAReaderWouldGuessAtIsRefusedWithItsLine) {
  for (const auto& [rows, words] : {
           std::pair("p1,\"2", "t.csv:2: a quote is not closed"),
           {"\"p\"1,2", "t.csv:2: text behind a quoted field"},
           {"p1,\"1\"2", "t.csv:2: text behind a quoted field"},
           {"p1,1,2", "found 3 fields, wanted 2"},
           {"p1,1e308", "t.csv:2: column 'x_mm': found 1e+308"},
           {"p1,inf", "'inf' is not a number"},
           {"p1,nan", "'nan' is not a number"},
       }) {
    EXPECT_THAT(words_of([&rows = rows] {
                  const CsvTable table = CsvTable::parse(fmt::format("pose,x_mm\n{}\n", rows), "t.csv");
                  (void)table.number(0, "x_mm");
                }),
                HasSubstr(words))
        << rows;
  }
  EXPECT_THAT(words_of([] { (void)CsvTable::parse("pose,pose\n", "t.csv"); }), HasSubstr("stands twice"));
}

TEST(StrictTables, AnIdWithBlanksOrQuotesComesBackAsItWas) {
  for (const std::string id : {" ", "home ", " p", "#p", "p,1", "p\"1", "nan"}) {
    const CsvTable table = CsvTable::parse("pose,x_mm\n" + csv_field(id) + ",1\n", "t.csv");
    ASSERT_EQ(table.rows(), 1U) << id;
    EXPECT_EQ(table.text(0, "pose"), id);
  }
  EXPECT_EQ(CsvTable::parse("pose\n\"a\x1b[1m\nb\"\n", "t.csv").text(0, "pose"), "a\\x1B[1m\\x0Ab");
}

// The reader of long tables holds to the same.
TEST(StrictTables, LongTablesAreReadAsStrictly) {
  const TemporaryFolder folder;
  const auto stream = [&folder](const std::string& text) {
    std::ofstream(folder.path() / "in.csv", std::ios::binary) << text;
    const RowTransform transform{"pose", {"x_mm"}, "pose\n", [](const StreamedRow& row, std::string& out) {
                                   out += csv_field(row.id) + "\n";
                                   return true;
                                 }};
    return words_of([&] {
      (void)stream_rows(folder.path() / "in.csv", folder.path() / "out.csv", "# test", transform, 3);
    });
  };
  EXPECT_EQ(stream("pose,x_mm\np1,1\n\"p 2\" ,2\n"), "");
  for (const auto& [text, words] : {
           std::pair("pose,x_mm\np1,\"1\n", "in.csv:2: a quote"),
           {"pose,x_mm\n\"p\"1,1\n", "in.csv:2: a quote"},
           {"pose,x_mm,x_mm\np1,1,1\n", "column 'x_mm' stands twice"},
           {"pose,x_mm\np1,1\np2,1\np1,1\n", "in.csv:4: this pose stands twice"},
           {"pose,x_mm\np1,1e300\n", "in.csv:2: x_mm: found 1e+300"},
       })
    EXPECT_THAT(stream(text), HasSubstr(words)) << text;
}

TEST(StrictYaml, AnotherDocumentIsRefusedWithItsLine) {
  const auto read = [](const std::string& text) {
    return words_of([&] { (void)YamlMap::parse(text, "c.yaml"); });
  };
  EXPECT_EQ(read("---\na: 1\n"), "");
  EXPECT_EQ(read("a: 1\n...\n"), "");
  EXPECT_EQ(read("a: 1\n---\n# nothing more\n"), "");
  for (const char* text : {"a: 1\n---\na: 2\n", "a: 1\n...\nb: 2\n", "a: 1\n...\n---\nb: 2\n"})
    EXPECT_THAT(read(text), HasSubstr("another document begins")) << text;
}

TEST(StrictYaml, NumbersOutOfRangeAreNamedByKeyAndLine) {
  const YamlMap map = YamlMap::parse("max_mm: 1e300\nat_mm: [1, 2, -1e200]\nsigma_mm: 1e-300\n", "c.yaml");
  EXPECT_THAT(words_of([&] { (void)map.number("max_mm"); }), HasSubstr("c.yaml:1: max_mm: found 1e+300"));
  EXPECT_THAT(words_of([&] { (void)map.vector3("at_mm"); }), HasSubstr("c.yaml:2: at_mm: found -1e+200"));
  EXPECT_EQ(map.number("sigma_mm"), 0);
}

}  // namespace
}  // namespace hexcal
