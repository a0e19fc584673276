// SPDX-License-Identifier: Apache-2.0
#include "laser_plane/coarse_line.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <striper/ambient/channel_choice.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/robust.hpp>

#include "laser_plane/board_paper.hpp"

namespace striper::detail {
namespace {

constexpr int kFewestOnLine = 20;
constexpr double kLeastGatePx = 0.5;
constexpr double kMostLineRmsPx = 4.0;  // A blurred, speckled line; noise scatters by dozens.

// The line is looked for with the method that takes the brightest pixel: white squares among black
// ones are peaks too, and the others would learn the width of these for the stripe's.
std::unique_ptr<StripeExtractor> coarse_extractor(const ExtractionSettings& settings,
                                                  const std::optional<NoiseModel>& noise) {
  ExtractOptions options;
  options.axis = settings.axis;
  options.noise = noise;
  options.method = ExtractMethod::kPaper;
  return make_extractor(options);
}

LitFrame lit_frame(const LaserImage& image, const ExtractionSettings& settings) {
  LitFrame frame = lit_frame_of_channel(image.on, settings.channel, settings.axis,
                                        full_scale_dn(image.bit_depth));
  if (settings.subtract_off && frame.dark.empty()) {
    ChannelImages off;
    select_channel(image.off, settings.channel, off);
    frame.dark = off.lit;
  }
  return frame;
}

// Whether a pixel beside a return's own is at full scale.
bool is_clipped(const LitFrame& frame, const Eigen::Vector2d& pixel) {
  const cv::Point at(static_cast<int>(std::lround(pixel.x())),
                     static_cast<int>(std::lround(pixel.y())));
  const cv::Rect near = cv::Rect(at.x - 1, at.y - 1, 3, 3) & cv::Rect({}, frame.lit.size());
  double brightest = 0.0;
  cv::minMaxLoc(frame.lit(near), nullptr, &brightest);
  return brightest >= frame.full_scale_dn;
}

std::string why_no_line(const BoardStripe& stripe, const std::optional<StraightLine>& line) {
  if (stripe.on_line < kFewestOnLine || 3 * stripe.on_line < stripe.returns)
    return fmt::format("no straight stripe on the board ({} returns, {} of them on a line)",
                       stripe.returns, stripe.on_line);
  if (line->rms > kMostLineRmsPx)
    return fmt::format("no straight stripe on the board (the returns scatter by {:.0f} px)",
                       line->rms);
  return {};
}

}  // namespace

Returns returns_within(const cv::Mat& seen, const LaserImage& image, const CameraModel& camera,
                       const ExtractionSettings& settings, StripeExtractor& extractor,
                       Verdict worst) {
  LitFrame frame = lit_frame(image, settings);
  cv::bitwise_not(seen, frame.masked);
  Stripe stripe;
  extractor.extract(frame, stripe);
  const bool columns = settings.axis == StripeAxis::kColumns;
  Returns returns;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (verdict(stripe.status[i]) > worst) continue;
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
    returns.clipped.push_back(is_clipped(frame, pixel) ? 1 : 0);
  }
  return returns;
}

double median_of(const std::vector<float>& values, const std::vector<std::size_t>& some) {
  std::vector<float> chosen;
  chosen.reserve(some.size());
  for (const std::size_t i : some) chosen.push_back(values[i]);
  return upper_median(chosen);
}

std::optional<double> unclipped_width_px(const Returns& returns,
                                         const std::vector<std::size_t>& some) {
  constexpr std::size_t kFewest = 8;
  std::vector<float> widths;
  for (const std::size_t i : some)
    if (!returns.clipped[i]) widths.push_back(returns.width_px[i]);
  if (widths.size() < std::max(kFewest, some.size() / 4)) return std::nullopt;
  return upper_median(widths);
}

CoarseLine find_coarse_line(const LaserImage& image, const Board& board, const CameraModel& camera,
                            const ExtractionSettings& settings,
                            const std::optional<NoiseModel>& noise) {
  CoarseLine coarse;
  coarse.mask = board_mask(board, camera, image.T_cam_board, kMarginSquares);
  coarse.returns = returns_within(coarse.mask, image, camera, settings,
                                  *coarse_extractor(settings, noise), Verdict::kDoubtful);
  BoardStripe& stripe = coarse.stripe;
  stripe.returns = static_cast<int>(coarse.returns.pixel.size());
  const auto line = fit_line(coarse.returns.undistorted, kLeastGatePx);
  stripe.on_line = line ? static_cast<int>(line->inliers.size()) : 0;
  stripe.reason = why_no_line(stripe, line);
  if (!stripe.found()) return coarse;
  coarse.line = *line;
  stripe.line_rms_px = line->rms;
  stripe.width_px = unclipped_width_px(coarse.returns, line->inliers)
                        .value_or(median_of(coarse.returns.width_px, line->inliers));
  std::vector<float> amplitudes = coarse.returns.amplitude_dn;
  stripe.amplitude_dn = upper_median(amplitudes);
  return coarse;
}

}  // namespace striper::detail
