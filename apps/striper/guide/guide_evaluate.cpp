// SPDX-License-Identifier: Apache-2.0
// striper guide evaluate: what guidance said against what is true, in the form of the 1991 report.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/units.hpp>
#include <striper/guidance/dash_errors.hpp>
#include <striper/guidance/guidance_errors.hpp>

#include "guide/guide_commands.hpp"
#include "options/option_bounds.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
  std::string job;
  std::string truth;
  double from_m = 0.0;
  double end_extension_m = 0.0;
  int line = 0;
  bool json = false;
};

constexpr const char* kDescription =
    "Hold a job against the truth: lateral error every 50 ft, ends of dashes as in Table 1.";

constexpr const char* kHelp =
    "The first table is of lateral.csv, where there is paint under the gun: rows, mean, rms and\n"
    "largest error, the share within half an inch, and rms of error over sigma. The second is "
    "Table "
    "1\n"
    "of the 1991 report: each end of a dash, where the gun was switched for it, and lengths.\n"
    "Gun delays and advances must be 0 in the run, else they are in the second table.\n\n"
    "Examples:\n"
    "  striper guide evaluate job --truth run/truth.csv\n"
    "  striper guide evaluate job --truth run/truth.csv --from 25 --json";

void define(Command& command, EvaluateArguments& arguments) {
  command.add_option("DIR", arguments.job, "What guide run has written")->required();
  command.add_option("--truth", arguments.truth, "truth.csv: distance_m,lateral_m,line0,line1")
      ->type_name("FILE")
      ->required();
  command.add_option("--from", arguments.from_m, "Count from this distance on, metres; default 0")
      ->type_name("M")
      ->check(at_least(0.0));
  command
      .add_option("--end-extension", arguments.end_extension_m,
                  "Take dashes for longer by this at either end, metres; the report: 0.0508")
      ->type_name("M")
      ->check(between(0.0, 1.0));
  command.add_option("--line", arguments.line, "Whose ends: line 0 or 1; default 0")
      ->type_name("N")
      ->check(between(0, 1));
  command.add_flag("--json", arguments.json, "The figures for programs on the standard output");
  command.footer(kHelp);
}

template <typename Row>
std::vector<Row> read_all(const fs::path& file, std::span<const CsvColumn<Row>> columns,
                          std::string_view what) {
  CsvReader<Row> reader(CsvInput::open(file), columns, what);
  std::vector<Row> rows;
  for (Row row; reader.next(row);) rows.push_back(row);
  return rows;
}

nlohmann::json number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

nlohmann::json json_of(const LateralErrors& errors) {
  return {{"from_m", errors.from_m},
          {"to_m", errors.to_m},
          {"rows", errors.rows},
          {"unknown", errors.unknown},
          {"mean_m", number(errors.mean_m)},
          {"rms_m", number(errors.rms_m)},
          {"largest_m", number(errors.largest_m)},
          {"within_half_inch", number(errors.within)},
          {"pull", number(errors.pull)}};
}

// Ends that were met, as the report counts them.
struct Table1 {
  std::vector<double> measured_m;
  std::vector<double> found_m;
  DashErrors counts;
  std::size_t missed = 0;
};

Table1 table_1(const GuidanceErrors& errors, double end_extension_m) {
  Table1 table;
  for (const DashEndError& end : errors.ends) {
    if (std::isnan(end.found_m)) {
      ++table.missed;
      continue;
    }
    table.measured_m.push_back(end.true_m);
    table.found_m.push_back(end.found_m);
  }
  DashErrorOptions options;
  options.end_extension_m = end_extension_m;
  options.first_is_begin = errors.ends.empty() || errors.ends.front().is_begin;
  table.counts = dash_errors(table.measured_m, table.found_m, options);
  return table;
}

// What there is none of (before the first end, or where none was found) is a dash.
std::string cell(double value, int width, int digits) {
  if (std::isnan(value)) return fmt::format("{:>{}}", "-", width);
  return fmt::format("{:{}.{}f}", value, width, digits);
}

void print_lateral(const GuidanceErrors& errors) {
  fmt::print("from_m   to_m   rows  mean_in  rms_in  largest_in  within .5 in  pull\n");
  const auto row = [](const LateralErrors& one) {
    if (one.rows == 0) return;
    fmt::print("{:6.1f} {:6.1f} {:6d} {:8.3f} {:7.3f} {:11.3f} {:11.2f} % {}\n", one.from_m,
               one.to_m, one.rows, one.mean_m / kInch_m, one.rms_m / kInch_m,
               one.largest_m / kInch_m, 100.0 * one.within, cell(one.pull, 5, 2));
  };
  for (const LateralErrors& one : errors.stretches) row(one);
  fmt::print("all\n");
  row(errors.all);
}

void print_ends(const GuidanceErrors& errors, const Table1& table) {
  if (errors.ends.empty()) return;
  fmt::print("\nend     measured_m  found_m  difference_in  length_m  found_m  difference_in\n");
  double last_true_m = std::nan("");
  double last_found_m = std::nan("");
  for (const DashEndError& end : errors.ends) {
    const double true_length_m = end.true_m - last_true_m;
    const double found_length_m = end.found_m - last_found_m;
    fmt::print("{:6} {} {} {} {} {} {}\n", end.is_begin ? "begin" : "end", cell(end.true_m, 11, 3),
               cell(end.found_m, 8, 3), cell(-end.error_m() / kInch_m, 14, 2),
               cell(true_length_m, 9, 3), cell(found_length_m, 8, 3),
               cell((true_length_m - found_length_m) / kInch_m, 14, 2));
    last_true_m = end.true_m;
    last_found_m = end.found_m;
  }
  fmt::print("ends within 4 in: {} of {}; lengths within 8 in: {} of {}; missed {}, invented {}\n",
             table.counts.ends_within, table.counts.ends, table.counts.lengths_within,
             table.counts.lengths, table.missed, errors.invented);
}

ExitCode guide_evaluate(const EvaluateArguments& arguments) {
  const fs::path job = arguments.job;
  const auto lateral =
      read_all(job / "lateral.csv", lateral_columns(), "table of lateral positions");
  std::vector<GunLine> guns = read_all(job / "guns.csv", gun_columns(), "table of guns");
  const auto truth = read_all(arguments.truth, road_truth_columns(), "table of truth");
  if (!guns.empty()) {
    // Of several guns, the first: delays and advances tell them apart, their dashes do not.
    std::erase_if(guns,
                  [name = guns.front().gun](const GunLine& line) { return line.gun != name; });
  }
  GuidanceErrorOptions options;
  options.from_m = arguments.from_m;
  options.line = arguments.line;
  const GuidanceErrors errors = guidance_errors(lateral, guns, truth, options);
  if (errors.all.rows + errors.all.unknown == 0) {
    throw Error(ErrorKind::kBadFile,
                fmt::format("{} and {} have no scan in common{}", arguments.job, arguments.truth,
                            arguments.from_m > 0.0 ? fmt::format(" from {} m on", arguments.from_m)
                                                   : std::string()));
  }
  const Table1 table = table_1(errors, arguments.end_extension_m);
  if (!arguments.json) {
    print_lateral(errors);
    print_ends(errors, table);
    return ExitCode::kDone;
  }
  nlohmann::json json{{"lateral", json_of(errors.all)},
                      {"stretches", nlohmann::json::array()},
                      {"ends",
                       {{"true", errors.ends.size()},
                        {"missed", table.missed},
                        {"invented", errors.invented},
                        {"counted", table.counts.ends},
                        {"within_4_in", table.counts.ends_within},
                        {"lengths", table.counts.lengths},
                        {"lengths_within_8_in", table.counts.lengths_within}}}};
  for (const LateralErrors& one : errors.stretches) json["stretches"].push_back(json_of(one));
  print_json(json);
  return ExitCode::kDone;
}

}  // namespace

void add_guide_evaluate(Command& guide, Action& action) {
  add_command<EvaluateArguments>(guide, action, "evaluate", kDescription, define, guide_evaluate);
}

}  // namespace striper::program
