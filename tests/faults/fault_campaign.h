#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/run_hexcal.h"
#include "tools/io/pose_table.h"
#include "tools/synthetic/simulation.h"

namespace hexcal {

/// The poses of CleanCampaign, and those that stay healthy when the fault is in p002.
inline const std::vector<std::string> kAllPoses{"home", "p001", "p002", "p003"};
inline const std::vector<std::string> kButP002{"home", "p001", "p003"};

/// A small rendered campaign (home, p001, p002, p003 with three photographs each) with its truth, made and
/// measured once per process. Its files are never written to again; every case works on a copy.
class CleanCampaign {
 public:
  static const CleanCampaign& instance();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const VirtualLaboratory& laboratory() const { return laboratory_; }
  [[nodiscard]] const Pose& truth(const std::string& pose) const { return truth_.at(pose); }
  /// Largest error that a healthy pose of a faulty campaign may have: twice its clean one. A pose that
  /// happens to lie nearer to the truth than the campaign's rms counts with the rms.
  [[nodiscard]] double allowed_mm(const std::string& pose) const;
  [[nodiscard]] double allowed_deg(const std::string& pose) const;
  [[nodiscard]] const std::string& poses_csv() const { return poses_csv_; }

  /// The shots of a pose as they were taken (round 0), or from other stations.
  [[nodiscard]] std::vector<Shot> shots(const std::string& pose, std::uint64_t round = 0) const;
  /// True if no photograph changed since it was rendered.
  [[nodiscard]] bool photographs_untouched() const;

 private:
  CleanCampaign();
  [[nodiscard]] std::map<std::string, std::string> photograph_hashes() const;

  TemporaryFolder home_;
  std::filesystem::path folder_;
  VirtualLaboratory laboratory_;
  std::map<std::string, Pose> truth_;
  std::map<std::string, double> error_mm_, error_deg_;
  std::map<std::string, std::string> hashes_;
  std::string poses_csv_;
};

/// What a run of `hexcal measure` left behind.
struct Outcome {
  int exit_code = -1;
  std::string out, err;
  std::map<std::string, PoseRecord> poses;

  [[nodiscard]] const PoseRecord& pose(const std::string& id) const;
};

/// One copy of the clean campaign to play a fault on. Photographs are hard links: take them away or put
/// others in their place, never write into them.
class FaultCampaign {
 public:
  FaultCampaign();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::filesystem::path poses() const { return folder_ / "poses"; }
  /// The photographs of a pose in the order of their names.
  [[nodiscard]] std::vector<std::filesystem::path> photographs(const std::string& pose) const;
  /// Writes a new file in the place of what is there.
  void put(const std::filesystem::path& path, const std::string& bytes) const;
  /// The same for a rendered shot.
  void put(const std::filesystem::path& path, const Shot& shot) const;
  /// Replaces text that must be there in one of the campaign's files.
  void replace(const std::string& file, const std::string& old_text, const std::string& new_text) const;
  /// campaign.yaml with LG from the true coordinates of the moving markers, for campaigns without home.
  void use_nominal_lg() const;

  [[nodiscard]] Outcome measure(const std::vector<std::string>& flags = {}) const;

  /// All the poses named are ok and within twice their clean error.
  static void expect_healthy(const Outcome& outcome, const std::vector<std::string>& poses);
  /// The pose has no numbers and its status begins with `status` and has these words.
  static void expect_refused(const Outcome& outcome, const std::string& pose, const std::string& status,
                             const std::string& words = "");

 private:
  TemporaryFolder home_;
  std::filesystem::path folder_;
};

/// Error of a measured pose: position in mm and angle in degrees.
[[nodiscard]] std::pair<double, double> pose_distance(const Pose& a, const Pose& b);

}  // namespace hexcal
