#include "tools/campaign/folder_watch.h"

#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>

namespace hexcal {
namespace fs = std::filesystem;

FolderWatch::FolderWatch(const fs::path& folder) : folder_(folder) {
  inotify_ = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  add(folder_);
}

FolderWatch::~FolderWatch() {
  if (inotify_ >= 0) ::close(inotify_);
}

void FolderWatch::add(const fs::path& folder) {
  if (inotify_ < 0) return;
  constexpr unsigned kEvents = IN_CREATE | IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE;
  ::inotify_add_watch(inotify_, folder.c_str(), kEvents);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    std::error_code ignored;
    if (entry.is_directory(ignored)) add(entry.path());
  }
}

void FolderWatch::wait(int milliseconds) {
  pollfd request{inotify_, POLLIN, 0};
  const int ready = ::poll(&request, inotify_ >= 0 ? 1 : 0, milliseconds);
  if (ready <= 0) return;
  std::array<char, 8192> events{};
  while (::read(inotify_, events.data(), events.size()) > 0) {
  }
  add(folder_);  // folders that are new; a watch twice on one folder is one watch
}

}  // namespace hexcal
