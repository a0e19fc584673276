// SPDX-License-Identifier: Apache-2.0
// Compiled once for every instruction set (see hwy/foreach_target.h); the best one is chosen at run
// time.
#include "stripe/report/patches/patch_net.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>

#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stripe/report/patches/patch_net.cpp"
#include <hwy/foreach_target.h>  // Must come first.
// clang-format off
#include <hwy/highway.h>
// clang-format on

#ifndef STRIPER_PATCH_NET_LAYERS
#define STRIPER_PATCH_NET_LAYERS
namespace striper::detail {
namespace {

// Output channels that are summed together.
constexpr std::size_t kTogether = 4;

// Square planes with a border of zeros.
template <std::size_t kChannels, std::size_t kWide>
struct Planes {
  static constexpr std::size_t kRow = kWide + 2;
  std::array<float, kChannels * kRow * kRow> of{};

  float* row(std::size_t channel, std::size_t y) {  // Without the border.
    return of.data() + (channel * kRow + y + 1) * kRow + 1;
  }
  const float* bordered(std::size_t channel, std::size_t y) const {
    return of.data() + (channel * kRow + y) * kRow;
  }
};

// weights: of each group of kTogether outputs, input by input, the filter's nine pixels, of each
// the outputs'.
struct Filters {
  std::span<const float> weights;
  std::span<const float> biases;
};

// weights: of each input, those of all outputs.
struct Dense {
  std::span<const float> weights;
  std::span<const float> biases;
};

// Written by tests/bench/fit_patches.py.
#include "stripe/report/patches/patch_net.inc"

// Outputs of each layer of filters, of what weighs the evidence, and of what weighs both.
constexpr std::size_t kFirst = 8;
constexpr std::size_t kSecond = 16;
constexpr std::size_t kThird = 16;
constexpr std::size_t kHidden = 48;
constexpr std::size_t kKnown = Evidence::kCount + 4;  // The evidence, log odds and place.
constexpr std::size_t kLastSide = ReturnPatch::kSide / 8;
constexpr std::size_t kShown = kThird * kLastSide * kLastSide;

template <std::size_t kWeights, std::size_t kBiases>
constexpr bool is_layer(const float (&)[kWeights], const float (&)[kBiases], std::size_t inputs,
                        std::size_t outputs) {
  return kWeights == inputs * outputs && kBiases == outputs && outputs % 8 == 0;
}
static_assert(is_layer(kFirstWeights, kFirstBiases, ReturnPatch::kPlanes * 9, kFirst));
static_assert(is_layer(kSecondWeights, kSecondBiases, kFirst * 9, kSecond));
static_assert(is_layer(kThirdWeights, kThirdBiases, kSecond * 9, kThird));
static_assert(is_layer(kSeenWeights, kSeenBiases, kShown, PatchNet::kSeen));
static_assert(is_layer(kKnownWeights, kKnownBiases, kKnown, kHidden));
static_assert(is_layer(kBothWeights, kBothBiases, PatchNet::kSeen + kHidden, kHidden));
static_assert(std::size(kLastWeights) == kHidden);

}  // namespace
}  // namespace striper::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace striper::detail {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<float, 8>;  // The narrowest plane's row, the fewest outputs.

// kVectors side by side of a row of kTogether outputs. @param out a row each, kWide apart.
template <int kVectors, std::size_t kIn, std::size_t kWide>
HWY_INLINE void filter_at(const Planes<kIn, kWide>& in, const float* weights, const float* biases,
                          std::size_t y, std::size_t x, float* out) {
  const Tag d;
  const std::size_t lanes = hn::Lanes(d);
  hn::Vec<Tag> sums[kTogether][kVectors];
  for (std::size_t n = 0; n < kTogether; ++n) {
    for (int v = 0; v < kVectors; ++v) sums[n][v] = hn::Set(d, biases[n]);
  }
  for (std::size_t channel = 0; channel < kIn; ++channel) {
    for (std::size_t down = 0; down < 3; ++down) {
      const float* const row = in.bordered(channel, y + down) + x;
      for (std::size_t right = 0; right < 3; ++right, weights += kTogether) {
        hn::Vec<Tag> pixels[kVectors];
        for (int v = 0; v < kVectors; ++v) {
          pixels[v] = hn::LoadU(d, row + right + static_cast<std::size_t>(v) * lanes);
        }
        for (std::size_t n = 0; n < kTogether; ++n) {
          const auto weight = hn::Set(d, weights[n]);
          for (int v = 0; v < kVectors; ++v) {
            sums[n][v] = hn::MulAdd(pixels[v], weight, sums[n][v]);
          }
        }
      }
    }
  }
  for (std::size_t n = 0; n < kTogether; ++n) {
    for (int v = 0; v < kVectors; ++v) {
      hn::StoreU(sums[n][v], d, out + n * kWide + x + static_cast<std::size_t>(v) * lanes);
    }
  }
}

// The filters, what is negative cut off, and the maximum of two by two.
template <std::size_t kIn, std::size_t kOut, std::size_t kWide>
void filter_and_halve(const Filters& filters, const Planes<kIn, kWide>& in,
                      Planes<kOut, kWide / 2>& out) {
  constexpr std::size_t kWeights = kIn * 9 * kTogether;
  const std::size_t lanes = hn::Lanes(Tag());
  std::array<float, 2 * kTogether * kWide> rows;
  for (std::size_t first = 0; first < kOut; first += kTogether) {
    const float* const weights = filters.weights.data() + first / kTogether * kWeights;
    const float* const biases = filters.biases.data() + first;
    for (std::size_t y = 0; y < kWide; y += 2) {
      for (std::size_t k = 0; k < 2; ++k) {
        float* const to = rows.data() + k * kTogether * kWide;
        std::size_t x = 0;
        for (; x + 2 * lanes <= kWide; x += 2 * lanes)
          filter_at<2>(in, weights, biases, y + k, x, to);
        for (; x < kWide; x += lanes) filter_at<1>(in, weights, biases, y + k, x, to);
      }
      for (std::size_t n = 0; n < kTogether; ++n) {
        const float* const upper = rows.data() + n * kWide;
        const float* const lower = upper + kTogether * kWide;
        float* const to = out.row(first + n, y / 2);
        for (std::size_t x = 0; x < kWide; x += 2) {
          to[x / 2] = std::max({0.0F, upper[x], upper[x + 1], lower[x], lower[x + 1]});
        }
      }
    }
  }
}

// What is negative is cut off.
template <std::size_t kIn, std::size_t kOut>
void weigh_inputs(const Dense& layer, const std::array<float, kIn>& in,
                  std::array<float, kOut>& out) {
  const Tag d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t first = 0; first < kOut; first += lanes) {
    auto sum = hn::LoadU(d, layer.biases.data() + first);
    const float* weights = layer.weights.data() + first;
    for (std::size_t i = 0; i < kIn; ++i, weights += kOut) {
      sum = hn::MulAdd(hn::Set(d, in[i]), hn::LoadU(d, weights), sum);
    }
    hn::StoreU(hn::Max(sum, hn::Zero(d)), d, out.data() + first);
  }
}

void look_at(const ReturnPatch& patch, PatchNet::Seen& seen) {
  constexpr std::size_t kSide = ReturnPatch::kSide;
  Planes<ReturnPatch::kPlanes, kSide> planes;
  for (std::size_t n = 0; n < ReturnPatch::kPlanes; ++n) {
    for (std::size_t y = 0; y < kSide; ++y) {
      std::copy_n(patch.of.data() + (n * kSide + y) * kSide, kSide, planes.row(n, y));
    }
  }
  Planes<kFirst, kSide / 2> first;
  filter_and_halve({kFirstWeights, kFirstBiases}, planes, first);
  Planes<kSecond, kSide / 4> second;
  filter_and_halve({kSecondWeights, kSecondBiases}, first, second);
  Planes<kThird, kLastSide> third;
  filter_and_halve({kThirdWeights, kThirdBiases}, second, third);
  std::array<float, kShown> shown;
  for (std::size_t n = 0; n < kThird; ++n) {
    for (std::size_t y = 0; y < kLastSide; ++y) {
      std::copy_n(third.row(n, y), kLastSide, shown.data() + (n * kLastSide + y) * kLastSide);
    }
  }
  weigh_inputs({kSeenWeights, kSeenBiases}, shown, seen);
}

float more_odds(const PatchNet::Seen& seen, const std::array<float, kKnown>& known) {
  std::array<float, kHidden> of_known;
  weigh_inputs({kKnownWeights, kKnownBiases}, known, of_known);
  std::array<float, PatchNet::kSeen + kHidden> both;
  std::copy(of_known.begin(), of_known.end(), std::copy(seen.begin(), seen.end(), both.begin()));
  std::array<float, kHidden> hidden;
  weigh_inputs({kBothWeights, kBothBiases}, both, hidden);
  float odds = kLastBias;
  for (std::size_t n = 0; n < kHidden; ++n) odds += hidden[n] * kLastWeights[n];
  return odds;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace striper::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace striper::detail {

HWY_EXPORT(look_at);
HWY_EXPORT(more_odds);

void PatchNet::look(const ReturnPatch& patch, Seen& seen) noexcept {
  HWY_DYNAMIC_DISPATCH(look_at)(patch, seen);
}

float PatchNet::more_log_odds(const Seen& seen, const Place& place, const Evidence& evidence,
                              float log_odds) noexcept {
  constexpr float kMostEvidence = 16.0F;
  std::array<float, kKnown> known;
  for (std::size_t kind = 0; kind < Evidence::kCount; ++kind) {
    known[kind] = std::clamp(evidence.of[kind], -kMostEvidence, kMostEvidence);
  }
  // In the units that it learnt of.
  known[Evidence::kCount] = log_odds / 3.0F;
  known[Evidence::kCount + 1] = place.along / 4.0F;
  known[Evidence::kCount + 2] = place.across / 3.0F;
  known[Evidence::kCount + 3] = place.fraction;
  return HWY_DYNAMIC_DISPATCH(more_odds)(seen, known);
}

}  // namespace striper::detail
#endif  // HWY_ONCE
