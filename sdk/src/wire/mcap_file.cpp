// SPDX-License-Identifier: Apache-2.0
#include "wire/mcap_file.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <striper/core/error.hpp>

namespace striper::wire {
namespace {

[[noreturn]] void refuse(const std::string& path, const char* what, int reason) {
  throw Error(reason == ENOENT ? ErrorKind::kNotFound : ErrorKind::kIo,
              fmt::format("{}: {}: {}", path, what, std::strerror(reason)));
}

}  // namespace

void CountedFile::append(ByteSpan bytes) {
  file_.append({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  size_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
}

ReadFile::ReadFile(const std::filesystem::path& path) : path_(path.string()) {
  file_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_ < 0) refuse(path_, "cannot be read", errno);
  struct stat status {};
  if (::fstat(file_, &status) != 0 || !S_ISREG(status.st_mode)) {
    ::close(file_);
    throw Error(ErrorKind::kBadFile,
                fmt::format("{}: is no regular file; an MCAP file expected", path_));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

ReadFile::~ReadFile() { ::close(file_); }

void ReadFile::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  while (!out.empty()) {
    const ssize_t count = ::pread(file_, out.data(), out.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse(path_, "cannot be read", errno);
    if (count == 0)
      throw Error(ErrorKind::kIo, fmt::format("{}: became shorter while it was read", path_));
    out = out.subspan(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

}  // namespace striper::wire
