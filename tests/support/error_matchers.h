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

/// Options are valid as they come; `change` makes one of them wrong, and the refusal says `words`.
template <typename Options, typename Change>
void expect_option_refused(const std::string& words, Change change) {
  Options options;
  EXPECT_NO_THROW(options.validate());
  change(options);
  EXPECT_THAT([&options] { options.validate(); }, ThrowsInputError(words));
}

}  // namespace hexcal
