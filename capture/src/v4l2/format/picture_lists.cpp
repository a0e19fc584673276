// SPDX-License-Identifier: Apache-2.0
#include "v4l2/format/picture_lists.hpp"

#include <algorithm>

namespace striper::detail::v4l2 {
namespace {

/// Asks with a growing index until the driver has no more.
/// @param question what every entry is asked for with.
template <typename Entry>
std::vector<Entry> list(const VideoDevice& device, unsigned long request, const Entry& question) {
  constexpr std::uint32_t kAtMost = 256;
  std::vector<Entry> entries;
  for (std::uint32_t index = 0; index < kAtMost; ++index) {
    Entry entry = question;
    entry.index = index;
    if (device.attempt(request, entry) != 0) break;
    entries.push_back(entry);
  }
  return entries;
}

double rate_of(const v4l2_fract& period) {
  if (period.numerator == 0) return 0.0;
  return static_cast<double>(period.denominator) / period.numerator;
}

}  // namespace

std::vector<v4l2_fmtdesc> list_formats(const VideoDevice& device) {
  v4l2_fmtdesc question{};
  question.type = device.buffer_type();
  return list(device, VIDIOC_ENUM_FMT, question);
}

std::vector<v4l2_frmsizeenum> list_sizes(const VideoDevice& device, std::uint32_t code) {
  v4l2_frmsizeenum question{};
  question.pixel_format = code;
  std::vector<v4l2_frmsizeenum> sizes = list(device, VIDIOC_ENUM_FRAMESIZES, question);
  if (!sizes.empty() && sizes.front().type != V4L2_FRMSIZE_TYPE_DISCRETE) sizes.resize(1);
  return sizes;
}

FrameRates list_rates(const VideoDevice& device, std::uint32_t code,
                      const v4l2_frmsize_discrete& size) {
  v4l2_frmivalenum question{};
  question.pixel_format = code;
  question.width = size.width;
  question.height = size.height;
  FrameRates rates;
  for (const v4l2_frmivalenum& entry : list(device, VIDIOC_ENUM_FRAMEINTERVALS, question)) {
    const bool is_discrete = entry.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const double rate_hz = rate_of(is_discrete ? entry.discrete : entry.stepwise.min);
    rates.fastest_hz = std::max(rates.fastest_hz, rate_hz);
    if (!is_discrete) break;
    if (rate_hz > 0.0) rates.listed_hz.push_back(rate_hz);
  }
  return rates;
}

}  // namespace striper::detail::v4l2
