// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <system_error>

#include <fmt/format.h>
#include <glob.h>

#include <striper/core/error.hpp>
#include <striper/images/picture_files.hpp>

namespace striper {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 9> kExtensions{".png", ".jpg", ".jpeg", ".tif", ".tiff",
                                                      ".bmp", ".pgm", ".ppm",  ".pnm"};

bool is_image_name(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

[[noreturn]] void refuse(ErrorKind kind, const std::string& pattern, const std::string& reason) {
  throw Error(kind, fmt::format("image files '{}': {}", pattern, reason));
}

std::vector<fs::path> files_of_directory(const std::string& directory) {
  std::error_code failure;
  std::vector<fs::path> files;
  auto entry = fs::directory_iterator(directory, failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure)) {
    if (is_image_name(entry->path()) && !fs::is_directory(entry->path())) {
      files.push_back(entry->path());
    }
  }
  if (failure) refuse(ErrorKind::kIo, directory, failure.message());
  if (files.empty()) {
    refuse(ErrorKind::kNotFound, directory,
           "the directory holds no image files (png, jpg, tif, bmp, pgm, ppm)");
  }
  return files;
}

std::vector<fs::path> files_of_pattern(const std::string& pattern) {
  glob_t found{};
  const int result = ::glob(pattern.c_str(), GLOB_NOSORT | GLOB_TILDE, nullptr, &found);
  std::vector<fs::path> files;
  for (std::size_t i = 0; result == 0 && i < found.gl_pathc; ++i) {
    std::error_code ignored;
    if (!fs::is_directory(found.gl_pathv[i], ignored)) files.emplace_back(found.gl_pathv[i]);
  }
  ::globfree(&found);
  // `shots/*` also matches what lies beside the image files: a recording's frames.csv, notes.
  if (std::any_of(files.begin(), files.end(), is_image_name)) {
    std::erase_if(files, [](const fs::path& file) { return !is_image_name(file); });
  }
  if (result == GLOB_NOSPACE) refuse(ErrorKind::kIo, pattern, "out of memory");
  if (files.empty()) {
    const bool is_pattern = pattern.find_first_of("*?[") != std::string::npos;
    refuse(ErrorKind::kNotFound, pattern,
           is_pattern ? "no file matches the pattern" : "no such file or directory");
  }
  return files;
}

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string_view take_digits(std::string_view& text) {
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  const auto count = static_cast<std::size_t>(end - text.begin());
  const std::string_view digits = text.substr(0, count);
  text.remove_prefix(count);
  return digits;
}

std::string_view without_leading_zeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) noexcept {
  const std::string_view whole_a = a;
  const std::string_view whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view value_a = without_leading_zeros(take_digits(a));
      const std::string_view value_b = without_leading_zeros(take_digits(b));
      if (value_a.size() != value_b.size()) return value_a.size() < value_b.size();
      if (value_a != value_b) return value_a < value_b;
      continue;
    }
    if (a.front() != b.front()) {
      return static_cast<unsigned char>(a.front()) < static_cast<unsigned char>(b.front());
    }
    a.remove_prefix(1);
    b.remove_prefix(1);
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a.size() != whole_b.size() ? whole_a.size() < whole_b.size() : whole_a < whole_b;
}

std::vector<fs::path> image_files(const std::string& pattern) {
  if (pattern.empty()) refuse(ErrorKind::kUsage, pattern, "name a directory, a file or a pattern");
  std::error_code failure;
  const fs::file_status status = fs::status(pattern, failure);
  if (failure && status.type() == fs::file_type::none) {
    refuse(ErrorKind::kIo, pattern, failure.message());
  }
  if (fs::exists(status) && !fs::is_directory(status)) return {pattern};
  std::vector<fs::path> files =
      fs::is_directory(status) ? files_of_directory(pattern) : files_of_pattern(pattern);
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.native(), b.native());
  });
  return files;
}

}  // namespace striper
