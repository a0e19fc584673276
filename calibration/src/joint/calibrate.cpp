// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <thread>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/joint/calibrate.hpp>

#include "joint/quality.hpp"

namespace striper {
namespace {

constexpr std::size_t kFewestCorners = 12;
constexpr std::size_t kFewestViewsForBend = 6;
constexpr double kBlurredPx = 2.5;
constexpr double kViewOutlier = 4.0;  // Times the median view's rms.
using Severity = Finding::Severity;

class Calibrator {
 public:
  Calibrator(const CalibrationInput& input, const CalibrationOptions& options)
      : input_(input), options_(options) {}

  Calibration run() {
    const auto began = std::chrono::steady_clock::now();
    list_pictures();
    find_boards();
    collect_views();
    solve_camera();
    find_stripes();
    solve_everything();
    judge();
    result_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    result_.model.quality_yaml = detail::quality_yaml(result_, options_.date);
    report("done", 1.0);
    return std::move(result_);
  }

 private:
  void report(const std::string& stage, double fraction) {
    if (options_.progress) options_.progress(stage, fraction);
  }

  void note(Severity severity, const char* code, std::string message, std::string advice) {
    result_.findings.push_back({severity, code, std::move(message), std::move(advice)});
  }

  // Every board picture once, every laser picture once per laser.
  void list_pictures() {
    input_.board.validate();
    std::map<std::string, bool> listed;
    for (std::size_t laser = 0; laser < input_.lasers.size(); ++laser) {
      const LaserPictures& pictures = input_.lasers[laser];
      if (!pictures.off.empty() && pictures.off.size() != pictures.on.size())
        throw Error(ErrorKind::kUsage,
                    fmt::format("laser {}: {} pictures with the laser off and {} with it on; pairs "
                                "need as many of each",
                                laser, pictures.off.size(), pictures.on.size()));
      for (std::size_t i = 0; i < pictures.on.size(); ++i) {
        PictureResult picture;
        picture.laser = static_cast<int>(laser);
        picture.lit = pictures.on[i];
        picture.picture = pictures.off.empty() ? pictures.on[i] : pictures.off[i];
        listed[picture.picture.name] = true;
        result_.pictures.push_back(std::move(picture));
      }
    }
    for (const SessionPicture& picture : input_.boards) {
      if (listed[picture.name]) continue;
      listed[picture.name] = true;
      PictureResult board;
      board.picture = picture;
      result_.pictures.push_back(std::move(board));
    }
    if (result_.pictures.empty())
      throw Error(ErrorKind::kUsage, "there is no picture to calibrate from");
  }

  void find_boards() {
    std::atomic<std::size_t> next{0};
    std::atomic<std::size_t> done{0};
    std::mutex lock;
    std::exception_ptr failure;
    const auto work = [&] {
      for (std::size_t i = next++; i < result_.pictures.size(); i = next++) {
        try {
          PictureResult& picture = result_.pictures[i];
          const cv::Mat image = picture.picture.load();
          check_size(picture.picture.name, image.size(), lock);
          picture.board = find_board(image, input_.board);
          picture.board_reason = picture.board.reason;
          // Inside of the try: a caller may end the work by throwing from its progress.
          const std::lock_guard guard(lock);
          report("finding boards",
                 0.5 * static_cast<double>(++done) / static_cast<double>(result_.pictures.size()));
        } catch (...) {
          const std::lock_guard guard(lock);
          failure = std::current_exception();
          next = result_.pictures.size();
        }
      }
    };
    std::vector<std::thread> others;
    for (int t = 1; t < options_.threads; ++t) others.emplace_back(work);
    work();
    for (std::thread& thread : others) thread.join();
    if (failure) std::rethrow_exception(failure);
  }

  void check_size(const std::string& name, cv::Size size, std::mutex& lock) {
    const std::lock_guard guard(lock);
    if (size_.empty()) {
      size_ = size;
      first_name_ = name;
      if (options_.known_camera && (options_.known_camera->camera.width() != size.width ||
                                    options_.known_camera->camera.height() != size.height))
        throw Error(
            ErrorKind::kBadValue,
            fmt::format("{}: the picture is {}x{} and the given intrinsics are of {}x{}", name,
                        size.width, size.height, options_.known_camera->camera.width(),
                        options_.known_camera->camera.height()));
    }
    if (size != size_)
      throw Error(
          ErrorKind::kBadValue,
          fmt::format("{}: the picture is {}x{}, but {} is {}x{}; all must come from one "
                      "camera at one setting",
                      name, size.width, size.height, first_name_, size_.width, size_.height));
  }

  void collect_views() {
    Observations& observations = result_.observations;
    observations.board = input_.board;
    observations.image_width = size_.width;
    observations.image_height = size_.height;
    std::map<std::string, int> view_of;  // A pose that several lasers share is one view.
    for (PictureResult& picture : result_.pictures) {
      if (!picture.board.found) continue;
      const auto known = view_of.find(picture.picture.name);
      if (known != view_of.end()) {
        picture.view = known->second;
        continue;
      }
      CornerView view;
      view.name = picture.picture.name;
      for (std::size_t i = 0; i < picture.board.corners_px.size(); ++i) {
        if (!picture.board.reliable[i]) continue;
        view.point.push_back(static_cast<int>(i));
        view.pixel.push_back(picture.board.corners_px[i]);
      }
      if (view.point.size() <
          std::min<std::size_t>(kFewestCorners,
                                static_cast<std::size_t>(input_.board.point_count()))) {
        picture.board_reason = fmt::format("only {} of {} corners look like corners",
                                           view.point.size(), input_.board.point_count());
        continue;
      }
      picture.view = static_cast<int>(observations.views.size());
      view_of[picture.picture.name] = picture.view;
      observations.views.push_back(std::move(view));
    }
    if (observations.views.empty()) refuse_without_boards();
  }

  [[noreturn]] void refuse_without_boards() {
    std::string hint;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, result_.pictures.size()); ++i) {
      const std::string size = guess_board_size(result_.pictures[i].picture.load(), input_.board);
      if (size.empty()) continue;
      hint =
          fmt::format("; a {} board is in {}: the size is given in inner corners, columns x rows",
                      size, result_.pictures[i].picture.name);
      break;
    }
    throw Error(ErrorKind::kUntrustworthy,
                fmt::format("the {} board was found in none of {} pictures ({}: {}){}",
                            to_string(input_.board), result_.pictures.size(),
                            result_.pictures.front().picture.name,
                            result_.pictures.front().board_reason, hint));
  }

  void solve_camera() {
    report("choosing the lens", 0.55);
    JointOptions& joint = result_.options;
    joint.known_camera = options_.known_camera;
    joint.threads = options_.threads;
    if (!options_.known_camera) {
      result_.lens = choose_lens(result_.observations, options_.lens);
      joint.lens = result_.lens.lens;
      joint.hold_k3 = result_.lens.hold_k3;
    }
    result_.solution = solve_joint(result_.observations, joint);
    leave_out_bad_views();
    choose_bend();
  }

  // A view whose corners fit far worse than the others' is another camera's, or wrongly found.
  void leave_out_bad_views() {
    if (result_.observations.views.size() < 5) return;
    std::vector<double> rms;
    for (std::size_t v = 0; v < result_.observations.views.size(); ++v) {
      const auto& view = result_.observations.views[v];
      double error_px = 0.0;
      solve_pose(result_.solution.camera, input_.board, view, result_.solution.bend_m, &error_px);
      rms.push_back(error_px);
    }
    std::vector<double> sorted = rms;
    std::sort(sorted.begin(), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    std::vector<int> good;
    std::vector<int> new_index(rms.size(), -1);
    for (std::size_t v = 0; v < rms.size(); ++v) {
      if (rms[v] > std::max(kViewOutlier * usual, usual + 0.3)) continue;
      new_index[v] = static_cast<int>(good.size());
      good.push_back(static_cast<int>(v));
    }
    if (good.size() == rms.size() || good.size() < 3) return;
    for (PictureResult& picture : result_.pictures) {
      if (picture.view < 0) continue;
      const auto old = static_cast<std::size_t>(picture.view);
      picture.view = new_index[old];
      if (picture.view >= 0) continue;
      picture.board_reason = fmt::format(
          "its corners fit to {:.2f} px only, the usual picture's to {:.2f} px: blurred, bent, or "
          "of "
          "another camera",
          rms[old], usual);
      note(Severity::kWarning, "view_left_out",
           fmt::format("{}: left out, {}", picture.picture.name, picture.board_reason),
           "look at the picture; take it again with the board held still");
    }
    result_.observations = result_.observations.subset(good);
    result_.solution = solve_joint(result_.observations, result_.options);
  }

  // The bend is worth two parameters where it takes away a clear part of the residual and is known.
  void choose_bend() {
    if (options_.known_camera || result_.observations.views.size() < kFewestViewsForBend) return;
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
    if (laser.on.size() != size_)
      throw Error(ErrorKind::kBadValue,
                  fmt::format("{}: the picture is {}x{}; expected {}x{} like the others",
                              laser.name, laser.on.cols, laser.on.rows, size_.width, size_.height));
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
    report("looking how the stripe is seen best", 0.6);
    std::vector<LaserPicture> trial;
    const std::size_t step = std::max<std::size_t>(1, lit.size() / 6);
    for (std::size_t k = 0; k < lit.size(); k += step)
      trial.push_back(laser_picture(result_.pictures[lit[k]]));
    result_.recipe = choose_recipe(trial, input_.board, result_.solution.camera, options_.axis,
                                   options_.channel);
    result_.observations.axis = result_.recipe.axis;
    for (std::size_t k = 0; k < lit.size(); ++k) {
      find_stripe(result_.pictures[lit[k]]);
      report("finding stripes",
             0.65 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(lit.size()));
    }
  }

  void find_stripe(PictureResult& picture) {
    StripeRecipe recipe = result_.recipe;
    const LaserPicture laser = laser_picture(picture);
    if (laser.off.empty()) recipe.subtract_off = false;
    picture.stripe =
        find_board_stripe(laser, input_.board, result_.solution.camera, recipe, options_.noise);
    picture.stripe_reason = picture.stripe.reason;
    if (!picture.stripe.found()) return;
    picture.stripe_view = static_cast<int>(result_.observations.stripes.size());
    StripeView view;
    view.name = picture.lit.name;
    view.view = picture.view;
    view.laser = picture.laser;
    view.pixel = picture.stripe.pixel;
    view.sigma_px = picture.stripe.sigma_px;
    result_.observations.stripes.push_back(std::move(view));
  }

  void solve_everything() {
    report("adjusting camera, boards and lasers together", 0.8);
    if (result_.observations.laser_count() < static_cast<int>(input_.lasers.size()))
      throw Error(ErrorKind::kUntrustworthy,
                  fmt::format("laser {}: no stripe was found on the board in any of its pictures",
                              result_.observations.laser_count()));
    if (!result_.observations.stripes.empty()) {
      result_.solution = solve_joint(result_.observations, result_.options);
      leave_out_bad_stripes();
    }
    result_.options.start = nullptr;
    fill_model();
  }

  // A stripe that lies off the plane of all the others is another line: a reflection, another
  // laser.
  void leave_out_bad_stripes() {
    std::vector<double> rms;
    const auto all_points_rms = [&](std::size_t s) {
      const StripeView& stripe = result_.observations.stripes[s];
      return stripe_rms_px(result_.observations, stripe, result_.solution.camera,
                           result_.solution.T_cam_board[static_cast<std::size_t>(stripe.view)],
                           result_.solution.planes[static_cast<std::size_t>(stripe.laser)],
                           result_.solution.bend_m);
    };
    for (std::size_t s = 0; s < result_.observations.stripes.size(); ++s)
      rms.push_back(all_points_rms(s));
    if (rms.size() < 5) return;
    std::vector<double> sorted = rms;
    std::sort(sorted.begin(), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    std::vector<StripeView> kept;
    std::vector<int> new_index(rms.size(), -1);
    for (std::size_t s = 0; s < rms.size(); ++s) {
      if (!(rms[s] <= std::max(5.0 * usual, 1.0))) continue;
      new_index[s] = static_cast<int>(kept.size());
      kept.push_back(result_.observations.stripes[s]);
    }
    if (kept.size() == rms.size() || 2 * kept.size() < rms.size()) return;
    for (PictureResult& picture : result_.pictures) {
      if (picture.stripe_view < 0) continue;
      const auto old = static_cast<std::size_t>(picture.stripe_view);
      picture.stripe_view = new_index[old];
      if (picture.stripe_view >= 0) continue;
      picture.stripe_reason =
          fmt::format("its stripe lies {:.1f} px off the plane of the others (usual: {:.2f} px)",
                      rms[old], usual);
      note(Severity::kWarning, "stripe_left_out",
           fmt::format("{}: left out, {}", picture.lit.name, picture.stripe_reason),
           "is it a reflection, or did the laser move?");
    }
    result_.observations.stripes = std::move(kept);
    result_.solution = solve_joint(result_.observations, result_.options);
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

  void judge() {
    report("cross-validating", 0.85);
    if (result_.solution.covariance.size() > 0) {
      result_.validation =
          cross_validate(result_.observations, result_.solution, result_.options, options_.threads);
      result_.model.covariance->matrix *= result_.validation.covariance_factor;
      result_.solution.covariance *= result_.validation.covariance_factor;
    }
    judge_pictures();
    judge_validation();
    for (Finding& finding :
         check_trust(result_.observations, result_.solution, result_.options, result_.model,
                     result_.validation.covariance_factor, options_.limits))
      result_.findings.push_back(std::move(finding));
    if (result_.model.camera.folds_inside_image())
      note(Severity::kWarning, "lens_folds",
           "the lens model folds back inside the picture: its corners cannot be used",
           "show the board in the corners of the picture, or choose another --lens");
    predict_ranges();
    std::stable_sort(result_.findings.begin(), result_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
    result_.forced = !result_.trustworthy() && options_.force;
  }

  void judge_pictures() {
    std::size_t lost = 0;
    std::size_t lost_stripes = 0;
    std::size_t lit = 0;
    std::string first;
    std::string blurred;
    for (const PictureResult& picture : result_.pictures) {
      if (!picture.board.found) {
        ++lost;
        if (first.empty()) first = picture.picture.name + ": " + picture.board_reason;
      }
      if (picture.laser >= 0) ++lit;
      if (picture.laser >= 0 && picture.view >= 0 && picture.stripe_view < 0) ++lost_stripes;
      if (picture.board.blur_px > kBlurredPx * std::max(1.0, size_.width / 1280.0))
        blurred += (blurred.empty() ? "" : ", ") + picture.picture.name;
    }
    if (lost > 0)
      note(4 * lost > result_.pictures.size() ? Severity::kWarning : Severity::kNote,
           "boards_not_found",
           fmt::format("the board was not found in {} of {} pictures ({})", lost,
                       result_.pictures.size(), first),
           "the whole board must be in the picture, sharp and evenly lit");
    if (lost_stripes > 0)
      note(4 * lost_stripes > lit ? Severity::kWarning : Severity::kNote, "stripes_not_found",
           fmt::format("no stripe was used in {} of {} laser pictures", lost_stripes, lit),
           "the laser must cross the board or its white margin");
    if (!blurred.empty())
      note(Severity::kWarning, "blurred", "blurred pictures: " + blurred,
           "hold the board still, expose shorter, focus");
  }

  void judge_validation() {
    const CrossValidation& validation = result_.validation;
    if (options_.known_camera && !options_.known_camera->covariance)
      note(Severity::kNote, "camera_error_unknown",
           "the intrinsics that were given carry no covariance: the error bars leave the camera's "
           "own "
           "error out",
           "give a model of this program, which carries it, or calibrate the camera from these "
           "pictures too");
    if (validation.splits == 0) {
      if (!options_.known_camera)
        note(Severity::kNote, "not_cross_validated",
             "too few pictures to solve two halves of them against each other",
             "eight or more pictures let the halves be compared");
      return;
    }
    if (validation.covariance_factor <= 1.0) return;
    const double times = std::sqrt(validation.covariance_factor);
    note(times > 2.0 ? Severity::kWarning : Severity::kNote, "halves_disagree",
         fmt::format(
             "two halves of the pictures disagree by more than their error bars say (NEES "
             "{:.1f}, expected {:.1f} to {:.1f}); all error bars were widened by {:.2f} for it",
             validation.nees, validation.nees_low, validation.nees_high, times),
         "the board may be bent, the lens model too simple, or the camera moved its focus");
  }

  void predict_ranges() {
    for (int laser = 0; laser < static_cast<int>(result_.model.lasers.size()); ++laser) {
      const Triangulator triangulator(result_.model, laser);
      double nearest_m = std::numeric_limits<double>::infinity();
      double farthest_m = 0.0;
      for (const auto& p : stripe_points_cam(result_.observations, result_.solution, laser)) {
        const Eigen::Vector3d q = triangulator.T_cam_scan().inverse() * p;
        nearest_m = std::min(nearest_m, q.head<2>().norm());
        farthest_m = std::max(farthest_m, q.head<2>().norm());
      }
      result_.depths_m.emplace_back(nearest_m, farthest_m);
      result_.range_sigmas.push_back(
          result_.model.covariance
              ? predict_range_sigma(result_.model, laser, {1.0, 2.0, 4.0}, nearest_m, farthest_m)
              : std::vector<RangeSigma>{});
    }
  }

  const CalibrationInput& input_;
  const CalibrationOptions& options_;
  Calibration result_;
  cv::Size size_;
  std::string first_name_;
};

}  // namespace

cv::Mat SessionPicture::load() const {
  if (file.empty()) return image;
  if (!std::filesystem::is_regular_file(file))
    throw Error(ErrorKind::kNotFound, fmt::format("{}: there is no such picture", file.string()));
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
