// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

namespace striper::testing {

/// Whether a sanitizer watches the code under test, but not the libraries beside it: times and
/// memory then say nothing of the product.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kIsInstrumented = true;
#elif defined(__has_feature)
inline constexpr bool kIsInstrumented =
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kIsInstrumented = false;
#endif

}  // namespace striper::testing

/// Skips figures over many trials where a sanitizer makes minutes of them: they are those of a
/// plain build, and the same code runs in other tests.
#define STRIPER_SKIP_FIGURES_WHERE_INSTRUMENTED() \
  if (!striper::testing::kIsInstrumented) {       \
  } else                                          \
    GTEST_SKIP() << "figures of a plain build"
