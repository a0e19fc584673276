// SPDX-License-Identifier: Apache-2.0
#include "serve/head_recorder.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <system_error>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/open_sink.hpp>

namespace striper::program {
namespace {

constexpr const char* kExtension = ".mcap";
constexpr double kEveryFrame_hz = 1e4;

// A head's name may have slashes, as a topic's.
std::string file_name(const std::string& head) {
  std::string name = head;
  std::replace(name.begin(), name.end(), '/', '_');
  return fmt::format("{}-{:%Y%m%dT%H%M%SZ}{}", name, fmt::gmtime(std::time(nullptr)), kExtension);
}

double utc_s(std::filesystem::file_time_type time) {
  const auto since = std::chrono::file_clock::to_sys(time).time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

}  // namespace

HeadRecorder::HeadRecorder(std::filesystem::path folder, std::string head, ScanBus& bus,
                           EventPort events)
    : folder_(std::move(folder)), head_(std::move(head)), bus_(bus), events_(std::move(events)) {}

std::filesystem::path HeadRecorder::begin(double seconds) {
  if (!(seconds > 0.0 && seconds <= kLongest_s)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("a recording of {} s: 0 to {} are possible", seconds, kLongest_s));
  }
  const std::lock_guard lock(mutex_);
  if (going_) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("'{}' is being recorded: one at a time", going_->path.string()));
  }
  if (folder_.empty()) {
    throw Error(ErrorKind::kUnsupported,
                "there is no folder for recordings: --recordings DIR says where");
  }
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  std::filesystem::path path = folder_ / file_name(head_);
  if (std::filesystem::exists(path)) {
    throw Error(ErrorKind::kUnsupported, fmt::format("'{}' is of this very second", path.string()));
  }
  const std::string sink = fmt::format("mcap:{}?frames={}", path.string(), kEveryFrame_hz);
  bus_.add(sink, open_sink(sink));
  going_ = Going{path, sink,
                 Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                    std::chrono::duration<double>(seconds))};
  return path;
}

void HeadRecorder::look() {
  std::optional<Going> over;
  {
    const std::lock_guard lock(mutex_);
    if (!going_ || Clock::now() < going_->end) return;
    over = std::exchange(going_, std::nullopt);
  }
  for (const SinkReport& report : bus_.remove(over->sink)) {
    if (report.state != SinkReport::State::kFinished) continue;  // Why it failed was said.
    events_.send({"recording_made", fmt::format("'{}' has {} scans, {} were lost",
                                                over->path.string(), report.written, report.lost)});
  }
}

std::vector<RecordingFile> HeadRecorder::list() const {
  std::vector<RecordingFile> files;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code gone;
    if (entry->path().extension() != kExtension || !entry->is_regular_file(gone)) continue;
    files.push_back({entry->path().filename().string(), entry->file_size(gone),
                     utc_s(entry->last_write_time(gone))});
  }
  std::sort(files.begin(), files.end(), [](const RecordingFile& a, const RecordingFile& b) {
    return std::pair(-a.time_s, a.name) < std::pair(-b.time_s, b.name);
  });
  return files;
}

// Of the list, so that no name leads anywhere else.
std::filesystem::path HeadRecorder::path_of(std::string_view name) const {
  for (const RecordingFile& one : list()) {
    if (one.name == name) return folder_ / one.name;
  }
  throw Error(ErrorKind::kNotFound, fmt::format("there is no recording '{}'", name));
}

}  // namespace striper::program
