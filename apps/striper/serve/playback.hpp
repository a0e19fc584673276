// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <striper/stream/sink_services.hpp>

#include "serve/head_desk.hpp"
#include "serve/shared_sink.hpp"

namespace striper::program {

/// A recording that is played back beside the head that measures: a head of its own, `playback`,
/// that scans the recorded frames anew, at their own pace, for those alone who show scans. Nothing
/// that is measured stops, and no file gets what is played. One at a time. Thread-safe.
class Playback {
 public:
  static constexpr std::string_view kHead = "playback";
  using Screens = std::vector<std::pair<std::string, SharedSink>>;  // By their addresses.

  explicit Playback(const EventPort& events);
  ~Playback();

  /// Plays a file from its start, in place of what is played. @param arguments how it is scanned.
  /// @param screens who shows it.
  void play(const std::filesystem::path& file, const ScannerArguments& arguments,
            const Screens& screens);
  /// @return whether anything was played.
  bool stop();

  /// As long as it is there, ended or not.
  std::optional<ServedHead> served() const;

  /// Does something with its desk. @throws Error{kNotFound} where nothing is played.
  template <typename Do>
  auto with_desk(Do what) const {
    return what(desk(now()));
  }

 private:
  struct Played;
  std::shared_ptr<Played> now() const;
  static HeadDesk& desk(const std::shared_ptr<Played>& played);

  const EventPort events_;
  mutable std::mutex mutex_;
  std::shared_ptr<Played> played_;
};

}  // namespace striper::program
