// SPDX-License-Identifier: Apache-2.0
// The pixels around the peaks of several batches, turned so that a peak is a lane. Compiled for
// every instruction set: see hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_PROFILE_PIXELS_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_PROFILE_PIXELS_INL_
#undef STRIPER_STRIPE_PROFILE_PIXELS_INL_
#else
#define STRIPER_STRIPE_PROFILE_PIXELS_INL_
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "stripe/profile/lane_group-inl.hpp"
#include "stripe/profile/profile_kernel.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

constexpr int kMostLanes = 16;
static_assert(hn::MaxLanes(Tag()) <= kMostLanes);
constexpr int kMostRows = 2 * ProfilePlan::kLargestWindow + 1;

HWY_INLINE int lanes_together() { return kTogether * lanes(); }

// ---- Where the lanes are.

// Lanes of one batch or more: their lines and centres.
struct Places {
  std::int32_t* line;
  std::int32_t* across;

  HWY_INLINE Places batch(int number) const {
    return {line + number * lanes(), across + number * lanes()};
  }
};

struct Centres {
  static constexpr int kMostLevels = 16;

  bool are_inside = false;  // All of their windows.
  // Of neighbouring lines, whose pixels lie side by side: the lowest row that one is centred on,
  // and of how many rows a cell apart each is centred on one. No such where they are no
  // neighbours, or the rows too many.
  int lowest = 0;
  int levels = 0;
  HWY_ALIGN std::uint8_t level[kTogether * kMostLanes];
};

void look_at_centres(const ProfileImages& images, const ProfilePlan& plan, const Places& places,
                     int batches, Centres& c) {
  const IntTag di;
  const Tag d;
  const int n = lanes();
  const int cell = 2 * plan.aligned + 1;
  auto least = hn::Load(di, places.across);
  auto most = least;
  auto run = hn::Add(hn::Set(di, places.line[0]), hn::Iota(di, 0));
  auto apart = hn::Zero(di);
  for (int b = 0; b < batches; ++b) {
    const auto across = hn::Load(di, places.across + b * n);
    least = hn::Min(least, across);
    most = hn::Max(most, across);
    apart = hn::Or(apart, hn::Xor(hn::Load(di, places.line + b * n), run));
    run = hn::Add(run, hn::Set(di, n));
  }
  c.lowest = hn::GetLane(hn::MinOfLanes(di, least));
  const int highest = hn::GetLane(hn::MaxOfLanes(di, most));
  c.are_inside = c.lowest >= plan.window && highest + plan.window < images.length;
  c.levels = 0;
  if (images.lit_steps.line != 1 || !c.are_inside ||
      highest - c.lowest >= Centres::kMostLevels * cell ||
      !hn::AllTrue(di, hn::Eq(apart, hn::Zero(di)))) {
    return;
  }
  const float per_cell = 1.0F / static_cast<float>(cell);
  const auto level_of = [&](auto across) HWY_ATTR {
    const V above = hn::ConvertTo(d, hn::Sub(across, hn::Set(di, c.lowest)));
    return nearest(hn::Mul(above, set(per_cell)));
  };
  for (int b = 0; b < batches; ++b) {
    const hn::Rebind<std::uint8_t, IntTag> bytes;
    const auto level = level_of(hn::Load(di, places.across + b * n));
    hn::StoreU(hn::DemoteTo(bytes, level), bytes, c.level + b * n);
  }
  c.levels = 1 + static_cast<int>((static_cast<float>(highest - c.lowest) + 0.5F) * per_cell);
}

// ---- Lanes copied one by one, each from wherever it is. `step` elements from row to row of `out`.

template <typename Pixel>
HWY_INLINE void copy_lane(const Pixel* first, std::ptrdiff_t step, int rows,
                          std::ptrdiff_t out_step, Pixel* out) {
  for (int k = 0; k < rows; ++k) out[k * out_step] = first[k * step];
}

// Pixels outside of the image repeat the border; `seen` knows them.
template <typename Pixel>
HWY_NOINLINE void copy_lane_at_border(const Pixel* line, std::ptrdiff_t step, int first, int length,
                                      int rows, std::ptrdiff_t out_step, Pixel* out) {
  for (int k = 0; k < rows; ++k) {
    out[k * out_step] = line[std::clamp(first + k, 0, length - 1) * step];
  }
}

template <typename Pixel>
HWY_NOINLINE void copy_lanes(const Pixel* image, const ProfileImages::Steps& steps, int length,
                             const Places& places, int half, int count, std::ptrdiff_t out_step,
                             Pixel* out) {
  const int rows = 2 * half + 1;
  for (int lane = 0; lane < count; ++lane) {
    const Pixel* const line = image + places.line[lane] * steps.line;
    const int first = places.across[lane] - half;
    if (first >= 0 && first + rows <= length) {
      copy_lane(line + first * steps.across, steps.across, rows, out_step, out + lane);
    } else {
      copy_lane_at_border(line, steps.across, first, length, rows, out_step, out + lane);
    }
  }
}

// ---- Lanes whose pixels follow one another, turned.

#if HWY_TARGET == HWY_SCALAR

template <typename Pixel>
bool turn_lanes(const Pixel* /*image*/, const ProfileImages::Steps& /*steps*/,
                const Places& /*places*/, int /*half*/, std::ptrdiff_t /*out_step*/,
                Pixel* /*out*/) {
  return false;  // A single lane needs no turning.
}

#else

// Of one batch whose windows are inside the image: a block of 128 bits of each lane at a time. To
// interleave the first half of it all with the second, once for every doubling of the lanes, turns
// rows and lanes. Returns false where there is no such block.
template <typename Pixel>
HWY_NOINLINE bool turn_lanes(const Pixel* image, const ProfileImages::Steps& steps,
                             const Places& places, int half, std::ptrdiff_t out_step, Pixel* out) {
  const hn::Full128<Pixel> d;
  constexpr int kAtOnce = static_cast<int>(16 / sizeof(Pixel));
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  const int last = 2 * half + 1 - kAtOnce;
  if (steps.across != 1 || last < 0) return false;
  for (int k = 0;; k = std::min(k + kAtOnce, last)) {
    hn::Vec<decltype(d)> v[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      v[lane] =
          hn::LoadU(d, image + places.line[lane] * steps.line + places.across[lane] - half + k);
    }
    for (int turned = 1; turned < kLanes; turned *= 2) {
      hn::Vec<decltype(d)> next[kLanes];
      for (int i = 0; i < kLanes / 2; ++i) {
        next[2 * i] = hn::InterleaveLower(d, v[i], v[i + kLanes / 2]);
        next[2 * i + 1] = hn::InterleaveUpper(d, v[i], v[i + kLanes / 2]);
      }
      for (int i = 0; i < kLanes; ++i) v[i] = next[i];
    }
    HWY_ALIGN Pixel block[kAtOnce * kLanes];
    for (int i = 0; i < kLanes; ++i) hn::Store(v[i], d, block + i * kAtOnce);
    for (int row = 0; row < kAtOnce; ++row) {
      std::copy_n(block + row * kLanes, kLanes, out + (k + row) * out_step);
    }
    if (k == last) return true;
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

// ---- Neighbouring lines, a vector of pixels at a time.

// Takes rows from `distance` elements on for those lanes.
template <class D, typename Pixel>
HWY_INLINE void pick_rows(D d, hn::Mask<D> from_farther, const Pixel* in, std::ptrdiff_t step,
                          std::ptrdiff_t distance, int rows, Pixel* out, std::ptrdiff_t out_step) {
  for (int k = 0; k < rows; ++k, in += step, out += out_step) {
    hn::StoreU(hn::IfThenElse(from_farther, hn::LoadU(d, in + distance), hn::LoadU(d, in)), d, out);
  }
}

// Shifts each lane by as many cells as its level, bit by bit, the highest one first: rows that end
// up outside were read where they are of no lane.
template <class D, typename Pixel>
HWY_INLINE void align_lanes(D d, hn::Vec<D> level, int levels, int cell, const Pixel* in,
                            std::ptrdiff_t step, int rows, Pixel* out, std::ptrdiff_t out_step) {
  const auto higher_by = [&](int bit) HWY_ATTR {
    const auto b = hn::Set(d, static_cast<Pixel>(bit));
    return hn::Eq(hn::And(level, b), b);
  };
  int bit = 1;
  while (2 * bit < levels) bit *= 2;
  const int all = rows + (levels - 1) * cell;
  const int both = std::min(rows + (bit - 1) * cell, all - bit * cell);
  const int rest = rows + (bit - 1) * cell - both;
  if (levels == 1) {
    pick_rows(d, higher_by(1), in, step, 0, rows, out, out_step);
    return;
  }
  pick_rows(d, higher_by(bit), in, step, bit * cell * step, both, out, out_step);
  pick_rows(d, higher_by(bit), in + both * step, step, 0, rest, out + both * out_step, out_step);
  for (bit /= 2; bit > 0; bit /= 2) {
    pick_rows(d, higher_by(bit), out, out_step, bit * cell * out_step, rows + (bit - 1) * cell, out,
              out_step);
  }
}

template <class D, typename Pixel>
HWY_INLINE void find_highest(D d, const Pixel* in, std::ptrdiff_t step, int rows, int count,
                             Pixel* highest) {
  for (int lane = 0; lane < count; lane += static_cast<int>(hn::Lanes(d))) {
    auto even = hn::LoadU(d, in + lane);
    auto odd = even;
    for (int k = 1; k < rows; k += 2) {
      odd = hn::Max(odd, hn::LoadU(d, in + k * step + lane));
      even = hn::Max(even, hn::LoadU(d, in + (k + 1) * step + lane));
    }
    hn::StoreU(hn::Max(even, odd), d, highest + lane);
  }
}

// ---- A group's pixels.

// Reads a batch's rows.
template <typename Pixel>
struct Rows {
  using PixelTag = hn::Rebind<Pixel, Tag>;

  const Pixel* first;
  std::ptrdiff_t step;

  HWY_INLINE V at(int k) const {
    return hn::ConvertTo(Tag(), hn::PromoteTo(IntTag(), hn::LoadU(PixelTag(), first + k * step)));
  }
};

// Row k, then lane, of the lit and of the dark image.
struct GroupPixels {
  // While lanes are shifted there are more rows.
  static constexpr int kMostCell = 2 * ProfilePlan::kMostAligned + 1;
  static constexpr int kRows = kMostRows + (Centres::kMostLevels / 2 - 1) * kMostCell;
  static constexpr int kRowBytes = kTogether * kMostLanes * static_cast<int>(sizeof(std::uint16_t));

  HWY_ALIGN std::uint8_t lit[kRows * kRowBytes];
  HWY_ALIGN std::uint8_t dark[kRows * kRowBytes];
  HWY_ALIGN std::uint8_t highest[kRowBytes];  // Of each lane's lit pixels.
};

// One batch of them.
struct BatchPixels {
  const GroupPixels& group;
  int batch;

  template <typename Pixel>
  HWY_INLINE Rows<Pixel> rows_of(const std::uint8_t* bytes) const {
    return {reinterpret_cast<const Pixel*>(bytes) + batch * lanes(), lanes_together()};
  }
};

// Copies what is around the centres of neighbouring lines; a vector is of `d`.
template <class D, typename Pixel = hn::TFromD<D>>
HWY_INLINE void copy_neighbours(D d, const Pixel* image, const ProfileImages::Steps& steps,
                                const ProfilePlan& plan, const Places& places,
                                const Centres& centres, int count, Pixel* out) {
  const hn::Rebind<std::uint8_t, D> bytes;
  const Pixel* in = image + places.line[0] + (centres.lowest - plan.window) * steps.across;
  for (int lane = 0; lane < count; lane += static_cast<int>(hn::Lanes(d))) {
    const auto level = hn::LoadU(bytes, centres.level + lane);
    const auto align = [&](auto wide) HWY_ATTR {
      align_lanes(d, wide, centres.levels, 2 * plan.aligned + 1, in + lane, steps.across,
                  2 * plan.window + 1, out + lane, lanes_together());
    };
    if constexpr (sizeof(Pixel) == 1) {
      align(level);
    } else {
      align(hn::PromoteTo(d, level));
    }
  }
}

// The same of any lines: `batches` of the group, from `first` on.
template <typename Pixel>
void copy_pixels(const void* image, const ProfileImages::Steps& steps, int length,
                 const ProfilePlan& plan, const Places& places, const Centres& centres, int first,
                 int batches, std::uint8_t* bytes) {
  const auto* const pixels = static_cast<const Pixel*>(image);
  Pixel* const out = reinterpret_cast<Pixel*>(bytes) + first * lanes();
  const int count = batches * lanes();
  if (centres.levels == 0) {
    const bool is_turned = batches == 1 && centres.are_inside &&
                           turn_lanes(pixels, steps, places, plan.window, lanes_together(), out);
    if (!is_turned) {
      copy_lanes(pixels, steps, length, places, plan.window, count, lanes_together(), out);
    }
  } else if (batches == kTogether) {
    copy_neighbours(hn::ScalableTag<Pixel>(), pixels, steps, plan, places, centres, count, out);
  } else {
    copy_neighbours(hn::Rebind<Pixel, Tag>(), pixels, steps, plan, places, centres, count, out);
  }
}

template <typename Pixel>
void copy_both_images(const ProfileImages& images, const ProfilePlan& plan, const Places& places,
                      const Centres& centres, int first, int batches, GroupPixels& group) {
  copy_pixels<Pixel>(images.lit, images.lit_steps, images.length, plan, places, centres, first,
                     batches, group.lit);
  const int rows = 2 * plan.window + 1;
  const int count = batches * lanes();
  const auto* const lit = reinterpret_cast<const Pixel*>(group.lit) + first * lanes();
  auto* const highest = reinterpret_cast<Pixel*>(group.highest) + first * lanes();
  if (batches == kTogether) {
    find_highest(hn::ScalableTag<Pixel>(), lit, lanes_together(), rows, count, highest);
  } else {
    find_highest(hn::Rebind<Pixel, Tag>(), lit, lanes_together(), rows, count, highest);
  }
  if (images.dark == nullptr) return;
  copy_pixels<Pixel>(images.dark, images.dark_steps, images.length, plan, places, centres, first,
                     batches, group.dark);
}

// Copies what is around the lanes' centres, of `batches` of the group from `first` on.
void copy_around(const ProfileImages& images, const ProfilePlan& plan, const Places& places,
                 const Centres& centres, int first, int batches, GroupPixels& group) {
  if (images.is_16_bit) {
    copy_both_images<std::uint16_t>(images, plan, places, centres, first, batches, group);
  } else {
    copy_both_images<std::uint8_t>(images, plan, places, centres, first, batches, group);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_PIXELS_INL_
