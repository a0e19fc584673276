// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace striper::testing {

/// Whether a sanitizer watches the code under test, but not the libraries beside it: times and
/// memory then say nothing of the product.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kIsInstrumented = true;
#else
inline constexpr bool kIsInstrumented = false;
#endif

}  // namespace striper::testing
