// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/paint_finder.hpp>

namespace striper {
namespace {

// Of Gaussian noise, sigma over the median absolute deviation.
constexpr double kSigmaOfDeviation = 1.4826;
// A converter's step has this noise where the sweep shows none.
constexpr double kLeastNoise = 0.28867513459481287;  // 1 / sqrt(12)
// Gaussian noise exceeds it once in 3.5 million samples, 25 000 sweeps of 142; the width gate takes
// such samples away, as they stand alone.
constexpr double kAutomaticSigmas = 5.0;

struct Edge {
  double at = 0.0;
  double sigma = 0.0;
};

// Where the signal crosses `level` between two samples, the one off the paint at `off`, the one on
// it at `on`. Noise moves either sample. A spot narrower than a sample's pitch leaves the place
// between them open too: all of it (1/sqrt(12)) where the whole height lies between the two, hardly
// any where it spreads over more. Of the powers 1 to 4 the third keeps the pulls of Gaussian spots
// of sigma 0.4 to 1 pitch nearest to 1 (PaintFinder.SigmaIsTheSpread); of sharper ones it is up to
// 1.7 times too small.
Edge edge_between(std::span<const double> sweep, std::size_t off, std::size_t on, double level,
                  double height, double noise) {
  const double slope = sweep[on] - sweep[off];
  const double share = (level - sweep[off]) / slope;
  const double direction = on > off ? 1.0 : -1.0;
  const double from_noise = noise * std::hypot(share, 1.0 - share) / slope;
  const double from_pitch = kLeastNoise * std::pow(std::min(slope / height, 1.0), 3);
  return {static_cast<double>(off) + direction * share, std::hypot(from_noise, from_pitch)};
}

}  // namespace

void PaintFinderOptions::validate() const {
  require_value(samples >= 3, "PaintFinderOptions::samples", static_cast<double>(samples),
                "3 or more");
  require_value(!std::isinf(threshold), "PaintFinderOptions::threshold", threshold,
                "a number, or NaN for automatic");
  require_value(std::isfinite(width_samples) && width_samples > 0.0,
                "PaintFinderOptions::width_samples", width_samples, "more than 0");
  require_value(width_tolerance > 0.0 && width_tolerance < 1.0,
                "PaintFinderOptions::width_tolerance", width_tolerance, "between 0 and 1");
}

double PaintLine::sigma() const noexcept { return 0.5 * std::hypot(sigma_begin, sigma_end); }

PaintFinder::PaintFinder(const PaintFinderOptions& options) : options_(options) {
  options_.validate();
  sorted_.reserve(options_.samples);
  lines_.reserve(options_.samples / 2 + 1);
  others_.reserve(options_.samples / 2 + 1);
}

double PaintFinder::median_of(std::span<const double> values) noexcept {
  sorted_.assign(values.begin(), values.end());
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  return *middle;
}

PaintFinder::Road PaintFinder::measure_road(std::span<const double> sweep) noexcept {
  Road road;
  road.level = median_of(sweep);
  for (double& value : sorted_) value = std::abs(value - road.level);
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>(sorted_.size() / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  road.noise = std::max(kSigmaOfDeviation * *middle, kLeastNoise);
  return road;
}

std::span<const PaintLine> PaintFinder::find(std::span<const double> sweep) noexcept {
  lines_.clear();
  others_.clear();
  sweep = sweep.first(std::min(sweep.size(), options_.samples));
  const auto is_number = [](double value) { return std::isfinite(value); };
  if (sweep.empty() || !std::all_of(sweep.begin(), sweep.end(), is_number)) return {};
  const Road road = measure_road(sweep);
  const double threshold = std::isnan(options_.threshold)
                               ? road.level + kAutomaticSigmas * road.noise
                               : options_.threshold;
  for (std::size_t first = 0; first < sweep.size();) {
    std::size_t past = first;
    while (past < sweep.size() && sweep[past] > threshold) ++past;
    if (past > first) add_line(sweep, first, past, road);
    first = past + 1;
  }
  return lines_;
}

// The samples from `first` to before `past` are above the threshold.
void PaintFinder::add_line(std::span<const double> sweep, std::size_t first, std::size_t past,
                           const Road& road) noexcept {
  const double height = median_of(sweep.subspan(first, past - first)) - road.level;
  if (!(height > 0.0)) return;
  const double half = road.level + 0.5 * height;
  std::size_t last = past - 1;
  while (sweep[first] < half) ++first;  // Ends: half of the samples reach the median.
  while (sweep[last] < half) --last;
  while (first > 0 && sweep[first - 1] >= half) --first;
  while (last + 1 < sweep.size() && sweep[last + 1] >= half) ++last;
  if (first == 0 || last + 1 == sweep.size()) return;

  const Edge begin = edge_between(sweep, first - 1, first, half, height, road.noise);
  const Edge end = edge_between(sweep, last + 1, last, half, height, road.noise);
  const double misfit = std::abs(end.at - begin.at - options_.width_samples);
  const bool is_line = misfit <= options_.width_tolerance * options_.width_samples;
  std::vector<PaintLine>& found = is_line ? lines_ : others_;
  // Two pieces above a high threshold can be one at half height.
  if (!found.empty() && begin.at <= found.back().end) return;
  found.push_back({begin.at, end.at, begin.sigma, end.sigma, height});
}

}  // namespace striper
