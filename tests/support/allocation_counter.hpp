// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace striper::testing {

/// Allocations through operator new of the whole program so far. Counted in
/// support/allocation_counter.cpp.
std::uint64_t allocations_so_far();

/// Counts the allocations since it was made.
class AllocationCounter {
 public:
  AllocationCounter() : start_(allocations_so_far()) {}
  std::uint64_t count() const { return allocations_so_far() - start_; }

 private:
  std::uint64_t start_;
};

}  // namespace striper::testing
