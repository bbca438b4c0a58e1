#include <cstdint>
#include <string_view>

#include "kinematics/geometry/input_error.h"
#include "tools/io/csv_table.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto table =
        hexcal::CsvTable::parse(std::string_view(reinterpret_cast<const char*>(data), size), "fuzz.csv");
    for (std::size_t row = 0; row < table.rows(); ++row) {
      for (const std::string& column : table.columns()) {
        try {
          (void)table.optional_number(row, column);
          (void)table.integer(row, column);
        } catch (const hexcal::InputError&) {
        }
        (void)hexcal::csv_field(table.text(row, column));
      }
    }
  } catch (const hexcal::InputError&) {
  }
  return 0;
}
