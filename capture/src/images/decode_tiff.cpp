// SPDX-License-Identifier: Apache-2.0
// TIFF through libtiff itself, not cv::imread: its 8-bit path fills what cannot be read with zeros.
#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <tiffio.h>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

// The file in memory, as libtiff reads it, and the first error that it reports.
struct TiffFile {
  Bytes bytes;
  std::uint64_t position = 0;
  char message[256] = {};
};

TiffFile& file_of(thandle_t handle) { return *static_cast<TiffFile*>(handle); }

tmsize_t read_bytes(thandle_t handle, void* into, tmsize_t count) {
  TiffFile& file = file_of(handle);
  const std::uint64_t begin = std::min<std::uint64_t>(file.position, file.bytes.size());
  const std::uint64_t got =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(count), file.bytes.size() - begin);
  std::memcpy(into, file.bytes.data() + begin, got);
  file.position = begin + got;
  return static_cast<tmsize_t>(got);
}

tmsize_t refuse_to_write(thandle_t /*handle*/, void* /*from*/, tmsize_t /*count*/) { return 0; }

toff_t seek(thandle_t handle, toff_t offset, int from) {
  TiffFile& file = file_of(handle);
  if (from == SEEK_CUR) offset += file.position;
  if (from == SEEK_END) offset += file.bytes.size();
  return file.position = offset;
}

int close_nothing(thandle_t /*handle*/) { return 0; }
toff_t size_of(thandle_t handle) { return file_of(handle).bytes.size(); }

int keep_first_error(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format,
                     va_list arguments) {
  auto& file = *static_cast<TiffFile*>(user);
  if (file.message[0] == '\0') {
    std::vsnprintf(file.message, sizeof(file.message), format, arguments);
  }
  return 1;  // Handled: the process-wide handler, which prints, is not called.
}

// Warnings are about unknown tags and the like.
int ignore_warning(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/,
                   va_list /*arguments*/) {
  return 1;
}

using TiffHandle = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

TiffHandle open_tiff(TiffFile& file) {
  TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
  TIFFOpenOptionsSetErrorHandlerExtR(options, keep_first_error, &file);
  TIFFOpenOptionsSetWarningHandlerExtR(options, ignore_warning, &file);
  // "m": no memory mapping, so that every access goes through read_bytes and its bounds.
  TIFF* tiff = TIFFClientOpenExt("image", "rm", &file, read_bytes, refuse_to_write, seek,
                                 close_nothing, size_of, nullptr, nullptr, options);
  TIFFOpenOptionsFree(options);
  return {tiff, &TIFFClose};
}

struct Layout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 1;
  std::uint16_t samples = 1;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  std::uint16_t planar = PLANARCONFIG_CONTIG;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  bool is_tiled = false;
};

Layout layout_of(TIFF* tiff) {
  Layout layout;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &layout.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &layout.height);
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &layout.photometric);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &layout.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &layout.samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_PLANARCONFIG, &layout.planar);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &layout.format);
  layout.is_tiled = TIFFIsTiled(tiff) != 0;
  return layout;
}

// Rows as they are stored: lossless for 8 and 16 bits.
bool can_read_rows(const Layout& layout) {
  const bool is_grey =
      layout.photometric == PHOTOMETRIC_MINISBLACK || layout.photometric == PHOTOMETRIC_MINISWHITE;
  const bool is_rgb = layout.photometric == PHOTOMETRIC_RGB && layout.samples >= 3;
  return (is_grey || is_rgb) && !layout.is_tiled && (layout.bits == 8 || layout.bits == 16) &&
         layout.format == SAMPLEFORMAT_UINT &&
         (layout.planar == PLANARCONFIG_CONTIG || layout.samples == 1);
}

bool read_rows(TIFF* tiff, const Layout& layout, cv::Mat& image) {
  const int depth = layout.bits == 16 ? CV_16U : CV_8U;
  const int channels = layout.photometric == PHOTOMETRIC_RGB ? 3 : 1;
  const int stored = static_cast<int>(layout.samples);
  const cv::Size size(static_cast<int>(layout.width), static_cast<int>(layout.height));
  image.create(size, CV_MAKETYPE(depth, channels));
  cv::Mat row(1, size.width, CV_MAKETYPE(depth, stored));
  if (TIFFScanlineSize64(tiff) > row.total() * row.elemSize()) return false;

  const int bgr_of_rgb[] = {0, 2, 1, 1, 2, 0};
  const int grey_only[] = {0, 0};
  for (int v = 0; v < size.height; ++v) {
    if (TIFFReadScanline(tiff, row.data, static_cast<std::uint32_t>(v), 0) != 1) return false;
    cv::Mat target = image.row(v);
    cv::mixChannels(&row, 1, &target, 1, channels == 3 ? bgr_of_rgb : grey_only,
                    static_cast<std::size_t>(channels));
  }
  if (layout.photometric == PHOTOMETRIC_MINISWHITE) cv::bitwise_not(image, image);
  return true;
}

// Tiles, palettes, bilevel and YCbCr: libtiff's own conversion to 8-bit colour.
bool read_as_rgba(TIFF* tiff, const Layout& layout, cv::Mat& image) {
  constexpr int kStopOnError = 1;
  cv::Mat rgba(static_cast<int>(layout.height), static_cast<int>(layout.width), CV_8UC4);
  if (TIFFReadRGBAImageOriented(tiff, layout.width, layout.height, rgba.ptr<std::uint32_t>(),
                                ORIENTATION_TOPLEFT, kStopOnError) != 1) {
    return false;
  }
  const bool is_grey =
      layout.photometric == PHOTOMETRIC_MINISBLACK || layout.photometric == PHOTOMETRIC_MINISWHITE;
  if (is_grey) {
    cv::extractChannel(rgba, image, 0);
  } else {
    const int bgr_of_rgba[] = {0, 2, 1, 1, 2, 0};
    image.create(rgba.size(), CV_8UC3);
    cv::mixChannels(&rgba, 1, &image, 1, bgr_of_rgba, 3);
  }
  return true;
}

}  // namespace

Fault decode_tiff(Bytes bytes, DecodedImage& decoded) {
  TiffFile file{bytes};
  const TiffHandle tiff = open_tiff(file);
  if (tiff == nullptr) return fmt::format("is a damaged or truncated TIFF: {}", file.message);
  const Layout layout = layout_of(tiff.get());
  if (Fault fault = check_size(layout.width, layout.height); !fault.empty()) return fault;

  const bool by_rows = can_read_rows(layout);
  if (!by_rows && layout.bits > 8) {
    return fmt::format(
        "is a TIFF of {} bits in a layout that is not supported (tiles, planes or "
        "numbers that are not unsigned); write it as strips",
        layout.bits);
  }
  const bool is_whole = by_rows ? read_rows(tiff.get(), layout, decoded.image)
                                : read_as_rgba(tiff.get(), layout, decoded.image);
  if (!is_whole || file.message[0] != '\0') {
    return fmt::format("is a damaged or truncated TIFF: {}", file.message);
  }
  decoded.bit_depth = layout.bits == 16 ? 16 : 8;
  return {};
}

}  // namespace striper::detail
