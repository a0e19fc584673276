// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time. A lane of a vector is a seed: as many profiles are measured at once as a vector has floats.
#include "stripe/profile_kernel.hpp"

#include <algorithm>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/profile_kernel.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
#include "stripe/gauss_newton-inl.hpp"
#include "stripe/profile_filter-inl.hpp"
#include "stripe/profile_window-inl.hpp"
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostMoves = 5;

// Where a batch's profiles are.
struct Located {
  Background background;
  FilterPeak peak;
};

// As many profiles as a vector has lanes, and what is known of them, stage by stage.
struct Batch {
  Window w;
  Located located;
  Noise noise;
  ExtraVariance extra;
  V width;  // Expected.
  V clipped;
  Estimate estimate;
};

// Loads the window around the lanes' centres, without its background.
Background load_without_background(const ProfileImages& images, const ProfilePlan& plan,
                                   Window& w) {
  const Centres centres = look_at_centres(w, plan.window, images.length);
  Background b;
  const bool may_be_plain =
      centres.are_inside && images.blind == nullptr && images.variance == nullptr;
  if (may_be_plain && with_plain_reader(images, centres, plan.window, w, [&](const auto& pixels) {
        return read_plain(plan, pixels, images.full_scale_dn, w, b);
      })) {
    return b;
  }
  load(images, centres, plan.window, w);
  b = fit_ring(plan, w);
  remove_background(plan, b, w);
  return b;
}

// Finds the filter's peak near the seeds, moving those where it lies too far off.
Located locate(const ProfileImages& images, const ProfilePlan& plan, Window& w) {
  const Tag d;
  const IntTag di;
  for (int move = 0;; ++move) {
    const Background background = load_without_background(images, plan, w);
    const Located located{background, find_filter_peak(plan, w)};
    const M strays = hn::Gt(hn::Abs(located.peak.at), set(static_cast<float>(plan.stray)));
    if (move == kMostMoves || hn::AllFalse(d, strays)) return located;
    // Only those that have to move, so that a profile's answer does not depend on its neighbours.
    const V move_by = hn::IfThenElseZero(strays, located.peak.at);
    const auto moved = hn::Add(hn::Load(di, w.across), hn::ConvertTo(di, move_by));
    const auto last = hn::Set(di, images.length - 1);
    hn::Store(hn::Min(hn::Max(moved, hn::Zero(di)), last), di, w.across);
  }
}

V count_clipped(const ProfilePlan& plan, const Window& w) {
  const Tag d;
  const int n = lanes();
  V sum = hn::Zero(d);
  if (w.is_plain) return sum;
  for (int k = plan.window - plan.core; k <= plan.window + plan.core; ++k) {
    sum = hn::Add(sum, hn::Sub(hn::Load(d, w.seen + k * n), hn::Load(d, w.usable + k * n)));
  }
  return sum;
}

void estimate(const ProfileImages& images, const ProfilePlan& plan, Batch& b) {
  const Tag d;
  const Background& background = b.located.background;
  const FilterPeak& peak = b.located.peak;
  b.noise = noise_of(plan, images, background, b.w);
  const V across = hn::Add(hn::ConvertTo(d, hn::Load(IntTag(), b.w.across)), peak.at);
  b.width = width_at(plan, across);
  b.clipped = count_clipped(plan, b.w);
  b.extra = {hn::Zero(d), hn::Zero(d)};
  if (images.variance != nullptr) b.extra = extra_at_peak(plan, b.w, peak.at);
  Estimate& e = b.estimate;
  e = estimate_from_filter(plan, peak, b.width);
  if (!plan.refine) {
    e.sigma = filter_sigma(plan, b.noise.with(b.extra), background, b.width, e.amplitude);
  } else if (b.w.is_plain) {
    refine<true>(plan, b.w, background, b.noise, b.extra, b.width, b.clipped, b.clipped, e);
  } else {
    const V ceiling = ceiling_of(images, background, b.noise, b.w);
    refine<false>(plan, b.w, background, b.noise, b.extra, b.width, b.clipped, ceiling, e);
  }
}

void store(const ProfilePlan& plan, const Batch& b, int first, const PeakMeasurements& out) {
  const Tag d;
  const IntTag di;
  const FilterPeak& peak = b.located.peak;
  const Estimate& e = b.estimate;
  hn::StoreU(hn::Add(hn::Load(di, b.w.across), hn::ConvertTo(di, peak.at)), di, out.across + first);
  hn::StoreU(hn::Sub(e.position, peak.at), d, out.offset + first);
  hn::StoreU(e.amplitude, d, out.amplitude + first);
  hn::StoreU(b.clipped, d, out.clipped + first);
  const M is_clipped = hn::Gt(b.clipped, hn::Zero(d));
  const V locking =
      hn::IfThenElse(is_clipped, set(plan.clipped_locking_variance), set(plan.locking_variance));
  hn::StoreU(root(hn::MulAdd(e.sigma, e.sigma, locking)), d, out.sigma + first);
  const V width = width_from_filter(plan, peak, b.noise);
  hn::StoreU(hn::IfThenElse(is_clipped, b.width, width), d, out.width + first);
  const V significance = significance_of(plan, peak, b.located.background, b.noise, b.extra);
  hn::StoreU(significance, d, out.significance + first);
  const V at_peak = b.noise.with(b.extra).variance(hn::Max(e.amplitude, hn::Zero(d)));
  hn::StoreU(hn::Mul(e.amplitude, inverse_root(at_peak)), d, out.snr + first);
}

void set_seeds(const PeakSeed* seeds, int first, int count, Window& w) {
  const int n = lanes();
  for (int lane = 0; lane < n; ++lane) {
    const PeakSeed& seed = seeds[std::min(first + lane, count - 1)];
    w.line[lane] = seed.line;
    w.across[lane] = seed.across;
  }
}

void measure(const ProfileImages& images, const ProfilePlan& plan, const PeakSeed* seeds, int count,
             const PeakMeasurements& out) {
  Batch batch;
  for (int first = 0; first < count; first += lanes()) {
    set_seeds(seeds, first, count, batch.w);
    batch.located = locate(images, plan, batch.w);
    estimate(images, plan, batch);
    store(plan, batch, first, out);
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
