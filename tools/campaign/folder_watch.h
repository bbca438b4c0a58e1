#pragma once

#include <filesystem>

namespace hexcal {

/// Waits for changes below a folder: by inotify where the system has it, and by time anyway, because network
/// folders report nothing.
class FolderWatch {
 public:
  explicit FolderWatch(const std::filesystem::path& folder);
  FolderWatch(const FolderWatch&) = delete;
  FolderWatch& operator=(const FolderWatch&) = delete;
  ~FolderWatch();

  /// Returns when something changed or after `milliseconds`, whichever is first.
  void wait(int milliseconds);

 private:
  void add(const std::filesystem::path& folder);
  int inotify_ = -1;
  std::filesystem::path folder_;
};

}  // namespace hexcal
