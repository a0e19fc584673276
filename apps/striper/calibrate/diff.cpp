// SPDX-License-Identifier: Apache-2.0
// striper diff: where and by how much two models of a striper differ.
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/report/model_diff.hpp>

#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct DiffArguments {
  std::string first;
  std::string second;
  int laser = 0;
  double farthest_m = 10.0;
  bool json = false;
};

constexpr const char* kDescription =
    "Compare two models: where in the image, and by how many millimetres, they differ.";

constexpr const char* kExamples =
    "Example:\n"
    "  striper diff march.yaml may.yaml\n"
    "      has the striper drifted since March?\n\n"
    "Exit code 1 where the models differ by more than twice what their own error bars explain.";

void define(Command& command, DiffArguments& arguments) {
  command.add_option("A", arguments.first, "The first model")->required();
  command.add_option("B", arguments.second, "The second model")->required();
  command.add_option("--laser", arguments.laser, "Which laser")->capture_default_str();
  command.add_option("--max-range", arguments.farthest_m, "Leave out what is farther, metres")
      ->check(above_zero())
      ->capture_default_str();
  command.add_flag("--json", arguments.json, "The differences for programs");
  command.footer(kExamples);
}

void say_difference(const ModelDifference& difference) {
  if (difference.rms_m == 0.0) {
    say(fmt::format("both models give the same range at all {} places of the image",
                    difference.pixels.size()));
    return;
  }
  say(fmt::format("range differs by {:.2f} mm rms over {} places of the image",
                  1e3 * difference.rms_m, difference.pixels.size()));
  say(fmt::format("most at pixel ({:.0f}, {:.0f}): {:+.2f} mm at {:.2f} m",
                  difference.worst.pixel.x(), difference.worst.pixel.y(),
                  1e3 * difference.worst.difference_m, difference.worst.range_m));
  for (const double range_m : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    double sum = 0.0;
    int count = 0;
    for (const PixelDifference& at : difference.pixels)
      if (at.range_m > 0.7 * range_m && at.range_m <= 1.4 * range_m)
        sum += at.difference_m * at.difference_m, ++count;
    if (count > 0)
      say(fmt::format("  about {:g} m: {:.2f} mm rms", range_m, 1e3 * std::sqrt(sum / count)));
  }
  if (std::isnan(difference.rms_sigmas))
    say("the models carry no covariance (or one of them): whether that is much is open");
  else
    say(fmt::format("that is {:.2f} times what their error bars explain", difference.rms_sigmas));
}

nlohmann::json to_json(const ModelDifference& difference) {
  nlohmann::json json;
  json["rms_m"] = difference.rms_m;
  json["worst_m"] = difference.worst_m;
  json["rms_sigmas"] = difference.rms_sigmas;
  for (const PixelDifference& at : difference.pixels)
    json["pixels"].push_back({{"u_px", at.pixel.x()},
                              {"v_px", at.pixel.y()},
                              {"range_m", at.range_m},
                              {"difference_m", at.difference_m},
                              {"sigma_m", at.sigma_m}});
  return json;
}

ExitCode compare(const DiffArguments& arguments) {
  const EventPort events = TerminalEvents().port();
  const ModelDifference difference =
      compare_models(load_model(arguments.first, events), load_model(arguments.second, events),
                     arguments.laser, arguments.farthest_m);
  if (difference.pixels.empty())
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("no pixel has a range within {:g} m in both models", arguments.farthest_m));
  say_difference(difference);
  if (arguments.json) print_json(to_json(difference));
  return difference.rms_sigmas > 2.0 ? ExitCode::kFailed : ExitCode::kDone;
}

}  // namespace

void add_diff(Command& striper, Action& action) {
  add_command<DiffArguments>(striper, action, "diff", kDescription, define, compare);
}

}  // namespace striper::program
