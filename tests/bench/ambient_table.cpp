// SPDX-License-Identifier: Apache-2.0
// Measures what each way of subtracting daylight is worth, on simulated frames of the paper's hard
// case (data/scenes/ntsc_sun.yaml), and prints docs/ambient.md:
//
//     build/release/tests/bench/ambient_table data/scenes/ntsc_sun.yaml > docs/ambient.md
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/simulator/scene_yaml.hpp>

#include "support/daylight.hpp"

namespace striper {
namespace {

using testing::DaylightScore;
using testing::DaylightWay;

struct Column {
  const char* name;
  DaylightWay way;
};

// A camera, and the ways to use its frames.
struct Camera {
  ScanMode scan;
  const char* pattern;
  std::vector<Column> columns;
};

const Camera kCameras[] = {
    {ScanMode::kBottomFirst,
     "0,dark",
     {{"none (`paper`)", {ExtractMethod::kPaper, PeakRule::kBrightest, AmbientMethod::kNone}},
      {"fields, `paper`", {ExtractMethod::kPaper, PeakRule::kBrightest, AmbientMethod::kAuto}},
      {"spatial only", {ExtractMethod::kRefined, PeakRule::kBrightest, AmbientMethod::kNone}},
      {"fields", {}}}},
    {ScanMode::kProgressive, "0,dark", {{"alternate", {}}}},
    {ScanMode::kProgressive,
     "0",
     {{"temporal", {ExtractMethod::kRefined, PeakRule::kContinuous, AmbientMethod::kTemporal}}}},
};

// The case itself is measured with more frames.
constexpr int kMoreOfTheCase = 4;

std::vector<DaylightScore> measure(Scene scene, const Camera& camera, int frames) {
  scene.timing.scan = camera.scan;
  scene.timing.pattern = IlluminationPattern::parse(camera.pattern);
  if (scene.timing.pattern.has_dark() && camera.scan == ScanMode::kProgressive) {
    scene.timing.picture_rate_hz *= 2.0;  // As many scans a second as the fields give.
    frames *= 2;
  }
  std::vector<DaylightWay> ways;
  for (const Column& column : camera.columns) ways.push_back(column.way);
  Simulator simulator(scene);
  std::vector<DaylightScore> scores;
  for (const auto& trial : testing::try_in_daylight(simulator, ways, frames)) {
    scores.push_back(trial.score());
  }
  return scores;
}

// "-" where nothing was found to be judged.
std::string figure(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : "-";
}

void print_row(const std::string& name, const char* way, const DaylightScore& score) {
  std::cout << fmt::format("| {} | {} | {:.2f} | {:.2f} | {:.5f} | {} | {} |\n", name, way,
                           100.0 * score.found_fraction(), 100.0 * score.blind_fraction(),
                           score.false_per_column(), figure(score.error_mm(), 1),
                           figure(score.pull(), 2))
            << std::flush;
}

void print_rows(const std::string& name, const Scene& scene, int frames) {
  for (const Camera& camera : kCameras) {
    const std::vector<DaylightScore> scores = measure(scene, camera, frames);
    for (std::size_t i = 0; i < scores.size(); ++i) {
      print_row(name, camera.columns[i].name, scores[i]);
    }
  }
}

void remove_light_sources(Scene& scene) {
  std::erase_if(scene.objects, [](const SceneObject& object) {
    return object.material.radiance_w_m2_sr_nm > 0.0;
  });
}

void dim_light_sources(Scene& scene, double factor) {
  for (SceneObject& object : scene.objects) object.material.radiance_w_m2_sr_nm *= factor;
}

void set_reflectance(Scene& scene, const std::string& name, double reflectance) {
  for (SceneObject& object : scene.objects) {
    if (object.name == name) object.material.reflectance = reflectance;
  }
}

void print_head(const Scene& scene, int frames) {
  std::cout << fmt::format(
      "# Daylight\n\n"
      "Made by `build/release/tests/bench/ambient_table {} > docs/ambient.md`.\n\n"
      "Simulated, {} scans of 640 columns a line (first group: {}); nobody tells which exposures "
      "are lit. The scene "
      "as it stands is the\n"
      "paper's hard case (bright sun, a stripe on asphalt at 2 m, grass and snow above it in the "
      "same columns, rear lights, a\n"
      "specular highlight of the sun); each group of lines changes one thing. Across the view the "
      "scene is a long wall "
      "that passes by; the\n"
      "light sources and the specular highlight go along, as those of a vehicle ahead, or pass by "
      "too, a set of them "
      "always in view.\n\n"
      "- **none (`paper`)**: the paper's method on the lit fields of the NTSC camera, nothing "
      "subtracted.\n"
      "- **fields, `paper`**: the same after the dark field has been subtracted.\n"
      "- **spatial only**: `refined` on the lit fields, nothing subtracted: the filter's and the "
      "width's own selectivity.\n"
      "- **fields**: `refined` with the tracker (`--peak continuous`) after the dark fields have "
      "been subtracted.\n"
      "- **alternate**: the same with a camera of 59.94 whole frames a second.\n"
      "- **temporal**: the same minus the running median, the laser always on: for stripes that "
      "wander past a standing sensor.\n"
      "  It subtracts a standing stripe too, so these scenes are not for it.\n\n"
      "Each way is told the model (lens, plane, channel, noise, width and brightness of the stripe "
      "over range) and nothing\n"
      "of the scene, nor which exposures are lit; all look at the same frames.\n\n"
      "Found: of the columns whose stripe is no edge and not covered by a light source. Blind: of "
      "the same "
      "columns, not found and said to\n"
      "be blind: a light source that passes by also hides what it covers in the dark fields before "
      "and "
      "after. False: good returns more\n"
      "than {:.0f} rows off, per column. Error: robust deviation of the range. Pull: robust "
      "deviation of error over predicted sigma;\n"
      "1 is right.\n\n"
      "| scene | way | found % | blind % | false per column | error mm | pull |\n"
      "|---|---|---|---|---|---|---|\n",
      scene.name, frames - 1, kMoreOfTheCase * frames - 1, DaylightScore::kMatchPx);
}

void print_table(const std::string& path, int frames) {
  const Scene base = load_scene(path);
  print_head(base, frames);
  print_rows("as it stands", base, kMoreOfTheCase * frames);
  for (const double sun : {0.0, 0.3, 1.5}) {
    Scene scene = base;
    scene.daylight.sun_w_m2_nm *= sun;
    scene.daylight.sky_w_m2_nm *= sun;
    scene.daylight.sky_radiance_w_m2_sr_nm *= sun;
    print_rows(fmt::format("sun {:.0f} %", 100.0 * sun), scene, frames);
  }
  for (const double reflectance : {0.2, 0.5}) {
    Scene scene = base;
    set_reflectance(scene, "asphalt wall", reflectance);
    print_rows(fmt::format("target {:.0f} %", 100.0 * reflectance), scene, frames);
  }
  for (const double reflectance : {0.1, 0.8}) {
    Scene scene = base;
    set_reflectance(scene, "grass", reflectance);
    set_reflectance(scene, "snow bank", reflectance);
    print_rows(fmt::format("background {:.0f} %", 100.0 * reflectance), scene, frames);
  }
  Scene no_light_sources = base;
  remove_light_sources(no_light_sources);
  print_rows("no light sources", no_light_sources, frames);
  Scene dim = base;
  dim_light_sources(dim, 0.02);
  print_rows("light sources of 2 % (not saturated)", dim, frames);
  for (const double speed_km_h : {5.0, 20.0, 36.0, 60.0, 100.0}) {
    Scene scene = base;
    testing::drive(scene, speed_km_h / 3.6);
    print_rows(fmt::format("{:.0f} km/h across the view", speed_km_h), scene, frames);
  }
  for (const double speed_km_h : {5.0, 10.8, 36.0, 60.0, 100.0}) {
    Scene scene = base;
    testing::drive_past_light_sources(scene, speed_km_h / 3.6, frames);
    print_rows(fmt::format("{:.0f} km/h past light sources", speed_km_h), scene, frames);
  }
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  const std::string path = argc > 1 ? argv[1] : "data/scenes/ntsc_sun.yaml";
  const int frames = argc > 2 ? std::atoi(argv[2]) : 9;
  striper::print_table(path, frames);
}
