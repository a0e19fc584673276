// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/edges/edge_normal.hpp"

#include <algorithm>
#include <cmath>

#include "core/pixel_box.hpp"

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/edges/edge_normal.cpp"
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

// A pixel to a lane.
constexpr std::size_t kMostLanes = 8;
using Pixels = hn::CappedTag<double, kMostLanes>;
static_assert(EdgeProfile::kMost % kMostLanes == 0, "what is loaded is in the profile");
using V = hn::Vec<Pixels>;
using M = hn::Mask<Pixels>;

constexpr std::size_t kParameters = EdgeModel::kCount;
constexpr std::size_t kProducts = kParameters * (kParameters + 1) / 2;
constexpr double kGone = 5.5;  // Sigmas: a normal distribution has 4e-8 beyond.
// Background farther than so many widths off counts as Cauchy's distribution of this scale has it.
constexpr double kCore = 2.5;
constexpr double kScale2 = 9.0;
constexpr double kLeastOfWidth2 = 0.05;  // Of the stripe's variance, the laser's own.
constexpr double kLeastDarkGain = 0.05;

HWY_INLINE V set(double value) { return hn::Set(Pixels(), value); }
HWY_INLINE V zero() { return hn::Zero(Pixels()); }
HWY_INLINE V square(V v) { return hn::Mul(v, v); }
HWY_INLINE double sum_of(V v) { return hn::GetLane(hn::SumOfLanes(Pixels(), v)); }

struct Step {
  V part;     // Integral of a normal distribution,
  V density;  // and its density.
};

// To 1.5e-7 (Abramowitz & Stegun 1964, equation 7.1.26).
HWY_INLINE Step step_at(V z) {
  const Pixels d;
  const V x = hn::Mul(hn::Abs(z), set(0.70710678118654752));
  const V t = hn::Div(set(1.0), hn::MulAdd(set(0.3275911), x, set(1.0)));
  const V e = hn::Exp(d, hn::Neg(square(x)));
  V series = hn::MulAdd(set(1.061405429), t, set(-1.453152027));
  series = hn::MulAdd(series, t, set(1.421413741));
  series = hn::MulAdd(series, t, set(-0.284496736));
  series = hn::MulAdd(series, t, set(0.254829592));
  const V tail = hn::Mul(hn::Mul(set(0.5), e), hn::Mul(series, t));
  const V part = hn::IfThenElse(hn::Gt(z, zero()), hn::Sub(set(1.0), tail), tail);
  return {part, hn::Mul(set(0.39894228040143268), e)};
}

// What the model says of pixels, and its derivatives.
struct Light {
  V background;
  V laser;
  V of_background[kParameters];
  V of_laser[kParameters];
};

// One model, ready to be evaluated at pixels. The laser's profile L has the variance w^2 - b^2, b
// the blur; a step of reflectance at e makes of it the blurred product, by completing the square
// b * (L H(x - e)) = G_w(x - p) Phi((m - e) / t), m = (p b^2 + x (w^2 - b^2)) / w^2 and t^2 =
// (w^2 - b^2) b^2 / w^2. The pixel's box is part of the blur.
class LightModel {
 public:
  LightModel(const EdgeModel& model, EdgeKind kind, double middle)
      : p_(model.of), middle_(middle), laser_contrast_(kind == EdgeKind::kReflectance ? 2.0 : 0.0) {
    const double blur = p_[EdgeModel::kBlur];
    const double width = p_[EdgeModel::kWidth];
    blur2_ = blur * blur + kPixelBox2;
    width2_ = width * width + kPixelBox2;
    laser2_ = std::max(width2_ - blur2_, kLeastOfWidth2 * width2_);
    core_ = kCore * std::sqrt(width2_);
    per_blur_ = 1.0 / std::sqrt(blur2_);
    per_mixed_ = std::sqrt(width2_ / (laser2_ * blur2_));
  }

  HWY_INLINE void evaluate(V x, Light& light) const {
    light.laser = zero();
    for (std::size_t i = 0; i < kParameters; ++i)
      light.of_background[i] = light.of_laser[i] = zero();
    add_background(x, light);
    add_laser(x, light);
  }

  // Of pixels that the stripe is on.
  HWY_INLINE M is_core(V x) const {
    return hn::Lt(hn::Abs(hn::Sub(x, set(p_[EdgeModel::kPosition]))), set(core_));
  }

 private:
  HWY_INLINE void add_background(V x, Light& light) const {
    const V contrast = set(p_[EdgeModel::kContrast]);
    const V ambient = set(p_[EdgeModel::kAmbient]);
    const V z = hn::Mul(hn::Sub(x, set(p_[EdgeModel::kEdge])), set(per_blur_));
    const Step wide = step_at(z);
    const V side = hn::MulSub(set(2.0), wide.part, set(1.0));
    const V edge =
        hn::Mul(set(2.0 * p_[EdgeModel::kContrast] * p_[EdgeModel::kAmbient]), wide.density);
    const V from_middle = hn::Sub(x, set(middle_));
    const V bright = hn::MulAdd(contrast, side, set(1.0));
    const V level = hn::MulAdd(ambient, bright, set(p_[EdgeModel::kBlack]));
    light.background = hn::MulAdd(set(p_[EdgeModel::kSlope]), from_middle, level);
    light.of_background[EdgeModel::kContrast] = hn::Mul(ambient, side);
    light.of_background[EdgeModel::kEdge] = hn::Mul(edge, set(-per_blur_));
    light.of_background[EdgeModel::kAmbient] = bright;
    light.of_background[EdgeModel::kBlack] = set(1.0);
    light.of_background[EdgeModel::kSlope] = from_middle;
    light.of_background[EdgeModel::kBlur] =
        hn::Mul(hn::Mul(edge, z), set(-p_[EdgeModel::kBlur] / blur2_));
  }

  HWY_INLINE void add_laser(V x, Light& light) const {
    const V off = hn::Sub(x, set(p_[EdgeModel::kPosition]));
    const V off2 = square(off);
    const M is_lit = hn::Le(off2, set(kGone * kGone * width2_));
    if (hn::AllFalse(Pixels(), is_lit)) return;
    const V contrast = set(p_[EdgeModel::kContrast]);
    const V bell =
        hn::IfThenElseZero(is_lit, hn::Exp(Pixels(), hn::Mul(off2, set(-0.5 / width2_))));
    const double share = blur2_ / width2_;
    const V mixed = hn::NegMulAdd(off, set(share), hn::Sub(x, set(p_[EdgeModel::kEdge])));
    const V y = hn::Mul(mixed, set(per_mixed_));
    const Step lit = step_at(y);
    const V lit_side = hn::Mul(set(laser_contrast_), hn::Sub(lit.part, set(0.5)));
    const V bright = hn::MulAdd(contrast, lit_side, set(1.0));
    const V peak = hn::Mul(set(p_[EdgeModel::kAmplitude]), bell);
    const V lit_edge =
        hn::Mul(hn::Mul(set(laser_contrast_ * p_[EdgeModel::kContrast]), peak), lit.density);
    light.laser = hn::Mul(peak, bright);
    light.of_laser[EdgeModel::kPosition] = hn::MulAdd(hn::Mul(light.laser, off), set(1.0 / width2_),
                                                      hn::Mul(lit_edge, set(share * per_mixed_)));
    light.of_laser[EdgeModel::kAmplitude] = hn::Mul(bell, bright);
    light.of_laser[EdgeModel::kContrast] = hn::Mul(peak, lit_side);
    light.of_laser[EdgeModel::kEdge] = hn::Mul(lit_edge, set(-per_mixed_));
    // Of m, and of t = sqrt(laser2 blur2 / width2).
    const V by_blur = hn::NegMulSub(off, set(2.0 * per_mixed_ / width2_),
                                    hn::Mul(y, set(1.0 / blur2_ - 1.0 / laser2_)));
    light.of_laser[EdgeModel::kBlur] =
        hn::Mul(hn::Mul(lit_edge, set(p_[EdgeModel::kBlur])), by_blur);
    const V by_width = hn::MulSub(off, set(2.0 * share * per_mixed_ / width2_),
                                  hn::Mul(y, set(1.0 / laser2_ - 1.0 / width2_)));
    const V of_bell = hn::Mul(hn::Mul(light.laser, off2), set(1.0 / (width2_ * width2_)));
    light.of_laser[EdgeModel::kWidth] =
        hn::Mul(set(p_[EdgeModel::kWidth]), hn::MulAdd(lit_edge, by_width, of_bell));
  }

  const std::array<double, kParameters>& p_;
  double middle_;
  double laser_contrast_;
  double blur2_, width2_, laser2_, core_, per_blur_, per_mixed_;
};

// What so many pixels tell at once: lit ones, or dark ones.
struct Rows {
  V residual;
  V variance;
  M is_told;
  M is_core;
};

class NormalSum {
 public:
  HWY_INLINE NormalSum() : core_chi2_(zero()), far_logs_(zero()) {
    for (V& product : products_) product = zero();
    for (V& of : gradient_) of = zero();
  }

  HWY_INLINE void add(const Rows& rows, const V* derivatives) {
    const V r2 = hn::Div(square(rows.residual), rows.variance);
    const M is_core = hn::And(rows.is_told, rows.is_core);
    const M is_far = hn::AndNot(rows.is_core, rows.is_told);
    core_chi2_ = hn::Add(core_chi2_, hn::IfThenElseZero(is_core, r2));
    far_logs_ = hn::Add(
        far_logs_,
        hn::Log(Pixels(),
                hn::IfThenElse(is_far, hn::MulAdd(r2, set(1.0 / kScale2), set(1.0)), set(1.0))));
    const V cauchy = hn::Div(set(kScale2), hn::Add(set(kScale2), r2));
    const V weight = hn::IfThenElse(rows.is_core, set(1.0), cauchy);
    const V root = hn::IfThenElseZero(rows.is_told, hn::Sqrt(hn::Div(weight, rows.variance)));
    const V residual = hn::Mul(root, rows.residual);
    V weighted[kParameters];
    V* product = products_;
    for (std::size_t i = 0; i < kParameters; ++i) {
      weighted[i] = hn::Mul(root, derivatives[i]);
      gradient_[i] = hn::MulAdd(weighted[i], residual, gradient_[i]);
      for (std::size_t j = 0; j <= i; ++j, ++product) {
        *product = hn::MulAdd(weighted[i], weighted[j], *product);
      }
    }
    rows_ += static_cast<int>(hn::CountTrue(Pixels(), rows.is_told));
    core_rows_ += static_cast<int>(hn::CountTrue(Pixels(), is_core));
  }

  void total(EdgeNormal& normal) const {
    const V* product = products_;
    for (std::size_t i = 0; i < kParameters; ++i) {
      normal.gradient[i] = sum_of(gradient_[i]);
      for (std::size_t j = 0; j <= i; ++j) normal.information[i][j] = sum_of(*product++);
    }
    normal.core_chi2 = sum_of(core_chi2_);
    normal.chi2 = normal.core_chi2 + kScale2 * sum_of(far_logs_);
    normal.rows = rows_;
    normal.core_rows = core_rows_;
  }

 private:
  V products_[kProducts];  // Of the derivatives by each two parameters.
  V gradient_[kParameters];
  V core_chi2_, far_logs_;
  int rows_ = 0;
  int core_rows_ = 0;
};

HWY_INLINE V variance_of(const NoiseModel& noise, V value) {
  const V light = hn::Max(hn::Sub(value, set(noise.black_level_dn)), zero());
  return hn::MulAdd(set(noise.dn_per_electron), light,
                    set(noise.variance_dn2(noise.black_level_dn)));
}

HWY_INLINE M clipped_at(const EdgeProfile& profile, std::size_t i) {
  const Pixels d;
  if (!profile.is_clipped) return hn::FirstN(d, 0);
  alignas(64) std::array<double, kMostLanes> flags{};
  const std::size_t there = std::min(hn::Lanes(d), profile.count - i);
  for (std::size_t n = 0; n < there; ++n) flags[n] = profile.clipped[i + n] ? 1.0 : 0.0;
  return hn::Ne(hn::Load(d, flags.data()), zero());
}

void sum_normal(const EdgeProfile& profile, const PlanNoise& noise, const EdgeModel& model,
                EdgeKind kind, EdgeNormal& normal) {
  const Pixels d;
  const double middle = profile.count > 0 ? profile.at[profile.count / 2] : 0.0;
  const LightModel light_model(model, kind, middle);
  const V speckle2 = set(noise.speckle_contrast * noise.speckle_contrast);
  NormalSum sum;
  Light light;
  for (std::size_t i = 0; i < profile.count; i += hn::Lanes(d)) {
    const M is_there = hn::FirstN(d, profile.count - i);
    const V x = hn::IfThenElse(is_there, hn::LoadU(d, &profile.at[i]), set(middle));
    light_model.evaluate(x, light);
    const M is_core = light_model.is_core(x);
    const V value = hn::Add(light.background, light.laser);
    const V lit = hn::IfThenElse(is_there, hn::LoadU(d, &profile.lit[i]), value);
    const V extra = hn::IfThenElseZero(is_there, hn::LoadU(d, &profile.extra[i]));
    const V own = hn::Add(variance_of(noise.model, value), extra);
    const V variance = hn::MulAdd(speckle2, square(light.laser), own);
    const M is_above = hn::And(clipped_at(profile, i), hn::Ge(value, lit));
    V derivatives[kParameters];
    for (std::size_t n = 0; n < kParameters; ++n)
      derivatives[n] = hn::Add(light.of_background[n], light.of_laser[n]);
    sum.add({hn::Sub(lit, value), variance, hn::AndNot(is_above, is_there), is_core}, derivatives);
    if (!profile.has_dark) continue;
    const V dark = hn::IfThenElse(is_there, hn::LoadU(d, &profile.dark[i]), light.background);
    const V gain = set(std::max(kLeastDarkGain, noise.dark_noise_gain));
    const V dark_variance = hn::Mul(gain, variance_of(noise.model, light.background));
    sum.add({hn::Sub(dark, light.background), dark_variance, is_there, is_core},
            light.of_background);
  }
  sum.total(normal);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(sum_normal);

EdgeNormal edge_normal(const EdgeProfile& profile, const PlanNoise& noise, const EdgeModel& model,
                       EdgeKind kind) noexcept {
  EdgeNormal normal{};
  HWY_DYNAMIC_DISPATCH(sum_normal)(profile, noise, model, kind, normal);
  return normal;
}

}  // namespace striper::detail
#endif  // HWY_ONCE
