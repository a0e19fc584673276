// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <striper/core/error.hpp>
#include <striper/guidance/guidance_errors.hpp>

namespace striper {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// What is true at a distance; the paint is that of the nearest row.
RoadTruth truth_at(std::span<const RoadTruth> truth, double distance_m) {
  const auto next =
      std::lower_bound(truth.begin(), truth.end(), distance_m,
                       [](const RoadTruth& row, double at_m) { return row.distance_m < at_m; });
  if (next == truth.end()) return truth.back();
  if (next == truth.begin()) return truth.front();
  const RoadTruth& before = *std::prev(next);
  const double share = (distance_m - before.distance_m) / (next->distance_m - before.distance_m);
  RoadTruth at = share < 0.5 ? before : *next;
  at.lateral_m = before.lateral_m + share * (next->lateral_m - before.lateral_m);
  return at;
}

struct Sums {
  double errors = 0.0;
  double squares = 0.0;
  double pulls = 0.0;
  double pulled = 0.0;
  double within = 0.0;
  double largest_m = 0.0;
};

void add(LateralErrors& of, Sums& sums, const LateralLine& line, double true_m, double within_m) {
  if (std::isnan(line.lateral_m)) {
    ++of.unknown;
    return;
  }
  const double error_m = line.lateral_m - true_m;
  ++of.rows;
  sums.errors += error_m;
  sums.squares += error_m * error_m;
  sums.within += std::abs(error_m) <= within_m ? 1.0 : 0.0;
  sums.largest_m = std::max(sums.largest_m, std::abs(error_m));
  if (!(line.sigma_m > 0.0)) return;
  sums.pulls += error_m * error_m / (line.sigma_m * line.sigma_m);
  sums.pulled += 1.0;
}

void finish(LateralErrors& of, const Sums& sums) {
  if (of.rows == 0) return;
  const auto rows = static_cast<double>(of.rows);
  of.mean_m = sums.errors / rows;
  of.rms_m = std::sqrt(sums.squares / rows);
  of.largest_m = sums.largest_m;
  of.within = sums.within / rows;
  if (sums.pulled > 0.0) of.pull = std::sqrt(sums.pulls / sums.pulled);
}

void add_lateral(std::span<const LateralLine> lateral, std::span<const RoadTruth> truth,
                 const GuidanceErrorOptions& options, GuidanceErrors& errors) {
  Sums all;
  Sums here;
  for (const LateralLine& line : lateral) {
    if (!(line.distance_m >= options.from_m) || line.distance_m > truth.back().distance_m) continue;
    const double begin_m = std::floor(line.distance_m / options.stretch_m) * options.stretch_m;
    if (errors.stretches.empty() || errors.stretches.back().from_m != begin_m) {
      if (!errors.stretches.empty()) finish(errors.stretches.back(), here);
      errors.stretches.push_back({});
      errors.stretches.back().from_m = begin_m;
      errors.stretches.back().to_m = begin_m + options.stretch_m;
      here = {};
    }
    const RoadTruth at = truth_at(truth, line.distance_m);
    if (at.line0 == 0) continue;
    add(errors.stretches.back(), here, line, at.lateral_m, options.within_m);
    add(errors.all, all, line, at.lateral_m, options.within_m);
  }
  if (!errors.stretches.empty()) {
    finish(errors.stretches.back(), here);
    errors.all.from_m = errors.stretches.front().from_m;
    errors.all.to_m = errors.stretches.back().to_m;
  }
  finish(errors.all, all);
}

std::vector<DashEndError> true_ends(std::span<const RoadTruth> truth,
                                    const GuidanceErrorOptions& options) {
  std::vector<DashEndError> ends;
  const auto is_painted = [&](const RoadTruth& row) {
    return (options.line == 0 ? row.line0 : row.line1) != 0;
  };
  for (std::size_t i = 1; i < truth.size(); ++i) {
    if (is_painted(truth[i]) == is_painted(truth[i - 1])) continue;
    const double at_m = 0.5 * (truth[i].distance_m + truth[i - 1].distance_m);
    if (at_m >= options.from_m) ends.push_back({is_painted(truth[i]), at_m, kUnknown});
  }
  return ends;
}

}  // namespace

GuidanceErrors guidance_errors(std::span<const LateralLine> lateral, std::span<const GunLine> guns,
                               std::span<const RoadTruth> truth,
                               const GuidanceErrorOptions& options) {
  if (truth.empty()) throw Error(ErrorKind::kBadValue, "no truth; expected a row or more");
  GuidanceErrors errors;
  add_lateral(lateral, truth, options, errors);
  errors.ends = true_ends(truth, options);
  const auto meet = [&](double at_m, bool is_begin) {
    if (at_m < options.from_m || at_m > truth.back().distance_m) return;
    DashEndError* nearest = nullptr;
    for (DashEndError& end : errors.ends) {
      if (end.is_begin != is_begin) continue;
      const bool is_nearer =
          nearest == nullptr || std::abs(end.true_m - at_m) < std::abs(nearest->true_m - at_m);
      if (is_nearer) nearest = &end;
    }
    if (nearest == nullptr || std::abs(nearest->true_m - at_m) > options.near_m) {
      ++errors.invented;
    } else if (std::isnan(nearest->found_m) ||
               std::abs(at_m - nearest->true_m) < std::abs(nearest->error_m())) {
      nearest->found_m = at_m;
    }
  };
  for (const GunLine& line : guns) {
    if (!line.is_on) continue;
    meet(line.from_m, true);
    const bool is_cut = &line == &guns.back();  // The run ends here, not the dash.
    if (!is_cut) meet(line.to_m, false);
  }
  return errors;
}

}  // namespace striper
