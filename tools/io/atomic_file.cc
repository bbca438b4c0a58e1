#include "tools/io/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"

namespace hexcal {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw InputError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

// Removes the temporary file unless it has been renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target)
      : path_(target.parent_path() / fmt::format(".{}.{}.tmp", target.filename().string(), ::getpid())) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor_ < 0) fail(target, "write");
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!renamed_) ::unlink(path_.c_str());
  }

  void write(std::string_view contents, const std::filesystem::path& target) {
    while (!contents.empty()) {
      const ssize_t count = ::write(descriptor_, contents.data(), contents.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail(target, "write");
      contents.remove_prefix(static_cast<std::size_t>(count));
    }
  }

  void rename_to(const std::filesystem::path& target) {
    if (::fsync(descriptor_) != 0 && errno != EINVAL) fail(target, "write");
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail(target, "write");
    if (::rename(path_.c_str(), target.c_str()) != 0) fail(target, "write");
    renamed_ = true;
  }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw InputError(fmt::format("{}: no such file", path.string()));
  if (std::filesystem::is_directory(path, error)) {
    throw InputError(fmt::format("{}: is a folder, wanted a file", path.string()));
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) fail(path, "read");
  std::string contents((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) fail(path, "read");
  return contents;
}

void write_file_atomically(const std::filesystem::path& path, std::string_view contents) {
  const std::filesystem::path target = path.has_parent_path() ? path : std::filesystem::path(".") / path;
  std::error_code error;
  std::filesystem::create_directories(target.parent_path(), error);
  if (error)
    throw InputError(fmt::format("{}: cannot create: {}", target.parent_path().string(), error.message()));
  if (std::filesystem::is_directory(target, error)) {
    throw InputError(fmt::format("{}: is a folder, wanted a file name to write", path.string()));
  }
  TemporaryFile temporary(target);
  temporary.write(contents, target);
  temporary.rename_to(target);
}

std::string provenance_line(std::string_view version, std::string_view command,
                            const std::vector<std::filesystem::path>& inputs) {
  std::string line = fmt::format("# hexcal {}  {}", version, command);
  for (const auto& input : inputs) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(input, error)) continue;
    line += fmt::format("  {} sha256:{}", input.filename().string(), sha256_hex(read_file(input)));
  }
  return line + "\n";
}

}  // namespace hexcal
