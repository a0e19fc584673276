// SPDX-License-Identifier: Apache-2.0
// striper convert: scans from one kind of file to others; a damaged recording to a whole one.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/recording_info.hpp>
#include <striper/stream/scan_bus.hpp>
#include <striper/stream/scan_files.hpp>
#include <striper/wire/mcap_copy.hpp>

#include "options/option_bounds.hpp"
#include "options/own_files.hpp"
#include "options/range_sigmas.hpp"
#include "options/shape_arguments.hpp"
#include "options/sink_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "record/shaped_outputs.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
  std::string scans;
  std::vector<std::string> outputs;
  std::optional<std::string> model;
  std::optional<double> start_s;
  std::optional<double> end_s;
  std::string head;
  ShapeArguments shape;
  double sigma_m = kNoSigma_m;
  std::optional<double> speed_m_s;
  std::optional<std::string> odometer;
  std::optional<double> counts_per_m;
  std::optional<int> bits;
  bool doubtful = false;
  bool missing = false;
  bool json = false;
};

constexpr const char* kDescription =
    "Convert scans from one kind of file to others, all or a part; save a damaged recording.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper convert run.mcap -o scans.csv --missing\n"
    "      every column of every scan as a table; CSV, JSON lines and MCAP hold the same bits\n"
    "  striper convert run.mcap -o part.mcap --start 60 --end 90 --head left\n"
    "      half a minute of one head, frames and model with it\n"
    "  striper convert broken.mcap -o whole.mcap\n"
    "      what can be read of a file whose writer died, with a proper end\n"
    "  striper convert drive.mcap -o road.ply --odometer odometer.csv --counts-per-m 1200\n"
    "      points for a viewer, the striper moved between scans\n"
    "  striper convert scans.csv -o smooth.csv -o points.las --smooth line\n"
    "      one pass, several files\n"
    "  striper convert scans.csv -o profile.csv --resample y=0.001 --fill-gaps 0.02 --doubtful\n"
    "      a return every millimetre; a table of ok returns alone needs its pixels for its gaps\n\n"
    "From .mcap to .mcap all messages are copied, frames too, unless scans are averaged, smoothed\n"
    "or resampled. --start and --end count from the first scan, or message, in seconds. The exit\n"
    "code is 0 where anything was saved of a damaged file: what was lost is said.";

void define_motion(Command& command, ConvertArguments& arguments) {
  auto* const speed =
      command
          .add_option("--speed", arguments.speed_m_s,
                      "Points (.ply, .pcd, .las): the striper moves on so fast, metres a second")
          ->type_name("M_PER_S");
  auto* const odometer =
      command
          .add_option("--odometer", arguments.odometer,
                      "Points: the striper moves as this wheel's counter says (odometer.csv)")
          ->type_name("FILE")
          ->excludes(speed);
  auto* const counts =
      command
          .add_option("--counts-per-m", arguments.counts_per_m, "Counts of the wheel in a metre")
          ->type_name("K")
          ->check(not_zero())
          ->needs(odometer);
  odometer->needs(counts);
  command.add_option("--bits", arguments.bits, "The counter starts again at 2^8, 2^16 or 2^32")
      ->type_name("8|16|32")
      ->check(one_of({"8", "16", "32"}))
      ->needs(odometer);
}

void define(Command& command, ConvertArguments& arguments) {
  command
      .add_option("SCANS", arguments.scans,
                  "Scans: a file .csv, .jsonl or .mcap, or any source and --model")
      ->required();
  command
      .add_option("-o,--output", arguments.outputs,
                  "Where they go: a file .csv, .jsonl, .mcap, .ply, .pcd or .las; several times if "
                  "you like")
      ->type_name("FILE")
      ->required()
      ->one_word_each();
  command
      .add_option("-m,--model", arguments.model,
                  "The calibrated striper, for files that do not hold it")
      ->type_name("FILE");
  command.add_option("--start", arguments.start_s, "Leave out what is earlier, seconds")
      ->type_name("S")
      ->check(at_least(0.0));
  command.add_option("--end", arguments.end_s, "Leave out what is later, seconds")
      ->type_name("S")
      ->check(at_least(0.0));
  command.add_option("--head", arguments.head, "This head of several alone")->type_name("H");
  add_shape_arguments(command, arguments.shape);
  add_sigma_option(command, arguments.sigma_m);
  define_motion(command, arguments);
  command.add_flag("--doubtful", arguments.doubtful,
                   "Also write returns that are not to be trusted");
  command.add_flag("--missing", arguments.missing,
                   "CSV: a line for every column (or row), with the reason where nothing is there");
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kExamples);
}

bool is_of_points(const SinkUri& uri) {
  return uri.scheme() == "ply" || uri.scheme() == "pcd" || uri.scheme() == "las";
}

bool is_recording(const std::string& path) { return fs::path(path).extension() == ".mcap"; }

// What of the recording is wanted: the time since its beginning, and the head.
class Part {
 public:
  explicit Part(const ConvertArguments& arguments)
      : start_s_(arguments.start_s), end_s_(arguments.end_s), head_(arguments.head) {
    if (start_s_ && end_s_ && *start_s_ >= *end_s_) {
      throw Error(
          ErrorKind::kUsage,
          fmt::format("--start {} --end {}: expected an end behind the start", *start_s_, *end_s_));
    }
  }

  void require_within(double duration_s, const std::string& file) const {
    if (start_s_.value_or(0.0) <= duration_s) return;
    throw Error(ErrorKind::kUsage,
                fmt::format("--start {}: '{}' is {:.3f} s long", *start_s_, file, duration_s));
  }

  // Times are whole nanoseconds, or seconds that are exact to much less than one.
  bool has(double since_begin_s) const {
    constexpr double kRounding_s = 1e-9;
    return since_begin_s >= start_s_.value_or(0.0) - kRounding_s && !is_behind(since_begin_s);
  }
  bool is_behind(double since_begin_s) const { return end_s_ && since_begin_s > *end_s_; }
  std::uint64_t start_ns(double begin_s) const {
    return static_cast<std::uint64_t>(1e9 * (begin_s + start_s_.value_or(0.0)));
  }
  bool has_head(std::string_view head) const { return head_.empty() || head == head_; }
  const std::string& head() const { return head_; }

  // Of the names that begin with a head's, those of another.
  bool has_name(std::string_view name, const std::vector<std::string>& heads) const {
    if (name.starts_with('/')) name.remove_prefix(1);
    const std::string_view first = name.substr(0, name.find('/'));
    const bool is_of_head =
        first != name && std::find(heads.begin(), heads.end(), first) != heads.end();
    return !is_of_head || has_head(first);
  }

 private:
  std::optional<double> start_s_;
  std::optional<double> end_s_;
  std::string head_;
};

// What the conversion came to.
struct Converted {
  std::uint64_t scans = 0;
  std::uint64_t messages = 0;  // Of recordings that were copied.
  std::vector<SinkReport> sinks;
  std::vector<RecordingDamage> damages;
  nlohmann::json shaped;  // ShapedOutputs.
  bool has_moved = false;
  bool is_interrupted = false;
};

// Reads the whole recording for what is in it, or until Ctrl-C.
RecordingInfo inspect(const std::string& file) {
  Progress progress("bytes", std::nullopt);
  return inspect_recording(file, [&](std::uint64_t bytes) { return progress.go_on(bytes); });
}

void copy_recording(const ConvertArguments& arguments, const Part& part, const RecordingInfo& known,
                    const std::string& to, Converted& done) {
  Progress progress("bytes", known.bytes);
  const double begin_s = known.start_s.value_or(0.0);
  wire::McapSelection selection;
  selection.message = [&](const wire::McapChannel& channel, wire::McapMessage& message) {
    if (!part.has_name(channel.topic, known.heads)) return false;
    const double since_begin_s = 1e-9 * static_cast<double>(message.log_time_ns) - begin_s;
    // Where the heads stand is said once, and holds for what comes later.
    const bool is_standing = channel.topic == "/tf_static";
    if (is_standing && !part.has(since_begin_s)) message.log_time_ns = part.start_ns(begin_s);
    return is_standing || part.has(since_begin_s);
  };
  selection.extra = [&](std::string_view name) { return part.has_name(name, known.heads); };
  selection.go_on = [&](std::uint64_t bytes) { return progress.go_on(bytes); };
  const wire::McapCopied copied = wire::copy_mcap(arguments.scans, to, selection);
  done.messages += copied.messages;
  done.is_interrupted = done.is_interrupted || copied.was_stopped;
}

// @param known of a recording. One of frames alone is scanned.
std::unique_ptr<ScanSource> open(const ConvertArguments& arguments,
                                 const std::optional<RecordingInfo>& known,
                                 const EventPort& events) {
  std::shared_ptr<const StriperModel> model;
  if (arguments.model) model = std::make_shared<const StriperModel>(load_model(*arguments.model));
  if (known && known->scans > 0)
    return read_mcap_scans(arguments.scans, model, arguments.head, true);
  return open_scans(arguments.scans, model, std::nullopt, events);
}

/// Gives the wanted scans of a source to a bus.
class ScanConversion {
 public:
  ScanConversion(const ConvertArguments& arguments, ScanSource& source, const Part& part,
                 ScanBus& bus, Converted& done)
      : arguments_(arguments), source_(source), part_(part), bus_(bus), done_(done) {}

  // @param total of the file's scans, where it is known.
  void run(std::optional<std::uint64_t> total) {
    Progress progress("scans", total);
    std::uint64_t read = 0;
    try {
      while (bus_.is_any_open() && take_next()) progress.update(++read);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kBadFile || done_.scans == 0) throw;
      done_.damages.push_back({{}, {}, error.what()});
    }
    done_.is_interrupted = done_.is_interrupted || stop_requested();
    if (const std::string loss = source_.loss(); done_.damages.empty() && !loss.empty())
      done_.damages.push_back({{}, {}, loss});
  }

 private:
  bool take_next() {
    constexpr std::chrono::milliseconds kPatience{200};
    auto scan = std::make_shared<PolarScan>();
    while (!stop_requested()) {
      const NextStatus status = source_.next(*scan, kPatience);
      if (status == NextStatus::kTimeout) continue;
      if (status != NextStatus::kFrame) return false;
      return give(std::move(scan));
    }
    return false;
  }

  bool give(std::shared_ptr<PolarScan> scan) {
    const double time_s = scan->time.seconds();
    if (!begin_s_) begin_s_ = time_s;
    if (!part_.has(time_s - *begin_s_) || !part_.has_head(scan->head())) return true;
    if (heads_.emplace(scan->head()).second) bus_.open(source_.info_of(scan->head()));
    complete_sigmas(*scan);
    bus_.write(std::shared_ptr<const PolarScan>(std::move(scan)));
    ++done_.scans;
    return true;
  }

  // Surfaces are found by how good their ranges are. Scans that are not touched keep their bits.
  void complete_sigmas(PolarScan& scan) {
    if (!is_smoothed_ && std::isnan(arguments_.sigma_m)) return;
    sigmas_.complete(scan);
    if (is_smoothed_) sigmas_.require_any(arguments_.scans);
  }

  const ConvertArguments& arguments_;
  RangeSigmas sigmas_{arguments_.sigma_m};
  bool is_smoothed_ = arguments_.shape.options().smooth;
  ScanSource& source_;
  const Part& part_;
  ScanBus& bus_;
  Converted& done_;
  std::optional<double> begin_s_;
  std::set<std::string, std::less<>> heads_;
};

void convert_scans(const ConvertArguments& arguments, const Part& part,
                   const std::vector<SinkUri>& outputs, const std::optional<RecordingInfo>& known,
                   Converted& done) {
  const TerminalEvents events;
  const auto source = open(arguments, known, events.port());
  ScanBus bus(events.port());
  const ShapedOutputs shaped(outputs, arguments.shape.options(), bus);
  const bool is_counted = known && known->scans > 0;
  ScanConversion(arguments, *source, part, bus, done)
      .run(is_counted ? std::optional(known->scans) : std::nullopt);
  if (done.scans == 0 && !done.is_interrupted) {
    throw Error(
        ErrorKind::kNotFound,
        fmt::format("'{}' has no scans{}{}", arguments.scans,
                    part.head().empty() ? "" : " of head " + part.head(),
                    arguments.start_s || arguments.end_s ? " between --start and --end" : ""));
  }
  bus.finish();
  done.sinks = shaped.reports(bus);
  done.shaped = shaped.to_json();
  done.has_moved = shaped.has_moved();
  if (bus.failure()) std::rethrow_exception(bus.failure());
  shaped.say_result();
}

// The options that are keys of an output's address.
void set_keys(const ConvertArguments& arguments, SinkUri& uri) {
  const bool is_csv = uri.scheme() == "csv";
  if (arguments.doubtful && (is_csv || is_of_points(uri))) uri.set_default("doubtful", "yes");
  if (arguments.missing && is_csv) uri.set_default("missing", "yes");
  if (!is_of_points(uri)) return;
  if (arguments.speed_m_s) uri.set_default("speed", fmt::format("{}", *arguments.speed_m_s));
  if (!arguments.odometer) return;
  uri.set_default("odometer", *arguments.odometer);
  uri.set_default("counts_per_m", fmt::format("{}", *arguments.counts_per_m));
  if (arguments.bits) uri.set_default("bits", fmt::format("{}", *arguments.bits));
}

std::vector<SinkUri> outputs_of(const ConvertArguments& arguments) {
  std::vector<SinkUri> uris = parse_sinks(arguments.outputs);
  std::vector<std::string> files;
  for (SinkUri& uri : uris) {
    files.push_back(uri.path());
    set_keys(arguments, uri);
  }
  require_own_files({arguments.scans}, files);
  const bool has_motion = arguments.speed_m_s || arguments.odometer;
  if (has_motion && std::none_of(uris.begin(), uris.end(), is_of_points)) {
    throw Error(ErrorKind::kUsage,
                "--speed and --odometer move points: expected an output .ply, .pcd or .las");
  }
  return uris;
}

void require_head(const std::string& head, const RecordingInfo& known, const std::string& file) {
  const auto& heads = known.heads;
  if (head.empty() || std::find(heads.begin(), heads.end(), head) != heads.end()) return;
  throw Error(ErrorKind::kUsage,
              fmt::format("'{}' has no head {}: expected {}", file, head, fmt::join(heads, ", ")));
}

void say_done(const Converted& done, const ConvertArguments& arguments,
              const std::vector<SinkUri>& copies) {
  for (const SinkUri& uri : copies)
    say(fmt::format("copied {} to {}", count(done.messages / copies.size(), "message"),
                    uri.text()));
  for (const SinkReport& sink : done.sinks)
    say(fmt::format("wrote {} to {}", count(sink.written, "scan"), sink.uri));
  for (const RecordingDamage& damage : done.damages) say(fmt::format("lost: {}", damage.reason));
  if (done.is_interrupted)
    say(fmt::format("interrupted: what was read of {} until then is written", arguments.scans));
}

nlohmann::json summarize(const Converted& done, const ConvertArguments& arguments) {
  nlohmann::json summary{{"input", arguments.scans},     {"outputs", arguments.outputs},
                         {"scans", done.scans},          {"messages", done.messages},
                         {"sinks", to_json(done.sinks)}, {"interrupted", done.is_interrupted}};
  summary["shaped"] = done.shaped;
  summary["lost"] = nlohmann::json::array();
  for (const RecordingDamage& damage : done.damages) summary["lost"].push_back(damage.reason);
  return summary;
}

// What a recording is copied to, message by message; the other outputs get its scans.
std::vector<SinkUri> take_copies(const ConvertArguments& arguments, std::vector<SinkUri>& outputs) {
  if (!is_recording(arguments.scans) || arguments.shape.options().is_any()) return {};
  const auto copies = std::stable_partition(
      outputs.begin(), outputs.end(), [](const SinkUri& uri) { return uri.scheme() != "mcap"; });
  std::vector<SinkUri> taken(copies, outputs.end());
  outputs.erase(copies, outputs.end());
  for (const SinkUri& uri : taken) uri.refuse_unused("none, where a recording is copied");
  return taken;
}

ExitCode convert(const ConvertArguments& arguments) {
  const Part part(arguments);
  std::vector<SinkUri> outputs = outputs_of(arguments);
  const std::vector<SinkUri> copies = take_copies(arguments, outputs);
  Converted done;
  std::optional<RecordingInfo> known;
  if (is_recording(arguments.scans)) {
    known = inspect(arguments.scans);
    if (stop_requested()) {
      done.is_interrupted = true;
      say(fmt::format("interrupted: nothing of {} is written", arguments.scans));
      if (arguments.json) print_json(summarize(done, arguments));
      return ExitCode::kFailed;
    }
    require_head(arguments.head, *known, arguments.scans);
    part.require_within(known->duration_s, arguments.scans);
    done.damages = known->damages;
    for (const SinkUri& uri : copies) copy_recording(arguments, part, *known, uri.path(), done);
  }
  if (!outputs.empty()) convert_scans(arguments, part, outputs, known, done);
  say_done(done, arguments, copies);
  if (arguments.json) print_json(summarize(done, arguments));
  if (done.has_moved) return ExitCode::kUntrustworthy;
  return done.is_interrupted ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_convert(Command& striper, Action& action) {
  add_command<ConvertArguments>(striper, action, "convert", kDescription, define, convert);
}

}  // namespace striper::program
