// SPDX-License-Identifier: Apache-2.0
#include "stripe/profile/frame_at_hand.hpp"

#include <cstddef>
#include <cstdint>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

template <typename Pixel>
ProfileImages images_of(const LitFrame& frame, StripeAxis axis) {
  const auto steps = [&](const cv::Mat& image) {
    const auto stride = static_cast<std::ptrdiff_t>(image.step1());
    return axis == StripeAxis::kColumns ? ProfileImages::Steps{1, stride}
                                        : ProfileImages::Steps{stride, 1};
  };
  ProfileImages images;
  images.lit = frame.lit.ptr<Pixel>();
  images.lit_steps = steps(frame.lit);
  if (!frame.dark.empty()) {
    images.dark = frame.dark.ptr<Pixel>();
    images.dark_steps = steps(frame.dark);
  }
  if (!frame.masked.empty()) {
    images.masked = frame.masked.ptr<std::uint8_t>();
    images.masked_steps = steps(frame.masked);
  }
  if (!frame.variance.empty()) {
    images.variance = frame.variance.ptr<float>();
    images.variance_steps = steps(frame.variance);
  }
  images.is_16_bit = sizeof(Pixel) == 2;
  images.length = line_length(frame.lit, axis);
  images.full_scale_dn = frame.full_scale_dn;
  return images;
}

}  // namespace

ProfileImages images_of(const LitFrame& frame, StripeAxis axis) {
  return frame.lit.depth() == CV_8U ? images_of<std::uint8_t>(frame, axis)
                                    : images_of<std::uint16_t>(frame, axis);
}

}  // namespace striper::detail
