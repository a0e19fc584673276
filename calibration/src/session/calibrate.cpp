// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/session/calibrate.hpp>

#include "session/calibration_steps.hpp"
#include "session/quality.hpp"

namespace striper {
namespace {

constexpr std::size_t kFewestViewsForBend = 6;

class Calibrator {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options)
      : input_(input), options_(options) {}

  Calibration run() {
    const auto began = std::chrono::steady_clock::now();
    detail::list_images(input_, result_);
    detail::find_boards(input_, options_, result_);
    solve_camera();
    if (!input_.lasers.empty()) detail::find_stripes(input_, options_, result_);
    solve_everything();
    detail::judge(options_, result_);
    result_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    result_.model.quality_yaml = detail::quality_yaml(result_, options_.date);
    detail::report_progress(options_, "done", 1.0);
    return std::move(result_);
  }

 private:
  void solve_camera() {
    detail::report_progress(
        options_, options_.known_camera ? "finding the boards' poses" : "choosing the lens", 0.55);
    JointOptions& joint = result_.options;
    joint.known_camera = options_.known_camera;
    joint.threads = options_.threads;
    joint.remove_outliers = !options_.like_opencv;
    if (!options_.known_camera) {
      result_.lens = choose_lens(result_.observations, options_.lens);
      joint.lens = result_.lens.lens;
      joint.hold_k3 = result_.lens.hold_k3;
    }
    result_.solution = solve_joint(result_.observations, joint);
    if (options_.like_opencv) return;
    detail::leave_out_bad_views(result_);
    choose_bend();
  }

  // The bend is worth two parameters where it takes away a clear part of the residual and is known.
  void choose_bend() {
    if (result_.observations.views.size() < kFewestViewsForBend) return;
    JointOptions with_bend = result_.options;
    with_bend.solve_bend = true;
    // The same weights for both: else the flat board's misfit would excuse itself.
    with_bend.start = &result_.solution;
    try {
      JointSolution bent = solve_joint(result_.observations, with_bend);
      const Eigen::Vector2d sigma_m = bent.bend_covariance.diagonal().cwiseSqrt();
      const double sigmas = bent.bend_m.cwiseAbs().cwiseQuotient(sigma_m).maxCoeff();
      const double before = result_.solution.corners.sigma_px;
      if (bent.corners.sigma_px > 0.93 * before || !(sigmas > 5.0)) return;
      result_.solution = std::move(bent);
      result_.options.solve_bend = true;
      result_.bend_solved = true;
    } catch (const Error&) {
      // Without a bend it is, then.
    }
  }

  void solve_everything() {
    detail::report_progress(options_, "adjusting camera, boards and lasers together", 0.8);
    if (result_.observations.laser_count() < static_cast<int>(input_.lasers.size()))
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("laser {}: no stripe was found on the board in any of its images",
                              result_.observations.laser_count()));
    if (!result_.observations.stripes.empty()) {
      const JointSolution from_corners = std::move(result_.solution);
      result_.solution = solve_joint(result_.observations, result_.options);
      detail::leave_out_bad_stripes(result_);
      if (!options_.known_camera) detail::compare_cameras(from_corners, result_);
    }
    result_.options.start = nullptr;
    fill_model();
  }

  void fill_model() {
    StriperModel& model = result_.model;
    model.camera = result_.solution.camera;
    for (const LaserPlane& plane : result_.solution.planes)
      model.lasers.push_back({plane, std::nullopt, std::nullopt});
    model.axis = result_.settings.axis;
    for (std::size_t laser = 0; laser < model.lasers.size(); ++laser)
      model.lasers[laser].look = detail::measure_look(result_, static_cast<int>(laser));
    model.noise = options_.noise;
    if (result_.solution.covariance.size() > 0)
      model.covariance = ModelCovariance{covariance_names(model.camera, model.lasers.size()),
                                         result_.solution.covariance};
  }

  const CalibrationInput& input_;
  const CalibrationOptions& options_;
  Calibration result_;
};

}  // namespace

cv::Mat SessionImage::load() const {
  if (file.empty()) return image;
  if (!std::filesystem::is_regular_file(file))
    throw Error(ErrorKind::kNotFound, fmt::format("{}: there is no such image", file.string()));
  if (read) return read(file);
  cv::Mat pixels = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (pixels.empty())
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: not an image that can be read (PNG, JPEG, TIFF, PGM, BMP)",
                            file.string()));
  if (pixels.channels() == 4) {  // Transparency says nothing about light.
    std::vector<cv::Mat> planes;
    cv::split(pixels, planes);
    planes.pop_back();
    cv::merge(planes, pixels);
  }
  return pixels;
}

BoardDistances Calibration::board_distances() const {
  const Eigen::Vector2d middle = observations.board.centre_m();
  std::vector<double> distances;
  for (const Eigen::Isometry3d& T_cam_board : solution.T_cam_board)
    distances.push_back((T_cam_board * Eigen::Vector3d(middle.x(), middle.y(), 0.0)).norm());
  if (distances.empty()) return {};
  std::sort(distances.begin(), distances.end());
  return {distances.front(), distances[distances.size() / 2], distances.back()};
}

std::string Calibration::verdict() const {
  const auto refusals = std::count_if(findings.begin(), findings.end(), [](const Event& f) {
    return f.severity == Severity::kRefusal;
  });
  const auto warnings = std::count_if(findings.begin(), findings.end(), [](const Event& f) {
    return f.severity == Severity::kWarning;
  });
  if (refusals > 0) return "Do not trust this calibration: " + findings.front().message + ".";
  if (warnings > 0)
    return fmt::format("This calibration can be used, with {} warning{}: {}.", warnings,
                       warnings == 1 ? "" : "s", findings.front().message);
  return "This calibration can be trusted.";
}

Calibration calibrate(const CalibrationInput& input, const CalibrationOptions& options) {
  return Calibrator(input, options).run();
}

}  // namespace striper
