// SPDX-License-Identifier: Apache-2.0
// Proves of every source what FrameSource promises of its controls: what is listed can be got, what
// can be set is read back, what cannot is refused by name, value and range, and all of that while
// frames come. Not what a control does: that is in each source's own tests.
#include <atomic>
#include <chrono>
#include <cmath>
#include <set>
#include <thread>

#include <gmock/gmock.h>

#include <striper/core/error.hpp>

#include "capture/conformance/frame_source_conformance.hpp"
#include "support/error_of.hpp"

namespace striper::testing {
namespace {

using ::testing::HasSubstr;

TEST_P(FrameSourceConformance, ControlsAreListedAndGot) {
  const auto source = GetParam().open();
  std::set<std::string> names;
  for (const Control& control : source->controls().list()) {
    SCOPED_TRACE(control.name);
    EXPECT_TRUE(names.insert(control.name).second);
    const ControlState& state = control.state;
    ASSERT_EQ(state.value.size(), control_size(control.type));
    ASSERT_EQ(state.minimum.size(), state.value.size());
    ASSERT_EQ(state.maximum.size(), state.value.size());
    for (std::size_t i = 0; i < state.value.size(); ++i) {
      EXPECT_GE(state.value[i], state.minimum[i]);
      EXPECT_LE(state.value[i], state.maximum[i]);
    }
    const Control again = source->controls().get(control.name);
    EXPECT_EQ(again.type, control.type);
    EXPECT_EQ(again.unit, control.unit);
    EXPECT_EQ(again.state.value, state.value);
  }
  const bool is_live_or_simulated = source->info().is_live || names.count("laser") != 0;
  EXPECT_EQ(names.count("exposure_us") != 0, is_live_or_simulated);
  EXPECT_EQ(names.empty(), !is_live_or_simulated);
}

TEST_P(FrameSourceConformance, ControlsRefuseWhatCannotBe) {
  const auto source = GetParam().open();
  const auto error = [&](const std::string& name, const ControlValue& value) {
    return error_of([&] { source->controls().set(name, value); });
  };
  EXPECT_EQ(error("no_such_control", {1.0}).kind(), ErrorKind::kUsage);
  EXPECT_THAT(error("no_such_control", {1.0}).what(), HasSubstr("'no_such_control'"));
  for (const Control& control : source->controls().list()) {
    SCOPED_TRACE(control.name);
    ControlValue value = control.state.maximum;
    value.front() += 1.0;
    if (!std::isfinite(value.front())) value.front() = NAN;
    const Error refused = error(control.name, value);
    EXPECT_EQ(refused.kind(),
              control.state.is_writable ? ErrorKind::kBadValue : ErrorKind::kUnsupported);
    EXPECT_THAT(refused.what(), HasSubstr(control.name + "="));
    EXPECT_EQ(source->controls().get(control.name).state.value, control.state.value);
  }
}

TEST_P(FrameSourceConformance, ControlsAreSetAndReadBackWhileItStreams) {
  const auto source = GetParam().open();
  source->start();
  std::atomic<bool> is_over = false;
  int sets = 0;
  std::thread setter([&] {
    const std::vector<Control> all = source->controls().list();
    while (!is_over) {
      for (const Control& control : all) {
        if (!control.state.is_writable) continue;
        EXPECT_EQ(source->controls().set(control.name, control.state.value).state.value,
                  control.state.value)
            << control.name;
        ++sets;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  Frame frame;
  for (int i = 0; i < 15; ++i) {
    EXPECT_EQ(source->next(frame, std::chrono::seconds(2)), NextStatus::kFrame);
    EXPECT_EQ(frame.status, FrameStatus::kOk) << frame.status_detail;
  }
  is_over = true;
  setter.join();
  source->stop();
  EXPECT_EQ(sets > 0, !source->controls().list().empty());
}

}  // namespace
}  // namespace striper::testing
