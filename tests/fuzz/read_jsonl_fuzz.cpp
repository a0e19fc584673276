// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a file of scans as JSON lines has, it gives scans or Error{kBadFile}. Seeds:
// jsonl_seeds.
#include <cstdint>
#include <cstdlib>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include <striper/core/error.hpp>
#include <striper/stream/scan_files.hpp>

namespace {

// A file in memory, named by its descriptor.
std::string file_of(const std::uint8_t* data, std::size_t size) {
  static const int file = ::memfd_create("fuzz.jsonl", 0);
  if (::ftruncate(file, 0) != 0) std::abort();
  if (::pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
  return "/proc/self/fd/" + std::to_string(file);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto scans = striper::read_jsonl_scans(file_of(data, size));
    for (striper::PolarScan scan; scans->next(scan, {}) == striper::NextStatus::kFrame;) {
      if (!scan.frame) std::abort();
    }
  } catch (const striper::Error& error) {
    if (error.kind() != striper::ErrorKind::kBadFile) std::abort();
  }
  return 0;
}
