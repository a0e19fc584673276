// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>

#include <opencv2/core.hpp>

#include <striper/core/frame.hpp>
#include <striper/core/lit_frame.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// The light that pixel k gets from a Gaussian stripe at `mu` of width `sigma` and peak
/// `amplitude`, integrated over the pixel's box.
inline double box_gaussian(double k, double mu, double sigma, double amplitude) {
  const double scale = 1.0 / (sigma * std::sqrt(2.0));
  return amplitude * sigma * std::sqrt(std::acos(-1.0) / 2.0) *
         (std::erf((k + 0.5 - mu) * scale) - std::erf((k - 0.5 - mu) * scale));
}

/// What a synthetic stripe looks like; each noise is off by default.
struct SyntheticStripe {
  int lines = 64;
  int length = 60;
  std::function<double(int line)> position = [](int) { return 30.0; };
  double sigma_px = 1.0;
  double amplitude_dn = 100.0;
  double background_dn = 10.0;
  double noise_dn = 0.0;
  int bit_depth = 8;
};

/// Renders it with one scan line per column.
inline LitFrame render(const SyntheticStripe& stripe) {
  const bool wide = stripe.bit_depth > 8;
  cv::Mat image(stripe.length, stripe.lines, wide ? CV_16UC1 : CV_8UC1);
  LitFrame frame;
  frame.full_scale_dn = full_scale_dn(stripe.bit_depth);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double light =
          stripe.background_dn +
          box_gaussian(v, stripe.position(u), stripe.sigma_px, stripe.amplitude_dn) +
          (stripe.noise_dn > 0.0 ? normal(0.0, stripe.noise_dn) : 0.0);
      const double dn = std::min<double>(frame.full_scale_dn, std::max(0.0, std::round(light)));
      if (wide) {
        image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(dn);
      } else {
        image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(dn);
      }
    }
  }
  frame.lit = image;
  return frame;
}

/// The same image with rows and columns exchanged, for the other stripe axis.
inline LitFrame transposed(const LitFrame& frame) {
  LitFrame out = frame;
  out.lit = frame.lit.t();
  if (!frame.dark.empty()) out.dark = frame.dark.t();
  if (!frame.masked.empty()) out.masked = frame.masked.t();
  if (!frame.variance.empty()) out.variance = frame.variance.t();
  out.grid = {frame.grid.v, frame.grid.u};
  return out;
}

}  // namespace striper::testing
