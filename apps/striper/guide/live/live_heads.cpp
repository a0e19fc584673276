// SPDX-License-Identifier: Apache-2.0
#include "guide/live/live_heads.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <mutex>
#include <utility>

#include <fmt/format.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>
#include <striper/guidance/scan_sweep.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/stream/open_sink.hpp>

#include "program/terminal.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;

constexpr const char* kEncoder = "encoder";
// Streams are waited for through so many of the slowest beam's periods: a frame that is lost, and
// a scan that takes its time.
constexpr double kPatiencePeriods = 3.0;

std::chrono::milliseconds patience_of(const GuidanceConfig& config) {
  double slowest_hz = std::numeric_limits<double>::infinity();
  for (const GuidanceBeam& beam : config.beams) slowest_hz = std::min(slowest_hz, beam.rate_hz);
  return std::chrono::milliseconds(std::lround(1000.0 * kPatiencePeriods / slowest_hz));
}

bool is_encoder(const GuidanceConfig& config) {
  return config.odometer_source.empty() || config.odometer_source == kEncoder;
}

// A camera that is lost is opened by its head, as at the start: at the first entry of its pattern.
// Opened again by its source it would begin anywhere, and a pattern without a dark exposure never
// shows where.
std::string opened_by_its_head(const std::string& source) {
  const bool is_camera = source.starts_with("gige:") || source.starts_with("v4l2:");
  if (!is_camera || source.find("reconnect=") != std::string::npos) return source;
  const bool has_query = source.find('?') != std::string::npos;
  return source + (has_query ? "&reconnect=no" : "?reconnect=no");
}

// A camera that was switched off and on counts from its start again: seen as a count that lies
// behind the last one once it is opened again. What was driven meanwhile nobody has counted.
class EncoderCount {
 public:
  void open_again() noexcept { is_new_ = true; }
  std::int64_t continued(std::int64_t counts, bool counts_up) noexcept {
    const std::int64_t ahead = counts + offset_ - last_;
    if (std::exchange(is_new_, false) && has_last_ && (counts_up ? ahead < 0 : ahead > 0)) {
      offset_ = last_ - counts;
    }
    has_last_ = true;
    return last_ = counts + offset_;
  }

 private:
  std::int64_t offset_ = 0;
  std::int64_t last_ = 0;
  bool has_last_ = false;
  bool is_new_ = false;
};

bool is_of_a_clock(const std::string& source) { return !source.starts_with("sim:"); }

}  // namespace

// A head, and what it needs as long as it runs.
struct LiveHeads::Running {
  Running(LiveHead how, ScannerArguments arguments)
      : named(std::move(how)), settings(std::move(arguments), named.name, false) {}

  // A frame's reading waits for the frame's scan: both go on in order, by the scan's way.
  void add(const OdometerReading& reading) {
    const std::lock_guard lock(mutex);
    readings.push_back(reading);
  }
  std::optional<OdometerReading> take_reading(double until_s) {
    const std::lock_guard lock(mutex);
    if (readings.empty() || readings.front().time_s > until_s) return {};
    const OdometerReading reading = readings.front();
    readings.pop_front();
    return reading;
  }

  LiveHead named;
  ScannerSettings settings;
  std::unique_ptr<Head> head;
  EncoderCount encoder;  // The head's thread's.
  std::mutex mutex;
  std::deque<OdometerReading> readings;
};

// Turns the scans of all heads into the sweeps of their beams.
class LiveHeads::BeamSink : public ScanSink {
 public:
  BeamSink(LiveHeads& to, std::vector<GuidanceBeam> beams) : to_(to), beams_(std::move(beams)) {}
  using ScanSink::write;
  void write(const PolarScan& scan) override {
    for (std::size_t i = 0; i < to_.named_.size(); ++i) {
      if (to_.named_[i].name != scan.head()) continue;
      to_.give_readings(i, scan.time.seconds());
      for (const GuidanceBeam& beam : beams_) {
        if (beam.head != scan.head() || beam.laser != scan.laser) continue;
        BeamSweep sweep;
        if (sweep_of_scan(scan, beam, sweep)) to_.inputs_.give(i, std::move(sweep));
      }
    }
  }

 private:
  LiveHeads& to_;
  std::vector<GuidanceBeam> beams_;
};

namespace {

// What of a bus is of one head.
class OneHeadSink : public ScanSink {
 public:
  OneHeadSink(std::string head, std::unique_ptr<ScanSink> to)
      : head_(std::move(head)), to_(std::move(to)) {}
  using ScanSink::write;
  SinkNeeds needs() const override { return to_->needs(); }
  void set_events(const EventPort& events) override { to_->set_events(events); }
  void open(const HeadInfo& head) override {
    if (head.head == head_) to_->open(head);
  }
  void write(const PolarScan& scan) override {
    if (scan.head() == head_) to_->write(scan);
  }
  void finish() override { to_->finish(); }

 private:
  std::string head_;
  std::unique_ptr<ScanSink> to_;
};

}  // namespace

LiveHeads::LiveHeads(std::vector<LiveHead> heads, const GuidanceConfig& config,
                     const std::filesystem::path& record, const EventPort& events)
    : named_(std::move(heads)),
      events_(events),
      inputs_(named_.size() + 1, patience_of(config)),
      bus_(events) {
  for (const GuidanceBeam& beam : config.beams) {
    const bool is_there = std::any_of(named_.begin(), named_.end(),
                                      [&](const LiveHead& one) { return one.name == beam.head; });
    if (is_there) continue;
    throw Error(ErrorKind::kUsage,
                beam.head.empty()
                    ? fmt::format("beam '{}' has no head: in guidance.yaml", beam.name)
                    : fmt::format("beam '{}' is of head '{}'; expected --head {}=SOURCE", beam.name,
                                  beam.head, beam.head));
  }
  bus_.add("guidance", std::make_unique<BeamSink>(*this, config.beams));
  for (std::size_t i = 0; i < named_.size(); ++i) add(i, config, record);
  if (is_encoder(config)) return;
  odometer_ =
      open_odometer_port(config.odometer_source, config.odometer.bits, events_,
                         [this](const LiveInput& input) { inputs_.give(named_.size(), input); });
}

LiveHeads::~LiveHeads() {
  try {
    finish();
  } catch (const std::exception& error) {
    say(error.what());
  }
}

void LiveHeads::add(std::size_t index, const GuidanceConfig& config,
                    const std::filesystem::path& record) {
  ScannerArguments arguments;
  arguments.model = named_[index].model;
  arguments.given = named_[index].options;
  load_model(named_[index].model);  // Before the camera is there.
  auto running = std::make_unique<Running>(named_[index], arguments);
  Running& head = *running;
  HeadParts parts;
  parts.open = [this, &head, index](const EventPort& port) {
    inputs_.leave(index);
    head.encoder.open_again();
    return open_source(opened_by_its_head(head.named.source), port);
  };
  parts.make_scanner = [this, &head](const SourceInfo& source, const EventPort& port) {
    if (source.is_live) is_live_ = true;
    return head.settings.make(source, port);
  };
  if (is_encoder(config) && index == 0) {
    const bool counts_up = config.odometer.counts_per_m > 0.0;
    parts.before_scan = [&head, counts_up](const Frame& frame) {
      if (!frame.encoder_counts) return;
      head.add({frame.time.seconds(), head.encoder.continued(*frame.encoder_counts, counts_up),
                std::numeric_limits<double>::quiet_NaN()});
    };
  }
  HeadOptions options;
  options.name = head.named.name;
  options.reopens = is_of_a_clock(head.named.source);
  options.events = events_.of_head(head.named.name);
  head.head = std::make_unique<Head>(std::move(parts), std::move(options), bus_);
  heads_.push_back(std::move(running));
  if (record.empty()) return;
  const std::string file = (record / (head.named.name + ".mcap")).string();
  bus_.add("mcap:" + file,
           std::make_unique<OneHeadSink>(head.named.name, open_sink("mcap:" + file)));
}

void LiveHeads::give_readings(std::size_t head, double until_s) {
  while (const auto reading = heads_[head]->take_reading(until_s)) inputs_.give(head, *reading);
}

void LiveHeads::start() {
  for (const auto& head : heads_) head->head->start();
}

bool LiveHeads::is_any_running() const {
  return std::any_of(heads_.begin(), heads_.end(),
                     [](const auto& head) { return head->head->is_running(); });
}

void LiveHeads::switch_lasers_off() {
  for (const auto& head : heads_) {
    try {
      head->head->switch_lasers(false);
    } catch (const Error&) {
      head->head->pause();  // Nothing to switch: the camera's lines go down with it.
    }
  }
}

void LiveHeads::finish() {
  if (std::exchange(is_finished_, true)) return;
  odometer_.reset();
  for (const auto& head : heads_) head->head->request_stop();
  std::exception_ptr failure;
  for (const auto& head : heads_) {
    try {
      head->head->wait();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  bus_.finish();
  for (std::size_t i = 0; i < heads_.size(); ++i) {
    give_readings(i, std::numeric_limits<double>::infinity());
  }
  inputs_.close();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace striper::program
