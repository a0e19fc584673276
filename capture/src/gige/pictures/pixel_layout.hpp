// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <opencv2/core/mat.hpp>

namespace striper::detail {

/// How the pixels of one row follow each other in memory.
enum class Packing : std::uint8_t {
  kBytes,       ///< One byte a pixel.
  kWords,       ///< Two bytes a pixel, little-endian, least significant bits used.
  kPacked10,    ///< GigE Vision 1.x: two pixels in three bytes, the low bits in the middle one.
  kPacked12,    ///< The same with four low bits each.
  kStream10,    ///< PFNC "p": four pixels in five bytes, least significant bit first.
  kStream12,    ///< PFNC "p": two pixels in three bytes, least significant bit first.
  kColour8Bgr,  ///< Three bytes a pixel.
  kColour8Rgb,
};

enum class Mosaic : std::uint8_t { kNone, kGR, kRG, kGB, kBG };

/// One pixel format of the GenICam pixel format naming convention that a frame can be made of.
struct PixelLayout {
  std::uint32_t code;
  std::string_view name;
  int bit_depth;
  Packing packing;
  Mosaic mosaic = Mosaic::kNone;

  std::size_t bits_per_pixel() const noexcept { return (code >> 16) & 0xff; }
  std::size_t row_bytes(int width) const noexcept;
  int channels() const noexcept;
  /// CV_8UC1, CV_16UC1 or CV_8UC3.
  int mat_type() const noexcept;

  /// True where the camera's memory can be used as it is.
  bool is_direct() const noexcept;
};

/// Every format that is understood, preferred ones first.
std::span<const PixelLayout> known_layouts() noexcept;
const PixelLayout* find_layout(std::uint32_t code) noexcept;
const PixelLayout* find_layout(std::string_view name) noexcept;

/// Looks at `data` as an image, without a copy. Precondition: `layout.is_direct()`.
cv::Mat wrap(const PixelLayout& layout, cv::Size size, void* data);

/// Unpacks to `image`, whose memory is reused where its size and type fit. A colour mosaic becomes
/// grey. `scratch` holds the unpacked mosaic.
/// Precondition: `data` has `row_bytes` for each row.
void unpack(const PixelLayout& layout, cv::Size size, const std::uint8_t* data, cv::Mat& scratch,
            cv::Mat& image);

/// The inverse for grey formats, for the virtual camera: appends nothing, writes whole rows.
/// Precondition: the layout is grey and `packed` has `row_bytes` for each row.
void pack(const PixelLayout& layout, const cv::Mat& image, std::uint8_t* packed);

}  // namespace striper::detail
