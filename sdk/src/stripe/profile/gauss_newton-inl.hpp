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
    const V tiny = set(1e-20F);
    const V i1 = inverse(hn::Max(n11, tiny));
    const V lk = hn::Mul(n1k, i1);
    const V lg = hn::Mul(n1g, i1);
    const V lp = hn::Mul(n1p, i1);
    const V dk = hn::Max(hn::NegMulAdd(lk, n1k, nkk), tiny);
    const V kg = hn::NegMulAdd(lk, n1g, nkg);
    const V kp = hn::NegMulAdd(lk, n1p, nkp);
    const V sk = hn::NegMulAdd(lk, r1, rk);
    const V ik = inverse(dk);
    const V mg = hn::Mul(kg, ik);
    const V mp = hn::Mul(kp, ik);
    const V dg = hn::Max(hn::NegMulAdd(mg, kg, hn::NegMulAdd(lg, n1g, ngg)), tiny);
    const V gp = hn::NegMulAdd(mg, kp, hn::NegMulAdd(lg, n1p, ngp));
    const V sg = hn::NegMulAdd(mg, sk, hn::NegMulAdd(lg, r1, rg));
    const V ig = inverse(dg);
    const V np = hn::Mul(gp, ig);
    const V dp =
        hn::Max(hn::NegMulAdd(np, gp, hn::NegMulAdd(mp, kp, hn::NegMulAdd(lp, n1p, npp))), tiny);
    const V sp = hn::NegMulAdd(np, sg, hn::NegMulAdd(mp, sk, hn::NegMulAdd(lp, r1, rp)));
    const V variance = inverse(dp);
    const V p = hn::Mul(sp, variance);
    return {hn::NegMulAdd(np, p, hn::Mul(sg, ig)), p, variance};
  }
};

// What is known of a batch of profiles before the fit.
struct Profiles {
  const ProfilePlan& plan;
  const Window& w;
  const Background& background;
  const Noise& noise;
  const ExtraVariance& extra;
  const Expected<V>& expected;
  V clipped;  // How many pixels of each.
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
    const Tag d;
    const int at = (profiles.plan.window + k) * lanes();
    const V kv = set(static_cast<float>(k));
    const V t = hn::Mul(hn::Sub(kv, position), shape.inverse_width);
    const V t2 = hn::Mul(t, t);
    const V value = shape.value(g, t2);
    const V weight = weight_of(hn::Max(hn::Mul(amplitude, value), hn::Zero(d)), at);
    V f = hn::Load(d, profiles.w.value + at);
    if constexpr (kPlain)
      f = hn::Sub(f, hn::MulAdd(kv, profiles.background.slope, profiles.background.level));
    normal.add_background(weight, kv, f);
    normal.add_stripe(weight, kv, f, value, shape.derivative(g, t, t2));
  }

  HWY_INLINE V weight_of(V signal, int at) const {
    V variance = profiles.noise.variance(signal);
    if constexpr (kPlain) return rough_inverse(variance);
    if (profiles.w.has_extra) variance = hn::Add(variance, hn::Load(Tag(), profiles.w.extra + at));
    const V usable = hn::Load(Tag(), profiles.w.usable + at);
    return hn::Mul(hn::IfThenElseZero(hn::Le(signal, ceiling), usable), rough_inverse(variance));
  }

  // exp(-(k - x)^2 / 2 sigma^2) for successive k by two multiplications each.
  HWY_INLINE void add_core(Normal& normal) const {
    const Tag d;
    const V i2 = hn::Mul(shape.inverse_width, shape.inverse_width);
    const V half = hn::Mul(set(-0.5F), i2);
    const V x = position;
    const V g0 = hn::Exp(d, hn::Mul(half, hn::Mul(x, x)));
    const V one = hn::Exp(d, half);
    const V towards = hn::Exp(d, hn::Mul(i2, x));
    const V ratio_of_ratios = hn::Mul(one, one);
    add_row(0, g0, normal);
    V up = hn::Mul(one, towards);
    V down = ratio(one, towards);
    V g_up = g0;
    V g_down = g0;
    for (int k = 1; k <= profiles.plan.core; ++k) {
      g_up = hn::Mul(g_up, up);
      g_down = hn::Mul(g_down, down);
      up = hn::Mul(up, ratio_of_ratios);
      down = hn::Mul(down, ratio_of_ratios);
      add_row(k, g_up, normal);
      add_row(-k, g_down, normal);
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
    normal.r1 = hn::Mul(weight, profiles.background.rest);
    normal.rk = hn::Mul(weight, profiles.background.rest_k);
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

template <bool kPlain>
void refine(const Profiles& profiles, Estimate<V>& estimate) {
  const Tag d;
  const V width = profiles.expected.width;
  const V clipped = profiles.clipped;
  const Shape shape(width);
  const Patience patience(clipped, width);
  const Estimate<V> start = estimate;
  Estimate<V> e = start;
  V limit = set(1e30F);
  for (int n = 1; n <= patience.most_steps; ++n) {
    const Step<kPlain> step{profiles, shape, e.position, e.amplitude, limit};
    Normal normal(hn::Zero(d));
    step.add_ring(normal);
    step.add_core(normal);
    const auto solution = normal.solve();
    // Dividing by the new amplitude, not the old one, is right however far off the old one was.
    e.amplitude = hn::Max(solution.amplitude, set(1e-3F));
    const V per_amplitude = inverse(e.amplitude);
    const V wanted = hn::Mul(solution.step_times_amplitude, per_amplitude);
    const V taken = hn::Min(hn::Max(wanted, hn::Neg(patience.longest)), patience.longest);
    e.position = hn::Add(e.position, taken);
    e.variance = hn::Mul(solution.step_variance, hn::Mul(per_amplitude, per_amplitude));
    if (patience.is_over(n, wanted, e.variance)) break;
    limit = hn::IfThenElse(hn::Gt(clipped, hn::Zero(d)), profiles.ceiling, limit);
  }
  // Noise can lead a weak fit astray, or leave nothing of it; the filter's peak stands then. Where
  // pixels are clipped there may be nothing to know.
  const V allowed = hn::MulAdd(set(0.5F), clipped, hn::Mul(set(1.2F), width));
  // Written so that a NaN is astray.
  const M is_far = hn::Not(hn::Le(hn::Abs(hn::Sub(e.position, start.position)), allowed));
  const M is_anywhere = hn::Not(hn::Le(e.variance, hn::Mul(allowed, allowed)));
  const M is_astray = hn::Or(is_far, hn::AndNot(hn::Gt(clipped, hn::Zero(d)), is_anywhere));
  estimate = e;
  if (hn::AllFalse(d, is_astray)) return;
  const V of_pixel = hn::Add(profiles.noise.base, profiles.extra.of_pixel);
  const V start_variance =
      filter_variance(profiles.plan, of_pixel, profiles.background.slope_variance,
                      profiles.expected, start.amplitude);
  estimate.position = hn::IfThenElse(is_astray, start.position, e.position);
  estimate.amplitude = hn::IfThenElse(is_astray, start.amplitude, e.amplitude);
  estimate.variance = hn::IfThenElse(is_astray, start_variance, e.variance);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_GAUSS_NEWTON_INL_
