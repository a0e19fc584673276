// SPDX-License-Identifier: Apache-2.0
// striper why: why a scan line gave the return that it gave.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/pipeline/scan_explanation.hpp>

#include "camera/why_json.hpp"
#include "options/scanner_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "run/frame_loop.hpp"
#include "run/summary.hpp"

namespace striper::program {
namespace {

struct WhyArguments {
  std::string source;
  ScannerArguments scanner;
  int line = 0;
  std::optional<std::uint64_t> frame;
  bool json = false;
};

constexpr const char* kDescription =
    "Why: what is in a scan line, what was taken for the stripe, and how sure that is.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper why images:shots --model striper.yaml --line 320\n"
    "      column 320 of the first frame that gives a scan: its candidates, what became of "
    "each,\n"
    "      the position's error by cause, and what a pixel means in millimetres there\n"
    "  striper why images:shots --model striper.yaml --line 320 --frame 17 --json\n"
    "      the same of frame 17, with the line's pixels, for programs\n\n"
    "A scan line is a column of the image, or a row with --axis rows. What became of a candidate:\n"
    "chosen, less_probable (another one of the line is more probably the stripe), outside (where\n"
    "the model has no stripe) or not_significant (no higher than noise, or an edge).";

void define(Command& command, WhyArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command.add_option("--line", arguments.line, "Column of the image, or row; from 0")
      ->type_name("N")
      ->required();
  command
      .add_option("--frame", arguments.frame,
                  "Number of the frame; default: the first that gives a scan")
      ->type_name("K");
  command.add_flag("--json", arguments.json, "All of it for programs on the standard output");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

void print_candidates(const LineExplanation& line) {
  fmt::print("{:>9} {:>7} {:>9} {:>7} {:>7} {:>7} {:>6} {:>6}  {}\n", "across_px", "sigma",
             "amplitude", "width", "signif.", "probab.", "lines", "joined", "what became of it");
  for (const LineCandidate& c : line.candidates) {
    fmt::print("{:>9.2f} {:>7.3f} {:>9.1f} {:>7.2f} {:>7.1f} {:>7.4f} {:>6} {:>6}  {}\n",
               c.across_px, c.sigma_px, c.amplitude_dn, c.width_px, c.significance, c.probability,
               c.lines, c.support, to_string(c.fate));
  }
  if (line.candidates.empty()) fmt::print("{:>9}  nothing rises above the background\n", "-");
}

void print_result(const ScanExplanation& why) {
  const Return& result = why.result;
  const SigmaCauses& sigma = why.line.sigma_px;
  fmt::print("status     {}\n", to_string(result.status));
  if (std::isfinite(sigma.total)) {
    fmt::print(
        "sigma_px   {:.4f} = read {:.4f}, shot {:.4f}, speckle {:.4f}, locking {:.4f}, other "
        "{:.4f}, squares added\n",
        sigma.total, sigma.read, sigma.shot, sigma.speckle, sigma.locking, sigma.other);
  }
  if (!std::isfinite(result.range_m)) return;
  fmt::print("range      {:.4f} m +- {:.2f} mm, by one pixel {:.4f} to {:.4f} m", result.range_m,
             1e3 * result.sigma_m, result.range_near_m, result.range_far_m);
  if (std::isfinite(result.sigma_cal_m)) {
    fmt::print("; calibration +- {:.2f} mm", 1e3 * result.sigma_cal_m);
  }
  fmt::print("\na pixel    {:.2f} mm; a degree between camera and laser {:.1f} mm\n",
             1e3 * why.range_m_per_px, 1e3 * why.range_m_per_deg);
}

void print(std::uint64_t frame, const ScanExplanation& why) {
  const LineExplanation& line = why.line;
  fmt::print(
      "frame {}, scan line {}: searched from {:.0f} to {:.0f}, for a stripe {:.2f} pixels wide "
      "(sigma)\nnoise {:.2f} DN; a candidate rises {:.1f} sigmas or more; {}\n\n",
      frame, line.line, line.from_px, line.to_px, line.expected_width_px, line.noise_dn,
      line.least_significance,
      line.is_chosen_over_lines ? "chosen by what goes on from scan line to scan line"
                                : "the scan line's highest peak is the stripe");
  print_candidates(line);
  fmt::print("\n");
  if (line.is_bridged) {
    fmt::print(
        "measured on the straight line of the sure returns about it, beside an edge of the "
        "surface\n");
  }
  print_result(why);
}

ExitCode why(const WhyArguments& arguments) {
  const TerminalEvents events;
  auto source = open_source(arguments.source, events.port());
  ScannerSetup setup = scanner_setup(arguments.scanner, source->info(), events.port());
  setup.options.stripe.can_explain = true;
  Scanner scanner = make_scanner(setup);
  std::optional<ScanExplanation> found;
  std::uint64_t number = 0;
  const auto look = [&](const auto& scans) {
    if (found || scans.empty()) return;
    const PolarScan& scan = scans.back();
    if (arguments.frame && scan.sequence != *arguments.frame) return;
    found = scanner.explain(arguments.line);
    number = scan.sequence;
  };
  Frame frame;
  source->start();
  while (!found && !stop_requested()) {
    const NextStatus status = source->next(frame, std::chrono::milliseconds(100));
    if (status == NextStatus::kTimeout) continue;
    if (status != NextStatus::kFrame) break;
    look(scanner.process(frame));
  }
  if (!found) look(scanner.finish());
  source->stop();
  if (!found) {
    throw Error(ErrorKind::kNotFound, arguments.frame
                                          ? fmt::format("frame {} gave no scan", *arguments.frame)
                                          : std::string("no frame gave a scan"));
  }
  if (arguments.json) {
    print_json(to_json(number, *found));
  } else {
    print(number, *found);
  }
  return ExitCode::kDone;
}

}  // namespace

void add_why(Command& striper, Action& action) {
  add_command<WhyArguments>(striper, action, "why", kDescription, define, why);
}

}  // namespace striper::program
