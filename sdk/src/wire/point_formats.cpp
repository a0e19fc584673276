// SPDX-License-Identifier: Apache-2.0
#include "wire/point_formats.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace striper::wire {
namespace {

void put_text(std::string_view text, Bytes& out) {
  out.insert(out.end(), text.begin(), text.end());
}

/// A text in a field of `size` bytes, filled up with zeros.
void put_field(std::string_view text, std::size_t size, Bytes& out) {
  text = text.substr(0, size);
  put_text(text, out);
  out.insert(out.end(), size - text.size(), 0);
}

void put_number(float value, Bytes& out) {
  ByteWriter(out).put(std::bit_cast<std::uint32_t>(value));
}
void put_number(double value, Bytes& out) {
  ByteWriter(out).put(std::bit_cast<std::uint64_t>(value));
}

/// All that PLY and PCD have of a point.
void put_everything(const CloudPoint& point, Bytes& out) {
  for (const float value : {point.x_m, point.y_m, point.z_m, point.intensity, point.sigma_m,
                            point.sigma_cal_m, point.width_px, point.confidence}) {
    put_number(value, out);
  }
  out.push_back(point.status);
  put_number(point.time_s, out);
}

// LAS 1.2, "Public header block", "Variable length records", "Point data record format 1"; LAS 1.4,
// table 24.
constexpr std::uint16_t kLasHeaderBytes = 227;
constexpr std::uint16_t kExtraDescriptionBytes = 192;
constexpr std::uint16_t kLasPointBytes = 28 + 8;
constexpr std::uint16_t kExtraRecordBytes = 2 * kExtraDescriptionBytes;
constexpr std::uint32_t kLasPointsAt = kLasHeaderBytes + 54 + kExtraRecordBytes;
constexpr double kLasScale = 1e-5;
constexpr std::uint8_t kExtraFloat = 9;

void put_extra_description(std::string_view name, std::string_view what, Bytes& out) {
  put_field({}, 2, out);
  out.push_back(kExtraFloat);
  out.push_back(0);  // Neither scaled nor with limits.
  put_field(name, 32, out);
  put_field({}, 4 + 5 * 24, out);
  put_field(what, 32, out);
}

void put_extra_record(Bytes& out) {
  ByteWriter writer(out);
  writer.put(std::uint16_t{0});
  put_field("LASF_Spec", 16, out);
  writer.put(std::uint16_t{4});
  writer.put(kExtraRecordBytes);
  put_field("Extra bytes", 32, out);
  put_extra_description("sigma", "m, one-sigma random", out);
  put_extra_description("sigma_cal", "m, one-sigma of calibration", out);
}

}  // namespace

// Numbers have leading zeros so that the header stays as long as it is.
void PlyLayout::put_header(const PointCounts& counts, Bytes& out) const {
  put_text(fmt::format(
               "ply\nformat binary_little_endian 1.0\ncomment Striper: metres, seconds since 1970\n"
               "element vertex {:010}\n",
               counts.points),
           out);
  for (const char* name :
       {"x", "y", "z", "intensity", "sigma", "sigma_cal", "width", "confidence"}) {
    put_text(fmt::format("property float {}\n", name), out);
  }
  put_text("property uchar status\nproperty double time\nend_header\n", out);
}

bool PlyLayout::put_point(const CloudPoint& point, Bytes& out) const {
  put_everything(point, out);
  return true;
}

void PcdLayout::put_header(const PointCounts& counts, Bytes& out) const {
  const bool is_organised = counts.is_organised && counts.scans > 0;
  put_text(fmt::format(
               "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
               "FIELDS x y z intensity sigma sigma_cal width confidence status time\n"
               "SIZE 4 4 4 4 4 4 4 4 1 8\nTYPE F F F F F F F F U F\nCOUNT 1 1 1 1 1 1 1 1 1 1\n"
               "WIDTH {:010}\nHEIGHT {:010}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {:010}\nDATA binary\n",
               is_organised ? counts.scan_points : counts.points, is_organised ? counts.scans : 1,
               counts.points),
           out);
}

bool PcdLayout::put_point(const CloudPoint& point, Bytes& out) const {
  put_everything(point, out);
  return true;
}

void LasLayout::put_header(const PointCounts& counts, Bytes& out) const {
  ByteWriter writer(out);
  put_text("LASF", out);
  put_field({}, 2 + 2 + 16, out);  // No source, times as they are, no project.
  writer.put(std::uint8_t{1});
  writer.put(std::uint8_t{2});
  put_field(fmt::format("Striper; intensity {:.6g} / DN", factor_), 32, out);
  put_field("Striper", 32, out);
  put_field({}, 4, out);  // No date of its own.
  writer.put(kLasHeaderBytes);
  writer.put(kLasPointsAt);
  writer.put(std::uint32_t{1});
  writer.put(std::uint8_t{1});
  writer.put(kLasPointBytes);
  const auto points =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(counts.points, UINT32_MAX));
  writer.put(points);
  writer.put(points);
  put_field({}, 4 * 4, out);  // None is a second or later return.
  for (int axis = 0; axis < 3; ++axis) put_number(kLasScale, out);
  for (int axis = 0; axis < 3; ++axis) put_number(0.0, out);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put_number(counts.points > 0 ? counts.greatest[axis] : 0.0, out);
    put_number(counts.points > 0 ? counts.least[axis] : 0.0, out);
  }
  put_extra_record(out);
}

bool LasLayout::put_point(const CloudPoint& point, Bytes& out) const {
  const std::array<double, 3> steps = {point.x_m / kLasScale, point.y_m / kLasScale,
                                       point.z_m / kLasScale};
  const auto fits = [](double step) { return std::abs(step) < 2147483647.0; };
  if (!std::all_of(steps.begin(), steps.end(), fits)) return false;
  ByteWriter writer(out);
  for (const double step : steps) writer.put(static_cast<std::uint32_t>(std::lround(step)));
  const double intensity = std::isnan(point.intensity) ? 0.0 : point.intensity * factor_;
  writer.put(static_cast<std::uint16_t>(std::lround(std::clamp(intensity, 0.0, 65535.0))));
  writer.put(std::uint8_t{1 | 1 << 3});  // The first return of one.
  writer.put(std::uint8_t{0});           // Never classified.
  writer.put(std::uint8_t{0});
  writer.put(point.status);
  writer.put(std::uint16_t{0});
  put_number(point.time_s, out);
  put_number(point.sigma_m, out);
  put_number(point.sigma_cal_m, out);
  return true;
}

}  // namespace striper::wire
