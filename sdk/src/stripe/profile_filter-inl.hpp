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
#include <type_traits>

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
  V position;       // Pixels from the seed.
  V amplitude;      // DN.
  V variance;       // Of the position, pixels^2.
  V per_curvature;  // Of the logarithm of the filter's answer at its peak, pixels^2.
};

// ---- Background: a straight line through the ring of pixels on both sides of the stripe.

struct Background {
  V level;           // At the seed.
  V slope;           // Per pixel.
  V level_variance;  // Of `level`, in units of the variance of a pixel.
  V slope_variance;
  V extra;  // Variance beyond noise of the pixels that were trusted.

  // What of `level` and `slope` the window's pixels still have.
  V left_level, left_slope;

  // Over the ring's usable pixels: their number, sum of distances from the seed k and of k^2; of
  // what remains, and k times what remains: 0 where a line could be fitted. Of a batch of which
  // nothing is missing the plan knows them.
  V count, sum_k, sum_kk, rest, rest_k;
};

// Reads the window of a batch of which nothing is missing; each pixel is read once, and its
// background stays on. False where a pixel is clipped; then nothing was done.
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
  auto place_below = pixels.place_of(plan.window - plan.core - 1);
  auto place_above = pixels.place_of(plan.window + plan.core + 1);
  for (std::ptrdiff_t q = plan.core + 1; q <= plan.window; ++q) {
    const V below = pixels.row_then_down(place_below);
    const V above = pixels.row_then_up(place_above);
    hn::Store(below, d, centre - q * n);
    hn::Store(above, d, centre + q * n);
    k = hn::Add(k, set(1.0F));
    sum = hn::Add(sum, hn::Add(below, above));
    sum_k = hn::MulAdd(k, hn::Sub(above, below), sum_k);
  }
  // Of a whole ring the distances are known beforehand, and they are even.
  const V per_count = set(plan.per_ring_count);
  const V per_squares = set(plan.per_ring_squares);
  b.level = hn::Mul(sum, per_count);
  b.slope = hn::Mul(sum_k, per_squares);
  b.level_variance = per_count;
  b.slope_variance = per_squares;
  b.extra = zero;
  b.left_level = b.level;
  b.left_slope = b.slope;
  auto place = pixels.place_of(plan.window - plan.core);
  for (std::ptrdiff_t row = -plan.core; row <= plan.core; ++row) {
    hn::Store(pixels.row_then_up(place), d, centre + row * n);
  }
  w.is_plain = pixels.is_below(full_scale_dn);
  hn::Store(hn::Mul(pixels.dark_sum, set(plan.per_rows)), d, w.dark);
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
void remove_background(const ProfilePlan& plan, Background& b, Window& w) {
  const Tag d;
  b.left_level = b.left_slope = hn::Zero(d);
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
  HWY_INLINE Noise with(V extra) const { return {hn::Add(base, extra), per_dn, speckle}; }
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

// The background that a window has kept, as the filter sees it at successive pixels.
struct FilteredBackground {
  V next, step;

  HWY_INLINE FilteredBackground(const ProfilePlan& plan, const Background& b, int first) {
    const V sum = set(plan.filter_sum);
    step = hn::Mul(sum, b.left_slope);
    next = hn::MulAdd(set(static_cast<float>(first)), step, hn::Mul(sum, b.left_level));
  }

  HWY_INLINE V take_off(V response) {
    const V without = hn::Sub(response, next);
    next = hn::Add(next, step);
    return without;
  }
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

// `any_reach` is plan.reach, perhaps known when this is compiled.
template <typename AnyFilter, typename Reach>
HWY_INLINE FilterPeak find_peak_of(const AnyFilter& filter, Reach any_reach,
                                   const ProfilePlan& plan, const Background& b, const Window& w) {
  const int n = lanes();
  const int reach = any_reach;
  const float* next = w.value + (plan.window - reach - 1) * n;
  FilteredBackground background(plan, b, -reach - 1);
  V before = background.take_off(filter.at(next));
  V here = background.take_off(filter.at(next + n));
  next += 2 * n;
  V at = set(static_cast<float>(-reach));
  FilterPeak best{hn::Zero(Tag()), before, set(-1e30F), here};
  for (int i = -reach; i <= reach; ++i, next += n) {
    const V after = background.take_off(filter.at(next));
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

// The reach of stripes up to a sigma of 1.6 pixels is known when this is compiled: without a loop
// every row is loaded once for all of the filter's places.
template <int kTaps>
HWY_INLINE FilterPeak find_peak_of(const ProfilePlan& plan, const Background& b, const Window& w) {
  using CommonReach = std::integral_constant<int, 3>;
  const Filter<kTaps> filter(plan);
  if (plan.reach == CommonReach()) return find_peak_of(filter, CommonReach(), plan, b, w);
  return find_peak_of(filter, plan.reach, plan, b, w);
}

FilterPeak find_filter_peak(const ProfilePlan& plan, const Background& b, const Window& w) {
  switch (plan.taps) {
    case 3:
      return find_peak_of<3>(plan, b, w);
    case 4:
      return find_peak_of<4>(plan, b, w);
    case 5:
      return find_peak_of<5>(plan, b, w);
    case 6:
      return find_peak_of<6>(plan, b, w);
    case 7:
      return find_peak_of<7>(plan, b, w);
    default:
      return find_peak_of(LongFilter{plan}, plan.reach, plan, b, w);
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
  V offset;         // Of the peak from the filter's peak pixel.
  V per_curvature;  // Pixels^2.
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
  const V per_curvature = inverse(hn::Max(hn::Add(fall_before, fall_after), set(1e-4F)));
  const V half = set(0.5F);
  V offset = hn::Mul(hn::Mul(half, hn::Sub(fall_before, fall_after)), per_curvature);
  offset = hn::Min(hn::Max(offset, hn::Neg(half)), half);
  if (plan.is_coarse) {
    const V square = hn::Mul(offset, offset);
    const V shape = hn::MulAdd(set(plan.filter_locking[1]), square, set(plan.filter_locking[0]));
    const V inside = hn::NegMulAdd(set(4.0F), square, set(1.0F));
    offset = hn::NegMulAdd(hn::Mul(offset, inside), shape, offset);
  }
  return {offset, per_curvature};
}

// What follows from a stripe's expected width.
struct Expected {
  V width, width2, per_width2;
  V per_total;  // 1 / (width^2 + filter_sigma^2)
  V per_gain;   // Amplitude over the filter's answer, A w f sqrt(2 pi / (w^2 + f^2)).

  HWY_INLINE Expected(const ProfilePlan& plan, V w) : width(w), width2(hn::Mul(w, w)) {
    const V total = hn::Add(width2, set(plan.filter_sigma * plan.filter_sigma));
    const V per_roots = inverse_root(hn::Mul(total, width2));
    const V per_both = hn::Mul(per_roots, per_roots);
    per_width2 = hn::Mul(total, per_both);
    per_total = hn::Mul(width2, per_both);
    per_gain = hn::Mul(hn::Mul(total, per_roots), set(plan.per_filter_root));
  }
};

// The error of matched filter and log-parabola: that of the zero crossing of its derivative, in
// white noise, noise that grows with the signal and with its square (speckle), and of the slope of
// the background.
HWY_INLINE V filter_variance(const ProfilePlan& plan, const Noise& noise, V slope_variance,
                             const Expected& expected, V amplitude) {
  const V a = hn::Max(amplitude, set(1e-3F));
  const V shot = hn::Mul(set(plan.filter_shot), noise.per_dn);
  const V speckle = hn::Mul(set(plan.filter_speckle), noise.speckle);
  const V of_signal = hn::Mul(a, hn::MulAdd(speckle, a, shot));
  const V of_slope =
      hn::Mul(hn::Mul(set(plan.filter_slope), hn::Mul(expected.width2, expected.width2)),
              hn::Mul(slope_variance, noise.base));
  const V of_pixels = hn::MulAdd(set(plan.filter_white), noise.base, of_signal);
  return hn::Mul(hn::MulAdd(expected.width, of_pixels, of_slope), rough_inverse(hn::Mul(a, a)));
}

// Position and amplitude from the filter's peak alone, for a stripe of the expected width.
HWY_INLINE Estimate estimate_from_filter(const ProfilePlan& plan, const FilterPeak& peak,
                                         const Expected& expected) {
  const LogPeak top = log_parabola(plan, peak);
  // exp(x), x below 0.2.
  const V x = hn::Mul(hn::Mul(set(0.5F), hn::Mul(top.offset, top.offset)), expected.per_total);
  V lift = hn::MulAdd(x, set(1.0F / 24.0F), set(1.0F / 6.0F));
  for (const float coefficient : {0.5F, 1.0F, 1.0F}) {
    lift = hn::MulAdd(x, lift, set(coefficient));
  }
  Estimate e;
  e.position = hn::Add(peak.at, top.offset);
  e.amplitude = hn::Mul(hn::Mul(peak.peak, lift), expected.per_gain);
  e.variance = hn::Zero(Tag());
  e.per_curvature = top.per_curvature;
  return e;
}

// The variance of a position given its own profile. Noise that sharpens the peak of the likelihood
// makes its place less uncertain, noise that blunts it more: one over the observed information, not
// over the expected one (Efron & Hinkley 1978). The filter's answer R is the likelihood's root, so
// that its peak's curvature is the information's, beside 1 / (w^2 + f^2). To the next order in one
// over the peak's signal-to-noise ratio rho, that of position over sigma is 1 + 2 / rho^2, and 2 /
// rho^2 is variance / w^2.
HWY_INLINE V observed_variance(const Estimate& e, const Expected& expected) {
  const V bluntness = hn::Mul(e.per_curvature, expected.per_total);
  const V believed = hn::Min(hn::Max(bluntness, set(0.5F)), set(2.0F));
  const V variance = hn::Mul(e.variance, believed);
  return hn::MulAdd(hn::Mul(variance, variance), expected.per_width2, variance);
}

// The stripe's width from the curvature of the filter's peak, without the noise that the filter's
// own response has, so that weak profiles are not too wide.
HWY_INLINE V width_from_filter(const ProfilePlan& plan, const FilterPeak& f, V base) {
  const V own = hn::Mul(base, set(plan.filter_energy));
  const V shared = hn::Mul(base, set(plan.filter_covariance));
  const V centre = hn::Max(hn::Sub(hn::Mul(f.peak, f.peak), own), set(1e-6F));
  const V beside = hn::Max(hn::Sub(hn::Mul(f.before, f.after), shared), hn::Zero(Tag()));
  // 1 / (2 artanh(s)), s = less / more, by its series.
  const V less = hn::Max(hn::Sub(centre, beside), hn::Mul(set(1e-4F), centre));
  const V more = hn::Add(centre, beside);
  const V per_both = rough_inverse(hn::Mul(less, more));
  const V s = hn::Mul(hn::Mul(less, less), per_both);
  const V z = hn::Mul(s, s);
  V series = hn::MulAdd(z, set(-0.0302F), set(-44.0F / 945.0F));
  series = hn::MulAdd(z, series, set(-4.0F / 45.0F));
  series = hn::MulAdd(z, series, set(-1.0F / 3.0F));
  series = hn::MulAdd(z, series, set(1.0F));
  const V total = hn::Mul(hn::Mul(series, set(0.5F)), hn::Mul(hn::Mul(more, more), per_both));
  const V filter2 = set(plan.filter_sigma * plan.filter_sigma);
  return rough_root(hn::Max(hn::Sub(total, filter2), set(0.04F)));
}

// What the filter's response varies by beyond the noise of the pixels filtered: the background's
// error and what motion and edges have left.
HWY_INLINE V response_variance_of(const ProfilePlan& plan, const Background& background,
                                  const Noise& noise, const ExtraVariance& extra) {
  const V sum2 = set(plan.filter_sum * plan.filter_sum);
  return hn::MulAdd(hn::Mul(sum2, background.level_variance), hn::Add(noise.base, background.extra),
                    extra.of_response);
}

// The filter's response in standard deviations of its noise.
HWY_INLINE V significance_of(const ProfilePlan& plan, V peak, V base, V beyond_pixels) {
  return hn::Mul(peak,
                 rough_inverse_root(hn::MulAdd(base, set(plan.filter_energy), beyond_pixels)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_FILTER_INL_
