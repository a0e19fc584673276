// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>

namespace striper::testing {

/// What an action is refused with; the test fails where it is not.
inline Error error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return {ErrorKind::kUsage, ""};
}

}  // namespace striper::testing
