// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iosfwd>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace striper::wire {

/// A return as a point, in whatever frame the file is of. NaN coordinates: there is none.
struct CloudPoint {
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  float x_m = kNone;
  float y_m = kNone;
  float z_m = kNone;
  float intensity = kNone;  ///< DN.
  float sigma_m = kNone;
  float sigma_cal_m = kNone;
  float width_px = kNone;
  float confidence = kNone;
  std::uint8_t status = 0;  ///< `return_code`.
  double time_s = 0.0;
};

/// The formats of files of points, little endian all of them. Sources: G. Turk, The PLY Polygon
/// File Format (1994); Point Cloud Library, "The PCD file format", v0.7; ASPRS, LAS
/// Specification 1.2 (2008), and from 1.4 the extra bytes.
enum class PointFormat {
  kPly,  ///< Points that are there.
  kPcd,  ///< Every point, WIDTH x HEIGHT being points a scan x scans where all scans are as long.
  kLas,  ///< 1.2, point format 1: points that are there, to 1e-5 m; sigma and sigma_cal as extra
         ///< bytes, status as user data, `time_s` as it is where LAS has GPS time; width and
         ///< confidence are not in it.
};

/// Of a file's extension, ".ply" and so on, in lower case.
std::optional<PointFormat> point_format_from_extension(std::string_view extension) noexcept;

struct PointFileOptions {
  /// LAS keeps intensities in 16 bits: DN times 65535 over this. The factor is in the header's
  /// system identifier.
  double full_scale_dn = 255.0;
};

/// Writes points as a file of one of the formats to a stream that can seek: the number of points
/// stands in front and is filled in by `flush` and `close`. No allocation per scan. Not
/// thread-safe.
class PointFile {
 public:
  virtual ~PointFile() = default;
  PointFile(const PointFile&) = delete;
  PointFile& operator=(const PointFile&) = delete;

  /// Appends the points of one scan. @throws Error{kIo} where the stream fails.
  virtual void write(std::span<const CloudPoint> scan) = 0;

  /// Makes what was written a whole file. @throws Error{kIo}.
  virtual void flush() = 0;

  /// In the file.
  virtual std::uint64_t points() const noexcept = 0;
  /// Not in the file because the format cannot hold them (beyond 21 km in LAS); those without
  /// coordinates not counted.
  virtual std::uint64_t left_out() const noexcept = 0;

 protected:
  PointFile() = default;
};

/// @param stream stays the caller's, and open as long as the PointFile is there. @throws
/// Error{kIo}.
std::unique_ptr<PointFile> make_point_file(PointFormat format, std::ostream& stream,
                                           const PointFileOptions& options = {});

}  // namespace striper::wire
