// SPDX-License-Identifier: Apache-2.0
// striper record: keeps what a source gives, without loss, for images: to replay.
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/images/recorder.hpp>

#include "board_poses.hpp"
#include "frame_loop.hpp"
#include "program.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

struct RecordArguments {
  std::string source;
  std::string directory;
  FrameLimits limits;
  double every_s = 0.0;
  std::optional<std::string> board;
  bool json = false;
};

constexpr const char* kDescription =
    "Keep pictures: what the source gives, without loss, in a directory that replays exactly.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper record 'gige:?exposure_us=20' -o run1 --seconds 30\n"
    "  striper capture images:run1 --model striper.yaml -o scans.csv\n"
    "      the same scans as from the camera, as often as you like\n"
    "  striper record v4l2:/dev/video0 -o shots --every 2 --frames 20\n"
    "      a picture every two seconds\n"
    "  striper record v4l2:/dev/video0 -o boards --when-board 8x6\n"
    "      pictures for a calibration: move the board about until you have some 20 poses\n\n"
    "The directory gets one PNG per frame (8 or 16 bits) and frames.csv: number, times,\n"
    "illumination, field, bit depth, region and status of each. Ctrl-C or a full disk loses "
    "nothing\n"
    "that was recorded before.";

void define(CLI::App& command, RecordArguments& arguments) {
  add_source(command, arguments.source);
  command
      .add_option("-o,--output", arguments.directory,
                  "The directory; it is made, and must not hold pictures already")
      ->type_name("DIR")
      ->required();
  add_frame_limits(command, arguments.limits);
  command
      .add_option("--every", arguments.every_s,
                  "Keep only pictures that are at least so many seconds apart")
      ->type_name("S")
      ->check(above_zero());
  command
      .add_option("--when-board", arguments.board,
                  "Keep only pictures that show this board (inner corners, or circles:7x7) sharply "
                  "and where it was not yet: for calibrating a live camera")
      ->type_name("8x6");
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

// Lets through pictures, with both of their fields, that are `--every` seconds apart.
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

ExitCode record(const RecordArguments& arguments) {
  auto source = open_source(arguments.source, TerminalEvents().port());
  Spacing spacing(arguments.every_s);
  std::optional<NewBoardPoses> poses;
  if (arguments.board) poses.emplace(*arguments.board, !source->info().pictures);
  Recorder recorder(arguments.directory, source->info());
  const FrameLoopResult result = read_frames(*source, arguments.limits, [&](const Frame& frame) {
    const bool is_wanted = spacing.lets_through(frame) && (!poses || poses->lets_through(frame));
    if (!is_wanted) return;
    spacing.note_kept(frame);
    recorder.write(frame);
  });

  say(fmt::format("read {}", describe(result)));
  if (recorder.frames() > 0) {
    say(fmt::format("recorded {} in {}; replay: striper capture {}",
                    count(recorder.frames(), "frame"), arguments.directory,
                    shell_word("images:" + arguments.directory)));
  } else {
    say(fmt::format("recorded nothing in {}", arguments.directory));
  }
  if (arguments.json) {
    nlohmann::json summary = to_json(result);
    summary["output"] = arguments.directory;
    summary["recorded"] = recorder.frames();
    print_json(summary);
  }
  let_go(std::move(source), result);
  return result.has_failed() ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_record(CLI::App& striper, Action& action) {
  add_command<RecordArguments>(striper, action, "record", kDescription, define, record);
}

}  // namespace striper::program
