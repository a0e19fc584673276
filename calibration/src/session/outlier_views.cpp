// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include <striper/core/robust.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kFewestToCompare = 5;
constexpr double kViewOutlier = 4.0;    // Times the median view's rms,
constexpr double kLeastViewPx = 0.3;    // and this much more than it.
constexpr double kStripeOutlier = 5.0;  // Times the median stripe's rms,
constexpr double kLeastStripePx = 1.0;  // and this much.

// Of each view's corners, all of them, its pose solved.
std::vector<double> rms_of_views(const Calibration& calibration) {
  std::vector<double> rms;
  for (const CornerView& view : calibration.observations.views)
    solve_pose(calibration.solution.camera, calibration.observations.board, view,
               calibration.solution.bend_m, &rms.emplace_back());
  return rms;
}

// Of each stripe's points, all of them.
std::vector<double> rms_of_stripes(const Calibration& calibration) {
  const JointSolution& s = calibration.solution;
  std::vector<double> rms;
  for (const StripeView& stripe : calibration.observations.stripes)
    rms.push_back(stripe_rms_px(calibration.observations, stripe, s.camera,
                                s.T_cam_board[static_cast<std::size_t>(stripe.view)],
                                s.planes[static_cast<std::size_t>(stripe.laser)], s.bend_m));
  return rms;
}

double usual_of(std::vector<double> rms) { return upper_median(rms); }

}  // namespace

void leave_out_bad_views(Calibration& calibration) {
  if (calibration.observations.views.size() < kFewestToCompare) return;
  const std::vector<double> rms = rms_of_views(calibration);
  const double usual = usual_of(rms);
  std::vector<int> good;
  std::vector<int> new_index(rms.size(), -1);
  for (std::size_t v = 0; v < rms.size(); ++v) {
    if (rms[v] > std::max(kViewOutlier * usual, usual + kLeastViewPx)) continue;
    new_index[v] = static_cast<int>(good.size());
    good.push_back(static_cast<int>(v));
  }
  if (good.size() == rms.size() || good.size() < 3) return;
  for (ImageResult& result : calibration.images) {
    if (result.view < 0) continue;
    const auto old = static_cast<std::size_t>(result.view);
    result.view = new_index[old];
    if (result.view >= 0) continue;
    result.board_reason = fmt::format(
        "its corners fit to {:.2f} px only, the usual image's to {:.2f} px: blurred, bent, or of "
        "another camera",
        rms[old], usual);
    note(calibration, Severity::kWarning, "view_left_out",
         fmt::format("{}: left out, {}", result.image.name, result.board_reason),
         "look at the image; take it again with the board held still");
  }
  calibration.observations = calibration.observations.subset(good);
  calibration.solution = solve_joint(calibration.observations, calibration.options);
}

void leave_out_bad_stripes(Calibration& calibration) {
  if (calibration.observations.stripes.size() < kFewestToCompare) return;
  const std::vector<double> rms = rms_of_stripes(calibration);
  const double usual = usual_of(rms);
  std::vector<StripeView> kept;
  std::vector<int> new_index(rms.size(), -1);
  for (std::size_t s = 0; s < rms.size(); ++s) {
    if (!(rms[s] <= std::max(kStripeOutlier * usual, kLeastStripePx))) continue;
    new_index[s] = static_cast<int>(kept.size());
    kept.push_back(calibration.observations.stripes[s]);
  }
  if (kept.size() == rms.size() || 2 * kept.size() < rms.size()) return;
  for (ImageResult& result : calibration.images) {
    if (result.stripe_view < 0) continue;
    const auto old = static_cast<std::size_t>(result.stripe_view);
    result.stripe_view = new_index[old];
    if (result.stripe_view >= 0) continue;
    result.stripe_reason =
        fmt::format("its stripe lies {:.1f} px off the plane of the others (usual: {:.2f} px)",
                    rms[old], usual);
    note(calibration, Severity::kWarning, "stripe_left_out",
         fmt::format("{}: left out, {}", result.lit.name, result.stripe_reason),
         "is it a reflection, or did the laser move?");
  }
  calibration.observations.stripes = std::move(kept);
  calibration.solution = solve_joint(calibration.observations, calibration.options);
}

}  // namespace striper::detail
