// SPDX-License-Identifier: Apache-2.0
// The pixels around a batch of peaks, turned so that a peak is a lane. Compiled for every
// instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_WINDOW_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_WINDOW_INL_
#undef STRIPER_STRIPE_PROFILE_WINDOW_INL_
#else
#define STRIPER_STRIPE_PROFILE_WINDOW_INL_
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/lanes-inl.hpp"
#include "stripe/profile_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostLanes = PeakMeasurements::kLanesAtMost;
constexpr int kMostRows = 2 * ProfilePlan::kLargestWindow + 1;

// Row k, then lane. Rows count from `half` pixels before the lane's centre.
struct Window {
  HWY_ALIGN float value[kMostRows * kMostLanes];  // lit - dark; the background is taken off later.
  HWY_ALIGN float dark[kMostLanes];               // Mean of the dark image.
  HWY_ALIGN std::int32_t line[kMostLanes];
  HWY_ALIGN std::int32_t across[kMostLanes];  // Centres.

  // Whether every pixel is inside the image, seen and below full scale, and nothing is known of
  // its variance. Otherwise, and only then, there is this:
  bool is_plain = false;
  HWY_ALIGN float seen[kMostRows * kMostLanes];    // 1 where inside the image and not blind.
  HWY_ALIGN float usable[kMostRows * kMostLanes];  // 1 where also not clipped.
  HWY_ALIGN float extra[kMostRows * kMostLanes];   // Variance beyond noise.
  bool has_extra = false;
};

// Where the centres are, for all lanes together.
struct Centres {
  bool are_inside;  // All of their windows.
  bool are_a_run;   // Neighbouring columns, all at the same row.
};

Centres look_at_centres(const Window& w, int half, int length) {
  const IntTag di;
  const auto across = hn::Load(di, w.across);
  const auto run = hn::Add(hn::Set(di, w.line[0]), hn::Iota(di, 0));
  const auto last = hn::Set(di, length - half);
  return {hn::AllTrue(di, hn::And(hn::Gt(across, hn::Set(di, half - 1)), hn::Lt(across, last))),
          hn::AllTrue(di, hn::And(hn::Eq(across, hn::Set(di, w.across[0])),
                                  hn::Eq(hn::Load(di, w.line), run)))};
}

// ---- Copies of pixels. `n` lanes to a row of `out`.

template <typename Pixel>
HWY_INLINE void copy_lane(const Pixel* first, std::ptrdiff_t step, int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) out[k * n] = first[k * step];
}

// Pixels outside of the image repeat the border; `seen` knows them.
template <typename Pixel>
HWY_NOINLINE void copy_lane_at_border(const Pixel* line, std::ptrdiff_t step, int first, int length,
                                      int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) out[k * n] = line[std::clamp(first + k, 0, length - 1) * step];
}

HWY_INLINE bool is_group(const Window& w, int lane, int half, int length) {
  bool same = w.across[lane] >= half && w.across[lane] + half < length;
  for (int i = 1; i < kSeedGroup; ++i) {
    same &= w.across[lane + i] == w.across[lane] && w.line[lane + i] == w.line[lane] + i;
  }
  return same;
}

template <typename Pixel>
HWY_INLINE void copy_group(const Pixel* first, std::ptrdiff_t step, int rows, int n, Pixel* out) {
  for (int k = 0; k < rows; ++k) {
    hwy::CopyBytes<kSeedGroup * sizeof(Pixel)>(first + k * step, out + k * n);
  }
}

template <typename Pixel>
HWY_NOINLINE void copy_window(const Pixel* image, const ProfileImages::Steps& steps, int length,
                              const Window& w, int half, int n, Pixel* out) {
  const int rows = 2 * half + 1;
  for (int lane = 0; lane < n; ++lane) {
    const Pixel* const line = image + w.line[lane] * steps.line;
    const int first = w.across[lane] - half;
    if (steps.line == 1 && lane + kSeedGroup <= n && is_group(w, lane, half, length)) {
      copy_group(line + first * steps.across, steps.across, rows, n, out + lane);
      lane += kSeedGroup - 1;
    } else if (first >= 0 && first + rows <= length) {
      copy_lane(line + first * steps.across, steps.across, rows, n, out + lane);
    } else {
      copy_lane_at_border(line, steps.across, first, length, rows, n, out + lane);
    }
  }
}

// A window's rows of pixels: in the image itself where they lie side by side, else copied.
template <typename Pixel>
struct Rows {
  const Pixel* first;
  std::ptrdiff_t step;

  HWY_INLINE V at(int k) const {
    const hn::Rebind<Pixel, Tag> dp;
    return hn::ConvertTo(Tag(), hn::PromoteTo(IntTag(), hn::LoadU(dp, first + k * step)));
  }
};

template <typename Pixel>
HWY_INLINE Rows<Pixel> rows_of(const void* pixels, const ProfileImages::Steps& steps, int length,
                               const Window& w, const Centres& centres, int half, Pixel* copy) {
  const auto* const image = static_cast<const Pixel*>(pixels);
  if (steps.line == 1 && centres.are_inside && centres.are_a_run) {
    return {image + w.line[0] + (w.across[0] - half) * steps.across, steps.across};
  }
  copy_window(image, steps, length, w, half, lanes(), copy);
  return {copy, lanes()};
}

// ---- What is known of each pixel.

template <typename Pixel>
void mark_clipped(const Rows<Pixel>& lit, int rows, V full_scale, Window& w) {
  const Tag d;
  const int n = lanes();
  for (int k = 0; k < rows; ++k) {
    hn::Store(set(1.0F), d, w.seen + k * n);
    hn::Store(hn::IfThenElseZero(hn::Lt(lit.at(k), full_scale), set(1.0F)), d, w.usable + k * n);
  }
}

HWY_INLINE bool is_seen(const ProfileImages& images, int line, int across) {
  if (across < 0 || across >= images.length) return false;
  if (images.blind == nullptr) return true;
  const ProfileImages::Steps& steps = images.blind_steps;
  return images.blind[line * steps.line + across * steps.across] == 0;
}

HWY_NOINLINE void mark_unseen(const ProfileImages& images, int half, Window& w) {
  const int n = lanes();
  for (int lane = 0; lane < n; ++lane) {
    for (int k = 0; k <= 2 * half; ++k) {
      if (is_seen(images, w.line[lane], w.across[lane] - half + k)) continue;
      w.seen[k * n + lane] = 0.0F;
      w.usable[k * n + lane] = 0.0F;
    }
  }
}

// ---- Loading.

template <typename Pixel>
void take_off_dark(const Rows<Pixel>& dark, int rows, Window& w) {
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
void load_pixels(const ProfileImages& images, const Centres& centres, int half, Window& w) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * half + 1;
  HWY_ALIGN Pixel copy[kMostRows * kMostLanes];
  const Rows<Pixel> lit =
      rows_of(images.lit, images.lit_steps, images.length, w, centres, half, copy);
  for (int k = 0; k < rows; ++k) hn::Store(lit.at(k), d, w.value + k * n);
  mark_clipped(lit, rows, set(static_cast<float>(images.full_scale_dn)), w);
  hn::Store(hn::Zero(d), d, w.dark);
  if (images.dark == nullptr) return;
  take_off_dark(rows_of(images.dark, images.dark_steps, images.length, w, centres, half, copy),
                rows, w);
}

// Fills the window around the lanes' centres, whatever there is.
HWY_NOINLINE void load(const ProfileImages& images, const Centres& centres, int half, Window& w) {
  if (images.is_16_bit) {
    load_pixels<std::uint16_t>(images, centres, half, w);
  } else {
    load_pixels<std::uint8_t>(images, centres, half, w);
  }
  w.is_plain = false;
  if (!centres.are_inside || images.blind != nullptr) mark_unseen(images, half, w);
  w.has_extra = images.variance != nullptr;
  if (!w.has_extra) return;
  copy_window(images.variance, images.variance_steps, images.length, w, half, lanes(), w.extra);
}

// Reads a batch that is inside the image row by row, and remembers what matters of the whole.
template <typename PixelT, bool kHasDark>
struct PlainReader {
  using Pixel = PixelT;

  Rows<Pixel> lit;
  Rows<Pixel> dark;
  V highest;  // Pixel of the lit image.
  V dark_sum;

  HWY_INLINE V row(int k) {
    const V value = lit.at(k);
    highest = hn::Max(highest, value);
    if constexpr (!kHasDark) return value;
    const V taken_off = dark.at(k);
    dark_sum = hn::Add(dark_sum, taken_off);
    return hn::Sub(value, taken_off);
  }
};

template <typename Pixel, bool kHasDark, typename Visitor>
HWY_INLINE bool visit_plain(const ProfileImages& images, const Centres& centres, int half,
                            const Window& w, const Visitor& visit) {
  HWY_ALIGN Pixel lit_copy[kMostRows * kMostLanes];
  HWY_ALIGN Pixel dark_copy[kHasDark ? kMostRows * kMostLanes : 1];
  const Rows<Pixel> lit =
      rows_of(images.lit, images.lit_steps, images.length, w, centres, half, lit_copy);
  Rows<Pixel> dark = lit;
  if constexpr (kHasDark) {
    dark = rows_of(images.dark, images.dark_steps, images.length, w, centres, half, dark_copy);
  }
  return visit(PlainReader<Pixel, kHasDark>{lit, dark, hn::Zero(Tag()), hn::Zero(Tag())});
}

// Hands a reader of the batch to `visit` and returns what that returns.
template <typename Visitor>
HWY_INLINE bool with_plain_reader(const ProfileImages& images, const Centres& centres, int half,
                                  const Window& w, const Visitor& visit) {
  if (images.is_16_bit) {
    return images.dark == nullptr
               ? visit_plain<std::uint16_t, false>(images, centres, half, w, visit)
               : visit_plain<std::uint16_t, true>(images, centres, half, w, visit);
  }
  return images.dark == nullptr ? visit_plain<std::uint8_t, false>(images, centres, half, w, visit)
                                : visit_plain<std::uint8_t, true>(images, centres, half, w, visit);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_WINDOW_INL_
