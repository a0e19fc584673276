// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include <striper/laser_plane/board_stripe.hpp>
#include <striper/stripe/extractor.hpp>

#include "laser_plane/board_ground.hpp"
#include "laser_plane/coarse_line.hpp"

namespace striper {
namespace {

using detail::BoardInPicture;
using detail::CoarseLine;
using detail::fit_line;
using detail::median;
using detail::median_width_px;
using detail::Returns;
using detail::returns_within;
using detail::StraightLine;

constexpr std::size_t kMostPoints = 120;
constexpr int kFewestPoints = 10;
constexpr int kFewestFine = 20;
constexpr double kLeastGatePx = 0.3;

// Along the line, where nothing is left to be mistaken for the stripe, the best there is.
std::unique_ptr<StripeExtractor> fine_extractor(const StripeRecipe& recipe, double width_px,
                                                const std::optional<NoiseModel>& noise) {
  ExtractOptions options;
  options.axis = recipe.axis;
  options.noise = noise;
  options.method = ExtractMethod::kRefined;
  options.stripe_sigma_px = width_px;
  return make_extractor(options);
}

// How far from its middle the stripe's light counts: albedo must not change under it.
double reach_px(double width_px) { return 1.0 + 2.5 * std::max(1.0, width_px); }

// Where the line runs in the picture: across for every column (kColumns) or row; NaN beyond its
// ends.
std::vector<double> across_of(const StraightLine& line, const Returns& returns,
                              const CameraModel& camera, StripeAxis axis) {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const std::size_t i : line.inliers) {
    first = std::min(first, returns.undistorted[i].x());
    last = std::max(last, returns.undistorted[i].x());
  }
  const bool columns = axis == StripeAxis::kColumns;
  std::vector<double> across(static_cast<std::size_t>(columns ? camera.width() : camera.height()),
                             std::numeric_limits<double>::quiet_NaN());
  constexpr double kStepPx = 0.5;  // Every line of the picture is met.
  for (double along = first; along <= last; along += kStepPx) {
    Eigen::Vector2d flat(along, line.offset + line.slope * along);
    if (!columns) std::swap(flat.x(), flat.y());
    const Projection at = camera.project({flat.x() / camera.fx(), flat.y() / camera.fy(), 1.0});
    if (at.status != CameraStatus::kOk) continue;
    const auto k = std::lround(columns ? at.pixel.x() : at.pixel.y());
    if (k >= 0 && k < static_cast<long>(across.size()))
      across[static_cast<std::size_t>(k)] = columns ? at.pixel.y() : at.pixel.x();
  }
  return across;
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

// The returns on the line under which no black meets white.
std::vector<std::size_t> clear_of_albedo_edges(const CoarseLine& coarse,
                                               const BoardInPicture& scene, StripeAxis axis) {
  std::vector<std::size_t> clear;
  for (const std::size_t i : coarse.line.inliers)
    if (!straddles_albedo_edge(scene, coarse.returns.pixel[i], axis,
                               reach_px(coarse.stripe.width_px)))
      clear.push_back(i);
  return clear;
}

// The line as the best extraction has it, and how wide the stripe is.
struct FineLine {
  Returns returns;
  StraightLine line;
  double width_px;
};

// What the returns scatter about their line beyond their own sigmas (speckle, paper, a background
// that is not quite straight) is an error that they have besides.
void add_scatter(const StraightLine& line, Returns& returns) {
  std::vector<float> sigmas;
  for (const std::size_t i : line.inliers)
    sigmas.push_back(static_cast<float>(returns.sigma_px[i]));
  const double own = median(std::move(sigmas));
  const double excess2 = line.rms * line.rms - own * own;
  if (!(excess2 > 0.0)) return;
  for (double& sigma : returns.sigma_px) sigma = std::sqrt(sigma * sigma + excess2);
}

// Extracts again along the line, on ground of one albedo in each column: black and white squares
// are peaks and steps too, which the fit would take for the stripe or for its background. Empty
// where too little of such ground is left to see the background on.
std::optional<FineLine> refine(const CoarseLine& coarse, const std::vector<std::size_t>& clear,
                               const LaserPicture& picture, const BoardInPicture& scene,
                               const StripeRecipe& recipe, const std::optional<NoiseModel>& noise) {
  std::vector<float> widths;
  for (const std::size_t i : clear) widths.push_back(coarse.returns.width_px[i]);
  double width_px = std::clamp(median(std::move(widths)), 0.5, 8.0);
  const double half_px = 6.0 + 12.0 * width_px;
  const std::vector<double> across =
      across_of(coarse.line, coarse.returns, scene.camera, recipe.axis);
  const cv::Mat seen =
      coarse.mask & even_ground(scene, across, recipe.axis, half_px, reach_px(width_px));
  std::optional<FineLine> fine;
  for (int pass = 0; pass < 2; ++pass) {  // With the width that the first one measures.
    Returns returns = returns_within(seen, picture, scene.camera, recipe,
                                     *fine_extractor(recipe, width_px, noise), Verdict::kGood);
    auto line = fit_line(returns.undistorted, kLeastGatePx);
    if (!line || static_cast<int>(line->inliers.size()) < kFewestFine) return std::nullopt;
    if (4 * line->inliers.size() < clear.size()) return std::nullopt;
    width_px = median_width_px(returns, *line);
    fine = FineLine{std::move(returns), std::move(*line), width_px};
  }
  add_scatter(fine->line, fine->returns);
  return fine;
}

}  // namespace

BoardStripe find_board_stripe(const LaserPicture& picture, const Board& board,
                              const CameraModel& camera, const StripeRecipe& recipe,
                              const std::optional<NoiseModel>& noise) {
  const CoarseLine coarse = detail::find_coarse_line(picture, board, camera, recipe, noise);
  BoardStripe stripe = coarse.stripe;
  if (!stripe.found()) return stripe;
  const BoardInPicture scene{board, camera, picture.T_cam_board.inverse()};
  const std::vector<std::size_t> clear = clear_of_albedo_edges(coarse, scene, recipe.axis);
  stripe.at_albedo_edge = stripe.on_line - static_cast<int>(clear.size());
  if (static_cast<int>(clear.size()) < kFewestPoints) {
    stripe.reason = fmt::format(
        "the stripe lies on black-white edges of the board almost everywhere ({} of {} returns)",
        stripe.at_albedo_edge, stripe.on_line);
    return stripe;
  }
  const auto fine = refine(coarse, clear, picture, scene, recipe, noise);
  if (fine) {
    stripe.line_rms_px = fine->line.rms;
    stripe.width_px = fine->width_px;
    average_neighbours(fine->returns, fine->line.inliers, stripe);
  } else {
    average_neighbours(coarse.returns, clear, stripe);
  }
  return stripe;
}

}  // namespace striper
