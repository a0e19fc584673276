// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time. A lane of a vector is a seed: as many profiles are measured at once as a vector has floats.
#include "stripe/profile_kernel.hpp"

#include <algorithm>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/profile_kernel.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<float>;
using V = hn::Vec<Tag>;
using M = hn::Mask<Tag>;

constexpr int kMostLanes = PeakMeasurements::kLanesAtMost;
constexpr int kMostRows = 2 * ProfilePlan::kLargestWindow + 1;
constexpr int kMostMoves = 5;
constexpr int kMostSteps = 2;
constexpr int kMostClippedSteps = 6;
constexpr float kLeastBackgroundPixels = 3.0F;
constexpr float kEnoughOnOneSide = 24.0F;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Tag())); }
HWY_INLINE V set(float value) { return hn::Set(Tag(), value); }
HWY_INLINE V ratio(V a, V b) { return hn::Div(a, b); }

// The pixels around a batch of seeds, transposed: row k, then lane.
struct Window {
  HWY_ALIGN float value[kMostRows * kMostLanes];   // lit - dark; the background is taken off later.
  HWY_ALIGN float seen[kMostRows * kMostLanes];    // 1 where inside the image and not blind.
  HWY_ALIGN float usable[kMostRows * kMostLanes];  // 1 where also not clipped.
  HWY_ALIGN float dark[kMostLanes];                // Mean of the dark image.
  HWY_ALIGN float extra[kMostRows * kMostLanes];   // Variance beyond noise.
  bool is_all_seen = false;                        // `seen` is all ones.
  HWY_ALIGN std::int32_t line[kMostLanes];
  HWY_ALIGN std::int32_t across[kMostLanes];
};

template <typename Pixel>
HWY_INLINE void copy_lane(const Pixel* first, std::ptrdiff_t step, int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) out[k * n] = first[k * step];
}

// Pixels outside of the image repeat the border; `seen` knows them.
template <typename Pixel>
HWY_NOINLINE void copy_lane_at_border(const Pixel* line, std::ptrdiff_t step, int first, int length,
                                      int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) out[k * n] = line[std::clamp(first + k, 0, length - 1) * step];
}

// Neighbouring columns with the same seed are copied four at a time.
constexpr int kGroup = kSeedGroup;

HWY_INLINE bool is_group(const Window& w, int lane, int half, int length) {
  bool same = w.across[lane] >= half && w.across[lane] + half < length;
  for (int i = 1; i < kGroup; ++i) {
    same &= w.across[lane + i] == w.across[lane] && w.line[lane + i] == w.line[lane] + i;
  }
  return same;
}

template <typename Pixel>
HWY_INLINE void copy_group(const Pixel* first, std::ptrdiff_t step, int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) {
    hwy::CopyBytes<kGroup * sizeof(Pixel)>(first + k * step, out + k * n);
  }
}

template <typename Pixel>
HWY_INLINE void copy_window(const Pixel* image, const ProfileImages::Steps& steps, int length,
                            const Window& w, int half, int n, Pixel* out) {
  const int rows = 2 * half + 1;
  for (int lane = 0; lane < n; ++lane) {
    const Pixel* const line = image + w.line[lane] * steps.line;
    const int first = w.across[lane] - half;
    if (steps.line == 1 && lane + kGroup <= n && is_group(w, lane, half, length)) {
      copy_group(line + first * steps.across, steps.across, rows, n, out + lane);
      lane += kGroup - 1;
    } else if (first >= 0 && first + rows <= length) {
      copy_lane(line + first * steps.across, steps.across, rows, n, out + lane);
    } else {
      copy_lane_at_border(line, steps.across, first, length, rows, n, out + lane);
    }
  }
}

template <typename Pixel>
HWY_INLINE V to_float(const Pixel* pixels) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const hn::Rebind<Pixel, Tag> dp;
  return hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(dp, pixels)));
}

template <typename Pixel>
void load_window(const ProfileImages& images, int half, Window& w) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * half + 1;
  HWY_ALIGN Pixel lit[kMostRows * kMostLanes];
  copy_window(static_cast<const Pixel*>(images.lit), images.lit_steps, images.length, w, half, n,
              lit);
  const V full_scale = set(static_cast<float>(images.full_scale_dn));
  for (int k = 0; k < rows; ++k) {
    const V value = to_float(lit + k * n);
    hn::Store(value, d, w.value + k * n);
    hn::Store(hn::IfThenElseZero(hn::Lt(value, full_scale), set(1.0F)), d, w.usable + k * n);
  }
  hn::Store(hn::Zero(d), d, w.dark);
  if (images.dark == nullptr) return;
  HWY_ALIGN Pixel dark[kMostRows * kMostLanes];
  copy_window(static_cast<const Pixel*>(images.dark), images.dark_steps, images.length, w, half, n,
              dark);
  V sum = hn::Zero(d);
  for (int k = 0; k < rows; ++k) {
    const V value = to_float(dark + k * n);
    sum = hn::Add(sum, value);
    hn::Store(hn::Sub(hn::Load(d, w.value + k * n), value), d, w.value + k * n);
  }
  hn::Store(hn::Mul(sum, set(1.0F / static_cast<float>(rows))), d, w.dark);
}

// Fills `seen`, takes it off `usable`, and says whether anything is unseen.
bool mark_unseen(const ProfileImages& images, int half, Window& w) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * half + 1;
  bool is_whole = images.blind == nullptr;
  for (int lane = 0; lane < n; ++lane) {
    is_whole &= w.across[lane] >= half && w.across[lane] + half < images.length;
  }
  if (is_whole && w.is_all_seen) return false;
  for (int k = 0; k < rows; ++k) hn::Store(set(1.0F), d, w.seen + k * n);
  w.is_all_seen = is_whole;
  if (is_whole) return false;
  for (int lane = 0; lane < n; ++lane) {
    for (int k = 0; k < rows; ++k) {
      const int across = w.across[lane] - half + k;
      const bool inside = across >= 0 && across < images.length;
      if (inside &&
          (images.blind == nullptr || images.blind[w.line[lane] * images.blind_steps.line +
                                                   across * images.blind_steps.across] == 0)) {
        continue;
      }
      w.seen[k * n + lane] = 0.0F;
      w.usable[k * n + lane] = 0.0F;
    }
  }
  return true;
}

void load(const ProfileImages& images, int half, Window& w) {
  if (images.is_16_bit) {
    load_window<std::uint16_t>(images, half, w);
  } else {
    load_window<std::uint8_t>(images, half, w);
  }
  if (images.variance != nullptr) {
    copy_window(images.variance, images.variance_steps, images.length, w, half, lanes(), w.extra);
  }
}

// ---- Background.

struct Line {
  V level;           // At the seed.
  V slope;           // Per pixel.
  V level_variance;  // Of `level`, in units of the variance of a pixel.
  V slope_variance;
};

Line fit_background(const ProfilePlan& plan, const Window& w) {
  const Tag d;
  const int n = lanes();
  V count_below = hn::Zero(d);
  V count_above = hn::Zero(d);
  V s1 = hn::Zero(d);
  V s2 = hn::Zero(d);
  V sf = hn::Zero(d);
  V s1f = hn::Zero(d);
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    const int below = (plan.window - q) * n;
    const int above = (plan.window + q) * n;
    const V u0 = hn::Load(d, w.usable + below);
    const V u1 = hn::Load(d, w.usable + above);
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
  const M has_any = hn::Ge(count, least);
  // A few pixels on one side alone tell no slope: the level is their mean.
  const M has_slope = hn::Or(hn::Ge(hn::Min(count_below, count_above), least),
                             hn::Ge(count, set(kEnoughOnOneSide)));
  const V det = hn::IfThenElse(has_slope, hn::NegMulAdd(s1, s1, hn::Mul(count, s2)), set(1.0F));
  const V safe_count = hn::Max(count, set(1.0F));
  const V mean = ratio(sf, safe_count);
  Line line;
  line.level = hn::IfThenElse(has_slope, ratio(hn::NegMulAdd(s1, s1f, hn::Mul(s2, sf)), det), mean);
  line.slope =
      hn::IfThenElseZero(has_slope, ratio(hn::NegMulAdd(s1, sf, hn::Mul(count, s1f)), det));
  line.level_variance = hn::IfThenElse(has_slope, ratio(s2, det), ratio(set(1.0F), safe_count));
  line.slope_variance = hn::IfThenElseZero(has_slope, ratio(count, det));
  // Without background there is no telling what stands out from it: no significance.
  line.level = hn::IfThenElseZero(has_any, line.level);
  line.level_variance = hn::IfThenElse(has_any, line.level_variance, set(1e12F));
  return line;
}

// From here on `value` is without its background; unseen pixels are 0.
void remove_background(const ProfilePlan& plan, const Line& line, bool any_unseen, Window& w) {
  const Tag d;
  const int n = lanes();
  V background = hn::NegMulAdd(set(static_cast<float>(plan.window)), line.slope, line.level);
  for (int k = 0; k <= 2 * plan.window; ++k) {
    V value = hn::Sub(hn::Load(d, w.value + k * n), background);
    if (any_unseen) value = hn::Mul(value, hn::Load(d, w.seen + k * n));
    hn::Store(value, d, w.value + k * n);
    background = hn::Add(background, line.slope);
  }
}

// ---- Matched filter.

struct FilterPeak {
  V at;  // Whole pixels from the seed.
  V before, peak, after;
};

HWY_INLINE V filtered(const ProfilePlan& plan, const Window& w, int at) {
  const Tag d;
  const int n = lanes();
  const float* const centre = w.value + (plan.window + at) * n;
  V even = hn::Mul(set(plan.filter[0]), hn::Load(d, centre));
  V odd = hn::Zero(d);
  for (int i = 1; i <= plan.taps; ++i) {
    const V tap = set(plan.filter[static_cast<std::size_t>(i)]);
    even = hn::MulAdd(tap, hn::Load(d, centre - i * n), even);
    odd = hn::MulAdd(tap, hn::Load(d, centre + i * n), odd);
  }
  return hn::Add(even, odd);
}

FilterPeak find_filter_peak(const ProfilePlan& plan, const Window& w) {
  V before = filtered(plan, w, -plan.reach - 1);
  V here = filtered(plan, w, -plan.reach);
  FilterPeak best{hn::Zero(Tag()), before, set(-1e30F), here};
  for (int at = -plan.reach; at <= plan.reach; ++at) {
    const V after = filtered(plan, w, at + 1);
    const M higher = hn::Gt(here, best.peak);
    best.at = hn::IfThenElse(higher, set(static_cast<float>(at)), best.at);
    best.before = hn::IfThenElse(higher, before, best.before);
    best.after = hn::IfThenElse(higher, after, best.after);
    best.peak = hn::IfThenElse(higher, here, best.peak);
    before = here;
    here = after;
  }
  return best;
}

// What the filter's peak has of the variance that motion and edges leave in `lit - dark`.
struct ExtraVariance {
  V of_pixel;     // The mean over the filter.
  V of_response;  // Of the filter's answer: texture errs alike from pixel to pixel.
};

HWY_NOINLINE ExtraVariance extra_at_peak(const ProfilePlan& plan, const Window& w, V at) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
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

struct Estimate {
  V position;   // Pixels from the seed.
  V amplitude;  // DN.
  V sigma;      // Pixels.
};

// Everything about the noise of a batch that does not change along its profiles.
struct Noise {
  V base;     // Variance of a pixel of the background.
  V per_dn;   // Its growth with the signal,
  V speckle;  // and with the square of the signal.
};

Noise noise_of(const ProfilePlan& plan, const ProfileImages& images, const Line& background,
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

HWY_INLINE V width_at(const ProfilePlan& plan, V across) {
  const V width = hn::MulAdd(set(plan.width_slope), across, set(plan.width));
  return hn::Min(hn::Max(width, set(plan.smallest_width)), set(plan.largest_width));
}

// Gauss-3 on the filtered profile: exact for a Gaussian, because Gaussian * Gaussian is Gaussian.
struct LogParabola {
  V offset;
  V curvature;  // 1 / sigma^2 of the filtered profile.
};

HWY_INLINE LogParabola log_parabola(const FilterPeak& f) {
  const Tag d;
  const V tiny = hn::Mul(hn::Max(f.peak, set(1e-3F)), set(1e-3F));
  const V peak = hn::Max(f.peak, set(1e-3F));
  const V a = hn::Log(d, hn::Min(ratio(hn::Max(f.before, tiny), peak), set(1.0F)));
  const V c = hn::Log(d, hn::Min(ratio(hn::Max(f.after, tiny), peak), set(1.0F)));
  const V curvature = hn::Max(hn::Neg(hn::Add(a, c)), set(1e-4F));
  const V offset = ratio(hn::Sub(c, a), hn::Add(curvature, curvature));
  return {hn::Min(hn::Max(offset, set(-0.5F)), set(0.5F)), curvature};
}

// The error of matched filter and log-parabola: that of the zero crossing of its derivative, in
// white noise (2 sigma / sqrt(pi)), noise that grows with the signal (0.614 sigma) and with its
// square (speckle), and of the slope of the background.
HWY_INLINE V filter_sigma(const Noise& noise, const Line& background, V width, V amplitude) {
  const V a = hn::Max(amplitude, set(1e-3F));
  const V inverse = ratio(set(1.0F), a);
  const V white = hn::Mul(hn::Mul(set(1.12838F), width), noise.base);
  const V shot = hn::Mul(hn::Mul(set(0.6142F), width), hn::Mul(noise.per_dn, a));
  const V speckle = hn::Mul(hn::Mul(set(0.3989F), width), hn::Mul(noise.speckle, hn::Mul(a, a)));
  const V w2 = hn::Mul(width, width);
  const V slope =
      hn::Mul(hn::Mul(set(8.0F), hn::Mul(w2, w2)), hn::Mul(background.slope_variance, noise.base));
  // Narrow stripes are sampled too coarsely for the integrals above: 7 % at a sigma of 0.7 pixels.
  const V coarse = hn::Mul(set(-1.0F / 0.12F), hn::Sub(hn::Max(width, set(0.5F)), set(0.757F)));
  const V factor = hn::MulAdd(set(0.14F), hn::Exp(Tag(), coarse), set(1.0F));
  const V sum = hn::Add(hn::MulAdd(white, factor, shot), hn::Add(speckle, slope));
  return hn::Mul(hn::Sqrt(sum), inverse);
}

// ---- Gauss-Newton.

// The box-integrated Gaussian and its derivative, as a Gaussian of the effective width with its
// fourth cumulant: kappa_4 = -1/120 of the pixel's box (Edgeworth's series; the next term is below
// 2e-4 at a width of half a pixel).
struct Shape {
  V inverse_width;
  V cumulant;  // kappa_4 / (24 sigma^4).

  explicit HWY_INLINE Shape(V width) {
    inverse_width = ratio(set(1.0F), width);
    const V i2 = hn::Mul(inverse_width, inverse_width);
    cumulant = hn::Mul(set(-1.0F / 2880.0F), hn::Mul(i2, i2));
  }

  // g: exp(-t^2 / 2).
  HWY_INLINE V value(V g, V t2) const {
    const V he4 = hn::MulAdd(t2, hn::Sub(t2, set(6.0F)), set(3.0F));
    return hn::MulAdd(hn::Mul(cumulant, he4), g, g);
  }
  HWY_INLINE V derivative(V g, V t, V t2) const {
    const V he5 = hn::MulAdd(t2, hn::Sub(t2, set(10.0F)), set(15.0F));
    return hn::Mul(hn::Mul(g, hn::Mul(t, inverse_width)), hn::MulAdd(cumulant, he5, set(1.0F)));
  }
};

// Normal equations of value = b + s k + a G + p G', G' the derivative for the position: p is a
// times the step to take.
struct Normal {
  V n11, n1k, nkk, n1g, nkg, ngg, n1p, nkp, ngp, npp;
  V r1, rk, rg, rp;

  explicit HWY_INLINE Normal(V zero)
      : n11(zero),
        n1k(zero),
        nkk(zero),
        n1g(zero),
        nkg(zero),
        ngg(zero),
        n1p(zero),
        nkp(zero),
        ngp(zero),
        npp(zero),
        r1(zero),
        rk(zero),
        rg(zero),
        rp(zero) {}

  HWY_INLINE void add_background(V w, V k, V f) {
    const V wk = hn::Mul(w, k);
    n11 = hn::Add(n11, w);
    n1k = hn::Add(n1k, wk);
    nkk = hn::MulAdd(wk, k, nkk);
    r1 = hn::MulAdd(w, f, r1);
    rk = hn::MulAdd(wk, f, rk);
  }

  HWY_INLINE void add_stripe(V w, V k, V f, V g, V p) {
    const V wg = hn::Mul(w, g);
    const V wp = hn::Mul(w, p);
    n1g = hn::Add(n1g, wg);
    nkg = hn::MulAdd(wg, k, nkg);
    ngg = hn::MulAdd(wg, g, ngg);
    rg = hn::MulAdd(wg, f, rg);
    n1p = hn::Add(n1p, wp);
    nkp = hn::MulAdd(wp, k, nkp);
    ngp = hn::MulAdd(wp, g, ngp);
    npp = hn::MulAdd(wp, p, npp);
    rp = hn::MulAdd(wp, f, rp);
  }

  struct Solution {
    V amplitude;
    V step_times_amplitude;
    V step_variance;  // Of the latter.
  };

  // Eliminates background, slope and amplitude: the last pivot is the information on the position.
  HWY_INLINE Solution solve() const {
    const V one = set(1.0F);
    const V tiny = set(1e-20F);
    const V i1 = ratio(one, hn::Max(n11, tiny));
    const V lk = hn::Mul(n1k, i1);
    const V lg = hn::Mul(n1g, i1);
    const V lp = hn::Mul(n1p, i1);
    const V dk = hn::Max(hn::NegMulAdd(lk, n1k, nkk), tiny);
    const V kg = hn::NegMulAdd(lk, n1g, nkg);
    const V kp = hn::NegMulAdd(lk, n1p, nkp);
    const V sk = hn::NegMulAdd(lk, r1, rk);
    const V ik = ratio(one, dk);
    const V mg = hn::Mul(kg, ik);
    const V mp = hn::Mul(kp, ik);
    const V dg = hn::Max(hn::NegMulAdd(mg, kg, hn::NegMulAdd(lg, n1g, ngg)), tiny);
    const V gp = hn::NegMulAdd(mg, kp, hn::NegMulAdd(lg, n1p, ngp));
    const V sg = hn::NegMulAdd(mg, sk, hn::NegMulAdd(lg, r1, rg));
    const V ig = ratio(one, dg);
    const V np = hn::Mul(gp, ig);
    const V dp =
        hn::Max(hn::NegMulAdd(np, gp, hn::NegMulAdd(mp, kp, hn::NegMulAdd(lp, n1p, npp))), tiny);
    const V sp = hn::NegMulAdd(np, sg, hn::NegMulAdd(mp, sk, hn::NegMulAdd(lp, r1, rp)));
    const V variance = ratio(one, dp);
    const V p = hn::Mul(sp, variance);
    return {hn::NegMulAdd(np, p, hn::Mul(sg, ig)), p, variance};
  }
};

// One row of the core. `g` is exp(-t^2 / 2) there.
struct CoreRow {
  const ProfilePlan& plan;
  const Window& w;
  const Noise& noise;
  const Shape& shape;
  V position;
  V amplitude;
  V ceiling;  // Pixels that should be above it are left out.
  bool has_extra;

  HWY_INLINE void add(int k, V g, Normal& normal) const {
    const Tag d;
    const int at = (plan.window + k) * lanes();
    const V kv = set(static_cast<float>(k));
    const V t = hn::Mul(hn::Sub(kv, position), shape.inverse_width);
    const V t2 = hn::Mul(t, t);
    const V value = shape.value(g, t2);
    const V signal = hn::Max(hn::Mul(amplitude, value), hn::Zero(d));
    V variance = hn::MulAdd(signal, hn::MulAdd(noise.speckle, signal, noise.per_dn), noise.base);
    if (has_extra) variance = hn::Add(variance, hn::Load(d, w.extra + at));
    const V weight =
        ratio(hn::IfThenElseZero(hn::Le(signal, ceiling), hn::Load(d, w.usable + at)), variance);
    const V f = hn::Load(d, w.value + at);
    normal.add_background(weight, kv, f);
    normal.add_stripe(weight, kv, f, value, shape.derivative(g, t, t2));
  }
};

void add_ring(const ProfilePlan& plan, const Window& w, const CoreRow& row, Normal& normal) {
  const Tag d;
  const int n = lanes();
  const V weight = ratio(set(1.0F), row.noise.base);
  for (int q = plan.core + 1; q <= plan.window; ++q) {
    for (const int k : {-q, q}) {
      const int at = (plan.window + k) * n;
      V wk = weight;
      if (row.has_extra) {
        wk = ratio(set(1.0F), hn::Add(row.noise.base, hn::Load(d, w.extra + at)));
      }
      normal.add_background(hn::Mul(wk, hn::Load(d, w.usable + at)), set(static_cast<float>(k)),
                            hn::Load(d, w.value + at));
    }
  }
}

// exp(-(k - x)^2 / 2 sigma^2) for successive k by two multiplications each.
void add_core(const CoreRow& row, Normal& normal) {
  const Tag d;
  const V i2 = hn::Mul(row.shape.inverse_width, row.shape.inverse_width);
  const V half = hn::Mul(set(-0.5F), i2);
  const V x = row.position;
  const V ratio_of_ratios = hn::Exp(d, hn::Neg(i2));
  const V g0 = hn::Exp(d, hn::Mul(half, hn::Mul(x, x)));
  row.add(0, g0, normal);
  V up = hn::Exp(d, hn::Mul(half, hn::Sub(set(1.0F), hn::Add(x, x))));
  V down = hn::Exp(d, hn::Mul(half, hn::Add(set(1.0F), hn::Add(x, x))));
  V g_up = g0;
  V g_down = g0;
  for (int k = 1; k <= row.plan.core; ++k) {
    g_up = hn::Mul(g_up, up);
    g_down = hn::Mul(g_down, down);
    up = hn::Mul(up, ratio_of_ratios);
    down = hn::Mul(down, ratio_of_ratios);
    row.add(k, g_up, normal);
    row.add(-k, g_down, normal);
  }
}

// Where some pixels of a profile are clipped, those that should be within a sigma of full scale
// are left out whether they are clipped or not: noise would choose among them, with a bias.
V ceiling_of(const ProfileImages& images, const Line& background, const Noise& noise,
             const Window& w) {
  const V offset = hn::Add(background.level, hn::Load(Tag(), w.dark));
  const V room = hn::Sub(set(static_cast<float>(images.full_scale_dn)), offset);
  const V variance = hn::MulAdd(room, hn::MulAdd(noise.speckle, room, noise.per_dn), noise.base);
  return hn::NegMulAdd(set(1.0F), hn::Sqrt(hn::Max(variance, noise.base)), room);
}

Estimate refine(const ProfilePlan& plan, const Window& w, const Noise& noise, V width,
                bool has_extra, V clipped, V ceiling, Estimate e) {
  const Tag d;
  const Estimate start = e;
  const bool any_clipped = !hn::AllTrue(d, hn::Eq(clipped, hn::Zero(d)));
  const Shape shape(width);
  const V longest = hn::Mul(set(0.75F), width);
  const V settled = hn::Mul(set(any_clipped ? 0.01F : 0.1F), width);
  const int least_steps = any_clipped ? 3 : 1;
  const int most_steps = any_clipped ? kMostClippedSteps : kMostSteps;
  V limit = set(1e30F);
  for (int step = 1; step <= most_steps; ++step) {
    const CoreRow row{plan, w, noise, shape, e.position, e.amplitude, limit, has_extra};
    Normal normal(hn::Zero(d));
    add_ring(plan, w, row, normal);
    add_core(row, normal);
    const auto solution = normal.solve();
    // Dividing by the new amplitude, not the old one, is right however far off the old one was.
    const V amplitude = hn::Max(solution.amplitude, set(1e-3F));
    const V wanted = ratio(solution.step_times_amplitude, amplitude);
    const V taken = hn::Min(hn::Max(wanted, hn::Neg(longest)), longest);
    e.position = hn::Add(e.position, taken);
    e.amplitude = amplitude;
    e.sigma = ratio(hn::Sqrt(solution.step_variance), amplitude);
    const V small = any_clipped ? settled : hn::Max(settled, e.sigma);
    if (step >= least_steps && hn::AllTrue(d, hn::Le(hn::Abs(wanted), small))) break;
    limit = hn::IfThenElse(hn::Gt(clipped, hn::Zero(d)), ceiling, limit);
  }
  // Noise can lead a weak fit astray; the filter's peak stands then.
  const V allowed = hn::MulAdd(set(0.5F), clipped, hn::Mul(set(1.2F), width));
  const M is_astray = hn::Gt(hn::Abs(hn::Sub(e.position, start.position)), allowed);
  e.position = hn::IfThenElse(is_astray, start.position, e.position);
  e.amplitude = hn::IfThenElse(is_astray, start.amplitude, e.amplitude);
  e.sigma = hn::IfThenElse(is_astray, start.sigma, e.sigma);
  return e;
}

// ---- One batch.

HWY_INLINE V count_in_core(const ProfilePlan& plan, const float* flags) {
  const Tag d;
  const int n = lanes();
  V sum = hn::Zero(d);
  for (int k = plan.window - plan.core; k <= plan.window + plan.core; ++k) {
    sum = hn::Add(sum, hn::Load(d, flags + k * n));
  }
  return sum;
}

// Loads the window around the seeds, moving those whose filter peak lies too far off.
struct Located {
  Line background;
  FilterPeak peak;
};

Located locate(const ProfileImages& images, const ProfilePlan& plan, Window& w) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  for (int move = 0;; ++move) {
    load(images, plan.window, w);
    const bool any_unseen = mark_unseen(images, plan.window, w);
    Located located;
    located.background = fit_background(plan, w);
    remove_background(plan, located.background, any_unseen, w);
    located.peak = find_filter_peak(plan, w);
    const V stray = set(static_cast<float>(plan.stray));
    if (move == kMostMoves || hn::AllTrue(d, hn::Le(hn::Abs(located.peak.at), stray))) {
      return located;
    }
    // Only those that have to move, so that a profile's answer does not depend on its neighbours.
    const V move_by = hn::IfThenElseZero(hn::Gt(hn::Abs(located.peak.at), stray), located.peak.at);
    const auto moved = hn::Add(hn::Load(di, w.across), hn::ConvertTo(di, move_by));
    const auto last = hn::Set(di, images.length - 1);
    hn::Store(hn::Min(hn::Max(moved, hn::Zero(di)), last), di, w.across);
  }
}

void store(const ProfilePlan& plan, const Window& w, const Located& located, const Estimate& e,
           const Noise& noise, const ExtraVariance& extra, V expected_width, V clipped, int first,
           const PeakMeasurements& out) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const auto whole = hn::ConvertTo(di, located.peak.at);
  hn::StoreU(hn::Add(hn::Load(di, w.across), whole), di, out.across + first);
  hn::StoreU(hn::Sub(e.position, located.peak.at), d, out.offset + first);
  hn::StoreU(e.amplitude, d, out.amplitude + first);
  hn::StoreU(clipped, d, out.clipped + first);
  const M is_clipped = hn::Gt(clipped, hn::Zero(d));
  const V locking =
      hn::IfThenElse(is_clipped, set(plan.clipped_locking_variance), set(plan.locking_variance));
  hn::StoreU(hn::Sqrt(hn::MulAdd(e.sigma, e.sigma, locking)), d, out.sigma + first);

  // Without the noise that the filter's own response has, so that weak profiles are not too wide.
  const V f0 = located.peak.peak;
  const V own = hn::Mul(noise.base, set(plan.filter_energy));
  const V shared = hn::Mul(noise.base, set(plan.filter_covariance));
  const V sides = hn::Sub(hn::Mul(located.peak.before, located.peak.after), shared);
  const V centre = hn::Max(hn::Sub(hn::Mul(f0, f0), own), set(1e-6F));
  const V curvature = hn::Neg(hn::Log(d, hn::Max(ratio(sides, centre), set(1e-6F))));
  const V total = ratio(set(1.0F), hn::Max(curvature, set(1e-4F)));
  const V filter2 = set(plan.filter_sigma * plan.filter_sigma);
  const V width = hn::Sqrt(hn::Max(hn::Sub(total, filter2), set(0.04F)));
  hn::StoreU(hn::IfThenElse(is_clipped, expected_width, width), d, out.width + first);

  const V sum2 = set(plan.filter_sum * plan.filter_sum);
  const V response = hn::MulAdd(
      noise.base, hn::MulAdd(sum2, located.background.level_variance, set(plan.filter_energy)),
      extra.of_response);
  hn::StoreU(ratio(f0, hn::Sqrt(response)), d, out.significance + first);

  const V peak_variance =
      hn::MulAdd(e.amplitude, hn::MulAdd(noise.speckle, e.amplitude, noise.per_dn),
                 hn::Add(noise.base, extra.of_pixel));
  hn::StoreU(ratio(e.amplitude, hn::Sqrt(peak_variance)), d, out.snr + first);
}

void measure_batch(const ProfileImages& images, const ProfilePlan& plan, Window& w, int first,
                   const PeakMeasurements& out) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  const Located located = locate(images, plan, w);
  const Noise noise = noise_of(plan, images, located.background, w);
  const LogParabola parabola = log_parabola(located.peak);

  const V across =
      hn::ConvertTo(d, hn::Add(hn::Load(di, w.across), hn::ConvertTo(di, located.peak.at)));
  const V width = width_at(plan, across);
  // The filter's peak value for a stripe of this width is A w f sqrt(2 pi / (w^2 + f^2)).
  const V total = hn::MulAdd(width, width, set(plan.filter_sigma * plan.filter_sigma));
  const V gain = ratio(hn::Mul(width, set(plan.filter_sigma * 2.5066283F)), hn::Sqrt(total));
  const V lift =
      hn::Exp(d, hn::Mul(set(0.5F), ratio(hn::Mul(parabola.offset, parabola.offset), total)));
  Estimate e;
  e.position = hn::Add(located.peak.at, parabola.offset);
  e.amplitude = ratio(hn::Mul(located.peak.peak, lift), gain);
  ExtraVariance extra{hn::Zero(d), hn::Zero(d)};
  if (images.variance != nullptr) extra = extra_at_peak(plan, w, located.peak.at);
  const Noise with_extra{hn::Add(noise.base, extra.of_pixel), noise.per_dn, noise.speckle};
  e.sigma = filter_sigma(with_extra, located.background, width, e.amplitude);
  const V clipped = hn::Sub(count_in_core(plan, w.seen), count_in_core(plan, w.usable));
  if (plan.refine) {
    e = refine(plan, w, noise, width, images.variance != nullptr, clipped,
               ceiling_of(images, located.background, noise, w), e);
  }
  store(plan, w, located, e, noise, extra, width, clipped, first, out);
}

void measure(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds, int count,
             const PeakMeasurements& out) {
  const int n = lanes();
  Window w;
  for (int first = 0; first < count; first += n) {
    for (int lane = 0; lane < n; ++lane) {
      const PeakSeed& seed = seeds[std::min(first + lane, count - 1)];
      w.line[lane] = seed.line;
      w.across[lane] = seed.across;
    }
    measure_batch(images, plan, w, first, out);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(measure);

void measure_profiles(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds,
                      int count, const PeakMeasurements& out) {
  HWY_DYNAMIC_DISPATCH(measure)(images, plan, seeds, count, out);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
