#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace hexcal {

/// Checks JSON against the part of JSON Schema (draft 2020-12) that hexcal's schemas use. Strict: a keyword
/// it does not know is an error of the schema, so that no rule goes unheeded.
class JsonSchema {
 public:
  using Json = nlohmann::json;

  explicit JsonSchema(const std::filesystem::path& file) : file_(file), root_(read(file)) {}

  /// What is wrong with `value`, with the place; empty if nothing is.
  [[nodiscard]] std::string fault(const Json& value) const { return fault(value, root_, "$"); }

 private:
  static Json read(const std::filesystem::path& file) {
    std::ifstream in(file);
    return Json::parse(in);
  }

  static bool has_type(const Json& value, const std::string& type) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "null") return value.is_null();
    if (type == "integer") return value.is_number_integer();
    if (type == "number") return value.is_number();
    throw std::logic_error("unknown type " + type);
  }

  static std::string type_fault(const Json& value, const Json& type, const std::string& place) {
    for (const Json& one : type.is_array() ? type : Json::array({type})) {
      if (has_type(value, one.get<std::string>())) return "";
    }
    return fmt::format("{}: found {}, wanted {}", place, value.dump().substr(0, 80), type.dump());
  }

  std::string reference_fault(const Json& value, const std::string& reference,
                              const std::string& place) const {
    if (reference.starts_with("#"))
      return fault(value, root_.at(Json::json_pointer(reference.substr(1))), place);
    const std::string inner = JsonSchema(file_.parent_path() / reference).fault(value);
    return inner.empty() ? "" : place + " (" + reference + "): " + inner;
  }

  std::string object_fault(const Json& value, const Json& schema, const std::string& place) const {
    const Json properties = schema.value("properties", Json::object());
    for (const Json& name : schema.value("required", Json::array())) {
      if (!value.contains(name.get<std::string>()))
        return fmt::format("{}: {} is missing", place, name.get<std::string>());
    }
    for (const auto& [name, member] : value.items()) {
      const Json& rule = properties.contains(name) ? properties.at(name) : schema.at("additionalProperties");
      if (rule == false) return fmt::format("{}.{}: not in the schema", place, name);
      const std::string inner = fault(member, rule, place + "." + name);
      if (!inner.empty()) return inner;
    }
    return "";
  }

  std::string array_fault(const Json& value, const Json& schema, const std::string& place) const {
    if (value.size() < schema.value("minItems", std::size_t{0}) ||
        value.size() > schema.value("maxItems", value.size())) {
      return fmt::format("{}: found {} items", place, value.size());
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      const std::string inner = fault(value[i], schema.at("items"), fmt::format("{}[{}]", place, i));
      if (!inner.empty()) return inner;
    }
    return "";
  }

  std::string choice_fault(const Json& value, const Json& choices, const std::string& place) const {
    int fits = 0;
    std::string words;
    for (const Json& choice : choices) {
      const std::string inner = fault(value, choice, place);
      fits += inner.empty() ? 1 : 0;
      if (!inner.empty()) words += (words.empty() ? "" : "; or ") + inner;
    }
    return fits == 1 ? "" : fmt::format("{}: fits {} of the choices: {}", place, fits, words);
  }

  std::string fault(const Json& value, const Json& schema, const std::string& place) const {
    // First the type: the other rules are for values that have it.
    if (schema.contains("type")) {
      const std::string inner = type_fault(value, schema.at("type"), place);
      if (!inner.empty()) return inner;
    }
    for (const auto& [keyword, rule] : schema.items()) {
      std::string inner;
      if (keyword == "enum") {
        if (std::find(rule.begin(), rule.end(), value) == rule.end())
          inner = fmt::format("{}: found {}, wanted one of {}", place, value.dump(), rule.dump());
      } else if (keyword == "oneOf") {
        inner = choice_fault(value, rule, place);
      } else if (keyword == "$ref") {
        inner = reference_fault(value, rule.get<std::string>(), place);
      } else if (keyword == "properties") {
        inner = object_fault(value, schema, place);
      } else if (keyword == "additionalProperties") {
        if (!schema.contains("properties")) inner = object_fault(value, schema, place);
      } else if (keyword == "items") {
        inner = array_fault(value, schema, place);
      } else if (keyword != "type" && keyword != "required" && keyword != "minItems" &&
                 keyword != "maxItems" && keyword != "description" && keyword != "title" &&
                 keyword != "$schema" && keyword != "$defs") {
        throw std::logic_error(fmt::format("{}: unknown keyword {}", place, keyword));
      }
      if (!inner.empty()) return inner;
    }
    return "";
  }

  std::filesystem::path file_;
  Json root_;
};

}  // namespace hexcal
