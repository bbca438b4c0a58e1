#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/hexcal/command_line.h"

namespace hexcal {
namespace {

std::string with_escaped(const std::string& text, const std::string& special) {
  std::string out;
  for (const char c : text) {
    if (special.find(c) != std::string::npos) out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

// Inside single quotes of a shell; zsh's argument specifications also need brackets and colons escaped.
std::string zsh_words(const std::string& text) {
  std::string out;
  for (const char c : with_escaped(text, "[]:")) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out;
}

std::string fish_words(const std::string& text) { return '\'' + with_escaped(text, "'\\") + '\''; }

std::vector<std::string> option_names(const CommandLine& command) {
  std::vector<std::string> names;
  for (const CommandLineOption& option : command.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

std::vector<std::string> command_names(const CommandLine& app) {
  std::vector<std::string> names;
  for (const CommandLine& command : app.commands) names.push_back(command.name);
  return names;
}

}  // namespace

std::string bash_completion(const CommandLine& app) {
  std::string out =
      fmt::format(R"(# bash completion for {0}, made by `{0} completion bash`
_{0}() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD-1]}}" words=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{1} {2}" -- "$current"))
    return
  fi
  case "${{COMP_WORDS[1]}} $previous" in
)",
                  app.name, fmt::join(command_names(app), " "), fmt::join(option_names(app), " "));
  for (const CommandLine& command : app.commands) {
    for (const CommandLineOption& option : command.options) {
      if (option.choices.empty()) continue;
      for (const std::string& name : option.names) {
        out += fmt::format("    \"{} {}\") words=\"{}\" ;;\n", command.name, name,
                           fmt::join(option.choices, " "));
      }
    }
  }
  out += R"(  esac
  if [ -n "$words" ]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
    return
  fi
  case "$current" in
    -*)
      case "${COMP_WORDS[1]}" in
)";
  for (const CommandLine& command : app.commands) {
    out += fmt::format("        {}) words=\"{}\" ;;\n", command.name, fmt::join(option_names(command), " "));
  }
  out += R"(      esac
      COMPREPLY=($(compgen -W "$words" -- "$current"))
      return ;;
  esac
  case "${COMP_WORDS[1]}" in
)";
  for (const CommandLine& command : app.commands) {
    for (const CommandLineOption& option : command.options) {
      if (option.names.empty() && !option.choices.empty()) {
        out += fmt::format("    {}) words=\"{}\" ;;\n", command.name, fmt::join(option.choices, " "));
      }
    }
  }
  return out + fmt::format(R"(  esac
  COMPREPLY=($(compgen -W "$words" -- "$current") $(compgen -f -- "$current"))
}}
complete -o filenames -F _{0} {0}
)",
                           app.name);
}

std::string zsh_completion(const CommandLine& app) {
  std::string out = fmt::format(R"(#compdef {0}
# zsh completion for {0}, made by `{0} completion zsh`
_{0}() {{
  local -a commands
  commands=(
)",
                                app.name);
  for (const CommandLine& command : app.commands) {
    out += fmt::format("    '{}:{}'\n", command.name, zsh_words(command.description));
  }
  out += R"(  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  case "$words[2]" in
)";
  for (const CommandLine& command : app.commands) {
    out += fmt::format("    {})\n      shift words; (( CURRENT-- ))\n      _arguments", command.name);
    for (const CommandLineOption& option : command.options) {
      const std::string values =
          option.choices.empty() ? "_files" : fmt::format("({})", fmt::join(option.choices, " "));
      const std::string value =
          option.value.empty() ? "" : fmt::format(":{}:{}", zsh_words(option.value), values);
      for (const std::string& name : option.names) {
        out += fmt::format(" \\\n        '*{}[{}]{}'", name, zsh_words(option.description), value);
      }
      if (option.names.empty())
        out += fmt::format(" \\\n        '*:{}:{}'", zsh_words(option.positional), values);
    }
    out += " ;;\n";
  }
  return out + fmt::format("  esac\n}}\n_{0} \"$@\"\n", app.name);
}

std::string fish_completion(const CommandLine& app) {
  std::string out = fmt::format("# fish completion for {0}, made by `{0} completion fish`\n", app.name);
  for (const CommandLine& command : app.commands) {
    out += fmt::format("complete -c {} -n __fish_use_subcommand -f -a {} -d {}\n", app.name, command.name,
                       fish_words(command.description));
  }
  for (const CommandLine& command : app.commands) {
    for (const CommandLineOption& option : command.options) {
      std::string line =
          fmt::format("complete -c {} -n '__fish_seen_subcommand_from {}'", app.name, command.name);
      for (const std::string& name : option.names) {
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!option.choices.empty()) {
        line += fmt::format(" -x -a '{}'", fmt::join(option.choices, " "));
      } else if (!option.names.empty() && !option.value.empty()) {
        line += " -r";
      } else if (option.names.empty()) {
        continue;  // a positional argument: fish completes files by itself
      }
      out += line + " -d " + fish_words(option.description) + '\n';
    }
  }
  return out;
}

}  // namespace hexcal
