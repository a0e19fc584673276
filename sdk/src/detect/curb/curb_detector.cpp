// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/detect/curb_detector.hpp>
#include <striper/detect/scan_gap.hpp>

#include "detect/curb/curb_hypotheses.hpp"
#include "detect/curb/curb_path.hpp"
#include "detect/curb/curb_posterior.hpp"

namespace striper {
namespace {

using detail::CurbHypotheses;
using detail::CurbPath;

// Chi-square, 2 degrees of freedom: four sigma of the one that is off.
constexpr double kGate = 16.0;

// Two curbs are not so near to each other: what is beyond the gate there had too small a bar.
constexpr double kSamePlace_m = 0.005;

constexpr double kLeastLikely = 0.01;  // Less, and a track is forgotten.
constexpr double kLongestHidden_m = 5.0;
constexpr int kHitsOfKnown = 3;
constexpr std::size_t kMostTracks = 16;

// What begins so near to a track is beside the same verge: blades of other heights.
constexpr double kSameVerge_m = 0.1;

// Ground that is seen beyond where a curb should be is no curb; nearer it may be the curb's own.
constexpr double kClearBeyond_m = 0.05;

constexpr std::array<std::string_view, 3> kStateWords{"new", "tracked", "hidden"};

bool is_sidewise(CurbKind kind) noexcept {
  return kind == CurbKind::kUp || kind == CurbKind::kDown || kind == CurbKind::kRamp;
}

// A track, and what is not told of it.
struct Tracked {
  CurbTrack track;
  CurbPath path;
  CurbHypotheses what;
  Eigen::Vector2d edge_m{0.0, 0.0};  // From the foot: along the road and above it.
  double hidden_m = 0.0;             // Way since it was seen, or clearly not.
  bool is_seen = false;
};

}  // namespace

std::string_view to_string(CurbState state) noexcept {
  return kStateWords[static_cast<std::size_t>(state)];
}

void CurbDetectorOptions::validate() const {
  curb.validate();
  require_value(slope > 0.0 && slope <= 10.0, "slope", slope, "0 < slope <= 10");
  require_value(bend > 0.0 && bend <= 10.0, "bend", bend, "0 < bend <= 10");
  require_value(straightness_m >= 0.0 && straightness_m <= 1.0, "straightness_m", straightness_m,
                "0 to 1 m");
  require_value(height_change_m >= 0.0 && height_change_m <= 1.0, "height_change_m",
                height_change_m, "0 to 1 m");
  require_value(object_length_m > 0.0 && object_length_m <= 100.0, "object_length_m",
                object_length_m, "0 < length <= 100 m");
  require_value(speed_m_s >= 0.0 && speed_m_s <= 100.0, "speed_m_s", speed_m_s, "0 to 100 m/s");
}

struct CurbDetector::Impl {
  struct Step {
    double way_m = 0.0;
    double turn_rad = 0.0;
  };

  Impl(const CurbDetectorOptions& how, std::shared_ptr<const StriperModel> model)
      : options(how), finder(how.curb, std::move(model)) {
    tracked.reserve(kMostTracks);
    told.reserve(kMostTracks);
  }

  Step step_to(double time_s, const std::optional<Motion>& motion);
  void predict(const Step& step);
  void take(const CurbFinding& finding, const CurbView& view);
  Tracked* owner_of(const CurbFinding& finding);
  double overgrown_at(double lateral_m) const;
  void hit(Tracked& one, const CurbFinding& finding, const CurbView& view);
  const CurbFinding* finding_beside(const Tracked& one, const CurbView& view) const;
  void look_for_unseen(const CurbView& view, double way_m);
  bool is_clearly_absent(const Tracked& one, const CurbView& view) const;
  void forget();
  void tell();

  CurbDetectorOptions options;
  CurbFinder finder;
  const CurbView* view = nullptr;
  double time_s = CurbTrack::kUnknown;
  std::optional<Motion> motion;
  ScanLine road;                    // The last that was seen,
  Eigen::Vector2d along{1.0, 0.0};  // and its direction.
  std::uint64_t next_id = 1;
  std::vector<Tracked> tracked;
  std::vector<CurbTrack> told;
  double way_m = 0.0;  // Of this step.
};

CurbDetector::CurbDetector(const CurbDetectorOptions& options,
                           std::shared_ptr<const StriperModel> model) {
  options.validate();
  impl_ = std::make_unique<Impl>(options, std::move(model));
}
CurbDetector::CurbDetector(CurbDetector&&) noexcept = default;
CurbDetector& CurbDetector::operator=(CurbDetector&&) noexcept = default;
CurbDetector::~CurbDetector() = default;

const CurbDetectorOptions& CurbDetector::options() const noexcept { return impl_->options; }

std::span<const CurbTrack> CurbDetector::tracks() const noexcept { return impl_->told; }

const CurbView& CurbDetector::view() const noexcept {
  static const CurbView kNothing;
  return impl_->view == nullptr ? kNothing : *impl_->view;
}

std::span<const CurbTrack> CurbDetector::update(const PolarScan& scan,
                                                const std::optional<Motion>& motion) {
  Impl& m = *impl_;
  const Impl::Step step = m.step_to(scan.time.seconds(), motion);
  m.predict(step);
  m.view = &m.finder.find(scan);
  if (m.view->has_road) {
    m.road = m.view->road;
    m.along = m.view->along;
  }
  for (const CurbFinding& finding : m.view->findings) m.take(finding, *m.view);
  m.look_for_unseen(*m.view, step.way_m);
  m.forget();
  m.tell();
  return m.told;
}

// The way since the last scan; all begins anew where that is not known.
CurbDetector::Impl::Step CurbDetector::Impl::step_to(double now_s,
                                                     const std::optional<Motion>& now) {
  const double passed_s = now_s - time_s;
  const bool is_next = do_tracks_go_on(passed_s);
  const auto is_moved = [](const std::optional<Motion>& one) {
    return one && std::isfinite(one->distance_m);
  };
  Step step{options.speed_m_s * passed_s, 0.0};
  if (is_moved(now) && is_moved(motion)) {
    step.way_m = std::abs(now->distance_m - motion->distance_m);
    const double turn_rad = now->yaw_rad - motion->yaw_rad;
    if (std::isfinite(turn_rad)) step.turn_rad = turn_rad;
  }
  time_s = now_s;
  motion = now;
  if (is_next) return step;
  tracked.clear();
  return {};
}

void CurbDetector::Impl::predict(const Step& step) {
  way_m = step.way_m;
  for (Tracked& one : tracked) {
    one.path.predict(step.way_m, step.turn_rad, options);
    one.track.way_m += step.way_m;
    one.is_seen = false;
  }
}

// The track that a finding is of: the most likely one, or else the one at the same place.
Tracked* CurbDetector::Impl::owner_of(const CurbFinding& finding) {
  Tracked* owner = nullptr;
  Tracked* neighbour = nullptr;
  double least = kGate;
  double nearest_m = kSamePlace_m;
  for (Tracked& one : tracked) {
    if (one.is_seen) continue;
    const double distance2 = one.path.distance2(finding, options);
    if (distance2 < least) {
      least = distance2;
      owner = &one;
    }
    const double apart_m = std::hypot(one.path.lateral_m() - finding.lateral_m,
                                      one.path.height_m() - finding.height_m);
    if (apart_m >= nearest_m) continue;
    nearest_m = apart_m;
    neighbour = &one;
  }
  return owner != nullptr ? owner : neighbour;
}

// As the nearest track says, before it is looked at.
double CurbDetector::Impl::overgrown_at(double lateral_m) const {
  double nearest_m = kSameVerge_m;
  double overgrown = detail::kOvergrown;
  for (const Tracked& one : tracked) {
    const double apart_m = std::abs(one.path.lateral_m() - lateral_m);
    if (apart_m >= nearest_m) continue;
    nearest_m = apart_m;
    overgrown = one.what.probability_of_overgrown();
  }
  return overgrown;
}

void CurbDetector::Impl::take(const CurbFinding& finding, const CurbView& seen) {
  if (!std::isfinite(finding.lateral_m) || !(finding.sigma_lateral_m > 0.0)) return;
  if (Tracked* const owner = owner_of(finding)) return hit(*owner, finding, seen);
  // A verge at the road's level tells of what is tracked; by itself it is none.
  const bool has_height = std::isfinite(finding.height_m) && std::isfinite(finding.sigma_height_m);
  if (!has_height || tracked.size() == kMostTracks) return;
  const double overgrown = overgrown_at(finding.lateral_m);
  Tracked& fresh = tracked.emplace_back();
  fresh.track.id = next_id++;
  fresh.path.start(finding, options);
  fresh.what.start(finding, overgrown);
  fresh.hidden_m = -way_m;
  fresh.track.hits = 0;
  hit(fresh, finding, seen);
}

void CurbDetector::Impl::hit(Tracked& one, const CurbFinding& finding, const CurbView& seen) {
  if (one.track.hits++ > 0) {
    // Where its bar was too small: as much as the gate lets through.
    const double beyond = std::sqrt(std::max(1.0, one.path.distance2(finding, options) / kGate));
    CurbFinding seen_as = finding;
    seen_as.sigma_lateral_m *= beyond;
    seen_as.sigma_height_m *= beyond;
    one.path.update(seen_as, options);
    one.what.hit(finding, one.hidden_m + way_m, options.object_length_m);
  }
  one.is_seen = true;
  one.hidden_m = 0.0;
  one.track.outward = seen.outward_at(finding.lateral_m);
  one.track.sigma_cal_lateral_m = finding.sigma_cal_lateral_m;
  one.track.sigma_cal_height_m = finding.sigma_cal_height_m;
  const Eigen::Vector2d edge = finding.top_m - finding.foot_m;
  if (edge.allFinite()) one.edge_m = {edge.dot(seen.along), -edge.dot(seen.road.normal())};
}

// Beyond it there is ground of the same road, and nothing nearer that could hide it.
bool CurbDetector::Impl::is_clearly_absent(const Tracked& one, const CurbView& seen) const {
  if (!seen.has_road) return false;
  const double margin = std::max(3.0 * one.path.sigma_lateral_m(), kClearBeyond_m);
  const double lateral = one.path.lateral_m();
  return seen.from_m < lateral - margin && seen.to_m > lateral + margin;
}

// What is found where a track is, and is not its own; null where there is nothing.
const CurbFinding* CurbDetector::Impl::finding_beside(const Tracked& one,
                                                      const CurbView& seen) const {
  const CurbFinding* nearest = nullptr;
  double nearest_m = kSameVerge_m;
  for (const CurbFinding& finding : seen.findings) {
    const double apart_m = std::abs(finding.lateral_m - one.path.lateral_m());
    if (!(apart_m < nearest_m)) continue;
    nearest_m = apart_m;
    nearest = &finding;
  }
  return nearest;
}

void CurbDetector::Impl::look_for_unseen(const CurbView& seen, double step_m) {
  for (Tracked& one : tracked) {
    if (one.is_seen) continue;
    one.hidden_m += step_m;
    if (const CurbFinding* const other = finding_beside(one, seen)) {
      one.what.see_beside(*other, step_m);
    }
    if (!is_clearly_absent(one, seen)) continue;
    one.what.miss(one.hidden_m, options.object_length_m);
    one.hidden_m = 0.0;
  }
}

void CurbDetector::Impl::forget() {
  std::erase_if(tracked, [](const Tracked& one) {
    return one.what.probability_of_something() < kLeastLikely || one.hidden_m > kLongestHidden_m;
  });
}

void CurbDetector::Impl::tell() {
  told.clear();
  const Eigen::Vector2d up = -road.normal();
  const Eigen::Vector2d below = road.distance_m * road.normal();
  for (Tracked& one : tracked) {
    CurbTrack& track = one.track;
    track.kind = one.what.kind();
    if (!is_sidewise(track.kind)) continue;
    track.confidence = one.what.probability_of_curb();
    const bool is_known = track.hits >= kHitsOfKnown;
    track.state = !is_known     ? CurbState::kNew
                  : one.is_seen ? CurbState::kTracked
                                : CurbState::kHidden;
    track.lateral_m = one.path.lateral_m();
    track.sigma_lateral_m = one.path.sigma_lateral_m();
    track.height_m = one.path.height_m();
    track.sigma_height_m = one.path.sigma_height_m();
    track.slope = one.path.slope();
    track.sigma_slope = one.path.sigma_slope();
    track.foot_m = below + track.lateral_m * along;
    track.top_m = track.foot_m + one.edge_m.x() * along + one.edge_m.y() * up;
    told.push_back(track);
  }
}

}  // namespace striper
