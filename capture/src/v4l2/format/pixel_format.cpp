// SPDX-License-Identifier: Apache-2.0
#include "v4l2/format/pixel_format.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <utility>

#include <linux/videodev2.h>
#include <opencv2/imgproc.hpp>

#include "images/decode.hpp"

#ifndef V4L2_PIX_FMT_Y12P
#define V4L2_PIX_FMT_Y12P v4l2_fourcc('Y', '1', '2', 'P')
#endif

namespace striper::detail::v4l2 {
namespace {

static_assert(std::endian::native == std::endian::little, "grey formats are little-endian");

constexpr std::uint32_t kBigEndFlag = 1U << 31;

constexpr std::array kPixelFormats{
    PixelFormat{V4L2_PIX_FMT_GREY, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_Y10, Layout::kGrey16, 10},
    PixelFormat{V4L2_PIX_FMT_Y12, Layout::kGrey16, 12},
    PixelFormat{V4L2_PIX_FMT_Y14, Layout::kGrey16, 14},
    PixelFormat{V4L2_PIX_FMT_Y16, Layout::kGrey16, 16},
    PixelFormat{V4L2_PIX_FMT_NV12, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV21, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV16, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV61, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV24, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV42, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV12M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV21M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV16M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_NV61M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YUV420, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YVU420, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YUV422P, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YUV420M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YVU420M, Layout::kGrey8, 8},
    PixelFormat{V4L2_PIX_FMT_YUYV, Layout::kLumaFirst, 8},
    PixelFormat{V4L2_PIX_FMT_YVYU, Layout::kLumaFirst, 8},
    PixelFormat{V4L2_PIX_FMT_UYVY, Layout::kLumaSecond, 8},
    PixelFormat{V4L2_PIX_FMT_VYUY, Layout::kLumaSecond, 8},
    PixelFormat{V4L2_PIX_FMT_Y16_BE, Layout::kGrey16BigEnd, 16},
    PixelFormat{V4L2_PIX_FMT_Y10P, Layout::kMipi10, 10},
    PixelFormat{V4L2_PIX_FMT_Y12P, Layout::kMipi12, 12},
    PixelFormat{V4L2_PIX_FMT_Y10BPACK, Layout::kBitPacked10, 10},
    PixelFormat{V4L2_PIX_FMT_BGR24, Layout::kBgr, 8},
    PixelFormat{V4L2_PIX_FMT_RGB24, Layout::kRgb, 8},
    PixelFormat{V4L2_PIX_FMT_XBGR32, Layout::kBgrx, 8},
    PixelFormat{V4L2_PIX_FMT_BGR32, Layout::kBgrx, 8},
    PixelFormat{V4L2_PIX_FMT_ABGR32, Layout::kBgrx, 8},
    PixelFormat{V4L2_PIX_FMT_XRGB32, Layout::kXrgb, 8},
    PixelFormat{V4L2_PIX_FMT_RGB32, Layout::kXrgb, 8},
    PixelFormat{V4L2_PIX_FMT_ARGB32, Layout::kXrgb, 8},
    PixelFormat{V4L2_PIX_FMT_SRGGB8, Layout::kBayer8, 8, cv::COLOR_BayerRGGB2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGRBG8, Layout::kBayer8, 8, cv::COLOR_BayerGRBG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGBRG8, Layout::kBayer8, 8, cv::COLOR_BayerGBRG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SBGGR8, Layout::kBayer8, 8, cv::COLOR_BayerBGGR2GRAY},
    PixelFormat{V4L2_PIX_FMT_SRGGB10, Layout::kBayer16, 10, cv::COLOR_BayerRGGB2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGRBG10, Layout::kBayer16, 10, cv::COLOR_BayerGRBG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGBRG10, Layout::kBayer16, 10, cv::COLOR_BayerGBRG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SBGGR10, Layout::kBayer16, 10, cv::COLOR_BayerBGGR2GRAY},
    PixelFormat{V4L2_PIX_FMT_SRGGB12, Layout::kBayer16, 12, cv::COLOR_BayerRGGB2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGRBG12, Layout::kBayer16, 12, cv::COLOR_BayerGRBG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGBRG12, Layout::kBayer16, 12, cv::COLOR_BayerGBRG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SBGGR12, Layout::kBayer16, 12, cv::COLOR_BayerBGGR2GRAY},
    PixelFormat{V4L2_PIX_FMT_SRGGB16, Layout::kBayer16, 16, cv::COLOR_BayerRGGB2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGRBG16, Layout::kBayer16, 16, cv::COLOR_BayerGRBG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SGBRG16, Layout::kBayer16, 16, cv::COLOR_BayerGBRG2GRAY},
    PixelFormat{V4L2_PIX_FMT_SBGGR16, Layout::kBayer16, 16, cv::COLOR_BayerBGGR2GRAY},
    PixelFormat{V4L2_PIX_FMT_MJPEG, Layout::kJpeg, 8},
    PixelFormat{V4L2_PIX_FMT_JPEG, Layout::kJpeg, 8},
};

template <typename Pixel, typename Unpack>
void unpack_rows(const RawImage& raw, cv::Mat& image, const Unpack& unpack) {
  for (int row = 0; row < raw.height; ++row) {
    const std::uint8_t* const from = raw.data + raw.stride * static_cast<std::size_t>(row);
    Pixel* const to = image.ptr<Pixel>(row);
    for (int column = 0; column < raw.width; ++column) to[column] = unpack(from, column);
  }
}

std::uint16_t mipi10(const std::uint8_t* row, int column) {
  const std::uint8_t* const group = row + 5 * (column / 4);
  const int place = column % 4;
  return static_cast<std::uint16_t>(group[place] << 2 | (group[4] >> (2 * place) & 3));
}

std::uint16_t mipi12(const std::uint8_t* row, int column) {
  const std::uint8_t* const group = row + 3 * (column / 2);
  const int place = column % 2;
  return static_cast<std::uint16_t>(group[place] << 4 | (group[2] >> (4 * place) & 15));
}

std::uint16_t bit_packed10(const std::uint8_t* row, int column) {
  const int bit = 10 * column;
  const std::uint8_t* const at = row + bit / 8;
  const int both = at[0] << 8 | at[1];  // 10 bits never reach into a third byte.
  return static_cast<std::uint16_t>(both >> (6 - bit % 8) & 1023);
}

bool decode(const RawImage& raw, cv::Mat& image) {
  const cv::Size wanted = image.size();
  striper::DecodedImage decoded;
  decoded.image = std::move(image);
  const bool is_whole = detail::decode_jpeg({raw.data, raw.bytes}, decoded).empty();
  image = std::move(decoded.image);
  if (!is_whole || image.size() != wanted) return false;
  if (image.channels() == 1) cv::cvtColor(cv::Mat(image), image, cv::COLOR_GRAY2BGR);
  return true;
}

}  // namespace

int PixelFormat::channels() const noexcept {
  switch (layout) {
    case Layout::kBgr:
    case Layout::kRgb:
    case Layout::kBgrx:
    case Layout::kXrgb:
    case Layout::kJpeg:
      return 3;
    default:
      return 1;
  }
}

int PixelFormat::mat_type() const noexcept {
  return CV_MAKETYPE(bit_depth > 8 ? CV_16U : CV_8U, channels());
}

bool PixelFormat::is_usable_in_place() const noexcept {
  return layout == Layout::kGrey8 || layout == Layout::kGrey16 || layout == Layout::kBgr;
}

std::size_t PixelFormat::row_bytes(int width) const noexcept {
  const auto pixels = static_cast<std::size_t>(width);
  switch (layout) {
    case Layout::kGrey8:
    case Layout::kBayer8:
      return pixels;
    case Layout::kMipi10:
    case Layout::kBitPacked10:
      return (pixels * 10 + 7) / 8;
    case Layout::kMipi12:
      return (pixels * 12 + 7) / 8;
    case Layout::kBgr:
    case Layout::kRgb:
      return pixels * 3;
    case Layout::kBgrx:
    case Layout::kXrgb:
      return pixels * 4;
    case Layout::kJpeg:
      return 0;
    default:
      return pixels * 2;
  }
}

std::span<const PixelFormat> pixel_formats() noexcept { return kPixelFormats; }

const PixelFormat* find_pixel_format(std::uint32_t fourcc) noexcept {
  const auto* const found =
      std::find_if(kPixelFormats.begin(), kPixelFormats.end(),
                   [&](const PixelFormat& format) { return format.fourcc == fourcc; });
  return found == kPixelFormats.end() ? nullptr : found;
}

std::string fourcc_to_string(std::uint32_t fourcc) {
  std::string text;
  for (int byte = 0; byte < 4; ++byte) {
    text += static_cast<char>(fourcc >> (8 * byte) & 0x7F);
  }
  while (text.ends_with(' ')) text.pop_back();
  if ((fourcc & kBigEndFlag) != 0) text += "-BE";
  return text;
}

std::uint32_t fourcc_from_string(std::string_view text) noexcept {
  const bool big_end = text.ends_with("-BE") || text.ends_with("-be");
  if (big_end) text.remove_suffix(3);
  if (text.empty() || text.size() > 4) return 0;
  for (const bool upper : {false, true}) {
    std::uint32_t fourcc = big_end ? kBigEndFlag : 0;
    for (std::size_t byte = 0; byte < 4; ++byte) {
      const auto letter = static_cast<unsigned char>(byte < text.size() ? text[byte] : ' ');
      fourcc |= static_cast<std::uint32_t>(upper ? std::toupper(letter) : letter) << (8 * byte);
    }
    if (upper || find_pixel_format(fourcc) != nullptr) return fourcc;
  }
  return 0;
}

cv::Mat view(const PixelFormat& format, const RawImage& raw) {
  // The pixels of a frame are read-only by contract; cv::Mat has no type for that.
  return {raw.height, raw.width, format.mat_type(), const_cast<std::uint8_t*>(raw.data),
          raw.stride};
}

bool convert(const PixelFormat& format, const RawImage& raw, cv::Mat& image) {
  image.create(raw.height, raw.width, format.mat_type());
  auto* const data = const_cast<std::uint8_t*>(raw.data);
  const auto over = [&](int type) {
    return cv::Mat(raw.height, raw.width, type, data, raw.stride);
  };
  switch (format.layout) {
    case Layout::kGrey8:
    case Layout::kGrey16:
    case Layout::kBgr:
      over(format.mat_type()).copyTo(image);
      return true;
    case Layout::kLumaFirst:
      cv::extractChannel(over(CV_8UC2), image, 0);
      return true;
    case Layout::kLumaSecond:
      cv::extractChannel(over(CV_8UC2), image, 1);
      return true;
    case Layout::kGrey16BigEnd:
      unpack_rows<std::uint16_t>(raw, image, [](const std::uint8_t* row, int column) {
        return static_cast<std::uint16_t>(row[2 * column] << 8 | row[2 * column + 1]);
      });
      return true;
    case Layout::kMipi10:
      unpack_rows<std::uint16_t>(raw, image, mipi10);
      return true;
    case Layout::kMipi12:
      unpack_rows<std::uint16_t>(raw, image, mipi12);
      return true;
    case Layout::kBitPacked10:
      unpack_rows<std::uint16_t>(raw, image, bit_packed10);
      return true;
    case Layout::kRgb:
      cv::cvtColor(over(CV_8UC3), image, cv::COLOR_RGB2BGR);
      return true;
    case Layout::kBgrx:
      cv::cvtColor(over(CV_8UC4), image, cv::COLOR_BGRA2BGR);
      return true;
    case Layout::kXrgb: {
      constexpr std::array<int, 6> kFromTo{3, 0, 2, 1, 1, 2};
      const cv::Mat source = over(CV_8UC4);
      cv::mixChannels(&source, 1, &image, 1, kFromTo.data(), 3);
      return true;
    }
    case Layout::kBayer8:
      cv::cvtColor(over(CV_8UC1), image, format.bayer_code);
      return true;
    case Layout::kBayer16:
      cv::cvtColor(over(CV_16UC1), image, format.bayer_code);
      return true;
    case Layout::kJpeg:
      return decode(raw, image);
  }
  return false;
}

}  // namespace striper::detail::v4l2
