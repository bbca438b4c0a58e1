#include "tools/hexcal/acceptance_limits.h"

#include <fmt/format.h>

namespace hexcal {

void add_limit_flags(CLI::App& command, AcceptanceLimits& limits, const LimitFlags& flags) {
  const auto add = [&command](const char* name, std::optional<double>& limit, const char* what) {
    command.add_option(name, limit, fmt::format("exit with 1 where this is passed: {}", what))
        ->check(CLI::NonNegativeNumber);
  };
  if (flags.mm != nullptr) add("--max-mm", limits.max_mm, flags.mm);
  if (flags.deg != nullptr) add("--max-deg", limits.max_deg, flags.deg);
  if (flags.with_rms_px) add("--max-rms-px", limits.max_rms_px, "root mean square of the residuals");
  if (!flags.with_verdict) return;
  command
      .add_option_function<std::string>(
          "--require", [&limits](const std::string&) { limits.require_good = true; },
          "good: exit with 1 unless the verdict is good")
      ->check(CLI::IsMember({"good"}));
}

std::vector<std::string> passed_limits(const AcceptanceLimits& limits, const Reached& reached) {
  std::vector<std::string> lines;
  const auto hold = [&lines](const char* name, const char* unit, const std::optional<double>& limit,
                             const std::optional<double>& value) {
    if (!limit || (value && *value <= *limit)) return;
    lines.push_back(value ? fmt::format("{} {:.6g} {}, wanted at most {:.6g}", name, *value, unit, *limit)
                          : fmt::format("{} is not known, wanted at most {:.6g} {}", name, *limit, unit));
  };
  hold("position", "mm", limits.max_mm, reached.mm);
  hold("orientation", "deg", limits.max_deg, reached.deg);
  hold("residuals", "px rms", limits.max_rms_px, reached.rms_px);
  if (limits.require_good && !reached.good)
    lines.emplace_back("the verdict is not good, as --require good wants it");
  return lines;
}

}  // namespace hexcal
