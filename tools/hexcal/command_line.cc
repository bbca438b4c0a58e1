#include "tools/hexcal/command_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "kinematics/geometry/input_error.h"
#include "tools/io/json_text.h"
#include "tools/io/number_range.h"
#include "tools/io/scalar_text.h"

namespace hexcal {
namespace {

// Without white space at its ends; `leading` says what counts as such in front.
std::string trimmed(const std::string& text, const char* leading = " \n") {
  const std::size_t first = text.find_first_not_of(leading);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \n") - first + 1);
}

// CLI11 writes the allowed values of IsMember into the type name: "TEXT:{csv,pi-gcs}".
std::vector<std::string> choices_of(const std::string& type_name) {
  std::vector<std::string> choices;
  const std::size_t open = type_name.find('{');
  const std::size_t close = type_name.find('}', open);
  if (open == std::string::npos || close == std::string::npos) return choices;
  std::string word;
  for (std::size_t i = open + 1; i <= close; ++i) {
    if (type_name[i] == ',' || i == close) {
      choices.push_back(trimmed(word));
      word.clear();
    } else {
      word += type_name[i];
    }
  }
  return choices;
}

CommandLineOption option_of(const CLI::Option& option) {
  CommandLineOption out;
  for (const std::string& name : option.get_snames()) out.names.push_back('-' + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  if (out.names.empty()) out.positional = option.get_name(true);
  const std::string type = option.get_type_name();
  out.choices = choices_of(type);
  if (option.get_items_expected_max() > 0) {
    const std::string kind = type.substr(0, type.find(':'));
    out.value = kind.empty() || kind.front() == '{' ? "VALUE" : kind;
  }
  out.description = trimmed(option.get_description());
  out.required = option.get_required();
  return out;
}

nlohmann::ordered_json json_of(const CommandLine& command) {
  nlohmann::ordered_json out{{"name", command.name},
                             {"description", command.description},
                             {"options", nlohmann::ordered_json::array()},
                             {"commands", nlohmann::ordered_json::array()}};
  for (const CommandLineOption& option : command.options) {
    nlohmann::ordered_json row{{"names", option.names}};
    if (option.names.empty()) row["positional"] = option.positional;
    row["value"] = option.value;
    row["choices"] = option.choices;
    row["required"] = option.required;
    row["description"] = option.description;
    out["options"].push_back(row);
  }
  for (const CommandLine& below : command.commands) out["commands"].push_back(json_of(below));
  return out;
}

}  // namespace

std::string command_json(const CommandLine& app) { return json_text(json_of(app), 1) + "\n"; }

void check_numbers(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      if (!option->get_type_name().starts_with("FLOAT")) continue;
      const std::string name = option->get_name();
      for (const std::string& text : option->results()) {
        const auto value = number_from_text(text);
        if (!value) throw InputError(fmt::format("{}: found '{}', wanted a number", name, text));
        std::string fault;
        (void)ranged_number(name, *value, fault);
        if (!fault.empty()) throw InputError(fmt::format("{}: {}", name, fault));
      }
    }
  }
}

CommandLine command_line_of(const CLI::App& app) {
  CommandLine out;
  out.name = app.get_name();
  const std::string text = app.get_description();
  out.description = trimmed(text.substr(0, text.find('\n')));
  if (out.description.starts_with(out.name + ": ")) out.description.erase(0, out.name.size() + 2);
  if (text.find('\n') != std::string::npos) out.details = trimmed(text.substr(text.find('\n')), "\n");
  const std::string footer = trimmed(app.get_footer(), "\n");  // its first line may be an indented sample
  if (!footer.empty()) out.details += (out.details.empty() ? "" : "\n\n") + footer;
  for (const CLI::Option* option : app.get_options()) out.options.push_back(option_of(*option));
  // An empty group hides an option or a command from --help; it stays hidden here.
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
    out.commands.push_back(command_line_of(*command));
  }
  return out;
}

}  // namespace hexcal
