#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/faults/fault_campaign.h"
#include "tests/faults/image_variants.h"

// Links that lead elsewhere, folders that may not be written to, files that change while they are read,
// clocks that jump.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::AnyOf;
using ::testing::Eq;
using ::testing::HasSubstr;

class HostileFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(results_);
    fs::create_directories(elsewhere_);
  }
  void expect_nothing_elsewhere() const { EXPECT_TRUE(fs::is_empty(elsewhere_)); }

  FaultCampaign lab_;
  TemporaryFolder other_;
  const fs::path results_ = lab_.folder() / "results";
  const fs::path elsewhere_ = other_.path() / "elsewhere";
};

TEST_F(HostileFolders, ResultsAreNotWrittenThroughALinkedFolder) {
  fs::remove_all(results_);
  fs::create_directory_symlink(elsewhere_, results_);
  for (const char* command : {"measure", "run", "watch", "compensate", "report"}) {
    const CommandResult result = run_hexcal({command, lab_.folder().string()});
    EXPECT_EQ(result.exit_code, 2) << command << result.out;
    EXPECT_THAT(result.err, HasSubstr("results: is a link, wanted a folder")) << command;
  }
  expect_nothing_elsewhere();
}

TEST_F(HostileFolders, NorThroughALinkInTheResults) {
  fs::remove_all(results_ / "cache");
  for (const char* name : {"cache", "overlays", "colmap"}) {
    fs::create_directory_symlink(elsewhere_, results_ / name);
    const Outcome outcome = lab_.measure({"--overlays", "--colmap"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, HasSubstr(std::string(name) + ": is a link, wanted a folder"));
    fs::remove(results_ / name);
  }
  fs::create_symlink(elsewhere_ / "lock", results_ / ".lock");
  EXPECT_EQ(lab_.measure().exit_code, 2);
  fs::remove(results_ / ".lock");
  expect_nothing_elsewhere();
}

TEST_F(HostileFolders, ALinkedResultIsReplacedAndItsTargetUntouched) {
  lab_.put(elsewhere_ / "passwd", "root:x:0:0\n");
  for (const char* name : {"poses.csv", "quality.json", "observations.txt", "markers.ply", "report.html"})
    fs::create_symlink(elsewhere_ / "passwd", results_ / name);
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
  EXPECT_EQ(run_hexcal({"report", lab_.folder().string()}).exit_code, 0);
  EXPECT_EQ(contents(elsewhere_ / "passwd"), "root:x:0:0\n");
  EXPECT_FALSE(fs::is_symlink(results_ / "poses.csv"));
  EXPECT_FALSE(fs::is_symlink(results_ / "report.html"));
}

TEST_F(HostileFolders, PhotographsMayBeLinks) {
  const fs::path photograph = lab_.photographs("p001")[0];
  fs::rename(photograph, elsewhere_ / "a.jpg");
  fs::create_symlink(elsewhere_ / "a.jpg", photograph);
  fs::rename(lab_.poses() / "p003", elsewhere_ / "p003");
  fs::create_directory_symlink(elsewhere_ / "p003", lab_.poses() / "p003");
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
}

// As somebody without root's rights, who may not write where others do.
class WithoutRights : public HostileFolders {
 protected:
  void SetUp() override {
    HostileFolders::SetUp();
    if (::geteuid() == 0) {
      as_nobody_ = "setpriv --reuid 65534 --regid 65534 --clear-groups ";
      const std::string trial = as_nobody_ + HEXCAL_BINARY " --version >/dev/null 2>&1";
      if (std::system(trial.c_str()) != 0) GTEST_SKIP() << "cannot run as nobody";
      fs::permissions(lab_.folder().parent_path(), fs::perms(0755));
      allow(fs::perms(0777));
      // Photographs are links that other tests may have left to root alone.
      for (const auto& entry : fs::recursive_directory_iterator(lab_.poses())) {
        if (entry.is_regular_file()) fs::permissions(entry.path(), fs::perms(0644));
      }
    }
  }
  void TearDown() override { allow(fs::perms(0777)); }
  void allow(fs::perms perms) const {
    fs::permissions(results_, perms);
    if (fs::exists(results_ / "cache")) fs::permissions(results_ / "cache", perms);
  }
  // Runs `hexcal measure & after; wait`.
  [[nodiscard]] int measure(const std::string& after = "") const {
    const std::string line = "cd / && " + as_nobody_ + HEXCAL_BINARY " measure '" + lab_.folder().string() +
                             "' >'" + err_.string() + "' 2>&1 & " + after + " wait $!";
    return WEXITSTATUS(std::system(line.c_str()));
  }

  std::string as_nobody_;
  const fs::path err_ = other_.path() / "err";
};

TEST_F(WithoutRights, AFolderThatMayNotBeWrittenIsSaid) {
  ASSERT_EQ(measure(), 0) << contents(err_);
  const std::string before = contents(results_ / "poses.csv");
  allow(fs::perms(0555));
  fs::remove(lab_.photographs("p002")[1]);  // the next results would differ
  EXPECT_EQ(measure(), 2);
  EXPECT_THAT(contents(err_), HasSubstr("Permission denied"));
  EXPECT_EQ(contents(results_ / "poses.csv"), before);
  fs::remove_all(results_);
  fs::permissions(lab_.folder(), fs::perms(0555));
  EXPECT_EQ(measure(), 2);
  EXPECT_THAT(contents(err_), HasSubstr("Permission denied"));
  fs::permissions(lab_.folder(), fs::perms(0755));
  fs::create_directories(results_);
}

TEST_F(WithoutRights, ThatAreTakenAwayInMidRun) {
  for (const char* moment : {"0.02", "0.1", "0.3"}) {
    allow(fs::perms(0777));
    for (const auto& entry : fs::directory_iterator(results_)) fs::remove_all(entry.path());
    const int code = measure(std::string("sleep ") + moment + "; chmod 555 '" + results_.string() + "';");
    EXPECT_THAT(code, AnyOf(Eq(0), Eq(2)));
    EXPECT_THAT(contents(err_), HasSubstr(code == 2 ? "Permission denied" : ""));
    EXPECT_EQ(fs::exists(results_ / "poses.csv"), code == 0);
  }
}

TEST_F(WithoutRights, APhotographThatMayNotBeReadHasAStatus) {
  const fs::path photograph = lab_.photographs("p002")[1];
  lab_.put(photograph, contents(photograph));
  fs::permissions(photograph, fs::perms::none);
  EXPECT_EQ(measure(), 1) << contents(err_);
  EXPECT_THAT(contents(results_ / "photos.csv"), HasSubstr("cannot read: Permission denied"));
}

TEST_F(HostileFolders, APhotographThatIsRewrittenWhileItIsRead) {
  const fs::path photograph = lab_.photographs("p002")[1];
  const std::string whole = contents(photograph);
  lab_.put(photograph, whole);
  fs::remove_all(results_ / "cache");
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::size_t i = 0; !stop; ++i) {
      std::ofstream(photograph, std::ios::binary)
          << whole.substr(0, i % 3 == 0 ? whole.size() : i * 7919 % whole.size());
      std::this_thread::sleep_for(std::chrono::milliseconds(i % 5));
    }
  });
  for (int i = 0; i < 4; ++i) {
    const Outcome outcome = lab_.measure();
    EXPECT_THAT(outcome.exit_code, AnyOf(Eq(0), Eq(1))) << outcome.err;
    FaultCampaign::expect_healthy(outcome, kButP002);
  }
  stop = true;
  writer.join();
  // Nothing of it was kept.
  lab_.put(photograph, whole);
  const Outcome outcome = lab_.measure();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(contents(results_ / "poses.csv"), CleanCampaign::instance().poses_csv());
}

TEST_F(HostileFolders, WatchSettlesWhateverTheClockSays) {
  const auto now = fs::file_time_type::clock::now();
  const std::vector<std::chrono::hours> jumps{std::chrono::hours(24), std::chrono::hours(24 * 365),
                                              -std::chrono::hours(24), -std::chrono::hours(24 * 365 * 60)};
  std::size_t i = 0;
  for (const std::string& pose : kAllPoses) {
    for (const fs::path& photograph : lab_.photographs(pose)) {
      const std::string bytes = contents(photograph);
      lab_.put(photograph, bytes);
      fs::last_write_time(photograph, now + jumps[i++ % jumps.size()]);
    }
  }
  const CommandResult result =
      run_hexcal({"watch", lab_.folder().string(), "--expect", "3", "--stop-after", "1"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const std::string& pose : kAllPoses)
    EXPECT_THAT(result.out, HasSubstr(" " + pose + ": ")) << result.out;
}

}  // namespace
}  // namespace hexcal
