// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace striper::program {

/// A small file that is written again and again, on a thread of its own: who switches guns waits
/// for no disk. Each text is there whole or not at all; the newest one counts, those that came
/// while another was written are left out. One thread gives the texts.
class KeptFile {
 public:
  explicit KeptFile(std::filesystem::path path);
  KeptFile(const KeptFile&) = delete;
  KeptFile& operator=(const KeptFile&) = delete;
  ~KeptFile();  ///< What was given last is written before.

  /// Returns at once.
  void put(std::string text);
  /// What a write failed by, told once.
  std::optional<std::string> take_failure();
  /// The last text, written when this returns. @throws Error{kIo} naming the file.
  void close(const std::string& text);

 private:
  void run(const std::stop_token& stop);
  void end();

  std::filesystem::path path_;
  std::mutex mutex_;
  std::condition_variable_any came_;
  std::optional<std::string> text_;
  std::optional<std::string> failure_;
  std::jthread thread_;  // Last: it works on all of the above.
};

}  // namespace striper::program
