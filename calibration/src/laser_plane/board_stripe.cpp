// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include <striper/board/find_board.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/robust.hpp>
#include <striper/laser_plane/board_stripe.hpp>
#include <striper/stripe/extractor.hpp>

#include "laser_plane/board_ground.hpp"
#include "laser_plane/board_paper.hpp"
#include "laser_plane/coarse_line.hpp"
#include "laser_plane/stripe_colour.hpp"

namespace striper {
namespace {

using detail::BoardInImage;
using detail::CoarseLine;
using detail::find_paper;
using detail::fit_line;
using detail::is_on_white;
using detail::ProfileGround;
using detail::Returns;
using detail::returns_within;
using detail::StraightLine;
using detail::StripeCourse;
using detail::unclipped_width_px;

constexpr std::size_t kMostPoints = 120;
constexpr int kFewestPoints = 10;
constexpr double kLeastWidthPx = 0.4;
constexpr double kMostWidthPx = 8.0;
constexpr double kLeastGatePx = 0.3;

// Along the line, where nothing is left to be mistaken for the stripe, the best there is.
std::unique_ptr<StripeExtractor> fine_extractor(const ExtractionSettings& settings, double width_px,
                                                const std::optional<NoiseModel>& noise) {
  ExtractOptions options;
  options.axis = settings.axis;
  options.noise = noise;
  options.method = ExtractMethod::kRefined;
  options.stripe_sigma_px = width_px;
  options.each_line_by_itself = true;
  return make_extractor(options);
}

// How far from its middle the stripe's light counts, with a margin for what blurs an edge.
double reach_px(double width_px) { return 1.0 + 2.5 * std::max(1.0, width_px); }

// The ground that a profile is wanted on: all of it far from every edge; where the squares are too
// small for that, at least on one of them, next to the edges masked.
enum class Demand { kWholeProfile, kMostOfIt };
ProfileGround ground_for(double width_px, Demand demand) {
  const double far_px = 6.0 + 12.0 * width_px;
  if (demand == Demand::kMostOfIt) return {reach_px(width_px), 0.0, far_px};
  const double profile_px = std::ceil(2.0 * std::max(1.0, width_px));
  return {profile_px, profile_px, far_px};
}

// Where the line runs in the image: across for every column (kColumns) or row; NaN beyond its
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
  constexpr double kStepPx = 0.5;  // Every scan line is met.
  const int steps = static_cast<int>(std::max(-1.0, (last - first) / kStepPx));
  for (int step = 0; step <= steps; ++step) {
    const double along = first + kStepPx * step;
    Eigen::Vector2d flat(along, line.at(along));
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
                        const BoardInImage& scene, BoardStripe& stripe) {
  const std::size_t group = (kept.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t first = 0; first < kept.size(); first += group) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double weights = 0.0;
    for (std::size_t k = first; k < std::min(first + group, kept.size()); ++k) {
      const std::size_t i = kept[k];
      const double weight = 1.0 / (returns.sigma_px[i] * returns.sigma_px[i]);
      stripe.return_px.push_back(returns.pixel[i]);
      stripe.samples.push_back({returns.pixel[i], returns.width_px[i], returns.amplitude_dn[i],
                                returns.clipped[i] != 0, is_on_white(scene, returns.pixel[i])});
      sum += weight * returns.pixel[i];
      weights += weight;
    }
    stripe.pixel.emplace_back(sum / weights);
    stripe.sigma_px.push_back(1.0 / std::sqrt(weights));
  }
}

// The returns on the line under which no black meets white.
std::vector<std::size_t> clear_of_albedo_edges(const CoarseLine& coarse, const BoardInImage& scene,
                                               StripeAxis axis) {
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
  std::vector<double> sigmas;
  for (const std::size_t i : line.inliers) sigmas.push_back(returns.sigma_px[i]);
  const double own = upper_median(sigmas);
  const double excess2 = line.rms * line.rms - own * own;
  if (!(excess2 > 0.0)) return;
  for (double& sigma : returns.sigma_px) sigma = std::sqrt(sigma * sigma + excess2);
}

// Where a line is looked for, and how.
struct Surroundings {
  const LaserImage& image;
  const BoardInImage& scene;
  const StripeCourse& course;
  const ExtractionSettings& settings;
  const std::optional<NoiseModel>& noise;
};

// The line as the best extraction finds it, on ground of one albedo in each column: black and white
// squares are peaks and steps too, which the fit would take for the stripe or for its background.
class FineSearch {
 public:
  FineSearch(const CoarseLine& coarse, const Surroundings& around, Demand demand)
      : coarse_(coarse), around_(around), demand_(demand) {}

  // Empty where too little of such ground is left to see the background on.
  std::optional<FineLine> run(const std::vector<std::size_t>& clear) {
    std::optional<double> width_px = unclipped_width_px(coarse_.returns, clear);
    look_around(width_px.value_or(coarse_.stripe.width_px));
    if (!width_px) width_px = straightest_width_px();
    std::optional<FineLine> fine;
    for (int pass = 0; pass < 2 && width_px; ++pass) {  // With the width that the first measures.
      fine = line_of(*width_px);
      if (!fine) break;
      width_px = unclipped_width_px(fine->returns, fine->line.inliers);
      if (!width_px) width_px = straightest_width_px();
      if (width_px) look_around(*width_px);
    }
    if (fine) add_scatter(fine->line, fine->returns);
    return fine;
  }

 private:
  void look_around(double width_px) {
    const double about_px = std::clamp(width_px, kLeastWidthPx, kMostWidthPx);
    seen_ = coarse_.mask & even_ground(around_.scene, around_.course.across, around_.settings.axis,
                                       ground_for(about_px, demand_));
  }

  std::optional<FineLine> line_of(double width_px) const {
    width_px = std::clamp(width_px, kLeastWidthPx, kMostWidthPx);
    Returns returns =
        returns_within(seen_, around_.image, around_.scene.camera, around_.settings,
                       *fine_extractor(around_.settings, width_px, around_.noise), Verdict::kGood);
    auto line = fit_line(returns.undistorted, kLeastGatePx);
    if (!line || static_cast<int>(line->inliers.size()) < kFewestPoints) return std::nullopt;
    return FineLine{std::move(returns), std::move(*line), width_px};
  }

  // Where nearly every profile is clipped: the width with which the line is straightest. Fitted
  // with a wrong one, a profile without a top comes out up to a tenth of a pixel off, to and fro as
  // the line crosses the pixels.
  std::optional<double> straightest_width_px() const {
    constexpr double kStep = 1.06;
    constexpr int kSteps = 18;  // To 0.35 of the coarse width, which clipping makes too large.
    std::optional<double> best_px;
    double best = std::numeric_limits<double>::infinity();
    double width_px = coarse_.stripe.width_px;
    for (int step = 0; step < kSteps; ++step, width_px /= kStep) {
      const auto fine = line_of(width_px);
      if (!fine) continue;
      const double scatter_px = scatter(*fine);
      if (scatter_px < best) best = scatter_px, best_px = fine->width_px;
    }
    return best_px;
  }

  // Of all the returns: with a wrong width the line's inliers may be those that cross the pixels
  // alike. What is further off than the gate counts no more for that.
  static double scatter(const FineLine& fine) {
    double sum = 0.0;
    for (const Eigen::Vector2d& p : fine.returns.undistorted)
      sum += std::pow(std::min(std::abs(p.y() - fine.line.at(p.x())), kLeastGatePx), 2.0);
    return std::sqrt(sum / static_cast<double>(fine.returns.undistorted.size()));
  }

  const CoarseLine& coarse_;
  const Surroundings& around_;
  Demand demand_;
  cv::Mat seen_;
};

}  // namespace

BoardStripe find_board_stripe(const LaserImage& image, const Board& board,
                              const CameraModel& camera, const ExtractionSettings& settings,
                              const std::optional<NoiseModel>& noise) {
  const CoarseLine coarse = detail::find_coarse_line(image, board, camera, settings, noise);
  BoardStripe stripe = coarse.stripe;
  if (!stripe.found()) return stripe;
  const StripeCourse course{settings.axis,
                            across_of(coarse.line, coarse.returns, camera, settings.axis),
                            2.0 * reach_px(stripe.width_px)};
  const BoardInImage scene{board, camera, image.T_cam_board.inverse(),
                           find_paper(to_grey8(image.off.empty() ? image.on : image.off), board,
                                      camera, image.T_cam_board, course)};
  const std::vector<std::size_t> clear = clear_of_albedo_edges(coarse, scene, settings.axis);
  stripe.at_albedo_edge = stripe.on_line - static_cast<int>(clear.size());
  if (static_cast<int>(clear.size()) < kFewestPoints) {
    stripe.reason = fmt::format(
        "the stripe lies on black-white edges of the board almost everywhere ({} of {} returns)",
        stripe.at_albedo_edge, stripe.on_line);
    return stripe;
  }
  const Surroundings around{image, scene, course, settings, noise};
  std::optional<FineLine> fine;
  for (const Demand demand : {Demand::kWholeProfile, Demand::kMostOfIt})
    if (!fine) fine = FineSearch(coarse, around, demand).run(clear);
  if (fine) {
    stripe.line_rms_px = fine->line.rms;
    stripe.width_px = fine->width_px;
    average_neighbours(fine->returns, fine->line.inliers, scene, stripe);
  } else {
    average_neighbours(coarse.returns, clear, scene, stripe);
  }
  if (image.on.channels() == 3) {
    stripe.colour =
        detail::stripe_colour(image.on, stripe, settings.axis, full_scale_dn(image.bit_depth));
  }
  return stripe;
}

}  // namespace striper
