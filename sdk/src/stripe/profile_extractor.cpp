// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile_extractor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "stripe/clipped_width.hpp"
#include "stripe/line_view.hpp"

namespace striper::detail {
namespace {

constexpr int kLeastLength = 3;
constexpr double kDefaultWidth = 1.5;
constexpr float kPixelBox2 = 1.0F / 12.0F;
constexpr float kLeastWidth2 = 0.01F;
constexpr double kFwhmOfSigma = 2.3548200450309493;

// A second candidate is measured where its pixel stands out from the noise,
constexpr double kSecondProminence = 4.0;
// and every candidate where the first one hardly does.
constexpr double kWeakFirstProminence = 6.0;

// The background's own error limits the significance of peaks below this.
constexpr float kWeakSignificance = 8.0F;
// Below this, no better background makes a peak of it.
constexpr float kHopelessSignificance = 2.5F;

constexpr int kGuessLines = 128;
constexpr double kGuessProminence = 4.0;
constexpr int kGuessReach = 32;

// Two candidates nearer than this, in widths, are one peak.
constexpr double kSamePeak = 1.0;

// The rule `continuous`: what the chain of lines must say before it is believed,
constexpr float kProbable = 0.5F;
constexpr float kCertain = 0.9F;
// how near to it, in widths, a line's own candidate is the same peak,
constexpr double kFollowedReach = 2.0;
// and what a line must show itself, but for a few in a row: else the stripe is bridged, not seen.
constexpr float kLeastFollowed = 0.5F;
constexpr int kMostBridged = 3;

constexpr int kMostPasses = 3;
constexpr double kWidthSettled = 0.04;
// Widths of strong profiles are taken; where a frame has too few of them, of weak ones too.
constexpr double kStrongSnr = 12.0;
constexpr double kFairSnr = 4.0;
constexpr int kEnoughStrong = 24;
constexpr int kFirstClippedFits = 64;
constexpr int kClippedFits = 12;

// Clipped pixels of a stripe twenty times full scale: 2 sqrt(2 ln 20) sigmas.
constexpr float kMostClippedWidths = 5.0F;
constexpr float kWidthTolerance = 4.0F;  // Standard errors, before a peak is too wide or narrow.

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

// The mean of several lines' profiles about their brightest pixels.
struct MeanProfile {
  std::array<double, 2 * kGuessReach + 1> sum{};
  std::array<int, 2 * kGuessReach + 1> count{};

  template <typename Pixel>
  void add(const LitFrame& frame, StripeAxis axis, int line_number, int across) {
    const LitLine<Pixel> line(frame, axis, line_number);
    const int first = std::max(0, across - kGuessReach);
    const int last = std::min(line.length() - 1, across + kGuessReach);
    for (int k = first; k <= last; ++k) {
      const auto i = static_cast<std::size_t>(k - across + kGuessReach);
      sum[i] += line.value(k);
      ++count[i];
    }
  }

  double at(int k) const {
    const auto i = static_cast<std::size_t>(k + kGuessReach);
    return count[i] > 0 ? sum[i] / count[i] : std::numeric_limits<double>::quiet_NaN();
  }

  // Half the width at half height over the background, the lower quarter of the profile; 0 where
  // there is no peak.
  double sigma() const {
    std::array<double, 2 * kGuessReach + 1> levels{};
    std::size_t known = 0;
    for (int k = -kGuessReach; k <= kGuessReach; ++k) {
      if (std::isfinite(at(k))) levels[known++] = at(k);
    }
    const auto quarter = levels.begin() + static_cast<std::ptrdiff_t>(known / 4);
    std::nth_element(levels.begin(), quarter, levels.begin() + static_cast<std::ptrdiff_t>(known));
    if (!(at(0) > *quarter)) return 0.0;
    const double half = 0.5 * (at(0) + *quarter);
    return (distance_to(half, -1) + distance_to(half, +1)) / kFwhmOfSigma;
  }

  // From the peak to where the profile falls below `level`, by linear interpolation.
  double distance_to(double level, int direction) const {
    for (int n = 1; n <= kGuessReach; ++n) {
      const double previous = at((n - 1) * direction);
      const double value = at(n * direction);
      if (!std::isfinite(value)) return n - 1;
      if (value <= level) return n - 1 + (previous - level) / (previous - value);
    }
    return kGuessReach;
  }
};

}  // namespace

ProfileExtractor::ProfileExtractor(const ExtractOptions& options) : options_(options) {}

void ProfileExtractor::extract(const LitFrame& frame, Stripe& stripe) {
  stripe.axis = options_.axis;
  stripe.grid = frame.grid;
  stripe.reset(line_count(frame.lit, options_.axis));
  length_ = line_length(frame.lit, options_.axis);
  step_ = options_.axis == StripeAxis::kColumns ? frame.grid.v.step : frame.grid.u.step;
  if (length_ < kLeastLength) return;

  chunks_.find(frame, options_.axis);
  chunks_.rank();
  detection_.prepare(length_, options_.false_alarm_rate, options_.weak_false_alarm_rate);
  set_limits();
  const PlanNoise noise = noise_of(frame);
  Learnt& learnt = learnt_of(frame.laser);
  if (!learnt.width.is_known() && !guess_width(frame, noise_dn(noise), learnt.width)) {
    WidthTracker unknown;
    unknown.set(kDefaultWidth);
    choose_seeds(noise_dn(noise));
    measure(frame, noise, unknown);
    report(unknown, stripe);
    if (options_.peak == PeakRule::kContinuous) follow(frame, noise, unknown, stripe);
    return;
  }
  choose_seeds(noise_dn(noise));
  for (int pass = 1; pass <= kMostPasses; ++pass) {
    measure(frame, noise, learnt.width);
    if (std::abs(learn_width(frame, learnt.width) - 1.0) < kWidthSettled) break;
  }
  report(learnt.width, stripe);
  if (options_.peak == PeakRule::kContinuous) follow(frame, noise, learnt.width, stripe);
  if (!options_.excess_sigma_px) learnt.excess.update(stripe);
  add_other_errors(learnt.excess, stripe);
}

void ProfileExtractor::set_limits() {
  limits_.significance = static_cast<float>(detection_.threshold());
  limits_.weak_significance = static_cast<float>(detection_.weak_threshold());
  limits_.amplitude = static_cast<float>(options_.threshold_dn.value_or(0.0));
  limits_.snr = static_cast<float>(options_.min_snr);
  limits_.narrow = static_cast<float>(options_.min_width_ratio);
  limits_.wide = static_cast<float>(options_.max_width_ratio);
  limits_.saturated_sigma = static_cast<float>(options_.max_saturated_sigma_px);
}

ProfileExtractor::Learnt& ProfileExtractor::learnt_of(int laser) {
  const auto index = static_cast<std::size_t>(std::max(0, laser));
  if (index >= learnt_.size()) learnt_.resize(index + 1);
  return learnt_[index];
}

PlanNoise ProfileExtractor::noise_of(const LitFrame& frame) {
  PlanNoise noise;
  noise.speckle_contrast = options_.speckle_contrast;
  if (!frame.dark.empty()) {
    noise.dark_noise_gain = static_cast<double>(frame.dark_noise_gain);
  }
  if (options_.noise) {
    noise.model = *options_.noise;
  } else {
    noise.model.read_noise_dn = background_noise_.update(frame, options_.axis, chunks_);
    noise.is_measured = true;
  }
  return noise;
}

// Of a dark pixel, to tell candidates from noise.
double ProfileExtractor::noise_dn(const PlanNoise& noise) const {
  return noise.is_measured ? noise.model.read_noise_dn
                           : std::sqrt((1.0 + noise.dark_noise_gain) *
                                       noise.model.variance_dn2(noise.model.black_level_dn));
}

// From the mean profile of the lines whose peak is clear.
bool ProfileExtractor::guess_width(const LitFrame& frame, double noise_dn,
                                   WidthTracker& width) const {
  if (options_.stripe_sigma_px) {
    width.set(std::sqrt(*options_.stripe_sigma_px * *options_.stripe_sigma_px + kPixelBox2));
    return true;
  }
  MeanProfile mean;
  int count = 0;
  const int stride = chunks_.lines() / kGuessLines + 1;
  for (int line = 0; line < chunks_.lines(); line += stride) {
    const ChunkMaxima::Peak peak = chunks_.best(0, line);
    if (peak.prominence_dn < kGuessProminence * noise_dn) continue;
    ++count;
    if (frame.lit.depth() == CV_8U) {
      mean.add<std::uint8_t>(frame, options_.axis, line, peak.across);
    } else {
      mean.add<std::uint16_t>(frame, options_.axis, line, peak.across);
    }
  }
  const double sigma = count > 0 ? mean.sigma() : 0.0;
  if (!(sigma > 0.0)) return false;
  width.set(std::clamp(sigma, 0.5, 8.0));
  return true;
}

void ProfileExtractor::choose_seeds(double noise_dn) {
  const int lines = chunks_.lines();
  const auto most = static_cast<std::size_t>(lines) * ChunkMaxima::kBest;
  seeds_.reserve(most);
  seeds_.clear();
  first_seed_.resize(static_cast<std::size_t>(lines) + 1);
  const int second = std::max(1, static_cast<int>(std::ceil(kSecondProminence * noise_dn)));
  const int weak = static_cast<int>(std::ceil(kWeakFirstProminence * noise_dn));
  for (int line = 0; line < lines; ++line) {
    first_seed_[static_cast<std::size_t>(line)] = static_cast<std::int32_t>(seeds_.size());
    const ChunkMaxima::Peak first = chunks_.best(0, line);
    if (first.prominence_dn <= 0) continue;
    seeds_.push_back({line, first.across});
    const int least = first.prominence_dn < weak ? 1 : second;
    for (int n = 1; n < ChunkMaxima::kBest && chunks_.prominence_dn(n, line) >= least; ++n) {
      seeds_.push_back({line, chunks_.best(n, line).across});
    }
  }
  first_seed_[static_cast<std::size_t>(lines)] = static_cast<std::int32_t>(seeds_.size());
  measured_.resize(most);
  weak_seeds_.reserve(most);
  weak_index_.reserve(most);
}

// Gives neighbouring seeds that nearly agree the same place: the filter finds its peak from there
// as well, and the pixels of columns then lie side by side.
void ProfileExtractor::align_seeds(int most) {
  const auto by_across = [](const PeakSeed& a, const PeakSeed& b) { return a.across < b.across; };
  for (std::size_t i = 0; i + kSeedGroup <= seeds_.size(); i += kSeedGroup) {
    const auto first = seeds_.begin() + static_cast<std::ptrdiff_t>(i);
    const auto [low, high] = std::minmax_element(first, first + kSeedGroup, by_across);
    const std::int32_t middle = (low->across + high->across) / 2;
    if (high->across - low->across > 2 * most) continue;
    std::for_each(first, first + kSeedGroup, [=](PeakSeed& seed) { seed.across = middle; });
  }
}

void ProfileExtractor::measure(const LitFrame& frame, const PlanNoise& noise,
                               const WidthTracker& width) {
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfileImages images = images_of(frame, options_.axis);
  const ProfilePlan plan = plan_profile(width.model(), noise, refine, false);
  align_seeds(plan.aligned);
  measure_profiles(images, plan, seeds_.data(), static_cast<int>(seeds_.size()),
                   measured_.arrays());
  measure_weak_again(images, noise, width, plan.window);
}

void ProfileExtractor::measure_weak_again(const ProfileImages& images, const PlanNoise& noise,
                                          const WidthTracker& width, int border) {
  weak_seeds_.clear();
  weak_index_.clear();
  for (std::size_t i = 0; i < seeds_.size(); ++i) {
    const float significance = measured_.significance[i];
    const bool is_weak = significance < kWeakSignificance && significance > kHopelessSignificance;
    // Near the border the background is seen on one side only: its slope needs more of it.
    const std::int32_t across = measured_.across[i];
    const bool is_near_border = across < border || across >= length_ - border;
    if (!is_weak && !is_near_border) continue;
    weak_seeds_.push_back({seeds_[i].line, measured_.across[i]});
    weak_index_.push_back(static_cast<std::int32_t>(i));
  }
  if (weak_seeds_.empty()) return;
  const bool refine = options_.method == ExtractMethod::kRefined;
  const ProfilePlan plan = plan_profile(width.model(), noise, refine, true);
  weak_measured_.resize(measured_.offset.size());
  measure_profiles(images, plan, weak_seeds_.data(), static_cast<int>(weak_seeds_.size()),
                   weak_measured_.arrays());
  for (std::size_t n = 0; n < weak_index_.size(); ++n) {
    const auto i = static_cast<std::size_t>(weak_index_[n]);
    measured_.across[i] = weak_measured_.across[n];
    measured_.offset[i] = weak_measured_.offset[n];
    measured_.amplitude[i] = weak_measured_.amplitude[n];
    measured_.width[i] = weak_measured_.width[n];
    measured_.sigma[i] = weak_measured_.sigma[n];
    measured_.significance[i] = weak_measured_.significance[n];
    measured_.snr[i] = weak_measured_.snr[n];
    measured_.clipped[i] = weak_measured_.clipped[n];
  }
}

// From the clearest candidate of lines spread over the frame; where nearly all of them are
// clipped, from the flanks of a few.
double ProfileExtractor::learn_width(const LitFrame& frame, WidthTracker& width) {
  if (options_.stripe_sigma_px) return 1.0;
  if (add_width_samples(kStrongSnr, width) >= kEnoughStrong) return width.finish();
  if (add_clipped_samples(frame, width) > 0) return width.finish();
  add_width_samples(kFairSnr, width);
  return width.finish();
}

int ProfileExtractor::add_clipped_samples(const LitFrame& frame, WidthTracker& width) {
  width.begin();
  const int most = width.has_learnt() ? kClippedFits : kFirstClippedFits;
  const int lines = chunks_.lines();
  int count = 0;
  for (int n = 0; n < most; ++n) {
    // Other lines in every frame, spread evenly.
    next_clipped_line_ = (next_clipped_line_ + lines / most * 5 / 3 + 1) % lines;
    const auto l = static_cast<std::size_t>(next_clipped_line_);
    const auto i = static_cast<std::size_t>(first_seed_[l]);
    if (first_seed_[l + 1] == first_seed_[l] || !(measured_.clipped[i] > 0.0F)) continue;
    const double position = measured_.across[i] + static_cast<double>(measured_.offset[i]);
    const auto fitted = fit_clipped_width(
        frame, options_.axis,
        {next_clipped_line_, position, measured_.amplitude[i], width.model().at(position)});
    if (!fitted) continue;
    width.add(position, *fitted, measured_.snr[i]);
    ++count;
  }
  return count;
}

int ProfileExtractor::add_width_samples(double least_snr, WidthTracker& width) const {
  width.begin();
  int count = 0;
  const int stride = chunks_.lines() / WidthTracker::kMostSamples + 1;
  for (int line = 0; line < chunks_.lines() && !width.is_full(); line += stride) {
    const auto l = static_cast<std::size_t>(line);
    if (first_seed_[l] == first_seed_[l + 1]) continue;
    const auto first = measured_.significance.begin() + first_seed_[l];
    const auto best = std::max_element(first, first + (first_seed_[l + 1] - first_seed_[l]));
    const auto i = static_cast<std::size_t>(best - measured_.significance.begin());
    if (measured_.clipped[i] > 0.0F || !(measured_.snr[i] > least_snr)) continue;
    width.add(measured_.across[i], measured_.width[i], measured_.snr[i]);
    ++count;
  }
  return count;
}

ReturnStatus ProfileExtractor::judge(std::size_t seed, const WidthTracker& width) const {
  const float significance = measured_.significance[seed];
  const float position = static_cast<float>(measured_.across[seed]) + measured_.offset[seed];
  if (!(significance >= limits_.significance && measured_.amplitude[seed] >= limits_.amplitude)) {
    return ReturnStatus::kNoStripe;
  }
  const auto expected = static_cast<float>(width.model().at(position));
  const auto last = static_cast<float>(length_ - 1);
  if (!(position >= -0.5F && position <= last + 0.5F)) return ReturnStatus::kNoStripe;
  if (position < expected || position > last - expected) return ReturnStatus::kEdge;
  const float sigma = measured_.sigma[seed];
  const float clipped = measured_.clipped[seed];
  if (clipped > 0.0F) {
    const bool is_lost = clipped > kMostClippedWidths * expected + 1.0F;
    if (is_lost || !(sigma <= limits_.saturated_sigma)) return ReturnStatus::kSaturated;
  } else {
    const float tolerance = kWidthTolerance * sigma;
    const float measured = measured_.width[seed];
    if (measured < limits_.narrow * expected - tolerance) return ReturnStatus::kNarrow;
    if (measured > limits_.wide * expected + tolerance) return ReturnStatus::kWide;
  }
  const bool is_weak =
      significance < limits_.weak_significance || measured_.snr[seed] < limits_.snr;
  return is_weak ? ReturnStatus::kWeak : ReturnStatus::kOk;
}

// The peaks of a line, in order across; candidates that turned out to be the same peak are one.
int ProfileExtractor::peaks_of_line(int line, const WidthTracker& width, LinePeaks& out) const {
  const auto l = static_cast<std::size_t>(line);
  std::size_t count = 0;
  for (auto i = first_seed_[l]; i < first_seed_[l + 1]; ++i) {
    const auto seed = static_cast<std::size_t>(i);
    const ReturnStatus status = judge(seed, width);
    if (status == ReturnStatus::kNoStripe) continue;
    const Peak peak{seed, measured_.across[seed] + static_cast<double>(measured_.offset[seed]),
                    status};
    const double near = kSamePeak * width.model().at(peak.position);
    const bool is_known = std::any_of(
        out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count),
        [&](const Peak& other) { return std::abs(other.position - peak.position) < near; });
    if (is_known) continue;
    std::size_t at = count++;
    for (; at > 0 && out[at - 1].position > peak.position; --at) out[at] = out[at - 1];
    out[at] = peak;
  }
  return static_cast<int>(count);
}

void ProfileExtractor::report(const WidthTracker& width, Stripe& stripe) const {
  LinePeaks peaks{};
  const bool all = options_.peak == PeakRule::kAll;
  if (all) stripe.clear();
  for (int line = 0; line < chunks_.lines(); ++line) {
    const int count = peaks_of_line(line, width, peaks);
    if (count == 0) {
      const std::size_t i = all ? stripe.append(line) : static_cast<std::size_t>(line);
      stripe.status[i] =
          chunks_.is_partly_blind(line) ? ReturnStatus::kBlind : ReturnStatus::kNoStripe;
    } else if (all) {
      for (int n = 0; n < count; ++n) {
        const Peak& peak = peaks[static_cast<std::size_t>(n)];
        put(stripe.append(line), peak, 1.0F, peak.status, stripe);
      }
    } else {
      report_line(line, peaks, count, stripe);
    }
  }
}

// A good peak goes before a doubtful one; among equals the rule decides.
bool ProfileExtractor::is_preferred(const Peak& peak, const Peak& to) const {
  const bool is_good = peak.status == ReturnStatus::kOk;
  if (is_good != (to.status == ReturnStatus::kOk)) return is_good;
  switch (options_.peak) {
    case PeakRule::kNearest:
      return (options_.near_end == NearEnd::kFirstPixel) == (peak.position < to.position);
    case PeakRule::kFarthest:
      return (options_.near_end == NearEnd::kFirstPixel) != (peak.position < to.position);
    case PeakRule::kBrightest:
    case PeakRule::kContinuous:
    case PeakRule::kAll:
      break;
  }
  return measured_.amplitude[peak.seed] > measured_.amplitude[to.seed];
}

void ProfileExtractor::report_line(int line, const LinePeaks& peaks, int count,
                                   Stripe& stripe) const {
  const auto i = static_cast<std::size_t>(line);
  if (count == 1) {
    put(i, peaks[0], 1.0F, peaks[0].status, stripe);
    return;
  }
  const Peak* chosen = peaks.data();
  for (const Peak* p = chosen + 1; p != peaks.data() + count; ++p) {
    if (is_preferred(*p, *chosen)) chosen = p;
  }
  const bool by_height =
      options_.peak == PeakRule::kBrightest || options_.peak == PeakRule::kContinuous;
  float rival = 0.0F;
  for (const Peak* p = peaks.data(); by_height && p != peaks.data() + count; ++p) {
    const bool is_rival = p != chosen && p->status == chosen->status;
    if (is_rival) rival = std::max(rival, measured_.amplitude[p->seed]);
  }
  const float ratio = std::min(1.0F, rival / measured_.amplitude[chosen->seed]);
  const bool is_ambiguous =
      chosen->status == ReturnStatus::kOk && ratio >= static_cast<float>(options_.ambiguity_ratio);
  // Half at equal heights, 0.94 at half the height.
  const float share = 1.0F / (1.0F + ratio * ratio * ratio * ratio);
  put(i, *chosen, share, is_ambiguous ? ReturnStatus::kAmbiguous : chosen->status, stripe);
}

void ProfileExtractor::put(std::size_t i, const Peak& peak, float share, ReturnStatus status,
                           Stripe& stripe) const {
  const AxisGrid& across = options_.axis == StripeAxis::kColumns ? stripe.grid.v : stripe.grid.u;
  const auto step = static_cast<float>(step_);
  const float width = measured_.width[peak.seed];
  stripe.across_px[i] = across.sensor(peak.position);
  stripe.sigma_px[i] = measured_.sigma[peak.seed] * step;
  stripe.amplitude_dn[i] = measured_.amplitude[peak.seed];
  stripe.width_px[i] = std::sqrt(std::max(kLeastWidth2, width * width - kPixelBox2)) * step;
  stripe.confidence[i] =
      share * detection_.probability_not_noise(measured_.significance[peak.seed]);
  stripe.status[i] = status;
}

// Where the stripe of all lines together runs through a candidate of a line, that one is taken;
// where there is none, what is there is measured. A line whose only peak is strong keeps it:
// existence is the line's own affair where the line can tell.
void ProfileExtractor::follow(const LitFrame& frame, const PlanNoise& noise,
                              const WidthTracker& width, Stripe& stripe) {
  const double typical = width.model().at_pivot;
  tracker_.track(frame, options_.axis, typical, noise);
  weak_seeds_.clear();
  for (int line = 0; line < chunks_.lines(); ++line) {
    const ContinuousTracker::Answer& answer = tracker_.of_line(line);
    if (answer.probability < kProbable || take_candidate_at(line, width, stripe)) continue;
    const auto i = static_cast<std::size_t>(line);
    if (stripe.status[i] == ReturnStatus::kNoStripe || stripe.status[i] == ReturnStatus::kWeak) {
      weak_seeds_.push_back({line, answer.across});
    }
  }
  if (weak_seeds_.empty()) return;
  // The line alone would lose its way: the filter's peak is looked for close by and stands.
  ProfilePlan plan = plan_profile(width.model(), noise, false, true);
  plan.reach = plan.stray = std::max(1, static_cast<int>(typical));
  measure_profiles(images_of(frame, options_.axis), plan, weak_seeds_.data(),
                   static_cast<int>(weak_seeds_.size()), measured_.arrays());
  int bridged = 0;
  for (std::size_t n = 0; n < weak_seeds_.size(); ++n) {
    const int line = weak_seeds_[n].line;
    const bool goes_on = n > 0 && weak_seeds_[n - 1].line == line - 1;
    const bool shows = measured_.significance[n] > kLeastFollowed;
    bridged = shows ? 0 : (goes_on ? bridged + 1 : 1);
    const float probability = tracker_.of_line(line).probability;
    const Peak peak{n, measured_.across[n] + static_cast<double>(measured_.offset[n]),
                    ReturnStatus::kWeak};
    if (bridged > kMostBridged) continue;
    if (!(peak.position >= 0.0 && peak.position <= length_ - 1)) continue;
    const auto i = static_cast<std::size_t>(line);
    put(i, peak, 1.0F, probability >= kCertain ? ReturnStatus::kOk : ReturnStatus::kWeak, stripe);
    stripe.confidence[i] = probability;
  }
}

bool ProfileExtractor::take_candidate_at(int line, const WidthTracker& width,
                                         Stripe& stripe) const {
  const ContinuousTracker::Answer& answer = tracker_.of_line(line);
  LinePeaks peaks{};
  const int count = peaks_of_line(line, width, peaks);
  const double near = kFollowedReach * width.model().at(answer.across) + 1.0;
  for (int n = 0; n < count; ++n) {
    Peak& peak = peaks[static_cast<std::size_t>(n)];
    if (std::abs(peak.position - answer.across) > near) continue;
    const bool is_sure = answer.probability >= kCertain && peak.status == ReturnStatus::kWeak;
    const auto i = static_cast<std::size_t>(line);
    put(i, peak, 1.0F, is_sure ? ReturnStatus::kOk : peak.status, stripe);
    stripe.confidence[i] = answer.probability;
    return true;
  }
  return false;
}

void ProfileExtractor::add_other_errors(const ExcessScatter& excess, Stripe& stripe) const {
  const double own =
      options_.excess_sigma_px ? *options_.excess_sigma_px * step_ : excess.sigma_px();
  if (!(own > 0.0)) return;
  const auto added = static_cast<float>(own * own);
  for (float& sigma : stripe.sigma_px) sigma = std::sqrt(sigma * sigma + added);
}

void ProfileExtractor::Measured::resize(std::size_t count) {
  const std::size_t padded = count + PeakMeasurements::kLanesAtMost;
  if (offset.size() >= padded) return;
  across.resize(padded);
  for (auto* values : {&offset, &amplitude, &width, &sigma, &significance, &snr, &clipped}) {
    values->resize(padded);
  }
}

PeakMeasurements ProfileExtractor::Measured::arrays() {
  return {across.data(), offset.data(),       amplitude.data(), width.data(),
          sigma.data(),  significance.data(), snr.data(),       clipped.data()};
}

}  // namespace striper::detail
