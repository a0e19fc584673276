// SPDX-License-Identifier: Apache-2.0
#include "profile/tools/enclosed_area.hpp"

#include <cmath>

namespace striper::detail {
namespace {

using Vector = Eigen::Vector2d;

// A return beside a line: how far along and beyond it, and how both move by its 1/distance.
struct Beside {
  double s, h;
  double ds_dq, dh_dq;
  double variance_q;
};

Beside beside(const InverseRanges& ranges, std::size_t i, const ScanLine& line) {
  const Vector p = point_of(ranges, i);
  const Vector by_q = -Vector(ranges.cosine[i], ranges.sine[i]) / (ranges.q[i] * ranges.q[i]);
  return {line.direction().dot(p), line.offset_m(p), line.direction().dot(by_q),
          line.normal().dot(by_q), 1.0 / ranges.weight[i]};
}

// The line from the first to the last element, as exact.
ScanLine chord_of(const InverseRanges& ranges, const std::vector<std::size_t>& elements) {
  const Vector first = point_of(ranges, elements.front());
  const Vector last = point_of(ranges, elements.back());
  const Vector t = (last - first).normalized();
  Vector n(t.y(), -t.x());
  if (n.dot(first) < 0.0) n = -n;
  ScanLine line;
  line.angle_rad = std::atan2(n.y(), n.x());
  line.distance_m = n.dot(first);
  return line;
}

// How the area changes with the place of one return.
struct Change {
  double h, s;
};

// Of the polygon of all returns, the chord its last side.
Change change_of_polygon(const std::vector<Beside>& row, std::size_t k) {
  const std::size_t n = row.size();
  const Beside& left = row[(k + n - 1) % n];
  const Beside& right = row[(k + 1) % n];
  return {0.5 * (right.s - left.s), 0.5 * (left.h - right.h)};
}

// Of trapezoids, and half a spacing level beyond both ends.
Change change_of_strip(const std::vector<Beside>& row, std::size_t k) {
  const std::size_t last = row.size() - 1;
  if (k == 0) return {row[1].s - row[0].s, -row[0].h - 0.5 * row[1].h};
  if (k == last) return {row[k].s - row[k - 1].s, row[k].h + 0.5 * row[k - 1].h};
  Change change{0.5 * (row[k + 1].s - row[k - 1].s), 0.5 * (row[k - 1].h - row[k + 1].h)};
  if (k == 1) change.s += 0.5 * row[0].h;
  if (k + 1 == last) change.s -= 0.5 * row[last].h;
  return change;
}

// What is steeper than 63 degrees between two returns is a jump, which happens anywhere between
// them: a rectangle's half, +- uniformly.
double jump_variance(const Beside& a, const Beside& b) {
  constexpr double kSteep = 2.0;
  if (std::abs(b.h - a.h) < kSteep * std::abs(b.s - a.s)) return 0.0;
  const double most = (b.h - a.h) * (b.s - a.s);
  return most * most / 12.0;
}

}  // namespace

std::size_t area_points(const std::vector<Patch>& patches) noexcept {
  return patches.size() < 2 ? patches[0].all.size()
                            : patches[0].elements.size() + patches[1].all.size();
}

EnclosedArea enclosed_area(const InverseRanges& ranges, const std::vector<Patch>& patches) {
  const std::vector<std::size_t>& elements = patches.back().all;
  const bool is_chord = patches.size() < 2;
  const ScanLine line =
      is_chord ? chord_of(ranges, elements) : fit_patch(ranges, patches[0].elements).line;
  std::vector<Beside> row;
  row.reserve(elements.size());
  for (const std::size_t i : elements) row.push_back(beside(ranges, i, line));
  EnclosedArea area;
  Vector by_line = Vector::Zero();
  for (std::size_t k = 0; k < row.size(); ++k) {
    const Beside& here = row[k];
    const Change by = is_chord ? change_of_polygon(row, k) : change_of_strip(row, k);
    area.value_m2 += here.h * by.h;
    const double by_q = by.h * here.dh_dq + by.s * here.ds_dq;
    area.variance_m4 += by_q * by_q * here.variance_q;
    by_line += Vector(by.h * here.s - by.s * (here.h + line.distance_m), -by.h);
    if (k > 0) area.variance_m4 += jump_variance(row[k - 1], here);
  }
  const std::size_t last = row.size() - 1;
  if (!is_chord) {
    const double cut = row[0].h * (row[1].s - row[0].s);
    const double other = row[last].h * (row[last].s - row[last - 1].s);
    area.variance_m4 += (cut * cut + other * other) / 12.0;
  }
  area.variance_m4 += by_line.dot(line.covariance * by_line);
  if (row[last].s < row[0].s) area.value_m2 = -area.value_m2;
  return area;
}

}  // namespace striper::detail
