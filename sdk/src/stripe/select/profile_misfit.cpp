// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/profile_misfit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr float kReach = 2.5F;
constexpr int kLeastReach = 3;
constexpr int kMostReach = 24;
constexpr float kMostMisfit = 2.0F;

// exp(-x / 2) for x up to 16, in steps of an eighth, and a straight line between.
class HalfExponential {
 public:
  HalfExponential() {
    for (std::size_t i = 0; i < values_.size(); ++i) {
      values_[i] = std::exp(-0.5F * static_cast<float>(i) / kPerUnit);
    }
  }
  float at(float x) const {
    const float place = std::min(x * kPerUnit, static_cast<float>(values_.size()) - 2.0F);
    const auto below = static_cast<std::size_t>(place);
    const float part = place - static_cast<float>(below);
    return values_[below] + part * (values_[below + 1] - values_[below]);
  }

 private:
  static constexpr float kPerUnit = 8.0F;
  std::array<float, 130> values_{};
};

template <typename Pixel>
ProfileMisfit misfit_in(const LitFrame& frame, StripeAxis axis, const Candidate& c) {
  static const HalfExponential kGaussian;
  const LitLine<Pixel> line(frame, axis, c.line);
  const int middle = c.list->across[c.at];
  const int reach =
      std::clamp(static_cast<int>(std::ceil(kReach * c.width)), kLeastReach, kMostReach);
  const int first = std::max(0, middle - reach);
  const int last = std::min(line.length() - 1, middle + reach);
  const float level = c.list->level[c.at];
  const float slope = c.list->slope[c.at];
  const float per_width2 = 1.0F / std::max(0.1F, c.width * c.width);
  float squares = 0.0F;
  for (int k = first; k <= last; ++k) {
    const auto off = static_cast<float>(k) - c.across;
    const float fitted = level + slope * off + c.amplitude * kGaussian.at(off * off * per_width2);
    const float rest = static_cast<float>(line.value(k)) - fitted;
    squares += rest * rest;
  }
  ProfileMisfit misfit;
  const auto count = static_cast<float>(std::max(1, last - first + 1));
  misfit.residual = std::min(std::sqrt(squares / count) / c.amplitude, kMostMisfit);
  const auto value = static_cast<float>(line.value(std::clamp(middle, 0, line.length() - 1)));
  const float before = value - static_cast<float>(line.value(first));
  const float after = value - static_cast<float>(line.value(last));
  const float most = std::max({before, after, 1.0F});
  misfit.sides = std::clamp(std::min(before, after) / most, -1.0F, 1.0F);
  if (c.is_clipped) misfit.residual = 0.0F;
  return misfit;
}

}  // namespace

ProfileMisfit misfit_of(const LitFrame& frame, StripeAxis axis, const Candidate& candidate) {
  return frame.lit.depth() == CV_8U ? misfit_in<std::uint8_t>(frame, axis, candidate)
                                    : misfit_in<std::uint16_t>(frame, axis, candidate);
}

}  // namespace striper::detail
