#include "tools/io/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstring>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/photograph/file_signature.h"
#include "photogrammetry/photograph/input_file.h"
#include "photogrammetry/photograph/photograph_format.h"
#include "tools/io/atomic_file.h"
#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

namespace fs = std::filesystem;

std::atomic<Overwrite> allowed{Overwrite::any_file};

[[noreturn]] void fail(const fs::path& path, const char* what) {
  throw InputError(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

[[noreturn]] void refuse(const fs::path& path, std::string_view what) {
  throw InputError(
      fmt::format("{}: {}; wanted another name, or --force to write over it", path.string(), what));
}

std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = trimmed(text.substr(0, end));
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

// What a file says of its origin at its beginning.
struct Origin {
  bool own = false;          // "# hexcal VERSION  COMMAND ..." is its first comment
  std::string_view command;  // that wrote it
  std::string_view kind;     // header of a table, first key of a mapping
};

Origin origin_of(std::string_view text) {
  constexpr std::string_view kMark = "# hexcal ";
  Origin origin;
  bool first_comment = true;
  for (int lines = 0; lines < 100 && !text.empty(); ++lines) {
    std::string_view line = next_line(text);
    if (line.empty() || line.starts_with("%YAML") || line == "---") continue;
    if (!line.starts_with('#')) {
      const std::size_t colon = line.find(':');
      origin.kind = line.substr(0, colon);
      break;
    }
    if (first_comment && line.starts_with(kMark)) {
      origin.own = true;
      line.remove_prefix(kMark.size());
      line.remove_prefix(std::min(line.find(' '), line.size()));
      line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
      origin.command = line.substr(0, line.find(' '));
    }
    first_comment = false;
  }
  return origin;
}

bool is_table_or_yaml(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".csv" || ending == ".yaml" || ending == ".yml";
}

bool lies_in_results(const fs::path& path) {
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(path.parent_path().empty() ? "." : path.parent_path(), error);
  return std::find(folder.begin(), folder.end(), "results") != folder.end();
}

constexpr std::size_t kBeginning = 16384;

// The beginning of what is there now.
std::string beginning_of(const fs::path& path) {
  InputFile file(path, ReadFor::own_result);
  std::string text(kBeginning, '\0');
  text.resize(file.failure().empty() ? file.read(text.data(), text.size()) : 0);
  return text;
}

// ".NAME.PROCESS.NUMBER.tmp": two threads may write one name at a time. A name may be as long as the file
// system allows, which leaves no room.
std::string temporary_name(const std::string& name) {
  constexpr std::size_t kMostOfName = 200;
  static std::atomic<unsigned> number{0};
  return fmt::format(".{}.{}.{}.tmp", name.substr(0, kMostOfName), ::getpid(), number++);
}

}  // namespace

void allow_overwriting(Overwrite what) { allowed = what; }
Overwrite allowed_overwriting() { return allowed; }

void require_writable(const fs::path& target, std::string_view contents) {
  std::error_code error;
  const fs::file_status there = fs::status(target, error);
  if (fs::is_directory(there))
    throw InputError(fmt::format("{}: is a folder, wanted a file name to write", target.string()));
  if (!fs::exists(there)) return;
  if (!fs::is_regular_file(there))
    throw InputError(fmt::format("{}: is a device or a pipe, wanted a file name to write", target.string()));
  if (allowed == Overwrite::any_file) return;
  if (was_read_as_input(target)) refuse(target, "was read by this command");
  if (lies_in_results(target)) return;
  const std::string old = beginning_of(target);
  const FileSignature signature = file_signature(old);
  if (photograph_format(target) != PhotographFormat::none ||
      (signature != FileSignature::other && signature != FileSignature::bmp))
    refuse(target, "is a photograph");
  if (!is_table_or_yaml(target)) return;
  const Origin before = origin_of(old);
  const Origin now = origin_of(contents);
  const bool same = before.command == now.command || before.kind == now.kind;
  if (old.size() < kBeginning && contents.starts_with(old)) return;  // nothing is lost
  if (!before.own) refuse(target, "is there already and hexcal did not write it");
  if (!same)
    refuse(target, fmt::format("is there already, another file than this one (hexcal {} wrote it)",
                               printable_text(before.command)));
}

OutputFile::OutputFile(const fs::path& path, std::string_view beginning)
    : target_(path.has_parent_path() ? path : fs::path(".") / path),
      path_(target_.parent_path() / temporary_name(target_.filename().string())) {
  require_writable(path, beginning);
  std::error_code error;
  fs::create_directories(target_.parent_path(), error);
  if (error)
    throw InputError(fmt::format("{}: cannot create: {}", target_.parent_path().string(), error.message()));
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (descriptor_ < 0) fail(target_, "write");
  try {
    write(beginning);
  } catch (...) {
    remove();
    throw;
  }
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : target_(std::move(other.target_)), path_(std::move(other.path_)), descriptor_(other.descriptor_) {
  other.descriptor_ = -1;
  other.path_.clear();
}

OutputFile::~OutputFile() { remove(); }

void OutputFile::write(std::string_view contents) {
  while (!contents.empty()) {
    const ssize_t count = ::write(descriptor_, contents.data(), contents.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(target_, "write");
    contents.remove_prefix(static_cast<std::size_t>(count));
  }
  // The disk may begin now; whoever flushes several files waits for them together.
  (void)::sync_file_range(descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE);
}

void OutputFile::flush() {
  if (::fsync(descriptor_) != 0 && errno != EINVAL) fail(target_, "write");
}

void OutputFile::rename_to_target() {
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0 || ::rename(path_.c_str(), target_.c_str()) != 0) fail(target_, "write");
  path_.clear();
}

void OutputFile::remove() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  if (!path_.empty()) ::unlink(path_.c_str());
}

}  // namespace hexcal
