// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/statistics.hpp>
#include <striper/detect/objects.hpp>
#include <striper/detect/scan_gap.hpp>

#include "detect/objects/object_clusters.hpp"
#include "detect/objects/object_filter.hpp"

namespace striper {
namespace {

using detail::ObjectCluster;
using detail::ObjectFilter;
using detail::ObjectLook;
using detail::OwnStep;
using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double kUnknown = ObjectTrack::kUnknown;

// 99.9 % of a chi-square with 2 degrees of freedom.
constexpr double kGate = 13.8;
const double kTwoSided95 = normal_quantile(0.975);

// Existence: an object is found where it can be with kFound; by chance there is one in the gate
// with kChance. An object in every second scan then loses more than it gains
// (kFound / kChance * (1 - kFound) / (1 - kChance) = .56), so ghosts of a wrong illumination
// pattern never last.
constexpr double kFound = 0.9;
constexpr double kChance = 0.2;
constexpr double kBorn = 0.3;
constexpr double kGone = 0.1;
constexpr double kSurest = 0.9999;
// Predicted so vaguely it may be anything.
constexpr double kLost_m = 1.0;
constexpr std::size_t kMostTracks = 128;
// A track that is a curb with less than this divides no zones.
constexpr double kSureCurb = 0.9;

double after_odds(double probability, double factor) {
  const double odds = probability / (1.0 - probability) * factor;
  return std::min(odds / (1.0 + odds), kSurest);
}

// Fieller (1954): the times T for which distance - closing T is 0 within 95 %.
void set_contact(double distance, double variance_d, double variance_v, double covariance,
                 ObjectTrack& t) {
  const double k2 = kTwoSided95 * kTwoSided95;
  const double v = t.closing_m_s;
  t.time_to_contact_s = t.ttc_low_s = t.ttc_high_s = kUnknown;
  if (v + kTwoSided95 * std::sqrt(variance_v) <= 0.0) return;  // It certainly does not.
  if (v > 0.0) t.time_to_contact_s = distance / v;
  const double a = v * v - k2 * variance_v;
  const double b = distance * v - k2 * covariance;
  const double c = distance * distance - k2 * variance_d;
  const double root = std::sqrt(std::max(b * b - a * c, 0.0));
  t.ttc_low_s = c > 0.0 && b + root > 0.0 ? c / (b + root) : 0.0;
  t.ttc_high_s = a > 0.0 ? (b + root) / a : std::numeric_limits<double>::infinity();
}

}  // namespace

std::string_view to_string(ObjectZone zone) noexcept {
  constexpr std::array<std::string_view, 3> kWords{"unknown", "road", "behind_curb"};
  return kWords[static_cast<std::size_t>(zone)];
}

void ObjectOptions::validate() const {
  require_value(max_gap_m > 0.0 && max_gap_m <= 10.0, "max_gap_m", max_gap_m, "above 0 to 10 m");
  require_value(min_returns >= 2 && min_returns <= 100, "min_returns", min_returns, "2 to 100");
  require_value(roughness_m >= 0.0 && roughness_m <= 1.0, "roughness_m", roughness_m, "0 to 1 m");
  require_value(acceleration_m_s2 > 0.0 && acceleration_m_s2 <= 100.0, "acceleration_m_s2",
                acceleration_m_s2, "above 0 to 100 m/s^2");
  require_value(max_acceleration_m_s2 >= acceleration_m_s2 && max_acceleration_m_s2 <= 1000.0,
                "max_acceleration_m_s2", max_acceleration_m_s2, "acceleration_m_s2 to 1000 m/s^2");
  require_value(max_speed_m_s > 0.0 && max_speed_m_s <= 200.0, "max_speed_m_s", max_speed_m_s,
                "above 0 to 200 m/s");
  require_value(ground_clearance_m >= 0.0 && ground_clearance_m <= 2.0, "ground_clearance_m",
                ground_clearance_m, "0 to 2 m");
  require_value(std::isfinite(forward_rad), "forward_rad", forward_rad, "an angle in radians");
  require_value(mount_m.allFinite(), "mount_m", mount_m.norm(), "a place in metres");
}

struct ObjectTracker::Impl {
  struct Tracked {
    ObjectFilter filter;
    ObjectTrack track;
  };
  struct Pair {
    double cost;
    std::size_t track, cluster;
  };

  OwnStep step_to(const PolarScan& scan, const std::optional<Motion>& motion);
  void associate();
  void take_hit(Tracked& tracked, const ObjectCluster& seen) const;
  void take_miss(Tracked& tracked) const;
  void begin(const ObjectCluster& seen);
  void drop_gone();
  void describe(Tracked& tracked, const OwnStep& own) const;
  void set_velocity(const Tracked& tracked, const OwnStep& own, ObjectTrack& track) const;
  ObjectZone zone_of(const ObjectTrack& track) const;

  ObjectOptions options;
  detail::ObjectClusters clusters;
  std::optional<detail::ObjectGround> ground;
  std::array<CurbEdge, 2> curbs;
  std::size_t curb_count = 0;

  std::vector<Tracked> tracked;
  std::vector<Pair> pairs;
  std::vector<char> is_track_taken, is_cluster_taken;
  std::vector<ObjectTrack> tracks;
  std::uint64_t last_id = 0;

  bool has_scan = false;
  std::int64_t last_ns = 0;
  std::optional<Motion> last_motion;
};

ObjectTracker::ObjectTracker(const ObjectOptions& options) : impl_(std::make_unique<Impl>()) {
  options.validate();
  impl_->options = options;
  impl_->tracked.reserve(kMostTracks);
  impl_->tracks.reserve(kMostTracks);
  impl_->is_track_taken.reserve(kMostTracks);
}
ObjectTracker::ObjectTracker(ObjectTracker&&) noexcept = default;
ObjectTracker& ObjectTracker::operator=(ObjectTracker&&) noexcept = default;
ObjectTracker::~ObjectTracker() = default;

const ObjectOptions& ObjectTracker::options() const noexcept { return impl_->options; }

void ObjectTracker::set_curbs(std::span<const CurbEdge> curbs) noexcept {
  impl_->curb_count = std::min(curbs.size(), impl_->curbs.size());
  std::copy_n(curbs.begin(), impl_->curb_count, impl_->curbs.begin());
}

void ObjectTracker::set_ground(const CurbView* view) noexcept {
  Impl& m = *impl_;
  m.ground.reset();
  m.curb_count = 0;
  if (view == nullptr || !view->has_road) return;
  m.ground.emplace();
  m.ground->road = view->road;
  m.ground->along = view->along;
  for (const CurbFinding& f : view->findings) {
    if (f.kind != CurbKind::kUp || m.curb_count == m.curbs.size()) continue;
    const Vector2d outward = view->outward_at(f.lateral_m);
    m.ground->steps[m.curb_count] = {f.lateral_m, outward.dot(view->along), f.height_m};
    m.curbs[m.curb_count++] = {f.foot_m, outward, f.sigma_lateral_m};
  }
}

// On each side of the road the most certain track; where there is none, what the scan itself shows.
void ObjectTracker::set_street(const CurbDetector& street) noexcept {
  Impl& m = *impl_;
  set_ground(&street.view());
  std::array<double, 2> confidence{};  // Of the edges that are tracked.
  for (const CurbTrack& curb : street.tracks()) {
    if (curb.kind != CurbKind::kUp || curb.confidence < kSureCurb) continue;
    std::size_t side = 0;
    while (side < m.curb_count && m.curbs[side].outward.dot(curb.outward) <= 0.0) ++side;
    if (side == m.curbs.size() || curb.confidence <= confidence[side]) continue;
    m.curb_count = std::max(m.curb_count, side + 1);
    m.curbs[side] = {curb.foot_m, curb.outward, curb.sigma_lateral_m};
    confidence[side] = curb.confidence;
  }
}

std::span<const ObjectTrack> ObjectTracker::update(const PolarScan& scan,
                                                   const std::optional<Motion>& motion) {
  Impl& m = *impl_;
  const OwnStep own = m.step_to(scan, motion);
  for (Impl::Tracked& f : m.tracked) f.filter.predict(own, m.options);
  m.clusters.find(scan, m.options, m.ground);
  m.associate();
  m.drop_gone();
  m.tracks.clear();
  for (Impl::Tracked& f : m.tracked) {
    m.describe(f, own);
    m.tracks.push_back(f.track);
  }
  return m.tracks;
}

// What the vehicle did since the last scan; where that is no use any more, all begins anew.
OwnStep ObjectTracker::Impl::step_to(const PolarScan& scan, const std::optional<Motion>& motion) {
  OwnStep own;
  const bool is_moving = motion && std::isfinite(motion->distance_m);
  own.dt_s = static_cast<double>(scan.time.monotonic_ns - last_ns) * 1e-9;
  const bool is_next =
      has_scan && do_tracks_go_on(own.dt_s) && is_moving == last_motion.has_value();
  if (!is_next) tracked.clear();
  if (is_moving) {
    const Motion from = is_next ? *last_motion : *motion;
    const auto or_zero = [](double value) { return std::isfinite(value) ? value : 0.0; };
    const auto grown = [&](double before, double now) {
      return std::max(or_zero(now) * or_zero(now) - or_zero(before) * or_zero(before), 0.0);
    };
    own.is_known = true;
    own.turn_rad = or_zero(motion->yaw_rad) - or_zero(from.yaw_rad);
    own.turn_variance = grown(from.sigma_yaw_rad, motion->sigma_yaw_rad);
    // In the vehicle: the chord of the arc, and what the sensor's place on it adds.
    const double way = motion->distance_m - from.distance_m;
    const Vector2d chord = Eigen::Rotation2Dd(0.5 * own.turn_rad) * Vector2d(way, 0.0);
    const Vector2d swing = Eigen::Rotation2Dd(own.turn_rad) * options.mount_m - options.mount_m;
    const Eigen::Rotation2Dd to_scan(options.forward_rad);
    const Vector2d forward = to_scan * Vector2d(1.0, 0.0);
    own.shift_m = to_scan * (chord + swing);
    own.shift_covariance =
        grown(from.sigma_distance_m, motion->sigma_distance_m) * forward * forward.transpose();
    const double rate = or_zero(motion->yaw_rate_rad_s);
    const Vector2d lever(-options.mount_m.y() * rate, options.mount_m.x() * rate);
    own.velocity_m_s = to_scan * (Vector2d(or_zero(motion->speed_m_s), 0.0) + lever);
    own.sigma_velocity_m_s = or_zero(motion->sigma_speed_m_s) * forward;
  }
  last_motion = is_moving ? motion : std::nullopt;
  last_ns = scan.time.monotonic_ns;
  has_scan = true;
  return own;
}

// Each track gets one cluster at most and each cluster one track, the most likely pair of all
// first: narrow expectations before wide ones.
void ObjectTracker::Impl::associate() {
  const std::vector<ObjectCluster>& found = clusters.found();
  pairs.clear();
  for (std::size_t t = 0; t < tracked.size(); ++t) {
    for (std::size_t c = 0; c < found.size(); ++c) {
      double spread = 0.0;
      const double d2 = tracked[t].filter.distance2(found[c], spread);
      const double known = 2.0 * std::log(tracked[t].track.confidence);
      if (d2 < kGate) pairs.push_back({d2 + spread - known, t, c});
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.cost < b.cost; });
  is_track_taken.assign(tracked.size(), 0);
  is_cluster_taken.assign(found.size(), 0);
  for (const Pair& p : pairs) {
    if (is_track_taken[p.track] != 0 || is_cluster_taken[p.cluster] != 0) continue;
    is_track_taken[p.track] = is_cluster_taken[p.cluster] = 1;
    take_hit(tracked[p.track], found[p.cluster]);
  }
  for (std::size_t t = 0; t < is_track_taken.size(); ++t)
    if (is_track_taken[t] == 0) take_miss(tracked[t]);
  for (std::size_t c = 0; c < found.size(); ++c)
    if (is_cluster_taken[c] == 0 && tracked.size() < kMostTracks) begin(found[c]);
}

void ObjectTracker::Impl::take_hit(Tracked& f, const ObjectCluster& seen) const {
  f.filter.update(seen);
  f.track.is_seen = true;
  ++f.track.hits;
  ++f.track.scans;
  f.track.confidence = after_odds(f.track.confidence, kFound / kChance);
}

void ObjectTracker::Impl::take_miss(Tracked& f) const {
  f.track.is_seen = false;
  ++f.track.scans;
  const ObjectLook look = clusters.look(f.filter.place(), f.filter.seen().width_m);
  if (look == ObjectLook::kClear)
    f.track.confidence = after_odds(f.track.confidence, (1.0 - kFound) / (1.0 - kChance));
  // Out of sight: nobody will say any more.
  if (look == ObjectLook::kOutside) f.track.confidence = 0.0;
}

void ObjectTracker::Impl::begin(const ObjectCluster& seen) {
  Tracked& f = tracked.emplace_back();
  f.filter.start(seen, options);
  f.track.id = ++last_id;
  f.track.is_seen = true;
  f.track.hits = f.track.scans = 1;
  f.track.confidence = kBorn;
}

void ObjectTracker::Impl::drop_gone() {
  std::erase_if(tracked, [](const Tracked& f) {
    const Matrix2d place = f.filter.covariance().topLeftCorner<2, 2>();
    return f.track.confidence < kGone || (!f.track.is_seen && place.trace() > kLost_m * kLost_m);
  });
}

void ObjectTracker::Impl::describe(Tracked& f, const OwnStep& own) const {
  ObjectTrack& t = f.track;
  const ObjectCluster& seen = f.filter.seen();
  t.width_m = seen.width_m;
  // The closest point moves along with the anchor; its error along the face is its own.
  t.position_m = f.filter.place() + (seen.closest_m - seen.anchor_m);
  const Matrix2d anchor = f.filter.covariance().topLeftCorner<2, 2>();
  const Vector2d n = seen.normal;
  const Vector2d tangent = seen.tangent();
  const double along = tangent.dot(seen.closest_covariance * tangent);
  t.covariance = n.dot(anchor * n) * n * n.transpose() + along * tangent * tangent.transpose();
  if (!t.is_seen) t.covariance += anchor;
  set_velocity(f, own, t);
  t.zone = zone_of(t);
}

void ObjectTracker::Impl::set_velocity(const Tracked& f, const OwnStep& own, ObjectTrack& t) const {
  t.velocity_m_s.setConstant(kUnknown);
  t.is_fully_observed = f.filter.is_fully_observed();
  t.closing_m_s = t.sigma_closing_m_s = t.sigma_v_m_s = t.observable_rad = kUnknown;
  t.time_to_contact_s = t.ttc_low_s = t.ttc_high_s = kUnknown;
  if (t.hits < 2) return;
  const auto& p = f.filter.covariance();
  const Matrix2d pv = p.bottomRightCorner<2, 2>();
  const Vector2d normal = f.filter.seen().normal;
  Vector2d best = normal;
  if (t.is_fully_observed) {
    Eigen::SelfAdjointEigenSolver<Matrix2d> axes;
    axes.computeDirect(pv);
    best = axes.eigenvectors().col(0);
    if (best.dot(t.position_m) < 0.0) best = -best;
  }
  t.observable_rad = std::atan2(best.y(), best.x());
  t.sigma_v_m_s = std::sqrt(best.dot(pv * best));
  t.velocity_m_s =
      t.is_fully_observed ? f.filter.velocity() : Vector2d(best * best.dot(f.filter.velocity()));

  const double distance = t.position_m.norm();
  const Vector2d out = t.is_fully_observed ? Vector2d(t.position_m / distance) : normal;
  const double own_sigma = out.dot(own.sigma_velocity_m_s);
  const double variance = out.dot(pv * out) + own_sigma * own_sigma;
  t.closing_m_s = out.dot(own.velocity_m_s - f.filter.velocity());
  t.sigma_closing_m_s = std::sqrt(variance);
  const double place = out.dot(t.covariance * out);
  const double both = out.dot(p.topRightCorner<2, 2>() * out);
  // Distance and closing speed: farther and faster away go together, so the sign turns.
  set_contact(distance, place, variance, -both, t);
}

ObjectZone ObjectTracker::Impl::zone_of(const ObjectTrack& t) const {
  ObjectZone zone = ObjectZone::kUnknown;
  for (std::size_t i = 0; i < curb_count; ++i) {
    const CurbEdge& curb = curbs[i];
    const double beyond = curb.outward.dot(t.position_m - curb.foot_m);
    const double sigma =
        std::sqrt(curb.outward.dot(t.covariance * curb.outward) + curb.sigma_m * curb.sigma_m);
    if (!(std::abs(beyond) > kTwoSided95 * sigma)) return ObjectZone::kUnknown;
    if (beyond > 0.0) return ObjectZone::kBehindCurb;
    zone = ObjectZone::kRoad;
  }
  return zone;
}

}  // namespace striper
