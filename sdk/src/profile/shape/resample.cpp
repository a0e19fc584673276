// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/resample.hpp>

namespace striper {
namespace {

constexpr double kEdgeSpacings = 3.0;
constexpr double kEdgeSigmas = 8.0;  // Noise alone makes no edge.

double place_of(const Return& r, ResampleGrid::Axis axis) {
  switch (axis) {
    case ResampleGrid::Axis::kX:
      return r.x_m;
    case ResampleGrid::Axis::kY:
      return r.y_m;
    default:
      return r.bearing_rad;
  }
}

template <typename Number>
Number mix(Number a, Number b, double part) {
  return static_cast<Number>((1.0 - part) * static_cast<double>(a) + part * static_cast<double>(b));
}

// On the straight line between two returns, `part` of the way.
Return between(const Return& a, const Return& b, double part) {
  Return r = a;
  r.x_m = mix(a.x_m, b.x_m, part);
  r.y_m = mix(a.y_m, b.y_m, part);
  r.range_m = std::hypot(r.x_m, r.y_m);
  r.bearing_rad = std::atan2(r.y_m, r.x_m);
  r.u_px = mix(a.u_px, b.u_px, part);
  r.v_px = mix(a.v_px, b.v_px, part);
  r.range_near_m = mix(a.range_near_m, b.range_near_m, part);
  r.range_far_m = mix(a.range_far_m, b.range_far_m, part);
  // As if both were wrong together, which after smoothing they are.
  r.sigma_m = mix(a.sigma_m, b.sigma_m, part);
  r.sigma_cal_m = mix(a.sigma_cal_m, b.sigma_cal_m, part);
  r.intensity_dn = mix(a.intensity_dn, b.intensity_dn, part);
  r.width_px = mix(a.width_px, b.width_px, part);
  r.row_sigma_px = mix(a.row_sigma_px, b.row_sigma_px, part);
  r.confidence = mix(a.confidence, b.confidence, part);
  return r;
}

// The returns of a scan that have a surface, and which of them are neighbours. A scan of all scan
// lines says by place what is between two of them; a table of the ok ones alone says it by their
// pixels.
class Neighbours {
 public:
  explicit Neighbours(const PolarScan& scan) : scan_(scan) {
    for (std::size_t i = 0; i < scan.returns.size(); ++i)
      if (scan.returns[i].status == ReturnStatus::kOk && scan.returns[i].range_m > 0.0)
        good_.push_back(i);
    find_pitch();
  }

  std::size_t size() const { return good_.size(); }
  const Return& at(std::size_t k) const { return scan_.returns[good_[k]]; }

  // Whether no scan line is between k and the next.
  bool are_neighbours(std::size_t k) const {
    if (good_[k + 1] != good_[k] + 1) return false;
    return !pitch_px_ || apart_px(k) < kSameLines * *pitch_px_;
  }

  double distance_m(std::size_t k) const {
    return std::hypot(at(k + 1).x_m - at(k).x_m, at(k + 1).y_m - at(k).y_m);
  }

  // How far apart neighbours k and k + 1 are; 0 where they are none.
  double spacing_m(std::size_t k) const {
    return k + 1 < size() && are_neighbours(k) ? distance_m(k) : 0.0;
  }

 private:
  static constexpr double kSameLines = 1.5;
  static constexpr double kPitchError = 0.02;  // Tables round pixels to hundredths.

  double apart_px(std::size_t k) const {
    return std::abs(at(k + 1).along_px(scan_.axis) - at(k).along_px(scan_.axis));
  }

  // What all are whole multiples of; none in a scan that was resampled, or has no pixels.
  void find_pitch() {
    double pitch_px = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k + 1 < size(); ++k) pitch_px = std::min(pitch_px, apart_px(k));
    bool is_pitch = pitch_px > kPitchError && std::isfinite(pitch_px);
    for (std::size_t k = 0; is_pitch && k + 1 < size(); ++k) {
      const double pitches = apart_px(k) / pitch_px;
      is_pitch = std::abs(pitches - std::round(pitches)) * pitch_px < kPitchError;
    }
    if (is_pitch) pitch_px_ = pitch_px;
  }

  const PolarScan& scan_;
  std::vector<std::size_t> good_;
  std::optional<double> pitch_px_;
};

constexpr double kMostPlaces = 1e6;  // Between two returns: 200 MB.

// The returns between which a grid is looked for, with their places in the scan.
struct Pair {
  const Return* a;
  const Return* b;
  bool is_gap;
};

// Places of the grid in [a, b), in the direction of the scan.
void add_between(const Pair& pair, const ResampleGrid& grid, std::vector<Return>& out) {
  const double from = place_of(*pair.a, grid.axis) / grid.step;
  const double to = place_of(*pair.b, grid.axis) / grid.step;
  const double sense = to > from ? 1.0 : -1.0;
  const double first = std::ceil(sense * from);
  const double steps = std::max(std::ceil(sense * to) - first, 0.0);
  if (steps > kMostPlaces)
    throw Error(ErrorKind::kUsage,
                "resample: the step is too small for the scan: between two of "
                "its returns it has more than a million places");
  for (std::uint64_t step = 0; static_cast<double>(step) < steps; ++step) {
    const double k = first + static_cast<double>(step);
    const double part = (sense * k - from) / (to - from);
    Return r = between(*pair.a, *pair.b, part);
    if (grid.axis == ResampleGrid::Axis::kBearing) {  // The chord's own bearing differs a little.
      const double bearing = sense * k * grid.step;
      const double cross = pair.a->x_m * pair.b->y_m - pair.a->y_m * pair.b->x_m;
      const double across = std::cos(bearing) * (pair.b->y_m - pair.a->y_m) -
                            std::sin(bearing) * (pair.b->x_m - pair.a->x_m);
      r.range_m = cross / across;
      r.bearing_rad = bearing;
      r.x_m = r.range_m * std::cos(bearing);
      r.y_m = r.range_m * std::sin(bearing);
    }
    if (pair.is_gap) {
      r.status = ReturnStatus::kFilled;
      r.sigma_m = std::hypot(r.sigma_m, (pair.b->range_m - pair.a->range_m) / std::sqrt(12.0));
    }
    out.push_back(r);
  }
}

}  // namespace

PolarScan resampled(const PolarScan& scan, const ResampleGrid& grid,
                    std::optional<double> fill_gaps_m) {
  PolarScan out = scan;
  out.returns.clear();
  const Neighbours good(scan);
  for (std::size_t k = 0; k + 1 < good.size(); ++k) {
    const Return& a = good.at(k);
    const Return& b = good.at(k + 1);
    const double apart = good.distance_m(k);
    const double usual = std::max(k > 0 ? good.spacing_m(k - 1) : 0.0, good.spacing_m(k + 1));
    const double noise = kEdgeSigmas * std::max(a.sigma_m, b.sigma_m);
    const bool is_edge = apart > kEdgeSpacings * usual + (std::isfinite(noise) ? noise : 0.0);
    const bool is_gap = !good.are_neighbours(k) || (usual > 0.0 && is_edge);
    if (is_gap && !(fill_gaps_m && apart <= *fill_gaps_m)) continue;
    add_between({&a, &b, is_gap}, grid, out.returns);
  }
  return out;
}

ResampleGrid parse_resample_grid(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view axis = text.substr(0, equals);
  const std::string_view number =
      equals == std::string_view::npos ? std::string_view{} : text.substr(equals + 1);
  ResampleGrid grid;
  const auto [end, error] =
      std::from_chars(number.data(), number.data() + number.size(), grid.step);
  const bool is_number = error == std::errc{} && end == number.data() + number.size();
  // A hundredth of what the finest laser profilers resolve; what is finer fills the memory.
  const double least = axis == "bearing" ? 1e-3 : 1e-5;
  const bool is_axis = axis == "x" || axis == "y" || axis == "bearing";
  if (!is_axis || !is_number || !(grid.step >= least) || !std::isfinite(grid.step))
    throw Error(ErrorKind::kUsage,
                fmt::format("resample '{}': expected x=M or y=M, a step of 1e-5 metres or more, or "
                            "bearing=DEG, of 1e-3 degrees or more",
                            text));
  grid.axis = axis == "x"   ? ResampleGrid::Axis::kX
              : axis == "y" ? ResampleGrid::Axis::kY
                            : ResampleGrid::Axis::kBearing;
  if (axis == "bearing") grid.step *= std::numbers::pi / 180.0;
  return grid;
}

}  // namespace striper
