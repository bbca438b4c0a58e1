#include "tools/hexcal/questions.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "kinematics/geometry/input_error.h"
#include "tools/io/scalar_text.h"

namespace hexcal {

Questions::Questions(bool wanted)
    : asked_(wanted && ::isatty(STDIN_FILENO) != 0 && ::isatty(STDOUT_FILENO) != 0) {}

std::string Questions::ask(const std::string& words, const std::string& proposal) const {
  if (!asked_) return proposal;
  fmt::print("{}{}? ", words, proposal.empty() ? "" : fmt::format(" [{}]", proposal));
  std::fflush(stdout);
  std::string answer;
  if (!std::getline(std::cin, answer)) throw InputError("no answer: the input ended; nothing was written");
  const std::string_view given = trimmed(answer);
  return given.empty() ? proposal : std::string(given);
}

double Questions::ask_number(const std::string& words, const std::optional<double>& proposal) const {
  while (true) {
    const std::string answer = ask(words, proposal ? fmt::format("{}", *proposal) : "");
    if (const auto number = number_from_text(answer); number && *number > 0) return *number;
    fmt::print("found '{}', wanted a number above 0\n", answer);
  }
}

}  // namespace hexcal
