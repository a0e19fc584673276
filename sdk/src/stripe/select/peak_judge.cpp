// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/select/peak_judge.hpp"

#include <limits>

#include "stripe/candidates/ridges/clipped_runs.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/select/peak_judge.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include "stripe/profile/lanes-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr float kWidthTolerance = 4.0F;  // Standard errors, before a peak is too wide or narrow.
constexpr float kPixelBox2 = 1.0F / 12.0F;
constexpr float kLeastWidth2 = 0.01F;

HWY_INLINE V word(ReturnStatus status) { return set(static_cast<float>(status)); }

// Of a batch of measured peaks.
struct Peaks {
  V position, amplitude, width, sigma, significance, snr, clipped;

  HWY_INLINE Peaks(const PeakList& p, std::size_t i) {
    const Tag d;
    position =
        hn::Add(hn::ConvertTo(d, hn::LoadU(IntTag(), &p.across[i])), hn::LoadU(d, &p.offset[i]));
    amplitude = hn::LoadU(d, &p.amplitude[i]);
    width = hn::LoadU(d, &p.width[i]);
    sigma = hn::LoadU(d, &p.sigma[i]);
    significance = hn::LoadU(d, &p.significance[i]);
    snr = hn::LoadU(d, &p.snr[i]);
    clipped = hn::LoadU(d, &p.clipped[i]);
  }
};

// Written so that a NaN is no stripe.
HWY_INLINE M is_stripe(const PeakLimits& limits, const Peaks& p) {
  const M stands_out = hn::And(hn::Ge(p.significance, set(limits.significance)),
                               hn::Ge(p.amplitude, set(limits.amplitude)));
  const M inside =
      hn::And(hn::Ge(p.position, set(-0.5F)), hn::Le(p.position, set(limits.last + 0.5F)));
  return hn::And(stands_out, inside);
}

// From the least reason to the gravest.
HWY_INLINE V status_of(const PeakLimits& limits, const Peaks& p) {
  const V expected = hn::MulAdd(set(limits.width_slope), p.position, set(limits.width));
  const M is_weak =
      hn::Or(hn::Lt(p.significance, set(limits.weak_significance)), hn::Lt(p.snr, set(limits.snr)));
  V status = hn::IfThenElse(is_weak, word(ReturnStatus::kWeak), word(ReturnStatus::kOk));

  const M is_clipped = hn::Gt(p.clipped, hn::Zero(Tag()));
  const V tolerance = hn::Mul(set(kWidthTolerance), p.sigma);
  const M is_wide = hn::Gt(p.width, hn::MulAdd(set(limits.wide), expected, tolerance));
  const M is_narrow = hn::Lt(p.width, hn::MulSub(set(limits.narrow), expected, tolerance));
  status = hn::IfThenElse(hn::AndNot(is_clipped, is_wide), word(ReturnStatus::kWide), status);
  status = hn::IfThenElse(hn::AndNot(is_clipped, is_narrow), word(ReturnStatus::kNarrow), status);

  const M is_lost =
      hn::Or(hn::Gt(p.clipped, hn::MulAdd(set(kMostClippedWidths), expected, set(1.0F))),
             hn::Not(hn::Le(p.sigma, set(limits.saturated_sigma))));
  status = hn::IfThenElse(hn::And(is_clipped, is_lost), word(ReturnStatus::kSaturated), status);

  const M is_at_edge =
      hn::Or(hn::Lt(p.position, expected), hn::Gt(p.position, hn::Sub(set(limits.last), expected)));
  return hn::IfThenElse(is_at_edge, word(ReturnStatus::kEdge), status);
}

HWY_INLINE V confidence_of(const PeakLimits& limits, V significance) {
  const Tag d;
  constexpr auto kLast = static_cast<float>(Detection::kLargest * Detection::kPerSigma);
  const V at = hn::Mul(significance, set(static_cast<float>(Detection::kPerSigma)));
  if (hn::AllTrue(d, hn::Ge(at, set(kLast)))) return set(limits.not_noise[static_cast<int>(kLast)]);
  const V safe = hn::IfThenElseZero(hn::Gt(at, hn::Zero(d)), hn::Min(at, set(kLast)));
  return hn::GatherIndex(d, limits.not_noise, hn::ConvertTo(IntTag(), safe));
}

void judge_batch(const PeakLimits& limits, PeakList& peaks, std::size_t i) {
  const Tag d;
  const hn::Rebind<std::uint8_t, Tag> d8;
  const Peaks p(peaks, i);
  const M is_there = is_stripe(limits, p);
  const V status = hn::IfThenElse(is_there, status_of(limits, p), word(ReturnStatus::kNoStripe));
  hn::StoreU(hn::DemoteTo(d8, hn::ConvertTo(IntTag(), status)), d8,
             reinterpret_cast<std::uint8_t*>(&peaks.status[i]));

  const V none = set(std::numeric_limits<float>::quiet_NaN());
  const auto store = [&](V value, BlankVector<float>& to) {
    hn::StoreU(hn::IfThenElse(is_there, value, none), d, &to[i]);
  };
  const V width2 = hn::MulSub(p.width, p.width, set(kPixelBox2));
  const V step = set(limits.step);
  store(hn::LoadU(d, &peaks.offset[i]), peaks.offset);
  store(p.amplitude, peaks.amplitude);
  store(hn::Mul(step, root(hn::Max(width2, set(kLeastWidth2)))), peaks.width);
  store(hn::Mul(step, p.sigma), peaks.sigma);
  store(confidence_of(limits, p.significance), peaks.confidence);
}

void judge(const PeakLimits& limits, PeakList& peaks) {
  const auto n = static_cast<std::size_t>(lanes());
  for (std::size_t i = 0; i < peaks.size(); i += n) judge_batch(limits, peaks, i);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(judge);

PeakLimits limits_of(const ExtractOptions& options, const Detection& detection,
                     const WidthModel& width, int length, double step) {
  PeakLimits limits{};
  limits.significance = static_cast<float>(detection.threshold());
  limits.weak_significance = static_cast<float>(detection.weak_threshold());
  limits.amplitude = static_cast<float>(options.threshold_dn.value_or(0.0));
  limits.snr = static_cast<float>(options.min_snr);
  limits.narrow = static_cast<float>(options.min_width_ratio);
  limits.wide = static_cast<float>(options.max_width_ratio);
  limits.saturated_sigma = static_cast<float>(options.max_saturated_sigma_px);
  limits.width = static_cast<float>(width.at(0.0));
  limits.width_slope = static_cast<float>(width.slope);
  limits.last = static_cast<float>(length - 1);
  limits.step = static_cast<float>(step);
  limits.not_noise = detection.not_noise();
  return limits;
}

void judge_peaks(const PeakLimits& limits, PeakList& peaks) {
  HWY_DYNAMIC_DISPATCH(judge)(limits, peaks);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
