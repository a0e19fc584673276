// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "wire/mcap_bytes.hpp"

namespace striper::wire {

/// A file that grows by whole pieces only.
class AppendedFile {
 public:
  /// @throws Error{kIo}.
  explicit AppendedFile(const std::filesystem::path& path);
  AppendedFile(const AppendedFile&) = delete;
  AppendedFile& operator=(const AppendedFile&) = delete;
  ~AppendedFile();

  /// All of the bytes or none: cut back where they do not fit. @throws Error{kIo}.
  void append(ByteSpan bytes);
  /// @throws Error{kIo}.
  void close();

  std::uint64_t size() const noexcept { return size_; }
  /// Of all bytes so far.
  std::uint32_t crc() const noexcept { return crc_; }
  const std::string& path() const noexcept { return path_; }
  bool is_open() const noexcept { return file_ >= 0; }

 private:
  std::string path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::uint32_t crc_ = 0;
};

/// A file that is read here and there.
class ReadFile {
 public:
  /// @throws Error{kNotFound, kIo, kBadFile (no regular file)}.
  explicit ReadFile(const std::filesystem::path& path);
  ReadFile(const ReadFile&) = delete;
  ReadFile& operator=(const ReadFile&) = delete;
  ~ReadFile();

  /// Fills `out`, which must lie within the file. @throws Error{kIo}.
  void read(std::uint64_t offset, std::span<std::uint8_t> out);

  std::uint64_t size() const noexcept { return size_; }
  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace striper::wire
