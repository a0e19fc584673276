// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// The pixels of one scan line about a stripe, those that are not masked.
struct EdgeProfile {
  static constexpr std::size_t kMost = 64;

  std::size_t count = 0;
  bool has_dark = false;
  bool is_clipped = false;          // Some pixel is.
  std::array<double, kMost> at;     // Pixel of the image.
  std::array<double, kMost> lit;    // DN,
  std::array<bool, kMost> clipped;  // which was so much or more,
  std::array<double, kMost> dark;   // where there is a dark exposure,
  std::array<double, kMost> extra;  // and what motion leaves in lit - dark, DN^2.
};

/// What a scan line shows where the surface's reflectance steps under the stripe: (ambient + laser)
/// x (1 -+ contrast), seen through a lens with blur, above the black level. Pixels of the image,
/// DN.
struct EdgeModel {
  enum Parameter : std::size_t {
    kPosition,   // Of the stripe.
    kAmplitude,  // Where the reflectance is the mean of both sides.
    kContrast,   // (after - before) / (after + before), of reflectance.
    kEdge,       // Where the step is.
    kAmbient,    // Above black, where the reflectance is the mean of both sides.
    kBlack,
    kBlur,   // Sigma of lens and edge; part of the width.
    kWidth,  // The stripe's sigma, without the pixel's box.
    kSlope,  // Of the daylight about the middle of the profile, DN per pixel.
    kCount
  };
  std::array<double, kCount> of{};
};

/// What is known of the parameters beforehand: Gaussians; a sigma of 0 says nothing is known.
struct EdgePrior {
  EdgeModel mean;
  std::array<double, EdgeModel::kCount> sigma{};
};

/// Whether the edge is of the surface's reflectance, or only of the light that falls on it, such as
/// a shadow's: then the laser has no part in it.
enum class EdgeKind { kReflectance, kShadow };

/// A fit of the model.
struct EdgeEstimate {
  EdgeModel model;
  double cost = 0.0;         // Chi squared with the priors' part.
  double misfit = 0.0;       // Chi squared of the pixels over their degrees of freedom.
  double core_misfit = 0.0;  // The same of the pixels that the stripe is on.
  double gain = 0.0;         // Of an edge over none, chi squared.
  double likelihood = 0.0;   // Of reflectance rather than a shadow.
  double variance = -1.0;    // Of the position, pixels^2; negative: there is none.
};

/// Fits the model by damped Gauss-Newton, each pixel weighted with the variance that the model
/// gives it; background pixels that other edges disturb count less. A clipped pixel says only that
/// the model is not below it.
EdgeEstimate fit_edge(const EdgeProfile& profile, const PlanNoise& noise, const EdgePrior& prior,
                      const EdgeModel& start, EdgeKind kind, int most_steps);

/// The best fit of an edge of reflectance from several starts: some steps from each, then from the
/// best of them to the end. Without a start there is none.
EdgeEstimate fit_edge_from(std::span<const EdgeModel> starts, const EdgeProfile& profile,
                           const PlanNoise& noise, const EdgePrior& prior, int first_steps,
                           int most_steps);

}  // namespace striper::detail
