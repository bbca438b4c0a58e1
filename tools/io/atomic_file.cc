#include "tools/io/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <fstream>
#include <optional>

#include "kinematics/geometry/input_error.h"
#include "photogrammetry/photograph/sha256.h"

namespace hexcal {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw InputError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

constexpr std::string_view kTemporaryEnding = ".tmp";
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxStreamBytes = std::size_t{1} << 26;

// ".NAME.PROCESS.NUMBER.tmp": two threads may write one name at a time.
std::string temporary_name(const std::string& name) {
  static std::atomic<unsigned> number{0};
  return fmt::format(".{}.{}.{}{}", name, ::getpid(), number++, kTemporaryEnding);
}

// Process that made a temporary name; none if it is not one.
std::optional<pid_t> maker_of(std::string_view name) {
  if (!name.starts_with('.') || !name.ends_with(kTemporaryEnding)) return std::nullopt;
  name.remove_suffix(kTemporaryEnding.size());
  const std::size_t number = name.rfind('.');
  const std::size_t process = number == 0 ? number : name.rfind('.', number - 1);
  pid_t pid = 0;
  if (process == std::string_view::npos || process == number) return std::nullopt;
  const auto [rest, error] = std::from_chars(name.data() + process + 1, name.data() + number, pid);
  if (error != std::errc() || rest != name.data() + number || pid <= 0) return std::nullopt;
  return pid;
}

// A file under a temporary name beside its target; removed unless it has been renamed.
class TemporaryFile {
 public:
  TemporaryFile(const std::filesystem::path& path, std::string_view contents)
      : target_(path.has_parent_path() ? path : std::filesystem::path(".") / path),
        path_(target_.parent_path() / temporary_name(target_.filename().string())) {
    std::error_code error;
    std::filesystem::create_directories(target_.parent_path(), error);
    if (error)
      throw InputError(fmt::format("{}: cannot create: {}", target_.parent_path().string(), error.message()));
    if (std::filesystem::is_directory(target_, error)) {
      throw InputError(fmt::format("{}: is a folder, wanted a file name to write", path.string()));
    }
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor_ < 0) fail(target_, "write");
    try {
      write(contents);
    } catch (...) {
      remove();
      throw;
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  TemporaryFile(TemporaryFile&& other) noexcept
      : target_(std::move(other.target_)), path_(std::move(other.path_)), descriptor_(other.descriptor_) {
    other.descriptor_ = -1;
    other.path_.clear();
  }
  ~TemporaryFile() { remove(); }

  void flush() {
    if (::fsync(descriptor_) != 0 && errno != EINVAL) fail(target_, "write");
  }

  void rename_to_target() {
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0 || ::rename(path_.c_str(), target_.c_str()) != 0) fail(target_, "write");
    path_.clear();
  }

 private:
  void write(std::string_view contents) const {
    while (!contents.empty()) {
      const ssize_t count = ::write(descriptor_, contents.data(), contents.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail(target_, "write");
      contents.remove_prefix(static_cast<std::size_t>(count));
    }
    // The disk may begin now; whoever flushes several files waits for them together.
    (void)::sync_file_range(descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE);
  }

  void remove() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!path_.empty()) ::unlink(path_.c_str());
  }

  std::filesystem::path target_;
  std::filesystem::path path_;  // empty once it is renamed
  int descriptor_ = -1;
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
  // In one piece; what has no size beforehand (a pipe) in pieces. A file may grow or shrink meanwhile.
  const bool regular = std::filesystem::is_regular_file(path, error);
  const std::uintmax_t expected = regular ? std::filesystem::file_size(path, error) : 0;
  const std::size_t limit = regular ? kMaxFileBytes : kMaxStreamBytes;
  const auto refuse_size = [&path, limit](std::uintmax_t found) {
    if (found > limit) throw InputError(fmt::format("{}: holds more than {} bytes", path.string(), limit));
  };
  if (!error) refuse_size(expected);
  std::string contents(error ? 0 : static_cast<std::size_t>(expected), '\0');
  std::size_t size = 0;
  while (in && size <= limit) {
    if (size == contents.size()) {
      if (in.peek() == std::char_traits<char>::eof()) break;
      contents.resize(size + 65536);
    }
    in.read(contents.data() + size, static_cast<std::streamsize>(contents.size() - size));
    size += static_cast<std::size_t>(in.gcount());
  }
  if (in.bad()) fail(path, "read");
  refuse_size(size);
  contents.resize(size);
  return contents;
}

void write_file_atomically(const std::filesystem::path& path, std::string_view contents, Keep keep) {
  TemporaryFile file(path, contents);
  if (keep == Keep::always) {
    remove_abandoned_files(path.has_parent_path() ? path.parent_path() : ".", path.filename().string());
    file.flush();
  }
  file.rename_to_target();
}

void write_files_atomically(const std::vector<std::pair<std::filesystem::path, std::string>>& files) {
  std::vector<TemporaryFile> written;
  written.reserve(files.size());
  for (const auto& [path, text] : files) written.emplace_back(path, text);
  for (TemporaryFile& file : written) file.flush();
  for (TemporaryFile& file : written) file.rename_to_target();
}

void refuse_linked_folders(const std::filesystem::path& results) {
  std::error_code error;
  const auto refuse = [&error](const std::filesystem::path& folder) {
    if (!std::filesystem::is_symlink(folder, error)) return;
    throw InputError(fmt::format("{}: is a link, wanted a folder; results are not written through links",
                                 folder.string()));
  };
  refuse(results);
  for (const auto& entry : std::filesystem::directory_iterator(results, error)) {
    if (entry.is_directory(error)) refuse(entry.path());
  }
}

void remove_abandoned_files(const std::filesystem::path& folder, std::string_view of_file) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!of_file.empty() && !name.starts_with(fmt::format(".{}.", of_file))) continue;
    const auto maker = maker_of(name);
    const bool alive = maker && (::kill(*maker, 0) == 0 || errno == EPERM);
    std::error_code ignored;
    if (maker && !alive) std::filesystem::remove(entry.path(), ignored);
  }
}

std::string one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) {
      line += fmt::format("\\x{:02X}", byte);
    } else {
      line += c;
    }
  }
  return line;
}

std::string provenance_line(std::string_view version, std::string_view command,
                            const std::vector<std::filesystem::path>& inputs) {
  std::string line = fmt::format("# hexcal {}  {}", version, command);
  for (const auto& input : inputs) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(input, error)) continue;
    line += fmt::format("  {} sha256:{}", one_line(input.filename().string()), sha256_hex(read_file(input)));
  }
  return line + "\n";
}

}  // namespace hexcal
