// SPDX-License-Identifier: Apache-2.0
#include "stripe/edges/reflectance_edge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/pixel_box.hpp"
#include "stripe/edges/edge_view.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// From there on, the second pair of pixels that is compared.
constexpr int kFarther = 4;
constexpr double kPlain2 = 16.0;  // Variances of a difference: 4 sigma.
// A step that cannot move the stripe by more than this part of its error is none; its middle moves
// by up to sqrt(2 / pi) widths times the contrast.
constexpr double kNoticeable = 0.3;
constexpr double kLargestShift = 0.8;
// A width that departs by so much, and so many errors of the position, is an edge's doing.
constexpr double kOddWidth = 0.1;
constexpr double kOddErrors = 5.0;

constexpr double kWidthRate = 0.06;       // Of a scan line, where the width is learnt.
constexpr double kReflectanceOdds = 9.0;  // Against a shadow's edge.

// Where the fit begins, in widths from the peak that was found: that is on the brighter side, and
// the stripe's middle may be on the darker one.
struct Start {
  double edge;
  double position;
  double contrast;
};
constexpr std::array kStarts{Start{-0.4, -0.3, 0.6}, Start{0.4, 0.3, -0.6}, Start{-0.4, -1.3, 0.8},
                             Start{0.4, 1.3, -0.8},  Start{1.2, 0.0, 0.4},  Start{-1.2, 0.0, -0.4},
                             Start{-2.2, 0.0, 0.4},  Start{2.2, 0.0, -0.4}};
constexpr double kSeenContrast = 0.05;
// What clips may be so many times as high as was reckoned without the edge.
constexpr std::array kHeights{1.0, 2.0};

constexpr int kFirstSteps = 2;
constexpr int kFirstStepsOfClipped = 5;
constexpr int kMostSteps = 10;
// What was tracked from the scan line before is searched for anew where it fits no better, or
// gains less over a shadow: chi squared of three parameters with 90 %.
constexpr double kSuspectMisfit = 1.4;
constexpr double kClearGain = 6.3;
constexpr double kNoContrast = 1e-3;
// Without an edge a stripe may be of any width: what is only wider or narrower has none.
constexpr double kAnyWidth = 0.4;
constexpr double kFaintContrast = 0.15;
// An edge explains the profile better than none does by so much, or there is none: chi squared of
// three parameters, by chance in a scan line of a thousand of those that are looked at.
constexpr double kEvidence = 16.0;
constexpr double kGoodMisfit = 2.0;
constexpr double kLargestSigma = 1.5;  // Widths: nothing is known of a position beyond.
constexpr double kLargestMove = 2.5;
constexpr double kBadMisfit = 4.0;  // As if it were no fit at all.
constexpr double kUnknown = 0.4;    // Widths: the error of a middle somewhere near an edge.

}  // namespace

// A return in pixels of the image.
struct ReflectanceEdges::Place {
  StripeAxis axis;
  int line;
  double position;
  double amplitude;
  double sigma;
  double width;  // Expected, without the pixel's box,
  double step;   // and sensor pixels per pixel.
  bool is_edge;  // The background is brighter on one side.
};

namespace {

// The pixels at which two sides are compared.
struct Sides {
  int near = 0;
  int far = 0;
};

Sides sides_of(const LitFrame& frame, double width) {
  // The dark exposure shows the edge under the stripe itself.
  if (!frame.dark.empty()) {
    const int near = std::max(1, static_cast<int>(std::lround(0.8 * width)));
    return {near, near + std::max(1, static_cast<int>(std::lround(width)))};
  }
  const int near = static_cast<int>(std::ceil(kStripeReach * width)) + 1;
  return {near, near + kFarther};
}

template <typename Pixel>
class EdgeTest {
 public:
  EdgeTest(const LitFrame& frame, const PlanNoise& noise, double width)
      : image_(frame.dark.empty() ? frame.lit : frame.dark),
        noise_(noise),
        has_dark_(!frame.dark.empty()),
        sides_(sides_of(frame, width)),
        slope_part_(has_dark_ ? 0.0 : (sides_.near + 0.5) / (sides_.far + 0.5)),
        least_variance_(noise.model.variance_dn2(noise.model.black_level_dn)),
        shift_(kLargestShift * width) {}

  // Whether the background beside a place is brighter on one side than noise makes it.
  bool is_edge(StripeAxis axis, int line, int at, double sigma) const {
    const auto pixels = image_line<const Pixel>(image_, axis, line);
    const int length = line_length(image_, axis);
    if (at < sides_.far + 1 || at >= length - sides_.far - 1) return false;
    const Pair near = pair(pixels, at, sides_.near);
    const Pair far = pair(pixels, at, sides_.far);
    // A slope of the daylight is no edge, and was subtracted with the dark exposure.
    return differs(near.difference - slope_part_ * far.difference, 1.0 + slope_part_ * slope_part_,
                   near, sigma) ||
           (has_dark_ && differs(far.difference, 1.0, far, sigma));
  }

 private:
  struct Pair {
    double difference;
    double sum;  // Of all four pixels.
  };

  static Pair pair(const StridedLine<const Pixel>& p, int at, int off) {
    const int before = p[at - off] + p[at - off - 1];
    const int after = p[at + off] + p[at + off + 1];
    return {static_cast<double>(after - before), static_cast<double>(after + before)};
  }

  bool differs(double difference, double variances, const Pair& at, double sigma) const {
    // Nearly always the answer is no, and needs no noise of these very pixels.
    const double squared = difference * difference;
    if (squared < kPlain2 * 4.0 * variances * least_variance_) return false;
    if (squared < kPlain2 * 4.0 * variances * noise_.model.variance_dn2(0.25 * at.sum)) {
      return false;
    }
    const double light = std::max(std::abs(difference), at.sum - 4.0 * black());
    return shift_ * std::abs(difference) > kNoticeable * sigma * light;
  }

  double black() const { return noise_.model.black_level_dn; }

  const cv::Mat& image_;
  const PlanNoise& noise_;
  bool has_dark_;
  Sides sides_;
  double slope_part_;      // Of the farther difference, in the nearer one.
  double least_variance_;  // Of a pixel.
  double shift_;
};

// What both hypotheses say of the position, each by its likelihood. In what neither explains,
// their difference counts less.
EdgeEstimate combined(const EdgeEstimate& reflectance, const EdgeEstimate& shadow) {
  const double misfit = std::max(1.0, std::min(reflectance.misfit, shadow.misfit));
  const double gain = std::clamp(0.5 * (shadow.cost - reflectance.cost) / misfit, -30.0, 30.0);
  const double odds = kReflectanceOdds * std::exp(gain);
  const double part = odds / (1.0 + odds);
  const double a = reflectance.model.of[EdgeModel::kPosition];
  const double b = shadow.model.of[EdgeModel::kPosition];
  EdgeEstimate both = part > 0.5 ? reflectance : shadow;
  if (reflectance.variance < 0.0 || shadow.variance < 0.0) {
    both.variance = -1.0;
    return both;
  }
  both.model.of[EdgeModel::kPosition] = part * a + (1.0 - part) * b;
  both.misfit = misfit;
  both.likelihood = part;
  both.variance = part * reflectance.variance * std::max(1.0, reflectance.misfit) +
                  (1.0 - part) * shadow.variance * std::max(1.0, shadow.misfit) +
                  part * (1.0 - part) * (a - b) * (a - b);
  return both;
}

EdgeEstimate search_edge(const EdgeProfile& profile, const PlanNoise& noise,
                         const EdgePrior& prior) {
  const double position = prior.mean.of[EdgeModel::kPosition];
  const double width = with_pixel_box(prior.mean.of[EdgeModel::kWidth]);
  const EdgeEnds ends = ends_of(profile);
  const double light = 2.0 * prior.mean.of[EdgeModel::kAmbient];
  const double seen = (ends.after - ends.before) / std::max(1.0, light);
  const bool is_seen = std::abs(seen) > kSeenContrast;
  const std::size_t heights = profile.is_clipped ? kHeights.size() : 1;
  std::array<EdgeModel, kStarts.size() * kHeights.size()> starts;
  std::size_t count = 0;
  for (const Start& from : kStarts) {
    if (is_seen && from.contrast * seen < 0.0) continue;
    for (std::size_t i = 0; i < heights; ++i) {
      EdgeModel& start = starts[count++] = prior.mean;
      start.of[EdgeModel::kAmplitude] *= kHeights[i];
      start.of[EdgeModel::kEdge] = position + from.edge * width;
      start.of[EdgeModel::kPosition] = position + from.position * width;
      start.of[EdgeModel::kContrast] = is_seen ? std::clamp(seen, -0.9, 0.9) : from.contrast;
    }
  }
  const int first_steps = profile.is_clipped ? kFirstStepsOfClipped : kFirstSteps;
  return fit_edge_from({starts.data(), count}, profile, noise, prior, first_steps, kMostSteps);
}

double cost_without_edge(const EdgeProfile& profile, const PlanNoise& noise, EdgePrior prior) {
  prior.mean.of[EdgeModel::kContrast] = 0.0;
  prior.sigma[EdgeModel::kContrast] = kNoContrast;
  prior.sigma[EdgeModel::kWidth] = kAnyWidth * prior.mean.of[EdgeModel::kWidth];
  return fit_edge(profile, noise, prior, prior.mean, EdgeKind::kShadow, kMostSteps).cost;
}

// The same edge, if it is one of the daylight alone.
EdgeEstimate shadow_beside(const EdgeProfile& profile, const PlanNoise& noise,
                           const EdgePrior& prior, const EdgeEstimate& reflectance) {
  EdgeModel start = reflectance.model;
  start.of[EdgeModel::kPosition] = prior.mean.of[EdgeModel::kPosition];
  return fit_edge(profile, noise, prior, start, EdgeKind::kShadow, kMostSteps);
}

EdgeFinding finding_of(const EdgeEstimate& estimate) {
  const auto& of = estimate.model.of;
  return {true, static_cast<float>(estimate.gain), static_cast<float>(estimate.misfit),
          static_cast<float>(of[EdgeModel::kContrast]),
          static_cast<float>(of[EdgeModel::kEdge] - of[EdgeModel::kPosition])};
}

}  // namespace

void ReflectanceEdges::correct(const LitFrame& frame, const PlanNoise& noise,
                               const WidthModel& width, Stripe& stripe) {
  looked_at_ = 0;
  findings_.reserve(stripe.status.capacity());  // With PeakRule::kAll frames differ.
  findings_.assign(stripe.size(), EdgeFinding{});
  last_line_ = last_moved_line_ = -2;
  width_scale_ = 1.0;
  const AxisGrid& across = grid_across(frame.grid, stripe.axis);
  const double typical = typical_width(width);
  const EdgeTest<std::uint8_t> test8(frame, noise, typical);
  const EdgeTest<std::uint16_t> test16(frame, noise, typical);
  const bool is_8_bit = frame.lit.depth() == CV_8U;
  const double per_step = 1.0 / across.step;
  const double level_width = without_pixel_box(width.at_pivot);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const double sigma = static_cast<double>(stripe.sigma_px[i]) * per_step;
    if (verdict(stripe.status[i]) == Verdict::kMissing || !(sigma > 0.0)) continue;
    const double position = (stripe.across_px[i] - across.offset) * per_step;
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): above 0; lround is a call for each scan line.
    const int at = static_cast<int>(position + 0.5);
    const int line = stripe.line[i];
    const double own =
        width_scale_ * (width.slope == 0.0 ? level_width : without_pixel_box(width.at(position)));
    const double odd = std::abs(static_cast<double>(stripe.width_px[i]) * per_step - own);
    const bool is_edge = is_8_bit ? test8.is_edge(stripe.axis, line, at, sigma)
                                  : test16.is_edge(stripe.axis, line, at, sigma);
    const bool is_suspicious =
        is_edge || last_moved_line_ == line - 1 || odd > kOddWidth * own + kOddErrors * sigma;
    if (!is_suspicious) continue;
    ++looked_at_;
    const Place place{stripe.axis, line, position,    static_cast<double>(stripe.amplitude_dn[i]),
                      sigma,       own,  across.step, is_edge};
    correct_return(frame, noise, place, stripe, i);
  }
}

void ReflectanceEdges::correct_return(const LitFrame& frame, const PlanNoise& noise,
                                      const Place& place, Stripe& stripe, std::size_t i) {
  const double reach = with_pixel_box(place.width);
  const EdgeProfile profile = edge_profile_at(frame, place.axis, place.line, place.position, reach);
  const EdgePrior prior =
      edge_prior(frame, noise, profile, place.position, place.amplitude, place.width);
  const EdgeEstimate both = find_edge(profile, noise, prior, place.line);
  findings_[i] = finding_of(both);
  if (!profile.is_clipped) learn_width(both, place.width);
  const double unknown = std::hypot(place.sigma, kUnknown * place.width);
  if (!(both.gain > kEvidence)) {
    // What is left of a clipped stripe may fit with an edge and without.
    if (profile.is_clipped && place.is_edge && both.misfit < kGoodMisfit)
      stripe.sigma_px[i] = static_cast<float>(unknown * place.step);
    return;
  }
  // A shadow's edge leaves the stripe where it is.
  if (!(both.likelihood > 0.5)) return;
  // Nor is anything known where the dark exposure shows more than one edge, or what is left of a
  // clipped stripe is not as the model has it: its foot is wider on one side, say.
  if ((profile.has_dark || profile.is_clipped) && both.misfit > kGoodMisfit) return;
  last_moved_line_ = place.line;
  const double position = both.model.of[EdgeModel::kPosition];
  const double largest = kLargestSigma * reach;
  const bool is_fitted = both.variance > 0.0 && both.variance < largest * largest &&
                         std::abs(position - place.position) < kLargestMove * reach &&
                         position > -0.5 && position < line_length(frame.lit, place.axis) - 0.5;
  double sigma = unknown;
  if (is_fitted) {
    stripe.across_px[i] += (position - place.position) * place.step;
    stripe.width_px[i] = static_cast<float>(both.model.of[EdgeModel::kWidth] * place.step);
    const double bad =
        std::clamp((both.misfit - kGoodMisfit) / (kBadMisfit - kGoodMisfit), 0.0, 1.0);
    sigma = std::hypot(std::sqrt(both.variance), bad * kUnknown * place.width);
  }
  stripe.sigma_px[i] = static_cast<float>(sigma * place.step);
}

// Where edges go on along the stripe, most scan lines' widths are those of what the edge leaves of
// it.
void ReflectanceEdges::learn_width(const EdgeEstimate& found, double expected) {
  if (!(found.misfit < kGoodMisfit)) return;
  const double scale = width_scale_ * found.model.of[EdgeModel::kWidth] / expected;
  width_scale_ += kWidthRate * (std::clamp(scale, 0.7, 1.5) - width_scale_);
}

// From where the scan line before had it; and from wherever it may be, where that explains the
// profile badly, or hardly better than a shadow does.
EdgeEstimate ReflectanceEdges::find_edge(const EdgeProfile& profile, const PlanNoise& noise,
                                         const EdgePrior& prior, int line) {
  EdgeEstimate reflectance;
  reflectance.cost = std::numeric_limits<double>::infinity();
  EdgeEstimate shadow;
  bool is_doubtful = true;
  bool has_shadow = last_line_ == line - 1;
  if (has_shadow) {
    EdgeModel start = prior.mean;
    for (const auto i : {EdgeModel::kPosition, EdgeModel::kContrast, EdgeModel::kEdge}) {
      start.of[i] = last_.of[i];
    }
    reflectance = fit_edge(profile, noise, prior, start, EdgeKind::kReflectance, kMostSteps);
    shadow = shadow_beside(profile, noise, prior, reflectance);
    const bool is_clear = shadow.cost > reflectance.cost + kClearGain ||
                          std::abs(reflectance.model.of[EdgeModel::kContrast]) < kFaintContrast;
    is_doubtful = !(is_clear && reflectance.misfit < kSuspectMisfit);
  }
  if (is_doubtful) {
    const EdgeEstimate found = search_edge(profile, noise, prior);
    if (found.cost < reflectance.cost) {
      reflectance = found;
      has_shadow = false;
    }
  }
  last_line_ = line;
  last_ = reflectance.model;
  const double without = cost_without_edge(profile, noise, prior);
  // Whether a shadow explains as much matters where there is something to correct.
  reflectance.gain = (without - reflectance.cost) / std::max(1.0, reflectance.misfit);
  if (!(reflectance.gain > kEvidence) && !profile.is_clipped) return reflectance;
  if (!has_shadow) shadow = shadow_beside(profile, noise, prior, reflectance);
  EdgeEstimate both = combined(reflectance, shadow);
  both.gain = (without - std::min(reflectance.cost, shadow.cost)) / both.misfit;
  return both;
}

}  // namespace striper::detail
