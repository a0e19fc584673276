// SPDX-License-Identifier: Apache-2.0
#include "follow/curb_plot.hpp"

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

/// Across the road: lateral to the right, height above the road up.
Vector across(const CurbView& view, const Vector& at_m) {
  return {view.along.dot(at_m), -view.road.offset_m(at_m)};
}

// Every second of the points, from the first or the second.
Vectors every_second(const Vectors& points, std::size_t from) {
  Vectors some;
  for (std::size_t i = from; i < points.size(); i += 2) some.push_back(points[i]);
  return some;
}

struct Reach {
  Vector low = Vector::Constant(1e9);
  Vector high = Vector::Constant(-1e9);

  void take(const Vector& at) {
    if (!at.allFinite()) return;
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  ChartAxis axis(int k, const char* label, double least) const {
    const double middle = 0.5 * (low[k] + high[k]);
    const double half = std::max(0.55 * (high[k] - low[k]), least);
    return {label, middle - half, middle + half};
  }
};

void add_bars(SvgChart& chart, const char* name, const char* colour, const Vectors& at,
              const std::vector<double>& half) {
  Vectors from, to;
  for (std::size_t i = 0; i < at.size(); ++i) {
    from.emplace_back(at[i].x(), at[i].y() - half[i]);
    to.emplace_back(at[i].x(), at[i].y() + half[i]);
  }
  chart.bars(name, colour, from, to);
}

}  // namespace

void CurbPlot::add(const PolarScan& scan, const CurbView& view, std::span<const CurbTrack> tracks,
                   double way_m) {
  for (const CurbTrack& track : tracks) {
    if (places_.size() == kMostPlaces) break;
    places_.push_back({way_m, track.lateral_m, track.sigma_lateral_m, track.height_m,
                       track.sigma_height_m, track.state != CurbState::kHidden,
                       track.confidence >= FoundTracks::kSure});
  }
  double best = 0.0;
  for (const CurbFinding& f : view.findings) best = std::max(best, f.probability());
  if (!view.has_road || best <= best_) return;
  best_ = best;
  title_ = fmt::format("Scan {}, across the road", scan.sequence);
  returns_.clear();
  for (const Return& r : scan.returns) {
    if (r.status == ReturnStatus::kOk) returns_.push_back(across(view, {r.x_m, r.y_m}));
  }
  road_.clear();
  face_.clear();
  top_.clear();
  for (const CurbFinding& f : view.findings) {
    const auto add_line = [&](Vectors& lines, const Vector& from, const Vector& to) {
      lines.push_back(across(view, from));
      lines.push_back(across(view, to));
    };
    add_line(road_, f.road_m, f.foot_m);
    add_line(face_, f.foot_m, f.top_m);
    add_line(top_, f.top_m, f.beyond_m);
  }
}

std::string CurbPlot::svg() const {
  Reach scan_reach;
  for (const Vector& at : returns_) scan_reach.take(at);
  std::vector<SvgChart> charts;
  if (!returns_.empty()) {
    SvgChart chart(title_, scan_reach.axis(0, "along the road's line (m)", 0.1),
                   scan_reach.axis(1, "height (m)", 0.2), true);
    chart.dots("return", "#9db4cc", 1.6, returns_);
    chart.bars("road", "#12395c", every_second(road_, 0), every_second(road_, 1));
    chart.bars("face", "#c2410c", every_second(face_, 0), every_second(face_, 1));
    chart.bars("top", "#15803d", every_second(top_, 0), every_second(top_, 1));
    charts.push_back(chart);
  }
  Vectors lateral_sure, lateral_unsure, lateral_hidden, all_lateral, all_height;
  std::vector<double> sigma_lateral, sigma_height;
  Reach place_reach, height_reach;
  for (const Place& p : places_) {
    const Vector lateral(p.way_m, p.lateral_m);
    (!p.is_seen ? lateral_hidden : p.is_sure ? lateral_sure : lateral_unsure).push_back(lateral);
    all_lateral.push_back(lateral);
    all_height.emplace_back(p.way_m, p.height_m);
    sigma_lateral.push_back(p.sigma_lateral_m);
    sigma_height.push_back(p.sigma_height_m);
    place_reach.take(lateral);
    height_reach.take({p.way_m, p.height_m});
  }
  if (places_.empty()) return svg_of(charts);
  SvgChart map("Curbs along the way", place_reach.axis(0, "way (m)", 0.5),
               place_reach.axis(1, "lateral (m)", 0.1));
  add_bars(map, "one sigma", "#f0a030", all_lateral, sigma_lateral);
  map.dots("certainly a curb", "#12395c", 2.4, lateral_sure);
  map.dots("less sure, or a ramp", "#c2410c", 2.0, lateral_unsure);
  map.dots("hidden", "#9db4cc", 2.0, lateral_hidden);
  charts.push_back(map);
  SvgChart heights("Their heights", height_reach.axis(0, "way (m)", 0.5),
                   height_reach.axis(1, "height (m)", 0.02));
  add_bars(heights, "one sigma", "#f0a030", all_height, sigma_height);
  heights.dots("height", "#12395c", 2.0, all_height);
  charts.push_back(heights);
  return svg_of(charts);
}

}  // namespace striper::program
