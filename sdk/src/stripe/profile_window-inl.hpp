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
#include <type_traits>

#include "stripe/lanes-inl.hpp"
#include "stripe/profile_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostLanes = 16;
static_assert(hn::MaxLanes(Tag()) <= kMostLanes);
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
  static constexpr int kMostLevels = 8;

  bool are_inside;  // All of their windows.
  // Of neighbouring lines, whose pixels lie side by side: the rows that they are centred on, from
  // the first one, `level_step` apart. None where they are no neighbours, or the rows too many.
  int levels;
  int first_level;
  int level_step;
};

Centres look_at_centres(const Window& w, bool are_side_by_side, int half, int aligned, int length) {
  const IntTag di;
  const auto across = hn::Load(di, w.across);
  const int lowest = hn::GetLane(hn::MinOfLanes(di, across));
  const int highest = hn::GetLane(hn::MaxOfLanes(di, across));
  const auto run = hn::Add(hn::Set(di, w.line[0]), hn::Iota(di, 0));
  const int step = 2 * aligned + 1;
  Centres centres{lowest >= half && highest + half < length, 0, lowest, step};
  if (are_side_by_side && centres.are_inside && highest - lowest < Centres::kMostLevels * step &&
      hn::AllTrue(di, hn::Eq(hn::Load(di, w.line), run))) {
    centres.levels = 1 + (highest - lowest) / step;  // All are a multiple of it apart.
  }
  return centres;
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

#if HWY_TARGET == HWY_SCALAR

template <typename Pixel>
bool turn_window(const Pixel* /*image*/, const ProfileImages::Steps& /*steps*/, const Window& /*w*/,
                 int /*half*/, Pixel* /*out*/) {
  return false;  // A single lane needs no turning.
}

#else

// Of windows inside the image, whose pixels follow one another: a block of 128 bits of each lane at
// a time. To interleave the first half of it all with the second, once for every doubling of the
// lanes, turns rows and lanes. Returns false where there is no such block.
template <typename Pixel>
HWY_NOINLINE bool turn_window(const Pixel* image, const ProfileImages::Steps& steps,
                              const Window& w, int half, Pixel* out) {
  const hn::Full128<Pixel> d;
  constexpr int kAtOnce = static_cast<int>(16 / sizeof(Pixel));
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  const int last = 2 * half + 1 - kAtOnce;
  if (steps.across != 1 || last < 0) return false;
  for (int k = 0;; k = std::min(k + kAtOnce, last)) {
    hn::Vec<decltype(d)> v[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      v[lane] = hn::LoadU(d, image + w.line[lane] * steps.line + w.across[lane] - half + k);
    }
    for (int turned = 1; turned < kLanes; turned *= 2) {
      hn::Vec<decltype(d)> next[kLanes];
      for (int i = 0; i < kLanes / 2; ++i) {
        next[2 * i] = hn::InterleaveLower(d, v[i], v[i + kLanes / 2]);
        next[2 * i + 1] = hn::InterleaveUpper(d, v[i], v[i + kLanes / 2]);
      }
      for (int i = 0; i < kLanes; ++i) v[i] = next[i];
    }
    for (int i = 0; i < kLanes; ++i) hn::StoreU(v[i], d, out + k * kLanes + i * kAtOnce);
    if (k == last) return true;
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

template <typename Pixel>
HWY_NOINLINE void copy_window(const Pixel* image, const ProfileImages::Steps& steps, int length,
                              const Window& w, int half, int n, Pixel* out) {
  const int rows = 2 * half + 1;
  for (int lane = 0; lane < n; ++lane) {
    const Pixel* const line = image + w.line[lane] * steps.line;
    const int first = w.across[lane] - half;
    if (first >= 0 && first + rows <= length) {
      copy_lane(line + first * steps.across, steps.across, rows, n, out + lane);
    } else {
      copy_lane_at_border(line, steps.across, first, length, rows, n, out + lane);
    }
  }
}

// A window's rows of pixels. Where neighbouring columns are centred on few rows they are read from
// the image itself, each row from so many places at once; else they are copied.
template <typename Pixel, int kLevels>
struct Rows {
  using PixelTag = hn::Rebind<Pixel, Tag>;

  std::ptrdiff_t step;
  const Pixel* first[kLevels];
  hn::Mask<PixelTag> lanes_of[kLevels];  // Of all but the first one.

  // `offset` is k * step.
  HWY_INLINE hn::Vec<PixelTag> pixels_from(std::ptrdiff_t offset) const {
    const PixelTag dp;
    auto pixels = hn::LoadU(dp, first[0] + offset);
    for (int i = 1; i < kLevels; ++i) {
      pixels = hn::IfThenElse(lanes_of[i], hn::LoadU(dp, first[i] + offset), pixels);
    }
    return pixels;
  }
  static HWY_INLINE V to_float(hn::Vec<PixelTag> pixels) {
    return hn::ConvertTo(Tag(), hn::PromoteTo(IntTag(), pixels));
  }
  HWY_INLINE V from(std::ptrdiff_t offset) const { return to_float(pixels_from(offset)); }
  HWY_INLINE V at(int k) const { return from(k * step); }
};

template <int kLevels, typename Pixel>
HWY_INLINE Rows<Pixel, kLevels> rows_of(const void* pixels, const ProfileImages::Steps& steps,
                                        int length, const Window& w, const Centres& centres,
                                        int half, Pixel* copy) {
  const auto* const image = static_cast<const Pixel*>(pixels);
  Rows<Pixel, kLevels> rows;
  if (centres.levels == 0) {
    const bool is_turned = centres.are_inside && turn_window(image, steps, w, half, copy);
    if (!is_turned) copy_window(image, steps, length, w, half, lanes(), copy);
    rows.step = lanes();
    rows.first[0] = copy;
    return rows;
  }
  rows.step = steps.across;
  const IntTag di;
  const hn::Rebind<Pixel, Tag> dp;
  const auto above_first =
      hn::DemoteTo(dp, hn::Sub(hn::Load(di, w.across), hn::Set(di, centres.first_level)));
  for (int i = 0; i < kLevels; ++i) {
    const int above = std::min(i, centres.levels - 1) * centres.level_step;
    rows.first[i] = image + w.line[0] + (centres.first_level + above - half) * steps.across;
    rows.lanes_of[i] = hn::Eq(above_first, hn::Set(dp, static_cast<Pixel>(above)));
  }
  return rows;
}

// Calls with one of a few numbers of levels that are known when the call is compiled.
template <typename Visitor>
HWY_INLINE auto with_levels(const Centres& centres, const Visitor& visit) {
  // A single lane has but one.
  if constexpr (hn::MaxLanes(Tag()) == 1) {
    return visit(std::integral_constant<int, 1>());
  } else {
    if (centres.levels <= 1) return visit(std::integral_constant<int, 1>());
    if (centres.levels == 2) return visit(std::integral_constant<int, 2>());
    if (centres.levels == 3) return visit(std::integral_constant<int, 3>());
    if (centres.levels == 4) return visit(std::integral_constant<int, 4>());
    if (centres.levels <= 6) return visit(std::integral_constant<int, 6>());
    return visit(std::integral_constant<int, Centres::kMostLevels>());
  }
}

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

template <typename Rows>
void take_off_dark(const Rows& dark, int rows, Window& w) {
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

template <typename Pixel, int kLevels>
void load_pixels(const ProfileImages& images, const Centres& centres, int half, Window& w) {
  const Tag d;
  const int n = lanes();
  const int rows = 2 * half + 1;
  HWY_ALIGN Pixel copy[kMostRows * kMostLanes];
  const auto lit =
      rows_of<kLevels>(images.lit, images.lit_steps, images.length, w, centres, half, copy);
  for (int k = 0; k < rows; ++k) hn::Store(lit.at(k), d, w.value + k * n);
  mark_clipped(lit, rows, set(static_cast<float>(images.full_scale_dn)), w);
  hn::Store(hn::Zero(d), d, w.dark);
  if (images.dark == nullptr) return;
  take_off_dark(
      rows_of<kLevels>(images.dark, images.dark_steps, images.length, w, centres, half, copy), rows,
      w);
}

// Fills the window around the lanes' centres, whatever there is.
HWY_NOINLINE void load(const ProfileImages& images, const Centres& centres, int half, Window& w) {
  with_levels(centres, [&](auto levels) {
    if (images.is_16_bit) {
      load_pixels<std::uint16_t, levels>(images, centres, half, w);
    } else {
      load_pixels<std::uint8_t, levels>(images, centres, half, w);
    }
  });
  w.is_plain = false;
  if (!centres.are_inside || images.blind != nullptr) mark_unseen(images, half, w);
  w.has_extra = images.variance != nullptr;
  if (!w.has_extra) return;
  copy_window(images.variance, images.variance_steps, images.length, w, half, lanes(), w.extra);
}

// Reads a batch that is inside the image row by row, and remembers what matters of the whole.
template <typename PixelRows, bool kHasDark>
struct PlainReader {
  using PixelTag = typename PixelRows::PixelTag;

  PixelRows lit;
  PixelRows dark;
  hn::Vec<PixelTag> highest;  // Of the lit image.
  V dark_sum;

  HWY_INLINE bool is_below(int full_scale_dn) const {
    const PixelTag dp;
    const auto clipped = hn::Set(dp, static_cast<hn::TFromD<PixelTag>>(full_scale_dn));
    return hn::AllFalse(dp, hn::Eq(hn::Max(highest, clipped), highest));
  }

  // A row, found by additions alone.
  struct Place {
    std::ptrdiff_t lit, dark;
  };
  HWY_INLINE Place place_of(int k) const { return {k * lit.step, k * dark.step}; }
  HWY_INLINE V row_then_down(Place& at) {
    const V value = row(at);
    at = {at.lit - lit.step, at.dark - dark.step};
    return value;
  }
  HWY_INLINE V row_then_up(Place& at) {
    const V value = row(at);
    at = {at.lit + lit.step, at.dark + dark.step};
    return value;
  }

 private:
  HWY_INLINE V row(const Place& at) {
    const auto pixels = lit.pixels_from(at.lit);
    highest = hn::Max(highest, pixels);
    const V value = PixelRows::to_float(pixels);
    if constexpr (!kHasDark) return value;
    const V taken_off = dark.from(at.dark);
    dark_sum = hn::Add(dark_sum, taken_off);
    return hn::Sub(value, taken_off);
  }
};

template <typename Pixel, bool kHasDark, int kLevels, typename Visitor>
HWY_INLINE bool visit_plain(const ProfileImages& images, const Centres& centres, int half,
                            const Window& w, const Visitor& visit) {
  HWY_ALIGN Pixel lit_copy[kMostRows * kMostLanes];
  HWY_ALIGN Pixel dark_copy[kHasDark ? kMostRows * kMostLanes : 1];
  const auto lit =
      rows_of<kLevels>(images.lit, images.lit_steps, images.length, w, centres, half, lit_copy);
  auto dark = lit;
  if constexpr (kHasDark) {
    dark = rows_of<kLevels>(images.dark, images.dark_steps, images.length, w, centres, half,
                            dark_copy);
  }
  using Reader = PlainReader<decltype(dark), kHasDark>;
  return visit(Reader{lit, dark, hn::Zero(typename Reader::PixelTag()), hn::Zero(Tag())});
}

// Hands a reader of the batch to `visit` and returns what that returns.
template <typename Visitor>
HWY_INLINE bool with_plain_reader(const ProfileImages& images, const Centres& centres, int half,
                                  const Window& w, const Visitor& visit) {
  return with_levels(centres, [&](auto levels) {
    if (images.is_16_bit) {
      return images.dark == nullptr
                 ? visit_plain<std::uint16_t, false, levels>(images, centres, half, w, visit)
                 : visit_plain<std::uint16_t, true, levels>(images, centres, half, w, visit);
    }
    return images.dark == nullptr
               ? visit_plain<std::uint8_t, false, levels>(images, centres, half, w, visit)
               : visit_plain<std::uint8_t, true, levels>(images, centres, half, w, visit);
  });
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_WINDOW_INL_
