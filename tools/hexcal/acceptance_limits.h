#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

namespace hexcal {

/// Limits of a regression test: a command whose results lie past one of them says so and exits with 1.
struct AcceptanceLimits {
  std::optional<double> max_mm, max_deg, max_rms_px;
  bool require_good = false;  ///< the verdict has to be good, without a warning
};

/// --max-mm, --max-deg, --max-rms-px, --require good; those of which the command says nothing are left out.
struct LimitFlags {
  const char* mm = "largest standard deviation of a position";
  const char* deg = "largest standard deviation of an angle";
  bool with_rms_px = true;
  bool with_verdict = true;
};
void add_limit_flags(CLI::App& command, AcceptanceLimits& limits, const LimitFlags& flags = {});

/// What was reached, to be held against the limits.
struct Reached {
  std::optional<double> mm, deg, rms_px;
  bool good = true;
};
/// A line for every limit that is passed: "position 0.12 mm, wanted at most 0.1". A limit whose figure is not
/// there counts as passed.
[[nodiscard]] std::vector<std::string> passed_limits(const AcceptanceLimits& limits, const Reached& reached);

}  // namespace hexcal
