// SPDX-License-Identifier: Apache-2.0
// PNG through libpng itself, not cv::imread: that prints to the standard error stream.
#include <csetjmp>
#include <cstring>

#include <fmt/format.h>
#include <png.h>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

// libpng leaves its functions by longjmp, which skips destructors: between a setjmp and the calls
// that it guards there are only plain values.
class PngReader {
 public:
  explicit PngReader(Bytes bytes) : rest_(bytes) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
  }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }

  bool read_header() {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT: libpng's way to report an error.
    png_set_read_fn(png_, this, on_read);
    png_read_info(png_, info_);
    reduce_to_grey_or_bgr();
    passes_ = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  bool read_rows(cv::Mat& image) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT: as above.
    for (int pass = 0; pass < passes_; ++pass) {
      for (int row = 0; row < image.rows; ++row) png_read_row(png_, image.ptr(row), nullptr);
    }
    png_read_end(png_, nullptr);
    return true;
  }

  std::uint32_t width() const { return png_get_image_width(png_, info_); }
  std::uint32_t height() const { return png_get_image_height(png_, info_); }
  int channels() const { return png_get_channels(png_, info_); }
  int bits() const { return png_get_bit_depth(png_, info_); }
  const char* message() const { return message_; }

 private:
  void reduce_to_grey_or_bgr() {
    const int colour = png_get_color_type(png_, info_);
    if (colour == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png_);
    if (colour == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png_);
    png_set_strip_alpha(png_);
    png_set_bgr(png_);
    if (png_get_bit_depth(png_, info_) == 16) png_set_swap(png_);
  }

  static void on_read(png_structp png, png_bytep into, std::size_t count) {
    auto* self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (count > self->rest_.size()) png_error(png, "the file ends too early");
    std::memcpy(into, self->rest_.data(), count);
    self->rest_ = self->rest_.subspan(count);
  }

  [[noreturn]] static void on_error(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngReader*>(png_get_error_ptr(png));
    std::strncpy(self->message_, message, sizeof(self->message_) - 1);
    png_longjmp(png, 1);
  }

  // Warnings are about colour profiles and the like; damaged pixel data is an error.
  static void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

  Bytes rest_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  int passes_ = 1;
  char message_[128] = {};
};

}  // namespace

Fault decode_png(Bytes bytes, DecodedImage& decoded) {
  PngReader reader(bytes);
  if (!reader.read_header()) return fmt::format("is a damaged PNG: {}", reader.message());
  if (Fault fault = check_size(reader.width(), reader.height()); !fault.empty()) return fault;

  const int depth = reader.bits() == 16 ? CV_16U : CV_8U;
  decoded.image.create(static_cast<int>(reader.height()), static_cast<int>(reader.width()),
                       CV_MAKETYPE(depth, reader.channels()));
  decoded.bit_depth = depth == CV_16U ? 16 : 8;
  if (!reader.read_rows(decoded.image)) {
    return fmt::format("is a damaged or truncated PNG: {}", reader.message());
  }
  return {};
}

}  // namespace striper::detail
