// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include <Eigen/Dense>
#include <fmt/format.h>

#include <striper/geometry/triangulator.hpp>
#include <striper/validate/trust.hpp>

namespace striper {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / std::numbers::pi;

// rms tilt of the board normals about their mean, about the camera's x and y axes.
Eigen::Vector2d tilt_spread_deg(const JointSolution& solution) {
  std::vector<Eigen::Vector2d> tilts;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Isometry3d& T : solution.T_cam_board) {
    const Eigen::Vector3d n = T.linear().col(2);
    tilts.emplace_back(std::atan2(n.y(), std::abs(n.z())), std::atan2(n.x(), std::abs(n.z())));
    mean += tilts.back();
  }
  mean /= static_cast<double>(std::max<std::size_t>(tilts.size(), 1));
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (const auto& tilt : tilts) squares += (tilt - mean).cwiseAbs2();
  return kDegrees *
         (squares / static_cast<double>(std::max<std::size_t>(tilts.size(), 1))).cwiseSqrt();
}

struct Checker {
  const Observations& observations;
  const JointSolution& solution;
  const JointOptions& options;
  const StriperModel& model;
  double widening;  // What the sigmas were multiplied by for a misfit.
  const TrustLimits& limits;
  std::vector<Event> findings;

  static const TrustCheck& row_of(EventCode code) {
    return *std::find_if(trust_checks().begin(), trust_checks().end(),
                         [&](const TrustCheck& check) { return check.code == code; });
  }

  // Whether a figure, in the unit of the check, is a finding.
  bool is_beyond(EventCode code, double figure) const {
    const TrustCheck& check = row_of(code);
    const double limit = check.limit(limits);
    return check.beyond == "below" ? figure < limit : figure > limit;
  }

  // Image widths of 640 pixels, one at least: residuals grow with them.
  double in_640ths() const { return std::max(1.0, observations.image_width / 640.0); }

  void add(EventCode code, std::string message) {
    const TrustCheck& check = row_of(code);
    add(check.severity, code, std::move(message), std::string(check.advice));
  }
  void add(EventCode code, std::string message, std::string advice) {
    add(row_of(code).severity, code, std::move(message), std::move(advice));
  }
  void add(Severity severity, EventCode code, std::string message, std::string advice) {
    findings.push_back({severity, code, std::move(message), std::move(advice)});
  }

  void check_views() {
    const auto views = static_cast<int>(observations.views.size());
    if (options.known_camera) return;
    if (is_beyond("too_few_views", views))
      add("too_few_views", fmt::format("the board was found in {} images; {} at least are needed",
                                       views, limits.fewest_views));
    else if (is_beyond("few_views", views))
      add("few_views", fmt::format("the board was found in {} images only", views));
  }

  void check_tilts() {
    if (options.known_camera || observations.views.size() < 2) return;
    const Eigen::Vector2d spread = tilt_spread_deg(solution);
    const double most = spread.norm();
    const std::string figures = fmt::format(
        "the boards' tilts vary by {:.1f} degrees rms up and down and {:.1f} left and right",
        spread.x(), spread.y());
    if (is_beyond("boards_parallel", most))
      add("boards_parallel",
          fmt::format("the boards are nearly parallel: {}, {:.0f} at least are needed. The focal "
                      "length and the distances cannot be told apart",
                      figures, limits.least_tilt_deg));
    else if (is_beyond("boards_tilted_one_way", spread.minCoeff()))
      add("boards_tilted_one_way", figures,
          spread.x() < spread.y() ? "add images with the board's top or bottom towards the camera"
                                  : "add images with the board's left or right side towards the "
                                    "camera");
    else if (is_beyond("boards_tilted_little", most))
      add("boards_tilted_little", figures);
  }

  void check_condition() {
    const bool is_regular = std::isfinite(solution.rcond) && !is_beyond("singular", solution.rcond);
    if (solution.covariance.size() > 0 && is_regular) return;
    add("singular", "the images leave a direction of the model free" +
                        (is_regular || solution.weakest.empty()
                             ? ": the adjustment ran away along it, and there are no error bars"
                             : fmt::format(" (mostly {}; reciprocal condition {:.1g})",
                                           weakest_names(), solution.rcond)));
  }

  // Three at the most, none of which has no part in it to speak of.
  std::string weakest_names() const {
    std::string names;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, solution.weakest.size()); ++i)
      if (const auto& [name, weight] = solution.weakest[i];
          weight >= 0.01 * solution.weakest.front().second)
        names += (i > 0 ? ", " : "") + name;
    return names;
  }

  void check_focal_length() {
    if (solution.covariance.size() == 0) return;
    const double error = std::max(std::sqrt(solution.covariance(0, 0)) / solution.camera.fx(),
                                  std::sqrt(solution.covariance(1, 1)) / solution.camera.fy());
    const double geometric = options.known_camera ? error : error / widening;
    if (is_beyond("focal_length_unknown", 100.0 * geometric))
      add("focal_length_unknown",
          fmt::format("the focal length is known to {:.2f} % only{}; the limit is {:.2f} %",
                      100.0 * geometric,
                      options.known_camera ? ", by the intrinsics that were given"
                                           : " from images placed like these, however well the "
                                             "corners fit",
                      100.0 * limits.most_focal_error));
    else if (is_beyond("focal_length_uncertain", 100.0 * error))
      add("focal_length_uncertain",
          fmt::format("the focal length is known to {:.2f} % only (fx {:.1f} +- {:.1f}, fy {:.1f} "
                      "+- {:.1f} px{}); {:.2f} % is usual",
                      100.0 * error, solution.camera.fx(), std::sqrt(solution.covariance(0, 0)),
                      solution.camera.fy(), std::sqrt(solution.covariance(1, 1)),
                      options.known_camera ? std::string() : of_misfit(),
                      100.0 * limits.high_focal_error));
  }

  // What part of an error bar is there for a misfit.
  std::string of_misfit() const {
    return widening > 1.005 ? fmt::format(
                                  ", {:.1f} times as much as from images placed like "
                                  "these, since they do not fit each other",
                                  widening)
                            : std::string();
  }

  // How much alike neighbouring corners err: about 0 where each errs by itself, near 1 where the
  // board has another shape than the model's, which is smooth over it.
  double neighbours_alike() const {
    double product = 0.0;
    double square = 0.0;
    const int columns = observations.board.columns;
    for (std::size_t v = 0; v < observations.views.size(); ++v) {
      std::map<int, Eigen::Vector2d> residual;
      for (std::size_t i = 0; i < observations.views[v].point.size(); ++i)
        if (solution.corner_residual_px[v][i].allFinite())
          residual.emplace(observations.views[v].point[i], solution.corner_residual_px[v][i]);
      for (const auto& [point, r] : residual)
        for (const int other : {point + 1, point + columns}) {
          if (other == point + 1 && other % columns == 0) continue;
          const auto neighbour = residual.find(other);
          if (neighbour == residual.end()) continue;
          product += r.dot(neighbour->second);
          square += 0.5 * (r.squaredNorm() + neighbour->second.squaredNorm());
        }
    }
    return square > 0.0 ? product / square : 0.0;
  }

  void check_residuals() {
    const double limit_px = limits.high_corner_rms_px * in_640ths();
    const Eigen::Vector2d half = observations.board.half_extent_m();
    const double bend = std::max(std::abs(solution.bend_m.x()) / half.x(),
                                 std::abs(solution.bend_m.y()) / half.y());
    if (is_beyond("board_bent", 100.0 * bend))
      add("board_bent",
          fmt::format(
              "the board is bent: its middle stands {:.2f} mm (across) and {:.2f} mm (down) "
              "off its ends. The bend is solved for, as a parabola; a real one is not quite",
              1e3 * solution.bend_m.x(), 1e3 * solution.bend_m.y()));
    if (!is_beyond("corners_do_not_fit", solution.corners.rms_px / in_640ths())) return;
    const std::string figures =
        fmt::format("the corners fit to {:.2f} px rms only; {:.2f} px is usual",
                    solution.corners.rms_px, limit_px);
    const double alike = neighbours_alike();
    if (alike > limits.bent_alike)
      add("board_bent",
          fmt::format("{}, and neighbouring corners err alike (correlation {:.2f}), as on a board "
                      "that is bent otherwise than in a parabola common to all images",
                      figures, alike),
          "glue the print to something flat: glass, aluminium, thick board. If it is flat, try "
          "another --lens");
    else
      add("corners_do_not_fit",
          fmt::format("{}, each corner by itself (correlation of neighbours {:.2f}): the images "
                      "are blurred, or corners are found wrongly",
                      figures, alike));
  }

  // Many times what a stripe is found to: images of different poses, or of different stripers.
  void check_stripes() {
    const double limit_px = limits.most_stripe_rms_px * in_640ths();
    if (!is_beyond("stripes_do_not_fit", solution.stripes.rms_px / in_640ths())) return;
    add("stripes_do_not_fit",
        fmt::format("the stripes do not lie in a plane: {:.1f} px rms; {:.1f} px is the limit",
                    solution.stripes.rms_px, limit_px));
  }

  void check_scale() {
    std::vector<double> depths;
    for (const auto& T : solution.T_cam_board) depths.push_back(T.translation().z());
    std::sort(depths.begin(), depths.end());
    const double middle = depths.empty() ? 1.0 : depths[depths.size() / 2];
    if (middle > limits.least_depth_m && !is_beyond("scale_unlikely", middle)) return;
    add("scale_unlikely", fmt::format("the boards come out {:.3g} m away, with squares of {:g} m",
                                      middle, observations.board.square_m));
  }

  void check_laser(int laser) {
    const std::vector<Eigen::Vector3d> points = stripe_points_cam(observations, solution, laser);
    if (points.size() < 3) return;
    check_plane_spread(laser, points);
    check_coverage(laser);
    check_range(laser, points);
  }

  void check_plane_spread(int laser, const std::vector<Eigen::Vector3d>& points) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& p : points) mean += p / static_cast<double>(points.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
    const double spread = std::sqrt(eigen.eigenvalues()[1] / eigen.eigenvalues()[2]);
    if (!is_beyond("planes_coincident", spread)) return;
    add("planes_coincident",
        fmt::format("laser {}: all stripes lie on nearly the same line in space (width over length "
                    "{:.3f}, {:.2f} at least is needed), so that its plane can turn about it",
                    laser, spread, limits.least_plane_spread));
  }

  void check_coverage(int laser) {
    const bool columns = observations.axis == StripeAxis::kColumns;
    Eigen::AlignedBox2d box;
    int images = 0;
    for (const StripeView& stripe : observations.stripes) {
      if (stripe.laser != laser) continue;
      ++images;
      for (const Eigen::Vector2d& pixel : stripe.pixel) box.extend(pixel);
    }
    const Eigen::Vector2d size = box.sizes();
    const double along =
        columns ? size.x() / observations.image_width : size.y() / observations.image_height;
    const double across =
        columns ? size.y() / observations.image_height : size.x() / observations.image_width;
    const std::string figures = fmt::format(
        "laser {}: in {} image{} the stripe covers {:.0f} % of the image along it and {:.0f} % "
        "across it",
        laser, images, images == 1 ? "" : "s", 100.0 * along, 100.0 * across);
    const std::string where = fmt::format(
        "move the board {} so that the stripe on it reaches both ends of the image, near and far",
        columns ? "to the left and right" : "up and down");
    if (is_beyond("stripe_in_corner", 100.0 * std::max(along, across)))
      add("stripe_in_corner", figures + ": a corner of it only", where);
    else if (is_beyond("stripe_covers_little", 100.0 * along))
      add("stripe_covers_little", figures, where);
    if (is_beyond("few_stripes", images))
      add(options.known_camera || images > 1 ? Severity::kWarning : Severity::kRefusal,
          "few_stripes",
          fmt::format("laser {}: the stripe was found on the board in {} image{}", laser, images,
                      images == 1 ? "" : "s"),
          std::string(row_of("few_stripes").advice));
  }

  void check_range(int laser, const std::vector<Eigen::Vector3d>& points) {
    if (solution.covariance.size() == 0) return;
    const Triangulator triangulator(model, laser);
    std::vector<std::pair<double, double>> relative;  // (range, sigma / range) at the stripes.
    for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / 60)) {
      const Projection at = model.camera.project(points[i]);
      if (at.status != CameraStatus::kOk) continue;
      const PlanePoint point = triangulator.triangulate(at.pixel);
      if (point.status != ReturnStatus::kOk) continue;
      relative.emplace_back(point.range_m(), triangulator.sigma_cal_m(at.pixel) / point.range_m());
    }
    if (relative.empty()) return;
    std::nth_element(
        relative.begin(), relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2),
        relative.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto [range_m, error] = relative[relative.size() / 2];
    const double geometric = error / widening;
    if (is_beyond("range_unknown", 100.0 * geometric))
      add("range_unknown",
          fmt::format("laser {}: images placed like these leave {:.2g} mm of one-sigma error at "
                      "{:.2f} m ({:.2f} %), however well they fit; the limit is {:.2f} %",
                      laser, 1e3 * geometric * range_m, range_m, 100.0 * geometric,
                      100.0 * limits.most_range_error));
    else if (is_beyond("range_uncertain", 100.0 * error))
      add("range_uncertain",
          fmt::format("laser {}: the calibration leaves {:.2g} mm of one-sigma error at {:.2f} m "
                      "({:.2f} %{}); {:.2f} % is usual",
                      laser, 1e3 * error * range_m, range_m, 100.0 * error, of_misfit(),
                      100.0 * limits.high_range_error));
  }
};

}  // namespace

std::vector<Event> check_trust(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, const StriperModel& model,
                               double covariance_factor, const TrustLimits& limits) {
  Checker checker{observations, solution, options, model, std::sqrt(covariance_factor), limits, {}};
  checker.check_views();
  checker.check_tilts();
  checker.check_condition();
  checker.check_focal_length();
  checker.check_residuals();
  checker.check_stripes();
  checker.check_scale();
  for (int laser = 0; laser < static_cast<int>(solution.planes.size()); ++laser)
    checker.check_laser(laser);
  return std::move(checker.findings);
}

}  // namespace striper
