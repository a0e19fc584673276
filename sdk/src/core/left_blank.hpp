// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace striper::detail {

/// Leaves new elements as memory has them: `resize` writes nothing.
template <typename T>
struct LeaveBlank : std::allocator<T> {
  static_assert(std::is_trivially_default_constructible_v<T>);

  template <typename U>
  struct rebind {  // NOLINT(readability-identifier-naming): what the standard calls it.
    using other = LeaveBlank<U>;
  };

  template <typename U>
  void construct(U* at) noexcept {
    ::new (static_cast<void*>(at)) U;
  }
  template <typename U, typename... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
};

/// A vector whose new elements are written before they are read, all of them. Room for the most
/// that may come costs no pages until something is there: a first page costs a microsecond or two.
template <typename T>
using BlankVector = std::vector<T, LeaveBlank<T>>;

}  // namespace striper::detail
