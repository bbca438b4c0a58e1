#include "tools/campaign/campaign_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <set>

#include "kinematics/geometry/input_error.h"
#include "tools/io/atomic_file.h"

namespace hexcal {
namespace fs = std::filesystem;
namespace {

// Folders that this process holds: `run` holds its campaign for all of its stages.
std::set<fs::path>& held_folders() {
  static std::set<fs::path> held;
  return held;
}

}  // namespace

CampaignLock::CampaignLock(const fs::path& results) {
  std::error_code error;
  fs::create_directories(results, error);
  if (error) throw InputError(fmt::format("{}: cannot create: {}", results.string(), error.message()));
  const fs::path path = results / ".lock";
  folder_ = fs::weakly_canonical(results, error);
  if (held_folders().count(folder_) != 0) return;
  refuse_linked_folders(results);
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file_ < 0)
    throw InputError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
    ::close(file_);
    throw InputError(fmt::format("{}: another hexcal is working on this campaign; wait for it or stop it",
                                 results.parent_path().string()));
  }
  held_folders().insert(folder_);
  remove_abandoned_files(results);
  remove_abandoned_files(results / "cache");
}

CampaignLock::~CampaignLock() {
  if (file_ < 0) return;
  held_folders().erase(folder_);
  ::close(file_);
}

}  // namespace hexcal
