// SPDX-License-Identifier: Apache-2.0
#include "detect/objects/object_clusters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>

namespace striper::detail {
namespace {

using Eigen::Vector2d;

constexpr double kPi = std::numbers::pi;
constexpr double kTurn = 2.0 * kPi;

// The most slanted surface whose returns are still neighbours (Borges & Aldon 2004, lambda).
constexpr double kLeastSlant_rad = 10.0 * kPi / 180.0;
constexpr double kGapSigmas = 5.0;   // A jump of less is noise, once in a million.
constexpr double kFaceSigmas = 3.0;  // A return that far off the face is not on it.
// A face whose normal is known less well is one point, seen along the ray.
constexpr double kVagueNormal_rad = 0.3;
// Between neighbours that are farther apart rays were without a return; one alone is a dropout.
constexpr double kSpacingsOfHole = 2.5;
// The face of a curb is within this of its foot, noise and all, and no object.
constexpr double kCurbFace_m = 0.05;

}  // namespace

double ObjectGround::height_m(const Vector2d& p_scan) const noexcept {
  double height = -road.offset_m(p_scan);
  const double lateral = p_scan.dot(along);
  for (const auto& step : steps)
    if (step && (lateral - step->from_m) * step->out > -kCurbFace_m) height -= step->height_m;
  return height;
}

// The face round the closest return: 1/range = p0 cos(b - middle) + p1 sin(b - middle).
struct ObjectClusters::Face {
  LineSums sums;
  LineFit fit;
  double middle_rad = 0.0;
  std::size_t first = 0;
  std::size_t last = 0;

  void add(const Point& p) noexcept {
    const double q = 1.0 / p.range_m;
    const double sigma = p.sigma_m * q * q;
    sums.add(std::cos(p.bearing_rad - middle_rad), std::sin(p.bearing_rad - middle_rad), q,
             1.0 / (sigma * sigma));
  }
  bool takes(const Point& p) const noexcept {
    const double f = std::cos(p.bearing_rad - middle_rad);
    const double g = std::sin(p.bearing_rad - middle_rad);
    const double q = 1.0 / p.range_m;
    const double sigma = p.sigma_m * q * q;
    const double variance = fit.variance_at(f, g) + sigma * sigma;
    const double off = q - fit.at(f, g);
    return off * off <= kFaceSigmas * kFaceSigmas * variance;
  }
  // Takes what lies on the line next to it on one side; one return may be off.
  void grow(const std::vector<Point>& points, std::size_t end, std::ptrdiff_t step) {
    std::size_t& edge = step < 0 ? first : last;
    for (std::size_t at = edge; at != end;) {
      at += static_cast<std::size_t>(step);
      if (takes(points[at])) {
        add(points[at]);
        fit = sums.solve();
        edge = at;
      } else if (at - edge != static_cast<std::size_t>(step)) {
        return;
      }
    }
  }
  // A point that is seen along the middle ray: the mean of 1/range.
  void make_vague() noexcept {
    fit = {};
    fit.parameters[0] = sums.fz / sums.ff;
    fit.covariance(0, 0) = 1.0 / sums.ff;
    fit.covariance(1, 1) = fit.parameters[0] * fit.parameters[0];  // A radian.
  }
  double q_at(double bearing) const noexcept {
    return fit.at(std::cos(bearing - middle_rad), std::sin(bearing - middle_rad));
  }
  double range_variance_at(double bearing) const noexcept {
    const double q = q_at(bearing);
    return fit.variance_at(std::cos(bearing - middle_rad), std::sin(bearing - middle_rad)) /
           (q * q * q * q);
  }
  double normal_rad() const noexcept {
    return middle_rad + std::atan2(fit.parameters[1], fit.parameters[0]);
  }
  double distance_m() const noexcept { return 1.0 / fit.parameters.norm(); }
  double sigma_normal_rad() const noexcept {
    const double q2 = fit.parameters.squaredNorm();
    const Vector2d turn(-fit.parameters[1] / q2, fit.parameters[0] / q2);
    return std::sqrt(turn.dot(fit.covariance * turn));
  }
};

void ObjectClusters::find(const PolarScan& scan, const ObjectOptions& options,
                          const std::optional<ObjectGround>& ground) {
  clusters_.clear();
  collect(scan, options, ground);
  if (points_.empty()) return;
  close_circle(options);
  std::size_t first = 0;
  for (std::size_t i = 1; i <= points_.size(); ++i) {
    if (i < points_.size() && !are_apart(points_[i - 1], points_[i], options)) continue;
    const bool is_enough = i - first >= static_cast<std::size_t>(options.min_returns);
    if (is_enough && !points_[first].is_ground) add(first, i - 1, options);
    first = i;
  }
}

void ObjectClusters::collect(const PolarScan& scan, const ObjectOptions& options,
                             const std::optional<ObjectGround>& ground) {
  points_.clear();
  std::size_t before = 0;  // Rays without a return before the first one, and after the last.
  std::size_t after = 0;
  for (const Return& r : scan.returns) {
    ++(points_.empty() ? before : after);
    if (verdict(r.status) != Verdict::kGood || !(r.range_m > 0.0) || !(r.sigma_m > 0.0)) continue;
    const Vector2d p(r.x_m, r.y_m);
    const bool is_ground = ground && ground->height_m(p) < options.ground_clearance_m;
    if (points_.empty()) --before;
    after = 0;
    points_.push_back({r.bearing_rad, r.range_m, r.sigma_m, p, is_ground});
  }
  const auto is_before = [](const Point& a, const Point& b) {
    return a.bearing_rad < b.bearing_rad;
  };
  if (points_.size() > 1 && points_.back().bearing_rad < points_.front().bearing_rad) {
    std::reverse(points_.begin(), points_.end());
    std::swap(before, after);
  }
  if (!std::is_sorted(points_.begin(), points_.end(), is_before))
    std::sort(points_.begin(), points_.end(), is_before);
  spacing_rad_ = typical_spacing();
  empty_before_rad_ = static_cast<double>(before) * spacing_rad_;
  empty_after_rad_ = static_cast<double>(after) * spacing_rad_;
}

double ObjectClusters::typical_spacing() {
  gaps_.clear();
  for (std::size_t i = 1; i < points_.size(); ++i)
    gaps_.push_back(points_[i].bearing_rad - points_[i - 1].bearing_rad);
  return gaps_.empty() ? 0.0 : upper_median(gaps_);
}

// A scanner that looks all round: begins at a gap, so that no object is cut in two.
void ObjectClusters::close_circle(const ObjectOptions& options) {
  const double open = points_.front().bearing_rad + kTurn - points_.back().bearing_rad;
  is_circle_ = open < kTurn / 8.0 && points_.size() > 2;
  if (!is_circle_) return;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    if (!are_apart(points_[i - 1], points_[i], options)) continue;
    for (std::size_t k = 0; k < i; ++k) points_[k].bearing_rad += kTurn;
    std::rotate(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(i), points_.end());
    return;
  }
}

bool ObjectClusters::are_apart(const Point& a, const Point& b,
                               const ObjectOptions& options) const noexcept {
  if (a.is_ground != b.is_ground) return true;
  const double turn = b.bearing_rad - a.bearing_rad;
  if (turn >= kLeastSlant_rad) return true;
  const double slanted =
      std::min(a.range_m, b.range_m) * std::sin(turn) / std::sin(kLeastSlant_rad - turn);
  const double noise = kGapSigmas * std::hypot(a.sigma_m, b.sigma_m);
  return (a.at_m - b.at_m).norm() > std::min(slanted, options.max_gap_m) + noise;
}

// The end of an object is where the next ray goes farther, or there is one without a return.
bool ObjectClusters::is_end_seen(std::size_t at, std::ptrdiff_t step) const noexcept {
  const std::size_t n = points_.size();
  const bool is_border = step < 0 ? at == 0 : at + 1 == n;
  if (is_border && !is_circle_) return (step < 0 ? empty_before_rad_ : empty_after_rad_) > 0.0;
  const std::size_t next = (at + n + static_cast<std::size_t>(step)) % n;
  const double turn = std::remainder(points_[next].bearing_rad - points_[at].bearing_rad, kTurn);
  return std::abs(turn) > kSpacingsOfHole * spacing_rad_ ||
         points_[next].range_m > points_[at].range_m;
}

ObjectClusters::Face ObjectClusters::face_of(std::size_t first, std::size_t last) const noexcept {
  std::size_t closest = first;
  for (std::size_t i = first; i <= last; ++i)
    if (points_[i].range_m < points_[closest].range_m) closest = i;
  Face face;
  face.first = std::max(closest, first + 1) - 1;
  face.last = std::min(face.first + 2, last);
  face.first = face.last >= first + 2 ? face.last - 2 : first;
  face.middle_rad = points_[closest].bearing_rad;
  for (std::size_t i = face.first; i <= face.last; ++i) face.add(points_[i]);
  face.fit = face.sums.solve();
  if (face.fit.is_determined) {
    face.grow(points_, first, -1);
    face.grow(points_, last, 1);
    face.grow(points_, first, -1);
  }
  if (!face.fit.is_determined || !(face.sigma_normal_rad() < kVagueNormal_rad)) face.make_vague();
  return face;
}

void ObjectClusters::add(std::size_t first, std::size_t last, const ObjectOptions& options) {
  const Face face = face_of(first, last);
  const double rough = options.roughness_m * options.roughness_m;
  ObjectCluster c;
  c.first = first;
  c.last = last;
  c.are_ends_seen = is_end_seen(first, -1) && is_end_seen(last, 1);
  const Point& begin = points_[first];
  const Point& end = points_[last];
  const double spacing = spacing_rad_ * 0.5 * (begin.range_m + end.range_m);
  c.width_m = (end.at_m - begin.at_m).norm() + spacing;

  const double normal = face.normal_rad();
  c.normal = {std::cos(normal), std::sin(normal)};
  c.sigma_normal_rad = face.sigma_normal_rad();
  // The foot of the perpendicular, where the face has it; else its nearer end.
  const double low = points_[face.first].bearing_rad - 0.5 * spacing_rad_;
  const double high = points_[face.last].bearing_rad + 0.5 * spacing_rad_;
  const double nearest = std::clamp(normal, low, high);
  const double range = 1.0 / face.q_at(nearest);
  const double slant = std::cos(nearest - normal);
  c.closest_m = range * Vector2d(std::cos(nearest), std::sin(nearest));
  const double foot_sigma = nearest == normal
                                ? std::min(range * c.sigma_normal_rad, c.width_m / std::sqrt(12.0))
                                : spacing / std::sqrt(12.0) / slant;
  const double closest_variance = face.range_variance_at(nearest) * slant * slant + rough;
  c.closest_covariance = closest_variance * c.normal * c.normal.transpose() +
                         foot_sigma * foot_sigma * c.tangent() * c.tangent().transpose();

  c.anchor_m = c.closest_m;
  c.normal_variance = closest_variance;
  c.tangent_variance = c.width_m * c.width_m / 12.0;
  if (c.are_ends_seen) {
    const Vector2d middle = 0.5 * (begin.at_m + end.at_m);
    c.anchor_m = middle + c.normal * (face.distance_m() - c.normal.dot(middle));
    const double bearing = std::atan2(c.anchor_m.y(), c.anchor_m.x());
    const double facing = std::cos(bearing - normal);
    c.normal_variance = face.range_variance_at(bearing) * facing * facing + rough;
    c.tangent_variance = spacing * spacing / 24.0 + rough;
  }
  clusters_.push_back(c);
}

ObjectLook ObjectClusters::look(const Vector2d& centre_m, double width_m) const noexcept {
  if (points_.empty()) return ObjectLook::kClear;
  const double range = centre_m.norm();
  const double half = std::atan2(0.5 * width_m, range);
  double bearing = std::atan2(centre_m.y(), centre_m.x());
  if (bearing < points_.front().bearing_rad - kPi) bearing += kTurn;
  if (is_circle_ && bearing < points_.front().bearing_rad) bearing += kTurn;
  if (!is_circle_ && (bearing < points_.front().bearing_rad - empty_before_rad_ ||
                      bearing > points_.back().bearing_rad + empty_after_rad_))
    return ObjectLook::kOutside;
  int nearer = 0;
  int others = 0;
  const auto begin =
      std::lower_bound(points_.begin(), points_.end(), bearing - half,
                       [](const Point& p, double limit) { return p.bearing_rad < limit; });
  for (auto p = begin; p != points_.end() && p->bearing_rad <= bearing + half; ++p)
    ++(p->range_m < range - kGapSigmas * p->sigma_m - 0.5 * width_m ? nearer : others);
  return nearer > others ? ObjectLook::kHidden : ObjectLook::kClear;
}

}  // namespace striper::detail
