// SPDX-License-Identifier: Apache-2.0
// Gauss-Newton on position, amplitude and background of a batch of profiles, each pixel weighted
// with its variance. Compiled for every instruction set: see hwy/foreach_target.h for the unusual
// include guard.
#if defined(STRIPER_STRIPE_GAUSS_NEWTON_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_GAUSS_NEWTON_INL_
#undef STRIPER_STRIPE_GAUSS_NEWTON_INL_
#else
#define STRIPER_STRIPE_GAUSS_NEWTON_INL_
#endif

#include <hwy/contrib/math/math-inl.h>

#include "stripe/profile/profile_estimate-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostSteps = 2;
constexpr int kMostClippedSteps = 6;

// The box-integrated Gaussian and its derivative, as a Gaussian of the effective width with its
// fourth cumulant: kappa_4 = -1/120 of the pixel's box (Edgeworth's series; the next term is below
// 2e-4 at a width of half a pixel).
struct Shape {
  V inverse_width;
  V cumulant;  // kappa_4 / (24 sigma^4).

  explicit HWY_INLINE Shape(V width) {
    inverse_width = inverse(width);
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

// Sums of values with the model's derivatives: the right side of normal equations.
struct RightSide {
  V one, k, g, p;

  explicit HWY_INLINE RightSide(V zero) : one(zero), k(zero), g(zero), p(zero) {}
};

// Normal equations of value = b + s k + a G + p G', G' the derivative for the position: p is a
// times the step to take.
struct Normal {
  V n11, n1k, nkk, n1g, nkg, ngg, n1p, nkp, ngp, npp;
  RightSide values;

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
        values(zero) {}

  HWY_INLINE void add_background(V w, V k, V f) {
    const V wk = hn::Mul(w, k);
    n11 = hn::Add(n11, w);
    n1k = hn::Add(n1k, wk);
    nkk = hn::MulAdd(wk, k, nkk);
    values.one = hn::MulAdd(w, f, values.one);
    values.k = hn::MulAdd(wk, f, values.k);
  }

  HWY_INLINE void add_stripe(V w, V k, V f, V g, V p) {
    const V wg = hn::Mul(w, g);
    const V wp = hn::Mul(w, p);
    n1g = hn::Add(n1g, wg);
    nkg = hn::MulAdd(wg, k, nkg);
    ngg = hn::MulAdd(wg, g, ngg);
    values.g = hn::MulAdd(wg, f, values.g);
    n1p = hn::Add(n1p, wp);
    nkp = hn::MulAdd(wp, k, nkp);
    ngp = hn::MulAdd(wp, g, ngp);
    npp = hn::MulAdd(wp, p, npp);
    values.p = hn::MulAdd(wp, f, values.p);
  }

  struct Solution {
    V amplitude;
    V step_times_amplitude;
    V step_variance;  // Of the latter.
  };

  // Eliminates background, slope and amplitude: the last pivot is the information on the position.
  HWY_INLINE Solution solve(const RightSide& r) const {
    const V tiny = set(1e-20F);
    const V i1 = inverse(hn::Max(n11, tiny));
    const V lk = hn::Mul(n1k, i1);
    const V lg = hn::Mul(n1g, i1);
    const V lp = hn::Mul(n1p, i1);
    const V dk = hn::Max(hn::NegMulAdd(lk, n1k, nkk), tiny);
    const V kg = hn::NegMulAdd(lk, n1g, nkg);
    const V kp = hn::NegMulAdd(lk, n1p, nkp);
    const V sk = hn::NegMulAdd(lk, r.one, r.k);
    const V ik = inverse(dk);
    const V mg = hn::Mul(kg, ik);
    const V mp = hn::Mul(kp, ik);
    const V dg = hn::Max(hn::NegMulAdd(mg, kg, hn::NegMulAdd(lg, n1g, ngg)), tiny);
    const V gp = hn::NegMulAdd(mg, kp, hn::NegMulAdd(lg, n1p, ngp));
    const V sg = hn::NegMulAdd(mg, sk, hn::NegMulAdd(lg, r.one, r.g));
    const V ig = inverse(dg);
    const V np = hn::Mul(gp, ig);
    const V dp =
        hn::Max(hn::NegMulAdd(np, gp, hn::NegMulAdd(mp, kp, hn::NegMulAdd(lp, n1p, npp))), tiny);
    const V sp = hn::NegMulAdd(np, sg, hn::NegMulAdd(mp, sk, hn::NegMulAdd(lp, r.one, r.p)));
    const V variance = inverse(dp);
    const V p = hn::Mul(sp, variance);
    return {hn::NegMulAdd(np, p, hn::Mul(sg, ig)), p, variance};
  }
};

// The ends of a run of clipped pixels are known to a pixel: its middle, to half the root of twice a
// twelfth. A step of reflectance moves an end. Of 15 000 runs of stripes in 150 random rooms 91 %
// were within one sigma of both together, 98.3 % within two.
constexpr float kRunVariance_px2 = 1.0F / 24.0F;
constexpr float kRunVariance_widths2 = 0.09F;

// Of full scale, what a fit of a clipped stripe says at most. (A stripe twenty times as high is not
// looked for.) Where its flanks fit nothing it would be anything, and the position sure.
constexpr float kMostOverexposed = 64.0F;

// How far a stripe's width is off the expected one, in parts of it: of 17 000 returns of random
// rooms four in five were within a tenth. A profile of which the image's border or a mask cuts
// something moves with it.
constexpr float kWidthError = 0.08F;

// Of a peak, the pixels that tell nothing of its height.
struct MissingPixels {
  V clipped;       // How many of its core are.
  M is_run;        // Those are one run with what is clipped beside the core:
  V run_middle;    // where the stripe is, pixels from the seed,
  V run_variance;  // and how well that tells.
  M is_cut;        // Some are outside of the image or masked.
};

// What is known of a batch of profiles before the fit.
struct Profiles {
  const ProfilePlan& plan;
  const Window& w;
  const Background& background;
  const Noise& noise;
  const ExtraVariance& extra;
  const Expected<V>& expected;
  MissingPixels missing;
  V ceiling;  // Where some are: those that should be above it are left out from the second step on.
};

// What one step needs. `kPlain`: the batch's window is plain.
template <bool kPlain>
struct Step {
  const Profiles& profiles;
  const Shape& shape;
  V position;
  V amplitude;
  V ceiling;  // Pixels that should be above it are left out.

  // One row of the core. `g` is exp(-t^2 / 2) there.
  HWY_INLINE void add_row(int k, V g, Normal& normal) const {
    const Row row = row_of(k, g);
    V f = hn::Load(Tag(), profiles.w.value + at(k));
    if constexpr (kPlain)
      f = hn::Sub(f, hn::MulAdd(row.k, profiles.background.slope, profiles.background.level));
    normal.add_background(row.weight, row.k, f);
    normal.add_stripe(row.weight, row.k, f, row.value, row.derivative);
  }

  // What a wider stripe has more there, over its amplitude and per part of its width.
  HWY_INLINE void add_widening(int k, V g, RightSide& wider) const {
    const Row row = row_of(k, g);
    const V weighted = hn::Mul(row.weight, hn::Mul(g, row.t2));
    wider.one = hn::Add(wider.one, weighted);
    wider.k = hn::MulAdd(weighted, row.k, wider.k);
    wider.g = hn::MulAdd(weighted, row.value, wider.g);
    wider.p = hn::MulAdd(weighted, row.derivative, wider.p);
  }

  struct Row {
    V k, t2, value, derivative, weight;
  };
  HWY_INLINE int at(int k) const { return (profiles.plan.window + k) * lanes(); }
  HWY_INLINE Row row_of(int k, V g) const {
    const V kv = set(static_cast<float>(k));
    const V t = hn::Mul(hn::Sub(kv, position), shape.inverse_width);
    const V t2 = hn::Mul(t, t);
    const V value = shape.value(g, t2);
    const V weight = weight_of(hn::Max(hn::Mul(amplitude, value), hn::Zero(Tag())), at(k));
    return {kv, t2, value, shape.derivative(g, t, t2), weight};
  }

  HWY_INLINE V weight_of(V signal, int at) const {
    V variance = profiles.noise.variance(signal);
    if constexpr (kPlain) return rough_inverse(variance);
    if (profiles.w.has_extra) variance = hn::Add(variance, hn::Load(Tag(), profiles.w.extra + at));
    const V usable = hn::Load(Tag(), profiles.w.usable + at);
    return hn::Mul(hn::IfThenElseZero(hn::Le(signal, ceiling), usable), rough_inverse(variance));
  }

  HWY_INLINE void add_core(Normal& normal) const {
    for_each_row([&](int k, V g) HWY_ATTR { add_row(k, g, normal); });
  }

  // exp(-(k - x)^2 / 2 sigma^2) for successive k by two multiplications each.
  template <typename OnRow>
  HWY_INLINE void for_each_row(const OnRow& on_row) const {
    const Tag d;
    const V i2 = hn::Mul(shape.inverse_width, shape.inverse_width);
    const V half = hn::Mul(set(-0.5F), i2);
    const V x = position;
    const V g0 = hn::Exp(d, hn::Mul(half, hn::Mul(x, x)));
    const V one = hn::Exp(d, half);
    const V towards = hn::Exp(d, hn::Mul(i2, x));
    const V ratio_of_ratios = hn::Mul(one, one);
    on_row(0, g0);
    V up = hn::Mul(one, towards);
    V down = ratio(one, towards);
    V g_up = g0;
    V g_down = g0;
    for (int k = 1; k <= profiles.plan.core; ++k) {
      g_up = hn::Mul(g_up, up);
      g_down = hn::Mul(g_down, down);
      up = hn::Mul(up, ratio_of_ratios);
      down = hn::Mul(down, ratio_of_ratios);
      on_row(k, g_up);
      on_row(-k, g_down);
    }
  }

  // All pixels of the ring have the same weight: its sums are those of the fit.
  HWY_INLINE void add_ring(Normal& normal) const {
    const V weight = inverse(profiles.noise.base);
    if constexpr (kPlain) {
      normal.n11 = hn::Mul(weight, set(profiles.plan.ring_count));
      normal.nkk = hn::Mul(weight, set(profiles.plan.ring_squares));
      return;
    }
    if (profiles.w.has_extra) {
      add_uneven_ring(normal);
      return;
    }
    normal.n11 = hn::Mul(weight, profiles.background.count);
    normal.nkk = hn::Mul(weight, profiles.background.sum_kk);
    normal.n1k = hn::Mul(weight, profiles.background.sum_k);
    normal.values.one = hn::Mul(weight, profiles.background.rest);
    normal.values.k = hn::Mul(weight, profiles.background.rest_k);
  }

  void add_uneven_ring(Normal& normal) const {
    const Tag d;
    normal = Normal(hn::Zero(d));
    for (int q = profiles.plan.core + 1; q <= profiles.plan.window; ++q) {
      for (const int k : {-q, q}) {
        const int at = (profiles.plan.window + k) * lanes();
        const V variance = hn::Add(profiles.noise.base, hn::Load(d, profiles.w.extra + at));
        const V weight = hn::Mul(hn::Load(d, profiles.w.usable + at), rough_inverse(variance));
        normal.add_background(weight, set(static_cast<float>(k)),
                              hn::Load(d, profiles.w.value + at));
      }
    }
  }
};

// Where some pixels of a profile are clipped, those that should be within a sigma of full scale
// are left out whether they are clipped or not: noise would choose among them, with a bias.
V ceiling_of(const ProfileImages& images, const Background& background, const Noise& noise,
             const Window& w) {
  const V offset = hn::Add(background.level, hn::Load(Tag(), w.dark));
  const V room = hn::Sub(set(static_cast<float>(images.full_scale_dn)), offset);
  const V variance = hn::Max(noise.variance(room), noise.base);
  return hn::Sub(room, root(variance));
}

// How many steps, and when they are small enough.
struct Patience {
  bool any_clipped;
  int least_steps, most_steps;
  V longest, settled;

  HWY_INLINE Patience(V clipped, V width) {
    any_clipped = !hn::AllTrue(Tag(), hn::Eq(clipped, hn::Zero(Tag())));
    least_steps = any_clipped ? 3 : 1;
    most_steps = any_clipped ? kMostClippedSteps : kMostSteps;
    longest = hn::Mul(set(0.75F), width);
    settled = hn::Mul(set(any_clipped ? 0.01F : 0.1F), width);
  }

  HWY_INLINE bool is_over(int step, V wanted, V variance) const {
    const V settled2 = hn::Mul(settled, settled);
    const V small2 = any_clipped ? settled2 : hn::Max(settled2, variance);
    return step >= least_steps && hn::AllTrue(Tag(), hn::Le(hn::Mul(wanted, wanted), small2));
  }
};

// A step's end, as the pixels have it and the middle of a run of clipped ones. What the flanks tell
// outweighs that, unless one of them lies between two pixels or is hidden: then the amplitude that
// goes with it is anything, and its error so large that nothing is left of what they tell.
struct Move {
  V amplitude;
  V step;
  V variance;  // Of the position then.
};

HWY_INLINE Move move_of(const Normal& normal, const Profiles& profiles, V position) {
  const MissingPixels& missing = profiles.missing;
  const auto solution = normal.solve(normal.values);
  const V most =
      hn::IfThenElse(missing.is_run, hn::Mul(set(kMostOverexposed), profiles.ceiling), set(1e30F));
  // Dividing by the new amplitude, not the old one, is right however far off the old one was.
  const V amplitude = hn::Min(hn::Max(solution.amplitude, set(1e-3F)), most);
  const V per_amplitude = inverse(amplitude);
  const V step = hn::Mul(solution.step_times_amplitude, per_amplitude);
  const V variance = hn::Mul(solution.step_variance, hn::Mul(per_amplitude, per_amplitude));
  if (hn::AllFalse(Tag(), missing.is_run)) return {amplitude, step, variance};
  const V flanks_part = ratio(missing.run_variance, hn::Add(missing.run_variance, variance));
  const V to_middle = hn::Sub(missing.run_middle, position);
  const V both = hn::MulAdd(flanks_part, hn::Sub(step, to_middle), to_middle);
  return {amplitude, hn::IfThenElse(missing.is_run, both, step),
          hn::IfThenElse(missing.is_run, hn::Mul(flanks_part, variance), variance)};
}

// What the width's error moves a position by, where the profile is cut.
template <bool kPlain>
HWY_INLINE V variance_by_width(const Step<kPlain>& step) {
  const V none = hn::Zero(Tag());
  const M is_cut = step.profiles.missing.is_cut;
  if (kPlain || hn::AllFalse(Tag(), is_cut)) return none;
  Normal normal(none);
  RightSide wider(none);
  step.add_ring(normal);
  step.for_each_row([&](int k, V g) HWY_ATTR {
    step.add_row(k, g, normal);
    step.add_widening(k, g, wider);
  });
  const V linear = hn::Abs(hn::Mul(set(kWidthError), normal.solve(wider).step_times_amplitude));
  const V moved = hn::Min(linear, step.profiles.expected.width);
  return hn::IfThenElseZero(is_cut, hn::Mul(moved, moved));
}

template <bool kPlain>
void refine(const Profiles& profiles, Estimate<V>& estimate) {
  const Tag d;
  const V width = profiles.expected.width;
  const V clipped = profiles.missing.clipped;
  const Shape shape(width);
  const Patience patience(clipped, width);
  const M has_run = profiles.missing.is_run;
  Estimate<V> start = estimate;
  start.position = hn::IfThenElse(has_run, profiles.missing.run_middle, start.position);
  Estimate<V> e = start;
  V limit = set(1e30F);
  for (int n = 1; n <= patience.most_steps; ++n) {
    const Step<kPlain> step{profiles, shape, e.position, e.amplitude, limit};
    Normal normal(hn::Zero(d));
    step.add_ring(normal);
    step.add_core(normal);
    const Move move = move_of(normal, profiles, e.position);
    e.amplitude = move.amplitude;
    const V taken = hn::Min(hn::Max(move.step, hn::Neg(patience.longest)), patience.longest);
    e.position = hn::Add(e.position, taken);
    e.variance = move.variance;
    if (patience.is_over(n, move.step, e.variance)) break;
    limit = hn::IfThenElse(hn::Gt(clipped, hn::Zero(d)), profiles.ceiling, limit);
  }
  // Noise can lead a weak fit astray, or leave nothing of it; the filter's peak stands then, or the
  // middle of a clipped run. Where pixels are clipped there may be nothing to know.
  const V allowed = hn::MulAdd(set(0.5F), clipped, hn::Mul(set(1.2F), width));
  // Written so that a NaN is astray.
  const M is_far = hn::Not(hn::Le(hn::Abs(hn::Sub(e.position, start.position)), allowed));
  const M is_anywhere = hn::Not(hn::Le(e.variance, hn::Mul(allowed, allowed)));
  const M is_worse = hn::AndNot(hn::Le(e.variance, profiles.missing.run_variance), has_run);
  const M is_lost = hn::Or(is_worse, hn::AndNot(hn::Gt(clipped, hn::Zero(d)), is_anywhere));
  const M is_astray = hn::Or(is_far, is_lost);
  estimate = e;
  if (!hn::AllFalse(d, is_astray)) {
    const V of_pixel = hn::Add(profiles.noise.base, profiles.extra.of_pixel);
    const V filtered = filter_variance(profiles.plan, of_pixel, profiles.background.slope_variance,
                                       profiles.expected, start.amplitude);
    const V start_variance = hn::IfThenElse(has_run, profiles.missing.run_variance, filtered);
    estimate.position = hn::IfThenElse(is_astray, start.position, e.position);
    estimate.amplitude = hn::IfThenElse(is_astray, start.amplitude, e.amplitude);
    estimate.variance = hn::IfThenElse(is_astray, start_variance, e.variance);
  }
  const Step<kPlain> there{profiles, shape, estimate.position, estimate.amplitude, limit};
  estimate.variance = hn::Add(estimate.variance, variance_by_width(there));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_GAUSS_NEWTON_INL_
