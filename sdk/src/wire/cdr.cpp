// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/cdr.hpp>

#include "wire/cdr_stream.hpp"
#include "wire/schema.hpp"

namespace striper::wire {

CdrReader::CdrReader(std::span<const std::uint8_t> bytes, std::string_view type)
    : bytes_(bytes), type_(type), field_("encapsulation") {
  if (bytes.size() < kEncapsulationBytes) {
    at_ = 0;
    refuse(fmt::format("{} bytes, at least {} expected", bytes.size(), kEncapsulationBytes));
  }
  if (bytes[0] != 0 || bytes[1] > 1) {
    throw Error(
        ErrorKind::kUnsupported,
        fmt::format("{}: encapsulation {:02x} {:02x}; only plain CDR, 00 00 and 00 01, is read",
                    type, bytes[0], bytes[1]));
  }
  is_swapped_ = bytes[1] == 0;
}

void CdrReader::refuse(const std::string& what) const {
  throw Error(ErrorKind::kBadFile, fmt::format("{}.{} at byte {}: {}", type_, field_, at_, what));
}

const std::uint8_t* CdrReader::take(std::size_t size, std::size_t count) {
  const std::size_t position = at_ - kEncapsulationBytes;
  const std::size_t padding = (size - position % size) % size;
  const std::size_t left = bytes_.size() - at_;
  if (padding > left || count > (left - padding) / size) {
    refuse(fmt::format("{} bytes expected, {} are left", padding + count * size, left));
  }
  const std::uint8_t* taken = bytes_.data() + at_ + padding;
  at_ += padding + count * size;
  return taken;
}

std::size_t CdrReader::get_count(std::size_t size) {
  std::uint32_t count = 0;
  get(count);
  const std::size_t left = bytes_.size() - at_;
  if (count > left / size) {
    refuse(fmt::format("{} elements expected, {} bytes are left", count, left));
  }
  return count;
}

void CdrReader::get(bool& value) {
  const std::uint8_t byte = *take(1, 1);
  if (byte > 1) refuse(fmt::format("{} where 0 or 1 is expected", byte));
  value = byte == 1;
}

void CdrReader::get(std::string& text) {
  const std::size_t size = get_count(1);
  text.clear();
  if (size == 0) return;  // Some writers leave an empty string's final zero away.
  const auto* bytes = reinterpret_cast<const char*>(take(1, size));
  if (bytes[size - 1] != '\0') refuse("the text does not end with a zero");
  text.assign(bytes, size - 1);
}

void CdrReader::require_end() const {
  const std::size_t left = bytes_.size() - at_;
  if (left > 3) refuse(fmt::format("{} bytes behind the last field", left));
}

template <typename M>
const MessageSchema& schema_of() {
  static const MessageSchema schema = [] {
    UsedMessages used;
    const MessageText text = message_text<M>(used);
    return make_schema(text, used);
  }();
  return schema;
}

template <typename M>
void write_cdr(const M& message, std::vector<std::uint8_t>& out) {
  CdrWriter(out).put(message);
}

template <typename M>
void read_cdr(std::span<const std::uint8_t> bytes, M& message) {
  CdrReader reader(bytes, Description<M>::kType);
  reader.get(message);
  reader.require_end();
}

using NodesOfHumble = ParticipantEntitiesInfo<kGidBytesOfHumble>;
using NodesOfIron = ParticipantEntitiesInfo<kGidBytesOfIron>;

// NOLINTBEGIN(bugprone-macro-parentheses): a type in parentheses is none.
#define STRIPER_INSTANTIATE(M)                                      \
  template const MessageSchema& schema_of<M>();                     \
  template void write_cdr<M>(const M&, std::vector<std::uint8_t>&); \
  template void read_cdr<M>(std::span<const std::uint8_t>, M&);
// NOLINTEND(bugprone-macro-parentheses)

STRIPER_INSTANTIATE(Header)
STRIPER_INSTANTIATE(PointField)
STRIPER_INSTANTIATE(PointCloud2)
STRIPER_INSTANTIATE(LaserScan)
STRIPER_INSTANTIATE(Image)
STRIPER_INSTANTIATE(CompressedImage)
STRIPER_INSTANTIATE(CameraInfo)
STRIPER_INSTANTIATE(TFMessage)
STRIPER_INSTANTIATE(DiagnosticArray)
STRIPER_INSTANTIATE(NodesOfHumble)
STRIPER_INSTANTIATE(NodesOfIron)
STRIPER_INSTANTIATE(PolarScan)
STRIPER_INSTANTIATE(FrameInfo)
STRIPER_INSTANTIATE(Odometer)
STRIPER_INSTANTIATE(Curbs)
STRIPER_INSTANTIATE(Objects)
STRIPER_INSTANTIATE(Event)

#undef STRIPER_INSTANTIATE

}  // namespace striper::wire
