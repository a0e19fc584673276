// SPDX-License-Identifier: Apache-2.0
#include "stream_sender.hpp"

#include <algorithm>
#include <ctime>
#include <vector>

#include <sys/socket.h>
#include <unistd.h>

#include "gige/protocol/udp_socket.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

void sleep_until_ns(std::int64_t time_ns) {
  const timespec until{time_ns / 1'000'000'000, time_ns % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

}  // namespace

/// Packets on their way into the kernel, many with one call.
class StreamSender::Batch {
 public:
  Batch(int fd, const sockaddr_in& to) : fd_(fd), to_(to) {}

  void add(const GvspPacket& packet) {
    packets_[count_++] = packet;
    bytes_ += packet.bytes();
  }
  bool is_full() const noexcept { return count_ == packets_.size(); }

  void flush() {
    for (std::size_t i = 0; i < count_; ++i) {
      GvspPacket& packet = packets_[i];
      auto& parts = parts_[i];
      parts[0] = {packet.head.data(), packet.head_bytes};
      parts[1] = {const_cast<std::uint8_t*>(packet.body.data()), packet.body.size()};
      msghdr& message = messages_[i].msg_hdr;
      message = {};
      message.msg_name = &to_;
      message.msg_namelen = sizeof(to_);
      message.msg_iov = parts.data();
      message.msg_iovlen = packet.body.empty() ? 1 : 2;
    }
    for (std::size_t done = 0; done < count_;) {
      const int sent = sendmmsg(fd_, &messages_[done], static_cast<unsigned>(count_ - done), 0);
      if (sent <= 0) break;  // nobody listens: what a cable would do, too
      done += static_cast<std::size_t>(sent);
    }
    count_ = 0;
    bytes_ = 0;
  }

 private:
  static constexpr std::size_t kMost = 32;
  int fd_;
  sockaddr_in to_;
  std::array<GvspPacket, kMost> packets_{};
  std::array<std::array<iovec, 2>, kMost> parts_{};
  std::array<mmsghdr, kMost> messages_{};
  std::size_t count_ = 0;
  std::size_t bytes_ = 0;
};

StreamSender::StreamSender(std::uint32_t local_address, double link_mbit_s)
    : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)),
      ns_per_byte_(8e3 / link_mbit_s),
      random_(1) {
  const sockaddr_in local = socket_address(local_address, 0);
  // Where it cannot be, packets leave from whatever address the system chooses.
  static_cast<void>(bind(fd_, reinterpret_cast<const sockaddr*>(&local), sizeof(local)));
  const int bytes = 4 << 20;
  setsockopt(fd_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
}

StreamSender::~StreamSender() { close(fd_); }

std::uint16_t StreamSender::local_port() const noexcept {
  sockaddr_in local{};
  socklen_t length = sizeof(local);
  getsockname(fd_, reinterpret_cast<sockaddr*>(&local), &length);
  return ntohs(local.sin_port);
}

bool StreamSender::loses_one() {
  if (lost_packets <= 0.0) return false;
  return static_cast<double>(random_() >> 11) * 0x1.0p-53 < lost_packets;
}

std::shared_ptr<SentFrame> StreamSender::make_frame(std::size_t bytes) {
  constexpr std::size_t kMemory = 32 << 20;
  constexpr std::size_t kFewest = 12;
  constexpr std::size_t kMost = 256;
  const std::lock_guard lock(mutex_);
  const std::size_t count = std::clamp(kMemory / std::max<std::size_t>(bytes, 1), kFewest, kMost);
  if (kept_.size() != count) {
    kept_.assign(count, nullptr);
    oldest_ = 0;
  }
  std::shared_ptr<SentFrame>& slot = kept_[oldest_];
  oldest_ = (oldest_ + 1) % kept_.size();
  // Somebody may be sending of it right now: then a new one takes its place.
  if (!slot || slot.use_count() > 1) slot = std::make_shared<SentFrame>();
  slot->block_id = 0;
  return slot;
}

void StreamSender::send(const std::shared_ptr<SentFrame>& frame, std::uint16_t block_id,
                        const sockaddr_in& to, std::int64_t packet_delay_ns) {
  {
    const std::lock_guard lock(mutex_);
    frame->block_id = block_id;
  }
  constexpr double kWorthSleeping_ns = 150e3;
  const std::uint32_t count = frame->packet_count();
  Batch batch(fd_, to);
  const std::int64_t begin_ns = monotonic_now_ns();
  double wire_ns = 0.0;
  double slept_at_ns = 0.0;
  for (std::uint32_t id = 0; id < count; ++id) {
    const GvspPacket packet = make_packet(*frame, id);
    wire_ns += ns_per_byte_ * static_cast<double>(packet.bytes() + 42) +
               static_cast<double>(packet_delay_ns);
    ++packets;
    if (is_silent || loses_one()) {
      ++lost;
    } else {
      batch.add(packet);
    }
    const bool is_pause = wire_ns - slept_at_ns > kWorthSleeping_ns;
    if (batch.is_full() || is_pause || id + 1 == count) batch.flush();
    if (is_pause) {
      sleep_until_ns(begin_ns + static_cast<std::int64_t>(wire_ns));
      slept_at_ns = wire_ns;
    }
  }
}

bool StreamSender::resend(std::uint16_t block_id, std::uint32_t first, std::uint32_t last,
                          const sockaddr_in& to) {
  std::shared_ptr<SentFrame> frame;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) {
      return kept && kept->block_id == block_id;
    });
    if (found == kept_.end()) return false;
    frame = *found;
  }
  Batch batch(fd_, to);
  last = std::min(last, frame->packet_count() - 1);
  for (std::uint32_t id = first; id <= last; ++id) {
    if (is_silent) continue;
    batch.add(make_packet(*frame, id));
    ++resent;
    if (batch.is_full()) batch.flush();
  }
  batch.flush();
  return true;
}

void StreamSender::send_test_packet(std::size_t bytes, const sockaddr_in& to) {
  if (is_silent) return;
  const std::vector<std::uint8_t> packet(bytes, 0);
  sendto(fd_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof(to));
}

}  // namespace striper::detail
