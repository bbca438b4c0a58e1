#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "calibration/method_comparison.h"
#include "tests/calibration/virtual_machine.h"
#include "tests/support/hexapods.h"
#include "tests/support/run_hexcal.h"
#include "tools/io/hexapod_file.h"
#include "tools/io/pose_table.h"

namespace hexcal {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kHexapod =
    "base_joints_mm: [[254.3, 54.1, 0], [-80.3, 247.3, 0], [-174, 193.2, 0], [-174, -193.2, 0], [-80.3, "
    "-247.3, 0], "
    "[254.3, -54.1, 0]]\n"
    "platform_joints_mm: [[100.4, 111.5, 0], [46.4, 142.7, 0], [-146.7, 31.2, 0], [-146.7, -31.2, 0], "
    "[46.4, -142.7, 0], [100.4, -111.5, 0]]\n"
    "B_from_UG: {xyz_mm: [0, 0, 550], rpy_deg: [0, 0, 0]}\n"
    "P_from_LG: {xyz_mm: [0, 0, 70], rpy_deg: [0, 0, 0]}\n"
    "home: {gd_mm: 50}\n"
    "actuators: {min_mm: 380, max_mm: 580}\n";
constexpr const char* kHead = "pose,x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg\n";

class Compensate : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
    return (folder_.path() / name).string();
  }
  // Ten targets and what a machine made of them, off by the same motion everywhere.
  std::string rows(double shift_mm, double turn_deg, double scale_mm = 1) {
    std::string text;
    for (int i = 0; i < 10; ++i) {
      const double t = i;
      text += fmt::format("p{}", i);
      for (const double v :
           {10 * (t - 4) + shift_mm, 5 * (6 - t) + shift_mm, 3 * ((i * 7) % 10 - 4) + shift_mm})
        text += fmt::format(",{}", v * scale_mm);
      for (const double v : {(i * 3) % 10 - 4.5, (i * 7) % 10 - 5.5, (i * 9) % 10 - 3.5})
        text += fmt::format(",{}", v + turn_deg);
      text += "\n";
    }
    return text;
  }
  std::string table(double shift_mm, double turn_deg, double scale_mm = 1) {
    return fmt::format("{}{}", kHead, rows(shift_mm, turn_deg, scale_mm));
  }
  CommandResult run(const std::string& poses, const std::string& targets) {
    return run_hexcal({"compensate", "--hexapod", write("hexapod.yaml", kHexapod), "--targets",
                       write("targets.csv", targets), "--poses", write("poses.csv", poses), "-o",
                       (folder_.path() / "out").string()});
  }
  TemporaryFolder folder_;
};

TEST_F(Compensate, PrintsAllMethodsAndWritesTheFiles) {
  const CommandResult r = run(table(1.5, 0.3), table(0, 0));
  EXPECT_LE(r.exit_code, 1) << r.err;
  EXPECT_THAT(r.out, AllOf(HasSubstr("option1"), HasSubstr("option2"), HasSubstr("option3"),
                           HasSubstr("kinematic"), HasSubstr("wrote")));
  for (const char* name : {"model.yaml", "predicted_poses.csv", "actuators.csv"})
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out" / name)) << name;
  // The same input gives the same bytes.
  const std::filesystem::path model = folder_.path() / "out/model.yaml";
  const std::string first = contents(model);
  (void)run(table(1.5, 0.3), table(0, 0));
  EXPECT_EQ(contents(model), first);
}

TEST_F(Compensate, RefusesInOneClearLine) {
  const std::string targets = table(0, 0);
  const std::string good = table(1, 0.2);
  const auto refused = [&](const std::string& poses, const std::string& wanted_targets, const char* words) {
    const CommandResult r = run(poses, wanted_targets);
    EXPECT_EQ(r.exit_code, 2) << words;
    EXPECT_THAT(r.err, HasSubstr(words));
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out/model.yaml"));
  };
  refused(good.substr(0, good.find("p3")), targets, "3 measured poses");
  refused(good + "p3,1,2,3,4,5,6\n", targets, "pose 'p3' stands twice");
  refused(table(1, 0.2, 0.001), targets, "metres?");
  refused(good + "q,nan,2,3,4,5,6\n", targets, "x_mm");
  std::string level = kHead;
  for (int i = 0; i < 10; ++i) level += fmt::format("p{},{},{},{},0,0,0\n", i, 3 * i - 12, (7 * i) % 10, i);
  refused(level, level, "all poses are level");
  refused(good, fmt::format("{}z,0,0,0,0,0,0\n", kHead), "no pose has a target");
  refused(good + "far,0,0,300,0,0,0\n", targets + "far,0,0,300,0,0,0\n", "wanted 380 to 580 mm");
}

// A slip leaves words and no command, also where an earlier call left some.
TEST_F(Compensate, PosesThatContradictTheMachineLeaveNoCommand) {
  ASSERT_LE(run(table(1.5, 0.3), table(0, 0)).exit_code, 1);
  std::string mirrored = kHead;
  for (const PoseRecord& record : read_pose_table(write("straight.csv", table(1.5, 0.3)))) {
    const Vector6d v = record.pose->vector();
    mirrored += fmt::format("{},{},{},{},{},{},{}\n", record.id, v[0], -v[1], v[2], -v[3] * kDegPerRad,
                            v[4] * kDegPerRad, -v[5] * kDegPerRad);
  }
  const CommandResult r = run(mirrored, table(0, 0));
  EXPECT_EQ(r.exit_code, 1) << r.err;
  EXPECT_THAT(r.out,
              AllOf(HasSubstr("no command is given"), HasSubstr("left-handed frame"), HasSubstr("next:")));
  for (const char* name : {"actuators.csv", "predicted_poses.csv"}) {
    const std::string text = contents(folder_.path() / "out" / name);
    EXPECT_THAT(text, HasSubstr("withheld: the measured poses contradict hexapod.yaml"));
    EXPECT_THAT(text, Not(HasSubstr(",ok")));
  }
  EXPECT_THAT(contents(folder_.path() / "out/model.yaml"), HasSubstr("nominal"));
}

// Turned towards the machine's singular pose, and far from what the others say.
TEST_F(Compensate, NamesAnOutlierNearASingularPose) {
  const CommandResult r =
      run(table(1.5, 0.3) + "twist,31.5,1.5,1.5,0.3,0.3,75.3\n", table(0, 0) + "twist,0,0,0,0,0,75\n");
  EXPECT_LE(r.exit_code, 1) << r.err;
  EXPECT_THAT(r.out, HasSubstr("left out as near-singular outliers: twist\n"));
}

// One pose set for all rows: a pose that was measured wrongly may not make every method look good.
TEST_F(Compensate, AllRowsOfATableStandOverTheSamePoses) {
  std::string poses = table(1.5, 0.3);
  std::string targets = table(0, 0);
  for (int i = 0; i < 30; ++i) {
    const std::array<int, 6> v{(i * 7) % 31 - 15, (i * 11) % 29 - 14, (i * 5) % 23 - 11,
                               (i * 3) % 11 - 5,  (i * 5) % 9 - 4,    (i * 7) % 13 - 6};
    targets += fmt::format("m{}", i);
    poses += fmt::format("m{}", i);
    for (int k = 0; k < 6; ++k) {
      const int wanted = v.at(static_cast<std::size_t>(k));
      targets += fmt::format(",{}", wanted);
      // The same error everywhere, and something like noise.
      poses += fmt::format(",{}", wanted + (k < 3 ? 1.5 : 0.3) + 0.004 * ((i * 17 + k * 29) % 31 - 15));
    }
    targets += "\n";
    poses += "\n";
  }
  targets += "lost,5,5,5,1,1,1\n";
  poses += "lost,45,-25,35,9,-7,12\n";
  (void)run(poses, targets);
  const CommandResult r =
      run_hexcal({"compensate", "--json", "--hexapod", (folder_.path() / "hexapod.yaml").string(),
                  "--targets", (folder_.path() / "targets.csv").string(), "--poses",
                  (folder_.path() / "poses.csv").string(), "-o", (folder_.path() / "out").string()});
  const nlohmann::json out = nlohmann::json::parse(r.out);
  EXPECT_EQ(out["unexplained"], nlohmann::json::array({"lost"}));
  EXPECT_EQ(out["uncompensated"]["poses"], 40);
  EXPECT_LT(out["uncompensated"]["position_max_mm"], 10);
  const int common = out["common_before"]["poses"];
  EXPECT_GT(common, 0);
  for (const auto& method : out["methods"]) {
    if (!method.contains("failure")) {
      EXPECT_EQ(method["common_after"]["poses"], common) << method["name"];
    }
  }
  if (out.contains("identified")) {
    EXPECT_EQ(out["identified"]["poses"][0]["pose"], "p0");
    EXPECT_EQ(out["identified"]["poses"].back()["pose"], "lost");
  }
}

TEST_F(Compensate, ResultsGoToControllers) {
  (void)run(table(1.5, 0.3), table(0, 0));
  const auto in = [&](const char* name) { return (folder_.path() / "out" / name).string(); };
  const std::string written = (folder_.path() / "written").string();
  const auto exported = [&](const char* name, const char* format) {
    return run_hexcal({"export", in(name), "--to", format, "-o", written});
  };
  CommandResult r = exported("predicted_poses.csv", "pi-gcs");
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, HasSubstr("poses can be reached"));
  r = exported("actuators.csv", "csv");
  EXPECT_EQ(r.exit_code, 0) << r.err;
  r = exported("actuators.csv", "linuxcnc");
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_THAT(r.err, HasSubstr("wanted csv"));
  (void)run_hexcal({"compensate", "--hexapod", (folder_.path() / "hexapod.yaml").string(), "--targets",
                    (folder_.path() / "targets.csv").string(), "--poses",
                    (folder_.path() / "poses.csv").string(), "--method", "geometry", "-o",
                    (folder_.path() / "out").string()});
  r = exported("model.yaml", "linuxcnc");
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_THAT(r.out, HasSubstr("genhexkins, re-read"));
}

// Round 2: the hidden machine goes to the corrected commands, is measured again, and the model is refined.
TEST_F(Compensate, PosesMeasuredAfterCompensationRefineTheModel) {
  const std::filesystem::path lab = folder_.path() / "lab";
  const std::filesystem::path out = folder_.path() / "out";
  const std::string targets = (lab / "targets.csv").string();
  const auto done = [](const std::vector<std::string>& arguments) {
    const CommandResult r = run_hexcal(arguments);
    EXPECT_LE(r.exit_code, 1) << r.err;
  };
  std::mt19937_64 rng(1);
  // The truth with 0.1 mm and 0.03 deg of noise.
  const auto measure = [&](const std::filesystem::path& truth) {
    std::normal_distribution<double> normal;
    std::vector<PoseRecord> records = read_pose_table(truth / "truth/poses.csv");
    for (PoseRecord& record : records) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        record.pose->position_mm[k] += 0.1 * normal(rng);
        record.pose->rpy_rad[k] += 0.03 * kRadPerDeg * normal(rng);
      }
    }
    return format_pose_table("", records, PoseColumns::target);
  };
  const auto rms_mm = [&](const std::filesystem::path& truth) {
    std::vector<PosePair> pairs;
    const std::vector<PoseRecord> wanted = read_pose_table(targets);
    const std::vector<PoseRecord> reached = read_pose_table(truth / "truth/poses.csv");
    for (std::size_t i = 0; i < std::min(wanted.size(), reached.size()); ++i)
      if (reached[i].pose) pairs.push_back({*wanted[i].pose, *reached[i].pose});
    return error_statistics(pairs).position_rms_mm;
  };
  const auto compensate_round = [&](const char* round) {
    done({"compensate", "--hexapod", (lab / "hexapod.yaml").string(), "--targets", targets, "--poses",
          (folder_.path() / "poses.csv").string(), "--sigma-mm", "0.1", "--sigma-deg", "0.03", "--round",
          round, "-o", out.string()});
  };
  const auto move_to = [&](const std::filesystem::path& commands, const std::filesystem::path& to) {
    done({"simulate", "-o", to.string(), "--from", lab.string(), "--commands", commands.string(),
          "--photos-per-pose", "0"});
  };
  done({"simulate", "-o", lab.string(), "--seed", "5", "--poses", "20", "--photos-per-pose", "0",
        "--calibration-photos", "0"});
  write("poses.csv", measure(lab));
  compensate_round("1");
  move_to(out / "actuators.csv", folder_.path() / "lab2");
  std::filesystem::create_directories(out / "round2");
  write("out/round2/poses.csv", measure(folder_.path() / "lab2"));
  compensate_round("2");
  move_to(out / "round2/actuators.csv", folder_.path() / "lab3");
  const double first = rms_mm(folder_.path() / "lab2");
  const double second = rms_mm(folder_.path() / "lab3");
  EXPECT_LT(first, 0.03 * rms_mm(lab));
  EXPECT_LT(second, 0.9 * first);
}

// A machine with 0.05 mm of play in each leg, whose last directions of movement legs.csv gives; apart, one
// that in addition is non-linear by 1 % of the stroke and gives under its load.
class CompensateFaults : public Compensate {
 protected:
  // The command trains on 34 poses, the machine goes to 100 other targets; likewise by the paper's options
  // and by plain geometry.
  void run_machine(bool other_faults) {
    const PlatformGeometry nominal = surrogate_hexapod();
    MachineModel truth = as_built(nominal, {2, 2, 0.01}, 8);
    truth.backlash_mm.setConstant(0.05);
    if (other_faults) {
      for (std::size_t leg = 0; leg < 6; ++leg)
        truth.stroke_curves[leg] = {330, 630, {leg % 2 == 0 ? 1.2 : -1.2, 0.4, -0.3, 0.2, 0.15, -0.1}};
      truth.sag << 0.15, 4, -3, 5;
    }
    const TargetBox box{20, 20, 12};
    ObservationSet set = measured(truth, nominal, random_poses(34, box, 3), {});
    std::mt19937_64 rng(4);
    std::normal_distribution<double> normal;
    std::string targets = kHead;
    std::string poses = kHead;
    std::string legs = "pose,q1,q2,q3,q4,q5,q6,approach1,approach2,approach3,approach4,approach5,approach6\n";
    const auto row = [](const std::string& id, const Pose& pose) {
      const Eigen::Vector3d deg = pose.rpy_rad * kDegPerRad;
      return fmt::format("{},{},{},{},{},{},{}\n", id, pose.position_mm.x(), pose.position_mm.y(),
                         pose.position_mm.z(), deg.x(), deg.y(), deg.z());
    };
    LegVector before = readings_from_lengths(nominal, leg_lengths(nominal, nominal.home_B_from_P()));
    for (PoseObservation& pose : set.poses) {
      const LegVector approach = (pose.readings - before).cwiseSign();
      Vector6d v = machine_pose(truth, pose.readings, *pose.target, approach)->vector();
      for (Eigen::Index k = 0; k < 6; ++k) v[k] += (k < 3 ? 0.004 : 0.002 * kRadPerDeg) * normal(rng);
      pose.measured = Pose::from_vector(v);
      targets += row(pose.id, *pose.target);
      poses += row(pose.id, pose.measured);
      legs += pose.id;
      for (const double q : pose.readings) legs += fmt::format(",{}", q);
      for (const double direction : approach) legs += fmt::format(",{}", direction);
      legs += "\n";
      before = pose.readings;
    }
    const std::vector<Pose> others = random_poses(100, box, 5);
    std::string more = kHead;
    for (std::size_t i = 0; i < others.size(); ++i) more += row(fmt::format("t{}", i), others[i]);
    write("more.csv", more);
    write("targets.csv", targets);
    write("poses.csv", poses);
    write("legs.csv", legs);
    write("hexapod.yaml", hexapod_text("", nominal));
    const auto file = [&](const char* name) { return (folder_.path() / name).string(); };
    const CommandResult r =
        run_hexcal({"compensate", "--hexapod", file("hexapod.yaml"), "--targets", file("targets.csv"),
                    "--poses", file("poses.csv"), "--legs", file("legs.csv"), "--sigma-mm", "0.004",
                    "--sigma-deg", "0.002", "--apply", file("more.csv"), "-o", file("out")});
    ASSERT_LE(r.exit_code, 1) << r.err;
    printed_ = r.out;
    std::vector<std::optional<LegVector>> commands;
    for (const LegRecord& record : read_leg_table(folder_.path() / "out" / "actuators.csv"))
      commands.push_back(record.readings);
    run_to("auto", truth, before, others, commands);
    for (const auto& [name, method] : {std::pair("geometry", CompensationMethod::kinematic),
                                       std::pair("option1", CompensationMethod::option1),
                                       std::pair("option2", CompensationMethod::option2),
                                       std::pair("option3", CompensationMethod::option3)}) {
      std::string reason;
      const auto fitted = fit_candidate(nominal, set, {name, method, {}, 0}, &reason);
      ASSERT_TRUE(fitted) << reason;
      std::vector<Target> wanted;
      for (const Pose& pose : others) wanted.push_back({"", pose});
      commands.clear();
      for (const CorrectedCommand& command : compensate(fitted->model, wanted))
        commands.push_back(command.readings);
      run_to(name, truth, before, others, commands);
    }
  }
  // The machine runs from one target to the next, so its play takes either side.
  void run_to(const std::string& method, const MachineModel& truth, LegVector last,
              const std::vector<Pose>& targets, const std::vector<std::optional<LegVector>>& commands) {
    ASSERT_EQ(commands.size(), targets.size());
    std::vector<PosePair> pairs;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      if (!commands[i]) continue;
      const auto reached = machine_pose(truth, *commands[i], targets[i], (*commands[i] - last).cwiseSign());
      ASSERT_TRUE(reached);
      pairs.push_back({targets[i], *reached});
      last = *commands[i];
    }
    errors_[method] = error_statistics(pairs);
    RecordProperty(method, fmt::format("{:.4f} mm {:.4f} deg", errors_[method].position_rms_mm,
                                       errors_[method].orientation_rms_rad * kDegPerRad));
  }
  void expect_no_worse_than_the_paper() {
    for (const char* paper : {"option1", "option2", "option3"}) {
      EXPECT_LT(errors_["auto"].position_rms_mm, errors_[paper].position_rms_mm) << paper;
      EXPECT_LT(errors_["auto"].orientation_rms_rad, errors_[paper].orientation_rms_rad) << paper;
    }
  }
  std::string printed_;
  std::map<std::string, ErrorStatistics> errors_;
};

TEST_F(CompensateFaults, BacklashIsSeenFromApproachDirections) {
  run_machine(false);
  EXPECT_THAT(printed_, HasSubstr("* kinematic + backlash"));
  // Each leg's play to 10 %.
  const std::string& text = printed_;
  const std::size_t at = text.find("backlash of the legs ");
  ASSERT_NE(at, std::string::npos) << text;
  std::istringstream numbers(text.substr(at + std::string("backlash of the legs ").size()));
  for (int leg = 0; leg < 6; ++leg) {
    double play_mm = 0;
    numbers >> play_mm;
    EXPECT_NEAR(play_mm, 0.05, 0.005) << text.substr(at, 100);
  }
  expect_no_worse_than_the_paper();
  // Play itself remains: the directions in which targets will be approached are not known.
  EXPECT_LT(errors_["auto"].position_rms_mm, 0.1);
}

TEST_F(CompensateFaults, FaultsOutsideTheModelAreStatedAndNoWorseThanThePaper) {
  run_machine(true);
  EXPECT_THAT(printed_, AllOf(HasSubstr("* kinematic + "), HasSubstr("stroke curves of the legs up to")));
  expect_no_worse_than_the_paper();
  EXPECT_LT(errors_["auto"].position_rms_mm, 0.5 * errors_["geometry"].position_rms_mm);
}

}  // namespace
}  // namespace hexcal
