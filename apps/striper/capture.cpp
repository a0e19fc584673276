// SPDX-License-Identifier: Apache-2.0
// striper capture: from a source of pictures to polar scans as CSV.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/sinks/csv_sink.hpp>

#include "frame_loop.hpp"
#include "program.hpp"
#include "scanner_arguments.hpp"
#include "stripe_watch.hpp"
#include "summary.hpp"
#include "terminal.hpp"
#include "terminal_events.hpp"

namespace striper::program {
namespace {

struct CaptureArguments {
  std::string source;
  std::string output = "-";
  ScannerArguments scanner;
  FrameLimits limits;
  CsvOptions csv;
  bool json = false;
};

constexpr const char* kDescription =
    "Scan: every lit picture becomes polar scans, as CSV with error bars.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper capture sim:data/scenes/room.yaml --frames 10 -o scans.csv\n"
    "      ten pictures of a simulated room; no model, so only where the stripe is in the picture\n"
    "  striper capture images:shots --model striper.yaml -o scans.csv\n"
    "      a directory of pictures, calibrated\n"
    "  striper capture 'v4l2:/dev/video0?standard=ntsc&laser=0,dark' -m striper.yaml --seconds 60\n"
    "      a minute of a grabber whose laser fires in every other field\n"
    "  striper capture 'images:*.png?fps=30' --axis rows --channel green --missing > rows.csv\n"
    "      a stripe that runs from top to bottom, with a line for every row\n\n"
    "Columns: frame,time_s,laser,u_px,v_px,bearing_rad,range_m,range_near_m,range_far_m,sigma_m,\n"
    "sigma_cal_m,x_m,y_m,intensity,width_px,row_sigma_px,confidence,status. Only returns of "
    "status\n"
    "'ok' are written unless --doubtful or --missing say otherwise. The exit code is 1 where any\n"
    "picture was corrupt or of wrong size; the others are scanned all the same. A FILE that holds\n"
    "anything but scans is not overwritten.";

void define(CLI::App& command, CaptureArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command
      .add_option("-o,--output", arguments.output,
                  "Where the scans go; '-', the default, is the standard output")
      ->type_name("FILE");
  add_frame_limits(command, arguments.limits);
  command.add_flag("--doubtful", arguments.csv.doubtful,
                   "Also write returns that are not to be trusted");
  command.add_flag(
      "--missing", arguments.csv.missing,
      "Write a line for every column (or row), with the reason where nothing is there");
  command.add_flag("--json", arguments.json,
                   "A summary for programs on the standard output (needs -o FILE)");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

nlohmann::json summarize(const FrameLoopResult& result, const Scanner& scanner,
                         const StripeWatch& watch, const ReturnCounts& returns, std::uint64_t lines,
                         const std::string& output, const TerminalEvents& events) {
  nlohmann::json summary = to_json(result);
  summary["output"] = output;
  summary["lines"] = lines;
  summary["scans"] = scanner.statistics().scans;
  summary["dark"] = scanner.statistics().dark;
  summary["refused"] = scanner.statistics().refused;
  watch.add_to(summary);
  summary["returns"] = returns.to_json();
  summary["decisions"] = decisions(scanner.status().ambient);
  summary["status"] = to_json(scanner.status());
  summary["events"] = to_json(events.heard());
  return summary;
}

// Frames that are good for the source and not for the scanner.
std::uint64_t misfits(const FrameLoopResult& result, const Scanner& scanner) {
  const SourceStatistics& source = result.statistics;
  const std::uint64_t bad = source.corrupt + source.incomplete + source.wrong_size;
  return scanner.statistics().refused - std::min(bad, scanner.statistics().refused);
}

// What was made of exposures without the laser matters where there are any, where somebody asked
// for it, and where so little of the stripe is found that daylight may be why.
bool do_dark_exposures_matter(const CaptureArguments& arguments, const SourceInfo& source,
                              const Scanner& scanner, const ReturnCounts& returns) {
  constexpr double kMostIsFound = 0.5;  // Of the lines: half a view may show no stripe.
  const bool is_asked = arguments.scanner.has("ambient") || source.cadence.has_dark();
  const bool is_found = static_cast<double>(returns.of(ReturnStatus::kOk)) >=
                        kMostIsFound * static_cast<double>(returns.total());
  return is_asked || scanner.statistics().dark > 0 || !is_found;
}

// The channel is the first decision.
void say_decisions(const Scanner& scanner, const TerminalEvents& events,
                   bool do_dark_exposures_matter) {
  std::vector<std::string> lines = decisions(scanner.status().ambient);
  if (!do_dark_exposures_matter && lines.size() > 1) lines.resize(1);
  for (const std::string& line : lines) say("decided: " + line);
  if (!do_dark_exposures_matter) return;
  for (const Event& event : events.heard()) {
    const bool is_of_dark = event.code == EventCode("no_dark_exposure");
    if (is_of_dark && event.severity == Severity::kInfo) say(sentence(event));
  }
}

void say_summary(const FrameLoopResult& result, const Scanner& scanner, const ReturnCounts& returns,
                 std::uint64_t lines, const std::string& output) {
  say(fmt::format("read {}", describe(result)));
  if (const std::uint64_t refused = misfits(result, scanner); refused > 0) {
    say(fmt::format("refused {}: see above", count(refused, "frame")));
  }
  say(fmt::format("wrote {}, {}, to {}", count(scanner.statistics().scans, "scan"),
                  count(lines, "line"), output == "-" ? "the standard output" : output));
  say(fmt::format("returns: {}", returns.describe()));
  if (returns.of(ReturnStatus::kBehind) > returns.of(ReturnStatus::kOk)) {
    say(
        fmt::format("warning: {} stripes were found where the camera's rays meet the laser's plane "
                    "behind it or nowhere: is it this striper's model, the plane's sign right?",
                    returns.of(ReturnStatus::kBehind)));
  }
}

bool is_standard_output(const std::string& path) {
  struct stat file {};
  struct stat standard {};
  if (path == "-") return true;
  return ::stat(path.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &standard) == 0 &&
         file.st_dev == standard.st_dev && file.st_ino == standard.st_ino;
}

ExitCode capture(const CaptureArguments& arguments) {
  if (arguments.json && is_standard_output(arguments.output)) {
    throw Error(ErrorKind::kUsage,
                "--json needs -o FILE: the standard output carries the scans themselves");
  }
  require_replaceable_by_scans(arguments.output);
  if (arguments.output == "-" && ::isatty(STDOUT_FILENO) == 1) show_no_progress();
  const TerminalEvents events({"no_stripe", "stripe_seen"});  // StripeWatch says more.
  auto source = open_source(arguments.source, events.port());
  const ScannerSetup setup = scanner_setup(arguments.scanner, source->info(), events.port());
  Scanner scanner = make_scanner(setup);
  StripeWatch watch(arguments.scanner, setup);
  CsvOptions csv = arguments.csv;
  csv.doubtful = csv.doubtful || csv.missing;  // A line for every column.
  std::optional<CsvSink> sink;  // From the first picture on: no old file gives way to nothing.

  ReturnCounts returns;
  const auto keep = [&](ScanSpan scans) {
    watch.look_at(scans);
    for (const PolarScan& scan : scans) {
      sink->write(scan);
      returns.add(scan);
    }
  };
  const FrameLoopResult result = read_frames(*source, arguments.limits, [&](const Frame& frame) {
    if (!sink) sink.emplace(arguments.output, csv);
    watch.keep(frame);
    keep(scanner.process(frame));
  });
  keep(scanner.finish());
  if (sink) sink->close();
  const std::uint64_t lines = sink ? sink->lines() : 0;

  say_summary(result, scanner, returns, lines, arguments.output);
  say_decisions(scanner, events,
                do_dark_exposures_matter(arguments, source->info(), scanner, returns));
  watch.conclude();
  if (arguments.json) {
    print_json(summarize(result, scanner, watch, returns, lines, arguments.output, events));
  }
  let_go(std::move(source), result);
  const bool is_clean = !result.has_failed() && misfits(result, scanner) == 0;
  return is_clean ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_capture(CLI::App& striper, Action& action) {
  add_command<CaptureArguments>(striper, action, "capture", kDescription, define, capture);
}

}  // namespace striper::program
