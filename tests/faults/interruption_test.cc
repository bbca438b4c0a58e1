#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <ctime>

#include "tests/faults/fault_campaign.h"

// Other runs at the same time, and disks that are full. Killed runs: kill_at_random.py.

namespace hexcal {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Interruption : public ::testing::Test {
 protected:
  [[nodiscard]] std::map<std::string, std::string> results() const {
    std::map<std::string, std::string> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(lab_.folder() / "results")) {
      if (entry.is_regular_file()) files[entry.path().filename().string()] = contents(entry.path());
    }
    return files;
  }
  FaultCampaign lab_;
};

TEST_F(Interruption, ASecondRunOnACampaignSaysSoAndStops) {
  const fs::path lock = lab_.folder() / "results" / ".lock";
  fs::create_directories(lock.parent_path());
  const int file = ::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  ASSERT_EQ(::flock(file, LOCK_EX | LOCK_NB), 0);
  for (const char* command : {"measure", "watch", "run"}) {
    const CommandResult result = run_hexcal({command, lab_.folder().string()});
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_THAT(result.err, HasSubstr("another hexcal is working on this campaign")) << command;
  }
  ::close(file);
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
}

TEST_F(Interruption, WhatAKilledRunLeftIsTakenAwayByTheNext) {
  lab_.put(lab_.folder() / "results" / ".poses.csv.999999999.3.tmp", "pose,sta");
  // Of a process whose number has been given to another one since: this one, which was not there in 2001.
  const fs::path reused = lab_.folder() / "results" / fmt::format(".poses.csv.{}.4.tmp", ::getpid());
  lab_.put(reused, "pose,sta");
  const std::array<timespec, 2> long_ago{{{1'000'000'000, 0}, {1'000'000'000, 0}}};
  ASSERT_EQ(::utimensat(AT_FDCWD, reused.c_str(), long_ago.data(), 0), 0);
  // Of one that is at work.
  const fs::path mine = lab_.folder() / "results" / fmt::format(".poses.csv.{}.5.tmp", ::getpid());
  lab_.put(mine, "pose,sta");
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
  EXPECT_FALSE(fs::exists(lab_.folder() / "results" / ".poses.csv.999999999.3.tmp"));
  EXPECT_FALSE(fs::exists(reused));
  EXPECT_TRUE(fs::exists(mine));
}

TEST_F(Interruption, AFullDiskIsAnErrorWithWordsAndLeavesTheOldResults) {
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
  const std::map<std::string, std::string> before = results();
  fs::remove(lab_.photographs("p002")[1]);  // the next results would differ
  const rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
  // No room for the largest of the results; the smaller ones would fit.
  const rlimit little{3000, unlimited.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  const int status = std::system(("'" HEXCAL_BINARY "' measure '" + lab_.folder().string() +
                                  "' 2>&1 >/dev/null | tail -c 300 > '" + lab_.folder().string() + "/err'")
                                     .c_str());
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &unlimited), 0);
  EXPECT_EQ(status, 0);
  EXPECT_THAT(contents(lab_.folder() / "err"), HasSubstr("cannot write: File too large"));
  EXPECT_EQ(results(), before);
  FaultCampaign::expect_healthy(lab_.measure(), kAllPoses);
}

}  // namespace
}  // namespace hexcal
