// SPDX-License-Identifier: Apache-2.0
// The local background of a batch of profiles and the noise of their pixels. Compiled for every
// instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_BACKGROUND_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_BACKGROUND_INL_
#undef STRIPER_STRIPE_PROFILE_BACKGROUND_INL_
#else
#define STRIPER_STRIPE_PROFILE_BACKGROUND_INL_
#endif

#include <cstddef>

#include "stripe/profile/profile_window-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr float kLeastBackgroundPixels = 3.0F;
constexpr float kEnoughOnOneSide = 24.0F;

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

// Pixels of a batch of which nothing is missing.
template <typename Pixel, bool kHasDark>
struct PlainReader {
  Rows<Pixel> lit, dark;
  V dark_sum;

  // k from the window's first row.
  HWY_INLINE V row(int k) {
    const V value = lit.at(k);
    if constexpr (!kHasDark) return value;
    const V taken_off = dark.at(k);
    dark_sum = hn::Add(dark_sum, taken_off);
    return hn::Sub(value, taken_off);
  }
};

// Reads the window of a batch of which nothing is missing; its background stays on.
template <typename Pixel, bool kHasDark>
void read_plain(const ProfilePlan& plan, const BatchPixels& pixels, Window& w, Background& b) {
  const Tag d;
  const int n = lanes();
  const V zero = hn::Zero(d);
  PlainReader<Pixel, kHasDark> reader{pixels.rows_of<Pixel>(pixels.group.lit),
                                      pixels.rows_of<Pixel>(pixels.group.dark), zero};
  V sum = zero;
  V sum_k = zero;
  V k = set(static_cast<float>(plan.core));
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    const V below = reader.row(plan.window - q);
    const V above = reader.row(plan.window + q);
    hn::Store(below, d, w.value + (plan.window - q) * n);
    hn::Store(above, d, w.value + (plan.window + q) * n);
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
  for (int row = plan.window - plan.core; row <= plan.window + plan.core; ++row) {
    hn::Store(reader.row(row), d, w.value + row * n);
  }
  w.is_plain = true;
  hn::Store(hn::Mul(reader.dark_sum, set(plan.per_rows)), d, w.dark);
}

template <typename Pixel>
HWY_INLINE bool is_any_clipped(const BatchPixels& pixels, int full_scale_dn) {
  const hn::Rebind<Pixel, Tag> d;
  const auto highest = hn::LoadU(d, pixels.rows_of<Pixel>(pixels.group.highest).first);
  const auto clipped = hn::Set(d, static_cast<Pixel>(full_scale_dn));
  return !hn::AllFalse(d, hn::Eq(hn::Max(highest, clipped), highest));
}

template <typename Pixel>
bool read_if_plain(const ProfileImages& images, const ProfilePlan& plan, const BatchPixels& pixels,
                   Window& w, Background& b) {
  if (is_any_clipped<Pixel>(pixels, images.full_scale_dn)) return false;
  if (images.dark == nullptr) {
    read_plain<Pixel, false>(plan, pixels, w, b);
  } else {
    read_plain<Pixel, true>(plan, pixels, w, b);
  }
  return true;
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

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_BACKGROUND_INL_
