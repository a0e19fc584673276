// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::detail {

/// How a stripe's profile along a scan line differs from a Gaussian, where it lies on a surface
/// that is not at one distance. All per pixel of the scan line, at the middle of the laser
/// plane.
struct ProfileSlopes {
  double rise = 0.0;      ///< Of the height over the laser plane: its second derivative over twice
                          ///< the first. Perspective: on a slope, far pixels see more of it.
  double distance = 0.0;  ///< Of the logarithm of the distance from the laser.
};

/// How far from the middle of the laser plane a fit of a Gaussian finds the stripe, px along the
/// scan line.
///
/// A laser plane whose thickness has the standard deviation s px lights the pixel x with
/// (1 + g x) exp(-x^2 (1 + 2 (t - w) x) / (2 s^2)) to first order: t is the rise, w how the laser
/// plane widens, g = -(2 d + w) how its light fades (over the line that it has grown to, and by the
/// incidence on a plane), d the slope of the distance. The lens blurs that to the width S. Its
/// first moment is s^2 (g - 3 (t - w)); a least-squares fit of a Gaussian of width S, which is
/// insensitive to the Hermite function of third order only as far as that is orthogonal to its
/// derivative, is off by s^2 (g - (t - w) (3 - 1.5 s^2 / S^2)).
///
/// Of a clipped profile the flanks are fitted, and hardly more tells. The 1.5 is the fourth moment
/// of the profile's square over S^2 times the second; of what lies further than c S from the middle
/// it is 2.2 for c = 1, 4.1 for 1.73, 5.1 for 2. That is not modelled: a stripe 1.5 px wide,
/// clipped at a quarter of its height (c = 1.73) on a slope of 34 degrees, is off by 0.013 px where
/// a whole one is by 0.004 (board_stripe_test.cpp).
///
/// Whether the laser plane widens from its source on (w = d) or not (w = 0) is not known: half of
/// it is taken, wrong by 16 % of the whole on the boards of the test.
///
/// Rendered without noise, boards tilted by -45 to 55 degrees, a laser plane 0.4 degrees thick,
/// f 461 px: -0.008 to 0.018 px, growing with the square of the thickness. A scan has the same
/// error, where it crosses a slope: it does not know the slope, and a hundredth of a pixel is below
/// its sigma.
/// @param laser_px the laser plane's own standard deviation in the image. @param width_px with the
/// lens blur, without the pixel's own box.
inline double stripe_skew_px(const ProfileSlopes& slopes, double laser_px, double width_px) {
  const double laser2 = laser_px * laser_px;
  const double share = laser2 / (width_px * width_px + 1.0 / 12.0);
  const double widening = 0.5 * slopes.distance;
  return -laser2 *
         ((slopes.rise - widening) * (3.0 - 1.5 * share) + 2.0 * slopes.distance + widening);
}

}  // namespace striper::detail
