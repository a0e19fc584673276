// SPDX-License-Identifier: Apache-2.0
#include "gige/pictures/pixel_layout.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include <opencv2/imgproc.hpp>

namespace striper::detail {
namespace {

// Codes: GenICam Pixel Format Naming Convention 2.4 and GigE Vision 1.2, chapter 26.
constexpr std::array kLayouts{
    PixelLayout{0x01080001, "Mono8", 8, Packing::kBytes},
    PixelLayout{0x01100003, "Mono10", 10, Packing::kWords},
    PixelLayout{0x01100005, "Mono12", 12, Packing::kWords},
    PixelLayout{0x01100025, "Mono14", 14, Packing::kWords},
    PixelLayout{0x01100007, "Mono16", 16, Packing::kWords},
    PixelLayout{0x010c0004, "Mono10Packed", 10, Packing::kPacked10},
    PixelLayout{0x010c0006, "Mono12Packed", 12, Packing::kPacked12},
    PixelLayout{0x010a0046, "Mono10p", 10, Packing::kStream10},
    PixelLayout{0x010c0047, "Mono12p", 12, Packing::kStream12},
    PixelLayout{0x01080008, "BayerGR8", 8, Packing::kBytes, Mosaic::kGR},
    PixelLayout{0x01080009, "BayerRG8", 8, Packing::kBytes, Mosaic::kRG},
    PixelLayout{0x0108000a, "BayerGB8", 8, Packing::kBytes, Mosaic::kGB},
    PixelLayout{0x0108000b, "BayerBG8", 8, Packing::kBytes, Mosaic::kBG},
    PixelLayout{0x0110000c, "BayerGR10", 10, Packing::kWords, Mosaic::kGR},
    PixelLayout{0x0110000d, "BayerRG10", 10, Packing::kWords, Mosaic::kRG},
    PixelLayout{0x0110000e, "BayerGB10", 10, Packing::kWords, Mosaic::kGB},
    PixelLayout{0x0110000f, "BayerBG10", 10, Packing::kWords, Mosaic::kBG},
    PixelLayout{0x01100010, "BayerGR12", 12, Packing::kWords, Mosaic::kGR},
    PixelLayout{0x01100011, "BayerRG12", 12, Packing::kWords, Mosaic::kRG},
    PixelLayout{0x01100012, "BayerGB12", 12, Packing::kWords, Mosaic::kGB},
    PixelLayout{0x01100013, "BayerBG12", 12, Packing::kWords, Mosaic::kBG},
    PixelLayout{0x0110002e, "BayerGR16", 16, Packing::kWords, Mosaic::kGR},
    PixelLayout{0x0110002f, "BayerRG16", 16, Packing::kWords, Mosaic::kRG},
    PixelLayout{0x01100030, "BayerGB16", 16, Packing::kWords, Mosaic::kGB},
    PixelLayout{0x01100031, "BayerBG16", 16, Packing::kWords, Mosaic::kBG},
    PixelLayout{0x010c0026, "BayerGR10Packed", 10, Packing::kPacked10, Mosaic::kGR},
    PixelLayout{0x010c0027, "BayerRG10Packed", 10, Packing::kPacked10, Mosaic::kRG},
    PixelLayout{0x010c0028, "BayerGB10Packed", 10, Packing::kPacked10, Mosaic::kGB},
    PixelLayout{0x010c0029, "BayerBG10Packed", 10, Packing::kPacked10, Mosaic::kBG},
    PixelLayout{0x010c002a, "BayerGR12Packed", 12, Packing::kPacked12, Mosaic::kGR},
    PixelLayout{0x010c002b, "BayerRG12Packed", 12, Packing::kPacked12, Mosaic::kRG},
    PixelLayout{0x010c002c, "BayerGB12Packed", 12, Packing::kPacked12, Mosaic::kGB},
    PixelLayout{0x010c002d, "BayerBG12Packed", 12, Packing::kPacked12, Mosaic::kBG},
    PixelLayout{0x010a0056, "BayerGR10p", 10, Packing::kStream10, Mosaic::kGR},
    PixelLayout{0x010a0058, "BayerRG10p", 10, Packing::kStream10, Mosaic::kRG},
    PixelLayout{0x010a0054, "BayerGB10p", 10, Packing::kStream10, Mosaic::kGB},
    PixelLayout{0x010a0052, "BayerBG10p", 10, Packing::kStream10, Mosaic::kBG},
    PixelLayout{0x010c0057, "BayerGR12p", 12, Packing::kStream12, Mosaic::kGR},
    PixelLayout{0x010c0059, "BayerRG12p", 12, Packing::kStream12, Mosaic::kRG},
    PixelLayout{0x010c0055, "BayerGB12p", 12, Packing::kStream12, Mosaic::kGB},
    PixelLayout{0x010c0053, "BayerBG12p", 12, Packing::kStream12, Mosaic::kBG},
    PixelLayout{0x02180015, "BGR8", 8, Packing::kColour8Bgr},
    PixelLayout{0x02180014, "RGB8", 8, Packing::kColour8Rgb},
};

// OpenCV names a mosaic by the second row's second and third pixel, GenICam by the first two.
int to_grey_code(Mosaic mosaic) {
  switch (mosaic) {
    case Mosaic::kRG:
      return cv::COLOR_BayerBG2GRAY;
    case Mosaic::kGR:
      return cv::COLOR_BayerGB2GRAY;
    case Mosaic::kGB:
      return cv::COLOR_BayerGR2GRAY;
    default:
      return cv::COLOR_BayerRG2GRAY;
  }
}

void unpack_row(Packing packing, int width, const std::uint8_t* in, std::uint16_t* out) {
  const int pairs = width / 2;
  switch (packing) {
    case Packing::kPacked10:
    case Packing::kPacked12: {
      const int low_bits = packing == Packing::kPacked10 ? 2 : 4;
      const int mask = (1 << low_bits) - 1;
      for (int i = 0; i < pairs; ++i, in += 3, out += 2) {
        out[0] = static_cast<std::uint16_t>((in[0] << low_bits) | (in[1] & mask));
        out[1] = static_cast<std::uint16_t>((in[2] << low_bits) | ((in[1] >> 4) & mask));
      }
      if (width % 2 != 0) {
        out[0] = static_cast<std::uint16_t>((in[0] << low_bits) | (in[1] & mask));
      }
      break;
    }
    case Packing::kStream12:
      for (int i = 0; i < pairs; ++i, in += 3, out += 2) {
        out[0] = static_cast<std::uint16_t>(in[0] | ((in[1] & 0x0f) << 8));
        out[1] = static_cast<std::uint16_t>((in[1] >> 4) | (in[2] << 4));
      }
      if (width % 2 != 0) out[0] = static_cast<std::uint16_t>(in[0] | ((in[1] & 0x0f) << 8));
      break;
    case Packing::kStream10:
      for (int i = 0; i < width; ++i) {
        const int bit = 10 * i;
        const int two_bytes = in[bit / 8] | (in[bit / 8 + 1] << 8);
        out[i] = static_cast<std::uint16_t>((two_bytes >> (bit % 8)) & 0x3ff);
      }
      break;
    default:
      break;
  }
}

void pack_row(Packing packing, int width, const std::uint16_t* in, std::uint8_t* out) {
  const auto second = [&](int i) { return i + 1 < width ? in[i + 1] : std::uint16_t{0}; };
  switch (packing) {
    case Packing::kPacked10:
    case Packing::kPacked12: {
      const int low_bits = packing == Packing::kPacked10 ? 2 : 4;
      const int mask = (1 << low_bits) - 1;
      for (int i = 0; i < width; i += 2, out += 3) {
        out[0] = static_cast<std::uint8_t>(in[i] >> low_bits);
        out[1] = static_cast<std::uint8_t>((in[i] & mask) | ((second(i) & mask) << 4));
        if (i + 1 < width) out[2] = static_cast<std::uint8_t>(second(i) >> low_bits);
      }
      break;
    }
    case Packing::kStream12:
      for (int i = 0; i < width; i += 2, out += 3) {
        out[0] = static_cast<std::uint8_t>(in[i]);
        out[1] = static_cast<std::uint8_t>((in[i] >> 8) | ((second(i) & 0x0f) << 4));
        if (i + 1 < width) out[2] = static_cast<std::uint8_t>(second(i) >> 4);
      }
      break;
    case Packing::kStream10:
      std::fill_n(out, (static_cast<std::size_t>(width) * 10 + 7) / 8, std::uint8_t{0});
      for (int i = 0; i < width; ++i) {
        const int bit = 10 * i;
        const int shifted = in[i] << (bit % 8);
        out[bit / 8] = static_cast<std::uint8_t>(out[bit / 8] | shifted);
        out[bit / 8 + 1] = static_cast<std::uint8_t>(shifted >> 8);
      }
      break;
    default:
      break;
  }
}

}  // namespace

std::size_t PixelLayout::row_bytes(int width) const noexcept {
  return (static_cast<std::size_t>(width) * bits_per_pixel() + 7) / 8;
}

int PixelLayout::channels() const noexcept {
  return packing == Packing::kColour8Bgr || packing == Packing::kColour8Rgb ? 3 : 1;
}

int PixelLayout::mat_type() const noexcept {
  if (channels() == 3) return CV_8UC3;
  return bit_depth == 8 ? CV_8UC1 : CV_16UC1;
}

bool PixelLayout::is_direct() const noexcept {
  return mosaic == Mosaic::kNone && (packing == Packing::kBytes || packing == Packing::kWords ||
                                     packing == Packing::kColour8Bgr);
}

std::span<const PixelLayout> known_layouts() noexcept { return kLayouts; }

const PixelLayout* find_layout(std::uint32_t code) noexcept {
  const auto* found = std::find_if(kLayouts.begin(), kLayouts.end(),
                                   [&](const PixelLayout& l) { return l.code == code; });
  return found == kLayouts.end() ? nullptr : found;
}

const PixelLayout* find_layout(std::string_view name) noexcept {
  const auto* found = std::find_if(kLayouts.begin(), kLayouts.end(),
                                   [&](const PixelLayout& l) { return l.name == name; });
  return found == kLayouts.end() ? nullptr : found;
}

cv::Mat wrap(const PixelLayout& layout, cv::Size size, void* data) {
  return {size, layout.mat_type(), data, layout.row_bytes(size.width)};
}

void unpack(const PixelLayout& layout, cv::Size size, const std::uint8_t* data, cv::Mat& scratch,
            cv::Mat& image) {
  const bool is_mosaic = layout.mosaic != Mosaic::kNone;
  const bool is_packed = layout.bit_depth > 8 && layout.packing != Packing::kWords;
  if (!is_packed) {
    // OpenCV wants a mutable pointer to look at memory that it only reads.
    const cv::Mat raw = wrap(layout, size, const_cast<std::uint8_t*>(data));
    if (layout.packing == Packing::kColour8Rgb) {
      cv::cvtColor(raw, image, cv::COLOR_RGB2BGR);
    } else if (is_mosaic) {
      cv::cvtColor(raw, image, to_grey_code(layout.mosaic));
    } else {
      raw.copyTo(image);
    }
    return;
  }
  cv::Mat& words = is_mosaic ? scratch : image;
  words.create(size, CV_16UC1);
  const std::size_t row_bytes = layout.row_bytes(size.width);
  for (int row = 0; row < size.height; ++row) {
    unpack_row(layout.packing, size.width, data + static_cast<std::size_t>(row) * row_bytes,
               words.ptr<std::uint16_t>(row));
  }
  if (is_mosaic) cv::cvtColor(words, image, to_grey_code(layout.mosaic));
}

void pack(const PixelLayout& layout, const cv::Mat& image, std::uint8_t* packed) {
  const std::size_t row_bytes = layout.row_bytes(image.cols);
  for (int row = 0; row < image.rows; ++row, packed += row_bytes) {
    if (layout.packing == Packing::kBytes || layout.packing == Packing::kWords) {
      std::memcpy(packed, image.ptr(row), row_bytes);
    } else {
      pack_row(layout.packing, image.cols, image.ptr<std::uint16_t>(row), packed);
    }
  }
}

}  // namespace striper::detail
