// SPDX-License-Identifier: Apache-2.0
#include "detect/curb/curb_lines.hpp"

#include <algorithm>
#include <cmath>

#include <striper/core/robust.hpp>

#include "profile/scan_line.hpp"

namespace striper::detail {
namespace {

// Of returns near the edge. The noses of curbs have radii of 10 to 25 mm; where such an arc of 15
// mm leaves the lines is 15 mm from their meeting at a right angle.
constexpr double kNose_m = 0.02;

// By how many sigma of a chi2 the returns near the edge have to miss the lines to be on a nose.
constexpr double kNoseExcess = 3.0;

// Of chi-square with one degree of freedom.
constexpr double kMedianOfChi2 = 0.455;

constexpr std::size_t kFewestOfLine = 3;
constexpr std::size_t kFewestThatTell = 12;  // How rough a surface is.
constexpr int kRounds = 3;                   // After two the returns stay where they are.

Eigen::Matrix2d inverse_normals(const ScanLine& a, const ScanLine& b) noexcept {
  Eigen::Matrix2d normals;
  normals << a.normal().transpose(), b.normal().transpose();
  return normals.inverse();
}

// What a meeting moves by with angle and distance of both lines: on each, n . dp = dd - (t . p) da.
Eigen::Matrix<double, 2, 4> d_meeting(const ScanLine& a, const ScanLine& b,
                                      const Eigen::Vector2d& at) noexcept {
  const Eigen::Matrix2d m = inverse_normals(a, b);
  Eigen::Matrix<double, 2, 4> d;
  d << -a.direction().dot(at) * m.col(0), m.col(0), -b.direction().dot(at) * m.col(1), m.col(1);
  return d;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) noexcept {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace

Eigen::Vector2d meeting(const ScanLine& a, const ScanLine& b) noexcept {
  return inverse_normals(a, b) * Eigen::Vector2d(a.distance_m, b.distance_m);
}

Eigen::Vector2d parameters_of(const ScanLine& line, const Eigen::Vector2d& pivot_m) noexcept {
  const Eigen::Vector2d normal = line.normal();
  return normal / (line.distance_m - normal.dot(pivot_m));
}

double misfit(const InverseRanges& ranges, std::size_t i, const ScanLine& line) noexcept {
  return ranges.misfit(i, parameters_of(line, ranges.pivot));
}

ScanLine line_through(const Eigen::Vector2d& at_m, const Eigen::Vector2d& direction, double sigma_m,
                      double sigma_rad) noexcept {
  Eigen::Vector2d normal(direction.y(), -direction.x());
  if (normal.dot(at_m) < 0.0) normal = -normal;
  ScanLine line;
  line.angle_rad = std::atan2(normal.y(), normal.x());
  line.distance_m = normal.dot(at_m);
  // It turns about the point.
  const Eigen::Vector2d d_angle(sigma_rad, sigma_rad * line.direction().dot(at_m));
  line.covariance = d_angle * d_angle.transpose();
  line.covariance(1, 1) += sigma_m * sigma_m;
  return line;
}

bool CurbLines::do_meet() const noexcept {
  constexpr double kLeastSine = 0.05;  // 3 degrees: flatter, and a line is no face.
  return std::abs(std::sin(road.angle_rad - face.angle_rad)) > kLeastSine &&
         std::abs(std::sin(face.angle_rad - top.angle_rad)) > kLeastSine;
}

Eigen::Vector2d CurbLines::foot_m() const noexcept { return meeting(road, face); }
Eigen::Vector2d CurbLines::edge_m() const noexcept { return meeting(face, top); }

void CurbLines::describe(const Eigen::Vector2d& along, CurbFinding& finding) const noexcept {
  finding.road = road;
  finding.foot_m = foot_m();
  finding.top_m = edge_m();
  Eigen::Matrix<double, 6, 6> c = Eigen::Matrix<double, 6, 6>::Zero();
  c.block<2, 2>(0, 0) = road.covariance;
  c.block<2, 2>(2, 2) = face.covariance;
  c.block<2, 2>(4, 4) = top.covariance;
  Eigen::Matrix<double, 4, 6> d = Eigen::Matrix<double, 4, 6>::Zero();
  d.block<2, 4>(0, 0) = d_meeting(road, face, finding.foot_m);
  d.block<2, 4>(2, 2) = d_meeting(face, top, finding.top_m);
  finding.covariance = d * c * d.transpose();

  const double sign = along.dot(road.direction()) < 0.0 ? -1.0 : 1.0;
  finding.lateral_m = sign * road.direction().dot(finding.foot_m);
  // The direction turns with the road: its change times the foot is -distance.
  Eigen::Matrix<double, 1, 6> d_lateral = road.direction().transpose() * d.topRows<2>();
  d_lateral(0) -= road.distance_m;
  finding.sigma_lateral_m = std::sqrt((d_lateral * c * d_lateral.transpose()).value());
  finding.height_m = -road.offset_m(finding.top_m);
  Eigen::Matrix<double, 1, 6> d_height = -road.normal().transpose() * d.bottomRows<2>();
  d_height(0) -= road.direction().dot(finding.top_m);
  d_height(1) += 1.0;
  finding.sigma_height_m = std::sqrt((d_height * c * d_height.transpose()).value());
  const Eigen::Vector2d rise = finding.top_m - finding.foot_m;
  // Outwards is where the sensor is not: the face's normal points away from it.
  const double out = road.direction().dot(face.normal()) < 0.0 ? -1.0 : 1.0;
  finding.face_rad = std::atan2(-road.normal().dot(rise), out * road.direction().dot(rise));
  finding.sigma_face_rad = std::sqrt(road.covariance(0, 0) + face.covariance(0, 0));
}

void CurbRefiner::refine(const InverseRanges& ranges, const CurbReach& reach, CurbLines& lines) {
  for (int round = 0; round < kRounds; ++round) {
    share_out(ranges, reach, lines);
    leave_out_strays(ranges, lines);
    CurbLines better = lines;
    if (!fit(ranges, better) || !better.do_meet()) return;
    lines = better;
  }
  leave_out_nose(ranges, lines);
  CurbLines better = lines;
  if (fit(ranges, better) && better.do_meet()) lines = better;
}

void CurbRefiner::share_out(const InverseRanges& ranges, const CurbReach& reach,
                            const CurbLines& lines) {
  for (auto& elements : on_) elements.clear();
  const Eigen::Vector2d foot = lines.foot_m() - ranges.pivot;
  const Eigen::Vector2d edge = lines.edge_m() - ranges.pivot;
  const double turn = reach.to > reach.from ? ranges.turn(reach.from, reach.to - 1) : 0.0;
  const double order = (turn < 0.0) == reach.is_road_first ? -1.0 : 1.0;
  for (std::size_t i = reach.from; i < reach.to; ++i) {
    const Eigen::Vector2d ray(ranges.cosine[i], ranges.sine[i]);
    const bool is_beyond_foot = order * cross(ray, foot) < 0.0;
    const bool is_beyond_edge = order * cross(ray, edge) < 0.0;
    on_[is_beyond_edge ? 2 : is_beyond_foot ? 1 : 0].push_back(i);
  }
}

// Speckle that pieces took in, by the scatter of the others.
void CurbRefiner::leave_out_strays(const InverseRanges& ranges, const CurbLines& lines) {
  const std::array<const ScanLine*, 3> all{&lines.road, &lines.face, &lines.top};
  for (std::size_t part = 0; part < all.size(); ++part) {
    misfits_.clear();
    for (const std::size_t i : on_[part]) misfits_.push_back(misfit(ranges, i, *all[part]));
    if (misfits_.empty()) continue;
    // Of a few half may be speckle, and tell nothing of the others.
    const bool do_tell = misfits_.size() > kFewestThatTell;
    const double rough = do_tell ? upper_median(misfits_) / kMedianOfChi2 : 1.0;
    const double most = kStrayChi2 * std::max(1.0, rough);
    std::erase_if(on_[part], [&](std::size_t i) { return misfit(ranges, i, *all[part]) > most; });
  }
}

// A nose is on no line. It is left out where it shows in the noise, for else its returns tell where
// the face is.
void CurbRefiner::leave_out_nose(const InverseRanges& ranges, const CurbLines& lines) {
  const Eigen::Vector2d edge = lines.edge_m();
  const auto is_near = [&](std::size_t i) {
    return (ranges.at_m(i) - edge).squaredNorm() < kNose_m * kNose_m;
  };
  double chi2 = 0.0;
  double count = 0.0;
  for (const std::size_t part : {1U, 2U}) {
    const ScanLine& line = part == 1U ? lines.face : lines.top;
    for (const std::size_t i : on_[part]) {
      if (!is_near(i)) continue;
      chi2 += misfit(ranges, i, line);
      count += 1.0;
    }
  }
  if (chi2 < count + kNoseExcess * std::sqrt(2.0 * count)) return;
  for (const std::size_t part : {1U, 2U}) std::erase_if(on_[part], is_near);
}

bool CurbRefiner::fit(const InverseRanges& ranges, CurbLines& lines) const {
  const std::array<ScanLine*, 3> wanted{&lines.road, &lines.face, &lines.top};
  for (std::size_t part = 0; part < 3; ++part) {
    if (on_[part].size() < kFewestOfLine) return false;
    const LineFit fit = fit_elements(ranges, on_[part]);
    if (!fit.is_determined) return false;
    // Surfaces are rougher than their error bars; never smoother.
    const double scale =
        on_[part].size() > kFewestThatTell
            ? std::max(1.0, std::sqrt(fit.chi2 / fit.dof()) - std::sqrt(2.0 / fit.dof()))
            : 1.0;
    *wanted[part] = scan_line(fit, scale, ranges.pivot);
  }
  return true;
}

}  // namespace striper::detail
