// SPDX-License-Identifier: Apache-2.0
// striper guide simulate: a drive along a road of a file, as a truck would record it, with the
// truth.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/whole_file.hpp>
#include <striper/guidance/guidance_csv.hpp>
#include <striper/road/road_drive.hpp>

#include "guide/guide_commands.hpp"
#include "guide/run_files.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

struct SimulateRoadArguments {
  std::string road;
  std::string output;
  bool json = false;
};

constexpr const char* kDescription =
    "Simulate a drive along a road: sweeps, odometer, and the truth of every centimetre.";

constexpr const char* kHelp =
    "ROAD.yaml says where the stripe goes, how worn it is, what else lies there, which truck "
    "drives\n"
    "and how; data/roads/README.md explains every key. The directory is a RUN for guide run, with\n"
    "truth.csv: distance_m,lateral_m,line0,line1 (0 or 1: paint that is there), a line a "
    "centimetre,\n"
    "and, where the road has a tape measure, tape.csv for guide align.\n\n"
    "Examples:\n"
    "  striper guide simulate data/roads/dashes.yaml -o run\n"
    "  striper guide run run -o job\n"
    "  striper guide evaluate job --truth run/truth.csv";

void define(Command& command, SimulateRoadArguments& arguments) {
  command.add_option("ROAD.yaml", arguments.road, "The road, see data/roads")->required();
  command
      .add_option("-o,--output", arguments.output,
                  "The directory; it is made, and must not hold a run")
      ->type_name("RUN")
      ->required();
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kHelp);
}

std::size_t most_samples(const GuidanceConfig& truck) {
  int most = 0;
  for (const GuidanceBeam& beam : truck.beams) most = std::max(most, beam.samples);
  return static_cast<std::size_t>(most);
}

std::uint64_t write_truth(const RoadDrive& drive, const fs::path& file) {
  constexpr double kStep_m = 0.01;
  CsvWriter<RoadTruth> truth(file.string(), road_truth_columns());
  std::uint64_t rows = 0;
  for (; static_cast<double>(rows) * kStep_m <= drive.way_m(); ++rows) {
    truth.add(drive.truth_at(static_cast<double>(rows) * kStep_m));
    if (rows % 1024 == 0) truth.flush();
  }
  truth.close();
  return rows;
}

// @return how many; without any there is no file.
std::size_t write_tape(const RoadDrive& drive, const fs::path& file) {
  const std::vector<TapeReading> readings = drive.tape_readings();
  if (readings.empty()) return 0;
  CsvWriter<TapeReading> tape(file.string(), tape_columns());
  for (const TapeReading& reading : readings) tape.add(reading);
  tape.close();
  return readings.size();
}

ExitCode guide_simulate(const SimulateRoadArguments& arguments) {
  const Road road = load_road(arguments.road);
  const fs::path output = arguments.output;
  make_run_directory(output);
  RoadDrive drive(road);
  SweepWriter sweeps((output / "sweeps.csv").string(), most_samples(road.truck));
  auto odometer = make_odometer_csv((output / "odometer.csv").string());
  BeamSweep sweep;
  OdometerReading reading;
  std::uint64_t written = 0;
  {
    Progress progress(
        "sweeps", static_cast<std::uint64_t>(drive.duration_s() * road.truck.beams.front().rate_hz *
                                             static_cast<double>(road.truck.beams.size())));
    while (!stop_requested()) {
      const RoadDrive::Next next = drive.next(sweep, reading);
      if (next == RoadDrive::Next::kEnd) break;
      if (next == RoadDrive::Next::kOdometer) {
        odometer.add(reading);
        continue;
      }
      sweeps.add(sweep);
      progress.update(++written);
      if (written % 256 == 0) odometer.flush();
    }
  }
  sweeps.close();
  odometer.close();
  const std::uint64_t rows = write_truth(drive, output / "truth.csv");
  const std::size_t readings = write_tape(drive, output / "tape.csv");
  write_file_atomically(output / "guidance.yaml", format_guidance(road.truck));
  say(fmt::format("simulated {:.1f} m in {:.1f} s: {}", drive.way_m(), drive.duration_s(),
                  count(written, "sweep")));
  say(fmt::format("wrote guidance.yaml, sweeps.csv, odometer.csv and truth.csv into {}",
                  arguments.output));
  if (readings > 0) {
    say(fmt::format("wrote tape.csv: {}; align: striper guide align {} -o aligned.yaml",
                    count(readings, "reading"), shell_word(arguments.output)));
  }
  say(fmt::format("guide: striper guide run {} -o job", shell_word(arguments.output)));
  if (arguments.json) {
    print_json({{"sweeps", written},
                {"way_m", drive.way_m()},
                {"duration_s", drive.duration_s()},
                {"truth_rows", rows},
                {"output", arguments.output},
                {"interrupted", stop_requested()}});
  }
  if (!stop_requested()) return ExitCode::kDone;
  say("interrupted: sweeps and odometer end there");
  return ExitCode::kFailed;
}

}  // namespace

void add_guide_simulate(Command& guide, Action& action) {
  add_command<SimulateRoadArguments>(guide, action, "simulate", kDescription, define,
                                     guide_simulate);
}

}  // namespace striper::program
