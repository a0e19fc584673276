// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <striper/core/append_file.hpp>

#include "wire/mcap_bytes.hpp"

namespace striper::wire {

/// A file that grows by whole pieces, and knows its length and checksum.
class CountedFile {
 public:
  /// @throws Error{kIo}.
  explicit CountedFile(const std::filesystem::path& path) : file_(path.string()) {}

  /// All of the bytes or none. @throws Error{kIo}.
  void append(ByteSpan bytes);
  /// @throws Error{kIo}.
  void close() { file_.close(); }

  std::uint64_t size() const noexcept { return size_; }
  /// Of all bytes so far.
  std::uint32_t crc() const noexcept { return crc_; }
  const std::string& path() const noexcept { return file_.path(); }
  bool is_open() const noexcept { return file_.is_open(); }

 private:
  AppendFile file_;
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
