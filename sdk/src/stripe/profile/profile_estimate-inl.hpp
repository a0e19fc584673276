// SPDX-License-Identifier: Apache-2.0
// What the filter's answer about its peak tells: position, amplitude, width, and their errors.
// Compiled for every instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_ESTIMATE_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#undef STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#else
#define STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
#endif

#include "stripe/profile/lane_group-inl.hpp"
#include "stripe/profile/profile_filter-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// A `T` is a vector, or those of a group of batches.

// What profiles measure.
template <typename T>
struct Estimate {
  T position;       // Pixels from the seed.
  T amplitude;      // DN.
  T variance;       // Of the position, pixels^2.
  T per_curvature;  // Of the logarithm of the filter's answer at its peak, pixels^2.
};

HWY_INLINE V width_at(const ProfilePlan& plan, V across) {
  const V width = hn::MulAdd(set(plan.width_slope), across, set(plan.width));
  return hn::Min(hn::Max(width, set(plan.smallest_width)), set(plan.largest_width));
}

// -ln(b / a) for s = (a - b) / (a + b), 0 <= s <= 1: 2 artanh(s), exact to 1e-6 of itself as far as
// b / a = 0.3, where the filter of a stripe does not get.
template <typename T>
HWY_INLINE T fall(const T& s) {
  const T z = mul(s, s);
  T sum = mul_add(z, set(0.44359741F), set(0.21910426F));
  sum = mul_add(z, sum, set(0.40758425F));
  sum = mul_add(z, sum, set(0.66637434F));
  return mul(s, mul_add(z, sum, set(2.0000018F)));
}

template <typename T>
struct LogPeak {
  T offset;         // Of the peak from the filter's peak pixel.
  T per_curvature;  // Pixels^2.
};

// Gauss-3 on the filtered profile, exact for a Gaussian, because Gaussian * Gaussian is Gaussian.
template <typename T>
HWY_INLINE LogPeak<T> log_parabola(const ProfilePlan& plan, const FilterPeak<T>& f) {
  const T peak = max(f.peak, set(1e-3F));
  const T before = min(max(f.before, set(0.0F)), peak);
  const T after = min(max(f.after, set(0.0F)), peak);
  const T sum_before = add(peak, before);
  const T sum_after = add(peak, after);
  // A factor that both falls have in common is not in their ratio.
  const T per_sums = rough_inverse(mul(sum_before, sum_after));
  const T fall_before = fall(mul(mul(sub(peak, before), sum_after), per_sums));
  const T fall_after = fall(mul(mul(sub(peak, after), sum_before), per_sums));
  const T per_curvature = inverse(max(add(fall_before, fall_after), set(1e-4F)));
  const V half = set(0.5F);
  T offset = mul(mul(half, sub(fall_before, fall_after)), per_curvature);
  offset = min(max(offset, hn::Neg(half)), half);
  if (plan.has_filter_locking) {
    const T square = mul(offset, offset);
    const T shape = mul_add(set(plan.filter_locking[1]), square, set(plan.filter_locking[0]));
    const T inside = neg_mul_add(set(4.0F), square, set(1.0F));
    offset = neg_mul_add(mul(offset, inside), shape, offset);
  }
  return {offset, per_curvature};
}

// What follows from a stripe's expected width.
template <typename T>
struct Expected {
  T width, width2, per_width2;
  T per_total;  // 1 / (width^2 + filter_sigma^2)
  T per_gain;   // Amplitude over the filter's answer, A w f sqrt(2 pi / (w^2 + f^2)).

  HWY_INLINE Expected(const ProfilePlan& plan, const T& w) : width(w), width2(mul(w, w)) {
    const T total = add(width2, set(plan.filter_sigma * plan.filter_sigma));
    const T per_roots = rough_inverse_root(mul(total, width2));
    const T per_both = mul(per_roots, per_roots);
    per_width2 = mul(total, per_both);
    per_total = mul(width2, per_both);
    per_gain = mul(mul(total, per_roots), set(plan.per_filter_root));
  }
};

// The error of matched filter and log-parabola: that of the zero crossing of its derivative, in
// white noise, noise that grows with the signal and with its square (speckle), and of the slope of
// the background. `base` is the variance of a pixel of the background.
template <typename T>
HWY_INLINE T filter_variance(const ProfilePlan& plan, const T& base, const T& slope_variance,
                             const Expected<T>& expected, const T& amplitude) {
  const T a = max(amplitude, set(1e-3F));
  const V shot = set(plan.filter_shot * plan.variance_per_dn);
  const V speckle = set(plan.filter_speckle * plan.speckle2);
  const T of_signal = mul(a, mul_add(speckle, a, shot));
  const T of_slope = mul(mul(set(plan.filter_slope), mul(expected.width2, expected.width2)),
                         mul(slope_variance, base));
  const T of_pixels = mul_add(set(plan.filter_white), base, of_signal);
  return mul(mul_add(expected.width, of_pixels, of_slope), rough_inverse(mul(a, a)));
}

// All but the variance, from the filter's peak alone, for a stripe of the expected width.
template <typename T>
HWY_INLINE Estimate<T> estimate_from_filter(const ProfilePlan& plan, const FilterPeak<T>& peak,
                                            const Expected<T>& expected) {
  const LogPeak<T> top = log_parabola(plan, peak);
  // exp(x / 2), x below 0.3, to 2e-5.
  const T x = mul(mul(top.offset, top.offset), expected.per_total);
  T lift = mul_add(x, set(1.0F / 48.0F), set(1.0F / 8.0F));
  for (const float coefficient : {0.5F, 1.0F}) lift = mul_add(x, lift, set(coefficient));
  Estimate<T> e;
  e.position = add(peak.at, top.offset);
  e.amplitude = mul(mul(peak.peak, lift), expected.per_gain);
  e.per_curvature = top.per_curvature;
  return e;
}

// The variance of a position given its own profile. Noise that sharpens the peak of the likelihood
// makes its place less uncertain, noise that blunts it more: one over the observed information, not
// over the expected one (Efron & Hinkley 1978). The filter's answer R is the likelihood's root, so
// that its peak's curvature is the information's, beside 1 / (w^2 + f^2). To the next order in one
// over the peak's signal-to-noise ratio rho, that of position over sigma is 1 + 2 / rho^2, and 2 /
// rho^2 is variance / w^2.
template <typename T>
HWY_INLINE T observed_variance(const Estimate<T>& e, const Expected<T>& expected) {
  const T bluntness = mul(e.per_curvature, expected.per_total);
  const T believed = min(max(bluntness, set(0.5F)), set(2.0F));
  const T variance = mul(e.variance, believed);
  return mul_add(mul(variance, variance), expected.per_width2, variance);
}

// The stripe's width from the curvature of the filter's peak, without the noise that the filter's
// own response has, so that weak profiles are not too wide.
template <typename T>
HWY_INLINE T width_from_filter(const ProfilePlan& plan, const FilterPeak<T>& f, const T& base) {
  const T own = mul(base, set(plan.filter_energy));
  const T shared = mul(base, set(plan.filter_covariance));
  const T centre = max(sub(mul(f.peak, f.peak), own), set(1e-6F));
  const T beside = max(sub(mul(f.before, f.after), shared), set(0.0F));
  // 1 / (2 artanh(s)), s = less / more, by its series.
  const T less = max(sub(centre, beside), mul(set(1e-4F), centre));
  const T more = add(centre, beside);
  const T per_both = rough_inverse(mul(less, more));
  const T s = mul(mul(less, less), per_both);
  const T z = mul(s, s);
  T series = mul_add(z, set(-0.0151F), set(-22.0F / 945.0F));
  series = mul_add(z, series, set(-2.0F / 45.0F));
  series = mul_add(z, series, set(-1.0F / 6.0F));
  series = mul_add(z, series, set(0.5F));
  const T total = mul(series, mul(mul(more, more), per_both));
  const T excess = sub(total, set(plan.filter_sigma * plan.filter_sigma));
  return rough_root(max(excess, set(0.04F)));
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
template <typename T>
HWY_INLINE T significance_of(const ProfilePlan& plan, const T& peak, const T& base,
                             const T& beyond_pixels) {
  return mul(peak, rough_inverse_root(mul_add(base, set(plan.filter_energy), beyond_pixels)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_ESTIMATE_INL_
