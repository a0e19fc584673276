// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper {

/// Maps an index along one image axis to the pixel coordinate of the full sensor:
/// `sensor = offset + step * index`. Coordinates are those of pixel centres, 0 being the first one.
struct AxisGrid {
  double offset = 0.0;
  double step = 1.0;

  double sensor(double index) const noexcept { return offset + step * index; }
  double index(double sensor_px) const noexcept { return (sensor_px - offset) / step; }

  friend bool operator==(const AxisGrid&, const AxisGrid&) = default;
};

/// Maps image indices to full-sensor pixels, per axis.
///
/// One concept for three things: a region of interest (offset = its corner, step 1), n x n binning
/// (step n, offset (n - 1) / 2: the centre of the first bin), and one field of an interlaced
/// frame (step 2 along v; offset 0 for the top field, 1 for the bottom field). They compose by
/// `then`.
struct PixelGrid {
  AxisGrid u;  ///< Along a row, to the right.
  AxisGrid v;  ///< Along a column, downwards.

  double sensor_u(double column) const noexcept { return u.sensor(column); }
  double sensor_v(double row) const noexcept { return v.sensor(row); }

  /// Returns the grid of an image cut from this one: `inner` maps its indices to this image's
  /// indices.
  PixelGrid then(const PixelGrid& inner) const noexcept {
    return {{u.sensor(inner.u.offset), u.step * inner.u.step},
            {v.sensor(inner.v.offset), v.step * inner.v.step}};
  }

  static PixelGrid region(int left, int top) noexcept {
    return {{static_cast<double>(left), 1.0}, {static_cast<double>(top), 1.0}};
  }
  static PixelGrid binned(int across, int down) noexcept {
    return {{0.5 * (across - 1), static_cast<double>(across)},
            {0.5 * (down - 1), static_cast<double>(down)}};
  }
  static PixelGrid top_field() noexcept { return {{0.0, 1.0}, {0.0, 2.0}}; }
  static PixelGrid bottom_field() noexcept { return {{0.0, 1.0}, {1.0, 2.0}}; }

  friend bool operator==(const PixelGrid&, const PixelGrid&) = default;
};

}  // namespace striper
