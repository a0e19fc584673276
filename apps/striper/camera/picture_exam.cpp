// SPDX-License-Identifier: Apache-2.0
#include "camera/picture_exam.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "program/terminal_events.hpp"

namespace striper::program {
namespace {

constexpr double kOverexposed = 0.02;     // Of the pixels, the stripe's own apart.
constexpr double kSeenAtLeast = 0.1;      // Of the exposures: the view may be empty for a while.
constexpr double kFaint = 0.1;            // Of full scale.
constexpr double kBlurred_px = 8.0;       // Full width at half the height.
constexpr double kWidthOfSigma = 2.3548;  // The same of a Gaussian.
constexpr double kMost = 0.5;
constexpr double kNextLine_px =
    3.0;  // A stripe is no further from where it was one scan line before.
constexpr double kOtherAxis = 0.2;  // So much more goes on along the other axis.
// What goes on from side to side there, and hardly at all here, is the stripe: a step in the ground
// turns a quarter of one that runs along rows.
constexpr double kFromSideToSide = 0.9;
constexpr double kHardly = 0.4;

double part(std::uint64_t of, std::uint64_t all) {
  return static_cast<double>(of) / static_cast<double>(std::max<std::uint64_t>(all, 1));
}

double median(std::vector<double> values) { return upper_median(values); }

AmbientOptions ambient_options(const ScannerOptions& options) {
  AmbientOptions ambient = options.ambient;
  ambient.axis = options.stripe.axis;
  ambient.noise = options.stripe.noise;
  ambient.events = options.events;
  return ambient;
}

// One stripe a scan line along either axis, whatever the capture would take.
std::unique_ptr<StripeExtractor> plain_extractor(StripeAxis axis) {
  ExtractOptions options;
  options.axis = axis;
  return make_extractor(options);
}

StripeAxis other(StripeAxis axis) {
  return axis == StripeAxis::kColumns ? StripeAxis::kRows : StripeAxis::kColumns;
}

const char* lines_of(const Stripe& stripe) {
  return stripe.axis == StripeAxis::kColumns ? "columns" : "rows";
}

// How many clipped pixels in a row the stripe's centre lies in; 0 where it is not clipped.
std::uint64_t clipped_at(const cv::Mat& clipped, const Stripe& stripe, std::size_t i) {
  const bool columns = stripe.axis == StripeAxis::kColumns;
  const AxisGrid& across = columns ? stripe.grid.v : stripe.grid.u;
  const int size = columns ? clipped.rows : clipped.cols;
  const auto is_clipped = [&](int at) {
    if (at < 0 || at >= size) return false;
    const auto* const row = clipped.ptr(columns ? at : stripe.line[i]);
    return row[columns ? stripe.line[i] : at] != 0;
  };
  const int centre = static_cast<int>(std::lround(across.index(stripe.across_px[i])));
  if (!is_clipped(centre)) return 0;
  int first = centre;
  int last = centre;
  while (is_clipped(first - 1)) --first;
  while (is_clipped(last + 1)) ++last;
  return static_cast<std::uint64_t>(last - first + 1);
}

}  // namespace

ImageExam::ImageExam(const ScannerSetup& setup)
    : options_(setup.options),
      ambient_(ambient_options(setup.options)),
      extractor_(make_extractor(setup.options.stripe)),
      along_(setup.options.stripe.axis),
      across_(other(setup.options.stripe.axis)),
      projector_(setup.model ? ScanProjector(*setup.model, setup.options.scan) : ScanProjector()) {}

void ImageExam::look_at(const Frame& frame) {
  if (frame.status != FrameStatus::kOk || frame.image.empty()) return;
  ++frames_;
  if (exposures_with_stripe_ == 0) kept_.keep(frame);
  ambient_.push(frame);
  look_at_lit_exposures();
}

void ImageExam::look_at_lit_exposures() {
  while (const LitFrame* const lit = ambient_.next()) look_at(*lit);
}

void ImageExam::look_at(const LitFrame& exposure) {
  ++exposures_;
  full_scale_dn_ = exposure.full_scale_dn;
  double brightest_dn = 0.0;
  cv::minMaxIdx(exposure.lit, nullptr, &brightest_dn);
  brightest_dn_ = std::max(brightest_dn_, brightest_dn);
  levels_dn_ += cv::mean(exposure.lit)[0];
  cv::compare(exposure.lit, exposure.full_scale_dn, clipped_, cv::CMP_GE);
  pixels_ += exposure.lit.total();
  clipped_pixels_ += static_cast<std::uint64_t>(cv::countNonZero(clipped_));

  along_.look_at(exposure);
  across_.look_at(exposure);
  extractor_->extract(exposure, stripe_);
  projector_.project(stripe_, exposure.laser, scan_);
  if (stripe_.is_seen) ++exposures_with_stripe_;
  lines_ += static_cast<std::uint64_t>(stripe_.line_count);
  for (std::size_t i = 0; i < stripe_.size(); ++i) {
    const ReturnStatus status = stripe_.status[i];
    if (verdict(status) == Verdict::kMissing || status == ReturnStatus::kWeak) continue;
    if (status == ReturnStatus::kOutlier) {
      ++outliers_;
      continue;
    }
    heights_dn_.push_back(stripe_.amplitude_dn[i]);
    widths_px_.push_back(kWidthOfSigma * stripe_.width_px[i]);
    const std::uint64_t own = clipped_at(clipped_, stripe_, i);
    clipped_pixels_ -= own;
    if (own > 0) ++clipped_peaks_;
    if (verdict(status) == Verdict::kDoubtful && status != ReturnStatus::kSaturated) ++doubtful_;
    if (verdict(scan_.returns[i].status) == Verdict::kMissing) ++off_the_plane_;
  }
}

bool ImageExam::is_overexposed() const noexcept {
  return part(clipped_pixels_, pixels_) > kOverexposed;
}

ImageExam::Continuity::Continuity(StripeAxis axis) : extractor_(plain_extractor(axis)) {
  stripe_.axis = axis;
}

void ImageExam::Continuity::look_at(const LitFrame& exposure) {
  const auto is_there = [&](std::size_t i) {
    return stripe_.status[i] == ReturnStatus::kOk || stripe_.status[i] == ReturnStatus::kSaturated;
  };
  extractor_->extract(exposure, stripe_);
  for (std::size_t i = 0; i + 1 < stripe_.size(); ++i) {
    const double step_px = std::abs(stripe_.across_px[i + 1] - stripe_.across_px[i]);
    ++neighbours_;
    if (is_there(i) && is_there(i + 1) && step_px <= kNextLine_px) ++continued_;
  }
}

double ImageExam::Continuity::part() const noexcept {
  return program::part(continued_, neighbours_);
}

const char* ImageExam::Continuity::lines() const noexcept { return lines_of(stripe_); }

void ImageExam::conclude(std::vector<Event>& findings) {
  ambient_.finish();
  look_at_lit_exposures();
  if (frames_ == 0) return;
  if (exposures_ == 0) {
    findings.push_back({"picture_unlit", fmt::format("none of {} frames could be scanned", frames_),
                        "the laser lights none of them, or none beside a dark one: what laser= "
                        "says is not what the laser does"});
    return;
  }
  findings.push_back(
      {"pattern_found", fmt::format("{}", fmt::join(decisions(ambient_.status()), ", "))});
  conclude_light(findings);
  if (!has_stripe()) {
    const auto there = best_sighting(kept_.frames(), options_);
    if (there) return conclude_stripe_elsewhere(*there, findings);
    if (!is_overexposed()) conclude_without_stripe(findings);
    return;
  }
  conclude_axis(findings);
  conclude_stripe(findings);
  conclude_model(findings);
}

// Two stripes that are as bright as each other, or one that is clipped all along, are seen though
// no return is sure: then most scan lines show something that is no outlier.
bool ImageExam::has_stripe() const noexcept {
  const bool is_sure = part(exposures_with_stripe_, exposures_) >= kSeenAtLeast;
  return is_sure || part(widths_px_.size(), lines_) > kMost;
}

void ImageExam::conclude_stripe_elsewhere(const StripeSighting& there,
                                          std::vector<Event>& findings) const {
  const std::string options = options_for(there, options_);
  const std::string tried =
      fmt::format("no laser stripe along {} in channel {}, but {}", to_string(options_.stripe.axis),
                  to_string(options_.ambient.channel), describe(there));
  if (options.empty()) {
    findings.push_back({"not_in_the_plane", tried + ", where the model has none",
                        "the model is of another striper, or camera or laser were moved: calibrate "
                        "it anew"});
    return;
  }
  const bool is_other_axis = there.axis != options_.stripe.axis;
  findings.emplace_back(is_other_axis ? EventCode("other_axis") : EventCode("other_channel"), tried,
                        fmt::format("say {}, and in the model stripe: {{axis: {}, channel: {}}}",
                                    options, to_string(there.axis), to_string(there.channel)));
}

void ImageExam::conclude_light(std::vector<Event>& findings) const {
  if (!is_overexposed()) return;
  findings.push_back(
      {"picture_overexposed",
       fmt::format("{:.0f} % of the pixels are saturated", 100.0 * part(clipped_pixels_, pixels_)),
       "exposure too long or too much daylight: shorten exposure_us, close the "
       "iris, fit the band-pass filter"});
}

// A lantern post does so too where the stripe does not reach from side to side.
void ImageExam::conclude_axis(std::vector<Event>& findings) const {
  if (across_.part() < along_.part() + kOtherAxis) return;
  const bool is_there = across_.part() >= kFromSideToSide && along_.part() < kHardly;
  findings.push_back(
      {is_there ? Severity::kError : Severity::kWarning, "other_axis",
       fmt::format(
           "what goes on from scan line to scan line runs along the other axis: in {:.0f} % of the "
           "{}, and in {:.0f} % of the {}",
           100.0 * across_.part(), across_.lines(), 100.0 * along_.part(), along_.lines()),
       fmt::format("if that is the stripe, say --axis {0}, and in the model stripe: {{axis: {0}}}",
                   across_.lines())});
}

void ImageExam::conclude_stripe(std::vector<Event>& findings) const {
  const std::uint64_t found = widths_px_.size();
  findings.push_back({"stripe_seen", fmt::format("a stripe in {:.0f} % of the {}",
                                                 100.0 * part(found, lines_), lines_of(stripe_))});
  const double height = median(heights_dn_) / full_scale_dn_;
  if (height < kFaint) {
    findings.push_back(
        {"stripe_faint", fmt::format("the stripe is faint: {:.0f} % of full scale", 100.0 * height),
         "exposure too short for this laser: lengthen exposure_us (not beyond its pulse), open "
         "the iris, or raise gain"});
  }
  const double width_px = median(widths_px_);
  if (width_px > kBlurred_px) {
    findings.push_back(
        {"stripe_wide",
         fmt::format("the stripe is {:.1f} pixels wide at half its height", width_px),
         "out of focus: turn the lens' ring until it is 2 to 4, then lock it; or "
         "the laser's own focus"});
  }
  if (part(clipped_peaks_, found) > kMost && !is_overexposed()) {
    findings.push_back({Severity::kWarning, "stripe_saturated",
                        fmt::format("the stripe is saturated in {:.0f} % of its {}",
                                    100.0 * part(clipped_peaks_, found), lines_of(stripe_)),
                        "fine for ranges while it is narrow; shorten exposure_us to see less of "
                        "the surroundings"});
  }
  const double doubtful = part(doubtful_ + outliers_, found + outliers_);
  if (doubtful > kMost) {
    findings.push_back(
        {"stripe_doubtful",
         fmt::format("{:.0f} % of what was found is not plainly the stripe", 100.0 * doubtful),
         "other bright lines in view, or a stripe along the other axis (--axis): "
         "`striper capture --doubtful` says what is wrong with each"});
  }
}

void ImageExam::conclude_without_stripe(std::vector<Event>& findings) const {
  if (brightest_dn_ < kFaint * full_scale_dn_) {
    findings.push_back({Severity::kError, "no_stripe",
                        fmt::format("the images are dark: the brightest pixel is {:.0f} of {}",
                                    brightest_dn_, full_scale_dn_),
                        "exposure too short, lens cap on, or laser off: lengthen exposure_us, "
                        "raise gain, check the laser's supply and strobe="});
    return;
  }
  findings.push_back({Severity::kError, "no_stripe",
                      fmt::format("no laser stripe in these images, along columns or rows, in any "
                                  "channel: is it on, is it in view, which axis? The surroundings "
                                  "are at {:.0f} of {}",
                                  levels_dn_ / static_cast<double>(exposures_), full_scale_dn_),
                      "laser off or out of view, or laser= is wrong: check its supply, interlock "
                      "and strobe= line; does it fire during the exposure? A stripe from top to "
                      "bottom wants --axis rows"});
}

void ImageExam::conclude_model(std::vector<Event>& findings) const {
  const double off = part(off_the_plane_, widths_px_.size());
  if (off < kMost) return;
  findings.push_back({"not_in_the_plane",
                      fmt::format("{:.0f} % of the stripe is where the model's laser plane cannot "
                                  "be seen",
                                  100.0 * off),
                      "the model is of another striper, or camera or laser were moved: calibrate "
                      "it anew"});
}

}  // namespace striper::program
