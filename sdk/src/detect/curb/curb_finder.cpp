// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/detect/curb_finder.hpp>

#include "detect/curb/curb_calibration.hpp"
#include "detect/curb/road_side.hpp"
#include "profile/cutter.hpp"

namespace striper {
namespace {

// Up is given to within what a vehicle on a road leans by: roll, and the road's own slope.
const double kLeastFacingUp = std::cos(20.0 * std::numbers::pi / 180.0);

// Shorter is no road: boxes and wheels are nearer than it at times, but have no such faces. Rough
// asphalt that is seen from half a metre is cut into pieces of a decimetre.
constexpr double kLeastRoad_m = 0.15;

constexpr std::array<std::string_view, kCurbKindCount> kKindWords{"none", "up",     "down", "ramp",
                                                                  "wall", "object", "rough"};

// Of a piece's nearest place.
double distance_of(const Piece& piece) {
  const Eigen::Vector2d along = piece.end_m - piece.begin_m;
  const double part = -piece.begin_m.dot(along) / along.squaredNorm();
  return (piece.begin_m + std::clamp(part, 0.0, 1.0) * along).norm();
}

}  // namespace

std::string_view to_string(CurbKind kind) noexcept {
  return kKindWords[static_cast<std::size_t>(kind)];
}

void CurbOptions::validate() const {
  if (!(min_height_m > 0.0 && min_height_m < max_height_m && max_height_m <= 1.0)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("min_height_m is {}, max_height_m {}; expected 0 < min < max <= 1",
                            min_height_m, max_height_m));
  }
  if (up_rad && !std::isfinite(*up_rad))
    throw Error(ErrorKind::kBadValue, "up_rad is not finite; expected an angle in radians");
  segments.validate();
}

struct CurbFinder::Impl {
  void take_geometry(const PolarScan& scan);
  const Piece* road_of() const;
  void look_along(StripeAxis axis);

  CurbOptions options;
  std::shared_ptr<const StriperModel> given;  // By whoever made this; may be null.
  std::shared_ptr<const StriperModel> model;  // Of the scan; may be null.
  int laser = -1;
  SegmentOptions segments;
  std::optional<detail::CurbCalibration> calibration;  // Where the model has a covariance.
  detail::Cutter cutter;
  Segmentation pieces;
  detail::RoadSide side;
  CurbView view;
};

CurbFinder::CurbFinder(const CurbOptions& options, std::shared_ptr<const StriperModel> model)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  impl_->options = options;
  impl_->given = std::move(model);
  impl_->view.findings.reserve(2 * detail::kMostFindingsOfASide);
}
CurbFinder::CurbFinder(CurbFinder&&) noexcept = default;
CurbFinder& CurbFinder::operator=(CurbFinder&&) noexcept = default;
CurbFinder::~CurbFinder() = default;

const CurbOptions& CurbFinder::options() const noexcept { return impl_->options; }

const CurbView& CurbFinder::find(const PolarScan& scan) {
  Impl& m = *impl_;
  m.view.findings.clear();
  m.take_geometry(scan);
  m.cutter.cut(scan, m.segments, m.pieces);
  const Piece* road = m.road_of();
  m.view.has_road = road != nullptr;
  if (road == nullptr) return m.view;
  m.view.road = road->line;
  m.look_along(scan.axis);
  const auto at = static_cast<std::size_t>(road - m.pieces.pieces.data());
  for (const double out : {-1.0, 1.0}) {
    const detail::RoadEnd end = m.side.look({m.cutter, m.pieces, m.options}, at, m.view.along, out);
    (out < 0.0 ? m.view.from_m : m.view.to_m) = end.lateral_m;
    for (const CurbFinding& finding : end.findings) {
      m.view.findings.push_back(finding);
      if (m.calibration) m.calibration->judge(m.view.findings.back());
    }
  }
  return m.view;
}

// What the model says of a laser is made when either changes.
void CurbFinder::Impl::take_geometry(const PolarScan& scan) {
  const auto& now = given || !scan.frame ? given : scan.frame->model;
  if (now == model && scan.laser == laser) return;
  model = now;
  laser = scan.laser;
  segments = options_for(model.get(), laser, options.segments);
  calibration.reset();
  const bool is_known =
      model && model->covariance && laser >= 0 && laser < static_cast<int>(model->lasers.size());
  if (is_known) calibration.emplace(*model, laser, segments.pivot_m);
}

// The piece of built ground nearest to the sensor.
const Piece* CurbFinder::Impl::road_of() const {
  const Piece* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < pieces.pieces.size(); ++k) {
    const Piece& piece = pieces.pieces[k];
    if ((piece.end_m - piece.begin_m).norm() < kLeastRoad_m) continue;
    if (piece.is_rough && !detail::is_paved(detail::scatter_m(cutter.ranges, cutter.runs[k])))
      continue;
    if (options.up_rad) {
      const Eigen::Vector2d up(std::cos(*options.up_rad), std::sin(*options.up_rad));
      if (-piece.line.normal().dot(up) < kLeastFacingUp) continue;
    }
    const double distance = distance_of(piece);
    if (distance >= least) continue;
    least = distance;
    nearest = &piece;
  }
  return nearest;
}

// Lateral grows towards +x of scans with the stripe axis rows, else +y.
void CurbFinder::Impl::look_along(StripeAxis axis) {
  constexpr double kUpright = 1e-6;
  view.along = view.road.direction();
  double sign = axis == StripeAxis::kRows ? view.along.x() : view.along.y();
  if (std::abs(sign) < kUpright) sign = view.along.x() + view.along.y();
  if (sign < 0.0) view.along = -view.along;
}

}  // namespace striper
