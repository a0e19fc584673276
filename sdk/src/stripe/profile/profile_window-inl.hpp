// SPDX-License-Identifier: Apache-2.0
// The windows of a batch of peaks as numbers, and what is known of each pixel. Compiled for every
// instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_WINDOW_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_WINDOW_INL_
#undef STRIPER_STRIPE_PROFILE_WINDOW_INL_
#else
#define STRIPER_STRIPE_PROFILE_WINDOW_INL_
#endif

#include <cstddef>
#include <cstdint>

#include "stripe/profile/profile_pixels-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

// Row k, then lane. Rows count from `half` pixels before the lane's centre.
struct Window {
  HWY_ALIGN float value[kMostRows * kMostLanes];  // lit - dark; the background is subtracted later.
  HWY_ALIGN float dark[kMostLanes];               // Mean of the dark image.

  // Whether every pixel is inside the image, seen and below full scale, and nothing is known of
  // its variance. Otherwise, and only then, there is this:
  bool is_plain = false;
  HWY_ALIGN float seen[kMostRows * kMostLanes];    // 1 where inside the image and not masked.
  HWY_ALIGN float usable[kMostRows * kMostLanes];  // 1 where also not clipped.
  HWY_ALIGN float extra[kMostRows * kMostLanes];   // Variance beyond noise.
  bool has_extra = false;
};

// ---- What is known of each pixel.

template <typename Rows>
void mark_clipped(const Rows& lit, int rows, V full_scale, Window& w) {
  const Tag d;
  const int n = lanes();
  for (int k = 0; k < rows; ++k) {
    hn::Store(set(1.0F), d, w.seen + k * n);
    hn::Store(hn::IfThenElseZero(hn::Lt(lit.at(k), full_scale), set(1.0F)), d, w.usable + k * n);
  }
}

HWY_INLINE bool is_seen(const ProfileImages& images, int line, int across) {
  if (across < 0 || across >= images.length) return false;
  if (images.masked == nullptr) return true;
  const ProfileImages::Steps& steps = images.masked_steps;
  return images.masked[line * steps.line + across * steps.across] == 0;
}

HWY_NOINLINE void mark_unseen(const ProfileImages& images, const Places& places, int half,
                              Window& w) {
  const int n = lanes();
  for (int lane = 0; lane < n; ++lane) {
    for (int k = 0; k <= 2 * half; ++k) {
      if (is_seen(images, places.line[lane], places.across[lane] - half + k)) continue;
      w.seen[k * n + lane] = 0.0F;
      w.usable[k * n + lane] = 0.0F;
    }
  }
}

// ---- Loading.

template <typename Rows>
void subtract_dark(const Rows& dark, int rows, Window& w) {
  const Tag d;
  const int n = lanes();
  V sum = hn::Zero(d);
  for (int k = 0; k < rows; ++k) {
    const V value = dark.at(k);
    sum = hn::Add(sum, value);
    hn::Store(hn::Sub(hn::Load(d, w.value + k * n), value), d, w.value + k * n);
  }
  hn::Store(hn::Mul(sum, set(1.0F / static_cast<float>(rows))), d, w.dark);
}

template <typename Pixel>
void load_pixels(const ProfileImages& images, const BatchPixels& pixels, int half, Window& w) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * half + 1;
  const Rows<Pixel> lit = pixels.rows_of<Pixel>(pixels.group.lit);
  for (int k = 0; k < rows; ++k) hn::Store(lit.at(k), d, w.value + k * n);
  mark_clipped(lit, rows, set(static_cast<float>(images.full_scale_dn)), w);
  hn::Store(hn::Zero(d), d, w.dark);
  if (images.dark != nullptr) subtract_dark(pixels.rows_of<Pixel>(pixels.group.dark), rows, w);
}

// Fills the window around the lanes' centres, whatever there is.
HWY_NOINLINE void load(const ProfileImages& images, const BatchPixels& pixels, const Places& places,
                       bool are_inside, int half, Window& w) {
  if (images.is_16_bit) {
    load_pixels<std::uint16_t>(images, pixels, half, w);
  } else {
    load_pixels<std::uint8_t>(images, pixels, half, w);
  }
  w.is_plain = false;
  if (!are_inside || images.masked != nullptr) mark_unseen(images, places, half, w);
  w.has_extra = images.variance != nullptr;
  if (!w.has_extra) return;
  const auto variance = image_of<float>(images.variance, images.variance_steps, images.length);
  copy_lanes(variance, places, half, lanes(), PixelRows<float>{w.extra, lanes()});
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_WINDOW_INL_
