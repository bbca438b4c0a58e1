#pragma once

#include <filesystem>
#include <string_view>

namespace hexcal {

/// What the process's outputs may take the place of.
enum class Overwrite {
  /// Not a file that this process read, nor a photograph, nor a YAML or CSV file that hexcal did not write
  /// itself (outside a folder called results). What the program does unless `--force` is given.
  own_results,
  /// Any file; a library's choice, whose caller knows what it does.
  any_file,
};
void allow_overwriting(Overwrite what);
[[nodiscard]] Overwrite allowed_overwriting();

/// Throws InputError if a file with this content must not be written at this place: see Overwrite. Never
/// allowed is what is no file, such as a folder or a device.
void require_writable(const std::filesystem::path& target, std::string_view contents);

/// Every output of hexcal: a file under a temporary name beside its target, which it replaces when it is
/// complete; removed unless that happened. Creates missing parent folders. Throws InputError with the
/// system's reason.
class OutputFile {
 public:
  /// `beginning` is written at once; it tells what kind of file it is (see require_writable).
  OutputFile(const std::filesystem::path& path, std::string_view beginning);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  OutputFile(OutputFile&& other) noexcept;
  ~OutputFile();

  void write(std::string_view contents);
  /// To the disk.
  void flush();
  void rename_to_target();

 private:
  void remove();

  std::filesystem::path target_;
  std::filesystem::path path_;  // empty once it is renamed
  int descriptor_ = -1;
};

}  // namespace hexcal
