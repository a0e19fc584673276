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

// Lanes of one batch or more: their scan lines and centres.
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
  // Of neighbouring scan lines, whose pixels lie side by side: the lowest row that one is centred
  // on, and of how many rows a cell apart each is centred on one. No such where they are no
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

// Some batches of a group, side by side in it.
struct Part {
  Places places;  // Of these batches.
  const Centres& centres;
  int first;  // Batch.
  int batches;
};

// Rows of pixels, `step` elements apart.
template <typename Pixel>
struct PixelRows {
  Pixel* first;
  std::ptrdiff_t step;

  HWY_INLINE Pixel* row(std::ptrdiff_t k) const { return first + k * step; }
  HWY_INLINE PixelRows from(std::ptrdiff_t k) const { return {row(k), step}; }
};

// One of the images.
template <typename Pixel>
struct Image {
  const Pixel* first;
  ProfileImages::Steps steps;
  int length;  // Across the scan lines.

  HWY_INLINE PixelRows<const Pixel> line(int number) const {
    return {first + number * steps.line, steps.across};
  }
};

template <typename Pixel>
HWY_INLINE Image<Pixel> image_of(const void* pixels, const ProfileImages::Steps& steps,
                                 int length) {
  return {static_cast<const Pixel*>(pixels), steps, length};
}

// ---- Lanes copied one by one, each from wherever it is.

template <typename Pixel>
HWY_INLINE void copy_lane(const PixelRows<const Pixel>& in, int rows, const PixelRows<Pixel>& out) {
  for (int k = 0; k < rows; ++k) *out.row(k) = *in.row(k);
}

// Pixels outside of the image repeat the border; `seen` knows them.
template <typename Pixel>
HWY_NOINLINE void copy_lane_at_border(const PixelRows<const Pixel>& line, int length, int first,
                                      int rows, const PixelRows<Pixel>& out) {
  for (int k = 0; k < rows; ++k) *out.row(k) = *line.row(std::clamp(first + k, 0, length - 1));
}

template <typename Pixel>
HWY_NOINLINE void copy_lanes(const Image<Pixel>& image, const Places& places, int half, int count,
                             const PixelRows<Pixel>& out) {
  const int rows = 2 * half + 1;
  for (int lane = 0; lane < count; ++lane) {
    const PixelRows<const Pixel> line = image.line(places.line[lane]);
    const int first = places.across[lane] - half;
    const PixelRows<Pixel> to{out.first + lane, out.step};
    if (first >= 0 && first + rows <= image.length) {
      copy_lane(line.from(first), rows, to);
    } else {
      copy_lane_at_border(line, image.length, first, rows, to);
    }
  }
}

// ---- Lanes whose pixels follow one another, turned.

#if HWY_TARGET == HWY_SCALAR

template <typename Pixel>
bool turn_lanes(const Image<Pixel>& /*image*/, const Places& /*places*/, int /*half*/,
                const PixelRows<Pixel>& /*out*/) {
  return false;  // A single lane needs no turning.
}

#else

// Of one batch whose windows are inside the image: a block of 128 bits of each lane at a time. To
// interleave the first half of it all with the second, once for every doubling of the lanes, turns
// rows and lanes. Returns false where there is no such block.
template <typename Pixel>
HWY_NOINLINE bool turn_lanes(const Image<Pixel>& image, const Places& places, int half,
                             const PixelRows<Pixel>& out) {
  const hn::Full128<Pixel> d;
  constexpr int kAtOnce = static_cast<int>(16 / sizeof(Pixel));
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  const int last = 2 * half + 1 - kAtOnce;
  if (image.steps.across != 1 || last < 0) return false;
  for (int k = 0;; k = std::min(k + kAtOnce, last)) {
    hn::Vec<decltype(d)> v[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      v[lane] = hn::LoadU(d, image.line(places.line[lane]).first + places.across[lane] - half + k);
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
      std::copy_n(block + row * kLanes, kLanes, out.row(k + row));
    }
    if (k == last) return true;
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

// ---- Neighbouring scan lines, a vector of pixels at a time.

// Takes rows from `distance` rows on for those lanes.
template <class D, typename Pixel>
HWY_INLINE void pick_rows(D d, hn::Mask<D> from_farther, PixelRows<const Pixel> in, int distance,
                          int rows, PixelRows<Pixel> out) {
  const std::ptrdiff_t farther = distance * in.step;
  for (int k = 0; k < rows; ++k, in.first += in.step, out.first += out.step) {
    const auto near = hn::LoadU(d, in.first);
    hn::StoreU(hn::IfThenElse(from_farther, hn::LoadU(d, in.first + farther), near), d, out.first);
  }
}

// How far lanes are shifted: by as many cells of rows as the lane's level, below `count`.
struct Levels {
  int count;
  int cell;
};

// Shifts each lane, bit by bit, the highest one first: rows that end up outside were read where
// they are of no lane.
template <class D, typename Pixel>
HWY_INLINE void align_lanes(D d, hn::Vec<D> level, const Levels& levels,
                            const PixelRows<const Pixel>& in, int rows,
                            const PixelRows<Pixel>& out) {
  const auto higher_by = [&](int bit) HWY_ATTR {
    const auto b = hn::Set(d, static_cast<Pixel>(bit));
    return hn::Eq(hn::And(level, b), b);
  };
  const int cell = levels.cell;
  int bit = 1;
  while (2 * bit < levels.count) bit *= 2;
  const int all = rows + (levels.count - 1) * cell;
  const int both = std::min(rows + (bit - 1) * cell, all - bit * cell);
  const int rest = rows + (bit - 1) * cell - both;
  if (levels.count == 1) {
    pick_rows(d, higher_by(1), in, 0, rows, out);
    return;
  }
  pick_rows(d, higher_by(bit), in, bit * cell, both, out);
  pick_rows(d, higher_by(bit), in.from(both), 0, rest, out.from(both));
  const PixelRows<const Pixel> shifted{out.first, out.step};
  for (bit /= 2; bit > 0; bit /= 2) {
    pick_rows(d, higher_by(bit), shifted, bit * cell, rows + (bit - 1) * cell, out);
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

// Copies what is around the centres of neighbouring scan lines; a vector is of `d`.
template <class D, typename Pixel = hn::TFromD<D>>
HWY_INLINE void copy_neighbours(D d, const Image<Pixel>& image, const ProfilePlan& plan,
                                const Part& part, Pixel* out) {
  const hn::Rebind<std::uint8_t, D> bytes;
  const Levels levels{part.centres.levels, 2 * plan.aligned + 1};
  const auto in = image.line(part.places.line[0]).from(part.centres.lowest - plan.window);
  for (int lane = 0; lane < part.batches * lanes(); lane += static_cast<int>(hn::Lanes(d))) {
    const auto level = hn::LoadU(bytes, part.centres.level + lane);
    const auto align = [&](auto wide) HWY_ATTR {
      align_lanes<D, Pixel>(d, wide, levels, {in.first + lane, in.step}, 2 * plan.window + 1,
                            {out + lane, lanes_together()});
    };
    if constexpr (sizeof(Pixel) == 1) {
      align(level);
    } else {
      align(hn::PromoteTo(d, level));
    }
  }
}

// The same of any scan lines.
template <typename Pixel>
void copy_pixels(const Image<Pixel>& image, const ProfilePlan& plan, const Part& part,
                 std::uint8_t* bytes) {
  Pixel* const out = reinterpret_cast<Pixel*>(bytes) + part.first * lanes();
  if (part.centres.levels == 0) {
    const PixelRows<Pixel> rows{out, lanes_together()};
    const bool is_turned = part.batches == 1 && part.centres.are_inside &&
                           turn_lanes(image, part.places, plan.window, rows);
    if (!is_turned) copy_lanes(image, part.places, plan.window, part.batches * lanes(), rows);
  } else if (part.batches == kTogether) {
    copy_neighbours(hn::ScalableTag<Pixel>(), image, plan, part, out);
  } else {
    copy_neighbours(hn::Rebind<Pixel, Tag>(), image, plan, part, out);
  }
}

template <typename Pixel>
void copy_both_images(const ProfileImages& images, const ProfilePlan& plan, const Part& part,
                      GroupPixels& group) {
  copy_pixels(image_of<Pixel>(images.lit, images.lit_steps, images.length), plan, part, group.lit);
  const int rows = 2 * plan.window + 1;
  const int count = part.batches * lanes();
  const auto* const lit = reinterpret_cast<const Pixel*>(group.lit) + part.first * lanes();
  auto* const highest = reinterpret_cast<Pixel*>(group.highest) + part.first * lanes();
  if (part.batches == kTogether) {
    find_highest(hn::ScalableTag<Pixel>(), lit, lanes_together(), rows, count, highest);
  } else {
    find_highest(hn::Rebind<Pixel, Tag>(), lit, lanes_together(), rows, count, highest);
  }
  if (images.dark == nullptr) return;
  copy_pixels(image_of<Pixel>(images.dark, images.dark_steps, images.length), plan, part,
              group.dark);
}

// Copies what is around the lanes' centres, of that part of the group.
void copy_around(const ProfileImages& images, const ProfilePlan& plan, const Part& part,
                 GroupPixels& group) {
  if (images.is_16_bit) {
    copy_both_images<std::uint16_t>(images, plan, part, group);
  } else {
    copy_both_images<std::uint8_t>(images, plan, part, group);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_PROFILE_PIXELS_INL_
