// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/peak_list.hpp"

namespace striper::detail {

void PeakList::make_room(std::size_t count) {
  seeds.reserve(count);
  const std::size_t padded = count + PeakMeasurements::kMultiple;
  if (offset.size() >= padded) return;
  across.resize(padded);
  for (auto* values : {&offset, &amplitude, &width, &sigma, &significance, &snr, &clipped, &level,
                       &slope, &confidence}) {
    values->resize(padded);
  }
  status.resize(padded);
}

PeakMeasurements PeakList::measurements() noexcept {
  return {across.data(),       offset.data(), amplitude.data(), width.data(), sigma.data(),
          significance.data(), snr.data(),    clipped.data(),   level.data(), slope.data()};
}

void PeakList::take(std::size_t i, const PeakList& from, std::size_t n) noexcept {
  across[i] = from.across[n];
  offset[i] = from.offset[n];
  amplitude[i] = from.amplitude[n];
  width[i] = from.width[n];
  sigma[i] = from.sigma[n];
  significance[i] = from.significance[n];
  snr[i] = from.snr[n];
  clipped[i] = from.clipped[n];
  level[i] = from.level[n];
  slope[i] = from.slope[n];
}

}  // namespace striper::detail
