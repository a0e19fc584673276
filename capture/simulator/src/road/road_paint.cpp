// SPDX-License-Identifier: Apache-2.0
#include "road/road_paint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "light/random.hpp"

namespace striper::detail {
namespace {

constexpr double kStep_m = 0.01;
constexpr double kBeyond_m = 60.0;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

enum Purpose : std::uint64_t { kEdges = 1, kChunks, kEnds, kTexture };

std::size_t cells(const Road& road) {
  return static_cast<std::size_t>((road.length_m + 2.0 * kBeyond_m) / kStep_m) + 1;
}

double cell_of(double along_m) { return (along_m + kBeyond_m) / kStep_m; }

// Share of a spot of this size that lies below `edge_m`, at `at_m`.
double below(double at_m, double edge_m, double spot_m) {
  return std::clamp((edge_m - at_m) / spot_m + 0.5, 0.0, 1.0);
}

// An Ornstein-Uhlenbeck process, and pieces broken off.
std::vector<double> worn_edge(const Road& road, std::uint64_t number) {
  const RoadWear& wear = road.wear;
  std::vector<double> worn(cells(road), 0.0);
  PixelRandom random(road.seed, kEdges, number, 0);
  const double alike = std::exp(-kStep_m / wear.edge_length_m);
  double now_m = wear.edge_sd_m * random.normal();
  for (double& one : worn) {
    now_m = alike * now_m + wear.edge_sd_m * std::sqrt(1.0 - alike * alike) * random.normal();
    one = now_m;
  }
  if (wear.chunks_per_m <= 0.0) return worn;
  PixelRandom chunks(road.seed, kChunks, number, 0);
  const auto next = [&] { return -std::log(chunks.uniform()) / wear.chunks_per_m; };
  const double end_m = static_cast<double>(worn.size()) * kStep_m;
  for (double at_m = next(); at_m < end_m; at_m += next()) {
    const double depth_m = wear.chunk_depth_m * (0.3 + 0.7 * chunks.uniform());
    const double length_m = 0.05 + 0.15 * chunks.uniform();
    const auto last = std::min(worn.size(), static_cast<std::size_t>((at_m + length_m) / kStep_m));
    for (auto i = static_cast<std::size_t>(at_m / kStep_m); i < last; ++i) worn[i] += depth_m;
  }
  return worn;
}

struct Usual {
  double length_m, width_m, brightness;
};

Usual usual(const std::string& kind) {
  if (kind == "marker") return {0.025, 0.1, 2.5};
  if (kind == "tape") return {0.3, 0.05, 2.0};
  if (kind == "cross") return {3.0, 1.2, 0.6};
  if (kind == "letter") return {2.4, 0.4, 0.6};
  return {0.12, 0.12, 0.5};
}

double or_usual(double given, double as_usual) { return std::isnan(given) ? as_usual : given; }

}  // namespace

RoadPaint::RoadPaint(const Road& road) : road_(road), fresh_m_(cells(road), kUnknown) {
  for (std::size_t i = 0; i < road.lines.size(); ++i) {
    edges_.push_back({worn_edge(road, 2 * i), worn_edge(road, 2 * i + 1)});
    const RoadLine& line = road.lines[i];
    PixelRandom random(road.seed, kEnds, i, 0);
    std::vector<Dash> dashes;
    const double end_m = std::min(line.end_m, road.length_m + kBeyond_m);
    const double cycle_m = line.dash_m > 0.0 ? line.dash_m + line.gap_m : end_m - line.begin_m;
    for (double from_m = line.begin_m; from_m < end_m; from_m += cycle_m) {
      const double to_m = line.dash_m > 0.0 ? std::min(from_m + line.dash_m, end_m) : end_m;
      const double off_begin_m = std::abs(road.wear.end_sd_m * random.normal());
      const double off_end_m = std::abs(road.wear.end_sd_m * random.normal());
      dashes.push_back({from_m + off_begin_m, to_m - off_end_m});
    }
    dashes_.push_back(std::move(dashes));
  }
  for (const RoadObject& object : road.objects) {
    const Usual as = usual(object.kind);
    const double length_m = or_usual(object.length_m, as.length_m);
    const double half_m = 0.5 * or_usual(object.width_m, as.width_m);
    const double brightness = or_usual(object.brightness, as.brightness);
    const auto bar = [&](double from_m, double to_m, double left_m, double right_m) {
      bars_.push_back({object.at_m + from_m, object.at_m + to_m, object.lateral_m + left_m,
                       object.lateral_m + right_m, brightness});
    };
    if (object.kind == "cross") {
      const double bar_m = 0.3;
      bar(0.0, length_m, 0.5 * bar_m, -0.5 * bar_m);
      bar(0.5 * (length_m - bar_m), 0.5 * (length_m + bar_m), half_m, -half_m);
    } else if (object.kind == "letter") {  // An E.
      const double stroke_m = 0.1;
      bar(0.0, length_m, half_m, half_m - stroke_m);
      for (const double at_m : {0.0, 0.5 * length_m - stroke_m, length_m - 2.0 * stroke_m}) {
        bar(at_m, at_m + 2.0 * stroke_m, half_m, -half_m);
      }
    } else {
      bar(0.0, length_m, half_m, -half_m);
    }
  }
}

const RoadLine* RoadPaint::line(int number) const noexcept {
  for (const RoadLine& one : road_.lines) {
    if (one.line == number) return &one;
  }
  return nullptr;
}

double RoadPaint::presence(std::size_t line, double along_m, double spot_m) const noexcept {
  const std::vector<Dash>& dashes = dashes_[line];
  // The dash that begins last before here, and the next: a spot may reach into both.
  auto next = std::upper_bound(dashes.begin(), dashes.end(), along_m,
                               [](double at_m, const Dash& dash) { return at_m < dash.from_m; });
  double share = 0.0;
  if (next != dashes.end()) share += 1.0 - below(along_m, next->from_m, spot_m);
  if (next != dashes.begin()) {
    const Dash& dash = *std::prev(next);
    share += below(along_m, dash.to_m, spot_m) - below(along_m, dash.from_m, spot_m);
  }
  return std::clamp(share, 0.0, 1.0);
}

void RoadPaint::cut(double along_m, double spot_m, std::vector<Cut>& cuts) const {
  cuts.clear();
  const double cell =
      std::clamp(cell_of(along_m), 0.0, static_cast<double>(fresh_m_.size()) - 1.001);
  const auto i = static_cast<std::size_t>(cell);
  const double share = cell - static_cast<double>(i);
  const auto mean = [&](const std::vector<double>& of) {
    return of[i] + share * (of[i + 1] - of[i]);
  };
  for (std::size_t k = 0; k < road_.lines.size(); ++k) {
    const double there = presence(k, along_m, spot_m);
    if (there <= 0.0) continue;
    const RoadLine& line = road_.lines[k];
    const double left_m = line.lateral_m + 0.5 * line.width_m - mean(edges_[k].left_m);
    const double right_m = line.lateral_m - 0.5 * line.width_m + mean(edges_[k].right_m);
    if (left_m > right_m) cuts.push_back({left_m, right_m, there * line.brightness});
  }
  for (const Bar& bar : bars_) {
    const double there = below(along_m, bar.to_m, spot_m) - below(along_m, bar.from_m, spot_m);
    if (there > 0.0) cuts.push_back({bar.left_m, bar.right_m, there * bar.brightness});
  }
  if (std::isfinite(fresh_m_[i])) {
    const double half_m = 0.5 * road_.truck.stripe.width_m;
    cuts.push_back({fresh_m_[i] + half_m, fresh_m_[i] - half_m, road_.light.fresh_share});
  }
}

bool RoadPaint::is_painted(double along_m, int number) const noexcept {
  for (std::size_t k = 0; k < road_.lines.size(); ++k) {
    if (road_.lines[k].line == number && presence(k, along_m, 1e-6) > 0.5) return true;
  }
  return false;
}

void RoadPaint::paint(double from_m, double to_m, double lateral_m) {
  const double most = static_cast<double>(fresh_m_.size()) - 1.0;
  const auto first = static_cast<std::size_t>(std::clamp(cell_of(from_m), 0.0, most));
  const auto last = static_cast<std::size_t>(std::clamp(cell_of(to_m), 0.0, most));
  for (std::size_t i = first; i < last; ++i) fresh_m_[i] = lateral_m;
}

double RoadPaint::fresh_at(double along_m) const noexcept {
  const double most = static_cast<double>(fresh_m_.size()) - 1.0;
  return fresh_m_[static_cast<std::size_t>(std::clamp(cell_of(along_m), 0.0, most))];
}

double RoadPaint::texture(double along_m, double lateral_m) const noexcept {
  constexpr double kGrain_m = 0.008;
  const auto row = static_cast<std::int64_t>(std::floor(along_m / kGrain_m));
  const auto column = static_cast<std::int64_t>(std::floor(lateral_m / kGrain_m));
  return PixelRandom(road_.seed, kTexture, static_cast<std::uint64_t>(row + (1 << 24)),
                     static_cast<std::uint64_t>(column + (1 << 24)))
      .uniform();
}

}  // namespace striper::detail
