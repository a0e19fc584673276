// SPDX-License-Identifier: Apache-2.0
#include "guide/live/kept_file.hpp"

#include <utility>

#include <striper/core/error.hpp>
#include <striper/core/whole_file.hpp>

namespace striper::program {

KeptFile::KeptFile(std::filesystem::path path)
    : path_(std::move(path)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

KeptFile::~KeptFile() { end(); }

void KeptFile::end() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void KeptFile::put(std::string text) {
  const std::lock_guard lock(mutex_);
  text_ = std::move(text);
  came_.notify_one();
}

std::optional<std::string> KeptFile::take_failure() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failure_, std::nullopt);
}

void KeptFile::close(const std::string& text) {
  {
    const std::lock_guard lock(mutex_);
    text_.reset();
  }
  end();
  write_file_atomically(path_, text);
}

void KeptFile::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (came_.wait(lock, stop, [this] { return text_.has_value(); })) {
    const std::string text = *std::exchange(text_, std::nullopt);
    lock.unlock();
    std::optional<std::string> failure;
    try {
      write_file_atomically(path_, text);
    } catch (const Error& error) {
      failure = error.what();
    }
    lock.lock();
    if (failure) failure_ = std::move(failure);
  }
}

}  // namespace striper::program
