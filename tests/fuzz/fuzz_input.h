#pragma once

#include <unistd.h>

#include <Eigen/Core>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "kinematics/geometry/input_error.h"

namespace hexcal::fuzzing {

/// The promise of every reader: it gives something usable or throws InputError. Anything else that is thrown
/// ends the program, which libFuzzer counts as a crash.
template <typename Read>
void refused_or(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

/// Gives the input to the reader that its first byte names; to none if there is no such reader.
inline void read_by_first_byte(const std::uint8_t* data, std::size_t size,
                               const std::map<char, void (*)(const std::string&)>& readers) {
  if (size == 0) return;
  const auto reader = readers.find(static_cast<char>(data[0]));
  if (reader == readers.end()) return;
  refused_or([&] { reader->second({reinterpret_cast<const char*>(data) + 1, size - 1}); });
}

/// Stops the program, naming what was promised and not kept.
inline void promise(bool kept, const char* what) {
  if (kept) return;
  std::fprintf(stderr, "not kept: %s\n", what);
  std::abort();
}

template <typename Derived>
void promise_finite(const Eigen::DenseBase<Derived>& values, const char* what) {
  promise(values.allFinite(), what);
}

/// Input of several files: parts that end at a line "====".
[[nodiscard]] inline std::vector<std::string> parts_of(std::string_view text) {
  constexpr std::string_view kCut = "====\n";
  std::vector<std::string> parts;
  for (;;) {
    const std::size_t at = text.find(kCut);
    parts.emplace_back(text.substr(0, at));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + kCut.size());
  }
}

/// A folder in memory for readers that take a path; one per process.
class MemoryFolder {
 public:
  MemoryFolder() {
    std::string name = "/dev/shm/hexcal_fuzz_XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;
  ~MemoryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path put(const char* name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream(file, std::ios::binary | std::ios::trunc)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return file;
  }

 private:
  std::filesystem::path path_;
};

inline const MemoryFolder& memory_folder() {
  static const MemoryFolder folder;
  return folder;
}

}  // namespace hexcal::fuzzing
