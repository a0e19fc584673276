// SPDX-License-Identifier: Apache-2.0
// striper capture: from a source of frames to polar scans in files.
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
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/stream/head.hpp>
#include <striper/stream/open_sink.hpp>

#include "options/own_files.hpp"
#include "options/scanner_arguments.hpp"
#include "options/shape_arguments.hpp"
#include "options/sink_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "record/shaped_outputs.hpp"
#include "run/frame_loop.hpp"
#include "run/stripe_watch.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct CaptureArguments {
  std::string source;
  std::vector<std::string> outputs;
  ScannerArguments scanner;
  FrameLimits limits;
  ShapeArguments shape;
  bool doubtful = false;
  bool missing = false;
  bool json = false;
};

constexpr const char* kDescription =
    "Scan: every lit exposure becomes polar scans, as CSV with error bars.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper capture sim:data/scenes/room.yaml --frames 10 -o scans.csv\n"
    "      ten frames of a simulated room; no model, so only where the stripe is in the image\n"
    "  striper capture images:shots --model striper.yaml -o scans.csv\n"
    "      a directory of image files, calibrated\n"
    "  striper capture 'v4l2:/dev/video0?standard=ntsc&laser=0,dark' -m striper.yaml --seconds 60\n"
    "      a minute of a grabber whose laser fires in every other field\n"
    "  striper capture 'images:*.png?fps=30' --axis rows --channel green --missing > rows.csv\n"
    "      a stripe that runs from top to bottom, with a line for every row\n"
    "  striper capture images:drive -m striper.yaml -o 'road.ply?speed=2.5' -o scans.csv\n"
    "      points for a viewer, the striper moving on by 2.5 m a second, and the table\n\n"
    "Columns: frame,time_s,laser,u_px,v_px,bearing_rad,range_m,range_near_m,range_far_m,sigma_m,\n"
    "sigma_cal_m,x_m,y_m,intensity,width_px,row_sigma_px,confidence,status. Only returns of "
    "status\n"
    "'ok' are written unless --doubtful or --missing say otherwise. The exit code is 1 where any\n"
    "frame was corrupt or of wrong size; the others are scanned all the same. A FILE that holds\n"
    "anything but scans is not overwritten.";

void define(Command& command, CaptureArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command
      .add_option("-o,--output", arguments.outputs,
                  "Where the scans go: a file .csv, .jsonl, .mcap, .ply, .pcd or .las, several "
                  "times if you "
                  "like; '-', the default, is CSV on the standard output")
      ->type_name("FILE")
      ->one_word_each();
  add_frame_limits(command, arguments.limits);
  command.add_flag("--doubtful", arguments.doubtful,
                   "Also write returns that are not to be trusted");
  command.add_flag(
      "--missing", arguments.missing,
      "Write a line for every column (or row), with the reason where nothing is there");
  add_shape_arguments(command, arguments.shape);
  command.add_flag("--json", arguments.json,
                   "A summary for programs on the standard output (needs -o FILE)");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

// What a run came to.
struct Capture {
  FrameReport read;
  SourceInfo source;
  ScannerStatus scanner;
  ReturnCounts returns;
  std::vector<SinkReport> sinks;
};

bool is_csv(const SinkUri& uri) { return uri.scheme() == "csv"; }

bool is_of_points(const SinkUri& uri) {
  return uri.scheme() == "ply" || uri.scheme() == "pcd" || uri.scheme() == "las";
}

// Lines that a CSV of all the scans has.
std::uint64_t lines_of(const SinkUri& uri, const ReturnCounts& returns) {
  const bool missing = uri.says_yes("missing");
  const bool doubtful = missing || uri.says_yes("doubtful");
  std::uint64_t lines = 0;
  for (int i = 0; i < kReturnStatusCount; ++i) {
    const auto status = static_cast<ReturnStatus>(i);
    const Verdict value = verdict(status);
    const bool is_written = value == Verdict::kGood || (value == Verdict::kDoubtful && doubtful) ||
                            (value == Verdict::kMissing && missing);
    if (is_written) lines += returns.of(status);
  }
  return lines;
}

nlohmann::json summarize(const Capture& done, const StripeWatch& watch,
                         const std::vector<SinkUri>& outputs, const ShapedOutputs& shaped,
                         const TerminalEvents& events) {
  nlohmann::json summary = to_json(done.read);
  summary["output"] = outputs.front().text();
  summary["outputs"] = to_json(done.sinks);
  summary["lines"] =
      lines_of(outputs.front(), shaped.are_shaped() ? shaped.returns() : done.returns);
  summary["shaped"] = shaped.to_json();
  summary["scans"] = done.scanner.counts.scans;
  summary["dark"] = done.scanner.counts.dark;
  summary["refused"] = done.scanner.counts.refused;
  watch.add_to(summary);
  summary["returns"] = done.returns.to_json();
  summary["decisions"] = decisions(done.scanner.ambient);
  summary["status"] = to_json(done.scanner);
  summary["events"] = to_json(events.heard());
  return summary;
}

// Frames that are good for the source and not for the scanner.
std::uint64_t misfits(const Capture& done) {
  const SourceStatistics& source = done.read.statistics;
  const std::uint64_t bad = source.corrupt + source.incomplete + source.wrong_size;
  return done.scanner.counts.refused - std::min(bad, done.scanner.counts.refused);
}

// What was made of exposures without the laser matters where there are any, where somebody asked
// for it, and where so little of the stripe is found that daylight may be why.
bool do_dark_exposures_matter(const CaptureArguments& arguments, const Capture& done) {
  constexpr double kMostIsFound = 0.5;  // Of the scan lines: half a view may show no stripe.
  const bool is_asked = arguments.scanner.has("ambient") || done.source.pattern.has_dark();
  const bool is_found = static_cast<double>(done.returns.of(ReturnStatus::kOk)) >=
                        kMostIsFound * static_cast<double>(done.returns.total());
  return is_asked || done.scanner.counts.dark > 0 || !is_found;
}

// The channel is the first decision.
void say_decisions(const ScannerStatus& scanner, const TerminalEvents& events,
                   bool do_dark_exposures_matter) {
  std::vector<std::string> lines = decisions(scanner.ambient);
  if (!do_dark_exposures_matter && lines.size() > 1) lines.resize(1);
  for (const std::string& line : lines) say("decided: " + line);
  if (!do_dark_exposures_matter) return;
  for (const Event& event : events.heard()) {
    const bool is_of_dark = event.code == EventCode("no_dark_exposure");
    if (is_of_dark && event.severity == Severity::kInfo) say(sentence(event));
  }
}

// @param returns  of the scans that were written.
void say_output(const SinkUri& uri, const SinkReport& sink, const ReturnCounts& returns) {
  const bool is_whole = is_csv(uri) && sink.state == SinkReport::State::kFinished;
  std::string text = fmt::format("wrote {}", count(sink.written, "scan"));
  if (is_whole) text += fmt::format(", {}", count(lines_of(uri, returns), "line"));
  text += fmt::format(", to {}", uri.path() == "-" ? "the standard output" : sink.uri);
  if (sink.lost > 0) text += fmt::format("; {} lost", sink.lost);
  say(text);
}

void say_summary(const Capture& done, const std::vector<SinkUri>& outputs,
                 const ShapedOutputs& shaped) {
  say(fmt::format("read {}", describe(done.read)));
  if (const std::uint64_t refused = misfits(done); refused > 0) {
    say(fmt::format("refused {}: see above", count(refused, "frame")));
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    say_output(outputs[i], done.sinks[i], shaped.are_shaped() ? shaped.returns() : done.returns);
  }
  say(fmt::format("returns: {}", done.returns.describe()));
  shaped.say_result();
  if (done.returns.of(ReturnStatus::kBehind) > done.returns.of(ReturnStatus::kOk)) {
    say(
        fmt::format("warning: {} stripes were found where the camera's rays meet the laser's plane "
                    "behind it or nowhere: is it this striper's model, the plane's sign right?",
                    done.returns.of(ReturnStatus::kBehind)));
  }
}

bool is_standard_output(const std::string& path) {
  struct stat file {};
  struct stat standard {};
  if (path == "-") return true;
  return ::stat(path.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &standard) == 0 &&
         file.st_dev == standard.st_dev && file.st_ino == standard.st_ino;
}

// What -o, --doubtful and --missing come to.
std::vector<SinkUri> outputs_of(const CaptureArguments& arguments) {
  std::vector<SinkUri> uris = parse_sinks(arguments.outputs);
  if (uris.empty()) uris.push_back(SinkUri::parse("-"));
  std::vector<std::string> files;
  for (SinkUri& uri : uris) {
    files.push_back(uri.path());
    if ((is_csv(uri) || is_of_points(uri)) && arguments.doubtful)
      uri.set_default("doubtful", "yes");
    if (is_csv(uri) && arguments.missing) uri.set_default("missing", "yes");
    if (arguments.json && is_standard_output(uri.path())) {
      throw Error(ErrorKind::kUsage,
                  "--json needs -o FILE: the standard output carries the scans themselves");
    }
  }
  require_own_files(
      {SourceUri::parse(arguments.source).path(), arguments.scanner.model.value_or("")}, files);
  return uris;
}

/// The head of one run, in front of a person.
class CaptureRun {
 public:
  CaptureRun(const CaptureArguments& arguments, const TerminalEvents& events, ScanBus& bus)
      : arguments_(arguments), events_(events), bus_(bus) {}

  Capture run() {
    HeadParts parts;
    parts.open = [this](const EventPort& port) { return open(port); };
    parts.make_scanner = [this](const SourceInfo& source, const EventPort& port) {
      return make(source, port);
    };
    parts.before_scan = [this](const Frame& frame) { watch_->keep(frame); };
    parts.after_scan = [this](ScanSpan scans) { look_at(scans); };
    HeadOptions options;
    options.limits = arguments_.limits;
    options.events = events_.port();
    // Scans that nobody takes any more are not worth a camera.
    options.should_stop = [this] { return stop_requested() || !bus_.is_any_open(); };
    Head head(parts, options, bus_);
    done_.read = head.run();
    done_.read.interrupted = stop_requested();
    done_.scanner = head.health().scanner;
    progress_.reset();
    return done_;
  }

  StripeWatch& watch() noexcept { return *watch_; }

 private:
  std::unique_ptr<FrameSource> open(const EventPort& port) {
    auto source = open_source(arguments_.source, port);
    done_.source = source->info();
    return source;
  }

  HeadScanner make(const SourceInfo& source, const EventPort& port) {
    const ScannerSetup setup = scanner_setup(arguments_.scanner, source, port);
    if (!setup.model && arguments_.shape.options().is_any()) {
      throw Error(ErrorKind::kUsage,
                  "--average, --smooth and --resample change ranges: they need --model");
    }
    Scanner scanner = make_scanner(setup);
    watch_.emplace(arguments_.scanner, setup);
    if (source.is_live) say(source.description);  // What was chosen where the address is silent.
    progress_.emplace("frames", total_pictures(arguments_.limits, source));
    return {std::move(scanner), shared_model(setup), setup.options.stripe.axis,
            setup.options.adapts_exposure};
  }

  void look_at(ScanSpan scans) {
    watch_->look_at(scans);
    for (const PolarScan& scan : scans) done_.returns.add(scan);
    progress_->update(++frames_);
  }

  const CaptureArguments& arguments_;
  const TerminalEvents& events_;
  ScanBus& bus_;
  Capture done_;
  std::uint64_t frames_ = 0;
  std::optional<StripeWatch> watch_;
  std::optional<Progress> progress_;
};

// StripeWatch says more of the stripe; where the one sink fails, the error says all.
TerminalEvents terminal_events(bool is_one) {
  if (!is_one) return TerminalEvents({"no_stripe", "stripe_seen"});
  return TerminalEvents({"no_stripe", "stripe_seen", "sink_failed", "disk_full", "sink_slow"});
}

ExitCode capture(const CaptureArguments& arguments) {
  const std::vector<SinkUri> outputs = outputs_of(arguments);
  const bool is_one = outputs.size() == 1;
  if (outputs.front().path() == "-" && ::isatty(STDOUT_FILENO) == 1) show_no_progress();
  const TerminalEvents events = terminal_events(is_one);
  ScanBus bus(events.port());
  const ShapedOutputs shaped(outputs, arguments.shape.options(), bus);

  CaptureRun run(arguments, events, bus);
  Capture done = run.run();
  bus.finish();
  done.sinks = shaped.reports(bus);
  if (is_one && bus.failure()) std::rethrow_exception(bus.failure());
  require_frames(done.read, arguments.source);

  say_summary(done, outputs, shaped);
  say_decisions(done.scanner, events, do_dark_exposures_matter(arguments, done));
  run.watch().conclude();
  if (arguments.json) print_json(summarize(done, run.watch(), outputs, shaped, events));
  if (done.read.is_lost) leave_threads_behind();
  const bool is_clean = !done.read.has_failed() && misfits(done) == 0 && !bus.failure();
  if (shaped.has_moved()) return ExitCode::kUntrustworthy;
  return is_clean ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_capture(Command& striper, Action& action) {
  add_command<CaptureArguments>(striper, action, "capture", kDescription, define, capture);
}

}  // namespace striper::program
