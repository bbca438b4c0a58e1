#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "kinematics/geometry/rigid3.h"

namespace hexcal {

/// A YAML mapping read strictly: every key must be asked for, and finish() refuses those that were not,
/// naming file, line and key and the nearest known key. All errors are InputError.
class YamlMap {
 public:
  /// Reads a file whose top level is a mapping.
  [[nodiscard]] static YamlMap read(const std::filesystem::path& path);
  /// Parses text; `path` is used in messages only.
  [[nodiscard]] static YamlMap parse(const std::string& text, const std::filesystem::path& path);

  [[nodiscard]] bool has(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback) const;
  [[nodiscard]] int integer(const std::string& key) const;
  [[nodiscard]] bool boolean_or(const std::string& key, bool fallback) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] std::optional<std::string> optional_text(const std::string& key) const;
  /// One of `allowed`, or an error that lists them.
  [[nodiscard]] std::string choice(const std::string& key, const std::vector<std::string>& allowed) const;
  /// A sequence of numbers; size 0 means any.
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t size = 0) const;
  /// A number, or a sequence of `size` numbers; a single number is repeated.
  [[nodiscard]] std::vector<double> numbers_or_one(const std::string& key, std::size_t size) const;
  [[nodiscard]] Eigen::Vector3d vector3(const std::string& key) const;
  /// A sequence of `size` triples; size 0 means any.
  [[nodiscard]] std::vector<Eigen::Vector3d> vectors3(const std::string& key, std::size_t size = 0) const;
  /// A sequence of scalars as written (ids, ranges such as 0-9).
  [[nodiscard]] std::vector<std::string> texts(const std::string& key) const;
  /// {xyz_mm: [..], rpy_deg: [..]}.
  [[nodiscard]] Rigid3 rigid3(const std::string& key) const;
  [[nodiscard]] YamlMap map(const std::string& key) const;
  [[nodiscard]] std::vector<YamlMap> maps(const std::string& key) const;
  /// Keys in file order, each then counts as asked for.
  [[nodiscard]] std::vector<std::string> keys() const;
  [[nodiscard]] bool is_map(const std::string& key) const;
  [[nodiscard]] bool is_sequence(const std::string& key) const;

  /// Throws if a key was never asked for.
  void finish() const;

  /// Error that names file, line and key.
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;

  [[nodiscard]] const std::filesystem::path& path() const;

 private:
  struct State;
  // The number as a key of this name may hold it (number_range.h).
  [[nodiscard]] double in_range(const std::string& key, double value) const;
  explicit YamlMap(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;
};

}  // namespace hexcal
