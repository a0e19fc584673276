// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace striper {

/// Lists the image files that `pattern` names, in natural order.
///
/// `pattern` is a directory (its image files by extension: png, jpg, jpeg, tif, tiff, bmp, pgm,
/// ppm, pnm; not those of its sub-directories), a pattern with `*`, `?` or `[...]` (files of other
/// extensions only where no image file matches), or one file. What exists under exactly this name
/// wins over what it means as a pattern.
/// @throws Error{kNotFound} where there is no such thing or no image file in it, Error{kIo} where
///         the directory cannot be read.
std::vector<std::filesystem::path> image_files(const std::string& pattern);

/// Orders names as people count: runs of digits by their value, so that `img9` comes before
/// `img10`. A strict weak order; equal values with more leading zeros come later.
bool natural_less(std::string_view a, std::string_view b) noexcept;

}  // namespace striper
