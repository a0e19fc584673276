// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/laser_plane/board_stripe.hpp>

#include "laser_plane/board_paper.hpp"
#include "laser_plane/coarse_line.hpp"

namespace striper {
namespace {

using detail::kMarginSquares;

constexpr std::size_t kTrialImages = 6;

// Scatter over the root of the number: how well the image's line is known. Infinite without one.
double line_uncertainty_px(const BoardStripe& stripe) {
  if (!stripe.found()) return std::numeric_limits<double>::infinity();
  return std::max(stripe.line_rms_px, 0.02) / std::sqrt(static_cast<double>(stripe.on_line));
}

// Exposure or ambient light may differ between the two images of a pair; then subtracting one from
// the other leaves the pattern, or worse.
bool off_is_comparable(const LaserImage& image, const cv::Mat& mask) {
  if (image.off.empty() || image.off.size() != image.on.size() ||
      image.off.type() != image.on.type())
    return false;
  const double on = cv::norm(cv::mean(image.on, mask));
  const double off = cv::norm(cv::mean(image.off, mask));
  return off < 1.1 * on && on < 1.5 * off + 5.0;
}

std::vector<Channel> candidate_channels(const cv::Mat& image, Channel given) {
  if (image.channels() == 1) return {Channel::kGrey};
  if (given != Channel::kAuto) return {given};
  return {Channel::kGrey, Channel::kRed,           Channel::kGreen,
          Channel::kBlue, Channel::kGreenMinusRed, Channel::kRedMinusGreen};
}

std::vector<ExtractionSettings> candidate_compared_settings(const LaserImage& image,
                                                            const cv::Mat& mask,
                                                            std::optional<StripeAxis> axis,
                                                            Channel channel) {
  std::vector<ExtractionSettings> compared_settings;
  const bool may_subtract = off_is_comparable(image, mask);
  for (const StripeAxis a : {StripeAxis::kColumns, StripeAxis::kRows}) {
    if (axis && *axis != a) continue;
    for (const Channel c : candidate_channels(image.on, channel)) {
      const bool difference = is_colour_difference(c);
      compared_settings.push_back({a, c, false});
      if (may_subtract && !difference) compared_settings.push_back({a, c, true});
    }
  }
  return compared_settings;
}

struct Impression {
  ExtractionSettings settings;
  double score;
};

// The information about the lines, summed: an image without a line adds nothing.
double score_of(const ExtractionSettings& settings, const std::vector<LaserImage>& images,
                const Board& board, const CameraModel& camera) {
  double score = 0.0;
  const std::size_t step = std::max<std::size_t>(1, images.size() / kTrialImages);
  for (std::size_t i = 0; i < images.size(); i += step) {
    if (settings.subtract_off && images[i].off.empty()) continue;
    const double uncertainty_px = line_uncertainty_px(
        detail::find_coarse_line(images[i], board, camera, settings, std::nullopt).stripe);
    if (std::isfinite(uncertainty_px)) score += 1.0 / uncertainty_px;
  }
  return score;
}

// Of its kind (lit images alone, or with the others subtracted) among the best, and with a fair
// part of the best one's information: each costs some 30 ms an image more. Where none of these is
// right the others are tried, so that the two bounds decide the time and not the result.
bool is_plausible(const Impression& one, const std::vector<Impression>& best_first) {
  constexpr int kMost = 4;
  constexpr double kLeastPart = 0.3;
  int before = 0;
  for (const Impression& other : best_first) {
    if (other.settings.subtract_off != one.settings.subtract_off) continue;
    if (other.settings == one.settings) return true;
    if (++before == kMost || one.score < kLeastPart * other.score) return false;
  }
  return false;
}

}  // namespace

std::string to_string(const ExtractionSettings& settings) {
  return fmt::format("{} {}{}", to_string(settings.axis), to_string(settings.channel),
                     settings.subtract_off ? ", laser-off image subtracted" : "");
}

SettingsRanking rank_settings(const std::vector<LaserImage>& images, const Board& board,
                              const CameraModel& camera, std::optional<StripeAxis> axis,
                              Channel channel) {
  std::vector<Impression> impressions;
  if (!images.empty()) {
    const cv::Mat first_mask =
        board_mask(board, camera, images.front().T_cam_board, kMarginSquares);
    for (const ExtractionSettings& settings :
         candidate_compared_settings(images.front(), first_mask, axis, channel)) {
      const double score = score_of(settings, images, board, camera);
      if (score > 0.0) impressions.push_back({settings, score});
    }
  }
  std::stable_sort(impressions.begin(), impressions.end(),
                   [](const Impression& a, const Impression& b) { return a.score > b.score; });
  SettingsRanking ranking;
  for (const Impression& one : impressions)
    (is_plausible(one, impressions) ? ranking.plausible : ranking.others).push_back(one.settings);
  if (impressions.empty())
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("no stripe was found on the board in any of {} images, in no channel, "
                            "neither along columns nor along rows: is the laser on in them, and "
                            "does it cross the board?",
                            images.size()));
  return ranking;
}

}  // namespace striper
