// SPDX-License-Identifier: Apache-2.0
// Whatever bytes an MCAP file has, McapReader gives its messages or throws Error{kBadFile} or
// {kUnsupported}. Seeds: a small file of each compression, and one without chunks; in half of them
// checksums are 0, so that damage is not noticed by them.
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_reader.hpp>

namespace {

// A file in memory, named by its descriptor.
std::string file_of(const std::uint8_t* data, std::size_t size) {
  static const int file = ::memfd_create("fuzz.mcap", 0);
  if (::ftruncate(file, 0) != 0) std::abort();
  if (::pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
  return "/proc/self/fd/" + std::to_string(file);
}

void read_all(const std::string& path, bool skip_damaged) {
  striper::wire::McapReader reader(path,
                                   {.max_chunk_bytes = 1 << 20, .skip_damaged = skip_damaged});
  for (std::size_t i = 0; i < reader.attachments().size() && !skip_damaged; ++i)
    reader.read_attachment(i);
  std::uint64_t bytes = 0;
  for (striper::wire::McapMessage message; reader.next(message);) {
    for (const std::uint8_t byte : message.data) bytes += byte;
    if (!reader.channels().contains(message.channel)) std::abort();
  }
  if (reader.end() == striper::wire::McapEnd::kUnread) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = file_of(data, size);
  for (const bool skip_damaged : {false, true}) {
    try {
      read_all(path, skip_damaged);
    } catch (const striper::Error& error) {
      const bool is_refusal = error.kind() == striper::ErrorKind::kBadFile ||
                              error.kind() == striper::ErrorKind::kUnsupported;
      if (!is_refusal) std::abort();
    }
  }
  return 0;
}
