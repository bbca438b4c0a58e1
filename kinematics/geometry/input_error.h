#pragma once

#include <stdexcept>
#include <string>

namespace hexcal {

/// The user's files or flags are wrong. The message is one clear line: file, line or key, what was found,
/// what was wanted. It lives here because every module can reach this folder; main catches it once and exits
/// with 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace hexcal
