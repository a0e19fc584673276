// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <string>

#include <gtest/gtest.h>

#include <striper/core/frame_source.hpp>

namespace striper::testing {

/// A source that the conformance suite is to try.
///
/// To add one: in a file of its own beside this, `INSTANTIATE_TEST_SUITE_P(NAME,
/// FrameSourceConformance, ::testing::Values(SourceUnderTest{...}), source_name)`.
struct SourceUnderTest {
  std::string name;  ///< Letters and digits: part of the test's name.

  /// Opens the source; several calls open it several times. A source without an end or with at
  /// least 24 frames, at 10 frames a second or more.
  std::function<std::unique_ptr<FrameSource>()> open;

  /// Two opened at once may both stream (files); otherwise the second must be refused by name.
  bool can_stream_twice = false;

  /// Empty, or why the source cannot be tried here (no such device): the tests skip with it.
  std::function<std::string()> absent = [] { return std::string(); };
};

inline void PrintTo(const SourceUnderTest& source, std::ostream* out) { *out << source.name; }

inline std::string source_name(const ::testing::TestParamInfo<SourceUnderTest>& info) {
  return info.param.name;
}

/// What every FrameSource promises (striper/core/frame_source.hpp), one test a promise.
class FrameSourceConformance : public ::testing::TestWithParam<SourceUnderTest> {
 protected:
  void SetUp() override {
    if (const std::string reason = GetParam().absent(); !reason.empty()) GTEST_SKIP() << reason;
  }
};

}  // namespace striper::testing
