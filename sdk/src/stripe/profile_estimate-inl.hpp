// SPDX-License-Identifier: Apache-2.0
// What the filter's answer about its peak tells: position, amplitude, width, and their errors.
// Compiled for every instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_ESTIMATE_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#undef STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#else
#define STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#endif

#include "stripe/profile_filter-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// What a batch's profiles measure.
struct Estimate {
  V position;       // Pixels from the seed.
  V amplitude;      // DN.
  V variance;       // Of the position, pixels^2.
  V per_curvature;  // Of the logarithm of the filter's answer at its peak, pixels^2.
};

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

#endif  // STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
