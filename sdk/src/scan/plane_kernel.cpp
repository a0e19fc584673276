// SPDX-License-Identifier: Apache-2.0
#include "scan/plane_kernel.hpp"

#include <limits>

// This file includes itself once per instruction set; the order matters.
// clang-format off
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scan/plane_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, PlaneBatch::kSize>;
using V = hn::Vec<D>;

// A cubic, lowest power first.
struct Cubic {
  V c0, c1, c2, c3;

  V at(V s) const { return hn::MulAdd(s, hn::MulAdd(s, hn::MulAdd(s, c3, c2), c1), c0); }
  V slope(V s) const {
    const D d;
    const V twice_c2 = hn::Mul(hn::Set(d, 2.0), c2);
    const V thrice_c3 = hn::Mul(hn::Set(d, 3.0), c3);
    return hn::MulAdd(s, hn::MulAdd(s, thrice_c3, twice_c2), c1);
  }
};

// The Hermite cubic with these values and slopes at 0 and 1.
HWY_INLINE Cubic hermite(V a, V slope_a, V b, V slope_b) {
  const V rise = hn::Sub(b, a);
  const V c3 = hn::Sub(hn::Sub(hn::Add(slope_a, slope_b), rise), rise);
  return {a, slope_a, hn::Sub(hn::Sub(rise, slope_a), c3), c3};
}

struct Homogeneous {
  V X, Y, w;
};

HWY_INLINE V row(const Eigen::Matrix3d& H, int i, V x, V y, V one_or_zero) {
  const D d;
  return hn::MulAdd(hn::Set(d, H(i, 0)), x,
                    hn::MulAdd(hn::Set(d, H(i, 1)), y, hn::Mul(hn::Set(d, H(i, 2)), one_or_zero)));
}

HWY_INLINE Homogeneous apply(const Eigen::Matrix3d& H, V x, V y, V one_or_zero) {
  return {row(H, 0, x, y, one_or_zero), row(H, 1, x, y, one_or_zero), row(H, 2, x, y, one_or_zero)};
}

HWY_INLINE V length(V x, V y) { return hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y))); }

HWY_INLINE V range_along(const Homogeneous& ray) {
  const D d;
  const V range = hn::Div(length(ray.X, ray.Y), ray.w);
  const V infinity = hn::Set(d, std::numeric_limits<double>::infinity());
  return hn::IfThenElse(hn::Gt(ray.w, hn::Zero(d)), range, infinity);
}

// atan2(y, x) relative to a reference direction that most of the batch is near to: atan(t) by its
// series, whose first term left out is 7e-17 at |t| = 0.1; NaN beyond that.
HWY_INLINE V bearing(const PlaneKernelInput& in, V x, V y) {
  const D d;
  const V x0 = hn::Set(d, in.x_reference_m);
  const V y0 = hn::Set(d, in.y_reference_m);
  const V along = hn::MulAdd(x0, x, hn::Mul(y0, y));
  const V t = hn::Div(hn::Sub(hn::Mul(x0, y), hn::Mul(y0, x)), along);
  const V t2 = hn::Mul(t, t);
  V sum = hn::Set(d, 1.0 / 13);
  for (const double coefficient : {-1.0 / 11, 1.0 / 9, -1.0 / 7, 1.0 / 5, -1.0 / 3, 1.0}) {
    sum = hn::MulAdd(sum, t2, hn::Set(d, coefficient));
  }
  const V near_enough = hn::MulAdd(sum, t, hn::Set(d, in.bearing_reference_rad));
  const auto is_near = hn::And(hn::Lt(hn::Abs(t), hn::Set(d, 0.1)), hn::Gt(along, hn::Zero(d)));
  return hn::IfThenElse(is_near, near_enough, hn::Set(d, std::numeric_limits<double>::quiet_NaN()));
}

HWY_INLINE void project_lanes(const PlaneKernelInput& in, PlaneBatch& batch, std::size_t i) {
  const D d;
  const hn::RebindToSigned<D> di;
  const auto node = hn::Load(di, &batch.node[i]);
  const auto number = [&](int k) { return hn::GatherIndex(d, in.nodes + k, node); };
  const Cubic x_of = hermite(number(0), number(2), number(4), number(6));
  const Cubic y_of = hermite(number(1), number(3), number(5), number(7));

  const V one = hn::Set(d, 1.0);
  const V s = hn::Load(d, &batch.s[i]);
  const V half = hn::Set(d, in.half_pixel_px * in.inverse_step);
  const V s_before = hn::Sub(s, half);
  const V s_after = hn::Add(s, half);
  const V before = range_along(apply(in.H, x_of.at(s_before), y_of.at(s_before), one));
  const V after = range_along(apply(in.H, x_of.at(s_after), y_of.at(s_after), one));

  const Homogeneous ray = apply(in.H, x_of.at(s), y_of.at(s), one);
  const V inverse_w = hn::Div(one, ray.w);
  const V x = hn::Mul(ray.X, inverse_w);
  const V y = hn::Mul(ray.Y, inverse_w);
  const V range = length(x, y);

  const V per_pixel = hn::Set(d, in.inverse_step);
  const Homogeneous slope = apply(in.H, hn::Mul(x_of.slope(s), per_pixel),
                                  hn::Mul(y_of.slope(s), per_pixel), hn::Zero(d));
  const V dx = hn::NegMulAdd(x, slope.w, slope.X);
  const V dy = hn::NegMulAdd(y, slope.w, slope.Y);
  const V dlength = hn::Mul(hn::MulAdd(x, dx, hn::Mul(y, dy)), inverse_w);

  hn::Store(x, d, &batch.x_m[i]);
  hn::Store(y, d, &batch.y_m[i]);
  hn::Store(range, d, &batch.range_m[i]);
  hn::Store(bearing(in, x, y), d, &batch.bearing_rad[i]);
  hn::Store(hn::Min(before, after), d, &batch.range_near_m[i]);
  hn::Store(hn::Max(before, after), d, &batch.range_far_m[i]);
  hn::Store(hn::Div(dlength, range), d, &batch.drange_dacross[i]);
  hn::Store(ray.w, d, &batch.w[i]);
}

void project_batch(const PlaneKernelInput& input, PlaneBatch& batch) {
  for (std::size_t i = 0; i < PlaneBatch::kSize; i += hn::Lanes(D()))
    project_lanes(input, batch, i);
}

}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(project_batch);

void project_batch(const PlaneKernelInput& input, PlaneBatch& batch) {
  HWY_DYNAMIC_DISPATCH(project_batch)(input, batch);
}

}  // namespace striper::detail
#endif
