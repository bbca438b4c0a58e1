#pragma once

#include <optional>
#include <string>

namespace hexcal {

/// Questions to a person at a terminal, each with a proposal that Enter takes. Where nobody is asked, the
/// proposal is the answer.
class Questions {
 public:
  /// Asks only if `wanted` and both standard input and output are a terminal.
  explicit Questions(bool wanted);
  [[nodiscard]] bool asked() const { return asked_; }
  /// Throws InputError if the input ends.
  [[nodiscard]] std::string ask(const std::string& words, const std::string& proposal) const;
  /// A number above 0; asks again until it is one. Wants asked() or a proposal.
  [[nodiscard]] double ask_number(const std::string& words, const std::optional<double>& proposal) const;

 private:
  bool asked_;
};

}  // namespace hexcal
