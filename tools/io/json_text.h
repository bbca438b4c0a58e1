#pragma once

#include <string>

namespace hexcal {

/// A JSON value as text. Names of files need not be UTF-8; what is not becomes U+FFFD.
template <typename Json>
[[nodiscard]] std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace hexcal
