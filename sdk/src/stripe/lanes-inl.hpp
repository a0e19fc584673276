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

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_LANES_INL_
