#pragma once

#include <string>
#include <utility>

namespace hexcal {

/// How much a finding weighs. A bad one contradicts the results: nothing is to be sent to a machine.
enum class Severity { good, warning, bad };

/// Something found about the user's photographs, poses or machine. It lives here because every module can
/// reach this folder; a computing module finds, commands and pages only show.
struct Finding {
  Severity severity = Severity::warning;
  std::string cause;        ///< what is wrong, with names and figures
  std::string instruction;  ///< the one thing to do about it, in the imperative; empty where nothing helps

  // NOLINTNEXTLINE(google-explicit-constructor): a warning is mostly its words
  Finding(std::string what, std::string todo = {}, Severity how_bad = Severity::warning)
      : severity(how_bad), cause(std::move(what)), instruction(std::move(todo)) {}
};

/// "good", "warning", "bad".
[[nodiscard]] inline const char* severity_name(Severity severity) {
  return severity == Severity::good ? "good" : severity == Severity::warning ? "warning" : "bad";
}

/// Cause and instruction as one line: "cause: instruction" without full stop.
[[nodiscard]] inline std::string finding_text(const Finding& finding) {
  return finding.instruction.empty() ? finding.cause : finding.cause + ": " + finding.instruction;
}

}  // namespace hexcal
