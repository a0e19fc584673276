// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/profile/resample.hpp>

#include "profile/shape/scan_neighbours.hpp"

namespace striper {
namespace {

constexpr double kMostPlaces = 1e6;  // Between two returns: 200 MB.
// Of a step, by which a return misses a place on which it was put.
constexpr double kOnPlace = 1e-6;

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

// Two returns between which places of a grid are looked for, and what is between them.
struct Pair {
  const Return* a;
  const Return* b;
  bool is_gap;
  bool is_last;  // Nothing goes on from b.
};

// Their places, in steps; bearings the short way round.
struct Places {
  double from;
  double to;
};

Places places_of(const Pair& pair, const ResampleGrid& grid) {
  Places places{place_of(*pair.a, grid.axis), place_of(*pair.b, grid.axis)};
  if (grid.axis == ResampleGrid::Axis::kBearing)
    places.to = places.from + std::remainder(places.to - places.from, 2.0 * std::numbers::pi);
  return {places.from / grid.step, places.to / grid.step};
}

// Where the ray of a bearing meets the line through both: the chord's own bearing differs a little.
void move_to_bearing(const Pair& pair, double bearing_rad, Return& r) {
  const Return& a = *pair.a;
  const Return& b = *pair.b;
  const double across =
      std::cos(bearing_rad) * (b.y_m - a.y_m) - std::sin(bearing_rad) * (b.x_m - a.x_m);
  r.range_m = (a.x_m * b.y_m - a.y_m * b.x_m) / across;
  r.bearing_rad = std::remainder(bearing_rad, 2.0 * std::numbers::pi);
  r.x_m = r.range_m * std::cos(bearing_rad);
  r.y_m = r.range_m * std::sin(bearing_rad);
}

// Places of the grid in [a, b), in the direction of the scan; that of b too where nothing goes on.
void add_between(const Pair& pair, const ResampleGrid& grid, std::vector<Return>& out) {
  const auto [from, to] = places_of(pair, grid);
  const double sense = to > from ? 1.0 : -1.0;
  const double first = std::ceil(sense * from - kOnPlace);
  const double end =
      pair.is_last ? std::floor(sense * to + kOnPlace) + 1.0 : std::ceil(sense * to - kOnPlace);
  const double steps = std::max(end - first, 0.0);
  if (steps > kMostPlaces)
    throw Error(ErrorKind::kUsage,
                "resample: the step is too small for the scan: between two of "
                "its returns it has more than a million places");
  for (std::uint64_t step = 0; static_cast<double>(step) < steps; ++step) {
    const double place = sense * (first + static_cast<double>(step));
    const double part = to == from ? 0.0 : std::clamp((place - from) / (to - from), 0.0, 1.0);
    Return r = between(*pair.a, *pair.b, part);
    if (grid.axis == ResampleGrid::Axis::kBearing && to != from)
      move_to_bearing(pair, place * grid.step, r);
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
  const detail::ScanNeighbours good(scan);
  const auto is_used = [&](std::size_t k) {
    if (k + 1 >= good.size()) return false;
    return !good.is_gap(k) || (fill_gaps_m && good.distance_m(k) <= *fill_gaps_m);
  };
  for (std::size_t k = 0; k + 1 < good.size(); ++k) {
    if (is_used(k))
      add_between({&good.at(k), &good.at(k + 1), good.is_gap(k), !is_used(k + 1)}, grid,
                  out.returns);
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
