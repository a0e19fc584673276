// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <striper/core/robust.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/simulator.hpp>

namespace striper::testing {

/// What scans of simulated frames are worth, column by column.
struct DaylightScore {
  static constexpr double kMatchPx = 3.0;

  std::size_t scans = 0;
  std::size_t scans_of_dark = 0;  ///< Made of an exposure that no laser lit: all of it is false.
  std::size_t countable = 0;      ///< Columns whose stripe is no edge and not under a light source.
  std::size_t found = 0;
  std::size_t located = 0;  ///< Found, or called doubtful at the stripe's place.
  std::size_t blind = 0;    ///< Of the countable columns: not found, and said to be blind.
  std::size_t columns = 0;
  std::size_t false_points = 0;  ///< Good returns that are no stripe's.
  std::vector<double> errors_mm;
  std::vector<double> pulls;  ///< Range error over `sigma_m`.

  double found_fraction() const { return ratio(found, countable); }
  double located_fraction() const { return ratio(located, countable); }
  double blind_fraction() const { return ratio(blind, countable); }
  double false_per_column() const { return ratio(false_points, columns); }
  double error_mm() const { return robust_deviation(errors_mm); }
  double pull() const { return robust_deviation(pulls); }

  /// @param truth of the exposure; null where no laser fired.
  void add(const PolarScan& scan, const Truth* truth) {
    ++scans;
    if (truth == nullptr) ++scans_of_dark;
    for (std::size_t i = 0; i < scan.returns.size(); ++i) {
      ++columns;
      if (truth != nullptr && is_countable(truth->lines[i])) {
        count(scan.returns[i], truth->lines[i].brightest, truth->axis);
      }
      if (scan.returns[i].status != ReturnStatus::kOk) continue;
      if (truth == nullptr || !is_true(scan.returns[i], *truth, i)) ++false_points;
    }
  }

 private:
  static double ratio(std::size_t part, std::size_t whole) {
    return static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, whole));
  }

  static double robust_deviation(std::vector<double> values) {
    if (values.empty()) return std::nan("");
    for (double& value : values) value = std::abs(value);
    return robust_sigma(values);
  }

  static bool is_countable(const TrueLine& line) {
    return line.status == TruthStatus::kVisible && !line.brightest.near_edge &&
           !line.brightest.blind;
  }

  static bool is_at(const TrueReturn& t, const Return& r, StripeAxis axis) {
    const double off_px = axis == StripeAxis::kColumns ? r.v_px - t.v_px : r.u_px - t.u_px;
    return std::abs(off_px) < kMatchPx;
  }

  // At an edge a column sees a part of what the truth gives to the one beside it.
  static bool is_true(const Return& r, const Truth& truth, std::size_t column) {
    const std::size_t first = column > 0 ? column - 1 : 0;
    for (std::size_t i = first; i <= column + 1 && i < truth.lines.size(); ++i) {
      const TrueLine& line = truth.lines[i];
      if (line.status != TruthStatus::kVisible) continue;
      if (is_at(line.brightest, r, truth.axis)) return true;
      for (const TrueReturn& other : line.others) {
        if (is_at(other, r, truth.axis)) return true;
      }
    }
    return false;
  }

  void count(const Return& r, const TrueReturn& truth, StripeAxis axis) {
    ++countable;
    if (r.status == ReturnStatus::kBlind) ++blind;
    if (!is_at(truth, r, axis)) return;
    ++located;
    if (r.status != ReturnStatus::kOk) return;
    ++found;
    const double error_m = r.range_m - truth.range_m;
    errors_mm.push_back(1000.0 * error_m);
    if (r.sigma_m > 0.0) pulls.push_back(error_m / r.sigma_m);
  }
};

/// Adds a scan of frame `scan.sequence` with the truth of the exposure it was made of.
inline void add_scan(const PolarScan& scan, Simulator& simulator, DaylightScore& score) {
  const std::vector<Truth> lit = simulator.truth(scan.sequence);
  const auto own = std::find_if(lit.begin(), lit.end(),
                                [&](const Truth& truth) { return truth.field == scan.field; });
  score.add(scan, own != lit.end() ? &*own : nullptr);
}

/// A way of finding the stripe in daylight.
struct DaylightWay {
  ExtractMethod extract = ExtractMethod::kRefined;
  PeakRule peak = PeakRule::kContinuous;
  AmbientMethod ambient = AmbientMethod::kAuto;
};

/// One way at work on frames of a scene; nobody tells which exposures are lit. What begins the
/// stream has a dark exposure on one side only and is not counted.
class DaylightTrial {
 public:
  DaylightTrial(Simulator& simulator, const DaylightWay& way)
      : simulator_(&simulator), scanner_(simulator.model(), options_of(simulator.model(), way)) {}

  void take(const Frame& frame) { keep(scanner_.process(frame)); }
  void finish() { keep(scanner_.finish()); }

  const DaylightScore& score() const { return score_; }
  ScannerStatus status() const { return scanner_.status(); }

 private:
  static ScannerOptions options_of(const StriperModel& model, const DaylightWay& way) {
    ScannerOptions options = ScannerOptions::for_model(model);
    options.stripe.method = way.extract;
    options.stripe.peak = way.peak;
    options.ambient.method = way.ambient;
    return options;
  }

  void keep(ScanSpan scans) {
    for (const PolarScan& scan : scans) {
      if (scan.sequence != 0) add_scan(scan, *simulator_, score_);
    }
  }

  Simulator* simulator_;
  Scanner scanner_;
  DaylightScore score_;
};

/// Scans those frames of a scene that `is_kept`, rendered once, in each of several ways.
inline std::vector<DaylightTrial> try_in_daylight(
    Simulator& simulator, std::span<const DaylightWay> ways, int frames,
    const std::function<bool(int)>& is_kept = [](int) { return true; }) {
  std::vector<DaylightTrial> trials;
  for (const DaylightWay& way : ways) trials.emplace_back(simulator, way);
  for (int number = 0; number < frames; ++number) {
    for (int part = 0; part < simulator.parts_per_frame(); ++part) {
      if (!is_kept(number * simulator.parts_per_frame() + part)) continue;
      Frame frame = simulator.render(static_cast<std::uint64_t>(number), part);
      frame.illumination = Illumination::unknown();
      for (DaylightTrial& trial : trials) trial.take(frame);
    }
  }
  for (DaylightTrial& trial : trials) trial.finish();
  return trials;
}

/// The same in one way.
inline DaylightScore scan_in_daylight(
    const Scene& scene, const DaylightWay& way, int frames,
    const std::function<bool(int)>& is_kept = [](int) { return true; },
    ScannerStatus* status = nullptr) {
  Simulator simulator(scene);
  const std::vector<DaylightTrial> trials = try_in_daylight(simulator, {&way, 1}, frames, is_kept);
  if (status != nullptr) *status = trials.front().status();
  return trials.front().score();
}

/// Lets a scene pass by. What shines belongs to a vehicle ahead and stays where it is seen; what
/// passes is made long enough.
inline void drive(Scene& scene, double speed_m_s) {
  const Eigen::Vector3d velocity(0.0, speed_m_s, 0.0);
  scene.device_motion.velocity_m_s = velocity;
  for (SceneObject& object : scene.objects) {
    if (object.material.radiance_w_m2_sr_nm > 0.0) object.motion.velocity_m_s = velocity;
    if (auto* const box = std::get_if<Box>(&object.shape)) box->size_m.y() *= 10.0;
    if (auto* const sweep = std::get_if<Sweep>(&object.shape)) sweep->length_m = 80.0;
  }
}

/// The same where what shines stands in the world and passes by too, again and again: as far apart
/// as an image is wide at 2 m.
inline void drive_past_light_sources(Scene& scene, double speed_m_s, int frames) {
  constexpr double kApart_m = 2.1;
  drive(scene, speed_m_s);
  const double way_m = speed_m_s * frames / scene.timing.picture_rate_hz;
  std::vector<SceneObject> light_sources;
  for (SceneObject& object : scene.objects) {
    if (object.material.radiance_w_m2_sr_nm <= 0.0) continue;
    object.motion.velocity_m_s.setZero();
    for (int n = 1; n <= static_cast<int>(std::ceil(way_m / kApart_m)); ++n) {
      light_sources.push_back(object);
      light_sources.back().T_world_object.translation().y() += n * kApart_m;
    }
  }
  scene.objects.insert(scene.objects.end(), light_sources.begin(), light_sources.end());
}

}  // namespace striper::testing
