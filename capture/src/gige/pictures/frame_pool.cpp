// SPDX-License-Identifier: Apache-2.0
#include "gige/pictures/frame_pool.hpp"

#include <utility>

namespace striper::detail {
namespace {

/// Puts a lease's control block into the slot itself. The slot is free for another lease when the
/// block is gone, and not earlier: so it goes back to the stream here and not in the deleter.
template <typename T>
struct SlotAllocator {
  using value_type = T;

  explicit SlotAllocator(PoolSlot& where) noexcept : slot(&where) {}
  template <typename Other>
  SlotAllocator(const SlotAllocator<Other>& other) noexcept : slot(other.slot) {}  // NOLINT

  T* allocate(std::size_t count) {
    static_assert(sizeof(T) <= sizeof(PoolSlot::lease_memory));
    return count == 1 ? reinterpret_cast<T*>(slot->lease_memory.data()) : nullptr;
  }
  void deallocate(T*, std::size_t) noexcept {
    const std::shared_ptr<FramePool> keeper = std::move(slot->keeper);
    keeper->end_lease(*slot);
  }

  template <typename Other>
  bool operator==(const SlotAllocator<Other>& other) const noexcept {
    return slot == other.slot;
  }

  PoolSlot* slot;
};

}  // namespace

FramePool::FramePool(int count, std::size_t bytes) {
  for (int i = 0; i < count; ++i) {
    auto slot = std::make_unique<PoolSlot>();
    slot->buffer.reset(arv_buffer_new_full(bytes, nullptr, slot.get(), nullptr));
    slots_.push_back(std::move(slot));
  }
}

void FramePool::attach(ArvStream* stream) {
  const std::lock_guard lock(mutex_);
  stream_ = stream;
  for (const auto& slot : slots_) {
    arv_stream_push_buffer(stream, ARV_BUFFER(g_object_ref(slot->buffer.get())));
  }
}

void FramePool::detach() {
  const std::lock_guard lock(mutex_);
  stream_ = nullptr;
}

PoolSlot& FramePool::slot_of(ArvBuffer* buffer) noexcept {
  return *static_cast<PoolSlot*>(const_cast<void*>(arv_buffer_get_user_data(buffer)));
}

void FramePool::give_back(PoolSlot& slot) noexcept {
  const std::lock_guard lock(mutex_);
  if (stream_ != nullptr) {
    arv_stream_push_buffer(stream_, ARV_BUFFER(g_object_ref(slot.buffer.get())));
  }
}

void FramePool::end_lease(PoolSlot& slot) noexcept {
  --leased_;
  give_back(slot);
}

std::shared_ptr<const void> FramePool::lease(PoolSlot& slot) {
  slot.keeper = shared_from_this();
  ++leased_;
  return {static_cast<const void*>(&slot), [](const void*) {}, SlotAllocator<std::byte>(slot)};
}

}  // namespace striper::detail
