// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <random>
#include <vector>

#include <netinet/in.h>

#include "sent_picture.hpp"

namespace striper::detail {

/// Sends frames packet by packet at the pace of a link, loses some on purpose, and keeps the last
/// ones to send packets again. `send` is for one thread, `resend` for another.
class StreamSender {
 public:
  StreamSender(std::uint32_t local_address, double link_mbit_s);
  StreamSender(const StreamSender&) = delete;
  StreamSender& operator=(const StreamSender&) = delete;
  ~StreamSender();

  std::uint16_t local_port() const noexcept;

  /// A frame to be filled and sent: one that nobody needs any more.
  /// @param bytes of its payload: small ones are kept longer.
  std::shared_ptr<SentFrame> make_frame(std::size_t bytes);

  /// From here on the frame is not changed, and can be asked for again by its block id.
  /// @param packet_delay_ns pause after each packet, on top of the link's.
  void send(const std::shared_ptr<SentFrame>& frame, std::uint16_t block_id, const sockaddr_in& to,
            std::int64_t packet_delay_ns);

  /// @return false where the frame is not kept any more.
  bool resend(std::uint16_t block_id, std::uint32_t first, std::uint32_t last,
              const sockaddr_in& to);

  void send_test_packet(std::size_t bytes, const sockaddr_in& to);

  std::atomic<double> lost_packets = 0.0;
  std::atomic<bool> is_silent = false;
  std::atomic<std::uint64_t> packets = 0;
  std::atomic<std::uint64_t> lost = 0;
  std::atomic<std::uint64_t> resent = 0;

 private:
  class Batch;

  bool loses_one();

  int fd_;
  double ns_per_byte_;
  std::mt19937_64 random_;
  std::mutex mutex_;
  std::vector<std::shared_ptr<SentFrame>> kept_;
  std::size_t oldest_ = 0;
};

}  // namespace striper::detail
