// SPDX-License-Identifier: Apache-2.0
// striper record: keeps what a source gives, without loss, for images: to replay.
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>

#include "calibrate/board_poses.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "record/frame_keeper.hpp"
#include "run/frame_loop.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct RecordArguments {
  std::string source;
  std::string output;
  std::optional<std::string> model;
  FrameLimits limits;
  double every_s = 0.0;
  std::optional<std::string> board;
  bool json = false;
};

constexpr const char* kDescription =
    "Keep what a source gives, without loss, in a directory or one file that replays exactly.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper record 'gige:?exposure_us=20' -o run1 --seconds 30\n"
    "  striper capture images:run1 --model striper.yaml -o scans.csv\n"
    "      the same scans as from the camera, as often as you like\n"
    "  striper record 'gige:?exposure_us=20' -o run1.mcap --model striper.yaml\n"
    "      one file with frames, scans, model and events, for ROS 2's and Foxglove's tools too;\n"
    "      striper capture mcap:run1.mcap replays it, '?realtime=yes' at the pace it had\n"
    "  striper record v4l2:/dev/video0 -o 'run.mcap?rotate=10min'\n"
    "      run_0000.mcap, run_0001.mcap, ...: a file every ten minutes (or rotate=1GB)\n"
    "  striper record v4l2:/dev/video0 -o shots --every 2 --frames 20\n"
    "      a frame every two seconds\n"
    "  striper record v4l2:/dev/video0 -o boards --when-board 8x6\n"
    "      images for a calibration: move the board about until you have some 20 poses\n\n"
    "A directory gets one PNG per frame (8 or 16 bits) and frames.csv: number, times,\n"
    "illumination, field, bit depth, region and status of each. A file .mcap gets the same\n"
    "as ROS 2's images with a striper_msgs/FrameInfo each (CONVENTIONS.md, Messages). Ctrl-C or a\n"
    "full disk loses nothing that was recorded before; a file whose writer was killed is read up "
    "to\n"
    "its last whole chunk, at most half a second earlier.";

void define(Command& command, RecordArguments& arguments) {
  add_source(command, arguments.source);
  command
      .add_option("-o,--output", arguments.output,
                  "The directory, which is made and must not hold image files already, or a file "
                  ".mcap")
      ->type_name("DIR|FILE.mcap")
      ->required();
  command
      .add_option("-m,--model", arguments.model,
                  "The calibrated striper (striper.yaml): its scans go into the file too")
      ->type_name("FILE");
  add_frame_limits(command, arguments.limits);
  command
      .add_option("--every", arguments.every_s,
                  "Keep only frames that are at least so many seconds apart")
      ->type_name("S")
      ->check(above_zero());
  command
      .add_option("--when-board", arguments.board,
                  "Keep only frames that show this board (inner corners, or circles:7x7) sharply "
                  "and where it was not yet: for calibrating a live camera")
      ->type_name("8x6");
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

// Lets through frames, with both of their fields, that are `--every` seconds apart.
class Spacing {
 public:
  explicit Spacing(double every_s) : every_ns_(static_cast<std::int64_t>(every_s * 1e9)) {}

  bool lets_through(const Frame& frame) const {
    if (!has_any_ || frame.sequence == sequence_) return true;
    // Half a field's tolerance would be too clever: the clock's own rounding is all there is.
    constexpr std::int64_t kRounding_ns = 1000;
    return frame.time.monotonic_ns >= time_ns_ + every_ns_ - kRounding_ns;
  }

  void note_kept(const Frame& frame) {
    if (has_any_ && frame.sequence == sequence_) return;
    has_any_ = true;
    sequence_ = frame.sequence;
    time_ns_ = frame.time.monotonic_ns;
  }

 private:
  std::int64_t every_ns_;
  bool has_any_ = false;
  std::uint64_t sequence_ = 0;
  std::int64_t time_ns_ = 0;
};

void say_kept(const FrameKeeper& keeper, const RecordArguments& arguments) {
  if (keeper.frames() == 0) {
    say(fmt::format("recorded nothing in {}", arguments.output));
    return;
  }
  const std::string scans =
      arguments.model ? fmt::format(" and {}", count(keeper.scans(), "scan")) : "";
  say(fmt::format("recorded {}{} in {}; replay: striper capture {}",
                  count(keeper.frames(), "frame"), scans, arguments.output,
                  shell_word(keeper.address())));
}

ExitCode record(const RecordArguments& arguments) {
  const HeldEvents held{TerminalEvents().port()};
  const EventPort& events = held.port();
  auto source = open_source(arguments.source, events);
  Spacing spacing(arguments.every_s);
  std::optional<NewBoardPoses> poses;
  if (arguments.board) poses.emplace(*arguments.board, !source->info().pictures);
  const auto keeper = make_frame_keeper(arguments.output, arguments.model, source->info(), held);
  const FrameReport result =
      read_frames(*source, arguments.limits, events, [&](const Frame& frame) {
        const bool is_wanted =
            spacing.lets_through(frame) && (!poses || poses->lets_through(frame));
        if (!is_wanted) return;
        spacing.note_kept(frame);
        keeper->write(frame);
      });
  keeper->finish();

  say(fmt::format("read {}", describe(result)));
  say_kept(*keeper, arguments);
  if (arguments.json) {
    nlohmann::json summary = to_json(result);
    summary["output"] = arguments.output;
    summary["recorded"] = keeper->frames();
    if (arguments.model) summary["scans"] = keeper->scans();
    print_json(summary);
  }
  let_go(std::move(source), result);
  return result.has_failed() ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_record(Command& striper, Action& action) {
  add_command<RecordArguments>(striper, action, "record", kDescription, define, record);
}

}  // namespace striper::program
