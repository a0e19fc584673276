// SPDX-License-Identifier: Apache-2.0
#include "profile/tools/tool_values.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <striper/core/robust.hpp>

#include "profile/circle_fit.hpp"
#include "profile/tools/enclosed_area.hpp"

namespace striper::detail {
namespace {

using Vector = Eigen::Vector2d;

// A radius or a crossing that is not known to half of itself is not determined.
constexpr double kMostRelativeSigma = 0.5;
// Constant, slope, and three that bend: bows and waves as long as the piece.
constexpr int kTerms = 5;
constexpr int kFewestForStraightness = 2 * kTerms;

double angle_between(double from_rad, double to_rad) {
  return std::remainder(to_rad - from_rad, 2.0 * std::numbers::pi);
}

ToolValue refused(MeasureStatus status) { return {Measurement::kNone, Measurement::kNone, status}; }

double along(const Vector& direction, const Eigen::Matrix2d& covariance) {
  return direction.dot(covariance * direction);
}

const MeasureRegion& region_of(const MeasureTool& tool, std::size_t k) {
  static const MeasureRegion kEverywhere;
  if (tool.regions.empty()) return kEverywhere;
  return tool.regions[std::min(k, tool.regions.size() - 1)];
}

using Terms = Eigen::Matrix<double, kTerms, 1>;

// Legendre's polynomials.
Terms terms_at(double x) {
  Terms p;
  p << 1.0, x, 0.0, 0.0, 0.0;
  for (int k = 2; k < kTerms; ++k)
    p[k] = ((2.0 * k - 1.0) * x * p[k - 1] - (k - 1.0) * p[k - 2]) / k;
  return p;
}

// Peak to valley of the polynomial that the offsets from the line follow.
ToolValue straightness_of(const InverseRanges& ranges, const std::vector<std::size_t>& elements) {
  if (static_cast<int>(elements.size()) < kFewestForStraightness)
    return refused(MeasureStatus::kFewPoints);
  const ScanLine line = fit_patch(ranges, elements).line;
  const Vector direction = line.direction();
  const double first = direction.dot(point_of(ranges, elements.front()));
  const double last = direction.dot(point_of(ranges, elements.back()));
  Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Terms right = Terms::Zero();
  double squares = 0.0;
  std::vector<Terms> at(elements.size());
  for (std::size_t k = 0; k < elements.size(); ++k) {
    const std::size_t i = elements[k];
    const Vector p = point_of(ranges, i);
    const double facing = line.normal().dot(Vector(ranges.cosine[i], ranges.sine[i]));
    const double by_q = facing / (ranges.q[i] * ranges.q[i]);
    const double weight = ranges.weight[i] / (by_q * by_q);
    const double offset = line.offset_m(p);
    at[k] = terms_at(2.0 * (direction.dot(p) - first) / (last - first) - 1.0);
    normal += weight * at[k] * at[k].transpose();
    right += weight * offset * at[k];
    squares += weight * offset * offset;
  }
  const Eigen::LDLT<Eigen::Matrix<double, kTerms, kTerms>> solver(normal);
  const Terms shape = solver.solve(right);
  if (!shape.allFinite()) return refused(MeasureStatus::kAmbiguous);
  const auto is_lower = [&](const Terms& a, const Terms& b) { return shape.dot(a) < shape.dot(b); };
  const auto [low, high] = std::minmax_element(at.begin(), at.end(), is_lower);
  const Terms difference = *high - *low;
  const double scale =
      scatter_scale(squares - shape.dot(right), static_cast<int>(elements.size()) - kTerms);
  return {shape.dot(difference), scale * scale * difference.dot(solver.solve(difference)),
          MeasureStatus::kOk};
}

ToolValues line_of(const InverseRanges& ranges, const Patch& patch) {
  ToolValues values;
  values[2] = straightness_of(ranges, patch.surface);
  if (!patch.is_straight) {
    values[0] = values[1] = refused(MeasureStatus::kNoLine);
    return values;
  }
  const ScanLine line = fit_patch(ranges, patch.elements).line;
  values[0] = {line.distance_m, line.covariance(1, 1), MeasureStatus::kOk};
  values[1] = {line.angle_rad, line.covariance(0, 0), MeasureStatus::kOk};
  return values;
}

// How far a point of the second surface lies beyond the first's line.
// @param by_second  how that point moves by the parameters of the second's line.
ToolValue offset_of(const PatchLine& first, const PatchLine& second, const Vector& p,
                    const Eigen::Matrix2d& by_second, const Eigen::Matrix2d& besides) {
  const Vector n = first.line.normal();
  const Vector gradient = by_second.transpose() * n;
  const double of_second =
      second.scale * second.scale * along(gradient, second.fit.covariance) + along(n, besides);
  return {first.line.offset_m(p), first.line.offset_variance_m2(p) + of_second, MeasureStatus::kOk};
}

ToolValue step_of(const InverseRanges& ranges, const PatchLine& first, const PatchLine& second,
                  const Patch& on_second) {
  const std::size_t middle = on_second.elements[on_second.elements.size() / 2];
  const Vector v(ranges.cosine[middle], ranges.sine[middle]);
  const double q = second.fit.at(v.x(), v.y());
  return offset_of(first, second, ranges.pivot + v / q, -v * v.transpose() / (q * q),
                   Eigen::Matrix2d::Zero());
}

ToolValue gap_of(const PatchLine& first, const PatchLine& second, const PatchEnd& from,
                 const PatchEnd& to) {
  const Vector t = first.line.direction();
  const Vector across = to.at_m - from.at_m;
  const double turn = first.line.normal().dot(across);  // How the first's direction moves it.
  const double variance = along(t, from.covariance_with(first)) +
                          along(t, to.covariance_with(second)) +
                          turn * turn * first.line.covariance(0, 0);
  return {std::abs(t.dot(across)), variance, MeasureStatus::kOk};
}

ToolValue width_of(const PatchLine& line, const PatchEnd& begin, const PatchEnd& end) {
  const Vector t = line.line.direction();
  const Vector by_line = (end.by_line() - begin.by_line()).transpose() * t;
  const double variance = along(t, begin.covariance) + along(t, end.covariance) +
                          line.scale * line.scale * along(by_line, line.fit.covariance);
  return {std::abs(t.dot(end.at_m - begin.at_m)), variance, MeasureStatus::kOk};
}

// p0 x + p1 y = 1 of both, from the pivot.
ToolValues position_of(const InverseRanges& ranges, const PatchLine& first,
                       const PatchLine& second) {
  Eigen::Matrix2d lines;
  lines.row(0) = first.fit.parameters.transpose();
  lines.row(1) = second.fit.parameters.transpose();
  const Eigen::Matrix2d inverse = lines.inverse();
  const Vector p = inverse * Vector::Ones();
  // d p = -inverse (d lines) p, a row by its own line's parameters.
  const double of_first = first.scale * first.scale * along(p, first.fit.covariance);
  const double of_second = second.scale * second.scale * along(p, second.fit.covariance);
  const Eigen::Matrix2d covariance =
      inverse * Vector(of_first, of_second).asDiagonal() * inverse.transpose();
  ToolValues values;
  const double most = kMostRelativeSigma * p.norm();
  const bool is_known = p.allFinite() && covariance.trace() < most * most;
  for (int k = 0; k < 2; ++k) {
    values[static_cast<std::size_t>(k)] =
        is_known ? ToolValue{p[k] + ranges.pivot[k], covariance(k, k), MeasureStatus::kOk}
                 : refused(MeasureStatus::kAmbiguous);
  }
  return values;
}

// Leaves out what is far off for the scatter; whether there was any.
bool trim(const InverseRanges& ranges, const CircleFit& circle,
          std::vector<std::size_t>& elements) {
  constexpr double kGateSigmas = 5.0;
  std::vector<double> sigmas;
  sigmas.reserve(elements.size());
  for (const std::size_t i : elements) sigmas.push_back(misfit(ranges, i, circle));
  std::vector<double> sorted = sigmas;
  const double gate = kGateSigmas * std::max(1.0, kSigmaOfMedianAbsolute * upper_median(sorted));
  std::size_t kept = 0;
  for (std::size_t k = 0; k < elements.size(); ++k)
    if (sigmas[k] <= gate) elements[kept++] = elements[k];
  const bool is_trimmed = kept < elements.size();
  elements.resize(kept);
  return is_trimmed;
}

CircleFit fit_most(const InverseRanges& ranges, std::vector<std::size_t> elements) {
  constexpr int kTrims = 2;
  CircleFit fit = fit_circle(ranges, elements);
  for (int k = 0; k < kTrims && fit.is_determined && trim(ranges, fit, elements); ++k)
    fit = fit_circle(ranges, elements);
  return fit;
}

ToolValues circle_of(const InverseRanges& ranges, const Patch& patch) {
  const CircleFit fit = fit_most(ranges, patch.all);
  const double scale = scatter_scale(fit.chi2, fit.dof());
  const Eigen::Vector3d variance = scale * scale * fit.covariance.diagonal();
  const double most = kMostRelativeSigma * fit.radius_m;
  MeasureStatus status = MeasureStatus::kOk;
  if (!fit.is_determined || 5 * fit.points < 4 * static_cast<int>(patch.all.size()))
    status = MeasureStatus::kNoLine;
  else if (variance[2] > most * most)
    status = MeasureStatus::kAmbiguous;
  if (status != MeasureStatus::kOk) return {refused(status), refused(status), refused(status)};
  return {ToolValue{fit.radius_m, variance[2], status},
          ToolValue{fit.centre_m.x(), variance[0], status},
          ToolValue{fit.centre_m.y(), variance[1], status}};
}

ToolValues of_ends(const MeasureTool& tool, const InverseRanges& ranges, const Patches& pieces,
                   const std::vector<Patch>& patches, const std::vector<PatchLine>& lines) {
  // Of two surfaces the ends that face each other.
  const bool is_in_order = patches[0].run <= patches.back().run;
  const bool is_width = tool.kind == ToolKind::kWidth;
  const bool from_later = is_width ? false : is_in_order;
  const bool to_later = is_width ? true : !is_in_order;
  const std::size_t last = patches.size() - 1;
  const bool is_from_needed = tool.kind != ToolKind::kFlush;
  if ((is_from_needed && !pieces.is_end_seen(patches[0], region_of(tool, 0), from_later)) ||
      !pieces.is_end_seen(patches[last], region_of(tool, last), to_later))
    return {refused(MeasureStatus::kOutside)};
  const PatchEnd from = pieces.end_of(ranges, patches[0], lines[0], from_later);
  const PatchEnd to = pieces.end_of(ranges, patches[last], lines[last], to_later);
  if (is_width) return {width_of(lines[0], from, to)};
  if (tool.kind == ToolKind::kGap) return {gap_of(lines[0], lines[1], from, to)};
  return {offset_of(lines[0], lines[1], to.at_m, to.by_line(), to.covariance)};
}

}  // namespace

int points_of(ToolKind kind, const std::vector<Patch>& patches) noexcept {
  std::size_t points = 0;
  if (kind == ToolKind::kCircle) points = patches[0].all.size();
  if (kind == ToolKind::kLine) points = patches[0].surface.size();
  if (kind == ToolKind::kArea) return static_cast<int>(area_points(patches));
  if (points == 0)
    for (const Patch& patch : patches) points += patch.elements.size();
  return static_cast<int>(points);
}

ToolValues values_of(const MeasureTool& tool, const InverseRanges& ranges, const Patches& pieces,
                     const std::vector<Patch>& patches) {
  if (tool.kind == ToolKind::kLine) return line_of(ranges, patches[0]);
  if (tool.kind == ToolKind::kCircle) return circle_of(ranges, patches[0]);
  if (tool.kind == ToolKind::kArea) {
    const EnclosedArea area = enclosed_area(ranges, patches);
    return {ToolValue{area.value_m2, area.variance_m4, MeasureStatus::kOk}};
  }
  std::vector<PatchLine> lines;
  for (const Patch& patch : patches) {
    if (!patch.is_straight)
      return {refused(MeasureStatus::kNoLine), refused(MeasureStatus::kNoLine)};
    lines.push_back(fit_patch(ranges, patch.elements));
  }
  switch (tool.kind) {
    case ToolKind::kStep:
      return {step_of(ranges, lines[0], lines[1], patches[1])};
    case ToolKind::kAngle:
      return {ToolValue{angle_between(lines[0].line.angle_rad, lines[1].line.angle_rad),
                        lines[0].line.covariance(0, 0) + lines[1].line.covariance(0, 0),
                        MeasureStatus::kOk}};
    case ToolKind::kPosition:
      return position_of(ranges, lines[0], lines[1]);
    default:
      return of_ends(tool, ranges, pieces, patches, lines);
  }
}

}  // namespace striper::detail
