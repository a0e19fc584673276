// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile_extractor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/log.hpp>

#include "stripe/line_choice.hpp"
#include "stripe/line_view.hpp"
#include "stripe/peak_judge.hpp"
#include "stripe/width_guess.hpp"

namespace striper::detail {
namespace {

constexpr int kLeastLength = 3;
constexpr double kDefaultWidth = 1.5;
constexpr double kPixelBox2 = 1.0 / 12.0;
constexpr double kQuantisation = 1.0 / 12.0;

// The background's own error limits the significance of peaks below this.
constexpr float kWeakSignificance = 8.0F;
// Below this, no better background makes a peak of it.
constexpr float kHopelessSignificance = 2.5F;

// What a stripe beside an edge shows above the brighter side, in sigmas: less than in all of a
// line, since there are few places where noise may do so.
constexpr double kLeastAboveEdge = 3.5;

constexpr int kMostPasses = 3;
constexpr double kWidthSettled = 0.04;

template <typename Pixel>
ProfileImages images_of(const LitFrame& frame, StripeAxis axis) {
  const auto steps = [&](const cv::Mat& image) {
    const auto stride = static_cast<std::ptrdiff_t>(image.step1());
    return axis == StripeAxis::kColumns ? ProfileImages::Steps{1, stride}
                                        : ProfileImages::Steps{stride, 1};
  };
  ProfileImages images;
  images.lit = frame.lit.ptr<Pixel>();
  images.lit_steps = steps(frame.lit);
  if (!frame.dark.empty()) {
    images.dark = frame.dark.ptr<Pixel>();
    images.dark_steps = steps(frame.dark);
  }
  if (!frame.blind.empty()) {
    images.blind = frame.blind.ptr<std::uint8_t>();
    images.blind_steps = steps(frame.blind);
  }
  if (!frame.variance.empty()) {
    images.variance = frame.variance.ptr<float>();
    images.variance_steps = steps(frame.variance);
  }
  images.is_16_bit = sizeof(Pixel) == 2;
  images.length = line_length(frame.lit, axis);
  images.full_scale_dn = frame.full_scale_dn;
  return images;
}

ProfileImages images_of(const LitFrame& frame, StripeAxis axis) {
  return frame.lit.depth() == CV_8U ? images_of<std::uint8_t>(frame, axis)
                                    : images_of<std::uint16_t>(frame, axis);
}

double noise_dn_of(const PlanNoise& noise) {
  return std::sqrt((1.0 + noise.dark_noise_gain) *
                   noise.model.variance_dn2(noise.model.black_level_dn));
}

}  // namespace

void ProfileExtractor::extract(const LitFrame& frame, Stripe& stripe) {
  stripe.axis = options_.axis;
  stripe.grid = frame.grid;
  const int length = line_length(frame.lit, options_.axis);
  if (length < kLeastLength) {
    stripe.reset(line_count(frame.lit, options_.axis));
    return;
  }
  stripe.resize(line_count(frame.lit, options_.axis));

  chunks_.find(frame, options_.axis);
  chunks_.rank(ChunkMaxima::kFirst);
  detection_.prepare(length, options_.false_alarm_rate, options_.weak_false_alarm_rate);
  const ProfileImages images = images_of(frame, options_.axis);
  const PlanNoise noise = noise_of(frame, images);
  const double step = grid_across(frame.grid, options_.axis).step;
  const Current current{frame, images, noise, noise_dn_of(noise), step};

  Learnt& learnt = learnt_of(frame.laser);
  if (!learnt.width.is_known() && !find_first_width(current, learnt.width)) {
    const WidthModel any{kDefaultWidth, 0.0, 0.0, 0.0};
    measure(current, any);
    report(current, any, stripe);
    return;
  }
  measure_and_learn(current, learnt.width);
  report(current, learnt.width.model(), stripe);
  if (!options_.excess_sigma_px) learnt.excess.update(stripe);
  add_other_errors(learnt.excess, step, stripe);
}

ProfileExtractor::Learnt& ProfileExtractor::learnt_of(int laser) {
  const auto index = static_cast<std::size_t>(std::max(0, laser));
  if (index >= learnt_.size()) learnt_.resize(index + 1);
  return learnt_[index];
}

PlanNoise ProfileExtractor::noise_of(const LitFrame& frame, const ProfileImages& images) {
  PlanNoise noise;
  noise.speckle_contrast = options_.speckle_contrast;
  if (!frame.dark.empty()) {
    noise.dark_noise_gain = static_cast<double>(frame.dark_noise_gain);
    const bool is_along_rows = options_.axis == StripeAxis::kColumns;
    if (is_along_rows) noise.dark_noise_correlation = frame.dark_noise_correlation;
  }
  const double exposures =
      1.0 + noise.dark_noise_gain * BackgroundNoise::part_seen(noise.dark_noise_correlation);
  if (options_.noise) {
    if (frame.full_scale_dn != noise_full_scale_dn_) take_given_noise(frame, images, exposures);
    noise.model = given_noise_;
    return noise;
  }
  const double own_dn = background_noise_.update(images, chunks_.best_across(), exposures);
  noise.model.read_noise_dn = std::sqrt(std::max(0.0, own_dn * own_dn - kQuantisation));
  return noise;
}

// The noise that was given, in the DN of these pictures.
void ProfileExtractor::take_given_noise(const LitFrame& frame, const ProfileImages& images,
                                        double exposures) {
  noise_full_scale_dn_ = frame.full_scale_dn;
  const int depth = std::bit_width(static_cast<unsigned>(frame.full_scale_dn));
  const double shown_dn = background_noise_.update(images, chunks_.best_across(), exposures);
  const double value_dn = cv::mean(frame.lit.row(frame.lit.rows / 2))[0];
  given_noise_ = options_.noise->at_likely_depth(depth, shown_dn * shown_dn, value_dn);
  if (options_.noise->bit_depth || !given_noise_.bit_depth) return;
  log(LogLevel::kWarning,
      fmt::format("the model's noise is taken to be that of 8-bit pictures: these, of {} bits, "
                  "have {:.1f} DN where it says {:.1f}; noise.bit_depth in the model says which "
                  "(striper noise writes it)",
                  depth, shown_dn, std::sqrt(options_.noise->variance_dn2(value_dn))));
}

bool ProfileExtractor::find_first_width(const Current& current, WidthTracker& width) const {
  if (options_.stripe_sigma_px) {
    width.set(std::sqrt(*options_.stripe_sigma_px * *options_.stripe_sigma_px + kPixelBox2));
    return true;
  }
  const auto guess = guess_stripe_width(current.frame, options_.axis, chunks_, current.noise_dn);
  if (guess) width.set(*guess);
  return guess.has_value();
}

// Where the width, or the filter that fits it, turns out to be another than was thought, once more
// with that.
void ProfileExtractor::measure_and_learn(const Current& current, WidthTracker& width) {
  const bool refine = options_.method == ExtractMethod::kRefined;
  for (int pass = 1; pass <= kMostPasses; ++pass) {
    const double filter = filter_sigma(width.model(), current.noise, refine);
    measure(current, width.model());
    if (options_.stripe_sigma_px) return;
    const double change = width_learner_.learn(current.frame, options_.axis, candidates_, width);
    const double filter_change = filter_sigma(width.model(), current.noise, refine) / filter;
    const double largest = std::max(std::abs(change - 1.0), std::abs(filter_change - 1.0));
    if (largest < kWidthSettled) return;
  }
}

void ProfileExtractor::measure(const Current& current, const WidthModel& width) {
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width, current.noise, refine, false);
  candidates_.choose(current.frame, options_.axis, chunks_, current.noise_dn, plan);
  const auto most = static_cast<std::size_t>(chunks_.lines()) * (ChunkMaxima::kBest - 1);
  weak_.make_room(most);
  weak_index_.reserve(most);
  measure(current, width, plan, candidates_.firsts);
  candidates_.look_behind(static_cast<float>(detection_.threshold()), current.frame, options_.axis,
                          chunks_);
  measure(current, width, plan, candidates_.extras);
  candidates_.blank_flat_lines();
}

void ProfileExtractor::measure(const Current& current, const WidthModel& width,
                               const ProfilePlan& plan, PeakList& peaks) {
  measure_profiles(current.images, plan, peaks.seeds.data(), static_cast<int>(peaks.size()),
                   peaks.measurements());
  measure_weak_again(current, width, plan.window, peaks);
  refuse_edges(current, width, plan, peaks);
}

// Of what is weak, or so near the border that the background is seen on one side only, whose slope
// then needs more of it.
void ProfileExtractor::measure_weak_again(const Current& current, const WidthModel& width,
                                          int border, PeakList& peaks) {
  // Without branches: nearly always the answer is no, a vector at a time.
  const auto needs_it = [&, last = current.images.length - border](std::size_t i) -> int {
    const float significance = peaks.significance[i];
    const std::int32_t across = peaks.across[i];
    const int is_weak = (significance < kWeakSignificance) & (significance > kHopelessSignificance);
    const int is_near_border = (across < border) | (across >= last);
    return is_weak | is_near_border;
  };
  int any = 0;
  for (std::size_t i = 0; i < peaks.size(); ++i) any |= needs_it(i);
  if (any == 0) return;

  weak_.seeds.clear();
  weak_index_.clear();
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    if (needs_it(i) == 0) continue;
    weak_.seeds.push_back({peaks.seeds[i].line, peaks.across[i]});
    weak_index_.push_back(i);
  }
  const bool refine = options_.method == ExtractMethod::kRefined;
  measure_profiles(current.images, plan_profile(width, current.noise, refine, true),
                   weak_.seeds.data(), static_cast<int>(weak_.size()), weak_.measurements());
  for (std::size_t n = 0; n < weak_.size(); ++n) {
    peaks.take(weak_index_[n], weak_, n);
    refuse_edge(current, width, weak_index_[n], peaks);
  }
}

void ProfileExtractor::refuse_edges(const Current& current, const WidthModel& width,
                                    const ProfilePlan& plan, PeakList& peaks) {
  // An edge tilts the background, unless at its very border, by a third of its height or more over
  // such a distance.
  const auto distance = static_cast<float>(3 * (plan.core + plan.window));
  const auto is_tilted = [&](std::size_t i) -> int {
    return distance * std::abs(peaks.slope[i]) > peaks.amplitude[i];
  };
  constexpr std::size_t kBlock = 16;  // Nearly always the answer is no, a vector at a time.
  for (std::size_t first = 0; first < peaks.size(); first += kBlock) {
    const std::size_t last = std::min(first + kBlock, peaks.size());
    int any = 0;
    for (std::size_t i = first; i < last; ++i) any |= is_tilted(i);
    if (any == 0) continue;
    for (std::size_t i = first; i < last; ++i) {
      if (is_tilted(i) != 0) refuse_edge(current, width, i, peaks);
    }
  }
}

void ProfileExtractor::refuse_edge(const Current& current, const WidthModel& width, std::size_t i,
                                   PeakList& peaks) {
  if (!(peaks.significance[i] >= detection_.threshold())) return;
  const PeakPlace place{peaks.seeds[i].line, peaks.across[i], typical_width(width), peaks.level[i]};
  if (&peaks == &candidates_.extras && is_beside_first(place)) return;
  if (significance_above_edge(current.frame, options_.axis, current.noise, place) >=
      kLeastAboveEdge) {
    return;
  }
  // Nor does the width, or the follower, learn from it.
  peaks.significance[i] = peaks.snr[i] = peaks.amplitude[i] = peaks.clipped[i] = 0.0F;
}

// Whether what brightens the place's sides may be the line's most prominent peak, and no edge.
bool ProfileExtractor::is_beside_first(const PeakPlace& place) const {
  const PeakList& firsts = candidates_.firsts;
  const auto line = static_cast<std::size_t>(place.line);
  return firsts.significance[line] >= static_cast<float>(detection_.threshold()) &&
         std::abs(firsts.position(line) - place.across) <= disturbed_by_neighbours_px(place.width);
}

void ProfileExtractor::report(const Current& current, const WidthModel& width, Stripe& stripe) {
  const PeakLimits limits =
      limits_of(options_, detection_, width, current.images.length, current.step);
  judge_peaks(limits, candidates_.firsts);
  judge_peaks(limits, candidates_.extras);
  choose_peaks(candidates_, width, options_, stripe);
  if (options_.peak == PeakRule::kContinuous) {
    follower_.follow(current.frame, current.images, candidates_, width,
                     plan_profile(width, current.noise, false, true), limits, current.noise,
                     stripe);
    follower_.drop_strays(chunks_, stripe);
  }
  mark_blind_lines(current.frame, stripe);
}

// Where two images are subtracted, the blind mask has what is clipped in both.
void ProfileExtractor::mark_blind_lines(const LitFrame& frame, Stripe& stripe) const {
  const auto is_clipped = [&](int line) {
    return frame.dark.empty() && chunks_.brightest_dn(line) >= frame.full_scale_dn;
  };
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kNoStripe) continue;
    const int line = stripe.line[i];
    if (chunks_.is_partly_blind(line) || is_clipped(line)) stripe.status[i] = ReturnStatus::kBlind;
  }
}

void ProfileExtractor::add_other_errors(const ExcessScatter& excess, double step,
                                        Stripe& stripe) const {
  const double own =
      options_.excess_sigma_px ? *options_.excess_sigma_px * step : excess.sigma_px();
  if (!(own > 0.0)) return;
  const auto added = static_cast<float>(own * own);
  for (float& sigma : stripe.sigma_px) sigma = std::sqrt(sigma * sigma + added);
}

}  // namespace striper::detail
