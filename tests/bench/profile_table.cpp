// SPDX-License-Identifier: Apache-2.0
// profile_table: pieces and smoothing beside what else is used for it, on the same scans: boards of
// 40 columns at other depths each (exact geometry, .1 px of noise in the row), with and without 2 %
// of gross outliers. Prints a table in Markdown.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <striper/core/robust.hpp>
#include <striper/profile/smooth.hpp>

#include "support/profile_scans.hpp"

namespace {

using striper::PolarScan;
using striper::Return;
using striper::testing::ProfileStriper;
using Point = Eigen::Vector2d;

constexpr std::size_t kBoard = 40;
constexpr double kGateSigmas = 4.0;  // Of what is on no line, of all rivals.

// A method's scan: its ranges, and the first columns of its pieces where it has any.
struct Outcome {
  std::vector<double> ranges;
  std::vector<std::size_t> begins;
};
using Method = std::function<Outcome(const PolarScan&)>;

Outcome plain(const PolarScan& scan) {
  Outcome out;
  for (const Return& r : scan.returns) out.ranges.push_back(r.range_m);
  return out;
}

Point point_of(const Return& r) { return {r.x_m, r.y_m}; }

struct PlainLine {
  Point normal{1.0, 0.0};
  double distance = 0.0;
};

// Total least squares in metres, as rivals do.
PlainLine line_through(const PolarScan& scan, const std::vector<std::size_t>& of) {
  Point mean = Point::Zero();
  for (const std::size_t i : of) mean += point_of(scan.returns[i]) / static_cast<double>(of.size());
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (const std::size_t i : of) {
    const Point d = point_of(scan.returns[i]) - mean;
    xx += d.x() * d.x();
    xy += d.x() * d.y();
    yy += d.y() * d.y();
  }
  const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
  const Point normal(-std::sin(angle), std::cos(angle));
  return {normal, normal.dot(mean)};
}

bool is_near(const PolarScan& scan, std::size_t i, const PlainLine& line) {
  const Return& r = scan.returns[i];
  return std::abs(line.normal.dot(point_of(r)) - line.distance) < kGateSigmas * r.sigma_m;
}

void put_on_line(const PolarScan& scan, const std::vector<std::size_t>& of, Outcome& out) {
  if (of.size() < 3) return;
  const PlainLine line = line_through(scan, of);
  for (const std::size_t i : of) {
    const double b = scan.returns[i].bearing_rad;
    out.ranges[i] = line.distance / line.normal.dot(Point(std::cos(b), std::sin(b)));
  }
}

// Iterative end-point fit (Ramer 1972; Duda & Hart 1973).
void split(const PolarScan& scan, std::size_t from, std::size_t to, Outcome& out) {
  const Point a = point_of(scan.returns[from]);
  const Point along = (point_of(scan.returns[to - 1]) - a).normalized();
  double worst = kGateSigmas;
  std::size_t at = from;
  for (std::size_t i = from + 1; i + 1 < to; ++i) {
    const Point d = point_of(scan.returns[i]) - a;
    const double off = std::abs(along.x() * d.y() - along.y() * d.x()) / scan.returns[i].sigma_m;
    if (off > worst) {
      worst = off;
      at = i;
    }
  }
  if (at > from && to - from > 3) {
    split(scan, from, at, out);
    split(scan, at, to, out);
    return;
  }
  out.begins.push_back(from);
  std::vector<std::size_t> of;
  for (std::size_t i = from; i < to; ++i) of.push_back(i);
  put_on_line(scan, of, out);
}

Outcome end_point_fit(const PolarScan& scan) {
  Outcome out = plain(scan);
  split(scan, 0, scan.returns.size(), out);
  return out;
}

// Lines one after the other (Fischler & Bolles 1981), each of what the ones before left over.
Outcome ransac(const PolarScan& scan) {
  constexpr int kTrials = 200;
  constexpr std::size_t kFewest = 10;
  Outcome out = plain(scan);
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) left.push_back(i);
  std::vector<int> label(scan.returns.size(), -1);
  for (int name = 0; left.size() >= kFewest; ++name) {
    std::vector<std::size_t> best;
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto draw = [&] {
        return static_cast<std::size_t>(
            striper::testing::uniform(0.0, static_cast<double>(left.size())));
      };
      const std::size_t first = draw();
      const std::size_t second = std::min(first + 1 + draw() % kBoard, left.size() - 1);
      if (first >= second) continue;
      const PlainLine line = line_through(scan, {left[first], left[second]});
      std::vector<std::size_t> on;
      for (const std::size_t i : left)
        if (is_near(scan, i, line)) on.push_back(i);
      if (on.size() > best.size()) best = on;
    }
    if (best.size() < kFewest) break;
    put_on_line(scan, best, out);
    for (const std::size_t i : best) label[i] = name;
    std::erase_if(left, [&](std::size_t i) { return label[i] >= 0; });
  }
  for (std::size_t i = 0; i < label.size(); ++i)
    if (i == 0 || label[i] != label[i - 1]) out.begins.push_back(i);
  return out;
}

// A filter of the ranges with weights for -reach to reach.
Outcome filtered(const PolarScan& scan, const std::vector<double>& weights) {
  Outcome out = plain(scan);
  const auto reach = static_cast<std::ptrdiff_t>(weights.size() / 2);
  const auto n = static_cast<std::ptrdiff_t>(scan.returns.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    double sum = 0.0, total = 0.0;
    for (std::ptrdiff_t k = std::max(-reach, -i); k <= std::min(reach, n - 1 - i); ++k) {
      const double w = weights[static_cast<std::size_t>(k + reach)];
      sum += w * scan.returns[static_cast<std::size_t>(i + k)].range_m;
      total += w;
    }
    out.ranges[static_cast<std::size_t>(i)] = sum / total;
  }
  return out;
}

// Second order over 11 (Savitzky & Golay 1964, table I).
Outcome savitzky_golay(const PolarScan& scan) {
  return filtered(scan, {-36, 9, 44, 69, 84, 89, 84, 69, 44, 9, -36});
}

Outcome median(const PolarScan& scan) {
  constexpr std::size_t kReach = 5;
  Outcome out = plain(scan);
  for (std::size_t i = kReach; i + kReach < scan.returns.size(); ++i) {
    std::vector<double> around;
    for (std::size_t k = i - kReach; k <= i + kReach; ++k)
      around.push_back(scan.returns[k].range_m);
    out.ranges[i] = striper::upper_median(around);
  }
  return out;
}

// As the Horus scanner smooths: a Gaussian of two columns within each run of columns with a stripe.
Outcome gaussian(const PolarScan& scan) {
  std::vector<double> weights;
  for (int k = -8; k <= 8; ++k) weights.push_back(std::exp(-0.125 * k * k));
  return filtered(scan, weights);
}

Method striper_method() {
  auto smoother = std::make_shared<striper::Smoother>();
  auto copy = std::make_shared<PolarScan>();
  return [smoother, copy](const PolarScan& scan) {
    *copy = scan;
    smoother->smooth(*copy);
    Outcome out = plain(*copy);
    for (const striper::Piece& piece : smoother->segmentation().pieces)
      out.begins.push_back(piece.first);
    for (const std::size_t i : smoother->segmentation().outliers)
      out.ranges[i] = std::numeric_limits<double>::quiet_NaN();
    return out;
  };
}

struct Score {
  striper::testing::Rms inside, edge;
  int missed = 0, wrong = 0, edges = 0;
};

void judge(const Outcome& out, const PolarScan& scan, const std::vector<double>& truth,
           Score& score) {
  const ProfileStriper striper;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const bool is_gross =
        std::abs(scan.returns[i].range_m - truth[i]) > 8.0 * striper.sigma_m(i, truth[i]);
    if (is_gross || !std::isfinite(out.ranges[i])) continue;
    const std::size_t from_edge = std::min(i % kBoard, kBoard - 1 - i % kBoard);
    (from_edge < 5 ? score.edge : score.inside)
        .add((out.ranges[i] - truth[i]) / striper.sigma_m(i, truth[i]));
  }
  if (out.begins.empty()) return;
  std::vector<char> is_found(truth.size() / kBoard, 0);
  for (const std::size_t begin : out.begins) {
    const std::size_t board = (begin + kBoard / 2) / kBoard;
    const auto off =
        static_cast<std::ptrdiff_t>(begin) - static_cast<std::ptrdiff_t>(board * kBoard);
    if (board == 0 || board >= is_found.size() || std::abs(off) > 1) {
      score.wrong += begin > 1 ? 1 : 0;
      continue;
    }
    score.wrong += is_found[board];
    is_found[board] = 1;
  }
  score.edges += static_cast<int>(is_found.size()) - 1;
  score.missed += static_cast<int>(std::count(is_found.begin() + 1, is_found.end(), 0));
}

void print_row(const char* name, const Method& method, double outliers) {
  constexpr int kScans = 200;
  const ProfileStriper striper;
  std::vector<double> truth;
  for (std::size_t i = 0; i < 640; ++i) {
    const std::size_t board = i / kBoard;
    truth.push_back(striper::testing::range_of_line(striper.bearing_rad(i),
                                                    0.1 * static_cast<double>(board % 3),
                                                    1.0 + 0.3 * static_cast<double>(board % 4)));
  }
  striper::testing::reseed();
  Score score;
  double seconds = 0.0;
  PolarScan scan;
  for (int k = 0; k < kScans; ++k) {
    striper::testing::noisy_scan(striper, truth, scan);
    striper::testing::add_gross_outliers(striper, outliers, scan);
    const auto start = std::chrono::steady_clock::now();
    const Outcome out = method(scan);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    judge(out, scan, truth, score);
  }
  std::printf("| %s | %.0f %% | %.0f | %.2f | %.2f |", name, 100.0 * outliers,
              1e6 * seconds / kScans, score.inside.value(), score.edge.value());
  if (score.edges > 0)
    std::printf(" %.1f %% | %.2f |\n", 100.0 * score.missed / score.edges,
                static_cast<double>(score.wrong) / kScans);
  else
    std::printf(" - | - |\n");
}

}  // namespace

int main() {
  std::printf(
      "| method | gross outliers | us a scan | rms inside | rms at edges | edges missed | false "
      "ones a scan |\n|---|---|---|---|---|---|---|\n");
  for (const double outliers : {0.0, 0.02}) {
    print_row("striper (pieces and smoothing)", striper_method(), outliers);
    print_row("RANSAC, a line after the other", ransac, outliers);
    print_row("iterative end-point fit", end_point_fit, outliers);
    print_row("Savitzky-Golay, 2nd order over 11", savitzky_golay, outliers);
    print_row("median over 11", median, outliers);
    print_row("Gaussian of 2 columns (Horus)", gaussian, outliers);
  }
  return 0;
}
