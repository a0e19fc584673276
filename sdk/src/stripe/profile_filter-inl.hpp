// SPDX-License-Identifier: Apache-2.0
// The matched filter of a batch of profiles and where its answer peaks. Compiled for every
// instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_FILTER_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_FILTER_INL_
#undef STRIPER_STRIPE_PROFILE_FILTER_INL_
#else
#define STRIPER_STRIPE_PROFILE_FILTER_INL_
#endif

#include <cstddef>
#include <type_traits>

#include "stripe/profile_background-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// ---- Matched filter.

template <typename T>
struct FilterPeak {
  T at;  // Whole pixels from the seed.
  T before, peak, after;
};

// The background that a window has kept, as the filter sees it at successive pixels.
struct FilteredBackground {
  V next, step;

  HWY_INLINE FilteredBackground(const ProfilePlan& plan, const Background& b, int first) {
    const V sum = set(plan.filter_sum);
    step = hn::Mul(sum, b.left_slope);
    next = hn::MulAdd(set(static_cast<float>(first)), step, hn::Mul(sum, b.left_level));
  }

  HWY_INLINE V take_off(V response) {
    const V without = hn::Sub(response, next);
    next = hn::Add(next, step);
    return without;
  }
};

// The filter's response at a pixel. Of common lengths the taps stay in registers.
template <int kTaps>
struct Filter {
  V tap[kTaps + 1];

  explicit HWY_INLINE Filter(const ProfilePlan& plan) {
    for (int i = 0; i <= kTaps; ++i) tap[i] = set(plan.filter[static_cast<std::size_t>(i)]);
  }

  HWY_INLINE V at(const float* centre) const {
    const Tag d;
    const int n = lanes();
    V even = hn::Mul(tap[0], hn::Load(d, centre));
    V odd = hn::Mul(tap[1], hn::Load(d, centre + n));
    even = hn::MulAdd(tap[1], hn::Load(d, centre - n), even);
    for (int i = 2; i <= kTaps; ++i) {
      even = hn::MulAdd(tap[i], hn::Load(d, centre - i * n), even);
      odd = hn::MulAdd(tap[i], hn::Load(d, centre + i * n), odd);
    }
    return hn::Add(even, odd);
  }
};

struct LongFilter {
  const ProfilePlan& plan;

  HWY_INLINE V at(const float* centre) const {
    const Tag d;
    const int n = lanes();
    V even = hn::Mul(set(plan.filter[0]), hn::Load(d, centre));
    V odd = hn::Zero(d);
    for (int i = 1; i <= plan.taps; ++i) {
      const V tap = set(plan.filter[static_cast<std::size_t>(i)]);
      even = hn::MulAdd(tap, hn::Load(d, centre - i * n), even);
      odd = hn::MulAdd(tap, hn::Load(d, centre + i * n), odd);
    }
    return hn::Add(even, odd);
  }
};

// `any_reach` is plan.reach, perhaps known when this is compiled.
template <typename AnyFilter, typename Reach>
HWY_INLINE FilterPeak<V> find_peak_of(const AnyFilter& filter, Reach any_reach,
                                      const ProfilePlan& plan, const Background& b,
                                      const Window& w) {
  const int n = lanes();
  const int reach = any_reach;
  const float* next = w.value + (plan.window - reach - 1) * n;
  FilteredBackground background(plan, b, -reach - 1);
  V before = background.take_off(filter.at(next));
  V here = background.take_off(filter.at(next + n));
  next += 2 * n;
  V at = set(static_cast<float>(-reach));
  FilterPeak<V> best{hn::Zero(Tag()), before, set(-1e30F), here};
  for (int i = -reach; i <= reach; ++i, next += n) {
    const V after = background.take_off(filter.at(next));
    const M higher = hn::Gt(here, best.peak);
    best.at = hn::IfThenElse(higher, at, best.at);
    best.before = hn::IfThenElse(higher, before, best.before);
    best.after = hn::IfThenElse(higher, after, best.after);
    best.peak = hn::IfThenElse(higher, here, best.peak);
    before = here;
    here = after;
    at = hn::Add(at, set(1.0F));
  }
  return best;
}

// The reach of stripes up to a sigma of 1.6 pixels is known when this is compiled: without a loop
// every row is loaded once for all of the filter's places.
template <int kTaps>
HWY_INLINE FilterPeak<V> find_peak_of(const ProfilePlan& plan, const Background& b,
                                      const Window& w) {
  using CommonReach = std::integral_constant<int, 3>;
  const Filter<kTaps> filter(plan);
  if (plan.reach == CommonReach()) return find_peak_of(filter, CommonReach(), plan, b, w);
  return find_peak_of(filter, plan.reach, plan, b, w);
}

FilterPeak<V> find_filter_peak(const ProfilePlan& plan, const Background& b, const Window& w) {
  switch (plan.taps) {
    case 3:
      return find_peak_of<3>(plan, b, w);
    case 4:
      return find_peak_of<4>(plan, b, w);
    case 5:
      return find_peak_of<5>(plan, b, w);
    case 6:
      return find_peak_of<6>(plan, b, w);
    case 7:
      return find_peak_of<7>(plan, b, w);
    default:
      return find_peak_of(LongFilter{plan}, plan.reach, plan, b, w);
  }
}

HWY_NOINLINE ExtraVariance extra_at_peak(const ProfilePlan& plan, const Window& w, V at) {
  const Tag d;
  const IntTag di;
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

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_FILTER_INL_
