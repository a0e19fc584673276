// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <opencv2/core/mat.hpp>

#include <striper/core/stripe_axis.hpp>
#include <striper/laser_plane/board_stripe.hpp>

namespace striper::detail {

/// The shares of blue, green and red in a stripe's own light, as the camera sees it: what its
/// profile stands above the ground on either side, channel by channel, at those of its returns that
/// are on white. Only pixels count of which no channel is clipped: of a stripe that is clipped to
/// white these are its flanks, which have its colour still. The median over the returns.
/// @param image CV_8UC3 or CV_16UC3, B, G, R. @return empty for too few such returns.
std::optional<std::array<double, 3>> stripe_colour(const cv::Mat& image, const BoardStripe& stripe,
                                                   StripeAxis axis, int full_scale_dn);

}  // namespace striper::detail
