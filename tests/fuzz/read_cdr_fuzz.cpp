// SPDX-License-Identifier: Apache-2.0
// Whatever bytes a message has, read_cdr gives a message that is written and read back to the same
// bytes, or throws Error{kBadFile} or {kUnsupported}. The first byte says which type. Seeds: a
// message of each type.
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include <striper/core/error.hpp>
#include <striper/wire/cdr.hpp>

namespace {

using Bytes = std::span<const std::uint8_t>;

template <typename M>
void read(Bytes bytes) {
  M message;
  striper::wire::read_cdr(bytes, message);
  std::vector<std::uint8_t> written;
  std::vector<std::uint8_t> again;
  striper::wire::write_cdr(message, written);
  striper::wire::read_cdr(Bytes(written), message);
  striper::wire::write_cdr(message, again);
  if (written != again) std::abort();
}

using namespace striper::wire;
constexpr void (*kReaders[])(Bytes) = {
    read<PointCloud2>,     read<LaserScan>, read<Image>,     read<CompressedImage>,
    read<CameraInfo>,      read<TFMessage>, read<PolarScan>, read<FrameInfo>,
    read<DiagnosticArray>, read<Odometer>,  read<Event>};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    kReaders[data[0] % std::size(kReaders)](Bytes(data + 1, size - 1));
  } catch (const striper::Error& error) {
    const bool is_refusal = error.kind() == striper::ErrorKind::kBadFile ||
                            error.kind() == striper::ErrorKind::kUnsupported;
    if (!is_refusal) std::abort();
  }
  return 0;
}
