#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace hexcal {

/// The command line as data, taken from the same definitions that --help prints and that parse the arguments,
/// so that manual and completion cannot drift from them.
struct CommandLineOption {
  std::vector<std::string> names;  ///< with dashes, short ones first; empty for a positional argument
  std::string positional;          ///< name of a positional argument
  std::string value;               ///< kind of value ("TEXT"); empty for a flag
  std::vector<std::string> choices;
  std::string description;
  bool required = false;
};

struct CommandLine {
  std::string name;
  std::string description;  ///< first line of the help
  std::string details;      ///< the rest of it, and the footer
  std::vector<CommandLineOption> options;
  std::vector<CommandLine> commands;
};

[[nodiscard]] CommandLine command_line_of(const CLI::App& app);

/// Refuses numbers of the command that was given which no machine or photograph has: not finite, or outside
/// of number_range.h. Throws InputError.
void check_numbers(const CLI::App& app);

/// All of it as JSON, for programs that call hexcal.
[[nodiscard]] std::string command_json(const CommandLine& app);

/// Completion scripts for `app` and its commands. Values that are no choice complete as files.
[[nodiscard]] std::string bash_completion(const CommandLine& app);
[[nodiscard]] std::string zsh_completion(const CommandLine& app);
[[nodiscard]] std::string fish_completion(const CommandLine& app);

/// The manual page in roff (man(7)), section 1.
[[nodiscard]] std::string manual_page(const CommandLine& app, const std::string& version);

}  // namespace hexcal
