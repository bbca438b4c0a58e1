#include "tools/io/atomic_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/printable_text.h"
#include "photogrammetry/photograph/sha256.h"
#include "tools/io/output_file.h"

namespace hexcal {
namespace {

constexpr std::string_view kTemporaryEnding = ".tmp";
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxStreamBytes = std::size_t{1} << 26;

// Process that made a temporary name (".NAME.PROCESS.NUMBER.tmp", output_file.cc); none if it is not one.
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

// Whether that process still runs. Numbers of processes are used again: one that began after the file was
// last written is another (field 22 of /proc/PID/stat, clock ticks since the machine started).
bool still_runs(pid_t maker, const std::filesystem::path& file) {
  if (::kill(maker, 0) != 0 && errno != EPERM) return false;
  std::ifstream stat_file(fmt::format("/proc/{}/stat", maker));
  std::string line;
  struct stat written {};
  if (!std::getline(stat_file, line) || ::stat(file.c_str(), &written) != 0) return true;
  std::istringstream fields(line.substr(line.rfind(')') + 1));  // the name before it may hold blanks
  std::string field;
  for (int i = 3; i < 22; ++i) fields >> field;
  double ticks = 0;
  if (!(fields >> ticks)) return true;
  const auto seconds = [](const timespec& t) {
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  timespec now{};
  timespec up{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  ::clock_gettime(CLOCK_BOOTTIME, &up);
  const double began = seconds(now) - seconds(up) + ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
  constexpr double kTicksOff = 0.05;
  return began <= seconds(written.st_mtim) + kTicksOff;
}

// What came through a pipe, by its name: it comes once.
std::string& piped(const std::filesystem::path& path, const std::function<std::string()>& read) {
  static std::mutex mutex;
  static std::map<std::string, std::string> contents;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto found = contents.find(path.string());
  return found != contents.end() ? found->second : contents.emplace(path.string(), read()).first->second;
}

}  // namespace

std::string read_file(const std::filesystem::path& path, ReadFor purpose) {
  const auto fail = [&path](const std::string& why) {
    throw InputError(fmt::format("{}: {}", path.string(), why));
  };
  const auto read_to_end = [&](InputFile& file) {
    const std::size_t limit = file.is_pipe() ? kMaxStreamBytes : kMaxFileBytes;
    const auto refuse_size = [&fail, limit](std::uintmax_t found) {
      if (found > limit) fail(fmt::format("holds more than {} bytes", limit));
    };
    refuse_size(file.size());
    // In one piece; what has no size beforehand (a pipe) in pieces. A file may grow or shrink meanwhile.
    std::string contents(static_cast<std::size_t>(file.size()) + 1, '\0');
    std::size_t size = 0;
    while (size <= limit) {
      size += file.read(contents.data() + size, contents.size() - size);
      if (size < contents.size()) break;
      contents.resize(size + 65536);
    }
    if (!file.failure().empty()) fail(file.failure());
    refuse_size(size);
    contents.resize(size);
    return contents;
  };
  if (is_handed_pipe(path)) {
    return piped(path, [&] {
      InputFile file(path, purpose);
      if (!file.failure().empty()) fail(file.failure());
      return read_to_end(file);
    });
  }
  InputFile file(path, purpose);
  if (!file.failure().empty()) fail(file.failure());
  return read_to_end(file);
}

void write_file_atomically(const std::filesystem::path& path, std::string_view contents, Keep keep) {
  OutputFile file(path, contents);
  if (keep == Keep::always) {
    remove_abandoned_files(path.has_parent_path() ? path.parent_path() : ".", path.filename().string());
    file.flush();
  }
  file.rename_to_target();
}

void write_files_atomically(const std::vector<std::pair<std::filesystem::path, std::string>>& files) {
  std::set<std::filesystem::path> names;
  for (const auto& [path, text] : files) {
    if (!names.insert(std::filesystem::absolute(path).lexically_normal()).second)
      throw InputError(fmt::format("{}: two results would go to this file", path.string()));
    require_writable(path, text);
  }
  std::vector<OutputFile> written;
  written.reserve(files.size());
  for (const auto& [path, text] : files) written.emplace_back(path, text);
  for (OutputFile& file : written) file.flush();
  for (OutputFile& file : written) file.rename_to_target();
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
    std::error_code ignored;
    if (maker && !still_runs(*maker, entry.path())) std::filesystem::remove(entry.path(), ignored);
  }
}

std::string provenance_line(std::string_view version, std::string_view command,
                            const std::vector<std::filesystem::path>& inputs) {
  std::string line = fmt::format("# hexcal {}  {}", version, command);
  for (const auto& input : inputs) {
    std::error_code error;
    const bool piped = is_handed_pipe(input);
    if (!piped && !std::filesystem::is_regular_file(input, error)) continue;
    line += fmt::format("  {} sha256:{}", piped ? "pipe" : printable_text(input.filename().string()),
                        sha256_hex(read_file(input)));
  }
  return line + "\n";
}

}  // namespace hexcal
