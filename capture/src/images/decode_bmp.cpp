// SPDX-License-Identifier: Apache-2.0
// Uncompressed BMP, by hand: cv::imread prints to the standard error stream when one is truncated.
#include <algorithm>
#include <array>
#include <cstdlib>

#include <fmt/format.h>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

std::uint32_t little_endian(Bytes bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count - 1; i >= 0; --i) {
    value = value << 8U | bytes[at + static_cast<std::size_t>(i)];
  }
  return value;
}

struct BmpHeader {
  static constexpr std::size_t kSize = 54;  // File header and the 40 bytes every version shares.

  std::size_t pixels = 0;   // Where they begin.
  std::size_t palette = 0;  // Where it begins.
  std::uint32_t colours = 0;
  int width = 0;
  int height = 0;  // Negative: the first row in the file is the top one.
  int bits = 0;
  std::uint32_t compression = 0;

  std::size_t row_bytes() const {
    return (static_cast<std::size_t>(width) * static_cast<std::size_t>(bits) + 31) / 32 * 4;
  }
};

BmpHeader read_bmp_header(Bytes bytes) {
  BmpHeader header;
  header.pixels = little_endian(bytes, 10, 4);
  header.palette = 14 + static_cast<std::size_t>(little_endian(bytes, 14, 4));
  header.width = static_cast<std::int32_t>(little_endian(bytes, 18, 4));
  header.height = static_cast<std::int32_t>(little_endian(bytes, 22, 4));
  header.bits = static_cast<int>(little_endian(bytes, 28, 2));
  header.compression = little_endian(bytes, 30, 4);
  header.colours = little_endian(bytes, 46, 4);
  if (header.colours == 0 && header.bits == 8) header.colours = 256;
  return header;
}

Fault check_bmp(const BmpHeader& header, Bytes bytes) {
  constexpr std::uint32_t kUncompressed = 0;
  const bool is_known = header.bits == 8 || header.bits == 24 || header.bits == 32;
  if (header.compression != kUncompressed || !is_known) {
    return fmt::format(
        "is a BMP of {} bits, compression {}; 8, 24 or 32 bits without compression are supported",
        header.bits, header.compression);
  }
  if (header.width <= 0 || header.height == INT32_MIN) return "is a damaged BMP: no size";
  const auto rows = static_cast<std::uint64_t>(std::abs(header.height));
  if (Fault fault = check_size(static_cast<std::uint64_t>(header.width), rows); !fault.empty()) {
    return fault;
  }
  const std::uint64_t needed = header.pixels + header.row_bytes() * rows;
  if (header.pixels < BmpHeader::kSize || needed > bytes.size()) {
    return fmt::format("is a damaged or truncated BMP: {} bytes of {}", bytes.size(), needed);
  }
  if (header.bits == 8 &&
      (header.colours > 256 || header.palette + 4 * std::size_t{header.colours} > header.pixels)) {
    return "is a damaged BMP: its palette overlaps its pixels";
  }
  return {};
}

using Palette = std::array<cv::Vec3b, 256>;

Palette read_palette(const BmpHeader& header, Bytes bytes) {
  Palette palette{};
  for (std::size_t i = 0; i < header.colours; ++i) {
    const std::size_t at = header.palette + 4 * i;
    palette[i] = {bytes[at], bytes[at + 1], bytes[at + 2]};
  }
  return palette;
}

bool is_grey(const Palette& palette) {
  return std::all_of(palette.begin(), palette.end(), [](const cv::Vec3b& colour) {
    return colour[0] == colour[1] && colour[1] == colour[2];
  });
}

void copy_bmp_row(const BmpHeader& header, const Palette& palette, const std::uint8_t* from,
                  cv::Mat& image, int row) {
  const int step = header.bits / 8;
  std::uint8_t* const to = image.ptr(row);
  for (int u = 0; u < header.width; ++u, from += step) {
    const cv::Vec3b colour =
        step == 1 ? palette[*from] : cv::Vec3b(from[0], from[1], from[2]);  // File order: B G R.
    std::copy_n(colour.val, image.channels(), to + u * image.channels());
  }
}

}  // namespace

Fault decode_bmp(Bytes bytes, DecodedImage& decoded) {
  if (bytes.size() < BmpHeader::kSize) {
    return fmt::format("is a truncated BMP: {} bytes", bytes.size());
  }
  const BmpHeader header = read_bmp_header(bytes);
  if (Fault fault = check_bmp(header, bytes); !fault.empty()) return fault;

  const Palette palette = header.bits == 8 ? read_palette(header, bytes) : Palette{};
  const int rows = std::abs(header.height);
  decoded.image.create(rows, header.width,
                       header.bits == 8 && is_grey(palette) ? CV_8UC1 : CV_8UC3);
  decoded.bit_depth = 8;
  for (int i = 0; i < rows; ++i) {
    const std::uint8_t* from =
        bytes.data() + header.pixels + header.row_bytes() * static_cast<std::size_t>(i);
    copy_bmp_row(header, palette, from, decoded.image, header.height < 0 ? i : rows - 1 - i);
  }
  return {};
}

}  // namespace striper::detail
