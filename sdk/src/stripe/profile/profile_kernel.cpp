// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time. A lane of a vector is a seed: as many profiles are measured at once as a vector has floats.
#include "stripe/profile/profile_kernel.hpp"

#include <algorithm>
#include <cstdlib>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/profile/profile_kernel.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include "stripe/profile/dark_noise-inl.hpp"
#include "stripe/profile/gauss_newton-inl.hpp"
#include "stripe/profile/profile_estimate-inl.hpp"
#include "stripe/profile/profile_filter-inl.hpp"
#include "stripe/profile/profile_pixels-inl.hpp"
#include "stripe/profile/profile_window-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostMoves = 5;

// As many profiles as a vector has lanes, and what is known of them, stage by stage.
struct Batch {
  hn::Vec<IntTag> across;  // Centres of the windows.
  FilterPeak<V> peak;
  Noise noise;
  V extra;                         // Variance of a pixel beyond noise.
  V beyond_pixels;                 // Of the filter's response.
  V level, slope, slope_variance;  // Of the background.
  V width;                         // Expected.
  MissingPixels missing;
  Estimate<V> estimate;  // With `refine`.
};

// The middle of the `2 * aligned + 1` pixels that a pixel is one of: neighbouring columns that
// nearly agree are centred on the same row and can be read side by side.
HWY_INLINE void set_centres(hn::Vec<IntTag> across, const ProfilePlan& plan, int length,
                            const Places& places) {
  const Tag d;
  const IntTag di;
  const int cell = 2 * plan.aligned + 1;
  const V aligned = set(static_cast<float>(plan.aligned));
  const V from_first = hn::Sub(hn::ConvertTo(d, across), aligned);
  const auto number = nearest(hn::Mul(from_first, set(1.0F / static_cast<float>(cell))));
  const auto snapped =
      nearest(hn::MulAdd(hn::ConvertTo(d, number), set(static_cast<float>(cell)), aligned));
  hn::Store(hn::Min(snapped, hn::Set(di, length - 1)), di, places.across);
}

// Where the batches of a group are, and their pixels.
struct GroupWindow {
  HWY_ALIGN std::int32_t line[kTogether * kMostLanes];
  HWY_ALIGN std::int32_t across[kTogether * kMostLanes];  // Centres.
  Centres centres;
  bool are_inside[kTogether];  // Of a batch, all of its windows.
  GroupPixels pixels;

  HWY_INLINE Places places() { return {line, across}; }
};

// Copies the pixels of one batch.
void copy_batch(const ProfileImages& images, const ProfilePlan& plan, int batch, GroupWindow& g) {
  const Places places = g.places().batch(batch);
  look_at_centres(images, plan, places, 1, g.centres);
  g.are_inside[batch] = g.centres.are_inside;
  copy_around(images, plan, {places, g.centres, batch, 1}, g.pixels);
}

// Together where the scan lines are neighbours, and not much apart across.
void copy_batches(const ProfileImages& images, const ProfilePlan& plan, int batches,
                  GroupWindow& g) {
  if (batches == kTogether) {
    look_at_centres(images, plan, g.places(), kTogether, g.centres);
    if (g.centres.levels > 0) {
      for (bool& is_inside : g.are_inside) is_inside = true;
      copy_around(images, plan, {g.places(), g.centres, 0, kTogether}, g.pixels);
      return;
    }
  }
  for (int batch = 0; batch < batches; ++batch) copy_batch(images, plan, batch, g);
}

// Loads the window of a batch and finds its background.
void load_with_background(const ProfileImages& images, const ProfilePlan& plan, int batch,
                          GroupWindow& g, Window& w, Background& background) {
  const BatchPixels pixels{g.pixels, batch};
  const bool is_inside = g.are_inside[batch];
  if (is_inside && images.masked == nullptr && images.variance == nullptr) {
    const bool is_plain = images.is_16_bit
                              ? read_if_plain<std::uint16_t>(images, plan, pixels, w, background)
                              : read_if_plain<std::uint8_t>(images, plan, pixels, w, background);
    if (is_plain) return;
  }
  load(images, pixels, g.places().batch(batch), is_inside, plan.window, w);
  fit_ring(plan, w, background);
  remove_background(plan, background, w);
}

// Finds the filter's peak near the seeds, moving those where it lies too far off.
Background locate(const ProfileImages& images, const ProfilePlan& plan, int batch, GroupWindow& g,
                  Window& w, Batch& b) {
  const Tag d;
  const IntTag di;
  const Places places = g.places().batch(batch);
  Background background;
  for (int move = 0;; ++move) {
    load_with_background(images, plan, batch, g, w, background);
    b.peak = find_filter_peak(plan, background, w);
    const M strays = hn::Gt(hn::Abs(b.peak.at), set(static_cast<float>(plan.stray)));
    if (move == kMostMoves || hn::AllFalse(d, strays)) break;
    // Only those that have to move, so that a profile's answer does not depend on its neighbours.
    const V move_by = hn::IfThenElseZero(strays, b.peak.at);
    const auto moved = hn::Add(hn::Load(di, places.across), hn::ConvertTo(di, move_by));
    set_centres(hn::Max(moved, hn::Zero(di)), plan, images.length, places);
    copy_batch(images, plan, batch, g);
  }
  b.across = hn::Load(di, places.across);
  return background;
}

// @param peak where the filter has it: of a run that is the stripe's, within it.
MissingPixels find_missing(const ProfilePlan& plan, const Window& w, V peak, V width) {
  constexpr int kBeyondCore = 2;  // A run's ends may be, where a seed is not its middle.
  const Tag d;
  const int n = lanes();
  const V none = hn::Zero(d);
  const M never = hn::Gt(none, none);
  MissingPixels missing{none, never, none, set(1.0F), never};
  if (w.is_plain) return missing;
  const int reach = std::min(plan.window, plan.core + kBeyondCore);
  V seen_pixels = none;
  V number = none;
  V sum_k = none;
  V sum_kk = none;
  for (int k = -reach; k <= reach; ++k) {
    const int at = (plan.window + k) * n;
    const V seen = hn::Load(d, w.seen + at);
    const V is_clipped = hn::Sub(seen, hn::Load(d, w.usable + at));
    const V kv = set(static_cast<float>(k));
    seen_pixels = hn::Add(seen_pixels, seen);
    number = hn::Add(number, is_clipped);
    sum_k = hn::MulAdd(kv, is_clipped, sum_k);
    sum_kk = hn::MulAdd(hn::Mul(kv, kv), is_clipped, sum_kk);
    if (std::abs(k) <= plan.core) missing.clipped = hn::Add(missing.clipped, is_clipped);
  }
  missing.is_cut = hn::Lt(seen_pixels, set(static_cast<float>(2 * reach + 1)));
  missing.run_middle = hn::Mul(sum_k, inverse(hn::Max(number, set(1.0F))));
  missing.run_variance =
      hn::MulAdd(set(kRunVariance_widths2), hn::Mul(width, width), set(kRunVariance_px2));
  // Of so many pixels next to one another, their number^2 (number^2 - 1) / 12.
  const V number2 = hn::Mul(number, number);
  const V spread = hn::MulSub(number, sum_kk, hn::Mul(sum_k, sum_k));
  const V of_a_run = hn::Mul(hn::Mul(number2, hn::Sub(number2, set(1.0F))), set(1.0F / 12.0F));
  const M is_one =
      hn::And(hn::Gt(number, none), hn::Le(hn::Abs(hn::Sub(spread, of_a_run)), set(0.5F)));
  // Both of its ends are seen, and the peak lies between them.
  const V half = hn::Mul(set(0.5F), number);
  const V to_end = hn::Add(hn::Abs(missing.run_middle), half);
  const M has_ends =
      hn::And(hn::Lt(to_end, set(static_cast<float>(reach))), hn::Not(missing.is_cut));
  const V to_peak = hn::Abs(hn::Sub(peak, missing.run_middle));
  const M has_peak = hn::Le(to_peak, hn::Add(half, set(1.0F)));
  missing.is_run = hn::And(is_one, hn::And(has_ends, has_peak));
  return missing;
}

void refine_in_window(const ProfileImages& images, const ProfilePlan& plan, const Window& w,
                      const Background& background, const ExtraVariance& extra, Batch& b) {
  const Expected<V> expected(plan, b.width);
  b.estimate = estimate_from_filter(plan, b.peak, expected);
  Profiles profiles{plan, w, background, b.noise, extra, expected, b.missing, b.missing.clipped};
  if (w.is_plain) {
    refine<true>(profiles, b.estimate);
  } else {
    profiles.ceiling = ceiling_of(images, background, b.noise, w);
    refine<false>(profiles, b.estimate);
  }
}

// All that needs the pixels.
void look(const ProfileImages& images, const ProfilePlan& plan, int batch, GroupWindow& g,
          Window& w, Batch& b) {
  const Tag d;
  const Background background = locate(images, plan, batch, g, w, b);
  b.noise = noise_of(plan, images, background, w);
  if (images.dark != nullptr && plan.variance_per_dn > 0.0F) {
    HWY_ALIGN std::int32_t across[kMostLanes];
    hn::Store(hn::Add(b.across, hn::ConvertTo(IntTag(), b.peak.at)), IntTag(), across);
    const Places peaks{g.places().batch(batch).line, across};
    b.noise.base = hn::Add(b.noise.base, excess_shot_noise(plan, images, w, peaks));
  }
  b.width = width_at(plan, hn::Add(hn::ConvertTo(d, b.across), b.peak.at));
  b.missing = find_missing(plan, w, b.peak.at, b.width);
  ExtraVariance extra{hn::Zero(d), hn::Zero(d)};
  if (images.variance != nullptr) extra = extra_at_peak(plan, w, b.peak.at);
  b.extra = extra.of_pixel;
  b.beyond_pixels = response_variance_of(plan, background, b.noise, extra);
  b.level = background.level;
  b.slope = background.slope;
  b.slope_variance = background.slope_variance;
  if (plan.refine) refine_in_window(images, plan, w, background, extra, b);
}

// What the batches know of one thing.
template <typename T>
HWY_INLINE Together<T> gather(const Batch* b, T Batch::*what) {
  return {{b[0].*what, b[1].*what, b[2].*what, b[3].*what}};
}
template <typename Whole>
HWY_INLINE Group gather(const Batch* b, Whole Batch::*whole, V Whole::*what) {
  return {{b[0].*whole.*what, b[1].*whole.*what, b[2].*whole.*what, b[3].*whole.*what}};
}

template <typename T, typename Element>
HWY_INLINE void store(const Together<T>& group, Element* out) {
  const hn::Rebind<Element, Tag> d;
  hn::StoreU(group.of[0], d, out);
  hn::StoreU(group.of[1], d, out + lanes());
  hn::StoreU(group.of[2], d, out + 2 * lanes());
  hn::StoreU(group.of[3], d, out + 3 * lanes());
}

// All the rest, of a group of batches.
void finish(const ProfilePlan& plan, const Batch* b, int first, const PeakMeasurements& out) {
  const FilterPeak<Group> peak{gather(b, &Batch::peak, &FilterPeak<V>::at),
                               gather(b, &Batch::peak, &FilterPeak<V>::before),
                               gather(b, &Batch::peak, &FilterPeak<V>::peak),
                               gather(b, &Batch::peak, &FilterPeak<V>::after)};
  const Group base = gather(b, &Batch::noise, &Noise::base);
  const Group expected_width = gather(b, &Batch::width);
  const Group clipped = gather(b, &Batch::missing, &MissingPixels::clipped);
  const auto is_clipped = is_above(clipped, set(0.0F));
  store(clipped, out.clipped + first);
  store(gather(b, &Batch::level), out.level + first);
  store(gather(b, &Batch::slope), out.slope + first);
  const Group width = width_from_filter(plan, peak, base);
  store(choose(is_clipped, expected_width, width), out.width + first);
  store(significance_of(plan, peak.peak, base, gather(b, &Batch::beyond_pixels)),
        out.significance + first);
  store(apply([](auto centre, V at) HWY_ATTR { return hn::Add(centre, nearest(at)); },
              gather(b, &Batch::across), peak.at),
        out.across + first);

  const Expected<Group> expected(plan, expected_width);
  const Group pixel_base = add(base, gather(b, &Batch::extra));
  Estimate<Group> e;
  if (plan.refine) {
    e = {gather(b, &Batch::estimate, &Estimate<V>::position),
         gather(b, &Batch::estimate, &Estimate<V>::amplitude),
         gather(b, &Batch::estimate, &Estimate<V>::variance),
         gather(b, &Batch::estimate, &Estimate<V>::per_curvature)};
  } else {
    e = estimate_from_filter(plan, peak, expected);
    e.variance =
        filter_variance(plan, pixel_base, gather(b, &Batch::slope_variance), expected, e.amplitude);
  }
  store(sub(e.position, peak.at), out.offset + first);
  store(e.amplitude, out.amplitude + first);
  const V locking = set(plan.locking_variance);
  const V clipped_locking = set(plan.clipped_locking_variance);
  // Of clipped peaks the filter's is none of the likelihood.
  const Group variance = choose(is_clipped, add(e.variance, clipped_locking),
                                add(observed_variance(e, expected), locking));
  store(rough_root(variance), out.sigma + first);
  const Group signal = max(e.amplitude, set(0.0F));
  const Group at_peak =
      mul_add(signal, mul_add(set(plan.speckle2), signal, set(plan.variance_per_dn)), pixel_base);
  store(mul(e.amplitude, rough_inverse_root(at_peak)), out.snr + first);
}

// The seeds of a batch, from `first` on.
void set_seeds(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds,
               int first, int count, const Places& places) {
  const IntTag di;
  hn::Vec<IntTag> line;
  hn::Vec<IntTag> across;
  if (first + lanes() <= count) {
    static_assert(sizeof(PeakSeed) == 2 * sizeof(std::int32_t));
    hn::LoadInterleaved2(di, &seeds[first].line, line, across);
    hn::Store(line, di, places.line);
  } else {  // The last one again and again.
    for (int lane = 0; lane < lanes(); ++lane) {
      const PeakSeed& seed = seeds[std::min(first + lane, count - 1)];
      places.line[lane] = seed.line;
      places.across[lane] = seed.across;
    }
    across = hn::Load(di, places.across);
  }
  set_centres(across, plan, images.length, places);
}

void measure(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds, int count,
             const PeakMeasurements& out) {
  static_assert(kTogether * kMostLanes <= PeakMeasurements::kMultiple);
  const int n = lanes();
  GroupWindow g;
  Window w;
  Batch batches[kTogether];
  for (int start = 0; start < count; start += lanes_together()) {
    const int used = std::min(kTogether, (count - start + n - 1) / n);
    for (int b = 0; b < used; ++b) {
      set_seeds(images, plan, seeds, start + b * n, count, g.places().batch(b));
    }
    copy_batches(images, plan, used, g);
    for (int b = 0; b < used; ++b) look(images, plan, b, g, w, batches[b]);
    for (int b = used; b < kTogether; ++b) batches[b] = batches[0];  // Written where nobody reads.
    finish(plan, batches, start, out);
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
