// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <striper/core/controls.hpp>
#include <striper/core/frame.hpp>
#include <striper/scan/scan_span.hpp>

namespace striper {

/// How bright the stripe shall be. Fractions of the image's full scale.
struct ExposureOptions {
  /// What this part of the stripe does not exceed, background included, ...
  double percentile = 0.9;
  /// ... shall be so bright: half leaves room for light that doubles between two exposures.
  double target = 0.5;
  /// The exposure is left alone while it is right within this factor: each change costs the pairs
  /// of lit and dark exposures about it.
  double tolerance = 1.25;
};

/// Automatic exposure by the stripe itself, whatever the rest of the image shows: sets a source's
/// `exposure_us` so that the stripe, with the light beside it, neither clips nor drowns in noise.
///
/// Light is proportional to the exposure, and every frame says how long its own was: each frame,
/// lit or dark, shows the light beside the stripe, and each scan what the laser adds, however late
/// it comes. So one step goes to the exposure that would have been right. Where too much there is
/// clipped, or there is no stripe in an image that is clipped or dark, the exposure goes down or
/// up by a factor, once for each frame that was taken with what was set last.
///
/// Not thread-safe. It looks at some thousand pixels of a frame of any size; no allocation after
/// the first scans.
class ExposureControl {
 public:
  /// @param controls of the source; outlives this.
  /// @throws Error{kUnsupported} where exposure_us cannot be set, Error{kDevice}.
  explicit ExposureControl(Controls& controls, const ExposureOptions& options = {});

  /// Looks at a frame and at the scans that it gave, which may be of earlier ones, and sets the
  /// exposure where another is right. Frames without a known exposure are taken to have that which
  /// was set last. @throws Error{kDevice} where the source refuses.
  void update(const Frame& frame, ScanSpan scans);

  double exposure_us() const noexcept { return exposure_us_; }
  /// How often it was changed.
  std::uint64_t changes() const noexcept { return changes_; }

 private:
  // Of one frame of late: how long it was exposed, and what most of its pixels show.
  struct Image {
    std::uint64_t sequence = 0;
    double exposure_us = 0.0;
    double brightness = 0.0;  // Of the full scale.
    double clipped = 0.0;     // The part of its pixels that is.
  };

  // Where the stripe was of late, what is beside it, and what the laser gave.
  struct Place {
    double u_px, v_px;
    double off_u_px, off_v_px;
    double stripe_dn_per_us;
  };

  Image look_at(const Frame& frame);
  const Image* image_of(const PolarScan& scan) const noexcept;
  bool is_as_set(const Image& image) const noexcept;
  void remember(const PolarScan& scan, const Image& image);
  double wanted_for(const Frame& frame, const Image& image);
  double wanted_without_stripe(const Image& image) const;
  void set(double wanted_us);

  Controls& controls_;
  ExposureOptions options_;
  double shortest_us_ = 0.0;
  double longest_us_ = 0.0;
  double exposure_us_ = 0.0;
  std::uint64_t changes_ = 0;
  std::vector<Image> images_;  // The latest, the newest last.
  std::vector<Place> places_;
  bool is_clipped_ = false;    // Too much of the last scan, which has the present exposure.
  std::vector<double> rates_;  // Scratch.
  std::vector<std::uint16_t> pixels_;
};

}  // namespace striper
