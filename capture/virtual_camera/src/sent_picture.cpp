// SPDX-License-Identifier: Apache-2.0
#include "sent_picture.hpp"

#include <algorithm>

#include "gige/protocol/gvcp.hpp"

namespace striper::detail {
namespace {

constexpr std::uint32_t kLeader = 1U << 24;
constexpr std::uint32_t kTrailer = 2U << 24;
constexpr std::uint32_t kPayload = 3U << 24;
constexpr std::uint32_t kImage = 0x0001;
constexpr std::uint32_t kWithChunks = 0x4000;
constexpr std::size_t kHeader = 8;

void put_header(GvspPacket& packet, std::uint16_t block_id, std::uint32_t format_and_id) {
  gvcp::put16(&packet.head[0], gvcp::kSuccess);
  gvcp::put16(&packet.head[2], block_id);
  gvcp::put32(&packet.head[4], format_and_id);
  packet.head_bytes = kHeader;
}

std::uint32_t payload_type(const SentFrame& frame) {
  return frame.has_chunks ? kImage | kWithChunks : kImage;
}

void put_leader(GvspPacket& packet, const SentFrame& frame) {
  std::uint8_t* const at = &packet.head[kHeader];
  const auto u32 = [](int value) { return static_cast<std::uint32_t>(value); };
  gvcp::put16(at + 2, payload_type(frame));
  gvcp::put64(at + 4, frame.timestamp);
  gvcp::put32(at + 12, frame.pixel_format);
  gvcp::put32(at + 16, u32(frame.region.width));
  gvcp::put32(at + 20, u32(frame.region.height));
  gvcp::put32(at + 24, u32(frame.region.x));
  gvcp::put32(at + 28, u32(frame.region.y));
  packet.head_bytes += 36;
}

void put_trailer(GvspPacket& packet, const SentFrame& frame) {
  std::uint8_t* const at = &packet.head[kHeader];
  gvcp::put16(at + 2, payload_type(frame));
  gvcp::put32(at + 4, static_cast<std::uint32_t>(frame.region.height));
  packet.head_bytes += frame.has_chunks ? 12 : 8;
}

}  // namespace

std::uint32_t SentFrame::packet_count() const noexcept {
  const std::size_t pieces = (payload.size() + packet_payload - 1) / packet_payload;
  return static_cast<std::uint32_t>(pieces) + 2;
}

GvspPacket make_packet(const SentFrame& frame, std::uint32_t packet_id) {
  GvspPacket packet;
  if (packet_id == 0) {
    put_header(packet, frame.block_id, kLeader);
    put_leader(packet, frame);
  } else if (packet_id + 1 == frame.packet_count()) {
    put_header(packet, frame.block_id, kTrailer | packet_id);
    put_trailer(packet, frame);
  } else {
    put_header(packet, frame.block_id, kPayload | packet_id);
    const std::size_t begin = (packet_id - 1) * frame.packet_payload;
    const std::size_t size = std::min(frame.packet_payload, frame.payload.size() - begin);
    packet.body = std::span(frame.payload).subspan(begin, size);
  }
  return packet;
}

}  // namespace striper::detail
