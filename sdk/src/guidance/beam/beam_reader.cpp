// SPDX-License-Identifier: Apache-2.0
#include "guidance/beam/beam_reader.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace striper::detail {
namespace {

// Half a second of sweeps tells the gain to some percent; it changes with weather, not with metres.
constexpr long kLearnAtLeast = 100;
constexpr double kMemory = 2000.0;  // Sweeps.
// Bare road that is darker than this many counts is noise and offset: it tells no gain.
constexpr double kLeastRoad = 16.0;
constexpr double kLeastGain = 0.2;
constexpr double kMostGain = 5.0;
// Beside paint so many samples are not bare: the spot's edge is on it.
constexpr std::size_t kBeside = 4;

// Worn at both edges, a line may keep less than half of its width; what is predicted keeps narrower
// things out.
constexpr double kWidthTolerance = 0.6;

PaintFinderOptions finder_options(const GuidanceBeam& beam, double stripe_width_m) {
  PaintFinderOptions options;
  options.samples = static_cast<std::size_t>(beam.samples);
  options.threshold = beam.threshold;
  options.width_samples = stripe_width_m / beam.sample_m();
  options.width_tolerance = kWidthTolerance;
  return options;
}

}  // namespace

BeamReader::BeamReader(const GuidanceBeam& beam, double stripe_width_m)
    : beam_(beam), finder_(finder_options(beam, stripe_width_m)) {
  const auto samples = static_cast<std::size_t>(beam.samples);
  gain_.assign(samples, 1.0);
  level_.assign(samples, 0.0);
  times_.assign(samples, 0);
  is_bare_.assign(samples, 1);
  even_.reserve(samples);
  seen_.reserve(samples);
  if (beam.response.empty()) return;
  // Nodes at equal distances, straight between them.
  for (std::size_t i = 0; i < samples; ++i) {
    const double at = static_cast<double>(i) * static_cast<double>(beam.response.size() - 1) /
                      static_cast<double>(samples - 1);
    const auto node = std::min(static_cast<std::size_t>(at), beam.response.size() - 1);
    const auto next = std::min(node + 1, beam.response.size() - 1);
    const double share = at - static_cast<double>(node);
    gain_[i] = (1.0 - share) * beam.response[node] + share * beam.response[next];
  }
}

std::span<const SeenPaint> BeamReader::read(std::span<const double> samples) {
  samples = samples.first(std::min(samples.size(), gain_.size()));
  seen_.clear();
  examine(samples);
  if (flaw_.is_constant) return seen_;
  even_.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) even_[i] = samples[i] / gain_[i];
  for (const PaintLine& line : finder_.find(even_)) add(line, true);
  for (const PaintLine& line : finder_.others()) add(line, false);
  std::sort(seen_.begin(), seen_.end(),
            [](const SeenPaint& a, const SeenPaint& b) { return a.left_m > b.left_m; });
  if (beam_.response.empty()) learn(samples);
  return seen_;
}

void BeamReader::examine(std::span<const double> samples) noexcept {
  flaw_ = {};
  const auto is_number = [](double sample) { return std::isfinite(sample); };
  if (samples.empty() || !std::all_of(samples.begin(), samples.end(), is_number)) {
    flaw_.is_constant = true;  // It tells as little.
    return;
  }
  const double full = std::ldexp(1.0, beam_.bits) - 1.0;
  flaw_.is_constant = std::all_of(samples.begin(), samples.end(),
                                  [&](double sample) { return sample == samples.front(); });
  const auto clipped =
      std::count_if(samples.begin(), samples.end(), [&](double s) { return s >= full; });
  flaw_.is_clipped = 2 * clipped > std::ssize(samples);
}

void BeamReader::add(const PaintLine& line, bool is_line) {
  SeenPaint paint;
  paint.left_m = beam_.lateral_m(line.begin);
  paint.right_m = beam_.lateral_m(line.end);
  paint.sigma_m = line.sigma() * beam_.sample_m();
  paint.height = line.height;
  paint.delay_s = beam_.delay_s(line.centre());
  paint.is_line = is_line;
  seen_.push_back(paint);
}

void BeamReader::learn(std::span<const double> samples) noexcept {
  if (samples.size() != gain_.size()) return;
  std::fill(is_bare_.begin(), is_bare_.end(), char{1});
  const auto mark = [&](const PaintLine& line) {
    const auto first = static_cast<std::size_t>(std::max(line.begin, 0.0));
    const auto last = static_cast<std::size_t>(line.end) + kBeside;
    for (std::size_t i = first > kBeside ? first - kBeside : 0;
         i <= std::min(last, samples.size() - 1); ++i) {
      is_bare_[i] = 0;
    }
  };
  for (const PaintLine& line : finder_.find(even_)) mark(line);
  for (const PaintLine& line : finder_.others()) mark(line);
  ++learnt_;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (is_bare_[i] == 0) continue;
    const double share = 1.0 / std::min(static_cast<double>(++times_[i]), kMemory);
    level_[i] += share * (samples[i] - level_[i]);
  }
  if (learnt_ % kLearnAtLeast == 0) take_gain();
}

// Samples that the stripe has always covered have no level: the parabola goes on over them.
void BeamReader::take_gain() noexcept {
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  std::size_t known = 0;
  double sum = 0.0;
  const auto powers = [&](std::size_t i) {
    const double side = 2.0 * static_cast<double>(i) / static_cast<double>(gain_.size() - 1) - 1.0;
    return Eigen::Vector3d(1.0, side, side * side);
  };
  for (std::size_t i = 0; i < gain_.size(); ++i) {
    if (times_[i] < kLearnAtLeast / 4) continue;
    squares += powers(i) * powers(i).transpose();
    products += powers(i) * level_[i];
    sum += level_[i];
    ++known;
  }
  if (2 * known < gain_.size() || sum / static_cast<double>(known) < kLeastRoad) return;
  const Eigen::Vector3d parabola = squares.ldlt().solve(products);
  for (std::size_t i = 0; i < gain_.size(); ++i) {
    gain_[i] = std::clamp(powers(i).dot(parabola) / parabola[0], kLeastGain, kMostGain);
  }
}

}  // namespace striper::detail
