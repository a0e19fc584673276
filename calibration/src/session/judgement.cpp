// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/statistics.hpp>
#include <striper/geometry/triangulator.hpp>

#include "session/calibration_steps.hpp"

namespace striper::detail {
namespace {

constexpr double kBlurredPx = 2.5;
// Which part of a laser's returns may be clipped before it is said, and before it is a warning.
constexpr double kFewClipped = 0.1;
constexpr double kManyClipped = 0.8;
// By how much a focal length may differ before it is another lens: the worst set of real boards,
// bent by more than can be solved for, has fx 616 where the same camera's other images have 620.
constexpr double kOtherLens = 0.02;
constexpr std::size_t kFewestToCompare = 6;

void judge_images(Calibration& calibration) {
  std::size_t unreadable = 0;
  std::size_t lost = 0;
  std::size_t lost_stripes = 0;
  std::size_t lit = 0;
  std::string fault;
  std::string first;
  std::string blurred;
  for (const ImageResult& result : calibration.images) {
    if (!result.fault.empty()) {
      ++unreadable;
      fault += (fault.empty() ? "" : "; ") + result.fault;
      continue;
    }
    if (!result.board.found) {
      ++lost;
      if (first.empty()) first = result.image.name + ": " + result.board_reason;
    }
    if (result.laser >= 0) ++lit;
    if (result.laser >= 0 && result.view >= 0 && result.stripe_view < 0) ++lost_stripes;
    if (result.board.blur_px >
        kBlurredPx * std::max(1.0, calibration.observations.image_width / 1280.0))
      blurred += (blurred.empty() ? "" : ", ") + result.image.name;
  }
  if (unreadable > 0)
    note(calibration, Severity::kWarning, "pictures_unreadable",
         fmt::format("{} of {} images could not be read and {} left out ({})", unreadable,
                     calibration.images.size(), unreadable == 1 ? "is" : "are", fault),
         "copy or take them again");
  if (lost > 0)
    note(calibration, 4 * lost > calibration.images.size() ? Severity::kWarning : Severity::kInfo,
         "boards_not_found",
         fmt::format("the board was not found in {} of {} images ({})", lost,
                     calibration.images.size(), first),
         "the whole board must be in the image, sharp and evenly lit");
  if (lost_stripes > 0)
    note(calibration, 4 * lost_stripes > lit ? Severity::kWarning : Severity::kInfo,
         "stripes_not_found",
         fmt::format("no stripe was used in {} of {} laser images", lost_stripes, lit),
         "the laser must cross the board or its white margin");
  if (!blurred.empty())
    note(calibration, Severity::kWarning, "blurred", "blurred images: " + blurred,
         "hold the board still, expose shorter, focus");
}

void judge_clipping(Calibration& calibration) {
  for (int laser = 0; laser < static_cast<int>(calibration.model.lasers.size()); ++laser) {
    const double share = clipped_share(calibration, laser);
    if (share < kFewClipped) continue;
    note(
        calibration, share < kManyClipped ? Severity::kInfo : Severity::kWarning, "stripe_clipped",
        fmt::format("laser {}: {:.0f} % of its stripe is clipped (pixels at full scale), where its "
                    "place and width are less well known and its brightness is not",
                    laser, 100.0 * share),
        "expose shorter, or turn the laser's power down, until the stripe is just below full "
        "scale");
  }
}

void judge_validation(const CalibrationOptions& options, Calibration& calibration) {
  const CrossValidation& validation = calibration.validation;
  if (options.known_camera && !options.known_camera->covariance)
    note(calibration, Severity::kInfo, "camera_error_unknown",
         "the intrinsics that were given carry no covariance: the error bars leave the camera's "
         "own error out",
         "give a model of this program, which carries it, or calibrate the camera from these "
         "images too");
  if (validation.splits == 0) {
    if (!options.known_camera || !calibration.solution.planes.empty())
      note(calibration, Severity::kInfo, "not_cross_validated",
           "too few images to solve two halves of them against each other",
           "eight or more images let the halves be compared");
    return;
  }
  if (validation.covariance_factor <= 1.0) return;
  const double times = std::sqrt(validation.covariance_factor);
  note(calibration, times > 2.0 ? Severity::kWarning : Severity::kInfo, "halves_disagree",
       fmt::format(
           "two halves of the images disagree by more than their error bars say (NEES "
           "{:.1f}, expected {:.1f} to {:.1f}); all error bars were widened by {:.2f} for it",
           validation.nees, validation.nees_low, validation.nees_high, times),
       "the board may be bent, the lens model too simple, or the camera moved its focus");
}

// `sigma` with two digits, the value with as many decimals.
std::string with_sigma(double value, double variance) {
  const double sigma = std::sqrt(variance);
  const int decimals =
      sigma > 0.0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 9) : 2;
  return fmt::format("{:.{}f} +- {:.{}f}", value, decimals, sigma, decimals);
}

// Whether two cameras are further apart than a covariance allows, held parameters left out.
bool differ(const CameraModel& a, const CameraModel& b, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd moved = b.parameters() - a.parameters();
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < moved.size(); ++i)
    if (covariance(i, i) > 0.0) free.push_back(i);
  const Eigen::VectorXd e = moved(free);
  const double distance = e.dot(Eigen::MatrixXd(covariance(free, free)).ldlt().solve(e));
  return distance > chi2_quantile(0.9999, static_cast<double>(free.size()));
}

// By a misfit of these images: what a given camera adds is no matter of theirs.
void widen(double factor, Calibration& calibration) {
  JointSolution& solution = calibration.solution;
  solution.covariance *= factor;
  if (solution.from_known_camera.size() > 0)
    solution.covariance -= (factor - 1.0) * solution.from_known_camera;
  calibration.model.covariance->matrix = solution.covariance;
}

void predict_ranges(Calibration& calibration) {
  for (int laser = 0; laser < static_cast<int>(calibration.model.lasers.size()); ++laser) {
    const Triangulator triangulator(calibration.model, laser);
    double nearest_m = std::numeric_limits<double>::infinity();
    double farthest_m = 0.0;
    for (const auto& p : stripe_points_cam(calibration.observations, calibration.solution, laser)) {
      const Eigen::Vector3d q = triangulator.T_cam_scan().inverse() * p;
      nearest_m = std::min(nearest_m, q.head<2>().norm());
      farthest_m = std::max(farthest_m, q.head<2>().norm());
    }
    calibration.depths_m.emplace_back(nearest_m, farthest_m);
    calibration.range_sigmas.push_back(
        calibration.model.covariance
            ? predict_range_sigma(calibration.model, laser, {1.0, 2.0, 4.0}, nearest_m, farthest_m)
            : std::vector<RangeSigma>{});
  }
}

}  // namespace

// With more information an estimate moves by no more than it was uncertain before (Hausman 1978,
// with the covariance of the difference bounded by that of the corners).
void compare_cameras(const JointSolution& from_corners, Calibration& calibration) {
  const JointSolution& joint = calibration.solution;
  if (from_corners.covariance.size() == 0 || joint.covariance.size() == 0) return;
  if (!differ(from_corners.camera, joint.camera, from_corners.covariance)) return;
  note(calibration, Severity::kWarning, "stripes_move_camera",
       fmt::format(
           "the stripes move the camera from where the corners put it: fx from {} to {:.2f}",
           with_sigma(from_corners.camera.fx(), from_corners.covariance(0, 0)), joint.camera.fx()),
       "the board is not flat where the stripe lies on it, or gives way from image to image; "
       "calibrate the camera from images of a stiff board and give it with --intrinsics");
}

void compare_with_known_camera(const CalibrationOptions& options, Calibration& calibration) {
  if (calibration.observations.views.size() < kFewestToCompare) return;
  Observations corners = calibration.observations;
  corners.stripes.clear();
  JointOptions free = calibration.options;
  free.known_camera.reset();
  free.lens = options.known_camera->camera.lens();
  // From nothing: a camera that is far off may not lead to the one of these images, and what the
  // solution has besides (its planes) would be held to be unknown without stripes.
  free.start = nullptr;
  try {
    const JointSolution own = solve_joint(corners, free);
    if (own.covariance.size() == 0) return;
    Eigen::MatrixXd covariance = own.covariance;
    const Eigen::Index count = own.camera.parameters().size();
    if (options.known_camera->covariance)
      covariance.topLeftCorner(count, count) += *options.known_camera->covariance;
    const double moved = std::abs(own.camera.fx() / options.known_camera->camera.fx() - 1.0);
    if (moved < options.limits.high_focal_error ||
        !differ(options.known_camera->camera, own.camera, covariance))
      return;
    // With a laser the model is what ranges come from; a camera alone hands on what was given.
    const bool is_other_lens = moved >= kOtherLens && !calibration.solution.planes.empty();
    note(calibration, is_other_lens ? Severity::kRefusal : Severity::kWarning,
         "known_camera_differs",
         fmt::format("the intrinsics that were given do not fit these images: fx is {:.2f} in "
                     "them, {} from the corners here",
                     options.known_camera->camera.fx(),
                     with_sigma(own.camera.fx(), own.covariance(0, 0))),
         "were they made with this lens, at this focus? If so, the board here is bent more than "
         "can be solved for: use a stiff one");
  } catch (const Error&) {
    // These images alone give no camera, and have no say.
  }
}

void judge(const CalibrationOptions& options, Calibration& calibration) {
  report_progress(options, "cross-validating", 0.85);
  if (calibration.solution.covariance.size() > 0) {
    calibration.validation = cross_validate(calibration.observations, calibration.solution,
                                            calibration.options, options.threads);
    widen(calibration.validation.covariance_factor, calibration);
  }
  if (options.known_camera) compare_with_known_camera(options, calibration);
  judge_images(calibration);
  judge_clipping(calibration);
  judge_validation(options, calibration);
  for (Event& finding :
       check_trust(calibration.observations, calibration.solution, calibration.options,
                   calibration.model, calibration.validation.covariance_factor, options.limits))
    calibration.findings.push_back(std::move(finding));
  if (calibration.model.camera.folds_inside_image())
    note(calibration, Severity::kWarning, "lens_folds",
         "the lens model folds back inside the image: its corners cannot be used",
         "show the board in the corners of the image, or choose another --lens");
  predict_ranges(calibration);
  std::stable_sort(calibration.findings.begin(), calibration.findings.end(),
                   [](const Event& a, const Event& b) { return a.severity > b.severity; });
  calibration.forced = !calibration.trustworthy() && options.force;
}

void report_progress(const CalibrationOptions& options, const std::string& stage, double fraction) {
  if (options.progress) options.progress(stage, fraction);
}

void note(Calibration& calibration, Severity severity, EventCode code, std::string message,
          std::string advice) {
  calibration.findings.push_back({severity, code, std::move(message), std::move(advice)});
}

}  // namespace striper::detail
