// SPDX-License-Identifier: Apache-2.0
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include <striper/scan/scan_pool.hpp>

namespace striper {

// What both the pool and the scans on their way hold on to. The lists have room for everything that
// was ever made, so that giving something back never allocates.
struct ScanPool::Shared {
  // A shared pointer's counts live in a block of their own, of one size.
  struct Block {
    void* memory;
    std::size_t bytes;
  };

  ~Shared() {
    for (const Block& block : blocks) ::operator delete(block.memory);
  }

  std::unique_ptr<PolarScan> take_scan() {
    const std::lock_guard lock(mutex);
    if (scans.empty()) {
      scans.reserve(++made);
      return std::make_unique<PolarScan>();
    }
    std::unique_ptr<PolarScan> scan = std::move(scans.back());
    scans.pop_back();
    return scan;
  }

  void give_back(PolarScan* scan) {
    scan->frame.reset();
    const std::lock_guard lock(mutex);
    scans.emplace_back(scan);
  }

  void* take_block(std::size_t bytes) {
    const std::lock_guard lock(mutex);
    if (!blocks.empty() && blocks.back().bytes == bytes) {
      void* const memory = blocks.back().memory;
      blocks.pop_back();
      return memory;
    }
    blocks.reserve(++blocks_made);
    return ::operator new(bytes);
  }

  void give_back(Block block) {
    const std::lock_guard lock(mutex);
    blocks.push_back(block);
  }

  mutable std::mutex mutex;
  std::vector<std::unique_ptr<PolarScan>> scans;
  std::vector<Block> blocks;
  std::size_t made = 0;
  std::size_t blocks_made = 0;
};

namespace {

// Allocates the counts of shared pointers from the pool's blocks.
template <typename T, typename Pool>
struct BlockAllocator {
  using value_type = T;
  template <typename U>
  struct rebind {  // NOLINT(readability-identifier-naming): what an allocator has to be.
    using other = BlockAllocator<U, Pool>;
  };

  explicit BlockAllocator(std::shared_ptr<Pool> pool_in) : pool(std::move(pool_in)) {}
  template <typename U>
  // NOLINTNEXTLINE(google-explicit-constructor): what an allocator has to be.
  BlockAllocator(const BlockAllocator<U, Pool>& other) : pool(other.pool) {}

  T* allocate(std::size_t n) { return static_cast<T*>(pool->take_block(n * sizeof(T))); }
  void deallocate(T* memory, std::size_t n) noexcept { pool->give_back({memory, n * sizeof(T)}); }
  friend bool operator==(const BlockAllocator&, const BlockAllocator&) = default;

  std::shared_ptr<Pool> pool;
};

}  // namespace

ScanPool::ScanPool() : shared_(std::make_shared<Shared>()) {}

std::shared_ptr<PolarScan> ScanPool::take() {
  const auto give_back = [pool = shared_](PolarScan* scan) { pool->give_back(scan); };
  PolarScan* const scan = shared_->take_scan().release();
  return {scan, give_back, BlockAllocator<PolarScan, Shared>(shared_)};
}

std::size_t ScanPool::size() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->made;
}

}  // namespace striper
