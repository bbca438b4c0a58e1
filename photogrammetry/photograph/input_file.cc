#include "photogrammetry/photograph/input_file.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <mutex>
#include <utility>

namespace hexcal {
namespace {

namespace fs = std::filesystem;

using FileId = std::pair<dev_t, ino_t>;

struct ReadFiles {
  std::mutex mutex;
  std::map<FileId, fs::path> names;  // absolute name under which a file was read
};

ReadFiles& read_files() {
  static ReadFiles files;
  return files;
}

void remember(const struct stat& file, const fs::path& path) {
  std::error_code error;
  fs::path name = fs::absolute(path, error);
  ReadFiles& files = read_files();
  const std::lock_guard<std::mutex> lock(files.mutex);
  files.names[{file.st_dev, file.st_ino}] = std::move(name);
}

// File systems whose files are the kernel's: reading one may wait for ever, or have an effect.
bool is_kernel_file_system(const fs::path& path) {
  struct statfs system {};
  if (::statfs(path.c_str(), &system) != 0) return false;
  switch (static_cast<unsigned long>(system.f_type)) {
    case PROC_SUPER_MAGIC:
    case SYSFS_MAGIC:
    case DEBUGFS_MAGIC:
    case TRACEFS_MAGIC:
    case CGROUP2_SUPER_MAGIC:
    case SECURITYFS_MAGIC:
      return true;
    default:
      return false;
  }
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "is a folder, wanted a file";
  if (S_ISFIFO(mode)) return "is a named pipe, wanted a file";
  if (S_ISSOCK(mode)) return "is a socket, wanted a file";
  return "is a device, wanted a file";
}

}  // namespace

bool is_handed_pipe(const fs::path& path) {
  const std::string name = path.lexically_normal().string();
  return name == "/dev/stdin" || name.starts_with("/dev/fd/") || name.starts_with("/proc/self/fd/");
}

InputFile::InputFile(const fs::path& path, ReadFor purpose) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) {
    failure_ = errno == ENOENT ? "no such file" : std::string("cannot read: ") + std::strerror(errno);
    return;
  }
  exists_ = true;
  pipe_ = S_ISFIFO(file.st_mode) && is_handed_pipe(path);
  if (!pipe_ && !S_ISREG(file.st_mode)) {
    failure_ = kind_of(file.st_mode);
    return;
  }
  if (!pipe_ && is_kernel_file_system(path)) {
    failure_ = "belongs to the kernel, wanted a file";
    return;
  }
  // Should a pipe have taken its place since, the opening does not wait for a writer.
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | (pipe_ ? 0 : O_NONBLOCK));
  if (descriptor_ < 0 || ::fstat(descriptor_, &file) != 0) {
    failure_ = std::string("cannot read: ") + std::strerror(errno);
    return;
  }
  if (!pipe_ && !S_ISREG(file.st_mode)) {
    failure_ = kind_of(file.st_mode);
    return;
  }
  if (pipe_) return;
  size_ = static_cast<std::uintmax_t>(file.st_size);
  if (purpose == ReadFor::input) remember(file, path);
}

InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::size_t InputFile::read(char* to, std::size_t wanted) {
  std::size_t got = 0;
  while (failure_.empty() && got < wanted) {
    const ssize_t count = ::read(descriptor_, to + got, wanted - got);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) failure_ = std::string("cannot read: ") + std::strerror(errno);
    if (count <= 0) break;
    got += static_cast<std::size_t>(count);
  }
  return got;
}

void InputFile::rewind() {
  if (::lseek(descriptor_, 0, SEEK_SET) < 0) failure_ = std::string("cannot read: ") + std::strerror(errno);
}

bool was_read_as_input(const fs::path& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return false;
  ReadFiles& files = read_files();
  const std::lock_guard<std::mutex> lock(files.mutex);
  const auto found = files.names.find({file.st_dev, file.st_ino});
  if (found == files.names.end()) return false;
  // An input that was replaced since leaves its inode to the next file, which is not it.
  struct stat still {};
  return ::stat(found->second.c_str(), &still) == 0 && still.st_dev == file.st_dev &&
         still.st_ino == file.st_ino;
}

}  // namespace hexcal
