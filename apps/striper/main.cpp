// SPDX-License-Identifier: Apache-2.0
// The one program: understands the command line, runs the chosen subcommand, turns what happened
// into an exit code.
#include <array>
#include <memory>

#include <CLI/CLI.hpp>

#include "camera/camera_commands.hpp"
#include "program/commands.hpp"
#include "program/help_formatter.hpp"
#include "program/program.hpp"

namespace {

using striper::program::Action;
using striper::program::Command;
using striper::program::ExitCode;

// One line per subcommand, in the order of `striper --help`.
constexpr std::array kCommands{
    striper::program::add_capture,   striper::program::add_serve,   striper::program::add_record,
#ifdef STRIPER_HAS_CALIBRATION
    striper::program::add_calibrate,
#endif
    striper::program::add_verify,    striper::program::add_why,     striper::program::add_noise,
#ifdef STRIPER_HAS_CALIBRATION
    striper::program::add_board,     striper::program::add_diff,
#endif
    striper::program::add_convert,   striper::program::add_info,    striper::program::add_measure,
    striper::program::add_curb,      striper::program::add_objects, striper::program::add_guide,
    striper::program::add_compare,   striper::program::add_design,  striper::program::add_eyesafe,
    striper::program::add_simulate,  striper::program::add_devices, striper::program::add_bench,
    striper::program::add_doctor,
};

constexpr const char* kDescription =
    "Turns a camera and a laser line into a calibrated range sensor.\n"
    "A source of frames is named images:DIR, sim:SCENE.yaml, v4l2:/dev/video0 or gige:SERIAL.";

constexpr const char* kFooter =
    "Each command explains itself: striper capture --help\n\n"
    "Data goes to the standard output, everything for people to the standard error stream.\n"
    "Exit code: 0 done, 1 failed, 2 wrong usage, 3 refused because the result would not be\n"
    "trustworthy. Ctrl-C ends any command cleanly: what is written is whole.";

}  // namespace

int main(int argc, char** argv) {
  striper::program::prepare_process();
  CLI::App striper(kDescription, "striper");
  striper.formatter(std::make_shared<striper::program::HelpFormatter>());
  striper.footer(kFooter);
  striper.set_version_flag("--version", "striper " STRIPER_VERSION);
  striper.require_subcommand(1);

  Command commands(striper);
  Action action;
  for (const auto add_command : kCommands) add_command(commands, action);
#ifdef STRIPER_HAS_ARAVIS
  striper::program::add_virtual_camera(commands, action);
#endif
  return static_cast<int>(striper::program::run(striper, argc, argv, action));
}
