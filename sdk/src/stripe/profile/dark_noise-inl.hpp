// SPDX-License-Identifier: Apache-2.0
// The shot noise of light that stands under a peak in `lit` and in `dark`: a marking, a light
// source, a bright edge. Compiled for every instruction set: see hwy/foreach_target.h for the
// unusual include guard.
#if defined(STRIPER_STRIPE_DARK_NOISE_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_DARK_NOISE_INL_
#undef STRIPER_STRIPE_DARK_NOISE_INL_
#else
#define STRIPER_STRIPE_DARK_NOISE_INL_
#endif

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "stripe/profile/profile_window-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// The dark image around whole pixels, each pixel weighted as its noise is in the filter's answer.
template <typename Pixel>
HWY_INLINE V dark_under_filter(const ProfilePlan& plan, const ProfileImages& images,
                               const Places& peaks) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * plan.noise_reach + 1;
  HWY_ALIGN Pixel copy[(2 * ProfilePlan::kMostTaps + 1) * kMostLanes];
  const auto dark = image_of<Pixel>(images.dark, images.dark_steps, images.length);
  copy_lanes(dark, peaks, plan.noise_reach, n, PixelRows<Pixel>{copy, n});
  const hn::Rebind<Pixel, Tag> dp;
  V sum = hn::Zero(d);
  for (int k = 0; k < rows; ++k) {
    const auto tap = static_cast<std::size_t>(std::abs(k - plan.noise_reach));
    const V pixels = hn::ConvertTo(d, hn::PromoteTo(IntTag(), hn::Load(dp, copy + k * n)));
    sum = hn::MulAdd(set(plan.noise_weight[tap]), pixels, sum);
  }
  return sum;
}

// By how much the noise of `lit - dark` under the filter's peak is more than that of the window's
// mean: where the dark image is plainly brighter there, not where its own noise makes it so.
HWY_NOINLINE V excess_shot_noise(const ProfilePlan& plan, const ProfileImages& images,
                                 const Window& w, const Places& peaks) {
  const Tag d;
  const V under = images.is_16_bit ? dark_under_filter<std::uint16_t>(plan, images, peaks)
                                   : dark_under_filter<std::uint8_t>(plan, images, peaks);
  const V mean = hn::Load(d, w.dark);
  const V per_dn = set(plan.variance_per_dn);
  const V light = hn::Max(hn::Sub(mean, set(plan.black_dn)), hn::Zero(d));
  const V variance = hn::MulAdd(per_dn, light, set(plan.variance_floor));
  const V own_sigma = hn::Mul(root(variance), set(plan.noise_of_weights));
  const V brighter = hn::Max(hn::Sub(hn::Sub(under, mean), own_sigma), hn::Zero(d));
  return hn::Mul(hn::Mul(per_dn, set(1.0F + plan.dark_noise_gain)), brighter);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_DARK_NOISE_INL_
