// SPDX-License-Identifier: Apache-2.0
// striper simulate: frames, the perfect model and the truth of a scene, as files.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/source_uri.hpp>
#include <striper/images/recorder.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/simulator/ideal_look.hpp>
#include <striper/simulator/simulated_source.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"
#include "run/frame_loop.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kDefaultFrames = 10;

struct SimulateArguments {
  std::string scene;
  std::string directory;
  std::uint64_t frames = kDefaultFrames;
  bool json = false;
};

constexpr const char* kDescription =
    "Simulate: images of a scene as the striper would see it, with the truth of every column.";

constexpr const char* kExamples =
    "SCENE is a file (see data/scenes), with the keys of a sim: source where wanted:\n"
    "  ?noise=off  ?seed=7  ?fps=30  ?laser=0,dark  ?fields=split-top\n\n"
    "Examples:\n"
    "  striper simulate data/scenes/room.yaml -o room --frames 20\n"
    "  striper simulate 'data/scenes/wall.yaml?noise=off' -o wall\n"
    "  striper capture images:room --model room/model.yaml -o scans.csv\n"
    "      scan what was simulated; compare with room/truth.csv\n\n"
    "The directory gets the images with frames.csv (a recording: images:DIR), model.yaml, the\n"
    "calibration without error (what the stripe looks like, at the ranges of these images), and\n"
    "truth.csv: the columns of a scan with exact values, a line "
    "for\n"
    "every column of every lit exposure.";

void define(Command& command, SimulateArguments& arguments) {
  command.add_option("SCENE", arguments.scene, "The scene file, see below")->required();
  command
      .add_option("-o,--output", arguments.directory,
                  "The directory; it is made, and must not hold image files already")
      ->type_name("DIR")
      ->required();
  command
      .add_option("--frames", arguments.frames,
                  fmt::format("How many frames; default {}", kDefaultFrames))
      ->type_name("N")
      ->check(above_zero());
  command.add_flag("--json", arguments.json, "A summary for programs on the standard output");
  command.footer(kExamples);
}

ReturnStatus status_of(TruthStatus status) {
  switch (status) {
    case TruthStatus::kVisible:
      return ReturnStatus::kOk;
    case TruthStatus::kOutsideModel:
      return ReturnStatus::kOutsideModel;
    case TruthStatus::kNoSurface:
    case TruthStatus::kShadowed:
    case TruthStatus::kOutsideFan:
      return ReturnStatus::kNoStripe;
  }
  return ReturnStatus::kNoStripe;
}

// The exact values under the names of a scan's; error bars and confidence, of which truth has none,
// stay empty.
Return to_return(const TrueLine& line) {
  const TrueReturn& truth = line.brightest;
  Return result;
  result.status = status_of(line.status);
  result.u_px = truth.u_px;
  result.v_px = truth.v_px;
  if (verdict(result.status) == Verdict::kMissing) return result;
  result.bearing_rad = truth.bearing_rad;
  result.range_m = truth.range_m;
  result.x_m = truth.x_m;
  result.y_m = truth.y_m;
  result.intensity_dn = static_cast<float>(truth.amplitude_dn);
  result.width_px = static_cast<float>(truth.width_px);
  return result;
}

PolarScan to_scan(const Truth& truth) {
  PolarScan scan;
  scan.sequence = truth.sequence;
  scan.time.monotonic_ns = std::llround(truth.time_s * 1e9);
  scan.laser = truth.laser;
  scan.field = truth.field;
  scan.axis = truth.axis;
  scan.returns.reserve(truth.lines.size());
  for (const TrueLine& line : truth.lines) scan.returns.push_back(to_return(line));
  return scan;
}

// How near and how far the lasers were seen, which is what a calibration of these images would
// know the stripe over.
class SeenRanges {
 public:
  void add(const Truth& truth) {
    const auto laser = static_cast<std::size_t>(truth.laser);
    if (ranges_m_.size() <= laser) ranges_m_.resize(laser + 1, {HUGE_VAL, 0.0});
    auto& [nearest_m, farthest_m] = ranges_m_[laser];
    for (const TrueLine& line : truth.lines) {
      if (line.status != TruthStatus::kVisible) continue;
      nearest_m = std::min(nearest_m, line.brightest.range_m);
      farthest_m = std::max(farthest_m, line.brightest.range_m);
    }
  }

  /// The model, the looks of its lasers between those ranges.
  StriperModel narrowed(const Simulator& simulator) const {
    // A range is not known so well that its own error may not take it over the end.
    constexpr double kMargin = 1.1;
    StriperModel model = simulator.model();
    for (std::size_t i = 0; i < std::min(ranges_m_.size(), model.lasers.size()); ++i) {
      const auto [nearest_m, farthest_m] = ranges_m_[i];
      if (!(farthest_m > 0.0)) continue;
      model.lasers[i].look = ideal_look(simulator.scene(), static_cast<int>(i), nearest_m / kMargin,
                                        farthest_m * kMargin);
    }
    return model;
  }

 private:
  std::vector<std::pair<double, double>> ranges_m_;  // Per laser.
};

// Accepts a path as well as a whole address.
SourceUri scene_uri(const std::string& scene) {
  return SourceUri::parse(scene.starts_with("sim:") ? scene : "sim:" + scene);
}

ExitCode simulate(const SimulateArguments& arguments) {
  const auto source = SimulatedSource::open(scene_uri(arguments.scene));
  const fs::path directory = arguments.directory;
  Recorder recorder(directory, source->info());
  save_model(source->simulator().model(), directory / "model.yaml");
  SeenRanges seen;
  CsvSink truth_file((directory / "truth.csv").string(), {.doubtful = true, .missing = true});

  const FrameReport result = read_frames(
      *source, {.pictures = arguments.frames, .seconds = {}}, {}, [&](const Frame& frame) {
        recorder.write(frame);
        if (frame.exposure_in_picture > 0) return;  // The truth of both fields is written already.
        for (const Truth& truth : source->simulator().truth(frame.sequence)) {
          truth_file.write(to_scan(truth));
          seen.add(truth);
        }
      });
  truth_file.close();
  save_model(seen.narrowed(source->simulator()), directory / "model.yaml");

  say(fmt::format("simulated {}", describe(result)));
  say(fmt::format("wrote them, frames.csv, model.yaml and truth.csv into {}", arguments.directory));
  say(fmt::format("scan it: striper capture {} --model {}",
                  shell_word("images:" + arguments.directory),
                  shell_word((directory / "model.yaml").string())));
  if (arguments.json) {
    nlohmann::json summary = to_json(result);
    summary["output"] = arguments.directory;
    summary["truth_lines"] = truth_file.lines();
    print_json(summary);
  }
  return ExitCode::kDone;
}

}  // namespace

void add_simulate(Command& striper, Action& action) {
  add_command<SimulateArguments>(striper, action, "simulate", kDescription, define, simulate);
}

}  // namespace striper::program
