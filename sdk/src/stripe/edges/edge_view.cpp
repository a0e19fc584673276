// SPDX-License-Identifier: Apache-2.0
#include "stripe/edges/edge_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr int kBackgroundPixels = 3;  // Beyond the stripe's reach.

// Lenses that are in focus blur by a third to half a pixel and more; a width that is learnt from
// most scan lines is true to some percent.
constexpr double kBlur = 0.45;
constexpr double kBlurSigma = 0.15;
constexpr double kWidthSigma = 0.045;
constexpr double kSlope = 0.03;  // Of the daylight, per pixel: shading.
constexpr double kContrastSigma = 0.6;
constexpr double kKnownBlack = 1.0 / 255.0;  // Of full scale, where the noise model has it,
constexpr double kUnknownBlack = 0.06;       // and where it does not.

template <typename Pixel>
EdgeProfile profile_at(const LitFrame& frame, StripeAxis axis, int line, double position,
                       double width) {
  const LitLine<Pixel> pixels(frame, axis, line);
  EdgeProfile profile;
  profile.has_dark = !frame.dark.empty();
  const int middle = static_cast<int>(std::lround(position));
  const int reach = std::min(static_cast<int>(std::ceil(kStripeReach * width)) + kBackgroundPixels,
                             static_cast<int>(EdgeProfile::kMost) / 2 - 1);
  StridedLine<const float> variance;
  if (!frame.variance.empty()) variance = image_line<float>(frame.variance, axis, line);
  const int end = std::min(pixels.length(), middle + reach + 1);
  for (int k = std::max(0, middle - reach); k < end; ++k) {
    if (pixels.masked(k)) continue;
    profile.at[profile.count] = k;
    profile.lit[profile.count] = pixels.lit(k);
    profile.clipped[profile.count] = pixels.clipped(k);
    profile.is_clipped = profile.is_clipped || pixels.clipped(k);
    profile.dark[profile.count] = pixels.dark(k);
    profile.extra[profile.count] =
        variance.first != nullptr ? static_cast<double>(variance[k]) : 0.0;
    ++profile.count;
  }
  return profile;
}

}  // namespace

EdgeProfile edge_profile_at(const LitFrame& frame, StripeAxis axis, int line, double position,
                            double width) {
  return frame.lit.depth() == CV_8U ? profile_at<std::uint8_t>(frame, axis, line, position, width)
                                    : profile_at<std::uint16_t>(frame, axis, line, position, width);
}

EdgeEnds ends_of(const EdgeProfile& profile) {
  const auto& values = profile.has_dark ? profile.dark : profile.lit;
  const std::size_t pixels = std::min<std::size_t>(kBackgroundPixels, profile.count / 2);
  EdgeEnds ends;
  for (std::size_t i = 0; i < pixels; ++i) {
    ends.before += values[i];
    ends.after += values[profile.count - 1 - i];
  }
  ends.before /= static_cast<double>(std::max<std::size_t>(1, pixels));
  ends.after /= static_cast<double>(std::max<std::size_t>(1, pixels));
  return ends;
}

EdgePrior edge_prior(const LitFrame& frame, const PlanNoise& noise, const EdgeProfile& profile,
                     double position, double amplitude, double width) {
  const EdgeEnds ends = ends_of(profile);
  const double black = noise.model.black_level_dn;
  const bool is_known = noise.model.dn_per_electron > 0.0 || black > 0.0;
  EdgePrior prior;
  auto& mean = prior.mean.of;
  mean[EdgeModel::kPosition] = mean[EdgeModel::kEdge] = position;
  mean[EdgeModel::kAmplitude] = amplitude;
  mean[EdgeModel::kContrast] = 0.0;
  mean[EdgeModel::kAmbient] = std::max(0.0, 0.5 * (ends.before + ends.after) - black);
  mean[EdgeModel::kBlack] = black;
  mean[EdgeModel::kBlur] = std::min(kBlur, 0.7 * width);
  mean[EdgeModel::kWidth] = width;
  auto& sigma = prior.sigma;
  sigma[EdgeModel::kPosition] = 2.0 * width;
  sigma[EdgeModel::kEdge] = kStripeReach * width + kBackgroundPixels;
  sigma[EdgeModel::kContrast] = kContrastSigma;
  sigma[EdgeModel::kBlack] = (is_known ? kKnownBlack : kUnknownBlack) * frame.full_scale_dn;
  const double seen = std::abs(ends.after - ends.before) / (2.0 * kStripeReach * width);
  sigma[EdgeModel::kSlope] = std::max(seen, kSlope * std::max(1.0, mean[EdgeModel::kAmbient]));
  sigma[EdgeModel::kBlur] = std::min(kBlurSigma, 0.3 * width);
  sigma[EdgeModel::kWidth] = kWidthSigma * width;
  return prior;
}

}  // namespace striper::detail
