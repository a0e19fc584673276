// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <opencv2/core/mat.hpp>

namespace striper::detail::v4l2 {

/// How the grey (or colour) of a pixel lies in the driver's memory.
enum class Layout : std::uint8_t {
  kGrey8,         ///< One byte each; also the luma plane that planar formats begin with.
  kGrey16,        ///< Two bytes each, little end first.
  kGrey16BigEnd,  ///< Two bytes each, big end first.
  kMipi10,        ///< 4 pixels in 5 bytes: the high bytes, then the four low pairs of bits.
  kMipi12,        ///< 2 pixels in 3 bytes: the high bytes, then the two low nibbles.
  kBitPacked10,   ///< A stream of 10-bit numbers, most significant bit first.
  kLumaFirst,     ///< Luma in the even bytes (YUYV).
  kLumaSecond,    ///< Luma in the odd bytes (UYVY).
  kBgr,           ///< Three bytes, OpenCV's own order.
  kRgb,           ///< Three bytes.
  kBgrx,          ///< Four bytes, the last unused.
  kXrgb,          ///< Four bytes, the first unused.
  kBayer8,        ///< One byte each under a colour mosaic.
  kBayer16,       ///< Two bytes each under a colour mosaic.
  kJpeg,          ///< A whole JPEG.
};

/// A pixel format of the kernel that striper can use.
struct PixelFormat {
  std::uint32_t fourcc = 0;
  Layout layout = Layout::kGrey8;
  int bit_depth = 8;
  int bayer_code = -1;  ///< cv::cvtColor's, to grey.

  int channels() const noexcept;
  int mat_type() const noexcept;  ///< CV_8UC1, CV_16UC1 or CV_8UC3.

  /// Whether a cv::Mat can be laid over the driver's memory.
  bool is_usable_in_place() const noexcept;

  /// Whether the driver's memory holds 16-bit numbers in our own byte order.
  bool has_wide_pixels() const noexcept {
    return layout == Layout::kGrey16 || layout == Layout::kBayer16;
  }

  /// Bytes that a row of `width` pixels takes at the least; 0 for JPEG.
  std::size_t row_bytes(int width) const noexcept;
};

/// All that are known, the best first: grey as it is, then luma that needs no copy, luma that needs
/// one, packed grey, colour, mosaics, and compressed images last. 8-bit grey comes before deeper
/// grey: it is what analogue grabbers really have and never costs frame rate; ask for `Y10`, `Y12`
/// or `Y16` where the sensor has more.
std::span<const PixelFormat> pixel_formats() noexcept;

const PixelFormat* find_pixel_format(std::uint32_t fourcc) noexcept;

/// `GREY`, `Y10`, `Y16-BE`: without the padding blanks.
std::string fourcc_to_string(std::uint32_t fourcc);

/// The inverse, case-insensitive; 0 for text that is no code.
std::uint32_t fourcc_from_string(std::string_view text) noexcept;

/// An image in the driver's memory.
struct RawImage {
  const std::uint8_t* data = nullptr;
  std::size_t bytes = 0;
  std::size_t stride = 0;  ///< From row to row.
  int width = 0;
  int height = 0;
};

/// Lays an image over the driver's memory. Precondition: `is_usable_in_place()`.
cv::Mat view(const PixelFormat& format, const RawImage& raw);

/// Copies an image into `image`, whose memory is reused where size and type fit. False where the
/// data is damaged (JPEG alone can be).
bool convert(const PixelFormat& format, const RawImage& raw, cv::Mat& image);

}  // namespace striper::detail::v4l2
