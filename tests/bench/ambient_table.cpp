// SPDX-License-Identifier: Apache-2.0
// Measures what each way of taking daylight off is worth, on simulated frames of the paper's hard
// case (data/scenes/ntsc_sun.yaml), and prints the table of docs/ambient.md:
//
//     build/release/tests/bench/ambient_table data/scenes/ntsc_sun.yaml > docs/ambient.md
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

namespace striper {
namespace {

constexpr double kMatchPx = 3.0;

struct Way {
  const char* name;
  ExtractMethod extract;
  AmbientMethod ambient;
  ScanMode scan;
  const char* cadence;
};

constexpr Way kWays[] = {
    {"method paper, none", ExtractMethod::kPaper, AmbientMethod::kNone, ScanMode::kProgressive,
     "0"},
    {"spatial only", ExtractMethod::kRefined, AmbientMethod::kNone, ScanMode::kProgressive, "0"},
    {"alternate", ExtractMethod::kRefined, AmbientMethod::kAuto, ScanMode::kProgressive, "0,dark"},
    {"fields", ExtractMethod::kRefined, AmbientMethod::kAuto, ScanMode::kBottomFirst, "0,dark"},
    {"temporal", ExtractMethod::kRefined, AmbientMethod::kTemporal, ScanMode::kProgressive, "0"},
};

struct Tally {
  std::size_t countable = 0;  // Columns where the stripe is plain to see: no edge, no lamp.
  std::size_t found = 0;
  std::size_t columns = 0;
  std::size_t false_points = 0;
  std::vector<double> errors_mm;
  std::vector<double> pulls;
};

double robust_deviation(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  for (double& value : values) value = std::abs(value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

void compare(const PolarScan& scan, const Truth& truth, Tally& tally) {
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    const TrueLine& line = truth.lines[i];
    const bool is_visible = line.status == TruthStatus::kVisible;
    const bool is_countable = is_visible && !line.brightest.near_edge && !line.brightest.blind;
    const auto is_at = [&](const TrueReturn& t) { return std::abs(r.v_px - t.v_px) < kMatchPx; };
    const bool is_good = r.status == ReturnStatus::kOk;
    const bool is_true = is_visible && (is_at(line.brightest) ||
                                        std::any_of(line.others.begin(), line.others.end(), is_at));
    ++tally.columns;
    if (is_good && !is_true) ++tally.false_points;
    if (!is_countable) continue;
    ++tally.countable;
    if (!is_good || !is_at(line.brightest)) continue;
    ++tally.found;
    const double error_m = r.range_m - line.brightest.range_m;
    tally.errors_mm.push_back(1000.0 * error_m);
    if (r.sigma_m > 0.0) tally.pulls.push_back(error_m / r.sigma_m);
  }
}

Tally measure(Scene scene, const Way& way, int pictures) {
  scene.timing.scan = way.scan;
  scene.timing.cadence = Cadence::parse(way.cadence);
  if (scene.timing.cadence.has_dark() && way.scan == ScanMode::kProgressive) {
    scene.timing.picture_rate_hz *= 2.0;  // As many scans a second as the fields give.
    pictures *= 2;
  }
  Simulator simulator(scene);
  const StriperModel model = simulator.model();
  ScannerOptions options = ScannerOptions::for_model(model);
  options.stripe.method = way.extract;
  options.ambient.method = way.ambient;
  Scanner scanner(model, options);
  Tally tally;
  const auto keep = [&](std::span<const PolarScan> scans) {
    for (const PolarScan& scan : scans) {
      if (scan.sequence == 0) continue;  // One-sided: begins the stream.
      compare(scan, simulator.truth(scan.sequence).at(0), tally);
    }
  };
  for (int picture = 0; picture < pictures; ++picture) {
    Frame frame = simulator.render(static_cast<std::uint64_t>(picture));
    frame.illumination = Illumination::unknown();  // Nobody tells which exposures are lit.
    keep(scanner.process(frame));
  }
  keep(scanner.finish());
  return tally;
}

void print_row(const std::string& scene, const Way& way, const Tally& tally) {
  const double found = 100.0 * static_cast<double>(tally.found) /
                       static_cast<double>(std::max<std::size_t>(1, tally.countable));
  const double wrong = static_cast<double>(tally.false_points) /
                       static_cast<double>(std::max<std::size_t>(1, tally.columns));
  std::cout << fmt::format("| {} | {} | {:.1f} | {:.5f} | {:.1f} | {:.2f} |\n", scene, way.name,
                           found, wrong, robust_deviation(tally.errors_mm),
                           robust_deviation(tally.pulls))
            << std::flush;
}

// The rear lights and the glint belong to a vehicle ahead: they move along.
void drive(Scene& scene, double speed_km_h) {
  const Eigen::Vector3d velocity(0.0, speed_km_h / 3.6, 0.0);
  scene.device_motion.velocity_m_s = velocity;
  for (SceneObject& object : scene.objects) {
    if (object.material.radiance_w_m2_sr_nm > 0.0) object.motion.velocity_m_s = velocity;
    if (auto* const box = std::get_if<Box>(&object.shape)) box->size_m.y() *= 10.0;
    if (auto* const sweep = std::get_if<Sweep>(&object.shape)) sweep->length_m = 80.0;
  }
}

void remove_lamps(Scene& scene) {
  std::erase_if(scene.objects, [](const SceneObject& object) {
    return object.material.radiance_w_m2_sr_nm > 0.0;
  });
}

void set_target(Scene& scene, double reflectance) {
  for (SceneObject& object : scene.objects) {
    if (object.name == "asphalt wall") object.material.reflectance = reflectance;
  }
}

void print_head(const Scene& scene, int pictures) {
  std::cout << fmt::format(
      "# Daylight\n\n"
      "Made by `build/release/tests/bench/ambient_table {} > docs/ambient.md`.\n"
      "Simulated, {} scans a row, nobody tells which exposures are lit. The scene as it stands is\n"
      "the paper's hard case; a row changes one thing. `alternate` has a camera of 59.94 whole\n"
      "pictures a second, `fields` the NTSC camera, `none` and `temporal` a laser that is always "
      "on.\n"
      "Found: of the columns whose stripe is no edge and not covered by a lamp. False: good "
      "returns\n"
      "more than {:.0f} rows off, per column. Error: robust deviation of the range. Pull: robust\n"
      "deviation of error over predicted sigma; 1 is right.\n\n"
      "| scene | way | found % | false per column | error mm | pull |\n|---|---|---|---|---|---|\n",
      scene.name, pictures - 1, kMatchPx);
}

void print_table(const std::string& path, int pictures) {
  const Scene base = load_scene(path);
  print_head(base, pictures);
  const auto row_of_ways = [&](const std::string& name, const Scene& scene) {
    for (const Way& way : kWays) print_row(name, way, measure(scene, way, pictures));
  };
  row_of_ways("as it stands", base);
  for (const double sun : {0.0, 0.3}) {
    Scene scene = base;
    scene.daylight.sun_w_m2_nm *= sun;
    scene.daylight.sky_w_m2_nm *= sun;
    scene.daylight.sky_radiance_w_m2_sr_nm *= sun;
    row_of_ways(fmt::format("sun {:.0f} %", 100.0 * sun), scene);
  }
  for (const double reflectance : {0.2, 0.5}) {
    Scene scene = base;
    set_target(scene, reflectance);
    row_of_ways(fmt::format("target {:.0f} %", 100.0 * reflectance), scene);
  }
  Scene no_lamps = base;
  remove_lamps(no_lamps);
  row_of_ways("no lamps", no_lamps);
  for (const double speed : {5.0, 36.0, 100.0}) {
    Scene scene = base;
    drive(scene, speed);
    row_of_ways(fmt::format("{:.0f} km/h across the view", speed), scene);
  }
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "data/scenes/ntsc_sun.yaml";
  const int pictures = argc > 2 ? std::atoi(argv[2]) : 8;
  striper::print_table(path, pictures);
}
