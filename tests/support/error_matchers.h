#pragma once

#include <gmock/gmock.h>

#include <string>

#include "kinematics/geometry/input_error.h"

namespace hexcal {

/// Matches a callable that throws InputError whose one-line message holds `part`.
inline auto ThrowsInputError(const std::string& part) {
  return ::testing::ThrowsMessage<InputError>(
      ::testing::AllOf(::testing::HasSubstr(part), ::testing::Not(::testing::HasSubstr("\n"))));
}

}  // namespace hexcal
