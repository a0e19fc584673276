// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile_extractor.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/event.hpp>

#include "stripe/learn/width_guess.hpp"
#include "stripe/line_view.hpp"
#include "stripe/select/line_choice.hpp"
#include "stripe/select/peak_judge.hpp"

namespace striper::detail {
namespace {

constexpr int kLeastLength = 3;
constexpr double kDefaultWidth = 1.5;
constexpr double kLeastSigma = 0.2;
// Pixels beyond where the stripe can be, for its background; and of a line that it can nearly
// always be in, all is searched.
constexpr int kBackgroundAbout = 40;
constexpr double kNearlyAll = 0.9;
constexpr double kPixelBox2 = 1.0 / 12.0;
constexpr double kQuantisation = 1.0 / 12.0;

// The background's own error limits the significance of peaks below this.
constexpr float kWeakSignificance = 8.0F;
// Below this, no better background makes a peak of it.
constexpr float kHopelessSignificance = 2.5F;

// What a stripe beside an edge shows above the brighter side, in sigmas: less than in all of a
// line, since there are few places where noise may do so.
constexpr double kLeastAboveEdge = 3.5;

// So often the brightest thing of a frame's lines, no noise, may change before ridges are looked
// for.
constexpr float kClearSignificance = 8.0F;
constexpr double kMostUnclear = 0.03;
// Ridges are compared with pixels so many widths off, at least and at most so many pixels: in
// pixels for a stripe of unknown width.
constexpr double kRidgeReach = 2.5;
constexpr double kLeastRidgeReach = 3.0;
constexpr double kMostRidgeReach = 24.0;
constexpr double kLeastRidge = 3.0;  // Sigmas of noise.

// Of the lines are surely the stripe where one is in view: six of 640.
constexpr double kLeastSure = 0.01;
constexpr float kSure = 0.99F;

// What is told by its neighbours has so many of them at least; and alone it is as likely a glint.
constexpr int kFewestToCompare = 16;
constexpr float kOfOneAlone = 0.5F;
constexpr double kSamePeakPx = 0.5;

// Half of each is measured well enough to know it by.
constexpr std::array kTriedWidths{0.8, 1.5, 3.0, 6.0};

constexpr int kMostPasses = 4;
constexpr double kWidthSettled = 0.04;

cv::Mat part_across(const cv::Mat& image, StripeAxis axis, int begin, int end) {
  if (image.empty()) return {};
  return axis == StripeAxis::kColumns ? image.rowRange(begin, end) : image.colRange(begin, end);
}

LitFrame part_across(const LitFrame& frame, StripeAxis axis, int begin, int end) {
  LitFrame part = frame;
  part.lit = part_across(frame.lit, axis, begin, end);
  part.dark = part_across(frame.dark, axis, begin, end);
  part.variance = part_across(frame.variance, axis, begin, end);
  part.blind = part_across(frame.blind, axis, begin, end);
  AxisGrid& across = axis == StripeAxis::kColumns ? part.grid.v : part.grid.u;
  across.offset = across.sensor(begin);
  return part;
}

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

// Whether an exposure without the laser has taken the background away.
bool is_background_subtracted(const LitFrame& frame) {
  return !frame.dark.empty() && !frame.is_dark_a_channel;
}

double noise_dn_of(const PlanNoise& noise) {
  return std::sqrt((1.0 + noise.dark_noise_gain) *
                   noise.model.variance_dn2(noise.model.black_level_dn));
}

}  // namespace

ProfileImages images_of(const LitFrame& frame, StripeAxis axis) {
  return frame.lit.depth() == CV_8U ? images_of<std::uint8_t>(frame, axis)
                                    : images_of<std::uint16_t>(frame, axis);
}

void ProfileExtractor::extract(const LitFrame& frame, Stripe& stripe) {
  stripe.axis = options_.axis;
  const LitFrame searched = searched_part(frame, expected_of(frame.laser));
  stripe.grid = searched.grid;
  extract_searched(searched, stripe);
  stripe.grid = frame.grid;
}

const ExpectedStripe* ProfileExtractor::expected_of(int laser) const {
  const auto index = static_cast<std::size_t>(std::max(0, laser));
  return index < options_.expected.size() ? &options_.expected[index] : nullptr;
}

// The part of the frame, across, that can show the stripe, with the background about it; and where
// in it each line can.
LitFrame ProfileExtractor::searched_part(const LitFrame& frame, const ExpectedStripe* expected) {
  const bool is_limited = expected != nullptr && !expected->first_px.empty();
  const int lines = line_count(frame.lit, options_.axis);
  limits_.first.resize(is_limited ? static_cast<std::size_t>(lines) : 0);
  limits_.last.resize(limits_.first.size());
  searched_from_px_ = 0;
  if (!is_limited) return frame;
  const AxisGrid& along = options_.axis == StripeAxis::kColumns ? frame.grid.u : frame.grid.v;
  const AxisGrid& across = grid_across(frame.grid, options_.axis);
  const auto sensor_lines = static_cast<std::ptrdiff_t>(expected->first_px.size());
  float first = std::numeric_limits<float>::max();
  float last = -1.0F;
  for (std::size_t i = 0; i < limits_.first.size(); ++i) {
    const std::ptrdiff_t line = std::lround(along.sensor(static_cast<double>(i)));
    const auto at = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(line, 0, std::max<std::ptrdiff_t>(0, sensor_lines - 1)));
    limits_.first[i] = static_cast<float>(across.index(expected->first_px[at]));
    limits_.last[i] = static_cast<float>(across.index(expected->last_px[at]));
    first = std::min(first, limits_.first[i]);
    last = std::max(last, limits_.last[i]);
  }
  const int length = line_length(frame.lit, options_.axis);
  const bool is_anywhere = first <= static_cast<float>(length) && last >= 0.0F && first <= last;
  if (!is_anywhere) return frame;
  const int begin = std::clamp(static_cast<int>(first) - kBackgroundAbout, 0, length);
  const int end = std::clamp(static_cast<int>(last) + kBackgroundAbout, begin, length);
  if (end - begin < kLeastLength || end - begin > kNearlyAll * length) return frame;
  searched_from_px_ = begin;
  for (float& limit : limits_.first) limit -= static_cast<float>(begin);
  for (float& limit : limits_.last) limit -= static_cast<float>(begin);
  return part_across(frame, options_.axis, begin, end);
}

void ProfileExtractor::extract_searched(const LitFrame& frame, Stripe& stripe) {
  const int length = line_length(frame.lit, options_.axis);
  if (length < kLeastLength) {
    stripe.reset(line_count(frame.lit, options_.axis));
    return;
  }
  stripe.resize(line_count(frame.lit, options_.axis));

  ridges_.reserve(frame.lit.size(), options_.axis);
  chunks_.find(frame, options_.axis);
  chunks_.rank(ChunkMaxima::kFirst);
  detection_.prepare(length, options_.false_alarm_rate, options_.weak_false_alarm_rate);
  const ProfileImages images = images_of(frame, options_.axis);
  const PlanNoise noise = noise_of(frame, images);
  const double step = grid_across(frame.grid, options_.axis).step;
  const Current current{frame, images, noise, noise_dn_of(noise), step};

  Learnt& learnt = learnt_of(frame.laser);
  if (!learnt.width.is_known()) begin_width(current, learnt.width);
  measure_and_learn(current, learnt.width);
  report(current, learnt.width.model(), stripe);
  if (!options_.excess_sigma_px) learnt.excess.update(stripe);
  const std::optional<WidthModel> known = known_width(frame);
  const WidthModel& width = known ? *known : learnt.width.model();
  edges_.correct(frame, noise, width, stripe);
  add_other_errors(learnt.excess, step, stripe);
  if (!options_.excess_sigma_px) {
    texture_.add(width, known.has_value(), grid_across(frame.grid, options_.axis), stripe);
  }
  if (!choice_.is_plain()) widen_by_evidence(stripe);
  if (options_.can_explain) keep_for_explanation(frame, noise, width, stripe);
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
  options_.events.send(
      {"noise_depth_assumed",
       fmt::format("the model's noise is taken to be that of 8-bit pictures: these, of {} bits, "
                   "have {:.1f} DN where it says {:.1f}; noise.bit_depth in the model says which "
                   "(striper noise writes it)",
                   depth, shown_dn, std::sqrt(options_.noise->variance_dn2(value_dn)))});
}

// The caller's, or the model's.
std::optional<WidthModel> ProfileExtractor::known_width(const LitFrame& frame) const {
  const auto effective = [](double sigma) { return std::sqrt(sigma * sigma + kPixelBox2); };
  if (options_.stripe_sigma_px) {
    return WidthModel{effective(*options_.stripe_sigma_px), 0.0, 0.0, 0.0};
  }
  const ExpectedStripe* const expected = expected_of(frame.laser);
  if (expected == nullptr || !expected->sigma_px) return {};
  const AxisGrid& across = grid_across(frame.grid, options_.axis);
  const double at_pivot = effective(std::max(kLeastSigma, *expected->sigma_px / across.step));
  const double slope = expected->sigma_slope * (*expected->sigma_px / across.step) / at_pivot;
  return WidthModel{at_pivot, slope, across.index(expected->pivot_px), 0.0};
}

// What is known, or what the brightest pixels show.
void ProfileExtractor::begin_width(const Current& current, WidthTracker& width) const {
  const std::optional<WidthModel> known = known_width(current.frame);
  if (options_.stripe_sigma_px) {
    width.set(known->at_pivot);
  } else if (known) {
    width.expect(*known);
  } else {
    const auto guess = guess_stripe_width(current.frame, options_.axis, chunks_, current.noise_dn);
    width.set(guess.value_or(kDefaultWidth));
  }
}

// Where the width, or the filter that fits it, turns out to be another than was thought, once more
// with that.
void ProfileExtractor::measure_and_learn(const Current& current, WidthTracker& width) {
  if (!options_.stripe_sigma_px && !width.is_trusted()) try_widths(current, width);
  const bool refine = options_.method == ExtractMethod::kRefined;
  for (int pass = 1; pass <= kMostPasses; ++pass) {
    const double filter = filter_sigma(width.model(), current.noise, refine);
    measure(current, width.model());
    choose(current, width);
    if (is_more_than_peaks(current.frame)) choose_among_ridges(current, width);
    if (options_.stripe_sigma_px) return;
    const double change = width_learner_.learn(current.frame, options_.axis, choice_, width);
    const double filter_change = filter_sigma(width.model(), current.noise, refine) / filter;
    const double largest = std::max(std::abs(change - 1.0), std::abs(filter_change - 1.0));
    if (largest < kWidthSettled) return;
  }
}

// Of a first frame whose background hides the stripe: begins with the width by which most of the
// lines show one.
void ProfileExtractor::try_widths(const Current& current, WidthTracker& width) {
  measure(current, width.model());
  if (!is_hidden_) return;
  float best = 0.0F;
  double taken = width.model().at_pivot;
  for (const double tried : kTriedWidths) {
    width.set(tried);
    measure(current, width.model());
    choose(current, width);
    const float merit = choice_.merit();
    if (!(merit > best)) continue;
    best = merit;
    taken = choice_.width().at_pivot;
  }
  width.set(taken);
}

void ProfileExtractor::measure(const Current& current, const WidthModel& width) {
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width, current.noise, refine, BackgroundReach::kUsual);
  candidates_.choose(current.frame, options_.axis, chunks_, current.noise_dn, plan);
  const auto most = static_cast<std::size_t>(chunks_.lines()) * Ridges::kMost;
  weak_.make_room(most);
  weak_index_.reserve(most);
  measure(current, width, plan, candidates_.firsts);
  candidates_.look_behind(static_cast<float>(detection_.threshold()), current.frame, options_.axis,
                          chunks_);
  measure(current, width, plan, candidates_.extras);
  is_hidden_ = is_hidden_by_background(current.frame);
  if (is_hidden_) look_for_ridges(current, width);
  refuse_outside(candidates_.firsts);
  refuse_outside(candidates_.extras);
  candidates_.blank_flat_lines();
}

// Whether the brightest thing of a line so often is another than that of the next that the stripe
// may not be among the brightest pixels.
bool ProfileExtractor::is_hidden_by_background(const LitFrame& frame) const {
  if (is_background_subtracted(frame) || is_by_itself()) return false;
  const auto unclear = static_cast<double>(candidates_.unclear_lines(kClearSignificance));
  return unclear > kMostUnclear * chunks_.lines();
}

// Whether the frame is not so plain that the highest peak of a line were the stripe.
bool ProfileExtractor::is_more_than_peaks(const LitFrame& frame) const {
  return !is_hidden_ && !is_background_subtracted(frame) && !is_by_itself() && !choice_.is_plain();
}

void ProfileExtractor::choose_among_ridges(const Current& current, const WidthTracker& width) {
  is_hidden_ = true;
  look_for_ridges(current, width.model());
  refuse_outside(candidates_.firsts);
  refuse_outside(candidates_.extras);
  candidates_.blank_flat_lines();
  choose(current, width);
}

// Between surfaces: an edge is no ridge, and a wide background would have other surfaces in it.
void ProfileExtractor::look_for_ridges(const Current& current, const WidthModel& width) {
  const double reach =
      std::clamp(kRidgeReach * typical_width(width), kLeastRidgeReach, kMostRidgeReach);
  const int least_dn = std::max(2, static_cast<int>(kLeastRidge * current.noise_dn));
  const LitFrame& frame = current.frame;
  if (!frame.dark.empty()) cv::subtract(frame.lit, frame.dark, difference_);
  const cv::Mat& image = frame.dark.empty() ? frame.lit : difference_;
  ridges_.find(image, options_.axis, static_cast<int>(std::ceil(reach)), least_dn);
  candidates_.take_ridges(ridges_);
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width, current.noise, refine, BackgroundReach::kNarrow);
  for (PeakList* const peaks : {&candidates_.firsts, &candidates_.extras}) {
    measure_profiles(current.images, plan, peaks->seeds.data(), static_cast<int>(peaks->size()),
                     peaks->measurements());
  }
  candidates_.blank_false_ridges();
}

bool ProfileExtractor::is_by_itself() const noexcept { return options_.each_line_by_itself; }

void ProfileExtractor::choose(const Current& current, const WidthTracker& width) {
  const ChoiceContext context{.width = width.model(),
                              .is_width_known = options_.stripe_sigma_px || width.is_trusted(),
                              .is_by_itself = is_by_itself(),
                              .is_hidden = is_hidden_,
                              .is_subtracted = is_background_subtracted(current.frame),
                              .black_dn = static_cast<float>(current.noise.model.black_level_dn),
                              .frame = &current.frame,
                              .axis = options_.axis,
                              .expected = expected_of(current.frame.laser)};
  choice_.choose(candidates_, context, static_cast<float>(detection_.threshold()));
}

void ProfileExtractor::measure(const Current& current, const WidthModel& width,
                               const ProfilePlan& plan, PeakList& peaks) {
  measure_profiles(current.images, plan, peaks.seeds.data(), static_cast<int>(peaks.size()),
                   peaks.measurements());
  measure_weak_again(current, width, plan.window, peaks);
  refuse_edges(current, width, plan, peaks);
}

// What lies where the stripe cannot be.
void ProfileExtractor::refuse_outside(PeakList& peaks) const {
  if (limits_.first.empty()) return;
  for (std::size_t i = 0; i < peaks.size(); ++i) {
    const auto line = static_cast<std::size_t>(peaks.seeds[i].line);
    const auto across = static_cast<float>(peaks.across[i]);
    if (across >= limits_.first[line] && across <= limits_.last[line]) continue;
    peaks.significance[i] = peaks.snr[i] = peaks.amplitude[i] = peaks.clipped[i] = 0.0F;
  }
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
  measure_profiles(current.images,
                   plan_profile(width, current.noise, refine, BackgroundReach::kWide),
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
  if (choice_.is_plain()) {
    choose_by_height(candidates_, width, options_, stripe);
  } else {
    choose_by_evidence(choice_, options_, stripe);
  }
  if (options_.peak == PeakRule::kContinuous && choice_.is_plain()) {
    follower_.follow(current.frame, current.images, candidates_, width,
                     plan_profile(width, current.noise, false, BackgroundReach::kWide), limits,
                     current.noise, stripe);
    follower_.drop_strays(chunks_, stripe);
  }
  const bool has_background = !is_background_subtracted(current.frame) && !is_by_itself();
  if (choice_.is_plain() && has_background) mark_alone(stripe);
  mark_outliers(stripe);
  mark_blind_lines(current.frame, stripe);
}

// A stripe would show in a line beside it, or not far off, where most of it is clear.
void ProfileExtractor::mark_alone(Stripe& stripe) const {
  if (options_.peak == PeakRule::kAll || chunks_.lines() < kFewestToCompare) return;
  const StripePieces& pieces = choice_.pieces();
  std::size_t good = 0;
  std::size_t clear = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const bool is_good = stripe.status[i] == ReturnStatus::kOk;
    good += static_cast<std::size_t>(is_good);
    clear += static_cast<std::size_t>(
        is_good && candidates_.firsts.significance[static_cast<std::size_t>(stripe.line[i])] >=
                       kClearSignificance);
  }
  if (2 * clear < good) return;
  const AxisGrid& across = grid_across(stripe.grid, stripe.axis);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    const double at = across.index(stripe.across_px[i]);
    for (std::size_t n = pieces.first_of(stripe.line[i]); n < pieces.first_of(stripe.line[i] + 1);
         ++n) {
      const Candidate& c = pieces.candidate(n);
      const bool is_it = std::abs(static_cast<double>(c.across) - at) < kSamePeakPx;
      const Piece& piece = pieces.pieces()[static_cast<std::size_t>(pieces.link(n).piece)];
      if (!is_it || piece.count > 1) continue;
      stripe.status[i] = ReturnStatus::kOutlier;
      stripe.confidence[i] = std::min(stripe.confidence[i], kOfOneAlone);
    }
  }
}

// What is good is the stripe with the probability that was asked for. And where fewer lines surely
// have it than a stripe that is in view gives, the image has none.
void ProfileExtractor::mark_outliers(Stripe& stripe) const {
  stripe.is_seen = std::any_of(stripe.status.begin(), stripe.status.end(),
                               [](ReturnStatus s) { return s == ReturnStatus::kOk; });
  if (is_by_itself()) return;
  const auto least = static_cast<float>(options_.min_confidence);
  std::size_t good = 0;
  std::size_t sure = 0;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) continue;
    if (stripe.confidence[i] < least) stripe.status[i] = ReturnStatus::kOutlier;
    good += static_cast<std::size_t>(stripe.status[i] == ReturnStatus::kOk);
    sure += static_cast<std::size_t>(stripe.confidence[i] >= kSure);
  }
  const double least_sure = choice_.is_plain() ? 0.0 : kLeastSure * chunks_.lines();
  // A faint stripe that is followed goes on where no line alone shows it.
  const bool is_followed = options_.peak == PeakRule::kContinuous;
  const bool is_scattered = choice_.is_scattered() && !is_followed;
  stripe.is_seen = good > 0 && static_cast<double>(sure) >= least_sure && !is_scattered;
  if (stripe.is_seen) return;
  for (ReturnStatus& status : stripe.status) {
    if (status == ReturnStatus::kOk) status = ReturnStatus::kOutlier;
  }
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

void ProfileExtractor::widen_by_evidence(Stripe& stripe) const {
  if (options_.peak == PeakRule::kAll) return;
  const auto step = static_cast<float>(grid_across(stripe.grid, stripe.axis).step);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    const StripeChoice::Chosen& chosen = choice_.of_line(stripe.line[i]);
    if (chosen.candidate < 0) continue;
    const float noise =
        choice_.pieces().candidate(static_cast<std::size_t>(chosen.candidate)).sigma;
    stripe.sigma_px[i] = std::max(step * noise, stripe.sigma_px[i] * chosen.sigma_factor);
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
