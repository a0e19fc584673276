// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <striper/images/read_picture.hpp>

namespace striper::detail {

/// What is wrong with an image, as the end of a sentence about it; empty when nothing is.
using Fault = std::string;
using Bytes = std::span<const std::uint8_t>;

/// Decodes an image of any known format; `decoded.image` keeps its memory where size and type fit.
/// Whatever does not decode to its end is a fault: these functions neither throw nor print.
Fault decode_image(Bytes bytes, DecodedImage& decoded);

Fault decode_png(Bytes bytes, DecodedImage& decoded);
Fault decode_jpeg(Bytes bytes, DecodedImage& decoded);
Fault decode_tiff(Bytes bytes, DecodedImage& decoded);
Fault decode_bmp(Bytes bytes, DecodedImage& decoded);
Fault decode_pnm(Bytes bytes, DecodedImage& decoded);

/// Refuses a size that a damaged header made up, before memory is taken for it.
Fault check_size(std::uint64_t width, std::uint64_t height);

/// Reads a whole file into `bytes`, whose memory is reused.
/// @return 0, or the system's error number.
int read_whole_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes);

}  // namespace striper::detail
