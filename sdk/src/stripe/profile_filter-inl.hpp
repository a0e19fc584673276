// SPDX-License-Identifier: Apache-2.0
// Local background, matched filter, log-parabola and its error. Compiled for every instruction set:
// see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_FILTER_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_FILTER_INL_
#undef STRIPER_STRIPE_PROFILE_FILTER_INL_
#else
#define STRIPER_STRIPE_PROFILE_FILTER_INL_
#endif

#include <cstddef>

#include <hwy/contrib/math/math-inl.h>

#include "stripe/profile_window-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr float kLeastBackgroundPixels = 3.0F;
constexpr float kEnoughOnOneSide = 24.0F;

// What a batch's profiles measure.
struct Estimate {
  V position;   // Pixels from the seed.
  V amplitude;  // DN.
  V variance;   // Of the position, pixels^2.
  V curvature;  // Of the logarithm of the filter's answer at its peak, per pixel^2.
};

// ---- Background: a straight line through the ring of pixels on both sides of the stripe.

struct Background {
  V level;           // At the seed.
  V slope;           // Per pixel.
  V level_variance;  // Of `level`, in units of the variance of a pixel.
  V slope_variance;
  V extra;  // Variance beyond noise of the pixels that were trusted.

  // Over the ring's usable pixels: their number, sum of distances from the seed k and of k^2; of
  // what remains, and k times what remains: 0 where a line could be fitted. Of a batch of which
  // nothing is missing the plan knows them.
  V count, sum_k, sum_kk, rest, rest_k;
};

// Reads the window of a batch of which nothing is missing and takes the background off as it goes:
// each pixel is read once. False where a pixel is clipped; then nothing was done.
template <typename Reader>
HWY_INLINE bool read_plain(const ProfilePlan& plan, Reader pixels, int full_scale_dn, Window& w,
                           Background& b) {
  const Tag d;
  const int n = lanes();
  const V zero = hn::Zero(d);
  float* const centre = w.value + plan.window * n;
  V sum = zero;
  V sum_k = zero;
  V k = set(static_cast<float>(plan.core));
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    const V below = pixels.row(plan.window - q);
    const V above = pixels.row(plan.window + q);
    hn::Store(below, d, centre - q * n);
    hn::Store(above, d, centre + q * n);
    k = hn::Add(k, set(1.0F));
    sum = hn::Add(sum, hn::Add(below, above));
    sum_k = hn::MulAdd(k, hn::Sub(above, below), sum_k);
  }
  // Of a whole ring the distances are known beforehand, and they are even.
  const V per_count = set(1.0F / plan.ring_count);
  const V per_squares = set(1.0F / plan.ring_squares);
  b.level = hn::Mul(sum, per_count);
  b.slope = hn::Mul(sum_k, per_squares);
  b.level_variance = per_count;
  b.slope_variance = per_squares;
  b.extra = zero;

  V background = hn::NegMulAdd(set(static_cast<float>(plan.core)), b.slope, b.level);
  for (int row = -plan.core; row <= plan.core; ++row) {
    hn::Store(hn::Sub(pixels.row(plan.window + row), background), d, centre + row * n);
    background = hn::Add(background, b.slope);
  }
  // The filter reaches into the ring.
  for (int q = plan.core + 1; q <= plan.filter_reach; ++q) {
    const V distance = set(static_cast<float>(q));
    float* const below = centre - q * n;
    float* const above = centre + q * n;
    hn::Store(hn::Sub(hn::Load(d, below), hn::NegMulAdd(distance, b.slope, b.level)), d, below);
    hn::Store(hn::Sub(hn::Load(d, above), hn::MulAdd(distance, b.slope, b.level)), d, above);
  }
  w.is_plain = pixels.is_below(full_scale_dn);
  const auto rows = static_cast<float>(2 * plan.window + 1);
  hn::Store(hn::Mul(pixels.dark_sum, set(1.0F / rows)), d, w.dark);
  return w.is_plain;
}

// How far a pixel of the ring is to be trusted: by its variance, where motion and edges have left
// more than noise, beside that of the best pixel.
struct Trust {
  const Window& w;
  V floor;
  V best;  // Variance beyond noise.

  Trust(const ProfilePlan& plan, const Window& window)
      : w(window), floor(set(plan.variance_floor)), best(hn::Zero(Tag())) {
    if (!w.has_extra) return;
    const Tag d;
    const V unknown = set(1e12F);
    V least = unknown;
    for (int q = plan.core + 1; q <= plan.window; ++q) {
      for (const int row : {plan.window - q, plan.window + q}) {
        const int at = row * lanes();
        const M is_usable = hn::Gt(hn::Load(d, w.usable + at), hn::Zero(d));
        least = hn::Min(least, hn::IfThenElse(is_usable, hn::Load(d, w.extra + at), unknown));
      }
    }
    best = hn::IfThenElseZero(hn::Lt(least, unknown), least);
  }

  HWY_INLINE V of(int at, V usable) const {
    if (!w.has_extra) return usable;
    const V variance = hn::Add(floor, hn::Load(Tag(), w.extra + at));
    return hn::Mul(usable, ratio(hn::Add(floor, best), variance));
  }
};

void fit_ring(const ProfilePlan& plan, const Window& w, Background& b) {
  const Tag d;
  const int n = lanes();
  const Trust trust(plan, w);
  V pixels = hn::Zero(d);
  V count_below = hn::Zero(d);
  V count_above = hn::Zero(d);
  V s1 = hn::Zero(d);
  V s2 = hn::Zero(d);
  V sf = hn::Zero(d);
  V s1f = hn::Zero(d);
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    const int below = (plan.window - q) * n;
    const int above = (plan.window + q) * n;
    const V usable_below = hn::Load(d, w.usable + below);
    const V usable_above = hn::Load(d, w.usable + above);
    pixels = hn::Add(pixels, hn::Add(usable_below, usable_above));
    const V u0 = trust.of(below, usable_below);
    const V u1 = trust.of(above, usable_above);
    const V f0 = hn::Mul(u0, hn::Load(d, w.value + below));
    const V f1 = hn::Mul(u1, hn::Load(d, w.value + above));
    const V k = set(static_cast<float>(q));
    count_below = hn::Add(count_below, u0);
    count_above = hn::Add(count_above, u1);
    s1 = hn::MulAdd(k, hn::Sub(u1, u0), s1);
    s2 = hn::MulAdd(hn::Mul(k, k), hn::Add(u0, u1), s2);
    sf = hn::Add(sf, hn::Add(f0, f1));
    s1f = hn::MulAdd(k, hn::Sub(f1, f0), s1f);
  }
  const V count = hn::Add(count_below, count_above);
  const V least = set(kLeastBackgroundPixels);
  const M has_any = hn::Ge(pixels, least);
  // A few pixels on one side alone tell no slope: the level is their mean.
  const M has_slope = hn::Or(hn::Ge(hn::Min(count_below, count_above), least),
                             hn::Ge(count, set(kEnoughOnOneSide)));
  const V det = hn::IfThenElse(has_slope, hn::NegMulAdd(s1, s1, hn::Mul(count, s2)), set(1.0F));
  const V safe_count = hn::Max(count, set(1.0F));
  b.level = hn::IfThenElse(has_slope, ratio(hn::NegMulAdd(s1, s1f, hn::Mul(s2, sf)), det),
                           ratio(sf, safe_count));
  b.slope = hn::IfThenElseZero(has_slope, ratio(hn::NegMulAdd(s1, sf, hn::Mul(count, s1f)), det));
  b.level_variance = hn::IfThenElse(has_slope, ratio(s2, det), inverse(safe_count));
  b.slope_variance = hn::IfThenElseZero(has_slope, ratio(count, det));
  // Without background there is no telling what stands out from it: no significance.
  b.level = hn::IfThenElseZero(has_any, b.level);
  b.level_variance = hn::IfThenElse(has_any, b.level_variance, set(1e12F));
  b.extra = trust.best;
  b.count = count;
  b.sum_k = s1;
  b.sum_kk = s2;
  b.rest = hn::IfThenZeroElse(has_any, sf);
  b.rest_k = hn::IfThenZeroElse(has_slope, hn::NegMulAdd(b.level, s1, s1f));
}

// From here on `value` is without its background; unseen pixels are 0.
void remove_background(const ProfilePlan& plan, const Background& b, Window& w) {
  const Tag d;
  const int n = lanes();
  V background = hn::NegMulAdd(set(static_cast<float>(plan.window)), b.slope, b.level);
  for (int k = 0; k <= 2 * plan.window; ++k) {
    const V value = hn::Sub(hn::Load(d, w.value + k * n), background);
    hn::Store(hn::Mul(value, hn::Load(d, w.seen + k * n)), d, w.value + k * n);
    background = hn::Add(background, b.slope);
  }
}

// ---- Noise: all that does not change along a profile.

// What the filter's peak has of the variance that motion and edges leave in `lit - dark`.
struct ExtraVariance {
  V of_pixel;     // The mean over the filter.
  V of_response;  // Of the filter's answer: texture errs alike from pixel to pixel.
};

struct Noise {
  V base;     // Variance of a pixel of the background.
  V per_dn;   // Its growth with the signal,
  V speckle;  // and with the square of the signal.

  HWY_INLINE V variance(V signal) const {
    return hn::MulAdd(signal, hn::MulAdd(speckle, signal, per_dn), base);
  }
  HWY_INLINE Noise with(const ExtraVariance& extra) const {
    return {hn::Add(base, extra.of_pixel), per_dn, speckle};
  }
};

Noise noise_of(const ProfilePlan& plan, const ProfileImages& images, const Background& background,
               const Window& w) {
  const Tag d;
  const V dark = hn::Load(d, w.dark);
  const V per_dn = set(plan.variance_per_dn);
  const V light =
      hn::Max(hn::Sub(hn::Add(background.level, dark), set(plan.black_dn)), hn::Zero(d));
  V base = hn::MulAdd(per_dn, light, set(plan.variance_floor));
  if (images.dark != nullptr && plan.dark_noise_gain > 0.0F) {
    const V dark_light = hn::Max(hn::Sub(dark, set(plan.black_dn)), hn::Zero(d));
    const V of_an_exposure = hn::MulAdd(per_dn, dark_light, set(plan.variance_floor));
    base = hn::MulAdd(set(plan.dark_noise_gain), of_an_exposure, base);
  }
  return {base, per_dn, set(plan.speckle2)};
}

// ---- Matched filter.

struct FilterPeak {
  V at;  // Whole pixels from the seed.
  V before, peak, after;
};

// The filter's response at a pixel. Of common lengths the taps stay in registers.
template <int kTaps>
struct Filter {
  V tap[kTaps + 1];

  explicit HWY_INLINE Filter(const ProfilePlan& plan) {
    for (int i = 0; i <= kTaps; ++i) tap[i] = set(plan.filter[static_cast<std::size_t>(i)]);
  }

  HWY_INLINE V at(const float* centre) const {
    const Tag d;
    const int n = lanes();
    V even = hn::Mul(tap[0], hn::Load(d, centre));
    V odd = hn::Mul(tap[1], hn::Load(d, centre + n));
    even = hn::MulAdd(tap[1], hn::Load(d, centre - n), even);
    for (int i = 2; i <= kTaps; ++i) {
      even = hn::MulAdd(tap[i], hn::Load(d, centre - i * n), even);
      odd = hn::MulAdd(tap[i], hn::Load(d, centre + i * n), odd);
    }
    return hn::Add(even, odd);
  }
};

struct LongFilter {
  const ProfilePlan& plan;

  HWY_INLINE V at(const float* centre) const {
    const Tag d;
    const int n = lanes();
    V even = hn::Mul(set(plan.filter[0]), hn::Load(d, centre));
    V odd = hn::Zero(d);
    for (int i = 1; i <= plan.taps; ++i) {
      const V tap = set(plan.filter[static_cast<std::size_t>(i)]);
      even = hn::MulAdd(tap, hn::Load(d, centre - i * n), even);
      odd = hn::MulAdd(tap, hn::Load(d, centre + i * n), odd);
    }
    return hn::Add(even, odd);
  }
};

template <typename AnyFilter>
HWY_INLINE FilterPeak find_peak_of(const AnyFilter& filter, const ProfilePlan& plan,
                                   const Window& w) {
  const int n = lanes();
  const float* next = w.value + (plan.window - plan.reach - 1) * n;
  V before = filter.at(next);
  V here = filter.at(next + n);
  next += 2 * n;
  V at = set(static_cast<float>(-plan.reach));
  FilterPeak best{hn::Zero(Tag()), before, set(-1e30F), here};
  for (int i = -plan.reach; i <= plan.reach; ++i, next += n) {
    const V after = filter.at(next);
    const M higher = hn::Gt(here, best.peak);
    best.at = hn::IfThenElse(higher, at, best.at);
    best.before = hn::IfThenElse(higher, before, best.before);
    best.after = hn::IfThenElse(higher, after, best.after);
    best.peak = hn::IfThenElse(higher, here, best.peak);
    before = here;
    here = after;
    at = hn::Add(at, set(1.0F));
  }
  return best;
}

FilterPeak find_filter_peak(const ProfilePlan& plan, const Window& w) {
  switch (plan.taps) {
    case 3:
      return find_peak_of(Filter<3>(plan), plan, w);
    case 4:
      return find_peak_of(Filter<4>(plan), plan, w);
    case 5:
      return find_peak_of(Filter<5>(plan), plan, w);
    case 6:
      return find_peak_of(Filter<6>(plan), plan, w);
    case 7:
      return find_peak_of(Filter<7>(plan), plan, w);
    default:
      return find_peak_of(LongFilter{plan}, plan, w);
  }
}

HWY_NOINLINE ExtraVariance extra_at_peak(const ProfilePlan& plan, const Window& w, V at) {
  const Tag d;
  const IntTag di;
  const int n = lanes();
  const auto first = hn::Add(hn::Mul(hn::ConvertTo(di, at), hn::Set(di, n)), hn::Iota(di, 0));
  V squares = hn::Zero(d);
  V deviations = hn::Zero(d);
  for (int i = -plan.taps; i <= plan.taps; ++i) {
    const auto index = hn::Add(first, hn::Set(di, (plan.window + i) * n));
    const V deviation = hn::Mul(set(plan.filter[static_cast<std::size_t>(i < 0 ? -i : i)]),
                                hn::Sqrt(hn::GatherIndex(d, w.extra, index)));
    squares = hn::MulAdd(deviation, deviation, squares);
    deviations = hn::Add(deviations, deviation);
  }
  return {hn::Mul(squares, set(1.0F / plan.filter_energy)), hn::Mul(deviations, deviations)};
}

HWY_INLINE V width_at(const ProfilePlan& plan, V across) {
  const V width = hn::MulAdd(set(plan.width_slope), across, set(plan.width));
  return hn::Min(hn::Max(width, set(plan.smallest_width)), set(plan.largest_width));
}

// -ln(b / a) for s = (a - b) / (a + b), 0 <= s <= 1: 2 artanh(s), exact to 1e-6 of itself as far as
// b / a = 0.3, where the filter of a stripe does not get.
HWY_INLINE V fall(V s) {
  const V z = hn::Mul(s, s);
  V sum = hn::MulAdd(z, set(0.44359741F), set(0.21910426F));
  sum = hn::MulAdd(z, sum, set(0.40758425F));
  sum = hn::MulAdd(z, sum, set(0.66637434F));
  return hn::Mul(s, hn::MulAdd(z, sum, set(2.0000018F)));
}

struct LogPeak {
  V offset;     // Of the peak from the filter's peak pixel.
  V curvature;  // Per pixel^2.
};

// Gauss-3 on the filtered profile, exact for a Gaussian, because Gaussian * Gaussian is Gaussian.
HWY_INLINE LogPeak log_parabola(const ProfilePlan& plan, const FilterPeak& f) {
  const V peak = hn::Max(f.peak, set(1e-3F));
  const V before = hn::Min(hn::Max(f.before, hn::Zero(Tag())), peak);
  const V after = hn::Min(hn::Max(f.after, hn::Zero(Tag())), peak);
  const V sum_before = hn::Add(peak, before);
  const V sum_after = hn::Add(peak, after);
  const V per_sums = inverse(hn::Mul(sum_before, sum_after));
  const V fall_before = fall(hn::Mul(hn::Mul(hn::Sub(peak, before), sum_after), per_sums));
  const V fall_after = fall(hn::Mul(hn::Mul(hn::Sub(peak, after), sum_before), per_sums));
  const V curvature = hn::Max(hn::Add(fall_before, fall_after), set(1e-4F));
  const V half = set(0.5F);
  V offset = hn::Mul(half, ratio(hn::Sub(fall_before, fall_after), curvature));
  offset = hn::Min(hn::Max(offset, hn::Neg(half)), half);
  if (plan.is_coarse) {
    const V square = hn::Mul(offset, offset);
    const V shape = hn::MulAdd(set(plan.filter_locking[1]), square, set(plan.filter_locking[0]));
    const V inside = hn::NegMulAdd(set(4.0F), square, set(1.0F));
    offset = hn::NegMulAdd(hn::Mul(offset, inside), shape, offset);
  }
  return {offset, curvature};
}

// The error of matched filter and log-parabola: that of the zero crossing of its derivative, in
// white noise, noise that grows with the signal and with its square (speckle), and of the slope of
// the background.
HWY_INLINE V filter_variance(const ProfilePlan& plan, const Noise& noise,
                             const Background& background, V width, V amplitude) {
  const V a = hn::Max(amplitude, set(1e-3F));
  const V w2 = hn::Mul(width, width);
  const V shot = hn::Mul(set(plan.filter_shot), noise.per_dn);
  const V speckle = hn::Mul(set(plan.filter_speckle), noise.speckle);
  const V of_signal = hn::Mul(a, hn::MulAdd(speckle, a, shot));
  const V of_slope = hn::Mul(hn::Mul(set(plan.filter_slope), hn::Mul(w2, w2)),
                             hn::Mul(background.slope_variance, noise.base));
  const V of_pixels = hn::MulAdd(set(plan.filter_white), noise.base, of_signal);
  return ratio(hn::MulAdd(width, of_pixels, of_slope), hn::Mul(a, a));
}

// Position and amplitude from the filter's peak alone, for a stripe of this width.
HWY_INLINE Estimate estimate_from_filter(const ProfilePlan& plan, const FilterPeak& peak, V width) {
  const LogPeak top = log_parabola(plan, peak);
  // The filter's peak value for a stripe of this width is A w f sqrt(2 pi / (w^2 + f^2)).
  const V total = hn::MulAdd(width, width, set(plan.filter_sigma * plan.filter_sigma));
  const V inverse_root_of_total = inverse_root(total);
  const V total_root = hn::Mul(total, inverse_root_of_total);
  const V per_gain = ratio(total_root, hn::Mul(width, set(plan.filter_sigma * 2.5066283F)));
  // exp(x), x below 0.2.
  const V per_total = hn::Mul(inverse_root_of_total, inverse_root_of_total);
  const V x = hn::Mul(hn::Mul(set(0.5F), hn::Mul(top.offset, top.offset)), per_total);
  V lift = hn::MulAdd(x, set(1.0F / 24.0F), set(1.0F / 6.0F));
  for (const float coefficient : {0.5F, 1.0F, 1.0F}) {
    lift = hn::MulAdd(x, lift, set(coefficient));
  }
  Estimate e;
  e.position = hn::Add(peak.at, top.offset);
  e.amplitude = hn::Mul(hn::Mul(peak.peak, lift), per_gain);
  e.variance = hn::Zero(Tag());
  e.curvature = top.curvature;
  return e;
}

// The variance of a position given its own profile. Noise that sharpens the peak of the likelihood
// makes its place less uncertain, noise that blunts it more: one over the observed information, not
// over the expected one (Efron & Hinkley 1978). The filter's answer R is the likelihood's root, so
// that its peak's curvature is the information's, beside 1 / (w^2 + f^2). To the next order in one
// over the peak's signal-to-noise ratio rho, that of position over sigma is 1 + 2 / rho^2, and 2 /
// rho^2 is variance / w^2.
HWY_INLINE V observed_variance(const ProfilePlan& plan, const Estimate& e, V width) {
  const V w2 = hn::Mul(width, width);
  const V total = hn::Add(w2, set(plan.filter_sigma * plan.filter_sigma));
  const V sharpness = hn::Min(hn::Max(hn::Mul(total, e.curvature), set(0.5F)), set(2.0F));
  const V per_both = inverse(hn::Mul(sharpness, w2));
  const V variance = hn::Mul(e.variance, hn::Mul(w2, per_both));
  const V over_w2 = hn::Mul(variance, hn::Mul(sharpness, per_both));
  return hn::MulAdd(variance, over_w2, variance);
}

// The stripe's width from the curvature of the filter's peak, without the noise that the filter's
// own response has, so that weak profiles are not too wide.
HWY_INLINE V width_from_filter(const ProfilePlan& plan, const FilterPeak& f, const Noise& noise) {
  const V own = hn::Mul(noise.base, set(plan.filter_energy));
  const V shared = hn::Mul(noise.base, set(plan.filter_covariance));
  const V sides = hn::Sub(hn::Mul(f.before, f.after), shared);
  const V centre = hn::Max(hn::Sub(hn::Mul(f.peak, f.peak), own), set(1e-6F));
  const V below = hn::Min(hn::Max(sides, hn::Zero(Tag())), centre);
  const V curvature = fall(ratio(hn::Sub(centre, below), hn::Add(centre, below)));
  const V total = inverse(hn::Max(curvature, set(1e-4F)));
  const V filter2 = set(plan.filter_sigma * plan.filter_sigma);
  return root(hn::Max(hn::Sub(total, filter2), set(0.04F)));
}

// The filter's response in standard deviations of its noise, that of the background included.
HWY_INLINE V significance_of(const ProfilePlan& plan, const FilterPeak& f,
                             const Background& background, const Noise& noise,
                             const ExtraVariance& extra) {
  const V sum2 = set(plan.filter_sum * plan.filter_sum);
  const V of_background =
      hn::Mul(hn::Mul(sum2, background.level_variance), hn::Add(noise.base, background.extra));
  const V beyond_filter = hn::Add(of_background, extra.of_response);
  return hn::Mul(f.peak,
                 inverse_root(hn::MulAdd(noise.base, set(plan.filter_energy), beyond_filter)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_FILTER_INL_
