// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/joint/calibrate.hpp>

#include "joint/calibration_steps.hpp"
#include "joint/quality.hpp"

namespace striper {
namespace {

constexpr std::size_t kFewestViewsForBend = 6;
using Severity = Finding::Severity;

class Calibrator {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options)
      : input_(input), options_(options) {}

  Calibration run() {
    const auto began = std::chrono::steady_clock::now();
    detail::list_pictures(input_, result_);
    detail::find_boards(input_, options_, result_);
    solve_camera();
    find_stripes();
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

  LaserPicture laser_picture(const PictureResult& picture) const {
    LaserPicture laser;
    laser.name = picture.lit.name;
    laser.on = picture.lit.load();
    if (picture.lit.name != picture.picture.name) laser.off = picture.picture.load();
    laser.bit_depth =
        laser.on.depth() == CV_16U && picture.lit.bit_depth <= 8 ? 16 : picture.lit.bit_depth;
    laser.T_cam_board = result_.solution.T_cam_board[static_cast<std::size_t>(picture.view)];
    return laser;
  }

  void find_stripes() {
    std::vector<std::size_t> lit;
    for (std::size_t i = 0; i < result_.pictures.size(); ++i)
      if (result_.pictures[i].laser >= 0 && result_.pictures[i].view >= 0) lit.push_back(i);
    if (input_.lasers.empty()) return;
    if (lit.empty())
      throw Error(ErrorKind::kUntrustworthy,
                  "the board was found in none of the laser pictures: without its pose the stripe "
                  "says nothing. Move the laser so that it leaves most corners free, or take pairs "
                  "(laser off, then on)");
    detail::report_progress(options_, "looking how the stripe is seen best", 0.6);
    std::vector<LaserPicture> trial;
    const std::size_t step = std::max<std::size_t>(1, lit.size() / 6);
    for (std::size_t k = 0; k < lit.size(); k += step)
      trial.push_back(laser_picture(result_.pictures[lit[k]]));
    result_.recipe = choose_recipe(trial, result_.observations.board, result_.solution.camera,
                                   options_.axis, options_.channel);
    result_.observations.axis = result_.recipe.axis;
    for (std::size_t k = 0; k < lit.size(); ++k) {
      find_stripe(result_.pictures[lit[k]]);
      detail::report_progress(
          options_, "finding stripes",
          0.65 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(lit.size()));
    }
  }

  void find_stripe(PictureResult& picture) {
    StripeRecipe recipe = result_.recipe;
    const LaserPicture laser = laser_picture(picture);
    if (laser.off.empty()) recipe.subtract_off = false;
    picture.stripe = find_board_stripe(laser, result_.observations.board, result_.solution.camera,
                                       recipe, options_.noise);
    picture.stripe_reason = picture.stripe.reason;
    if (!picture.stripe.found()) return;
    picture.stripe_view = static_cast<int>(result_.observations.stripes.size());
    StripeView view;
    view.name = picture.lit.name;
    view.view = picture.view;
    view.laser = picture.laser;
    view.pixel = picture.stripe.pixel;
    view.sigma_px = picture.stripe.sigma_px;
    // What blurs the board's edges blurs the stripe as well; the rest of its width is the laser's.
    view.width_px = picture.stripe.width_px;
    view.sheet_px = std::sqrt(std::max(
        0.0, view.width_px * view.width_px - picture.board.blur_px * picture.board.blur_px));
    result_.observations.stripes.push_back(std::move(view));
  }

  void solve_everything() {
    detail::report_progress(options_, "adjusting camera, boards and lasers together", 0.8);
    if (result_.observations.laser_count() < static_cast<int>(input_.lasers.size()))
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("laser {}: no stripe was found on the board in any of its pictures",
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
    model.axis = result_.recipe.axis;
    model.channel = result_.recipe.channel;
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

cv::Mat SessionPicture::load() const {
  if (file.empty()) return image;
  if (!std::filesystem::is_regular_file(file))
    throw Error(ErrorKind::kNotFound, fmt::format("{}: there is no such picture", file.string()));
  if (read) return read(file);
  cv::Mat pixels = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  if (pixels.empty())
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: not a picture that can be read (PNG, JPEG, TIFF, PGM, BMP)",
                            file.string()));
  if (pixels.channels() == 4) {  // Transparency says nothing about light.
    std::vector<cv::Mat> planes;
    cv::split(pixels, planes);
    planes.pop_back();
    cv::merge(planes, pixels);
  }
  return pixels;
}

std::string Calibration::verdict() const {
  const auto refusals = std::count_if(findings.begin(), findings.end(), [](const Finding& f) {
    return f.severity == Severity::kRefusal;
  });
  const auto warnings = std::count_if(findings.begin(), findings.end(), [](const Finding& f) {
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
