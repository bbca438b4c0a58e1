#include "tools/hexcal/command.h"

namespace hexcal {

void add_evaluate_command(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare pose tables: the paper's tables 2-4 and true rms");
  command->callback([&action] { action = [] { return static_cast<int>(kBug); }; });
}

}  // namespace hexcal
