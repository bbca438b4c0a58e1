#include <fmt/format.h>

#include <memory>

#include "tools/hexcal/command.h"
#include "tools/hexcal/command_line.h"
#include "tools/io/version.h"

namespace hexcal {
namespace {

constexpr const char* kCompletionFooter = R"(Sample use:
  hexcal completion bash > ~/.local/share/bash-completion/completions/hexcal
  hexcal completion zsh > ~/.zfunc/_hexcal
  hexcal completion fish > ~/.config/fish/completions/hexcal.fish
  hexcal completion man | man -l -
  hexcal completion json                (commands and options, for programs))";

}  // namespace

void add_completion_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("completion", "Print shell completion or the manual page");
  command->footer(kCompletionFooter);
  const auto kind = std::make_shared<std::string>();
  command->add_option("KIND", *kind, "what to print")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish", "man", "json"}));
  command->callback([&app, &action, kind] {
    action = [&app, kind] {
      const CommandLine line = command_line_of(app);
      fmt::print("{}", *kind == "bash"   ? bash_completion(line)
                       : *kind == "zsh"  ? zsh_completion(line)
                       : *kind == "fish" ? fish_completion(line)
                       : *kind == "json" ? command_json(line)
                                         : manual_page(line, fmt::format("hexcal {}", kVersion)));
      return static_cast<int>(kDone);
    };
  });
}

}  // namespace hexcal
