// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <opencv2/imgproc.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/robust.hpp>

#include "ambient/pixels/clipped_part.hpp"
#include "ambient/pixels/colour_difference.hpp"

namespace striper {
namespace {

constexpr int kBlue = 0;
constexpr int kGreen = 1;
constexpr int kRed = 2;

// Scan lines are looked at in pairs of neighbours, this far apart.
constexpr int kPairSpacing = 4;
constexpr int kMostJumpPx = 2;
constexpr double kLeastSnr = 5.0;

// How much better than the best so far a channel must be. A difference loses light and can hollow
// out the stripe, so it has to show more scan lines that nothing else does.
constexpr double kChannelMargin = 0.02;
constexpr double kDifferenceMargin = 0.15;

// The brightest spot of a scan line.
struct Spot {
  int position;
  double amplitude;  // Above the scan line's median.
  int width;         // Pixels above half the amplitude, anywhere in the scan line.
};

Spot brightest_spot(const float* line, int length, std::vector<float>& scratch) {
  int position = 1;
  float best = -1e9F;
  for (int k = 1; k + 1 < length; ++k) {
    const float sum = line[k - 1] + line[k] + line[k + 1];
    if (sum > best) {
      best = sum;
      position = k;
    }
  }
  scratch.assign(line, line + length);
  const double median = upper_median(scratch);
  const double amplitude = best / 3.0 - median;
  const double half = median + 0.5 * amplitude;
  const auto above = std::count_if(line, line + length, [&](float value) { return value > half; });
  return {position, amplitude, static_cast<int>(above)};
}

// Whether the brightest spot of a colour difference is one side of a stripe whose core is clipped
// to white: beyond bright pixels in which the difference vanishes there is the stripe's other side.
// Corrected (ColourDifference), it shows no more than the stripe's own colour does, so that is
// chosen.
bool is_side_of_a_hollow_line(const float* difference, const float* lit, int length,
                              const Spot& spot, double clipped_level) {
  constexpr int kFarthest = 24;
  const double peak = difference[spot.position];
  for (const int direction : {-1, 1}) {
    bool in_core = false;
    for (int step = 1; step <= kFarthest; ++step) {
      const int k = spot.position + direction * step;
      if (k < 0 || k >= length) break;
      if (lit[k] >= clipped_level && difference[k] < 0.5 * peak) in_core = true;
      if (in_core && difference[k] > 0.6 * peak) return true;
    }
  }
  return false;
}

// The median absolute difference of neighbours, as the sigma of a normal distribution.
double line_noise(const float* line, int length, std::vector<float>& scratch) {
  scratch.resize(static_cast<std::size_t>(length - 1));
  for (int k = 0; k + 1 < length; ++k) {
    scratch[static_cast<std::size_t>(k)] = std::abs(line[k + 1] - line[k]);
  }
  return std::max(0.5, kSigmaOfMedianAbsolute / std::sqrt(2.0) * upper_median(scratch));
}

// A channel's scan lines one after the other in memory, whatever the axis.
cv::Mat as_lines(const cv::Mat& image, StripeAxis axis) {
  cv::Mat lines;
  image.convertTo(lines, CV_32F);
  return axis == StripeAxis::kColumns ? cv::Mat(lines.t()) : lines;
}

// The fraction of neighbouring scan lines that agree about a narrow bright spot, and how it stands
// out of the noise.
struct LineEvidence {
  double agreement = 0.0;
  double snr = 0.0;
};

LineEvidence line_evidence(const ChannelImages& channel, StripeAxis axis, double clipped_level) {
  const cv::Mat lit = as_lines(channel.lit, axis);
  const bool is_difference = !channel.dark.empty();
  const cv::Mat values = is_difference ? cv::Mat(lit - as_lines(channel.dark, axis)) : lit;
  const int length = values.cols;
  if (length < 3 || values.rows < 2) return {};
  // A stripe covers 3 % of the pixels across it at most; whatever covers more is a surface.
  const int widest = std::max(12, length / 32);

  std::vector<float> scratch;
  std::vector<double> snrs;
  int pairs = 0;
  for (int i = 0; i + 1 < values.rows; i += kPairSpacing) {
    ++pairs;
    const Spot a = brightest_spot(values.ptr<float>(i), length, scratch);
    const Spot b = brightest_spot(values.ptr<float>(i + 1), length, scratch);
    const double noise = line_noise(values.ptr<float>(i), length, scratch);
    const bool narrow = a.width <= widest && b.width <= widest;
    const bool strong = std::min(a.amplitude, b.amplitude) > kLeastSnr * noise;
    const bool together = std::abs(a.position - b.position) <= kMostJumpPx;
    if (!narrow || !strong || !together) continue;
    if (is_difference && is_side_of_a_hollow_line(values.ptr<float>(i), lit.ptr<float>(i), length,
                                                  a, clipped_level)) {
      continue;
    }
    snrs.push_back(0.5 * (a.amplitude + b.amplitude) / noise);
  }
  if (snrs.empty()) return {};
  const double agreement = static_cast<double>(snrs.size()) / pairs;
  return {agreement, upper_median(snrs)};
}

void difference_of(const cv::Mat& image, int lit, int dark, ChannelImages& reuse) {
  cv::extractChannel(image, reuse.lit, lit);
  cv::extractChannel(image, reuse.dark, dark);
}

}  // namespace

void select_channel(const cv::Mat& image, Channel channel, ChannelImages& reuse) {
  if (image.channels() == 1) {
    reuse.lit = image;
    reuse.dark.release();
    return;
  }
  // A matrix that is still shared with somebody's frame must not be written into.
  if (!is_sole_owner(reuse.lit)) reuse.lit.release();
  switch (channel) {
    case Channel::kGreenMinusRed:
      return difference_of(image, kGreen, kRed, reuse);
    case Channel::kRedMinusGreen:
      return difference_of(image, kRed, kGreen, reuse);
    case Channel::kRed:
      cv::extractChannel(image, reuse.lit, kRed);
      break;
    case Channel::kGreen:
      cv::extractChannel(image, reuse.lit, kGreen);
      break;
    case Channel::kBlue:
      cv::extractChannel(image, reuse.lit, kBlue);
      break;
    case Channel::kGrey:
    case Channel::kAuto:
      cv::cvtColor(image, reuse.lit, cv::COLOR_BGR2GRAY);
      break;
  }
  reuse.dark.release();
}

LitFrame lit_frame_of_channel(const cv::Mat& image, Channel channel, StripeAxis axis,
                              int full_scale_dn) {
  ChannelImages images;
  select_channel(image, channel, images);
  LitFrame frame;
  frame.lit = images.lit;
  frame.dark = images.dark;
  frame.full_scale_dn = full_scale_dn;
  if (!frame.dark.empty()) detail::ColourDifference().correct(frame, axis);
  return frame;
}

Channel choose_channel(const cv::Mat& image, StripeAxis axis) {
  if (image.channels() == 1) return Channel::kGrey;
  // Where two are about as good the earlier one wins.
  constexpr std::array kCandidates{Channel::kGrey,          Channel::kRed,
                                   Channel::kGreen,         Channel::kBlue,
                                   Channel::kGreenMinusRed, Channel::kRedMinusGreen};
  double brightest = 0.0;
  cv::minMaxLoc(image.reshape(1), nullptr, &brightest);
  const double clipped_level = detail::kClippedPart * brightest;
  Channel best = Channel::kGrey;
  double best_score = -1.0;
  ChannelImages images;
  for (const Channel channel : kCandidates) {
    select_channel(image, channel, images);
    const LineEvidence evidence = line_evidence(images, axis, clipped_level);
    // Agreement decides; how far the stripe stands out breaks ties.
    const double score = evidence.agreement + 0.05 * std::min(1.0, evidence.snr / 50.0);
    const bool is_difference = !images.dark.empty();
    if (score > best_score + (is_difference ? kDifferenceMargin : kChannelMargin)) {
      best_score = score;
      best = channel;
    }
  }
  return best;
}

}  // namespace striper
