#include "tools/io/kept_text.h"

#include <fmt/format.h>

#include "photogrammetry/photograph/sha256.h"

namespace hexcal {
namespace {

// A seal is what stands around the text: before, its SHA-256, between, the text, after.
struct Seal {
  std::string_view before, between, after;

  [[nodiscard]] std::string around(std::string_view text) const {
    return fmt::format("{}{}{}{}{}", before, sha256_hex(text), between, text, after);
  }
  [[nodiscard]] std::optional<std::string_view> broken_open(std::string_view sealed) const {
    constexpr std::size_t kDigits = 64;
    const std::size_t head = before.size() + kDigits + between.size();
    if (sealed.size() < head + after.size()) return std::nullopt;
    const std::string_view text = sealed.substr(head, sealed.size() - head - after.size());
    return around(text) == sealed ? std::optional(text) : std::nullopt;
  }
};

constexpr Seal kTextSeal{"# sha256 of what follows: ", "\n", ""};
constexpr Seal kJsonSeal{"{\"sha256\":\"", "\",\n\"kept\":", "}\n"};

}  // namespace

std::string sealed_text(std::string_view text) { return kTextSeal.around(text); }
std::optional<std::string_view> unsealed_text(std::string_view sealed) {
  return kTextSeal.broken_open(sealed);
}

std::string sealed_json(std::string_view json) { return kJsonSeal.around(json); }
std::optional<std::string_view> unsealed_json(std::string_view sealed) {
  return kJsonSeal.broken_open(sealed);
}

}  // namespace hexcal
