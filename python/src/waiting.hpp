// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include <striper/core/frame_source.hpp>

namespace striper::python {

// How long a signal such as Ctrl-C may wait.
inline constexpr std::chrono::milliseconds kSignalPeriod{50};

/// Runs Python's signal handlers. @throws what they raise. Holds the interpreter's lock.
inline void handle_signals() {
  if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
}

/// Raises EOFError.
[[noreturn]] inline void raise_end(const char* message) {
  PyErr_SetString(PyExc_EOFError, message);
  throw pybind11::error_already_set();
}

/// Waits for `next(time)` in slices, without the interpreter's lock; between them signals are
/// handled. @param timeout_s empty: for ever.
template <typename Next>
NextStatus wait_for_next(Next next, std::optional<double> timeout_s) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  while (true) {
    std::chrono::milliseconds slice = kSignalPeriod;
    if (timeout_s) {
      const std::chrono::duration<double> left =
          std::chrono::duration<double>(*timeout_s) - (Clock::now() - begin);
      slice = std::min(slice, std::max(std::chrono::milliseconds(0),
                                       std::chrono::ceil<std::chrono::milliseconds>(left)));
    }
    NextStatus status{};
    {
      const pybind11::gil_scoped_release unlocked;
      status = next(slice);
    }
    handle_signals();
    if (status != NextStatus::kTimeout) return status;
    if (timeout_s && Clock::now() - begin >= std::chrono::duration<double>(*timeout_s)) {
      return status;
    }
  }
}

/// Runs `work` on a thread of its own and handles signals meanwhile. Where a handler raises,
/// `cancel` is called and the end of the work waited for.
template <typename Work, typename Cancel>
auto run_interruptibly(Work work, Cancel cancel) {
  auto result = std::async(std::launch::async, std::move(work));
  const auto is_done = [&] {
    const pybind11::gil_scoped_release unlocked;
    return result.wait_for(kSignalPeriod) == std::future_status::ready;
  };
  try {
    while (!is_done()) handle_signals();
  } catch (...) {
    const pybind11::gil_scoped_release unlocked;
    cancel();
    result.wait();
    throw;
  }
  return result.get();
}

/// Holds a T that is let go of without the interpreter's lock: its threads may be waiting for that
/// in a callback.
template <typename T>
class Unlocked {
 public:
  explicit Unlocked(T held) : held_(std::move(held)) {}
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;
  ~Unlocked() {
    const pybind11::gil_scoped_release unlocked;
    held_.reset();
  }

  T& operator*() { return held_; }
  auto* operator->() { return held_.get(); }
  const auto* operator->() const { return held_.get(); }

 private:
  T held_;
};

}  // namespace striper::python
