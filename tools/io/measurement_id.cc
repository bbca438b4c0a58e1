#include "tools/io/measurement_id.h"

#include <fmt/format.h>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/input_file.h"
#include "photogrammetry/photograph/sha256.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDigits = 16;
// As a comment of a table; as the first member of a JSON object.
constexpr std::string_view kTableMark = "\n# measurement ";
constexpr std::string_view kJsonMark = "{\n \"measurement\": \"";

}  // namespace

std::string measurement_id(std::string_view content) { return sha256_hex(content).substr(0, kDigits); }

std::string measurement_line(std::string_view id) { return fmt::format("{}{}\n", kTableMark.substr(1), id); }

std::optional<std::string> measurement_of(const fs::path& path) {
  InputFile file(path, ReadFor::own_result);
  if (!file.failure().empty() || file.is_pipe()) return std::nullopt;
  std::string text(16384, '\0');
  text.resize(file.read(text.data(), text.size()));
  std::size_t at = text.find(kTableMark);
  if (text.starts_with(kJsonMark)) {
    at = kJsonMark.size();
  } else if ((text.starts_with('#') || text.starts_with("\"#")) && at != std::string::npos) {
    at += kTableMark.size();
  } else {
    return std::nullopt;
  }
  return at + kDigits <= text.size() ? std::optional(text.substr(at, kDigits)) : std::nullopt;
}

std::optional<fs::path> of_another_measurement(const fs::path& file, const std::vector<fs::path>& others) {
  const auto own = measurement_of(file);
  for (const fs::path& other : others) {
    std::error_code error;
    if (!fs::is_regular_file(other, error)) continue;
    const auto its = measurement_of(other);
    const bool is_table = other.extension() == ".csv";  // what else names none is damaged, as its reader says
    if (its != own && (its || is_table)) return other;
  }
  return std::nullopt;
}

void require_one_measurement(const fs::path& file, const std::vector<fs::path>& others) {
  if (const auto other = of_another_measurement(file, others)) {
    throw InputError(
        fmt::format("{}: is of another measurement than {} (one was copied there, or measured with -o "
                    "elsewhere); measure again, or name the tables that belong together",
                    other->string(), file.string()));
  }
}

}  // namespace hexcal
