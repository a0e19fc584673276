// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include <striper/wire/point_file.hpp>

#include "wire/mcap_bytes.hpp"

namespace striper::wire {

/// What a header says of the points behind it.
struct PointCounts {
  std::uint64_t points = 0;
  std::uint64_t scans = 0;
  std::size_t scan_points = 0;  ///< Of each scan.
  bool is_organised = true;     ///< All scans are as long.
  std::array<double, 3> least{kFar, kFar, kFar};
  std::array<double, 3> greatest{-kFar, -kFar, -kFar};

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
};

/// One format: a header of constant length, and a point.
class PointLayout {
 public:
  virtual ~PointLayout() = default;
  virtual void put_header(const PointCounts& counts, Bytes& out) const = 0;
  /// Appends a point; false where the format cannot hold it.
  virtual bool put_point(const CloudPoint& point, Bytes& out) const = 0;
  virtual bool keeps_missing() const { return false; }
};

class PlyLayout : public PointLayout {
 public:
  void put_header(const PointCounts& counts, Bytes& out) const override;
  bool put_point(const CloudPoint& point, Bytes& out) const override;
};

class PcdLayout : public PointLayout {
 public:
  void put_header(const PointCounts& counts, Bytes& out) const override;
  bool put_point(const CloudPoint& point, Bytes& out) const override;
  bool keeps_missing() const override { return true; }
};

class LasLayout : public PointLayout {
 public:
  explicit LasLayout(double full_scale_dn) : factor_(65535.0 / full_scale_dn) {}
  void put_header(const PointCounts& counts, Bytes& out) const override;
  bool put_point(const CloudPoint& point, Bytes& out) const override;

 private:
  double factor_;
};

}  // namespace striper::wire
