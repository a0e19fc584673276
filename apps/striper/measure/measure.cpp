// SPDX-License-Identifier: Apache-2.0
// striper measure: distances, steps, gaps and the like in scans, with error bars and limits.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/profile/measurement_csv.hpp>
#include <striper/profile/tools.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/stream/scan_bus.hpp>

#include "measure/measure_limits.hpp"
#include "measure/measure_plot.hpp"
#include "options/option_bounds.hpp"
#include "options/own_files.hpp"
#include "options/range_sigmas.hpp"
#include "program/plot_file.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct MeasureArguments {
  std::string scans;
  std::vector<std::string> tools;
  std::vector<std::string> limits;
  std::optional<std::string> model;
  std::optional<std::string> output;
  std::optional<std::string> plot;
  std::uint64_t frames = std::numeric_limits<std::uint64_t>::max();
  double sigma_m = kNoSigma_m;
  bool json = false;
};

constexpr const char* kDescription =
    "Measure in scans: distance, step, gap, flush, width, angle, circle, position, area; limits.";

constexpr const char* kHelp =
    "Tools (NAME is yours; a REGION is x=A..B,y=C..D, metres of the scan frame, x forward and y\n"
    "left; what is left out is open; without a REGION everything):\n"
    "  NAME:line[:R]           NAME.line.distance from the sensor's origin, NAME.line.angle of "
    "the\n"
    "                          normal, NAME.line.straightness (peak to valley of bows and waves)\n"
    "  NAME:step:R1;R2         how far the second surface lies beyond the first; + is away\n"
    "  NAME:gap:R1;R2          from the end of one surface to the next one's, along the first\n"
    "  NAME:flush:R1;R2        how far the second's near end lies beyond the first; + is away\n"
    "  NAME:width:R            of one surface, from end to end\n"
    "  NAME:angle:R1;R2        from the first's normal to the second's, counter-clockwise\n"
    "  NAME:circle:R           NAME.circle.radius, NAME.circle.x, NAME.circle.y\n"
    "  NAME:position:R1;R2     where the two lines meet: NAME.position.x, NAME.position.y\n"
    "  NAME:area:R1;R2         between the second's returns and the first's line; of one R "
    "between\n"
    "                          its returns and their chord; + is beyond\n"
    "One R where two are taken: its two largest straight pieces, in the order of the scan.\n\n"
    "Each scan gives a line for each row: "
    "frame,time_s,tool,value,sigma,sigma_cal,unit,points,status.\n"
    "sigma is the random error of this scan, and gets smaller by averaging; sigma_cal is the\n"
    "calibration's, alike in all scans, and does not; it needs a model with a covariance.\n"
    "An end of a surface is known to a column / sqrt(12): that part of the sigma of a width, a "
    "gap\n"
    "and a flush stays while the scene stands still. Noise alone makes a straightness of two to\n"
    "three of its sigmas.\n"
    "Where there is no value the status says why: no_line (not straight, or not a circle),\n"
    "few_points, ambiguous (several surfaces there, of similar size), outside (the end that is\n"
    "measured is not in the region or not in view).\n\n"
    "Examples:\n"
    "  striper measure scans.csv --tool weld:step:y=-0.1..0\\;y=0..0.1 -o measurements.csv\n"
    "  striper measure images:parts --model striper.yaml --tool 'g:gap:y=..0;y=0..'\n"
    "      --limit g.gap=0.002..0.004      a gap of 2 to 4 mm; exit code 1 where one was not\n"
    "  striper measure v4l2:/dev/video0 --model striper.yaml --tool wall:line --json\n"
    "      until Ctrl-C; the summary for programs\n\n"
    "Exit code 1 where a limit was broken, or what it is of could never be measured.";

void define(Command& command, MeasureArguments& arguments) {
  command
      .add_option("SCANS", arguments.scans,
                  "Scans: a recording (.csv, .jsonl, .mcap), or any source and --model")
      ->required();
  command.add_option("--tool", arguments.tools, "What to measure, and where; several times")
      ->type_name("NAME:TOOL[:REGION[;REGION]]")
      ->required()
      ->one_word_each();
  command
      .add_option("--limit", arguments.limits,
                  "What a row has to be: NAME.step=A..B; NAME alone where the tool has one row")
      ->type_name("NAME=A..B")
      ->one_word_each();
  command
      .add_option("-m,--model", arguments.model,
                  "The calibrated striper; for a source of frames, and for sigma_cal")
      ->type_name("FILE");
  command
      .add_option("-o,--output", arguments.output,
                  "Where the table goes; default: the standard output, with --json nowhere")
      ->type_name("FILE");
  command
      .add_option("--plot", arguments.plot,
                  "The first scan from above with its pieces and corners, and what was measured "
                  "over time")
      ->type_name("FILE.svg");
  command.add_option("--frames", arguments.frames, "Stop after so many scans")
      ->type_name("N")
      ->check(above_zero());
  add_sigma_option(command, arguments.sigma_m);
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kHelp);
}

// What one row came to over all scans.
struct RowSummary {
  std::string unit;
  std::uint64_t count = 0;
  double sum = 0.0;
  double squares = 0.0;  // About `first`, so that digits are kept.
  double first = 0.0;
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  double variance = 0.0;
  double sigma_cal = Measurement::kNone;
  std::map<std::string, std::uint64_t> status;

  void add(const Measurement& m) {
    unit = m.unit;
    ++status[std::string(to_string(m.status))];
    if (m.status != MeasureStatus::kOk) return;
    if (count++ == 0) first = m.value;
    sum += m.value - first;
    squares += (m.value - first) * (m.value - first);
    least = std::min(least, m.value);
    most = std::max(most, m.value);
    variance += m.sigma * m.sigma;
    sigma_cal = m.sigma_cal;
  }
  double mean() const { return first + sum / static_cast<double>(count); }
  double deviation() const {
    const auto n = static_cast<double>(count);
    return count > 1 ? std::sqrt(std::max(squares - sum * sum / n, 0.0) / (n - 1.0))
                     : Measurement::kNone;
  }
  double sigma() const { return std::sqrt(variance / static_cast<double>(count)); }
};

nlohmann::json number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value;
}

nlohmann::json json_of(const RowSummary& row) {
  nlohmann::json json{{"unit", row.unit}, {"count", row.count}, {"status", row.status}};
  const bool is_any = row.count > 0;
  json["mean"] = number(is_any ? row.mean() : NAN);
  json["sd"] = number(row.deviation());
  json["min"] = number(row.least);
  json["max"] = number(row.most);
  json["sigma"] = number(is_any ? row.sigma() : NAN);
  json["sigma_cal"] = number(row.sigma_cal);
  return json;
}

// What all scans came to; outlives the sink, which is the bus's.
struct MeasureResult {
  MeasureLimits limits;
  RangeSigmas sigmas;
  std::uint64_t scans = 0;
  std::map<std::string, RowSummary> rows;
  std::optional<MeasurePlot> plot;  // Where one is asked for.
};

/// Measures every scan of a bus, on the bus's thread of this sink.
class MeasureSink : public ScanSink {
 public:
  using ScanSink::write;

  MeasureSink(const MeasureArguments& arguments, std::shared_ptr<MeasureResult> result,
              EventPort events)
      : scans_(arguments.scans),
        output_(arguments.output.value_or("-")),
        is_table_(arguments.output || !arguments.json),
        result_(std::move(result)),
        events_(std::move(events)) {
    for (const std::string& text : arguments.tools) tools_.push_back(parse_measure_tool(text));
    const std::vector<std::string> rows = Measurer(tools_).rows();  // Refuses names that are twice.
    result_->limits.require_rows(rows);
  }

  void open(const HeadInfo& head) override {
    model_ = head.model;
    measurer_.emplace(tools_, model_);
  }

  void write(const PolarScan& scan) override {
    scan_ = scan;
    result_->sigmas.complete(scan_);
    result_->sigmas.require_any(scans_);
    if (is_table_ && !table_) table_.emplace(output_, measurement_columns());
    if (result_->plot) result_->plot->add(scan_, model_.get());
    for (const Measurement& m : measurer_->measure(scan_)) {
      if (result_->plot) result_->plot->add(m, scan.sequence);
      result_->rows[m.tool].add(m);
      result_->limits.look_at(m, scan.sequence, events_);
      if (table_) table_->add({scan.sequence, scan.time.seconds(), m});
    }
    if (table_) table_->flush();
    ++result_->scans;
  }

  void finish() override {
    if (table_) table_->close();
  }

 private:
  std::string scans_;
  std::string output_;
  bool is_table_;  // Begun with the first scan.
  std::shared_ptr<MeasureResult> result_;
  EventPort events_;
  std::vector<MeasureTool> tools_;
  std::shared_ptr<const StriperModel> model_;
  std::optional<Measurer> measurer_;
  std::optional<CsvWriter<MeasurementLine>> table_;
  PolarScan scan_;
};

// Gives all scans of a source to a bus.
void pour(ScanSource& source, std::uint64_t most, ScanBus& bus) {
  Progress progress("scans", std::nullopt);
  bus.open(source.info());
  for (std::uint64_t scans = 0; scans < most && !stop_requested() && bus.is_any_open();) {
    auto scan = std::make_shared<PolarScan>();
    const NextStatus status = source.next(*scan, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) break;
    bus.write(std::shared_ptr<const PolarScan>(std::move(scan)));
    progress.update(++scans);
  }
}

void say_rows(const std::map<std::string, RowSummary>& rows) {
  for (const auto& [name, row] : rows) {
    std::string text = fmt::format("{:24}", name);
    if (row.count > 0) {
      text += fmt::format(" {:.6g} {} +- {:.2g} a scan", row.mean(), row.unit, row.sigma());
      if (std::isfinite(row.sigma_cal))
        text += fmt::format(", +- {:.2g} by the calibration", row.sigma_cal);
      if (row.count > 1) text += fmt::format("; deviation {:.2g}", row.deviation());
      text += ";";
    }
    for (const auto& [status, number] : row.status) text += fmt::format(" {} {}", number, status);
    say(text);
  }
}

nlohmann::json summary_of(const MeasureResult& result, const TerminalEvents& events) {
  nlohmann::json json{{"scans", result.scans},
                      {"limits", result.limits.to_json()},
                      {"kept", result.limits.are_kept()},
                      {"events", to_json(events.heard())}};
  json["tools"] = nlohmann::json::object();
  for (const auto& [name, row] : result.rows) json["tools"][name] = json_of(row);
  return json;
}

void require_outputs(const MeasureArguments& arguments) {
  std::vector<std::string> read{SourceUri::parse(arguments.scans).path()};
  if (arguments.model) read.push_back(*arguments.model);
  std::vector<std::string> written;
  for (const auto& file : {arguments.output, arguments.plot})
    if (file) written.push_back(*file);
  require_own_files(read, written);
  if (arguments.output) require_replaceable_table(*arguments.output, measurement_columns());
  require_plot_file("--plot", arguments.plot);
}

ExitCode measure(const MeasureArguments& arguments) {
  const TerminalEvents events({"sink_failed"});  // The error says all.
  const auto result = std::make_shared<MeasureResult>(
      MeasureResult{MeasureLimits(arguments.limits), RangeSigmas(arguments.sigma_m), 0, {}, {}});
  if (arguments.plot) result->plot.emplace();
  require_outputs(arguments);
  std::shared_ptr<const StriperModel> model;
  if (arguments.model)
    model = std::make_shared<StriperModel>(load_model(*arguments.model, events.port()));
  const auto source = open_scans(arguments.scans, model, std::nullopt, events.port());
  // Behind all that can fail: it empties the table of before.
  auto sink = std::make_unique<MeasureSink>(arguments, result, events.port());
  ScanBus bus(events.port());
  bus.add("measure", std::move(sink));
  pour(*source, arguments.frames, bus);
  say_loss(*source);
  bus.finish();
  if (bus.failure()) std::rethrow_exception(bus.failure());
  if (result->scans == 0)
    throw Error(ErrorKind::kBadFile, fmt::format("{} has no scans", arguments.scans));
  say(fmt::format("measured {}", count(result->scans, "scan")));
  say_rows(result->rows);
  for (const std::string& line : result->limits.verdicts()) say(line);
  if (arguments.plot) write_plot_file(*arguments.plot, result->plot->svg());
  if (arguments.json) print_json(summary_of(*result, events));
  return result->limits.are_kept() ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_measure(Command& striper, Action& action) {
  add_command<MeasureArguments>(striper, action, "measure", kDescription, define, measure);
}

}  // namespace striper::program
