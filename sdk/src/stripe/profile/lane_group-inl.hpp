// SPDX-License-Identifier: Apache-2.0
// Arithmetic on the vectors of several batches side by side. Compiled for every instruction set:
// see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_LANE_GROUP_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_LANE_GROUP_INL_
#undef STRIPER_STRIPE_LANE_GROUP_INL_
#else
#define STRIPER_STRIPE_LANE_GROUP_INL_
#endif

#include "stripe/profile/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// What follows a profile's pixels is one long chain of operations, each of which waits four cycles
// for the one before: a step of several batches after the other keeps a core busy.
constexpr int kTogether = 4;

template <typename T>
struct Together {
  T of[kTogether];
};
using Group = Together<V>;

template <typename T>
constexpr bool kIsTogether = false;
template <typename T>
constexpr bool kIsTogether<Together<T>> = true;

template <typename T>
HWY_INLINE const T& part(const T& same_for_all, int /*batch*/) {
  return same_for_all;
}
template <typename T>
HWY_INLINE const T& part(const Together<T>& group, int batch) {
  return group.of[batch];
}

// Applies an operation to vectors, or to those of each batch.
template <typename Op, typename... Ts>
HWY_INLINE auto apply(const Op& op, const Ts&... x) {
  if constexpr ((kIsTogether<Ts> || ...)) {
    return Together<decltype(op(part(x, 0)...))>{
        {op(part(x, 0)...), op(part(x, 1)...), op(part(x, 2)...), op(part(x, 3)...)}};
  } else {
    return op(x...);
  }
}

// The operations of Highway, of vectors and of groups.

template <typename A, typename B>
HWY_INLINE auto add(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Add(x, y); }, a, b);
}
template <typename A, typename B>
HWY_INLINE auto sub(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Sub(x, y); }, a, b);
}
template <typename A, typename B>
HWY_INLINE auto mul(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Mul(x, y); }, a, b);
}
template <typename A, typename B, typename C>
HWY_INLINE auto mul_add(const A& a, const B& b, const C& c) {
  return apply([](V x, V y, V z) HWY_ATTR { return hn::MulAdd(x, y, z); }, a, b, c);
}
template <typename A, typename B, typename C>
HWY_INLINE auto neg_mul_add(const A& a, const B& b, const C& c) {
  return apply([](V x, V y, V z) HWY_ATTR { return hn::NegMulAdd(x, y, z); }, a, b, c);
}
template <typename A, typename B>
HWY_INLINE auto min(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Min(x, y); }, a, b);
}
template <typename A, typename B>
HWY_INLINE auto max(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Max(x, y); }, a, b);
}
template <typename A, typename B>
HWY_INLINE auto is_above(const A& a, const B& b) {
  return apply([](V x, V y) HWY_ATTR { return hn::Gt(x, y); }, a, b);
}
template <typename C, typename A, typename B>
HWY_INLINE auto choose(const C& condition, const A& yes, const B& no) {
  return apply([](M c, V x, V y) HWY_ATTR { return hn::IfThenElse(c, x, y); }, condition, yes, no);
}

HWY_INLINE Group inverse(const Group& g) {
  return apply([](V v) HWY_ATTR { return inverse(v); }, g);
}
HWY_INLINE Group inverse_root(const Group& g) {
  return apply([](V v) HWY_ATTR { return inverse_root(v); }, g);
}
HWY_INLINE Group rough_inverse(const Group& g) {
  return apply([](V v) HWY_ATTR { return rough_inverse(v); }, g);
}
HWY_INLINE Group rough_inverse_root(const Group& g) {
  return apply([](V v) HWY_ATTR { return rough_inverse_root(v); }, g);
}
HWY_INLINE Group rough_root(const Group& g) {
  return apply([](V v) HWY_ATTR { return rough_root(v); }, g);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_LANE_GROUP_INL_
