#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace hexcal {

/// What a file is read for. Own results and kept answers may be written anew by the call that read them.
enum class ReadFor { input, own_result };

/// Every file that hexcal reads is opened here, so that no wait is without end and every input is known.
/// Regular files only: a FIFO, a device or a file of /proc or /sys (/proc/kmsg calls itself regular) is
/// refused before it is opened. A pipe is taken under the names by which a shell hands one over: /dev/stdin,
/// /dev/fd/N, /proc/self/fd/N.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path, ReadFor purpose = ReadFor::input);
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  /// Why it could not be opened, or reading failed; empty if all is well.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  [[nodiscard]] bool exists() const { return exists_; }
  [[nodiscard]] bool is_pipe() const { return pipe_; }
  [[nodiscard]] std::uintmax_t size() const { return size_; }  ///< when it was opened; 0 of a pipe

  /// Bytes read, fewer than wanted only at the end or after a failure.
  std::size_t read(char* to, std::size_t wanted);
  /// To the beginning again; not of a pipe.
  void rewind();

 private:
  int descriptor_ = -1;
  bool exists_ = false;
  bool pipe_ = false;
  std::uintmax_t size_ = 0;
  std::string failure_;
};

/// Whether a path is a name of a pipe that a shell hands over.
[[nodiscard]] bool is_handed_pipe(const std::filesystem::path& path);

/// Whether this process read the file as an input, under whatever name: compared are device and inode.
[[nodiscard]] bool was_read_as_input(const std::filesystem::path& path);

}  // namespace hexcal
