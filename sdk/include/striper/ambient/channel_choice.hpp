// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

#include <striper/core/channel.hpp>
#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper {

/// One channel of an image, as what is lit and what is subtracted from it.
struct ChannelImages {
  cv::Mat lit;
  cv::Mat dark;  ///< The other channel of a colour difference; else empty.
};

/// Takes one channel out of an image. A grey image is handed through without a copy, whatever
/// the channel.
///
/// @param image CV_8UC1, CV_16UC1, CV_8UC3 or CV_16UC3 (B, G, R). @param channel anything but
/// kAuto.
/// @param reuse its matrices are written into where they fit, so that a stream allocates once.
void select_channel(const cv::Mat& image, Channel channel, ChannelImages& reuse);

/// One channel of a frame as a frame of its own. A colour difference is corrected where the
/// stripe is clipped to white: both of its flanks would be read as stripes, and nothing between
/// them. Allocates. @param channel anything but kAuto.
LitFrame lit_frame_of_channel(const cv::Mat& image, Channel channel, StripeAxis axis,
                              int full_scale_dn);

/// Returns the channel in which the laser's stripe is searched: its own colour, grey, or where
/// neither tells red, green or blue, but never a difference. The laser's colour is the one of which
/// there is more than of the others in a narrow bright spot beside that of the next scan line
/// (column or row), in a tenth of the scan lines at least: white boards and grey edges do not show
/// in that. Grey is taken where such spots are the brightest of the image as well, where no channel
/// is better, and in a grey image. In its own channel far less is wrong than in a difference
/// (docs/accuracy.md). @param image as above.
/// Looks at half of the pixels. Allocates.
Channel choose_channel(const cv::Mat& image, StripeAxis axis);

}  // namespace striper
