// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/field_order.hpp"

#include <algorithm>
#include <limits>

namespace striper::detail {
namespace {

constexpr int kBands = 12;
constexpr int kSamples = 24;

// A block is found again where it differs by less than this part of what it does where it was, and
// of what it does in the mean of all places.
constexpr double kFoundAgain = 0.4;
// Half-way fits so much better than as far behind, or the other way round.
constexpr double kFitsBetter = 0.6;

struct Place {
  int band = 0;
  int sample = 0;
};

// Whether a block that starts there is inside.
bool holds(const cv::Mat& profiles, const Place& at) {
  return at.band >= 0 && at.band + kBands <= profiles.rows && at.sample >= 0 &&
         at.sample + kSamples <= profiles.cols;
}

double difference(const cv::Mat& a, const Place& at_a, const cv::Mat& b, const Place& at_b) {
  float sum = 0.0F;
  for (int band = 0; band < kBands; ++band) {
    const auto* const p = a.ptr<float>(at_a.band + band) + at_a.sample;
    const auto* const q = b.ptr<float>(at_b.band + band) + at_b.sample;
    for (int k = 0; k < kSamples; ++k) sum += (p[k] - q[k]) * (p[k] - q[k]);
  }
  return static_cast<double>(sum);
}

// How far a block of `first` has moved in `next`; nowhere if that is not plain.
Place shift_of(const cv::Mat& first, const cv::Mat& next, const Place& block,
               const OrderSearch& search) {
  double least = std::numeric_limits<double>::max();
  double sum = 0.0;
  int places = 0;
  Place best;
  for (int band = -search.bands; band <= search.bands; ++band) {
    for (int sample = -search.samples; sample <= search.samples; ++sample) {
      const Place there{block.band + band, block.sample + sample};
      if (!holds(next, there)) continue;
      const double value = difference(first, block, next, there);
      sum += value;
      ++places;
      if (value >= least) continue;
      least = value;
      best = {band, sample};
    }
  }
  const double where_it_was = difference(first, block, next, block);
  const bool is_plain = least < kFoundAgain * where_it_was && least < kFoundAgain * sum / places;
  return is_plain ? best : Place{};
}

// How badly `second`, half the shift on from `block` (or back), fits the mean of what it was before
// and will be; odd shifts lie between two places.
double misfit(const cv::Mat& first, const cv::Mat& second, const cv::Mat& next, const Place& block,
              const Place& shift, int direction) {
  const int twice_band = 2 * block.band + direction * shift.band;
  const int twice_sample = 2 * block.sample + direction * shift.sample;
  const auto floor_half = [](int twice) { return (twice - (twice & 1)) / 2; };
  const Place low{floor_half(twice_band), floor_half(twice_sample)};
  const int more_bands = twice_band & 1;
  const int more_samples = twice_sample & 1;
  if (!holds(second, low) || !holds(second, {low.band + more_bands, low.sample + more_samples})) {
    return -1.0;
  }
  double sum = 0.0;
  for (int band = 0; band < kBands; ++band) {
    const auto* const before = first.ptr<float>(block.band + band) + block.sample;
    const auto* const after =
        next.ptr<float>(block.band + shift.band + band) + block.sample + shift.sample;
    const auto* const a = second.ptr<float>(low.band + band) + low.sample;
    const auto* const b = second.ptr<float>(low.band + more_bands + band) + low.sample;
    for (int k = 0; k < kSamples; ++k) {
      const float there = 0.25F * (a[k] + a[k + more_samples] + b[k] + b[k + more_samples]);
      const float d = there - 0.5F * (before[k] + after[k]);
      sum += static_cast<double>(d * d);
    }
  }
  return sum;
}

}  // namespace

OrderVotes vote_on_order(const cv::Mat& first, const cv::Mat& second, const cv::Mat& next,
                         const OrderSearch& search) {
  OrderVotes votes;
  for (Place block; block.band + kBands <= first.rows; block.band += kBands) {
    for (block.sample = 0; block.sample + kSamples <= first.cols; block.sample += kSamples) {
      if (!holds(next, block)) continue;
      const Place shift = shift_of(first, next, block, search);
      if (shift.band == 0 && shift.sample == 0) continue;
      const double half_way = misfit(first, second, next, block, shift, 1);
      const double behind = misfit(first, second, next, block, shift, -1);
      if (half_way < 0.0 || behind < 0.0) continue;
      if (half_way < kFitsBetter * behind) ++votes.right;
      if (behind < kFitsBetter * half_way) ++votes.wrong;
    }
  }
  return votes;
}

}  // namespace striper::detail
