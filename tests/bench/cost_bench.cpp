// SPDX-License-Identifier: Apache-2.0
// What the public headers say that their calls cost, measured: a line for each, named by its
// header. The scan stage, the extraction and the ambient stage have benchmarks of their own beside
// this one.
//
//     build/release/tests/bench/cost_bench
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

#include <striper/compare/centroid_repeatability.hpp>
#include <striper/compare/scan_comparison.hpp>
#include <striper/design/design_figures.hpp>
#include <striper/design/eye_safety.hpp>
#include <striper/design/paper_table.hpp>
#include <striper/detect/curb_finder.hpp>
#include <striper/detect/objects.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/guidance/path_filter.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/pipeline/expect_stripe.hpp>
#include <striper/pipeline/scan_mask.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/profile/segments.hpp>
#include <striper/profile/smooth.hpp>
#include <striper/profile/tools.hpp>
#include <striper/road/road.hpp>
#include <striper/road/road_drive.hpp>
#include <striper/simulator/ideal_look.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>
#include <striper/stripe/photon_transfer.hpp>

#include "support/models.hpp"
#include "support/profile_scans.hpp"
#include "support/road_scans.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using benchmark::DoNotOptimize;

// @param call once an iteration; what it needs it owns.
void add(const std::string& name, std::function<void()> call) {
  benchmark::RegisterBenchmark(name.c_str(), [call = std::move(call)](benchmark::State& state) {
    for ([[maybe_unused]] auto _ : state) call();
  });
}

// Once a scan line of the image, as a scan needs it; the time is that of one.
template <typename Call>
void add_per_line(const std::string& name, int lines, Call call) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    int line = 0;
    for ([[maybe_unused]] auto _ : state) {
      line = line + 1 == lines ? 0 : line + 1;
      call(line);
    }
  });
}

void add_geometry() {
  const StriperModel model = testing::typical_model();
  const CameraModel camera = model.camera;
  const Triangulator triangulator(model, 0);
  add_per_line("model/camera_model.hpp: project", 640, [=](int i) {
    DoNotOptimize(camera.project(Eigen::Vector3d(1e-3 * i - 0.3, 0.1, 1.0)));
  });
  add_per_line("model/camera_model.hpp: unproject", 640,
               [=](int i) { DoNotOptimize(camera.unproject(Eigen::Vector2d(i, 300.0))); });
  add_per_line("geometry/triangulator.hpp: triangulate", 640,
               [=](int i) { DoNotOptimize(triangulator.triangulate(Eigen::Vector2d(i, 300.0))); });
  add_per_line("geometry/triangulator.hpp: triangulate_ray", 640, [=](int i) {
    DoNotOptimize(triangulator.triangulate_ray(Eigen::Vector2d(1e-3 * i - 0.3, 0.1)));
  });
  LineSums sums;
  for (int i = 0; i < 40; ++i) sums.add(1.0, 0.01 * i, 0.5 + 0.02 * i, 1.0);
  add("geometry/line_fit.hpp: chi2", [=]() mutable {
    DoNotOptimize(sums);
    DoNotOptimize(sums.chi2());
  });
  add("geometry/line_fit.hpp: solve", [=]() mutable {
    DoNotOptimize(sums);
    DoNotOptimize(sums.solve());
  });
}

void add_scanner() {
  auto simulator =
      std::make_shared<Simulator>(load_scene(testing::source_path("data/scenes/room.yaml")));
  const StriperModel model = simulator->model();
  add("pipeline/expect_stripe.hpp: expect_stripe",
      [=] { DoNotOptimize(expect_stripe(model, 0, {})); });
  add("simulator/ideal_look.hpp: ideal_look",
      [scene = simulator->scene()] { DoNotOptimize(ideal_look(scene, 0)); });
  ScanMask mask;
  mask.metres = {{{0.2, -0.4}, {0.6, -0.4}, {0.6, 0.4}, {0.2, 0.4}}};
  add("pipeline/scan_mask.hpp: ignored_pixels, 640x480",
      [=] { DoNotOptimize(ignored_pixels(mask, &model, 0)); });
  ScannerOptions options;
  options.stripe.can_explain = true;
  auto scanner = std::make_shared<Scanner>(model, options);
  for (std::uint64_t n = 0; n < 8; ++n) scanner->process(simulator->render(n));
  add_per_line("pipeline/scanner.hpp: explain", 640,
               [=](int i) { DoNotOptimize(scanner->explain(i)); });
  add("simulator/simulator.hpp: construct and render, 640x480",
      [scene = simulator->scene()] { DoNotOptimize(Simulator(scene).render(0)); });
  auto transfer = std::make_shared<PhotonTransfer>();
  const cv::Mat image = simulator->render(0).image;
  add("stripe/photon_transfer.hpp: add, 640x480", [=] { transfer->add(image, 255); });
}

// A room's corner, a post before it, and something that stands out.
PolarScan scan_of_corner() {
  const testing::ProfileStriper striper;
  const auto shape = [](double bearing_rad) {
    if (bearing_rad > -0.3 && bearing_rad < -0.2) return 1.1;
    const double far = testing::range_of_line(bearing_rad, 0.0, 2.5);
    const double side = testing::range_of_line(bearing_rad, 1.2, 1.6);
    return side < far ? side : far;
  };
  PolarScan scan;
  testing::noisy_scan(striper, testing::exact_ranges(striper, shape), scan);
  return scan;
}

void add_profile() {
  auto scan = std::make_shared<PolarScan>(scan_of_corner());
  auto segmenter = std::make_shared<Segmenter>();
  auto segmentation = std::make_shared<Segmentation>();
  add("profile/segments.hpp: segment", [=] { segmenter->segment(*scan, *segmentation); });
  auto smoother = std::make_shared<Smoother>();
  auto smoothed = std::make_shared<PolarScan>();
  add("profile/smooth.hpp: smooth, with the segmentation", [=] {
    *smoothed = *scan;
    smoother->smooth(*smoothed);
  });
  StriperModel model = testing::typical_model();
  const std::vector<MeasureTool> tools{parse_measure_tool("wall:line:x=2.4..2.6"),
                                       parse_measure_tool("post:width:x=0.9..1.2")};
  auto plain = std::make_shared<Measurer>(tools);
  add("profile/tools.hpp: measure", [=] { DoNotOptimize(&plain->measure(*scan)); });
  model.covariance = testing::plausible_covariance(model);
  auto calibrated = std::make_shared<Measurer>(tools, std::make_shared<const StriperModel>(model));
  add("profile/tools.hpp: measure, with a covariance",
      [=] { DoNotOptimize(&calibrated->measure(*scan)); });
  const testing::RoadStriper road;
  auto street = std::make_shared<PolarScan>();
  testing::road_scan(road, ranges_of_profile(road, testing::curb_profile(1.5, 0.12)), *street);
  CurbOptions curbs;
  curbs.up_rad = road.up_rad();
  auto plain_finder = std::make_shared<CurbFinder>(curbs);
  add("detect/curb_finder.hpp: find", [=] { DoNotOptimize(&plain_finder->find(*street)); });
  auto finder = std::make_shared<CurbFinder>(curbs, std::make_shared<const StriperModel>(model));
  add("detect/curb_finder.hpp: find, with a covariance",
      [=] { DoNotOptimize(&finder->find(*street)); });
  auto objects = std::make_shared<ObjectTracker>();
  auto later = std::make_shared<PolarScan>(*scan);
  add("detect/objects.hpp: update", [=] {
    later->time.monotonic_ns += 33'000'000;
    DoNotOptimize(objects->update(*later).size());
  });
  const std::vector<PolarScan> scans(1, *scan);
  add("compare/scan_comparison.hpp: compare_scans",
      [=] { DoNotOptimize(compare_scans(scans, *scan)); });
}

void add_design() {
  const DesignFigures figures(paper_striper(55.0));
  add("design/design_figures.hpp: at", [=] { DoNotOptimize(figures.at(2.0)); });
  add("design/paper_table.hpp: paper_table_1", [] { DoNotOptimize(paper_table_1()); });
  EyeSafetyInput input;
  input.emission = PulsedEmission{1e-6};
  add("design/eye_safety.hpp: assess_eye_safety", [=] { DoNotOptimize(assess_eye_safety(input)); });
  add("compare/centroid_repeatability.hpp: centroid_change_px",
      [] { DoNotOptimize(centroid_change_px(1.2, 20.0)); });
}

void add_guidance() {
  PathFilterOptions options;
  options.beam_x_m = {2.4, 0.0, -2.4};
  auto filter = std::make_shared<PathFilter>(options);
  auto way = std::make_shared<double>(0.0);
  auto beam = std::make_shared<std::size_t>(0);
  add("guidance/path_filter.hpp: see", [=] {
    *beam = (*beam + 1) % 3;
    if (*beam == 0) filter->advance(*way += 0.1);
    StripeSight sight;
    sight.beam = *beam;
    sight.sigma_m = 0.002;
    sight.width_m = 0.1;
    DoNotOptimize(filter->see(sight));
  });
  const Road road = load_road(testing::source_path("data/roads/dashes.yaml"));
  auto drive = std::make_shared<RoadDrive>(road);
  add("road/road_drive.hpp: next", [=] {
    BeamSweep sweep;
    OdometerReading reading;
    if (drive->next(sweep, reading) == RoadDrive::Next::kEnd) *drive = RoadDrive(road);
  });
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  striper::add_geometry();
  striper::add_scanner();
  striper::add_profile();
  striper::add_design();
  striper::add_guidance();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
