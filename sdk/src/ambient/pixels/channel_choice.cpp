// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/robust.hpp>

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

// What tells the laser's colour: in so many of the pairs it shows a stripe. (In images of the real
// sets that have a stripe the laser's own does in .29 to all.)
constexpr double kLeastColoured = 0.1;

// And in half as many as grey shows a bright line in. (In one image of a red line in a dark room,
// that all of grey shows, blue has most: .35.)
constexpr double kLeastOfGrey = 0.5;

// Grey shows a colour's stripe if it has this share of it in the same place. Where it has less,
// something is brighter than the stripe.
constexpr double kSameInGrey = 0.9;

// How much better than the best so far a channel must be where no colour tells.
constexpr double kChannelMargin = 0.02;

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

// The median absolute difference of neighbours, as the sigma of a normal distribution.
double line_noise(const float* line, int length, std::vector<float>& scratch) {
  scratch.resize(static_cast<std::size_t>(length - 1));
  for (int k = 0; k + 1 < length; ++k) {
    scratch[static_cast<std::size_t>(k)] = std::abs(line[k + 1] - line[k]);
  }
  return std::max(0.5, kSigmaOfMedianAbsolute / std::sqrt(2.0) * upper_median(scratch));
}

// A stripe covers 3 % of the pixels across it at most; whatever covers more is a surface.
int widest_stripe(int length) { return std::max(12, length / 32); }

// In which pairs of scan lines an image shows a narrow bright spot beside that of the neighbour,
// and where.
struct ShownStripe {
  static constexpr int kNone = -1;

  std::vector<int> position;  // Of each pair, or kNone.
  double agreement = 0.0;     // The fraction of the pairs that have one,
  double snr = 0.0;           // and the median of how it stands out of the noise.

  /// Agreement decides, and where two are alike how far the stripe stands out.
  double score() const noexcept { return agreement + 0.05 * std::min(1.0, snr / 50.0); }

  /// How much of it another image shows in the same place: on either side of a hollow core.
  double share_in(const ShownStripe& other, int nearby) const {
    int own = 0;
    int same = 0;
    for (std::size_t pair = 0; pair < position.size(); ++pair) {
      if (position[pair] == kNone) continue;
      ++own;
      const bool is_any = other.position[pair] != kNone;
      same += is_any && std::abs(other.position[pair] - position[pair]) <= nearby ? 1 : 0;
    }
    return own == 0 ? 0.0 : static_cast<double>(same) / own;
  }
};

// @param pairs two scan lines after another, CV_32FC1.
ShownStripe stripe_shown_by(const cv::Mat& pairs) {
  const int length = pairs.cols;
  ShownStripe shown;
  std::vector<float> scratch;
  std::vector<double> snrs;
  const int widest = widest_stripe(length);
  for (int i = 0; i + 1 < pairs.rows; i += 2) {
    const Spot a = brightest_spot(pairs.ptr<float>(i), length, scratch);
    const Spot b = brightest_spot(pairs.ptr<float>(i + 1), length, scratch);
    const double noise = line_noise(pairs.ptr<float>(i), length, scratch);
    const bool narrow = a.width <= widest && b.width <= widest;
    const bool strong = std::min(a.amplitude, b.amplitude) > kLeastSnr * noise;
    const bool together = std::abs(a.position - b.position) <= kMostJumpPx;
    const bool is_any = narrow && strong && together;
    shown.position.push_back(is_any ? a.position : ShownStripe::kNone);
    if (is_any) snrs.push_back(0.5 * (a.amplitude + b.amplitude) / noise);
  }
  if (snrs.empty()) return shown;
  shown.agreement = static_cast<double>(snrs.size()) / static_cast<double>(shown.position.size());
  shown.snr = upper_median(snrs);
  return shown;
}

// Pairs of an image's scan lines as rows, CV_32FC3, whatever the axis.
cv::Mat pairs_of(const cv::Mat& image, StripeAxis axis) {
  const bool is_columns = axis == StripeAxis::kColumns;
  const int lines = is_columns ? image.cols : image.rows;
  const int length = is_columns ? image.rows : image.cols;
  const int pairs = (lines - 1 + kPairSpacing - 1) / kPairSpacing;
  cv::Mat all(2 * pairs, length, CV_32FC3);
  for (int i = 0; i < all.rows; ++i) {
    const int line = i / 2 * kPairSpacing + i % 2;
    cv::Mat row = all.row(i);
    const cv::Mat from = is_columns ? cv::Mat(image.col(line).t()) : image.row(line);
    from.convertTo(row, CV_32F);
  }
  return all;
}

// Where two are about as good the earlier one wins.
constexpr std::array kColours{std::pair(Channel::kRed, kRed), std::pair(Channel::kGreen, kGreen),
                              std::pair(Channel::kBlue, kBlue)};

// The colour of which there is more than of the others along a stripe, or grey. White and grey
// things do not show in that, however bright they are.
std::pair<Channel, ShownStripe> most_coloured(const std::vector<cv::Mat>& colours) {
  std::pair<Channel, ShownStripe> most{Channel::kGrey, {}};
  for (const auto& [channel, colour] : kColours) {
    cv::Mat excess = 1.5 * colours[static_cast<std::size_t>(colour)];
    for (const cv::Mat& each : colours) excess -= 0.5 * each;
    ShownStripe shown = stripe_shown_by(excess);
    const bool is_enough = shown.agreement >= kLeastColoured;
    if (is_enough && shown.score() > most.second.score()) most = {channel, std::move(shown)};
  }
  return most;
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
  const bool is_columns = axis == StripeAxis::kColumns;
  if ((is_columns ? image.rows : image.cols) < 3 || (is_columns ? image.cols : image.rows) < 2)
    return Channel::kGrey;
  const cv::Mat pairs = pairs_of(image, axis);
  std::vector<cv::Mat> colours;
  cv::split(pairs, colours);
  cv::Mat grey;
  cv::cvtColor(pairs, grey, cv::COLOR_BGR2GRAY);
  const ShownStripe in_grey = stripe_shown_by(grey);

  const auto [laser, excess] = most_coloured(colours);
  if (laser != Channel::kGrey && excess.agreement >= kLeastOfGrey * in_grey.agreement) {
    const bool is_brightest = excess.share_in(in_grey, widest_stripe(pairs.cols)) >= kSameInGrey &&
                              in_grey.agreement >= excess.agreement;
    return is_brightest ? Channel::kGrey : laser;
  }
  Channel best = Channel::kGrey;
  double best_score = in_grey.score();
  for (const auto& [channel, colour] : kColours) {
    const double score = stripe_shown_by(colours[static_cast<std::size_t>(colour)]).score();
    if (!(score > best_score + kChannelMargin)) continue;
    best_score = score;
    best = channel;
  }
  return best;
}

}  // namespace striper
