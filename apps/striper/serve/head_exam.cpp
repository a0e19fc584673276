// SPDX-License-Identifier: Apache-2.0
#include "serve/head_exam.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>

#include "camera/picture_exam.hpp"
#include "camera/stream_exam.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;

constexpr auto kAskedLately = 10s;
constexpr auto kLooksEvery = 3s;
constexpr auto kKeepsFor = 2s;           // Of a slow camera what came until then.
constexpr auto kOfLate = 60s;            // What was lost, or warned of, before is over.
constexpr std::size_t kMostFrames = 12;  // Shows a pattern of up to four exposures three times.
constexpr std::size_t kMostBytes = 64 << 20;  // Of cameras with many pixels fewer.
constexpr std::size_t kMostHeard = 100;

SourceStatistics difference(const SourceStatistics& now, const SourceStatistics& before) {
  if (now.delivered < before.delivered) return now;  // It was opened again.
  SourceStatistics since;
  since.delivered = now.delivered - before.delivered;
  since.dropped = now.dropped - before.dropped;
  since.overrun = now.overrun - before.overrun;
  since.corrupt = now.corrupt - before.corrupt;
  since.incomplete = now.incomplete - before.incomplete;
  since.wrong_size = now.wrong_size - before.wrong_size;
  since.reconnects = now.reconnects - before.reconnects;
  return since;
}

void add_sinks(const std::vector<SinkReport>& sinks, std::vector<Event>& found) {
  for (const SinkReport& sink : sinks) {
    if (sink.state == SinkReport::State::kClosed) {
      found.push_back({"sink_failed", fmt::format("{} was closed: it gets no scans", sink.uri),
                       "what happened says why; start striper again when it is repaired"});
    } else if (sink.lost > 0 && sink.delivery == Delivery::kLossless) {
      found.push_back({"sink_slow", fmt::format("{} lost {} scans so far", sink.uri, sink.lost),
                       "a faster disk, fewer outputs, or a slower camera"});
    }
  }
}

}  // namespace

HeadExam::HeadExam(const ScannerSettings& settings) : settings_(settings) {}

void HeadExam::note(const SourceInfo& source) {
  const std::lock_guard lock(mutex_);
  source_ = source;
}

void HeadExam::keep(const Frame& frame) {
  const std::lock_guard lock(mutex_);
  if (!is_keeping_ || frame.status != FrameStatus::kOk || kept_.size() == kMostFrames) return;
  const std::size_t bytes = frame.image.total() * frame.image.elemSize();
  if (!kept_.empty() && kept_bytes_ + bytes > kMostBytes) return;
  kept_bytes_ += bytes;
  kept_.push_back(frame);
  kept_.back().image = frame.image.clone();
  kept_.back().lease.reset();
}

void HeadExam::hear(const Event& event) {
  const std::lock_guard lock(mutex_);
  heard_.push_back({Clock::now(), event});
  if (heard_.size() > kMostHeard) heard_.pop_front();
}

bool HeadExam::is_due(Clock::time_point now) const {
  return source_ && now - asked_ < kAskedLately && now - looked_ > kLooksEvery;
}

void HeadExam::look(const HeadHealth& health) {
  std::vector<Frame> frames;
  SourceInfo source;
  {
    const std::lock_guard lock(mutex_);
    const Clock::time_point now = Clock::now();
    note_statistics(health.read.statistics);
    if (!is_keeping_ && is_due(now)) {
      is_keeping_ = true;
      keeping_since_ = now;
    }
    const bool is_enough = kept_.size() == kMostFrames || now - keeping_since_ > kKeepsFor;
    if (!is_keeping_ || !is_enough) return;
    is_keeping_ = false;
    kept_bytes_ = 0;
    frames = std::exchange(kept_, {});
    source = *source_;
  }
  std::vector<Event> found = examine(frames, source);
  const std::lock_guard lock(mutex_);
  of_images_ = std::move(found);
  looked_ = Clock::now();
}

void HeadExam::note_statistics(const SourceStatistics& now) {
  if (Clock::now() - before_when_ < kOfLate && now.delivered >= before_.delivered) return;
  before_ = now;
  before_when_ = Clock::now();
}

std::vector<Event> HeadExam::examine(const std::vector<Frame>& frames,
                                     const SourceInfo& source) const {
  std::vector<Event> found;
  if (frames.empty()) return found;
  try {
    ImageExam images(scanner_setup(settings_.arguments(), source));
    for (const Frame& frame : frames) images.look_at(frame);
    images.conclude(found);
  } catch (const Error& error) {
    found.push_back({Severity::kError, "picture_unlit", error.what()});
  }
  return found;
}

void HeadExam::add_state(const HeadHealth& health, std::vector<Event>& found) const {
  switch (health.state) {
    case SourceState::kWaiting:
      found.push_back({Severity::kError, "source_waiting",
                       "the source is not there: it is waited for",
                       "power, cable and address of the camera; another program may hold it: "
                       "striper doctor looks at the network"});
      break;
    case SourceState::kSilent:
      found.push_back({Severity::kError, "source_silent", "the camera is open and sends nothing",
                       "does it wait for a trigger, is there a signal?"});
      break;
    case SourceState::kPaused:
      found.push_back({"source_paused", "the source was stopped", "Start opens it again"});
      break;
    case SourceState::kEnded:
      found.push_back({"source_ended", "the source has ended"});
      break;
    case SourceState::kStreaming:
      found.push_back({"source_opened",
                       fmt::format("{:.1f} frames a second from {}", health.rate_hz,
                                   source_ ? source_->description : std::string("the source"))});
  }
}

// Each once.
void HeadExam::add_heard(std::vector<Event>& found) const {
  const Clock::time_point now = Clock::now();
  for (auto one = heard_.rbegin(); one != heard_.rend(); ++one) {
    const auto is_same = [&](const Event& other) { return other.code == one->event.code; };
    const bool is_news = one->event.severity >= Severity::kWarning && now - one->when < kOfLate;
    if (is_news && std::none_of(found.begin(), found.end(), is_same)) found.push_back(one->event);
  }
}

std::vector<Event> HeadExam::findings(const HeadHealth& health,
                                      const std::vector<SinkReport>& sinks) {
  const std::lock_guard lock(mutex_);
  asked_ = Clock::now();
  std::vector<Event> found;
  add_state(health, found);
  if (source_) {
    FrameReport report = health.read;
    report.statistics = difference(health.read.statistics, before_);
    conclude_stream(report, *source_, found);
  }
  if (health.state == SourceState::kStreaming) {
    found.insert(found.end(), of_images_.begin(), of_images_.end());
  }
  add_sinks(sinks, found);
  add_heard(found);
  std::stable_sort(found.begin(), found.end(),
                   [](const Event& a, const Event& b) { return a.severity > b.severity; });
  return found;
}

}  // namespace striper::program
