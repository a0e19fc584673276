// SPDX-License-Identifier: Apache-2.0
#include "follow/object_plot.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "follow/found_tracks.hpp"
#include "program/svg_chart.hpp"

namespace striper::program {
namespace {

using Vector = Eigen::Vector2d;
using Vectors = std::vector<Vector>;

constexpr std::size_t kMostPlaces = 20'000;  // 2 MB of a plot.
constexpr double kSoon_s = 0.1;

// As one looks at a striper from above: forward is up, left is left.
Vector from_above(const Vector& p_scan) { return {-p_scan.y(), p_scan.x()}; }

Vectors all_from_above(const Vectors& points) {
  Vectors seen;
  for (const Vector& p : points) seen.push_back(from_above(p));
  return seen;
}

}  // namespace

void ObjectPlot::add(const PolarScan& scan, std::span<const ObjectTrack> tracks) {
  const double time_s = scan.time.seconds();
  if (std::isnan(start_s_)) start_s_ = time_s;
  Vectors at, soon;
  for (const ObjectTrack& track : tracks) {
    if (track.confidence < FoundTracks::kSure) continue;
    const Vector place(time_s - start_s_, track.position_m.norm());
    Vectors& where = !track.is_seen                          ? hidden_
                     : track.zone == ObjectZone::kBehindCurb ? behind_
                                                             : road_;
    if (where.size() < kMostPlaces) where.push_back(place);
    if (!track.velocity_m_s.allFinite()) continue;
    at.push_back(track.position_m);
    soon.push_back(track.position_m + kSoon_s * track.velocity_m_s);
  }
  if (at.empty() && !returns_.empty()) return;
  title_ = fmt::format("Scan {} from above", scan.sequence);
  at_ = at;
  soon_ = soon;
  returns_.clear();
  for (const Return& r : scan.returns) {
    if (r.status == ReturnStatus::kOk) returns_.emplace_back(r.x_m, r.y_m);
  }
}

std::string ObjectPlot::svg() const {
  Vector low = Vector::Zero();
  Vector high = Vector::Constant(0.1);
  for (const Vectors* const points : {&returns_, &at_}) {
    for (const Vector& p : *points) {
      low = low.cwiseMin(from_above(p));
      high = high.cwiseMax(from_above(p));
    }
  }
  const double margin = 0.05 * (high - low).maxCoeff();
  SvgChart scan(title_, {"to the right (m)", low.x() - margin, high.x() + margin},
                {"forward (m)", low.y() - margin, high.y() + margin}, true);
  scan.dots("return", "#9db4cc", 1.6, all_from_above(returns_));
  scan.bars("its way in a tenth of a second", "#c2410c", all_from_above(at_),
            all_from_above(soon_));
  scan.dots("closest point of an object", "#12395c", 3.0, all_from_above(at_));
  double longest_s = 0.1;
  double farthest_m = 0.1;
  for (const Vectors* const places : {&road_, &behind_, &hidden_}) {
    for (const Vector& p : *places) {
      longest_s = std::max(longest_s, p.x());
      farthest_m = std::max(farthest_m, p.y());
    }
  }
  SvgChart ranges("Their ranges", {"time (s)", 0.0, 1.02 * longest_s},
                  {"range (m)", 0.0, 1.05 * farthest_m});
  ranges.dots("object", "#12395c", 2.0, road_);
  ranges.dots("behind the curb", "#15803d", 2.0, behind_);
  ranges.dots("hidden", "#9db4cc", 2.0, hidden_);
  return svg_of({scan, ranges});
}

}  // namespace striper::program
