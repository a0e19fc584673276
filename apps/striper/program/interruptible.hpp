// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <thread>
#include <utility>

#include <striper/core/error.hpp>

#include "program/program.hpp"

namespace striper::program {

/// Runs work whose steps (a search for a board, a solve) take too long for Ctrl-C to wait for, and
/// that writes no file: it is left where it is. It goes on until the process ends, which it then
/// does without its destructors, so what the work refers to must be its own.
/// @throws what the work does, and Error(kDevice, "interrupted").
template <typename Result>
Result run_interruptible(std::function<Result()> work) {
  constexpr std::chrono::milliseconds kLook(20);
  std::packaged_task<Result()> task(std::move(work));
  std::future<Result> result = task.get_future();
  std::thread thread(std::move(task));
  while (result.wait_for(kLook) != std::future_status::ready) {
    if (!stop_requested()) continue;
    thread.detach();
    leave_threads_behind();
    throw Error(ErrorKind::kDevice, "interrupted");
  }
  thread.join();
  if (stop_requested()) throw Error(ErrorKind::kDevice, "interrupted");
  return result.get();
}

}  // namespace striper::program
