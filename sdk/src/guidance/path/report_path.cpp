// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/beam_weights.hpp>
#include <striper/guidance/report_path.hpp>

namespace striper {
namespace {

// There is a row of weights for each of the 2^beams sets; a vehicle has three.
constexpr std::size_t kMostBeams = 8;

// The weights of the beams whose bits are set in `seen`, in the order of all; 0 for the others.
void put_weights(std::span<const double> beam_x_m, unsigned seen, std::span<double> row) {
  std::vector<double> seen_x_m;
  for (std::size_t i = 0; i < beam_x_m.size(); ++i) {
    if ((seen >> i & 1U) != 0) seen_x_m.push_back(beam_x_m[i]);
  }
  const std::vector<double> weights = beam_weights(seen_x_m);
  auto next = weights.begin();
  for (std::size_t i = 0; i < beam_x_m.size(); ++i) {
    if ((seen >> i & 1U) != 0) row[i] = *next++;
  }
}

}  // namespace

void ReportPathOptions::validate() const {
  if (beam_x_m.empty() || beam_x_m.size() > kMostBeams) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("ReportPathOptions::beam_x_m has {} beams - expected 1 to {}",
                            beam_x_m.size(), kMostBeams));
  }
  if (!(alpha >= 0.0 && alpha < 1.0)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("ReportPathOptions::alpha={} - expected 0 up to, but not, 1", alpha));
  }
}

ReportPath::ReportPath(const ReportPathOptions& options)
    : beams_(options.beam_x_m.size()), alpha_(options.alpha) {
  options.validate();
  weights_.resize(beams_ << beams_);
  last_m_.assign(beams_, std::numeric_limits<double>::quiet_NaN());
  for (unsigned seen = 1; seen < 1U << beams_; ++seen) {
    put_weights(options.beam_x_m, seen, std::span(weights_).subspan(seen * beams_, beams_));
  }
}

ReportPathPoint ReportPath::update(std::span<const double> beam_lateral_m) noexcept {
  const std::size_t given = std::min(beam_lateral_m.size(), beams_);
  int seeing = 0;
  for (std::size_t i = 0; i < given; ++i) {
    if (!std::isfinite(beam_lateral_m[i])) continue;
    last_m_[i] = beam_lateral_m[i];
    ++seeing;
  }
  if (seeing == 0) return {lateral_m_, 0};
  unsigned known = 0;
  for (std::size_t i = 0; i < beams_; ++i) {
    if (std::isfinite(last_m_[i])) known |= 1U << i;
  }
  double at_gun_m = 0.0;
  for (std::size_t i = 0; i < beams_; ++i) {
    if ((known >> i & 1U) != 0) at_gun_m += weights_[known * beams_ + i] * last_m_[i];
  }
  // Equation (10); the first answer has none before it.
  lateral_m_ = std::isnan(lateral_m_) ? at_gun_m : (1.0 - alpha_) * at_gun_m + alpha_ * lateral_m_;
  return {lateral_m_, seeing};
}

}  // namespace striper
