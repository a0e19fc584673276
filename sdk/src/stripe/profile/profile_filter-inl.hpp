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
#include <utility>

#include "stripe/profile/profile_background-inl.hpp"

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

// The background that a window has kept, as the filter sees it.
struct FilteredBackground {
  V level, slope;

  HWY_INLINE FilteredBackground(const ProfilePlan& plan, const Background& b) {
    const V sum = set(plan.filter_sum);
    level = hn::Mul(sum, b.left_level);
    slope = hn::Mul(sum, b.left_slope);
  }

  // What it subtracts from the response at a pixel.
  HWY_INLINE V minus_at(int k) const {
    return hn::NegMulAdd(set(static_cast<float>(k)), slope, hn::Neg(level));
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

HWY_INLINE void take_if_higher(const FilterPeak<V>& candidate, FilterPeak<V>& best) {
  const M higher = hn::Gt(candidate.peak, best.peak);
  best.at = hn::IfThenElse(higher, candidate.at, best.at);
  best.before = hn::IfThenElse(higher, candidate.before, best.before);
  best.after = hn::IfThenElse(higher, candidate.after, best.after);
  best.peak = hn::IfThenElse(higher, candidate.peak, best.peak);
}

template <typename AnyFilter>
HWY_INLINE FilterPeak<V> find_peak_of(const AnyFilter& filter, const ProfilePlan& plan,
                                      const Background& b, const Window& w) {
  const FilteredBackground background(plan, b);
  const auto response = [&](int k) HWY_ATTR {
    return hn::Add(filter.at(w.value + (plan.window + k) * lanes()), background.minus_at(k));
  };
  const auto at = [](int k) HWY_ATTR { return set(static_cast<float>(k)); };
  const int reach = plan.reach;
  V here = response(-reach);
  V after = response(1 - reach);
  FilterPeak<V> best{at(-reach), response(-reach - 1), here, after};
  for (int k = 1 - reach; k <= reach; ++k) {
    const V before = here;
    here = after;
    after = response(k + 1);
    take_if_higher({at(k), before, here, after}, best);
  }
  return best;
}

// The reach of stripes up to a sigma of 1.6 pixels.
constexpr int kCommonReach = 3;

// The responses at all places of the common reach, together: a row is loaded once, and each of its
// products belongs to another sum, so that none waits for the one before.
template <int kTaps>
struct Responses {
  static constexpr int kCount = 2 * kCommonReach + 3;
  V at[kCount];

  HWY_INLINE Responses(const ProfilePlan& plan, const Background& b, const Window& w) {
    const Filter<kTaps> filter(plan);
    const FilteredBackground background(plan, b);
    const float* const first = w.value + (plan.window - kCommonReach - 1 - kTaps) * lanes();
    add(filter, background, first, std::make_integer_sequence<int, kCount>(),
        std::make_integer_sequence<int, kCount + 2 * kTaps>());
  }

 private:
  template <int... kPlaces, int... kRows>
  HWY_INLINE void add(const Filter<kTaps>& filter, const FilteredBackground& background,
                      const float* first, std::integer_sequence<int, kPlaces...> places,
                      std::integer_sequence<int, kRows...> /*rows*/) {
    ((at[kPlaces] = background.minus_at(kPlaces - kCommonReach - 1)), ...);
    (add_row<kRows>(filter, hn::Load(Tag(), first + kRows * lanes()), places), ...);
  }

  template <int kRow, int... kPlaces>
  HWY_INLINE void add_row(const Filter<kTaps>& filter, V value,
                          std::integer_sequence<int, kPlaces...> /*places*/) {
    (add_product<kRow - kTaps - kPlaces, kPlaces>(filter, value), ...);
  }

  template <int kOffset, int kPlace>
  HWY_INLINE void add_product(const Filter<kTaps>& filter, V value) {
    constexpr int kTap = kOffset < 0 ? -kOffset : kOffset;
    if constexpr (kTap <= kTaps) at[kPlace] = hn::MulAdd(filter.tap[kTap], value, at[kPlace]);
  }
};

template <int kTaps>
HWY_INLINE FilterPeak<V> find_near_peak(const ProfilePlan& plan, const Background& b,
                                        const Window& w) {
  const Responses<kTaps> r(plan, b, w);
  FilterPeak<V> best{set(-kCommonReach), r.at[0], r.at[1], r.at[2]};
  const auto look_at = [&]<int kPlace>(std::integral_constant<int, kPlace> /*place*/) HWY_ATTR {
    const V at = set(static_cast<float>(kPlace - kCommonReach - 1));
    take_if_higher({at, r.at[kPlace - 1], r.at[kPlace], r.at[kPlace + 1]}, best);
  };
  [&]<int... kPlaces>(std::integer_sequence<int, kPlaces...> /*places*/) HWY_ATTR {
    (look_at(std::integral_constant<int, kPlaces + 2>()), ...);
  }
  (std::make_integer_sequence<int, Responses<kTaps>::kCount - 3>());
  return best;
}

template <int kTaps>
HWY_INLINE FilterPeak<V> find_peak_of(const ProfilePlan& plan, const Background& b,
                                      const Window& w) {
  if (plan.reach == kCommonReach) return find_near_peak<kTaps>(plan, b, w);
  return find_peak_of(Filter<kTaps>(plan), plan, b, w);
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
      return find_peak_of(LongFilter{plan}, plan, b, w);
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
