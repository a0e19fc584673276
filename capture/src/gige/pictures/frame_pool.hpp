// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/core/illumination.hpp>

#include "gige/protocol/arv_ptr.hpp"

namespace striper::detail {

class FramePool;

/// One camera buffer and what is known of the frame in it. Between the stream (which fills it),
/// the source (which looks at it) and a Frame (which leases it) it has one owner at a time.
struct PoolSlot {
  GPtr<ArvBuffer> buffer;
  cv::Mat unpacked;
  cv::Mat scratch;

  std::int64_t arrival_ns = 0;    ///< CLOCK_MONOTONIC, of the first packet.
  std::int64_t completed_ns = 0;  ///< CLOCK_MONOTONIC, of the last packet.
  std::uint64_t arrival = 0;      ///< Number of the buffer in the order of completion.
  std::uint64_t trigger = 0;      ///< Number of the software trigger that took it.
  Illumination commanded;         ///< What the host had the laser do for it.

  std::shared_ptr<FramePool> keeper;  ///< Set while leased.
  alignas(std::max_align_t) std::array<std::byte, 96> lease_memory{};
};

/// The buffers of one stream. Leased buffers outlive the stream; those that come back while it
/// lives are filled again. Thread-safe.
class FramePool : public std::enable_shared_from_this<FramePool> {
 public:
  FramePool(int count, std::size_t bytes);

  /// Hands all buffers to the stream, and from now on those that are returned. Once in a pool's
  /// life.
  void attach(ArvStream* stream);

  /// From now on returned buffers are kept.
  void detach();

  /// The slot of a buffer of this pool.
  static PoolSlot& slot_of(ArvBuffer* buffer) noexcept;

  /// Puts a buffer back into the stream.
  void give_back(PoolSlot& slot) noexcept;

  /// The same for one that was leased.
  void end_lease(PoolSlot& slot) noexcept;

  /// What keeps the buffer while a Frame uses it; gives it back when the last copy goes.
  /// Allocates nothing.
  std::shared_ptr<const void> lease(PoolSlot& slot);

  /// False where so many are leased already that the stream would run dry: copy, then.
  bool can_lease() const noexcept { return leased_ + kForTheStream < slots_.size(); }

 private:
  static constexpr std::size_t kForTheStream = 3;

  std::mutex mutex_;
  ArvStream* stream_ = nullptr;
  std::atomic<std::size_t> leased_ = 0;
  std::vector<std::unique_ptr<PoolSlot>> slots_;
};

}  // namespace striper::detail
