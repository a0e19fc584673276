// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// Mean change, from one image of a still scene to the next, of the three-pixel centroid about
/// the brightest pixel (c - a) / (a + b + c), the paper's sub-pixel position, pixels: over all
/// places of a Gaussian stripe between the pixels, in white noise, its background subtracted.
///
/// The noise moves the centroid, and which of 25 pixels is the brightest. By quadrature over the
/// brightest pixel's value and its neighbours', which are less: good to 2 %. About 2 ms. Below a
/// ratio of 7 or so pixels beside a narrow stripe may be the brightest, and a longer scan line
/// changes by more. Of normal errors the mean change is 2 / sqrt(pi) sigma.
/// @param sigma_px of the stripe's Gaussian, without the pixel's own width, 0.3 to 5.
/// @param snr its height over the noise of a pixel, 2 or more; the noise of the exposures
/// that are subtracted counts: one exposure makes it 1 / sqrt(2) of a single image's.
/// @throws Error{kBadValue} naming the value and the bound.
double centroid_change_px(double sigma_px, double snr);

/// The signal-to-noise ratio at which that change is `change_px`, 0.02 to 1: the paper's 0.3 means
/// 5 for a sigma of 0.7 pixels, 8 for 1.2, 21 for 2.0. About 0.3 s.
/// @throws Error{kBadValue} naming the value and the bound.
double centroid_snr(double sigma_px, double change_px);

}  // namespace striper
