// SPDX-License-Identifier: Apache-2.0
// Arithmetic on vectors of floats, a peak to a lane. Compiled for every instruction set: see
// hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_LANES_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_LANES_INL_
#undef STRIPER_STRIPE_LANES_INL_
#else
#define STRIPER_STRIPE_LANES_INL_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<float>;
using IntTag = hn::RebindToSigned<Tag>;
using V = hn::Vec<Tag>;
using M = hn::Mask<Tag>;

HWY_INLINE int lanes() { return static_cast<int>(hn::Lanes(Tag())); }
HWY_INLINE V set(float value) { return hn::Set(Tag(), value); }

// The nearest whole number to v, abs(v) below 2^22: what does not fit is not looked after.
HWY_INLINE hn::Vec<IntTag> nearest(V v) {
  constexpr float kUnitsAreTheLastBit = 12582912.0F;  // 1.5 * 2^23
  const IntTag di;
  const auto bits = hn::BitCast(di, hn::Add(v, set(kUnitsAreTheLastBit)));
  return hn::Sub(bits, hn::BitCast(di, set(kUnitsAreTheLastBit)));
}

// 1 / v to 12 bits or better, for weights: dividing is the slowest thing a core can do.
HWY_INLINE V rough_inverse(V v) {
#if HWY_ARCH_X86
  return hn::ApproximateReciprocal(v);
#else
  return hn::Div(set(1.0F), v);
#endif
}

// 1 / v, to the last bit or two, v neither 0 nor infinite: Newton doubles the bits.
HWY_INLINE V inverse(V v) {
#if HWY_ARCH_X86
  const V rough = hn::ApproximateReciprocal(v);
  return hn::Mul(rough, hn::NegMulAdd(v, rough, set(2.0F)));
#else
  return hn::Div(set(1.0F), v);
#endif
}

HWY_INLINE V ratio(V a, V b) { return hn::Mul(a, inverse(b)); }

// 1 / sqrt(v), to the last bit or two, v above 0.
HWY_INLINE V inverse_root(V v) {
#if HWY_ARCH_X86
  const V rough = hn::ApproximateReciprocalSqrt(v);
  const V half = hn::Mul(hn::Mul(set(0.5F), v), rough);
  return hn::Mul(rough, hn::NegMulAdd(half, rough, set(1.5F)));
#else
  return hn::Div(set(1.0F), hn::Sqrt(v));
#endif
}

// sqrt(v), v above 0.
HWY_INLINE V root(V v) { return hn::Mul(v, inverse_root(v)); }

// The same to 12 bits or better, for what is an estimate of an error anyway.
HWY_INLINE V rough_inverse_root(V v) {
#if HWY_ARCH_X86
  return hn::ApproximateReciprocalSqrt(v);
#else
  return inverse_root(v);
#endif
}
HWY_INLINE V rough_root(V v) { return hn::Mul(v, rough_inverse_root(v)); }

// ln v to 1e-7, v above 0 (Moshier's Cephes, logf), without the division of hn::Log.
HWY_INLINE V log(V v) {
  const Tag d;
  const IntTag di;
  const auto bits = hn::BitCast(di, v);
  const auto exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, 0x3F3504F3)));
  const V t = hn::Sub(hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(exponent))), set(1.0F));
  const V t2 = hn::Mul(t, t);
  V even = hn::MulAdd(set(7.0376836292e-2F), t2, set(1.1676998740e-1F));
  V odd = hn::MulAdd(set(-1.1514610310e-1F), t2, set(-1.2420140846e-1F));
  even = hn::MulAdd(even, t2, set(1.4249322787e-1F));
  odd = hn::MulAdd(odd, t2, set(-1.6668057665e-1F));
  even = hn::MulAdd(even, t2, set(2.0000714765e-1F));
  odd = hn::MulAdd(odd, t2, set(-2.4999993993e-1F));
  even = hn::MulAdd(even, t2, set(3.3333331174e-1F));
  const V cubic = hn::Mul(hn::Mul(t, t2), hn::MulAdd(odd, t, even));
  const V of_mantissa = hn::Add(t, hn::NegMulAdd(set(0.5F), t2, cubic));
  return hn::MulAdd(hn::ConvertTo(d, exponent), set(0.69314718F), of_mantissa);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_LANES_INL_
