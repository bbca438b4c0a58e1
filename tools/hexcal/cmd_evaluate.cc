#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/statistics.h"
#include "kinematics/geometry/input_error.h"
#include "tools/hexcal/acceptance_limits.h"
#include "tools/hexcal/command.h"
#include "tools/hexcal/error_tables.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/json_text.h"
#include "tools/io/measurement_id.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct EvaluateFlags {
  fs::path targets;
  fs::path before;
  std::vector<fs::path> after;
  AcceptanceLimits limits;
  bool json = false;
};

using PoseById = std::map<std::string, Pose>;

// One pose table and its statistics, over its own valid poses and over those that all tables share.
struct EvaluatedTable {
  std::string label;
  PoseById poses;
  std::vector<std::string> without_pose;
  std::vector<std::string> suspect;  // measured, but something contradicts them: left out
  std::vector<std::string> without_target;
  std::vector<std::string> defining;  // the home that defines LG: zero by definition, no error of anything
  ErrorStatistics own;
  ErrorStatistics common;
};

EvaluatedTable read_table(const fs::path& path, const std::string& label, const PoseById& targets) {
  EvaluatedTable table;
  table.label = label;
  const fs::path covariance = path.parent_path() / "poses_covariance.csv";
  if (measurement_of(path) && of_another_measurement(path, {covariance}))
    fmt::print(stderr, "{}: is of another measurement than {} beside it\n", path.string(),
               covariance.string());
  for (const PoseRecord& record : read_pose_table(path)) {
    if (!record.pose) {
      table.without_pose.push_back(record.id);
    } else if (is_suspect(record.status)) {
      table.suspect.push_back(record.id);
    } else if (record.sigma && record.sigma->isZero(0) && record.pose->vector().isZero(0)) {
      table.defining.push_back(record.id);
    } else if (targets.count(record.id) == 0) {
      table.without_target.push_back(record.id);
    } else {
      table.poses[record.id] = *record.pose;
    }
  }
  if (table.poses.empty()) {
    throw InputError(fmt::format("{}: no pose has a target, wanted ids as in the targets", path.string()));
  }
  table.own = error_statistics([&] {
    std::vector<PosePair> pairs;
    for (const auto& [id, pose] : table.poses) pairs.push_back({targets.at(id), pose});
    return pairs;
  }());
  return table;
}

// The file's name where that tells the tables apart, else as many of its folders as it takes.
std::vector<std::string> labels_of(const std::vector<fs::path>& tables) {
  if (tables.size() == 1) return {"after"};
  std::vector<std::string> labels;
  std::vector<fs::path> rest;
  for (const fs::path& table : tables) {
    const fs::path whole = fs::absolute(table).lexically_normal();
    labels.push_back(whole.stem().string());
    rest.push_back(whole.parent_path());
  }
  const auto same = [&](std::size_t i) { return std::ranges::count(labels, labels[i]) > 1; };
  for (bool changed = true; changed;) {
    changed = false;
    const std::vector<std::string> before = labels;
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (std::ranges::count(before, before[i]) < 2 || !rest[i].has_filename()) continue;
      labels[i] = rest[i].filename().string() + "/" + labels[i];
      rest[i] = rest[i].parent_path();
      changed = true;
    }
  }
  for (std::size_t i = labels.size(); i-- > 0;)
    if (same(i))
      labels[i] += fmt::format(
          " ({})",
          std::count(labels.begin(), labels.begin() + static_cast<std::ptrdiff_t>(i) + 1, labels[i]));
  return labels;
}

Json improvement_json(const ErrorStatistics& before, const ErrorStatistics& after) {
  const auto percent = improvement_percent;
  return {{"position_magnitude_percent", percent(before.position_magnitude_mm, after.position_magnitude_mm)},
          {"orientation_magnitude_percent",
           percent(before.orientation_magnitude_rad, after.orientation_magnitude_rad)},
          {"position_rms_percent", percent(before.position_rms_mm, after.position_rms_mm)},
          {"orientation_rms_percent", percent(before.orientation_rms_rad, after.orientation_rms_rad)}};
}

// Tables 2 to 4 of the paper: ranges, eq. 7 and improvements, each table over its own valid poses.
std::string paper_table(const EvaluatedTable& before, const EvaluatedTable& after) {
  TextTable text(paper_columns("the paper's table"));
  const auto add = [&](const std::string& name, const ErrorStatistics& s) {
    text.add_row(paper_row(name, s));
  };
  add("error range " + before.label, before.own);
  if (&after != &before) {
    add("error range " + after.label, after.own);
    std::vector<std::string> cells(10);
    cells[0] = "magnitude of improvement";
    cells[8] =
        decimal(improvement_percent(before.own.position_magnitude_mm, after.own.position_magnitude_mm), 1) +
        " %";
    cells[9] = decimal(improvement_percent(before.own.orientation_magnitude_rad,
                                           after.own.orientation_magnitude_rad),
                       1) +
               " %";
    text.add_row(cells, Colour::bold);
  }
  return text.text();
}

std::string fair_table(const std::vector<EvaluatedTable>& tables) {
  TextTable text({fmt::format("true errors over the same {} poses", tables[0].common.poses), "rms_mm",
                  "max_mm", "rms_deg", "max_deg", "position", "orientation"});
  const ErrorStatistics& before = tables[0].common;
  for (const EvaluatedTable& table : tables) {
    const ErrorStatistics& s = table.common;
    const bool first = &table == &tables[0];
    text.add_row(
        {table.label, decimal(s.position_rms_mm, 4), decimal(s.position_max_mm, 4),
         decimal(s.orientation_rms_rad * kDegPerRad, 4), decimal(s.orientation_max_rad * kDegPerRad, 4),
         first ? "" : decimal(improvement_percent(before.position_rms_mm, s.position_rms_mm), 2) + " %",
         first ? ""
               : decimal(improvement_percent(before.orientation_rms_rad, s.orientation_rms_rad), 2) + " %"});
  }
  return text.text();
}

int run_evaluate(const EvaluateFlags& flags) {
  PoseById targets;
  for (const PoseRecord& record : read_pose_table(flags.targets)) {
    if (record.pose) targets[record.id] = *record.pose;
  }
  std::vector<EvaluatedTable> tables{read_table(flags.before, "before", targets)};
  const std::vector<std::string> labels = labels_of(flags.after);
  for (std::size_t i = 0; i < flags.after.size(); ++i)
    tables.push_back(read_table(flags.after[i], labels[i], targets));
  std::vector<std::string> common;
  for (const auto& shared : tables[0].poses) {
    const std::string& id = shared.first;
    if (std::all_of(tables.begin(), tables.end(), [&](const auto& t) { return t.poses.count(id) == 1; }))
      common.push_back(id);
  }
  for (EvaluatedTable& table : tables) {
    std::vector<PosePair> pairs;
    for (const std::string& id : common) pairs.push_back({targets.at(id), table.poses.at(id)});
    table.common = error_statistics(pairs);
  }
  bool some_failed = false;
  Json out;
  for (const EvaluatedTable& table : tables) {
    some_failed =
        some_failed || !table.without_pose.empty() || !table.suspect.empty() || !table.without_target.empty();
    Json entry{{"table", table.label},
               {"own_poses", error_json(table.own)},
               {"common_poses", error_json(table.common)},
               {"without_pose", table.without_pose},
               {"suspect", table.suspect},
               {"without_target", table.without_target},
               {"defines_frame", table.defining}};
    if (&table != &tables[0]) {
      entry["improvement_own_poses"] = improvement_json(tables[0].own, table.own);
      entry["improvement_common_poses"] = improvement_json(tables[0].common, table.common);
    }
    out["tables"].push_back(entry);
  }
  const ErrorStatistics& last = tables.back().own;
  for (const std::string& line : passed_limits(
           flags.limits, {last.position_max_mm, last.orientation_max_rad * kDegPerRad, std::nullopt, true})) {
    fmt::print(stderr, "limit: {} ({})\n", line, tables.back().label);
    some_failed = true;
  }
  if (flags.json) {
    fmt::print("{}\n", json_text(out, 2));
    return some_failed ? kSomeFailed : kDone;
  }
  if (tables.size() == 1) fmt::print("{}\n", paper_table(tables[0], tables[0]));
  for (std::size_t i = 1; i < tables.size(); ++i) fmt::print("{}\n", paper_table(tables[0], tables[i]));
  fmt::print("{}", fair_table(tables));
  for (const EvaluatedTable& table : tables) {
    if (!table.without_pose.empty())
      fmt::print("{}: no pose for {}\n", table.label, fmt::join(table.without_pose, ", "));
    if (!table.suspect.empty())
      fmt::print("{}: suspect and left out: {}\n", table.label, fmt::join(table.suspect, ", "));
    if (!table.without_target.empty())
      fmt::print("{}: no target for {}\n", table.label, fmt::join(table.without_target, ", "));
  }
  return some_failed ? kSomeFailed : kDone;
}

}  // namespace

void add_evaluate_command(CLI::App& app, Action& action) {
  const auto flags = std::make_shared<EvaluateFlags>();
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare pose tables: the paper's tables 2-4 and true rms");
  command->add_option("--targets", flags->targets, "poses that were wanted (targets.csv)")->required();
  command->add_option("--before", flags->before, "poses reached before compensation (poses.csv)")->required();
  command->add_option("--after", flags->after,
                      "poses reached after compensation; may be given several times");
  add_limit_flags(*command, flags->limits,
                  {"largest position error of the last table",
                   "largest angle between target and pose of the last table", false, false});
  command->add_flag("--json", flags->json, "machine-readable output");
  command->footer(
      "The paper's table stands over each table's own valid poses; the true errors stand over the poses "
      "that\n"
      "all tables share. position_mm and orientation_deg are the paper's eq. 7. Sample output:\n"
      "  true errors over the same 34 poses   rms_mm  max_mm  rms_deg  max_deg  position  orientation\n"
      "  before                               9.4106 17.2530   3.8641   6.9120\n"
      "  after                                0.0131  0.0302   0.0034   0.0071   99.86 %      99.91 %");
  command->callback([flags, &action] { action = [flags] { return run_evaluate(*flags); }; });
}

}  // namespace hexcal
