// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/guidance/gun_alignment.hpp>

namespace striper {
namespace {

constexpr double kZeroSigma_m = 0.00127;
constexpr double kScaleSigma = 0.01;
constexpr double kDelaySigma_s = 0.002;
constexpr double kPlaceSigma_m = 0.01;
constexpr double kMisfit = 3.0;
// Valves are within a second, guns within metres: so little that it moves nothing that is measured.
constexpr double kPriorDelay_s = 1.0;
constexpr double kPriorPlace_m = 10.0;

// NOLINTBEGIN(bugprone-macro-parentheses): a lambda.
#define STRIPER_CELL(member) \
  [](auto& r) -> auto& { return r.member; }
// NOLINTEND(bugprone-macro-parentheses)

constexpr std::array kStates{CsvWord<bool>{true, "ON"}, CsvWord<bool>{false, "OFF"}};
constexpr std::array kVoltsColumns{
    csv_column<VoltsReading>("volts", STRIPER_CELL(volts), CsvNeed::kRequired),
    csv_column<VoltsReading>("lateral_m", STRIPER_CELL(lateral_m), CsvNeed::kRequired),
    csv_column<VoltsReading>("sigma_m", STRIPER_CELL(sigma_m)),
};
constexpr std::array kPaintedColumns{
    csv_column<PaintedEnd>("gun", STRIPER_CELL(gun), CsvNeed::kRequired),
    csv_column<PaintedEnd>(
        "state",
        [](auto& r) {
          return CsvWords{r.is_on, kStates};
        },
        CsvNeed::kRequired),
    csv_column<PaintedEnd>("signal_m", STRIPER_CELL(signal_m), CsvNeed::kRequired),
    csv_column<PaintedEnd>("speed_m_s", STRIPER_CELL(speed_m_s), CsvNeed::kRequired),
    csv_column<PaintedEnd>("painted_m", STRIPER_CELL(painted_m), CsvNeed::kRequired),
    csv_column<PaintedEnd>("sigma_m", STRIPER_CELL(sigma_m)),
};

#undef STRIPER_CELL

void require_sigma(double sigma_m) {
  if (sigma_m > 0.0) return;
  throw Error(ErrorKind::kBadValue, fmt::format("sigma_m is {}; expected above 0", sigma_m));
}

GunAlignment align_gun(std::span<const PaintedEnd> ends, const std::string& gun) {
  const auto row_of = [](const PaintedEnd& end) {
    return Eigen::Vector3d(1.0, end.is_on ? end.speed_m_s : 0.0, end.is_on ? 0.0 : end.speed_m_s);
  };
  Eigen::Matrix3d squares =
      Eigen::Vector3d(1.0 / (kPriorPlace_m * kPriorPlace_m), 1.0 / (kPriorDelay_s * kPriorDelay_s),
                      1.0 / (kPriorDelay_s * kPriorDelay_s))
          .asDiagonal();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  GunAlignment out;
  out.gun = gun;
  for (const PaintedEnd& end : ends) {
    if (end.gun != gun) continue;
    require_sigma(end.sigma_m);
    const double weight = 1.0 / (end.sigma_m * end.sigma_m);
    squares += weight * row_of(end) * row_of(end).transpose();
    products += weight * (end.painted_m - end.signal_m) * row_of(end);
    ++out.ends;
  }
  const auto cholesky = squares.ldlt();
  const Eigen::Vector3d found = cholesky.solve(products);
  double chi2 = 0.0;
  for (const PaintedEnd& end : ends) {
    if (end.gun != gun) continue;
    const double off_m = end.painted_m - end.signal_m - row_of(end).dot(found);
    chi2 += off_m * off_m / (end.sigma_m * end.sigma_m);
  }
  const double freedom = static_cast<double>(out.ends) - 3.0;
  out.misfit = freedom > 0.0 ? std::sqrt(chi2 / freedom) : 0.0;
  const Eigen::Matrix3d covariance =
      cholesky.solve(Eigen::Matrix3d::Identity()) * std::max(1.0, out.misfit * out.misfit);
  out.x_m = found[0];
  out.on_delay_s = found[1];
  out.off_delay_s = found[2];
  out.sigma_x_m = std::sqrt(covariance(0, 0));
  out.sigma_on_s = std::sqrt(covariance(1, 1));
  out.sigma_off_s = std::sqrt(covariance(2, 2));
  out.is_trusted = out.sigma_on_s <= kDelaySigma_s && out.sigma_off_s <= kDelaySigma_s &&
                   out.sigma_x_m <= kPlaceSigma_m && out.misfit <= kMisfit;
  return out;
}

}  // namespace

std::span<const CsvColumn<VoltsReading>> volts_columns() { return kVoltsColumns; }
std::span<const CsvColumn<PaintedEnd>> painted_columns() { return kPaintedColumns; }

OutputAlignment align_output(std::span<const VoltsReading> readings) {
  LineSums sums;
  for (const VoltsReading& reading : readings) {
    require_sigma(reading.sigma_m);
    sums.add(1.0, reading.volts, reading.lateral_m, 1.0 / (reading.sigma_m * reading.sigma_m));
  }
  OutputAlignment out;
  out.readings = readings.size();
  const LineFit fit = sums.solve();
  if (!fit.is_determined || fit.parameters[1] == 0.0) return out;
  out.misfit = fit.dof() > 0 ? std::sqrt(fit.chi2 / fit.dof()) : 0.0;
  const double grow = std::max(1.0, out.misfit);
  const double slope = fit.parameters[1];
  out.offset_m = fit.parameters[0];
  out.volts_per_m = 1.0 / slope;
  out.sigma_offset_m = grow * std::sqrt(fit.covariance(0, 0));
  out.sigma_volts_per_m = grow * std::sqrt(fit.covariance(1, 1)) / (slope * slope);
  out.is_trusted = out.readings >= 3 && out.sigma_offset_m <= kZeroSigma_m &&
                   out.sigma_volts_per_m <= kScaleSigma * std::abs(out.volts_per_m) &&
                   out.misfit <= kMisfit;
  return out;
}

std::vector<GunAlignment> align_guns(std::span<const PaintedEnd> ends) {
  std::vector<GunAlignment> guns;
  for (const PaintedEnd& end : ends) {
    const bool is_known = std::any_of(guns.begin(), guns.end(),
                                      [&](const GunAlignment& gun) { return gun.gun == end.gun; });
    if (!is_known) guns.push_back(align_gun(ends, end.gun));
  }
  return guns;
}

void apply(const OutputAlignment& alignment, GuidanceConfig& config) {
  config.output.offset_m = alignment.offset_m;
  config.output.volts_per_m = alignment.volts_per_m;
  config.output.offset_sd_m = alignment.sigma_offset_m;
}

void apply(const GunAlignment& alignment, GuidanceConfig& config) {
  for (GuidanceGun& gun : config.guns) {
    if (gun.name != alignment.gun) continue;
    gun.gun.x_m = alignment.x_m;
    gun.gun.on_delay_s = alignment.on_delay_s;
    gun.gun.off_delay_s = alignment.off_delay_s;
    gun.on_delay_sd_s = alignment.sigma_on_s;
    gun.off_delay_sd_s = alignment.sigma_off_s;
    return;
  }
  throw Error(
      ErrorKind::kBadValue,
      fmt::format("guidance.yaml has no gun '{}', whose paint was measured", alignment.gun));
}

}  // namespace striper
