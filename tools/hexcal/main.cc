#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "kinematics/geometry/input_error.h"
#include "kinematics/geometry/nearest_name.h"
#include "kinematics/geometry/printable_text.h"
#include "tools/hexcal/command_line.h"
#include "tools/hexcal/commands.h"
#include "tools/hexcal/printable_output.h"
#include "tools/hexcal/terminal.h"
#include "tools/io/atomic_file.h"
#include "tools/io/output_file.h"
#include "tools/io/version.h"

namespace {

bool wants_json(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands()) {
    const CLI::Option* json = command->get_option_no_throw("--json");
    if (json != nullptr && json->count() > 0) return true;
  }
  return false;
}

// A stream that was closed before the start would be the next file that is opened, and words would go into
// it.
void open_closed_streams() {
  for (int stream = 0; stream <= 2; ++stream) {
    if (::fcntl(stream, F_GETFD) < 0 && errno == EBADF)
      (void)::open("/dev/null", stream == 0 ? O_RDONLY : O_WRONLY);  // the lowest number that is free
  }
}

// The command line's first word is no command: a short overview, or the command that is meant.
std::string no_command(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  const auto word = std::find_if(argv + 1, argv + argc, [](const char* text) { return text[0] != '-'; });
  if (word == argv + argc)
    return fmt::format("wanted a command; hexcal init FOLDER begins, hexcal --help has all: {}",
                       fmt::join(names, ", "));
  if (std::find(names.begin(), names.end(), *word) != names.end()) return "";
  const auto meant = hexcal::nearest_name(*word, names);
  return fmt::format("'{}' is no command{}", hexcal::printable_text(*word),
                     meant ? fmt::format("; did you mean {}?", *meant) : " (see hexcal --help)");
}

int no_memory() {
  fmt::print(stderr, "hexcal: not enough memory\n");
  return hexcal::kInputError;
}

int refused_thread(const char* reason) {
  fmt::print(stderr,
             "hexcal: the system starts no more threads ({}); wanted fewer --threads, or a higher limit\n",
             hexcal::printable_text(reason));
  return hexcal::kInputError;
}

int run(int argc, char** argv) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // a photograph's status says it
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit is an error of the write that meets it, with words
  CLI::App app{"hexcal: calibration of a Stewart platform by photographs", "hexcal"};
  app.set_version_flag("--version", fmt::format("hexcal {}", hexcal::kVersion));
  app.require_subcommand(1);
  app.fallthrough();  // --quiet may stand behind the command too
  bool quiet = false;
  app.add_flag("--quiet", quiet, "Print nothing but errors (and what --json asks for)");
  bool force = false;
  app.add_flag("--force", force,
               "Write over what was read, over photographs, YAML and CSV files that hexcal did not write");
  hexcal::Action action;
  // In the order of a day's work.
  for (const auto add :
       {hexcal::add_init_command, hexcal::add_template_command, hexcal::add_camera_command,
        hexcal::add_simulate_command, hexcal::add_detect_command, hexcal::add_check_command,
        hexcal::add_run_command, hexcal::add_measure_command, hexcal::add_watch_command,
        hexcal::add_plan_command, hexcal::add_compensate_command, hexcal::add_evaluate_command,
        hexcal::add_legs_command, hexcal::add_pose_command, hexcal::add_workspace_command,
        hexcal::add_report_command, hexcal::add_export_command, hexcal::add_completion_command}) {
    add(app, action);
  }
  try {
    app.parse(argc, argv);
    hexcal::check_numbers(app);
    if (!force) hexcal::allow_overwriting(hexcal::Overwrite::own_results);
    if (quiet && !wants_json(app)) hexcal::silence_words();
    const int code = action();
    if (const int error = hexcal::output_error())
      throw std::system_error(error, std::generic_category(), "standard output");
    return code;
  } catch (const CLI::Success& done) {  // --help, --version
    return app.exit(done);
  } catch (const CLI::ParseError& error) {
    const std::string words = no_command(app, argc, argv);
    fmt::print(stderr, "hexcal: {}\n",
               words.empty() ? std::string(error.what()) + " (see hexcal --help)" : words);
    return hexcal::kInputError;
  } catch (const hexcal::InputError& error) {
    fmt::print(stderr, "hexcal: {}\n", hexcal::printable_text(error.what()));
    return hexcal::kInputError;
  } catch (const std::filesystem::filesystem_error& error) {  // a folder without permission, a name too long
    fmt::print(stderr, "hexcal: {}: {}\n", hexcal::printable_text(error.path1().string()),
               error.code().message());
    return hexcal::kInputError;
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return refused_thread(error.what());
    // A full disk behind standard output
    fmt::print(stderr, "hexcal: {}\n", hexcal::printable_text(error.what()));
    return hexcal::kInputError;
  } catch (const std::bad_alloc&) {
    return no_memory();
  } catch (const std::exception& error) {
    if (std::string_view(error.what()).find("pthread_create") != std::string_view::npos)  // TBB's words
      return refused_thread(error.what());
    const auto* from_opencv = dynamic_cast<const cv::Exception*>(&error);
    if (from_opencv != nullptr && from_opencv->code == cv::Error::StsNoMem) return no_memory();
    fmt::print(stderr,
               "hexcal: internal error: {}\nThis is a bug in hexcal; please report it with the command.\n",
               error.what());
    return hexcal::kBug;
  }
}

}  // namespace

int main(int argc, char** argv) {
  open_closed_streams();
  hexcal::make_output_printable();
  // OpenCV and Eigen want more stack than a low limit (ulimit -s) leaves to this thread and to new ones.
  constexpr std::size_t kStack = std::size_t{8} << 20;
  rlimit limit{};
  if (::getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kStack) return run(argc, argv);
  pthread_attr_t attributes;
  if (::pthread_attr_init(&attributes) == 0 && ::pthread_attr_setstacksize(&attributes, kStack) == 0)
    (void)::pthread_setattr_default_np(&attributes);
  int code = hexcal::kBug;
  try {
    std::thread([&] { code = run(argc, argv); }).join();
  } catch (const std::system_error& error) {
    return refused_thread(error.what());
  }
  return code;
}
