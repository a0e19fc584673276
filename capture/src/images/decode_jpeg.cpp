// SPDX-License-Identifier: Apache-2.0
// JPEG through libjpeg itself, because of its warnings: a truncated JPEG is completed with grey,
// and a warning is all that tells.
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>
// After <cstdio>: the header needs FILE and size_t.
#include <jpeglib.h>
// After <jpeglib.h>.
#include <jerror.h>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

// libjpeg's errors leave by longjmp, which skips destructors: between a setjmp and the calls that
// it guards there are only plain values.
class JpegReader {
 public:
  explicit JpegReader(Bytes bytes) {
    jpeg_.err = jpeg_std_error(&errors_.base);
    errors_.base.error_exit = on_error;
    errors_.base.emit_message = on_message;
    errors_.base.output_message = [](j_common_ptr) {};
    if (setjmp(errors_.escape) != 0) return;  // NOLINT: libjpeg's way to report an error.
    jpeg_create_decompress(&jpeg_);
    jpeg_mem_src(&jpeg_, bytes.data(), bytes.size());
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }

  bool read_header() {
    if (is_damaged()) return false;
    if (setjmp(errors_.escape) != 0) return false;  // NOLINT: as above.
    jpeg_read_header(&jpeg_, TRUE);
    jpeg_.out_color_space = jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
    return !is_damaged();
  }

  bool read_rows(cv::Mat& image) {
    if (setjmp(errors_.escape) != 0) return false;  // NOLINT: as above.
    jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height && !is_damaged()) {
      JSAMPROW row = image.ptr(static_cast<int>(jpeg_.output_scanline));
      jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    // Reads on to the end marker, without which the file is not whole.
    if (!is_damaged()) jpeg_finish_decompress(&jpeg_);
    return !is_damaged();
  }

  std::uint32_t width() const { return jpeg_.image_width; }
  std::uint32_t height() const { return jpeg_.image_height; }
  int components() const { return jpeg_.num_components; }
  const char* message() const { return errors_.message; }

 private:
  struct Errors {
    jpeg_error_mgr base;  // First: libjpeg's pointer to it is a pointer to this.
    std::jmp_buf escape;
    char message[JMSG_LENGTH_MAX];
  };

  bool is_damaged() const { return errors_.message[0] != '\0'; }

  static Errors& errors_of(j_common_ptr jpeg) { return *reinterpret_cast<Errors*>(jpeg->err); }

  [[noreturn]] static void on_error(j_common_ptr jpeg) {
    (*jpeg->err->format_message)(jpeg, errors_of(jpeg).message);
    std::longjmp(errors_of(jpeg).escape, 1);  // NOLINT: as above.
  }

  static void on_message(j_common_ptr jpeg, int level) {
    constexpr int kWarning = -1;  // Levels from 0 up are traces.
    const int code = jpeg->err->msg_code;
    const bool is_harmless = code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR;
    if (level != kWarning || is_harmless) return;
    char* const message = errors_of(jpeg).message;
    if (message[0] == '\0') (*jpeg->err->format_message)(jpeg, message);
  }

  jpeg_decompress_struct jpeg_{};
  Errors errors_{};
};

}  // namespace

Fault decode_jpeg(Bytes bytes, DecodedImage& decoded) {
  JpegReader reader(bytes);
  if (!reader.read_header()) {
    return fmt::format("is a damaged or truncated JPEG: {}", reader.message());
  }
  if (Fault fault = check_size(reader.width(), reader.height()); !fault.empty()) return fault;
  if (reader.components() != 1 && reader.components() != 3) {
    return fmt::format("is a JPEG of {} colour components; 1 or 3 are supported",
                       reader.components());
  }

  decoded.image.create(static_cast<int>(reader.height()), static_cast<int>(reader.width()),
                       CV_8UC(reader.components()));
  decoded.bit_depth = 8;
  if (!reader.read_rows(decoded.image)) {
    return fmt::format("is a damaged or truncated JPEG: {}", reader.message());
  }
  return {};
}

}  // namespace striper::detail
