// SPDX-License-Identifier: Apache-2.0
// Which rule tells best which of a scan line's peaks is the stripe: every scene that comes with
// Striper, the paper's hard case as nothing was tuned on it, and the real images of
// ../shared/realdata where they are there.
//
//     peak_table [FRAMES, 6 by default] [SCENE.yaml ...]
//
// A scene is scanned as it is and, where its laser is always on, with a dark exposure between each
// two. The model is the simulator's own; nobody tells which exposures are lit.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <time.h>

#include <striper/core/robust.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/daylight.hpp"
#include "support/real_stripe.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::DaylightScore;

struct Rule {
  const char* name;
  PeakRule rule;
};

constexpr std::array<Rule, 4> kRules{{{"continuous", PeakRule::kContinuous},
                                      {"brightest", PeakRule::kBrightest},
                                      {"nearest", PeakRule::kNearest},
                                      {"farthest", PeakRule::kFarthest}}};

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// A scanner with a rule, what its scans are worth and what they cost.
struct Trial {
  Trial(Simulator& simulator, const Rule& rule)
      : scanner(simulator.model(), options_of(rule)), name(rule.name) {}

  static ScannerOptions options_of(const Rule& rule) {
    ScannerOptions options;
    options.stripe.peak = rule.rule;
    return options;
  }

  void take(const Frame& frame, Simulator& simulator) {
    const double begin_s = cpu_s();
    const ScanSpan scans = scanner.process(frame);
    if (!scans.empty()) {
      ms_a_scan.push_back(1e3 * (cpu_s() - begin_s) / static_cast<double>(scans.size()));
    }
    keep(scans, simulator);
  }
  void keep(ScanSpan scans, Simulator& simulator) {
    for (const PolarScan& scan : scans) testing::add_scan(scan, simulator, score);
  }

  Scanner scanner;
  std::string name;
  DaylightScore score;
  std::vector<double> ms_a_scan;
};

std::string cells(Trial& trial) {
  const DaylightScore& s = trial.score;
  const double false_percent = 100.0 * s.false_per_column();
  const double ms = trial.ms_a_scan.empty() ? 0.0 : upper_median(trial.ms_a_scan);
  return fmt::format(" {:.2f} | {:.3f} | {:.2f} |", 100.0 * s.found_fraction(), false_percent, ms);
}

void print_row(const std::string& name, const Scene& scene, int frames) {
  Simulator simulator(scene);
  std::vector<Trial> trials;
  for (const Rule& rule : kRules) trials.emplace_back(simulator, rule);
  for (int number = 0; number < frames; ++number) {
    for (int part = 0; part < simulator.parts_per_frame(); ++part) {
      Frame frame = simulator.render(static_cast<std::uint64_t>(number), part);
      frame.illumination = Illumination::unknown();
      for (Trial& trial : trials) trial.take(frame, simulator);
    }
  }
  std::string row = fmt::format("| {} | {} |", name, scene.timing.pattern.to_string());
  for (Trial& trial : trials) {
    trial.keep(trial.scanner.finish(), simulator);
    row += cells(trial);
  }
  std::cout << row << std::endl;
}

void print_head(const char* what, bool has_cost) {
  std::string names = fmt::format("| {} |", what);
  std::string units = has_cost ? "| | exposures |" : "| |";
  std::string rule = has_cost ? "|---|---|" : "|---|";
  if (has_cost) names += " |";
  for (const Rule& one : kRules) {
    names += fmt::format(" **{}** | |", one.name);
    units += " found % | false % |";
    rule += "---|---|";
    if (!has_cost) continue;
    names += " |";
    units += " ms |";
    rule += "---|";
  }
  // Markdown has one row of headings: the units are the first of the table.
  std::cout << "\n" << names << "\n" << rule << "\n" << units << "\n";
}

std::vector<std::string> shipped_scenes() {
  std::vector<std::string> paths;
  const auto folder = testing::source_path("data/scenes");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

void print_scene(const std::string& path, int frames) {
  Scene scene = load_scene(path);
  const std::filesystem::path file(path);
  const bool is_street = file.parent_path().filename() == "street";
  const std::string name = (is_street ? "street/" : "") + file.stem().string();
  if (scene.timing.pattern.is_bracket())
    scene.timing.pattern = IlluminationPattern::parse("0,dark");
  const int needed = frames * static_cast<int>(scene.timing.pattern.entries().size());
  print_row(name, scene, needed);
  if (scene.timing.pattern.has_dark()) return;
  scene.timing.pattern = IlluminationPattern::parse("0,dark");
  print_row(name, scene, 2 * frames);
}

// The paper's hard case with other noise, a target that is half as bright, and from a vehicle.
void print_held_out(int frames) {
  const Scene hard = load_scene(testing::source_path("data/scenes/ntsc_sun.yaml"));
  for (const std::uint64_t seed : {10'001U, 10'002U}) {
    Scene scene = hard;
    scene.seed = seed;
    print_row(fmt::format("hard case, seed {}", seed), scene, 2 * frames);
    for (SceneObject& object : scene.objects) {
      if (object.name == "asphalt wall") object.material.reflectance *= 0.5;
    }
    print_row(fmt::format("hard case, asphalt half as bright, seed {}", seed), scene, 2 * frames);
    testing::drive(scene, 36.0 / 3.6);
    print_row(fmt::format("the same at 36 km/h, seed {}", seed), scene, 2 * frames);
  }
}

testing::RealScore real_score(const std::vector<testing::RealImage>& images, PeakRule rule) {
  testing::RealSettings settings;
  settings.peak = rule;
  testing::RealScanner scanner(settings);
  testing::RealScore sum;
  for (const testing::RealImage& image : images) sum.add(scanner.score(image));
  return sum;
}

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void print_real_row(const std::vector<testing::RealImage>& images) {
  std::string row = fmt::format("| {}, {} |", images.front().set(), to_string(images.front().axis));
  for (const Rule& rule : kRules) {
    const testing::RealScore score = real_score(images, rule.rule);
    const double found = percent(score.found, score.with_stripe);
    row += score.with_stripe == 0 ? " - |" : fmt::format(" {:.2f} |", found);
    row += fmt::format(" {:.3f} |", percent(score.wrong, score.judged()));
  }
  std::cout << row << std::endl;
}

void print_real() {
  print_head("real images", false);
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    print_real_row(testing::real_boards("bouguet-calib-example", ".tif", axis));
    print_real_row(testing::real_boards("opencv-left-right", ".jpg", axis));
  }
  const auto images = testing::real_images();
  for (auto first = images.begin(); first != images.end();) {
    const auto last = std::find_if(first, images.end(),
                                   [&](const auto& image) { return image.set() != first->set(); });
    print_real_row({first, last});
    first = last;
  }
}

void run(const std::vector<std::string>& words) {
  const int frames = words.empty() ? 6 : std::atoi(words.front().c_str());
  std::vector<std::string> scenes(words.begin() + (words.empty() ? 0 : 1), words.end());
  const bool is_all = scenes.empty();
  if (is_all) scenes = shipped_scenes();
  print_head("scene", true);
  for (const std::string& scene : scenes) print_scene(scene, frames);
  if (!is_all) return;
  print_held_out(frames);
  if (std::filesystem::exists(testing::real_data("neil-rover-striper"))) print_real();
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  try {
    striper::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "peak_table: " << error.what() << "\n";
    return 1;
  }
}
