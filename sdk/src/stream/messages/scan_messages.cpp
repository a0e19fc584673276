// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/messages/scan_messages.hpp>
#include <striper/wire/return_code.hpp>

namespace striper {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

void set_header(const PolarScan& scan, wire::Header& header) {
  header.stamp = to_stamp(scan.time);
  if (scan.frame) {
    header.frame_id = scan.frame->frame_id;
  } else {
    header.frame_id.clear();
  }
}

/// Calls `visit` with each number of a message and of a return that is the same: the one list for
/// both directions.
template <typename Message, typename Visit>
void for_each_column(Message& message, Visit&& visit) {
  visit(message.u_px, &Return::u_px);
  visit(message.v_px, &Return::v_px);
  visit(message.bearing_rad, &Return::bearing_rad);
  visit(message.range_m, &Return::range_m);
  visit(message.range_near_m, &Return::range_near_m);
  visit(message.range_far_m, &Return::range_far_m);
  visit(message.sigma_m, &Return::sigma_m);
  visit(message.sigma_cal_m, &Return::sigma_cal_m);
  visit(message.x_m, &Return::x_m);
  visit(message.y_m, &Return::y_m);
  visit(message.intensity, &Return::intensity_dn);
  visit(message.width_px, &Return::width_px);
  visit(message.row_sigma_px, &Return::row_sigma_px);
  visit(message.confidence, &Return::confidence);
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorKind::kBadFile, "striper_msgs/msg/PolarScan: " + what);
}

ReturnStatus status_of(std::uint8_t code) {
  const auto status = wire::return_status_from_code(code);
  if (!status) refuse(fmt::format("status {} stands for nothing", code));
  return *status;
}

constexpr std::array<std::string_view, 8> kPointFields = {
    "x", "y", "z", "intensity", "sigma", "sigma_cal", "width", "confidence"};
constexpr std::uint32_t kPointStep = 36;

void set_point_fields(wire::PointCloud2& message) {
  message.fields.resize(kPointFields.size() + 1);
  for (std::size_t i = 0; i < kPointFields.size(); ++i) {
    message.fields[i].name = kPointFields[i];
    message.fields[i].offset = static_cast<std::uint32_t>(4 * i);
    message.fields[i].datatype = wire::PointField::kFloat32;
  }
  message.fields.back() = {"status", 32, wire::PointField::kUint8, 1};
}

}  // namespace

wire::Time to_stamp(const FrameTime& time) noexcept {
  const std::int64_t ns = time.monotonic_ns + time.utc_offset_ns.value_or(0);
  std::int64_t seconds = ns / kSecond;
  if (ns % kSecond < 0) --seconds;
  return {static_cast<std::int32_t>(seconds), static_cast<std::uint32_t>(ns - seconds * kSecond)};
}

void to_message(const PolarScan& scan, wire::PolarScan& message) {
  set_header(scan, message.header);
  message.sequence = scan.sequence;
  message.monotonic_ns = scan.time.monotonic_ns;
  message.has_utc = scan.time.utc_offset_ns.has_value();
  message.utc_offset_ns = scan.time.utc_offset_ns.value_or(0);
  message.laser = static_cast<std::uint8_t>(scan.laser);
  message.field = static_cast<std::uint8_t>(scan.field);
  message.axis = scan.axis == StripeAxis::kColumns ? 0 : 1;
  for_each_column(message, [&](auto& values, auto member) {
    values.resize(scan.returns.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = scan.returns[i].*member;
  });
  message.status.resize(scan.returns.size());
  for (std::size_t i = 0; i < scan.returns.size(); ++i)
    message.status[i] = wire::return_code(scan.returns[i].status);
}

void from_message(const wire::PolarScan& message, PolarScan& scan) {
  const std::size_t lines = message.status.size();
  for_each_column(message, [&](const auto& values, auto) {
    if (values.size() != lines)
      refuse(fmt::format("an array of {} beside {} of status", values.size(), lines));
  });
  if (message.field > static_cast<std::uint8_t>(Field::kInterlacedBottomFirst)) {
    refuse(fmt::format("field {} stands for nothing", message.field));
  }
  if (message.axis > 1) refuse(fmt::format("axis {} stands for nothing", message.axis));
  scan.sequence = message.sequence;
  scan.time.monotonic_ns = message.monotonic_ns;
  scan.time.utc_offset_ns.reset();
  if (message.has_utc) scan.time.utc_offset_ns = message.utc_offset_ns;
  scan.laser = message.laser;
  scan.field = static_cast<Field>(message.field);
  scan.axis = message.axis == 0 ? StripeAxis::kColumns : StripeAxis::kRows;
  scan.is_stripe_seen = true;
  scan.returns.resize(lines);
  for_each_column(message, [&](const auto& values, auto member) {
    for (std::size_t i = 0; i < lines; ++i) scan.returns[i].*member = values[i];
  });
  for (std::size_t i = 0; i < lines; ++i) scan.returns[i].status = status_of(message.status[i]);
}

void to_message(const PolarScan& scan, wire::PointCloud2& message) {
  set_header(scan, message.header);
  message.height = 1;
  message.width = static_cast<std::uint32_t>(scan.returns.size());
  set_point_fields(message);
  message.is_bigendian = false;
  message.point_step = kPointStep;
  message.row_step = kPointStep * message.width;
  message.is_dense = false;
  message.data.assign(message.row_step, 0);
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& value = scan.returns[i];
    const bool is_there = std::isfinite(value.x_m) && std::isfinite(value.y_m);
    const float nothing = std::numeric_limits<float>::quiet_NaN();
    const std::array<float, 8> numbers = {is_there ? static_cast<float>(value.x_m) : nothing,
                                          is_there ? static_cast<float>(value.y_m) : nothing,
                                          is_there ? 0.0F : nothing,
                                          value.intensity_dn,
                                          static_cast<float>(value.sigma_m),
                                          static_cast<float>(value.sigma_cal_m),
                                          value.width_px,
                                          value.confidence};
    std::memcpy(message.data.data() + i * kPointStep, numbers.data(), sizeof numbers);
    message.data[i * kPointStep + sizeof numbers] = wire::return_code(value.status);
  }
}

LaserScanMaker::LaserScanMaker(const LaserScanGrid& grid) : grid_(grid) {
  const bool is_grid = grid.bearings >= 2 && grid.angle_max_rad > grid.angle_min_rad &&
                       grid.range_max_m > grid.range_min_m;
  if (!is_grid) {
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("LaserScanGrid: {} bearings from {} to {} rad, {} to {} m", grid.bearings,
                    grid.angle_min_rad, grid.angle_max_rad, grid.range_min_m, grid.range_max_m));
  }
  distances_.resize(static_cast<std::size_t>(grid.bearings));
  ranges_.resize(distances_.size());
}

void LaserScanMaker::place(const Return& value, int bearing, wire::LaserScan& message) {
  const auto at = static_cast<std::size_t>(bearing);
  const double distance =
      std::abs((value.bearing_rad - grid_.angle_min_rad) / grid_.increment_rad() - bearing);
  if (distance > 1.0 || distance > distances_[at]) return;
  if (distance == distances_[at] && value.range_m >= ranges_[at]) return;
  distances_[at] = distance;
  ranges_[at] = value.range_m;
  const bool is_good = verdict(value.status) == Verdict::kGood;
  message.ranges[at] =
      is_good ? static_cast<float>(value.range_m) : std::numeric_limits<float>::quiet_NaN();
  message.intensities[at] = value.intensity_dn;
}

void LaserScanMaker::to_message(const PolarScan& scan, wire::LaserScan& message) {
  constexpr float kNothing = std::numeric_limits<float>::infinity();
  set_header(scan, message.header);
  message.angle_min = static_cast<float>(grid_.angle_min_rad);
  message.angle_max = static_cast<float>(grid_.angle_max_rad);
  message.angle_increment = static_cast<float>(grid_.increment_rad());
  message.time_increment = 0.0F;
  message.scan_time = 0.0F;
  message.range_min = static_cast<float>(grid_.range_min_m);
  message.range_max = static_cast<float>(grid_.range_max_m);
  message.ranges.assign(distances_.size(), kNothing);
  message.intensities.assign(distances_.size(), 0.0F);
  std::fill(distances_.begin(), distances_.end(), std::numeric_limits<double>::infinity());
  for (const Return& value : scan.returns) {
    if (!std::isfinite(value.bearing_rad) || !std::isfinite(value.range_m)) continue;
    const double step = (value.bearing_rad - grid_.angle_min_rad) / grid_.increment_rad();
    if (step < -1.0 || step > grid_.bearings) continue;
    const int below = static_cast<int>(std::floor(step));
    for (int bearing = std::max(0, below - 1); bearing <= std::min(grid_.bearings - 1, below + 1);
         ++bearing) {
      place(value, bearing, message);
    }
  }
}

}  // namespace striper
