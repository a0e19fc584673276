// SPDX-License-Identifier: Apache-2.0
#include "session/quality.hpp"

#include <cmath>
#include <iterator>

#include <ceres/version.h>
#include <fmt/format.h>

namespace striper::detail {
namespace {

std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::string("~");
}

std::string yaml_string(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + '"';
}

}  // namespace

std::string quality_yaml(const Calibration& calibration, const std::string& date) {
  const JointSolution& solution = calibration.solution;
  const CrossValidation& validation = calibration.validation;
  std::string yaml;
  const auto out = std::back_inserter(yaml);
  if (!date.empty()) fmt::format_to(out, "date: {}\n", yaml_string(date));
  fmt::format_to(out, "solver: Ceres {}\n", CERES_VERSION_STRING);
  fmt::format_to(out, "trustworthy: {}\n", calibration.trustworthy());
  if (calibration.forced) yaml += "forced: true\n";
  fmt::format_to(out, "verdict: {}\n", yaml_string(calibration.verdict()));
  fmt::format_to(out, "board: {}\nsquare_m: {}\n", to_string(calibration.observations.board),
                 number(calibration.observations.board.square_m));
  fmt::format_to(out, "views: {}\nstripe_views: {}\n", calibration.observations.views.size(),
                 calibration.observations.stripes.size());
  fmt::format_to(out, "corner_rms_px: {}\ncorner_sigma_px: {}\n", number(solution.corners.rms_px),
                 number(solution.corners.sigma_px));
  if (!calibration.observations.stripes.empty())
    fmt::format_to(out, "stripe_rms_px: {}\nstripe_sigma_factor: {}\n",
                   number(solution.stripes.rms_px), number(solution.stripes.sigma_factor));
  fmt::format_to(out, "outlier_points: {}\n", solution.outliers.size());
  if (calibration.bend_solved)
    fmt::format_to(out, "board_bend_m: [{}, {}]\n", number(solution.bend_m.x()),
                   number(solution.bend_m.y()));
  fmt::format_to(out, "held_out_corner_rms_px: {}\n", number(validation.corner_rms_px()));
  if (!calibration.observations.stripes.empty())
    fmt::format_to(out, "held_out_stripe_rms_px: {}\n", number(validation.stripe_rms_px()));
  if (validation.splits > 0)
    fmt::format_to(out,
                   "split_half: {{splits: {}, nees: {}, dof: {}, band: [{}, {}], "
                   "covariance_factor: {}}}\n",
                   validation.splits, number(validation.nees), number(validation.dof),
                   number(validation.nees_low), number(validation.nees_high),
                   number(validation.covariance_factor));
  for (std::size_t laser = 0; laser < calibration.range_sigmas.size(); ++laser)
    for (const RangeSigma& at : calibration.range_sigmas[laser])
      fmt::format_to(out, "laser{}_sigma_cal_at_{:g}m: {}\n", laser, at.range_m,
                     number(at.sigma_m));
  for (std::size_t laser = 0; laser < calibration.depths_m.size(); ++laser)
    fmt::format_to(out, "laser{}_calibrated_ranges_m: [{}, {}]\n", laser,
                   number(calibration.depths_m[laser].first),
                   number(calibration.depths_m[laser].second));
  return yaml;
}

}  // namespace striper::detail
