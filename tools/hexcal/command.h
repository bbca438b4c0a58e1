#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace hexcal {

/// What a subcommand does once its flags are parsed; returns the exit code.
using Action = std::function<int()>;

enum ExitCode : int {
  kDone = 0,
  kSomeFailed = 1,  ///< done, but some items failed; they were listed
  kInputError = 2,  ///< the user's files or flags
  kBug = 3,
};

}  // namespace hexcal
