// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/core/error.hpp>
#include <striper/laser_plane/board_stripe.hpp>
#include <striper/stripe/extractor.hpp>

#include "laser_plane/straight_line.hpp"

namespace striper {
namespace {

constexpr double kMarginSquares = 3.0;  // How far beyond the print the board may go on.
constexpr std::size_t kMostPoints = 120;
constexpr int kFewestOnLine = 20;
constexpr double kLeastGatePx = 0.5;
constexpr double kMostLineRmsPx = 4.0;  // A blurred, speckled line; noise scatters by dozens.
constexpr std::size_t kTrialPictures = 6;

// The method that the points of a board are found with.
std::unique_ptr<StripeExtractor> best_extractor(StripeAxis axis,
                                                const std::optional<NoiseModel>& noise) {
  ExtractOptions options;
  options.axis = axis;
  options.noise = noise;
  // The refined method on a picture masked down to the board is still to be measured; this one is
  // (it puts the points of a session where they belong, which the refined one did not).
  options.method = ExtractMethod::kPaper;
  return make_extractor(options);
}

// How much light a point of the board's plane sends back: 1 white, 0 black; white off the print.
int albedo(const Board& board, const Eigen::Vector2d& p_m) {
  const double x = p_m.x() / board.square_m;
  const double y = p_m.y() / board.square_m;
  if (board.pattern == Board::Pattern::kCircles) {
    const double dx = x - std::clamp(std::round(x), 0.0, board.columns - 1.0);
    const double dy = y - std::clamp(std::round(y), 0.0, board.rows - 1.0);
    return std::hypot(dx, dy) < 0.3 ? 0 : 1;
  }
  if (x < -1.0 || y < -1.0 || x > board.columns || y > board.rows) return 1;
  const int parity = static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y));
  return parity & 1;
}

// Where a pixel's ray meets the board's plane; empty behind the camera.
std::optional<Eigen::Vector2d> on_board(const CameraModel& camera,
                                        const Eigen::Isometry3d& T_board_cam,
                                        const Eigen::Vector2d& pixel) {
  const Unprojection ray = camera.unproject(pixel);
  if (ray.status != CameraStatus::kOk) return std::nullopt;
  const Eigen::Vector3d centre = T_board_cam.translation();
  const Eigen::Vector3d r = T_board_cam.linear() * Eigen::Vector3d(ray.xy.x(), ray.xy.y(), 1.0);
  const double along = -centre.z() / r.z();
  if (!(along > 0.0)) return std::nullopt;
  return Eigen::Vector2d((centre + along * r).head<2>());
}

// True where black meets white under the profile of a return.
bool straddles_albedo_edge(const Board& board, const CameraModel& camera,
                           const Eigen::Isometry3d& T_board_cam, const Eigen::Vector2d& pixel,
                           const Eigen::Vector2d& across, double reach_px) {
  int first = -1;
  for (int step = -4; step <= 4; ++step) {
    const auto p = on_board(camera, T_board_cam, pixel + 0.25 * step * reach_px * across);
    if (!p) return true;
    const int here = albedo(board, *p);
    if (first < 0) first = here;
    if (here != first) return true;
  }
  return false;
}

LitFrame lit_frame(const LaserPicture& picture, const StripeRecipe& recipe) {
  ChannelImages on;
  select_channel(picture.on, recipe.channel, on);
  LitFrame frame;
  frame.lit = on.lit;
  frame.dark = on.dark;
  frame.full_scale_dn = (1 << picture.bit_depth) - 1;
  if (recipe.subtract_off && on.dark.empty()) {
    ChannelImages off;
    select_channel(picture.off, recipe.channel, off);
    frame.dark = off.lit;
  }
  return frame;
}

struct Returns {
  std::vector<Eigen::Vector2d> pixel;
  std::vector<Eigen::Vector2d> undistorted;  // (along, across) in pixels of a lens without
                                             // distortion.
  std::vector<double> sigma_px;
  std::vector<float> amplitude_dn;
  std::vector<float> width_px;
};

Returns returns_on_board(const LaserPicture& picture, const cv::Mat& mask,
                         const CameraModel& camera, const StripeRecipe& recipe,
                         const std::optional<NoiseModel>& noise) {
  LitFrame frame = lit_frame(picture, recipe);
  cv::bitwise_not(mask, frame.blind);
  Stripe stripe;
  best_extractor(recipe.axis, noise)->extract(frame, stripe);
  const bool columns = recipe.axis == StripeAxis::kColumns;
  Returns returns;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (verdict(stripe.status[i]) == Verdict::kMissing) continue;
    const Eigen::Vector2d pixel(stripe.u_px(i), stripe.v_px(i));
    const Unprojection ray = camera.unproject(pixel);
    const double sigma_px = stripe.sigma_px[i];
    if (ray.status != CameraStatus::kOk || !(sigma_px > 0.0) || !std::isfinite(sigma_px)) continue;
    const Eigen::Vector2d flat(camera.fx() * ray.xy.x(), camera.fy() * ray.xy.y());
    returns.pixel.push_back(pixel);
    returns.undistorted.push_back(columns ? flat : Eigen::Vector2d(flat.y(), flat.x()));
    returns.sigma_px.push_back(sigma_px);
    returns.amplitude_dn.push_back(stripe.amplitude_dn[i]);
    returns.width_px.push_back(stripe.width_px[i]);
  }
  return returns;
}

double median(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Averages neighbouring returns, weighted, until there are few enough: along a line that costs
// nothing and makes the adjustment fast.
void average_neighbours(const Returns& returns, const std::vector<std::size_t>& kept,
                        BoardStripe& stripe) {
  const std::size_t group = (kept.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t first = 0; first < kept.size(); first += group) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weights = 0.0;
    for (std::size_t k = first; k < std::min(first + group, kept.size()); ++k) {
      const std::size_t i = kept[k];
      const double weight = 1.0 / (returns.sigma_px[i] * returns.sigma_px[i]);
      sum += weight * returns.pixel[i];
      weights += weight;
    }
    stripe.pixel.emplace_back(sum / weights);
    stripe.sigma_px.push_back(1.0 / std::sqrt(weights));
  }
}

// Scatter over the root of the number: how well the picture's line is known. Infinite without one.
double line_uncertainty_px(const BoardStripe& stripe) {
  if (!stripe.found()) return std::numeric_limits<double>::infinity();
  return std::max(stripe.line_rms_px, 0.02) / std::sqrt(static_cast<double>(stripe.on_line));
}

// Exposure or ambient light may differ between the two pictures of a pair; then taking one off the
// other leaves the pattern, or worse.
bool off_is_comparable(const LaserPicture& picture, const cv::Mat& mask) {
  if (picture.off.empty() || picture.off.size() != picture.on.size() ||
      picture.off.type() != picture.on.type())
    return false;
  const double on = cv::norm(cv::mean(picture.on, mask));
  const double off = cv::norm(cv::mean(picture.off, mask));
  return off < 1.1 * on && on < 1.5 * off + 5.0;
}

std::vector<Channel> candidate_channels(const cv::Mat& image, Channel given) {
  if (image.channels() == 1) return {Channel::kGrey};
  if (given != Channel::kAuto) return {given};
  return {Channel::kGrey, Channel::kRed,           Channel::kGreen,
          Channel::kBlue, Channel::kGreenMinusRed, Channel::kRedMinusGreen};
}

std::vector<StripeRecipe> candidate_recipes(const LaserPicture& picture, const cv::Mat& mask,
                                            std::optional<StripeAxis> axis, Channel channel) {
  std::vector<StripeRecipe> recipes;
  const bool may_subtract = off_is_comparable(picture, mask);
  for (const StripeAxis a : {StripeAxis::kColumns, StripeAxis::kRows}) {
    if (axis && *axis != a) continue;
    for (const Channel c : candidate_channels(picture.on, channel)) {
      const bool difference = c == Channel::kGreenMinusRed || c == Channel::kRedMinusGreen;
      recipes.push_back({a, c, false});
      if (may_subtract && !difference) recipes.push_back({a, c, true});
    }
  }
  return recipes;
}

}  // namespace

std::string to_string(const StripeRecipe& recipe) {
  return fmt::format("{} {}{}", to_string(recipe.axis), to_string(recipe.channel),
                     recipe.subtract_off ? ", laser-off picture subtracted" : "");
}

cv::Mat board_mask(const Board& board, const CameraModel& camera,
                   const Eigen::Isometry3d& T_cam_board, double margin_squares) {
  const double out = board.print_border_m() + margin_squares * board.square_m;
  const Eigen::Vector2d low(-out, -out);
  const Eigen::Vector2d high = 2.0 * board.half_extent_m() + Eigen::Vector2d(out, out);
  const std::array<Eigen::Vector2d, 5> ring = {low, Eigen::Vector2d(high.x(), low.y()), high,
                                               Eigen::Vector2d(low.x(), high.y()), low};
  constexpr int kSteps = 24;  // A straight edge is curved in the picture.
  std::vector<cv::Point> outline;
  for (std::size_t side = 0; side + 1 < ring.size(); ++side)
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Vector2d p = ring[side] + (ring[side + 1] - ring[side]) * step / kSteps;
      const Projection at = camera.project(T_cam_board * Eigen::Vector3d(p.x(), p.y(), 0.0));
      if (at.status != CameraStatus::kOk) continue;
      const Eigen::Vector2d clamped = at.pixel.cwiseMax(-1e4).cwiseMin(1e5);
      outline.emplace_back(static_cast<int>(std::lround(clamped.x())),
                           static_cast<int>(std::lround(clamped.y())));
    }
  cv::Mat mask = cv::Mat::zeros(camera.height(), camera.width(), CV_8UC1);
  if (outline.size() >= 3)
    cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{outline}, cv::Scalar(255));
  return mask;
}

BoardStripe find_board_stripe(const LaserPicture& picture, const Board& board,
                              const CameraModel& camera, const StripeRecipe& recipe,
                              const std::optional<NoiseModel>& noise) {
  const cv::Mat mask = board_mask(board, camera, picture.T_cam_board, kMarginSquares);
  const Returns returns = returns_on_board(picture, mask, camera, recipe, noise);
  BoardStripe stripe;
  stripe.returns = static_cast<int>(returns.pixel.size());
  const auto line = detail::fit_line(returns.undistorted, kLeastGatePx);
  stripe.on_line = line ? static_cast<int>(line->inliers.size()) : 0;
  if (stripe.on_line < kFewestOnLine || 3 * stripe.on_line < stripe.returns) {
    stripe.reason =
        fmt::format("no straight stripe on the board ({} returns, {} of them on a line)",
                    stripe.returns, stripe.on_line);
    return stripe;
  }
  if (line->rms > kMostLineRmsPx) {
    stripe.reason = fmt::format(
        "no straight stripe on the board (the returns scatter by {:.0f} px)", line->rms);
    return stripe;
  }
  stripe.line_rms_px = line->rms;
  stripe.width_px = median(returns.width_px);
  stripe.amplitude_dn = median(returns.amplitude_dn);
  const Eigen::Isometry3d T_board_cam = picture.T_cam_board.inverse();
  const Eigen::Vector2d across =
      recipe.axis == StripeAxis::kColumns ? Eigen::Vector2d(0.0, 1.0) : Eigen::Vector2d(1.0, 0.0);
  std::vector<std::size_t> kept;
  for (const std::size_t i : line->inliers) {
    const double reach_px =
        1.0 + 2.5 * std::max(1.0, std::min<double>(returns.width_px[i], 2.0 * stripe.width_px));
    if (straddles_albedo_edge(board, camera, T_board_cam, returns.pixel[i], across, reach_px))
      ++stripe.at_albedo_edge;
    else
      kept.push_back(i);
  }
  if (static_cast<int>(kept.size()) < kFewestOnLine / 2) {
    stripe.reason = fmt::format(
        "the stripe lies on black-white edges of the board almost everywhere ({} of {} returns)",
        stripe.at_albedo_edge, stripe.on_line);
    return stripe;
  }
  average_neighbours(returns, kept, stripe);
  return stripe;
}

StripeRecipe choose_recipe(const std::vector<LaserPicture>& pictures, const Board& board,
                           const CameraModel& camera, std::optional<StripeAxis> axis,
                           Channel channel) {
  if (pictures.empty()) return {axis.value_or(StripeAxis::kColumns), Channel::kGrey, false};
  const cv::Mat first_mask =
      board_mask(board, camera, pictures.front().T_cam_board, kMarginSquares);
  const std::size_t step = std::max<std::size_t>(1, pictures.size() / kTrialPictures);
  std::optional<StripeRecipe> best;
  double best_score = 0.0;
  for (const StripeRecipe& recipe :
       candidate_recipes(pictures.front(), first_mask, axis, channel)) {
    // The information about the lines, summed: a picture without a line adds nothing.
    double score = 0.0;
    for (std::size_t i = 0; i < pictures.size(); i += step) {
      if (recipe.subtract_off && pictures[i].off.empty()) continue;
      const double uncertainty_px =
          line_uncertainty_px(find_board_stripe(pictures[i], board, camera, recipe));
      if (std::isfinite(uncertainty_px)) score += 1.0 / uncertainty_px;
    }
    if (score > best_score) best_score = score, best = recipe;
  }
  if (!best)
    throw Error(
        ErrorKind::kUntrustworthy,
        fmt::format("no stripe was found on the board in any of {} pictures, in no channel, "
                    "neither along columns nor along rows: is the laser on in them, and "
                    "does it cross the board?",
                    pictures.size()));
  return *best;
}

}  // namespace striper
