// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/core/event.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/scan/scan_projector.hpp>
#include <striper/stripe/extractor.hpp>

#include "options/scanner_arguments.hpp"
#include "run/stripe_watch.hpp"

namespace striper::program {

/// What images show of light, laser and focus, for people in front of a camera.
///
/// The frames go through the stages that would scan them (pattern, fields, channel, daylight,
/// stripe, laser plane), so that what is judged is what a capture would get; the limits are wide.
class ImageExam {
 public:
  explicit ImageExam(const ScannerSetup& setup);

  /// Takes a frame into account, whatever its status.
  void look_at(const Frame& frame);

  /// What was seen; after the last frame.
  void conclude(std::vector<Event>& findings);

 private:
  // How much of what is found in a scan line goes on in the next one, which a stripe does.
  class Continuity {
   public:
    explicit Continuity(StripeAxis axis);

    void look_at(const LitFrame& exposure);
    double part() const noexcept;
    const char* lines() const noexcept;

   private:
    std::unique_ptr<StripeExtractor> extractor_;
    Stripe stripe_;
    std::uint64_t neighbours_ = 0;
    std::uint64_t continued_ = 0;
  };

  void look_at_lit_exposures();
  void look_at(const LitFrame& exposure);
  void conclude_light(std::vector<Event>& findings) const;
  void conclude_axis(std::vector<Event>& findings) const;
  void conclude_stripe(std::vector<Event>& findings) const;
  bool has_stripe() const noexcept;
  void conclude_without_stripe(std::vector<Event>& findings) const;
  void conclude_stripe_elsewhere(const StripeSighting& there, std::vector<Event>& findings) const;
  void conclude_model(std::vector<Event>& findings) const;
  bool is_overexposed() const noexcept;

  ScannerOptions options_;
  KeptFrames kept_;
  AmbientStage ambient_;
  std::unique_ptr<StripeExtractor> extractor_;
  Continuity along_;
  Continuity across_;
  ScanProjector projector_;
  Stripe stripe_;
  PolarScan scan_;
  cv::Mat clipped_;  ///< Where the last exposure is.

  std::uint64_t frames_ = 0;
  std::uint64_t exposures_ = 0;
  std::uint64_t pixels_ = 0;
  std::uint64_t clipped_pixels_ = 0;  ///< But for the stripe's own.
  double brightest_dn_ = 0.0;
  double levels_dn_ = 0.0;  ///< Sum of the exposures' means.
  int full_scale_dn_ = 255;

  std::uint64_t exposures_with_stripe_ = 0;
  std::uint64_t outliers_ = 0;

  // Of the stripe, each element a scan line in which it was found.
  std::uint64_t lines_ = 0;
  std::uint64_t clipped_peaks_ = 0;
  std::uint64_t doubtful_ = 0;
  std::uint64_t off_the_plane_ = 0;
  std::vector<double> heights_dn_;
  std::vector<double> widths_px_;
};

}  // namespace striper::program
