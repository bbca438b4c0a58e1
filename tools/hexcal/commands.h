#pragma once

#include "tools/hexcal/command.h"

namespace hexcal {

// One per cmd_NAME.cc: adds the subcommand with its flags and sets `action` when it is the one called.
void add_init_command(CLI::App& app, Action& action);
void add_template_command(CLI::App& app, Action& action);
void add_camera_command(CLI::App& app, Action& action);
void add_simulate_command(CLI::App& app, Action& action);
void add_detect_command(CLI::App& app, Action& action);
void add_check_command(CLI::App& app, Action& action);
void add_run_command(CLI::App& app, Action& action);
void add_measure_command(CLI::App& app, Action& action);
void add_watch_command(CLI::App& app, Action& action);
void add_plan_command(CLI::App& app, Action& action);
void add_compensate_command(CLI::App& app, Action& action);
void add_evaluate_command(CLI::App& app, Action& action);
void add_legs_command(CLI::App& app, Action& action);
void add_pose_command(CLI::App& app, Action& action);
void add_workspace_command(CLI::App& app, Action& action);
void add_report_command(CLI::App& app, Action& action);
void add_export_command(CLI::App& app, Action& action);
void add_completion_command(CLI::App& app, Action& action);

}  // namespace hexcal
