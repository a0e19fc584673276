// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::speed {

/// Makes the compiler believe that a result is used.
template <typename T>
inline void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

}  // namespace striper::speed
