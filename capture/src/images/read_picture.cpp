// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <new>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/images/read_picture.hpp>

#include "images/decode.hpp"

namespace striper {
namespace detail {
namespace {

// Far above any sensor, far below what exhausts a machine.
constexpr std::uint64_t kMaxPixels = 1U << 28;
constexpr std::uint64_t kMaxSide = 1U << 16;

using namespace std::string_view_literals;

struct Format {
  std::string_view magic;
  Fault (*decode)(Bytes, DecodedImage&);
};

constexpr std::array<Format, 9> kFormats{{
    {"\x89PNG\r\n\x1a\n"sv, decode_png},
    {"\xff\xd8\xff"sv, decode_jpeg},
    {"II*\0"sv, decode_tiff},
    {"MM\0*"sv, decode_tiff},
    {"BM"sv, decode_bmp},
    {"P2"sv, decode_pnm},
    {"P3"sv, decode_pnm},
    {"P5"sv, decode_pnm},
    {"P6"sv, decode_pnm},
}};

bool begins_with(Bytes bytes, std::string_view magic) {
  return bytes.size() >= magic.size() &&
         std::equal(magic.begin(), magic.end(), bytes.begin(),
                    [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
}

}  // namespace

Fault check_size(std::uint64_t width, std::uint64_t height) {
  if (width == 0 || height == 0) return fmt::format("claims a size of {}x{}", width, height);
  if (width > kMaxSide || height > kMaxSide || width * height > kMaxPixels) {
    return fmt::format("claims a size of {}x{}, more than {} pixels", width, height, kMaxPixels);
  }
  return {};
}

Fault decode_image(Bytes bytes, DecodedImage& decoded) {
  if (bytes.empty()) return "is empty (0 bytes)";
  const auto format = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& candidate) {
    return begins_with(bytes, candidate.magic);
  });
  if (format == kFormats.end()) return "is no PNG, JPEG, TIFF, BMP, PGM or PPM";
  try {
    return format->decode(bytes, decoded);
  } catch (const std::bad_alloc&) {
    return "does not fit into memory";
  } catch (const cv::Exception& error) {
    return fmt::format("does not decode: {}", error.err);
  }
}

int read_whole_file(const std::filesystem::path& path, std::vector<std::uint8_t>& bytes) {
  // Not to hang on a pipe, nor to read a directory: only regular files have images.
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return errno;
  struct stat status {};
  int failure = ::fstat(file, &status) == 0 ? 0 : errno;
  if (failure == 0 && !S_ISREG(status.st_mode)) failure = S_ISDIR(status.st_mode) ? EISDIR : EINVAL;
  if (failure == 0) {
    bytes.resize(static_cast<std::size_t>(status.st_size));
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t got = ::read(file, bytes.data() + done, bytes.size() - done);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) failure = errno;
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
  }
  ::close(file);
  return failure;
}

}  // namespace detail

DecodedImage read_image(const std::filesystem::path& path) {
  std::vector<std::uint8_t> bytes;
  if (const int failure = detail::read_whole_file(path, bytes); failure != 0) {
    throw Error(failure == ENOENT ? ErrorKind::kNotFound : ErrorKind::kIo,
                fmt::format("image file '{}': {}", path.string(),
                            std::generic_category().message(failure)));
  }
  DecodedImage decoded;
  if (const detail::Fault fault = detail::decode_image(bytes, decoded); !fault.empty()) {
    throw Error(ErrorKind::kBadFile, fmt::format("image file '{}' {}", path.string(), fault));
  }
  return decoded;
}

}  // namespace striper
