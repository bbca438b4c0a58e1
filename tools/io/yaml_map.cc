#include "tools/io/yaml_map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/nearest_name.h"
#include "kinematics/geometry/pose.h"
#include "tools/io/atomic_file.h"
#include "tools/io/number_range.h"
#include "tools/io/scalar_text.h"

namespace hexcal {

struct YamlMap::State {
  State(std::filesystem::path file, std::string dotted, const YAML::Node& mapping)
      : path(std::move(file)), prefix(std::move(dotted)), node(mapping) {
    for (const auto& entry : node) {  // of a key that stands twice, the first
      if (entry.first.IsScalar()) entries.emplace(entry.first.Scalar(), entry.second);
    }
  }

  // Undefined if there is none.
  [[nodiscard]] YAML::Node find(const std::string& key) const {
    const auto found = entries.find(key);
    return found == entries.end() ? YAML::Node(YAML::NodeType::Undefined) : found->second;
  }

  std::filesystem::path path;
  std::string prefix;  // dotted name of this mapping, with a trailing dot
  YAML::Node node;
  std::unordered_map<std::string, YAML::Node> entries;
  std::set<std::string> asked;
};

namespace {

constexpr std::size_t kMaxYamlBytes = 16 << 20;
constexpr int kMaxYamlDepth = 32;
constexpr std::size_t kMaxYamlNodes = 300'000;

// An alias may stand inside its own anchor, or multiply a small file into a huge tree.
bool is_bounded(const YAML::Node& node, int depth, std::size_t& nodes) {
  if (depth > kMaxYamlDepth || ++nodes > kMaxYamlNodes) return false;
  if (!node.IsMap() && !node.IsSequence()) return true;
  return std::all_of(node.begin(), node.end(), [&](const auto& entry) {
    return node.IsSequence()
               ? is_bounded(entry, depth + 1, nodes)
               : is_bounded(entry.first, depth + 1, nodes) && is_bounded(entry.second, depth + 1, nodes);
  });
}

std::string place(const std::filesystem::path& path, const YAML::Node& node) {
  return fmt::format("{}:{}", path.string(), node.Mark().line + 1);
}

std::string shown(const YAML::Node& node) {
  constexpr std::size_t kShown = 60;
  if (node.IsScalar()) {
    const std::string& text = node.Scalar();
    return fmt::format("'{}'{}", text.substr(0, kShown), text.size() > kShown ? " ..." : "");
  }
  if (node.IsSequence()) return fmt::format("a list of {}", node.size());
  if (node.IsMap()) return "a mapping";
  return "nothing";
}

}  // namespace

YamlMap YamlMap::parse(const std::string& text, const std::filesystem::path& path) {
  if (text.size() > kMaxYamlBytes) {
    throw InputError(
        fmt::format("{}: {} bytes, wanted at most {}", path.string(), text.size(), kMaxYamlBytes));
  }
  YAML::Node node;
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    for (const YAML::Node& document : documents) {
      if (!document.IsDefined() || document.IsNull()) continue;  // nothing between two marks
      if (node.IsDefined() && !node.IsNull())
        throw InputError(fmt::format("{}: another document begins, wanted one (no --- or ... between keys)",
                                     place(path, document)));
      node.reset(document);
    }
  } catch (const YAML::Exception& error) {
    throw InputError(fmt::format("{}:{}: not valid YAML: {}", path.string(), error.mark.line + 1, error.msg));
  }
  std::size_t nodes = 0;
  if (!is_bounded(node, 0, nodes)) {
    throw InputError(
        fmt::format("{}: nested more than {} deep or longer than {} entries (an alias to itself?)",
                    path.string(), kMaxYamlDepth, kMaxYamlNodes));
  }
  if (!node.IsMap()) {
    throw InputError(fmt::format("{}: found {}, wanted keys and values", path.string(), shown(node)));
  }
  return YamlMap(std::make_shared<State>(path, "", node));
}

YamlMap YamlMap::read(const std::filesystem::path& path) { return parse(read_file(path), path); }

const std::filesystem::path& YamlMap::path() const { return state_->path; }

bool YamlMap::has(const std::string& key) const {
  state_->asked.insert(key);
  const YAML::Node node = state_->find(key);
  return node.IsDefined() && !node.IsNull();
}

void YamlMap::fail(const std::string& key, const std::string& message) const {
  const YAML::Node node = state_->find(key);
  const std::string where = place(state_->path, node.IsDefined() ? node : state_->node);
  throw InputError(fmt::format("{}: {}{}: {}", where, state_->prefix, key, message));
}

namespace {
YAML::Node require(const YamlMap& map, const YAML::Node& node, const YAML::Node& value,
                   const std::string& key, const char* wanted) {
  if (map.has(key)) return value;
  std::string message = fmt::format("missing, wanted {}", wanted);
  for (const auto& entry : node) {  // most often it is there, misspelt
    const std::string other = entry.first.IsScalar() ? entry.first.Scalar() : std::string();
    if (other != key && edit_distance(other, key) <= std::min<std::size_t>(2, key.size() / 3))
      message += fmt::format("; '{}' in line {} looks like it", other, entry.first.Mark().line + 1);
  }
  map.fail(key, message);
}
}  // namespace

double YamlMap::number(const std::string& key) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a number");
  const auto value = node.IsScalar() ? number_from_text(node.Scalar()) : std::nullopt;
  if (!value) fail(key, fmt::format("found {}, wanted a number", shown(node)));
  return in_range(key, *value);
}

double YamlMap::in_range(const std::string& key, double value) const {
  std::string fault;
  const double number = ranged_number(key, value, fault);
  if (!fault.empty()) fail(key, fault);
  return number;
}

double YamlMap::number_or(const std::string& key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

int YamlMap::integer(const std::string& key) const {
  const double value = number(key);
  if (value != std::floor(value) || std::abs(value) > 2e9) {
    fail(key, fmt::format("found {}, wanted a whole number", shown(state_->find(key))));
  }
  return static_cast<int>(value);
}

bool YamlMap::boolean_or(const std::string& key, bool fallback) const {
  if (!has(key)) return fallback;
  const YAML::Node node = state_->find(key);
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
    fail(key, fmt::format("found {}, wanted true or false", shown(node)));
  }
  return value;
}

std::string YamlMap::text(const std::string& key) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a text");
  if (!node.IsScalar()) fail(key, fmt::format("found {}, wanted a text", shown(node)));
  return node.Scalar();
}

std::optional<std::string> YamlMap::optional_text(const std::string& key) const {
  if (!has(key)) return std::nullopt;
  return text(key);
}

std::string YamlMap::choice(const std::string& key, const std::vector<std::string>& allowed) const {
  const std::string value = text(key);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    fail(key, fmt::format("found '{}', wanted one of {}", value, fmt::join(allowed, ", ")));
  }
  return value;
}

std::vector<double> YamlMap::numbers(const std::string& key, std::size_t size) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a list of numbers");
  if (!node.IsSequence() || (size != 0 && node.size() != size)) {
    fail(key, fmt::format("found {}, wanted a list of {}numbers", shown(node),
                          size != 0 ? fmt::format("{} ", size) : std::string()));
  }
  std::vector<double> values;
  for (const auto& entry : node) {
    const auto value = entry.IsScalar() ? number_from_text(entry.Scalar()) : std::nullopt;
    if (!value) fail(key, fmt::format("found {}, wanted a number", shown(entry)));
    values.push_back(in_range(key, *value));
  }
  return values;
}

std::vector<double> YamlMap::numbers_or_one(const std::string& key, std::size_t size) const {
  if (has(key) && !is_sequence(key)) return std::vector<double>(size, number(key));
  return numbers(key, size);
}

Eigen::Vector3d YamlMap::vector3(const std::string& key) const {
  const std::vector<double> v = numbers(key, 3);
  return {v[0], v[1], v[2]};
}

std::vector<Eigen::Vector3d> YamlMap::vectors3(const std::string& key, std::size_t size) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a list of [x, y, z]");
  if (!node.IsSequence() || (size != 0 && node.size() != size)) {
    fail(key, fmt::format("found {}, wanted a list of {}[x, y, z]", shown(node),
                          size != 0 ? fmt::format("{} ", size) : std::string()));
  }
  std::vector<Eigen::Vector3d> values;
  for (const auto& entry : node) {
    Eigen::Vector3d v;
    if (!entry.IsSequence() || entry.size() != 3)
      fail(key, fmt::format("found {}, wanted [x, y, z]", shown(entry)));
    for (std::size_t i = 0; i < 3; ++i) {
      const auto value = entry[i].IsScalar() ? number_from_text(entry[i].Scalar()) : std::nullopt;
      if (!value) fail(key, fmt::format("found {}, wanted a number", shown(entry[i])));
      v[static_cast<Eigen::Index>(i)] = in_range(key, *value);
    }
    values.push_back(v);
  }
  return values;
}

std::vector<std::string> YamlMap::texts(const std::string& key) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a list");
  if (!node.IsSequence()) fail(key, fmt::format("found {}, wanted a list", shown(node)));
  std::vector<std::string> values;
  for (const auto& entry : node) {
    if (!entry.IsScalar()) fail(key, fmt::format("found {}, wanted a single value", shown(entry)));
    values.push_back(entry.Scalar());
  }
  return values;
}

Rigid3 YamlMap::rigid3(const std::string& key) const {
  const YamlMap motion = map(key);
  const Eigen::Vector3d xyz_mm = motion.vector3("xyz_mm");
  const Eigen::Vector3d rpy_deg = motion.vector3("rpy_deg");
  motion.finish();
  return {quaternion_from_rpy(rpy_deg * kRadPerDeg), xyz_mm};
}

YamlMap YamlMap::map(const std::string& key) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "keys and values");
  if (!node.IsMap()) fail(key, fmt::format("found {}, wanted keys and values", shown(node)));
  return YamlMap(std::make_shared<State>(state_->path, state_->prefix + key + ".", node));
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) const {
  const YAML::Node node = require(*this, state_->node, state_->find(key), key, "a list");
  if (!node.IsSequence()) fail(key, fmt::format("found {}, wanted a list", shown(node)));
  std::vector<YamlMap> all;
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (!node[i].IsMap()) fail(key, fmt::format("found {}, wanted keys and values", shown(node[i])));
    all.push_back(YamlMap(
        std::make_shared<State>(state_->path, fmt::format("{}{}[{}].", state_->prefix, key, i), node[i])));
  }
  return all;
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> all;
  for (const auto& entry : state_->node) {
    if (!entry.first.IsScalar()) {
      throw InputError(fmt::format("{}: a key is not a single value", place(state_->path, entry.first)));
    }
    all.push_back(entry.first.Scalar());
    state_->asked.insert(all.back());
  }
  return all;
}

bool YamlMap::is_map(const std::string& key) const { return has(key) && state_->find(key).IsMap(); }
bool YamlMap::is_sequence(const std::string& key) const { return has(key) && state_->find(key).IsSequence(); }

void YamlMap::finish() const {
  std::set<std::string> seen;
  for (const auto& entry : state_->node) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : shown(entry.first);
    const std::string where = place(state_->path, entry.first);
    if (!seen.insert(key).second) {
      throw InputError(fmt::format("{}: key '{}{}' stands twice", where, state_->prefix, key));
    }
    if (state_->asked.count(key) != 0) continue;
    const auto nearest = std::min_element(state_->asked.begin(), state_->asked.end(),
                                          [&](const std::string& a, const std::string& b) {
                                            return edit_distance(a, key) < edit_distance(b, key);
                                          });
    std::string hint = fmt::format("; known here: {}", fmt::join(state_->asked, ", "));
    if (nearest != state_->asked.end() && edit_distance(*nearest, key) <= 3) {
      hint = fmt::format("; did you mean '{}'?", *nearest);
    }
    throw InputError(fmt::format("{}: unknown key '{}{}'{}", where, state_->prefix, key, hint));
  }
}

}  // namespace hexcal
