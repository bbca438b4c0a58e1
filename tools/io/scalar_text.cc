#include "tools/io/scalar_text.h"

#include <charconv>
#include <cmath>
#include <system_error>

namespace hexcal {
namespace {

constexpr int kMaxId = 1'000'000;
constexpr int kMaxRange = 100'000;  // more than any family has
constexpr std::string_view kBlanks = " \t\r";

// Nothing unless all of the text is a number.
template <typename T>
std::optional<T> whole_number(std::string_view text) {
  T value{};
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || rest != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::optional<double> number_from_text(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  const auto value = whole_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> id_from_text(std::string_view text) {
  const auto id = whole_number<int>(text);
  return id && *id >= 0 && *id <= kMaxId ? id : std::nullopt;
}

std::optional<IdRange> id_range_from_text(std::string_view text) {
  const std::size_t dash = text.find('-');
  const auto first = id_from_text(text.substr(0, dash));
  const auto last = dash == std::string_view::npos ? first : id_from_text(text.substr(dash + 1));
  if (!first || !last || *last < *first || *last - *first > kMaxRange) return std::nullopt;
  return IdRange{*first, *last};
}

}  // namespace hexcal
