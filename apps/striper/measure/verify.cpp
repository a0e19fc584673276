// SPDX-License-Identifier: Apache-2.0
// striper verify: scans a flat target and holds what is measured against what the model promises.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>

#include "measure/flat_target.hpp"
#include "measure/known_target.hpp"
#include "measure/verify_sheet.hpp"
#include "options/scanner_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/frame_loop.hpp"
#include "run/stripe_watch.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct VerifyArguments {
  std::string source;
  ScannerArguments scanner;
  FrameLimits limits;
  FlatCriteria flat;
  std::vector<std::string> at;
  std::optional<double> step_m;
  std::optional<double> radius_m;
  bool json = false;
};

constexpr const char* kDescription =
    "Check a striper on a flat target: flatness against the error bars, fill, temporal noise, "
    "bias.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper verify v4l2:/dev/video0 --model striper.yaml --frames 50\n"
    "      a flat wall across the whole field of view\n"
    "  striper verify images:wall --model striper.yaml --distance 1.500\n"
    "      the wall is 1.500 m from the scan origin, measured square to it\n"
    "  striper verify images:a --model striper.yaml --distance 1 --at 1.5=images:b --at "
    "2=images:c\n"
    "      and how straight measured distances run along with known ones\n"
    "  striper verify images:block --model striper.yaml --step 0.020\n\n"
    "A sheet as of a laser profiler comes first: clearance, measuring range and field of view (of\n"
    "the model), spacing, z resolution, repeatability of the mean, rate, latency, with counts.\n"
    "Flatness: rms of the returns about a straight line, and the same over each return's own\n"
    "sigma (1 where the error bars are right). Temporal noise: mean change of a column's stripe\n"
    "between successive scans, px. Exit code 0 passed, 1 failed.";

void define(Command& command, VerifyArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command.get_option("--model")->required()->description(
      "The calibrated striper to check (striper.yaml)");
  add_frame_limits(command, arguments.limits);
  auto* const distance =
      command
          .add_option("--distance", arguments.flat.distance_m,
                      "True distance of the target from the scan origin, square to it, metres")
          ->type_name("M")
          ->check(above_zero());
  auto* const fill =
      command
          .add_option("--min-fill", arguments.flat.least_fill,
                      fmt::format("Least part of the scan lines with a return; default {}",
                                  arguments.flat.least_fill))
          ->type_name("PART");
  auto* const ratio = command
                          .add_option("--max-ratio", arguments.flat.most_ratio,
                                      fmt::format("Most scatter, in predicted sigmas; default {}",
                                                  arguments.flat.most_ratio))
                          ->type_name("RATIO")
                          ->check(above_zero());
  command
      .add_option("--at", arguments.at,
                  "The same target at another known distance, in frames of its own, held against "
                  "it as --distance is; needs --distance and two of these: linearity")
      ->type_name("M=SOURCE")
      ->one_word_each();
  auto* const step = command
                         .add_option("--step", arguments.step_m,
                                     "The target is a step of so many metres (surfaces alongside)")
                         ->type_name("M")
                         ->check(above_zero());
  auto* const radius =
      command
          .add_option("--radius", arguments.radius_m,
                      "The target is a cylinder of so many metres' radius; nothing else in view")
          ->type_name("M")
          ->check(above_zero())
          ->excludes(step);
  for (auto* const target : {step, radius})
    target->excludes(distance)->excludes(fill)->excludes(ratio);  // Of a flat target.
  command.add_flag("--json", arguments.json, "The figures for programs");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

// Scans a source as the options say. `on_scans` also hears how long they took.
FrameReport scan_all(const VerifyArguments& arguments, const std::string& uri,
                     const EventPort& events,
                     const std::function<void(ScanSpan, double)>& on_scans) {
  using Clock = std::chrono::steady_clock;
  auto source = open_source(uri, events);
  const ScannerSetup setup = scanner_setup(arguments.scanner, source->info(), events);
  Scanner scanner = make_scanner(setup);
  StripeWatch watch(arguments.scanner, setup);
  const FrameReport read = read_frames(*source, arguments.limits, events, [&](const Frame& frame) {
    watch.keep(frame);
    const Clock::time_point start = Clock::now();
    const ScanSpan scans = scanner.process(frame);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    watch.look_at(scans);
    on_scans(scans, seconds);
  });
  const ScanSpan rest = scanner.finish();
  watch.look_at(rest);
  on_scans(rest, 0.0);
  watch.conclude();
  let_go(std::move(source), read);
  return read;
}

// `M=SOURCE`
std::pair<double, std::string> distance_and_source(const std::string& text) {
  const std::size_t equals = text.find('=');
  char* end = nullptr;
  const double known_m = std::strtod(text.c_str(), &end);
  if (equals == std::string::npos || end != text.c_str() + equals || !(known_m > 0.0))
    throw Error(ErrorKind::kUsage, fmt::format("--at {}: expected M=SOURCE", text));
  return {known_m, text.substr(equals + 1)};
}

// Three distances are the fewest that can be off a straight line, and each is another.
void require_distances(const VerifyArguments& arguments) {
  std::set<double> known;
  if (arguments.flat.distance_m) known.insert(*arguments.flat.distance_m);
  for (const std::string& text : arguments.at) {
    if (!known.insert(distance_and_source(text).first).second) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("--at {}: expected a distance that no other target has", text));
    }
  }
  if (arguments.at.empty() || (arguments.flat.distance_m && arguments.at.size() > 1)) return;
  throw Error(ErrorKind::kUsage,
              "--at: expected --distance and two of these at least: linearity is of three");
}

// All distances of which both is known: what they are and what they measure.
struct Distances {
  std::vector<KnownDistance> known;
  std::vector<std::string> failures;  // Of those in frames of their own.
};

Distances known_distances(const VerifyArguments& arguments, const FlatTarget& main,
                          const EventPort& events) {
  Distances distances;
  if (arguments.flat.distance_m)
    distances.known.push_back({*arguments.flat.distance_m, main.mean_distance_m()});
  for (const std::string& text : arguments.at) {
    const auto [known_m, uri] = distance_and_source(text);
    FlatTarget there;
    scan_all(arguments, uri, events, [&](ScanSpan scans, double) {
      for (const PolarScan& scan : scans) there.add(scan);
    });
    distances.known.push_back({known_m, there.mean_distance_m()});
    FlatCriteria criteria = arguments.flat;
    criteria.distance_m = known_m;
    for (const std::string& failure : there.failures(criteria))
      distances.failures.push_back(fmt::format("at {:g} m {}", known_m, failure));
  }
  return distances;
}

nlohmann::json say_linearity(const std::vector<KnownDistance>& distances) {
  constexpr std::size_t kFewest = 3;
  if (distances.size() < kFewest) return nullptr;
  const Linearity found = linearity(distances);
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  nlohmann::json errors = nlohmann::json::array();
  for (const KnownDistance& one : distances) {
    least = std::min(least, one.known_m);
    most = std::max(most, one.known_m);
    errors.push_back({{"known_m", one.known_m}, {"measured_m", one.measured_m}});
  }
  say(
      fmt::format("z linearity: {:.3f} mm, {:.3f} % of the {:.3f} m between them (largest error of "
                  "{} distances beside the best straight line; gain {:.5f}, offset {:+.3f} mm)",
                  1e3 * found.most_m, 100.0 * found.most_m / (most - least), most - least,
                  distances.size(), found.gain, 1e3 * found.offset_m));
  return {{"most_m", found.most_m},
          {"gain", found.gain},
          {"offset_m", found.offset_m},
          {"distances", errors}};
}

// The step or the cylinder that the target is, if it is one.
std::optional<KnownTarget> known_target(const VerifyArguments& arguments,
                                        const std::shared_ptr<const StriperModel>& model) {
  if (arguments.step_m) return KnownTarget(KnownTarget::Kind::kStep, *arguments.step_m, model);
  if (arguments.radius_m)
    return KnownTarget(KnownTarget::Kind::kCylinder, *arguments.radius_m, model);
  return std::nullopt;
}

std::string verdict_of(const std::vector<std::string>& failures) {
  return failures.empty() ? "passed" : fmt::format("failed: {}", fmt::join(failures, "; "));
}

ExitCode verify(const VerifyArguments& arguments) {
  if (!(arguments.flat.least_fill >= 0.0 && arguments.flat.least_fill <= 1.0)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--min-fill {}: expected a part, 0 to 1", arguments.flat.least_fill));
  }
  require_distances(arguments);
  const TerminalEvents events({"no_stripe", "stripe_seen"});  // StripeWatch says more.
  const auto model = std::make_shared<const StriperModel>(load_model(*arguments.scanner.model));
  FlatTarget flat;
  VerifySheet sheet;
  std::optional<KnownTarget> target = known_target(arguments, model);
  const FrameReport read =
      scan_all(arguments, arguments.source, events.port(), [&](ScanSpan scans, double seconds) {
        if (seconds > 0.0) sheet.took(seconds);
        for (const PolarScan& scan : scans) {
          flat.add(scan);
          sheet.add(scan);
          if (target) target->add(scan);
        }
      });
  const double rate_hz =
      read.elapsed_s > 0.0 ? static_cast<double>(read.pictures) / read.elapsed_s : NAN;
  const nlohmann::json figures =
      sheet.to_json(measuring_range(*model, 0), rate_hz, flat.distances_m());
  for (const std::string& line : sheet_lines(figures)) say(line);
  const Distances distances = known_distances(arguments, flat, events.port());
  const nlohmann::json of_distances = say_linearity(distances.known);
  std::vector<std::string> failures = target ? target->failures() : flat.failures(arguments.flat);
  failures.insert(failures.end(), distances.failures.begin(), distances.failures.end());
  if (read.is_lost) failures.emplace_back("the source was lost before the end");
  if (target)
    say(target->line());
  else
    flat.say_result(arguments.flat);
  say(verdict_of(failures));
  if (arguments.json) {
    nlohmann::json json = target ? nlohmann::json::object() : flat.to_json(arguments.flat);
    json["sheet"] = figures;
    json["linearity"] = of_distances;
    json["target"] = nullptr;
    if (target) json["target"] = target->to_json();
    json["passed"] = failures.empty();
    json["failures"] = failures;
    print_json(json);
  }
  return failures.empty() ? ExitCode::kDone : ExitCode::kFailed;
}

}  // namespace

void add_verify(Command& striper, Action& action) {
  add_command<VerifyArguments>(striper, action, "verify", kDescription, define, verify);
}

}  // namespace striper::program
