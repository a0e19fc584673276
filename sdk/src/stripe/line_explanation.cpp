// SPDX-License-Identifier: Apache-2.0
// ProfileExtractor::explain: the scan line measured once more, with each cause of error alone.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stripe/line_explanation.hpp>

#include "stripe/profile/line_view.hpp"
#include "stripe/profile_extractor.hpp"

namespace striper {

std::string_view to_string(CandidateFate fate) noexcept {
  switch (fate) {
    case CandidateFate::kChosen:
      return "chosen";
    case CandidateFate::kLessProbable:
      return "less_probable";
    case CandidateFate::kOutside:
      return "outside";
    case CandidateFate::kNotSignificant:
      break;
  }
  return "not_significant";
}

namespace detail {
namespace {

void copy_line(const cv::Mat& image, StripeAxis axis, int line, std::vector<float>& values) {
  if (image.empty()) return;
  const cv::Mat pixels = axis == StripeAxis::kColumns ? image.col(line).t() : image.row(line);
  cv::Mat as_float;
  pixels.convertTo(as_float, CV_32F);
  values.assign(as_float.ptr<float>(), as_float.ptr<float>() + as_float.total());
}

double variance_of(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed& seed) {
  PeakList one;
  one.make_room(1);
  one.seeds.assign(1, seed);
  measure_profiles(images, plan, one.seeds.data(), 1, one.measurements());
  return static_cast<double>(one.sigma[0]) * static_cast<double>(one.sigma[0]);
}

double root(double variance) { return std::sqrt(std::max(0.0, variance)); }

}  // namespace

void ProfileExtractor::keep_for_explanation(const LitFrame& frame, const PlanNoise& noise,
                                            const WidthModel& width, const Stripe& stripe) {
  const auto copy = [](const cv::Mat& from, cv::Mat& to) {
    from.empty() ? to.release() : from.copyTo(to);
  };
  Kept& kept = kept_;
  const cv::Mat lit = kept.frame.lit;  // The memory stays.
  cv::Mat dark = kept.frame.dark;
  cv::Mat variance = kept.frame.variance;
  cv::Mat masked = kept.frame.masked;
  kept.frame = frame;
  kept.frame.lit = lit;
  copy(frame.lit, kept.frame.lit);
  copy(frame.dark, dark);
  copy(frame.variance, variance);
  copy(frame.masked, masked);
  kept.frame.dark = dark;
  kept.frame.variance = variance;
  kept.frame.masked = masked;
  kept.noise = noise;
  kept.width = width;
  kept.stripe = stripe;
}

LineExplanation ProfileExtractor::explain(int line) const {
  const LitFrame& frame = kept_.frame;
  if (frame.lit.empty()) {
    throw Error(ErrorKind::kBadValue, "explain: no frame was kept; set can_explain before");
  }
  const int lines = line_count(frame.lit, options_.axis);
  if (line < 0 || line >= lines) {
    throw Error(ErrorKind::kBadValue, fmt::format("scan line {} - expected 0 to {}, the image's {}",
                                                  line, lines - 1, to_string(options_.axis)));
  }
  const AxisGrid& across = grid_across(frame.grid, options_.axis);
  LineExplanation why;
  why.line = line;
  why.first_px = across.sensor(0.0);
  why.step_px = across.step;
  copy_line(frame.lit, options_.axis, line, why.lit);
  copy_line(frame.dark, options_.axis, line, why.dark);
  why.noise_dn = noise_dn_of(kept_.noise);
  why.least_significance = finder_.detection().threshold();
  why.expected_width_px = across.step * typical_width(kept_.width);
  why.from_px = why.first_px;
  why.to_px = across.sensor(static_cast<double>(why.lit.size()) - 1.0);
  if (part_.is_limited()) {
    why.from_px = std::max(why.from_px, across.sensor(part_.first_of(line)));
    why.to_px = std::min(why.to_px, across.sensor(part_.last_of(line)));
  }
  why.is_chosen_over_lines = !choice_.is_plain();
  why.is_bridged = bridges_.has(line);
  explain_candidates(across, why);
  explain_sigma(across, why);
  return why;
}

// The candidates that were to be chosen among, and those that were not.
void ProfileExtractor::explain_candidates(const AxisGrid& across, LineExplanation& why) const {
  const StripePieces& pieces = choice_.pieces();
  const StripeChoice::Chosen& chosen = choice_.of_line(why.line);
  const auto index = static_cast<std::size_t>(why.line);
  const float probability = confidence_.of_line(index).value_or(chosen.confidence);
  const auto add = [&](const PeakList& list, std::size_t i) {
    LineCandidate c;
    // What was refused before it was measured has no finer position than its pixel.
    const double at = list.position(i);
    c.across_px = across.sensor(std::isfinite(at) ? at : static_cast<double>(list.across[i]));
    c.sigma_px = across.step * static_cast<double>(list.sigma[i]);
    c.amplitude_dn = static_cast<double>(list.amplitude[i]);
    c.width_px = across.step * static_cast<double>(list.width[i]);
    c.significance = static_cast<double>(list.significance[i]);
    c.snr = static_cast<double>(list.snr[i]);
    const bool is_outside = c.across_px < why.from_px || c.across_px > why.to_px;
    c.fate = is_outside ? CandidateFate::kOutside : CandidateFate::kNotSignificant;
    why.candidates.push_back(c);
  };
  for (std::size_t i = pieces.first_of(why.line); i < pieces.first_of(why.line + 1); ++i) {
    const Candidate& candidate = pieces.candidate(i);
    const Piece& piece = pieces.pieces()[static_cast<std::size_t>(pieces.link(i).piece)];
    add(*candidate.list, candidate.at);
    LineCandidate& c = why.candidates.back();
    const bool is_chosen = static_cast<std::int32_t>(i) == chosen.candidate && !why.is_bridged;
    const bool is_rival = static_cast<std::int32_t>(i) == chosen.rival_candidate;
    c.fate = is_chosen ? CandidateFate::kChosen : CandidateFate::kLessProbable;
    c.probability = static_cast<double>(is_chosen  ? probability
                                        : is_rival ? std::min(chosen.rival, 1.0F - probability)
                                                   : 0.0F);
    c.lines = piece.count;
    c.support = piece.support;
  }
  const auto is_listed = [&](const PeakList& list, std::size_t i) {
    const double at_px = across.sensor(list.position(i));  // NaN: not measured, not listed.
    return std::any_of(why.candidates.begin(), why.candidates.end(),
                       [&](const LineCandidate& c) { return c.across_px == at_px; });
  };
  for (const PeakList* const list :
       {&finder_.candidates().primary, &finder_.candidates().secondary}) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      if (list->seeds[i].line == why.line && !is_listed(*list, i)) add(*list, i);
    }
  }
  std::stable_sort(why.candidates.begin(), why.candidates.end(),
                   [](const LineCandidate& a, const LineCandidate& b) {
                     const bool is_first = a.fate == CandidateFate::kChosen;
                     if (is_first != (b.fate == CandidateFate::kChosen)) return is_first;
                     return a.significance > b.significance;
                   });
}

// Each cause alone, as the kernel has it; what is reported beyond them has other causes.
void ProfileExtractor::explain_sigma(const AxisGrid& across, LineExplanation& why) const {
  const auto element = std::find(kept_.stripe.line.begin(), kept_.stripe.line.end(), why.line);
  if (element == kept_.stripe.line.end()) return;
  const auto i = static_cast<std::size_t>(element - kept_.stripe.line.begin());
  if (!(kept_.stripe.sigma_px[i] > 0.0F)) return;
  const double at = across.index(kept_.stripe.across_px[i]);
  const PeakSeed seed{why.line, static_cast<std::int32_t>(std::lround(at))};
  const ProfileImages images = images_of(kept_.frame, options_.axis);
  const bool refine = options_.method == ExtractMethod::kRefined;
  const auto variance = [&](const PlanNoise& noise, bool has_locking) {
    ProfilePlan plan =
        plan_profile(kept_.width, noise, refine,
                     finder_.is_hidden() ? BackgroundReach::kNarrow : BackgroundReach::kUsual);
    if (!has_locking) {
      plan.has_filter_locking = false;
      plan.locking_variance = plan.clipped_locking_variance = 0.0F;
    }
    return across.step * across.step * variance_of(images, plan, seed);
  };
  PlanNoise without_speckle = kept_.noise;
  without_speckle.speckle_contrast = 0.0;
  PlanNoise read_only = without_speckle;
  read_only.model.dn_per_electron = 0.0;
  const double read = variance(read_only, false);
  const double shot = variance(without_speckle, false);
  const double speckle = variance(kept_.noise, false);
  const double all = variance(kept_.noise, true);
  const double total = static_cast<double>(kept_.stripe.sigma_px[i]);
  why.sigma_px = {root(read),          root(shot - read),         root(speckle - shot),
                  root(all - speckle), root(total * total - all), total};
}

}  // namespace detail
}  // namespace striper
