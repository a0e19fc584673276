// SPDX-License-Identifier: Apache-2.0
// PGM and PPM, by hand: cv::imread prints to the standard error stream when one is truncated, and
// forgets the maximum, which says how many bits are significant.
#include <algorithm>
#include <bit>
#include <cctype>
#include <optional>

#include <fmt/format.h>

#include "images/decode.hpp"

namespace striper::detail {
namespace {

// Reads numbers as text, with blanks and comments between them.
class PnmText {
 public:
  explicit PnmText(Bytes bytes) : bytes_(bytes) {}

  // Empty where there is none, or where the file ends so that more digits may be missing.
  std::optional<std::uint32_t> number() {
    skip_blanks();
    constexpr std::size_t kMaxDigits = 9;
    const std::size_t begin = at_;
    std::uint32_t value = 0;
    while (is_digit() && at_ - begin < kMaxDigits) value = 10 * value + (bytes_[at_++] - '0');
    const bool is_whole = at_ > begin && at_ < bytes_.size() && !is_digit();
    return is_whole ? std::optional(value) : std::nullopt;
  }

  // The binary pixels begin after exactly one blank.
  Bytes pixels() const { return bytes_.subspan(std::min(at_ + 1, bytes_.size())); }

 private:
  bool is_digit() const { return at_ < bytes_.size() && std::isdigit(bytes_[at_]) != 0; }

  void skip_blanks() {
    bool in_comment = false;
    for (; at_ < bytes_.size(); ++at_) {
      if (bytes_[at_] == '#') in_comment = true;
      if (bytes_[at_] == '\n') in_comment = false;
      if (!in_comment && std::isspace(bytes_[at_]) == 0) return;
    }
  }

  Bytes bytes_;
  std::size_t at_ = 2;  // After the magic number.
};

// Stores sample number `i` of a row; a pixel is R, G, B in the file and B, G, R in memory.
void store(cv::Mat& image, int row, int i, std::uint32_t value) {
  const int channels = image.channels();
  const int at = channels == 1 ? i : i / 3 * 3 + (2 - i % 3);
  if (image.depth() == CV_16U) {
    image.ptr<std::uint16_t>(row)[at] = static_cast<std::uint16_t>(value);
  } else {
    image.ptr<std::uint8_t>(row)[at] = static_cast<std::uint8_t>(value);
  }
}

Fault read_binary(Bytes pixels, cv::Mat& image) {
  const std::size_t needed = image.total() * image.elemSize();
  if (pixels.size() < needed) {
    return fmt::format("is a truncated PGM or PPM: {} bytes of pixels of {}", pixels.size(),
                       needed);
  }
  const int samples = image.cols * image.channels();
  const bool is_wide = image.depth() == CV_16U;  // Big-endian in the file.
  std::size_t at = 0;
  for (int row = 0; row < image.rows; ++row) {
    for (int i = 0; i < samples; ++i) {
      std::uint32_t value = pixels[at++];
      if (is_wide) value = value << 8U | pixels[at++];
      store(image, row, i, value);
    }
  }
  return {};
}

Fault read_text(PnmText& text, std::uint32_t maximum, cv::Mat& image) {
  for (int row = 0; row < image.rows; ++row) {
    for (int i = 0; i < image.cols * image.channels(); ++i) {
      const auto value = text.number();
      if (!value) return fmt::format("is a damaged or truncated PGM or PPM: row {}", row);
      if (*value > maximum) {
        return fmt::format("is a damaged PGM or PPM: {} above its maximum {}", *value, maximum);
      }
      store(image, row, i, *value);
    }
  }
  return {};
}

}  // namespace

Fault decode_pnm(Bytes bytes, DecodedImage& decoded) {
  const std::uint8_t kind = bytes[1];
  const bool is_colour = kind == '3' || kind == '6';
  const bool is_text = kind == '2' || kind == '3';
  PnmText text(bytes);
  const auto width = text.number();
  const auto height = text.number();
  const auto maximum = text.number();
  if (!width || !height || !maximum || *maximum == 0 || *maximum > 65535) {
    return "is a damaged or truncated PGM or PPM: no size and maximum";
  }
  if (Fault fault = check_size(*width, *height); !fault.empty()) return fault;
  const std::size_t samples = std::size_t{*width} * *height * (is_colour ? 3 : 1);
  if (text.pixels().size() < samples) {  // Each takes a byte at least: before memory is taken.
    return fmt::format("is a truncated PGM or PPM: {} bytes for {} samples", text.pixels().size(),
                       samples);
  }

  decoded.bit_depth = std::max(8, static_cast<int>(std::bit_width(*maximum)));
  decoded.image.create(static_cast<int>(*height), static_cast<int>(*width),
                       CV_MAKETYPE(decoded.bit_depth > 8 ? CV_16U : CV_8U, is_colour ? 3 : 1));
  return is_text ? read_text(text, *maximum, decoded.image)
                 : read_binary(text.pixels(), decoded.image);
}

}  // namespace striper::detail
