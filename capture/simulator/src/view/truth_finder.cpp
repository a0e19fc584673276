// SPDX-License-Identifier: Apache-2.0
#include "view/truth_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "view/sensor.hpp"

namespace striper::detail {
namespace {

constexpr double kSolvedPx = 1e-11;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A spot of a surface in the middle of the laser plane.
struct Spot {
  double position_px = kNone;  ///< Along the scan line.
  int facet = -1;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  TruthStatus status = TruthStatus::kNoSurface;
  double slope_px = 0.0;  ///< How far the stripe moves along the scan line from one to the next.
  TrueReturn value;
};

class TruthFinder {
 public:
  explicit TruthFinder(const TruthInput& input)
      : in_(input),
        scene_(input.view.scene()),
        world_(input.view.world()),
        region_(input.view.scene().imager.region),
        by_columns_(scene_.axis == StripeAxis::kColumns),
        casters_(input.beam.casters(world_)),
        T_scan_cam_(standard_T_cam_scan(input.beam.plane(), scene_.axis).inverse()) {}

  std::vector<TrueLine> find() {
    const int count = by_columns_ ? in_.image_size.width : in_.image_size.height;
    for (int line = 0; line < count; ++line) spots_.push_back(find_spots(line_px(line)));
    std::vector<TrueLine> lines;
    lines.reserve(spots_.size());
    for (int line = 0; line < count; ++line) lines.push_back(summarize(line));
    return lines;
  }

 private:
  double line_px(int line) const noexcept {
    return by_columns_ ? in_.grid.sensor_u(line) : in_.grid.sensor_v(line);
  }
  Eigen::Vector2d pixel(double line, double along) const noexcept {
    return by_columns_ ? Eigen::Vector2d(line, along) : Eigen::Vector2d(along, line);
  }
  double first_px() const noexcept { return (by_columns_ ? region_.y : region_.x) - 0.5; }
  double last_px() const noexcept {
    return first_px() + (by_columns_ ? region_.height : region_.width);
  }

  Hit cast(const Eigen::Vector2d& at, const Eigen::Vector3d& ray) const noexcept {
    const int u =
        std::clamp(static_cast<int>(std::lround(at.x())), region_.x, region_.x + region_.width - 1);
    const int v = std::clamp(static_cast<int>(std::lround(at.y())), region_.y,
                             region_.y + region_.height - 1);
    return in_.view.cast(u, v, ray);
  }

  /// Distance from the laser plane where a ray meets a facet's endless surface.
  double height_on(int facet, const Eigen::Vector3d& ray) const noexcept {
    return in_.beam.height_m(world_.surface_t(facet, ray) * ray);
  }
  double exact_height(int facet, double line, double along) const noexcept {
    return height_on(facet, scene_.camera.unproject(pixel(line, along)).xy.homogeneous());
  }

  struct Sample {
    double along;
    Eigen::Vector3d ray;
    int facet;
  };

  Sample sample(double line, double along) const noexcept {
    const Eigen::Vector2d at = pixel(line, along);
    const int u = static_cast<int>(at.x());
    const int v = static_cast<int>(at.y());
    if (at.x() == u && at.y() == v) {  // A pixel's centre, which has been cast already.
      return {along, in_.view.rays().at(u, v).homogeneous(), in_.view.hit(u, v).facet};
    }
    const Eigen::Vector3d ray = in_.view.rays().interpolate(at.x(), at.y()).homogeneous();
    return {along, ray, ray.allFinite() ? cast(at, ray).facet : -1};
  }

  std::vector<Spot> find_spots(double line) const {
    std::vector<Spot> found;
    bool any_ray = false;
    Sample before = sample(line, first_px());
    const int length = by_columns_ ? region_.height : region_.width;
    for (int i = 0; i <= length; ++i) {  // Every pixel's centre, then the last one's far edge.
      const Sample here = sample(line, std::min(first_px() + 0.5 + i, last_px()));
      any_ray = any_ray || here.ray.allFinite();
      look_between(line, before, here, before.facet, found);
      if (here.facet != before.facet) look_between(line, before, here, here.facet, found);
      before = here;
    }
    if (!any_ray) found.emplace_back().status = TruthStatus::kOutsideModel;
    return found;
  }

  void look_between(double line, const Sample& a, const Sample& b, int facet,
                    std::vector<Spot>& found) const {
    if (facet < 0 || !a.ray.allFinite() || !b.ray.allFinite()) return;
    const double height_a = height_on(facet, a.ray);
    const double height_b = height_on(facet, b.ray);
    if (!(height_a < 0.0 ? height_b >= 0.0 : height_b < 0.0)) return;
    const double along = solve(facet, line, a.along, b.along);
    if (!found.empty() && std::abs(found.back().position_px - along) < 1e-6) return;
    Spot spot;
    spot.position_px = along;
    spot.facet = facet;
    const Eigen::Vector2d at = pixel(line, along);
    const Eigen::Vector3d ray = scene_.camera.unproject(at).xy.homogeneous();
    const double t = world_.surface_t(facet, ray);
    const Hit first = cast(at, ray);
    if (!(first.t > t * (1.0 - 1e-9) && first.t < t * (1.0 + 1e-9))) return;  // Hidden.
    spot.point = t * ray;
    describe(at, ray, spot);
    found.push_back(spot);
  }

  /// Regula falsi (Illinois) between two positions of different sides, on the exact lens.
  double solve(int facet, double line, double a, double b) const noexcept {
    double height_a = exact_height(facet, line, a);
    double height_b = exact_height(facet, line, b);
    // The table's rays may differ from the exact ones in the last digits: a root on a sample.
    if ((height_a < 0.0) == (height_b < 0.0)) {
      return std::abs(height_a) < std::abs(height_b) ? a : b;
    }
    double middle = a;
    for (int i = 0; i < 60 && std::abs(b - a) > kSolvedPx; ++i) {
      const double previous = middle;
      middle = (a * height_b - b * height_a) / (height_b - height_a);
      const double height = exact_height(facet, line, middle);
      if (height == 0.0 || (i > 0 && std::abs(middle - previous) < kSolvedPx)) break;
      if ((height < 0.0) == (height_b < 0.0)) {
        height_a *= 0.5;
      } else {
        a = b;
        height_a = height_b;
      }
      b = middle;
      height_b = height;
    }
    return middle;
  }

  void describe(const Eigen::Vector2d& at, const Eigen::Vector3d& ray, Spot& spot) const {
    TrueReturn& value = spot.value;
    value.u_px = at.x();
    value.v_px = at.y();
    const Eigen::Vector3d p_scan = T_scan_cam_ * spot.point;
    value.x_m = p_scan.x();
    value.y_m = p_scan.y();
    value.range_m = std::hypot(p_scan.x(), p_scan.y());
    value.bearing_rad = std::atan2(p_scan.y(), p_scan.x());
    value.object = world_.facet(spot.facet).object;
    const Eigen::Vector3d normal = world_.normal_to_camera(spot.facet, spot.point);
    const BeamAt light = in_.beam.at(spot.point, normal);
    if (!light.in_fan) {
      spot.status = TruthStatus::kOutsideFan;
    } else if (light.peak_fluence_j_m2 == 0.0 ||
               world_.blocked(in_.beam.origin(), spot.point, casters_)) {
      spot.status = TruthStatus::kShadowed;
    } else {
      spot.status = TruthStatus::kVisible;
      describe_profile(at, ray, normal, light, spot);
    }
  }

  void describe_profile(const Eigen::Vector2d& at, const Eigen::Vector3d& ray,
                        const Eigen::Vector3d& normal, const BeamAt& light, Spot& spot) const {
    const Imager& imager = scene_.imager;
    const double t = spot.point.z();
    const RayGrid& rays = in_.view.rays();
    const auto slope = [&](const Eigen::Vector2d& step) {
      const Eigen::Vector2d change =
          rays.interpolate(at.x() + 0.25 * step.x(), at.y() + 0.25 * step.y()) -
          rays.interpolate(at.x() - 0.25 * step.x(), at.y() - 0.25 * step.y());
      const Eigen::Vector3d d_ray(2.0 * change.x(), 2.0 * change.y(), 0.0);
      return t * in_.beam.normal().dot(d_ray - ray * (normal.dot(d_ray) / normal.dot(ray)));
    };
    const double along = slope(pixel(0.0, 1.0));
    const double across = slope(pixel(1.0, 0.0));
    spot.slope_px = -across / along;

    const double thickness_px = light.sigma_m / std::abs(along);
    const double across_variance = spot.slope_px * spot.slope_px;
    const double bin_across = by_columns_ ? imager.binning.width : imager.binning.height;
    const double variance = thickness_px * thickness_px +
                            imager.blur_sigma_px * imager.blur_sigma_px * (1.0 + across_variance) +
                            across_variance * bin_across * bin_across / 12.0;
    spot.value.width_px = std::sqrt(variance);
    const Reflection reflection = in_.view.shading().reflection({t, spot.facet}, spot.point);
    const double electrons =
        light.peak_fluence_j_m2 * in_.view.shading().electrons_per_fluence(
                                      reflection, spot.point, in_.beam.origin(), in_.laser);
    spot.value.amplitude_dn = imager.dn_per_electron * electrons * imager.binning.area() *
                              (1.0 - imager.bloom.fraction) * thickness_px / spot.value.width_px;
  }

  TrueLine summarize(int line) const {
    TrueLine result;
    (by_columns_ ? result.brightest.u_px : result.brightest.v_px) = line_px(line);
    std::vector<TrueReturn> lit;
    for (const Spot& spot : spots_[static_cast<std::size_t>(line)]) {
      if (spot.status == TruthStatus::kVisible) {
        lit.push_back(spot.value);
        lit.back().near_edge = is_near_edge(line, spot);
        look_at_saturation(lit.back());
      } else if (result.status == TruthStatus::kNoSurface) {
        result.status = spot.status;
        if (spot.facet >= 0) result.brightest = spot.value;
      }
    }
    if (lit.empty()) return result;
    std::stable_sort(lit.begin(), lit.end(), [](const TrueReturn& a, const TrueReturn& b) {
      return a.amplitude_dn > b.amplitude_dn;
    });
    result.status = TruthStatus::kVisible;
    result.brightest = lit.front();
    result.others.assign(lit.begin() + 1, lit.end());
    return result;
  }

  bool is_near_edge(int line, const Spot& spot) const {
    for (int k = 1; k <= scene_.edge_distance_px; ++k) {
      for (const int sign : {-1, 1}) {
        if (ends_along(line, spot, sign * k) || ends_across(line, spot, sign * k)) return true;
      }
    }
    return false;
  }

  int patch_at(int facet, const Eigen::Vector3d& point) const {
    return in_.view.shading().reflection({point.z(), facet}, point).patch;
  }

  /// Whether the surface, its paint or its light is another one some pixels along the scan line.
  bool ends_along(int line, const Spot& spot, int away) const {
    const double along = spot.position_px + away;
    if (along < first_px() || along > last_px()) return true;
    const Sample there = sample(line_px(line), along);
    if (there.facet != spot.facet) return true;
    const Eigen::Vector3d point = world_.surface_t(spot.facet, there.ray) * there.ray;
    return patch_at(spot.facet, point) != patch_at(spot.facet, spot.point) ||
           world_.blocked(in_.beam.origin(), point, casters_);
  }

  /// Whether the stripe does not go on as it should in a scan line some pixels away.
  bool ends_across(int line, const Spot& spot, int away) const {
    const int there = line + away;
    if (there < 0 || there >= static_cast<int>(spots_.size())) return false;
    const double expected = spot.position_px + spot.slope_px * (line_px(there) - line_px(line));
    const auto& candidates = spots_[static_cast<std::size_t>(there)];
    return std::none_of(candidates.begin(), candidates.end(), [&](const Spot& other) {
      return other.status == TruthStatus::kVisible && other.facet == spot.facet &&
             std::abs(other.position_px - expected) < 2.0 &&
             patch_at(other.facet, other.point) == patch_at(spot.facet, spot.point);
    });
  }

  void look_at_saturation(TrueReturn& value) const {
    const double limit = saturation_electrons(scene_.imager) / scene_.imager.binning.area();
    const int reach = static_cast<int>(std::ceil(3.0 * value.width_px + 0.5));
    const Eigen::Vector2d at(value.u_px, value.v_px);
    for (int k = -reach; k <= reach; ++k) {
      const Eigen::Vector2d near =
          at + (by_columns_ ? Eigen::Vector2d(0, k) : Eigen::Vector2d(k, 0));
      const int column = static_cast<int>(std::lround(near.x())) - region_.x;
      const int row = static_cast<int>(std::lround(near.y())) - region_.y;
      if (column < 0 || row < 0 || column >= region_.width || row >= region_.height) continue;
      const double daylight = in_.daylight.at<float>(row, column);
      value.blind = value.blind || daylight >= limit;
      value.clipped = value.clipped || daylight + in_.laser_light.at<float>(row, column) >= limit;
    }
  }

  const TruthInput& in_;
  const Scene& scene_;
  const World& world_;
  cv::Rect region_;
  bool by_columns_;
  std::vector<int> casters_;
  Eigen::Isometry3d T_scan_cam_;
  std::vector<std::vector<Spot>> spots_;  // Per scan line.
};

}  // namespace

std::vector<TrueLine> find_truth(const TruthInput& input) { return TruthFinder(input).find(); }

}  // namespace striper::detail
