// SPDX-License-Identifier: Apache-2.0
// Pixels of lit - dark, a vector at a time. Compiled for every instruction set: see
// hwy/foreach_target.h for the unusual include guard.
#if defined(STRIPER_STRIPE_BLOCK_READER_INL_) == defined(HWY_TARGET_TOGGLE)
#ifdef STRIPER_STRIPE_BLOCK_READER_INL_
#undef STRIPER_STRIPE_BLOCK_READER_INL_
#else
#define STRIPER_STRIPE_BLOCK_READER_INL_
#endif

#include <cstdint>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "stripe/candidates/block_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <typename Pixel>
using PixelTag = hn::ScalableTag<Pixel>;

template <typename Pixel>
using PixelVec = hn::Vec<PixelTag<Pixel>>;

template <class D>
HWY_INLINE hn::Vec<D> load_masked(D d, const std::uint8_t* masked) {
  if constexpr (sizeof(hn::TFromD<D>) == 1) {
    return hn::LoadU(d, masked);
  } else {
    const hn::Rebind<std::uint8_t, D> half;
    return hn::PromoteTo(d, hn::LoadU(half, masked));
  }
}

// What the planes hold, known when the loop is compiled: a plane that is absent costs nothing.
template <typename PixelT, bool kHasDark, bool kHasMask>
struct Reader {
  using Pixel = PixelT;

  PixelPlanes<Pixel> planes;

  HWY_INLINE PixelVec<Pixel> load(int row, int col) const {
    return load(PixelTag<Pixel>(), row, col);
  }

  // As many as `d` has lanes.
  template <class D>
  HWY_INLINE hn::Vec<D> load(D d, int row, int col) const {
    auto v = hn::LoadU(d, planes.lit + row * planes.lit_stride + col);
    if constexpr (kHasDark) {
      v = hn::SaturatedSub(v, hn::LoadU(d, planes.dark + row * planes.dark_stride + col));
    }
    if constexpr (kHasMask) {
      const auto seen =
          hn::Eq(load_masked(d, planes.masked + row * planes.masked_stride + col), hn::Zero(d));
      v = hn::IfThenElseZero(seen, v);
    }
    return v;
  }

  HWY_INLINE void prefetch(int row, int col) const {
    hwy::Prefetch(planes.lit + row * planes.lit_stride + col);
    if constexpr (kHasDark) hwy::Prefetch(planes.dark + row * planes.dark_stride + col);
  }

  Pixel value(int row, int col) const {
    if (kHasMask && planes.masked[row * planes.masked_stride + col] != 0) return 0;
    const Pixel lit = planes.lit[row * planes.lit_stride + col];
    if constexpr (!kHasDark) return lit;
    const Pixel dark = planes.dark[row * planes.dark_stride + col];
    return lit > dark ? static_cast<Pixel>(lit - dark) : Pixel{0};
  }
};

template <typename Visitor, typename Pixel>
void with_reader(const PixelPlanes<Pixel>& planes, const Visitor& visit) {
  const bool dark = planes.dark != nullptr;
  if (planes.masked != nullptr) {
    if (dark) {
      visit(Reader<Pixel, true, true>{planes});
    } else {
      visit(Reader<Pixel, false, true>{planes});
    }
  } else if (dark) {
    visit(Reader<Pixel, true, false>{planes});
  } else {
    visit(Reader<Pixel, false, false>{planes});
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#endif  // STRIPER_STRIPE_BLOCK_READER_INL_
