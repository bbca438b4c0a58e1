#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "tools/hexcal/command_line.h"

namespace hexcal {
namespace {

// Text for roff: backslash and minus are special everywhere, dot and apostrophe at the start of a line.
std::string roff(const std::string& text) {
  std::string out;
  bool line_start = true;
  for (const char c : text) {
    if (line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    line_start = c == '\n';
  }
  return out;
}

// Indented lines of a help text are samples: they keep their line breaks.
std::string roff_paragraphs(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  bool sample = false;
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.starts_with("  ");
    if (indented && !sample) out += ".PP\n.EX\n";
    if (!indented && sample && !line.empty()) out += ".EE\n.PP\n";
    if (indented || !line.empty()) sample = indented;
    out += line.empty() ? (sample ? "\n" : ".PP\n") : roff(line) + '\n';
  }
  return out + (sample ? ".EE\n" : "");
}

std::string option_heading(const CommandLineOption& option) {
  std::string out;
  for (const std::string& name : option.names) out += (out.empty() ? "\\fB" : ", \\fB") + roff(name) + "\\fR";
  if (option.names.empty()) out = "\\fI" + roff(option.positional) + "\\fR";
  if (!option.choices.empty()) {
    std::string choices;
    for (const std::string& choice : option.choices) choices += (choices.empty() ? "" : "|") + roff(choice);
    out += " {" + choices + '}';
  } else if (!option.names.empty() && !option.value.empty()) {
    out += " \\fI" + roff(option.value) + "\\fR";
  }
  return out + (option.required && !option.names.empty() ? " (required)" : "");
}

std::string options_text(const CommandLine& command) {
  std::string out;
  for (const CommandLineOption& option : command.options) {
    out += ".TP\n" + option_heading(option) + '\n' + roff(option.description) + '\n';
  }
  return out;
}

}  // namespace

std::string manual_page(const CommandLine& app, const std::string& version) {
  std::string out = fmt::format(".TH {} 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n", app.name,
                                roff(version), app.name, roff(app.description));
  out += fmt::format(".SH SYNOPSIS\n.B {}\n.I COMMAND\n[\\fIOPTIONS\\fR]\n.SH OPTIONS\n{}", app.name,
                     options_text(app));
  out += ".SH COMMANDS\n";
  for (const CommandLine& command : app.commands) {
    out += fmt::format(".SS \"{} {}\"\n{}\n", app.name, roff(command.name), roff(command.description));
    if (!command.details.empty()) out += ".PP\n" + roff_paragraphs(command.details);
    out += options_text(command);
  }
  return out + R"(.SH EXIT STATUS
.TP
0
done
.TP
1
done, but some items failed; they were listed
.TP
2
the user's files or flags are wrong; one line says which, what was found and what was wanted
.TP
3
a bug
)";
}

}  // namespace hexcal
