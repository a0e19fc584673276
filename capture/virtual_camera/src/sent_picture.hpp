// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core/types.hpp>

namespace striper::detail {

/// One frame as it goes over the wire (GVSP, GigE Vision 1.2, chapter 24): leader, payload
/// packets and trailer, any of which can be made again when a client asks for it.
struct SentFrame {
  std::uint16_t block_id = 0;
  std::uint64_t timestamp = 0;
  std::uint32_t pixel_format = 0;
  cv::Rect region;
  bool has_chunks = false;
  std::size_t packet_payload = 0;  ///< Bytes of the image in one packet.
  std::vector<std::uint8_t> payload;

  /// 0 is the leader, the last one the trailer.
  std::uint32_t packet_count() const noexcept;
};

/// One packet: a header of its own and a piece of the image.
struct GvspPacket {
  std::array<std::uint8_t, 64> head{};
  std::size_t head_bytes = 0;
  std::span<const std::uint8_t> body;

  std::size_t bytes() const noexcept { return head_bytes + body.size(); }
};

GvspPacket make_packet(const SentFrame& frame, std::uint32_t packet_id);

}  // namespace striper::detail
