// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulated_source.hpp>

#include "simulated_controls.hpp"

namespace striper {
namespace {

constexpr long kMostFrames = 1'000'000'000'000L;

[[noreturn]] void refuse(const Uri& uri, std::string_view key, std::string_view value,
                         std::string_view expected) {
  throw Error(ErrorKind::kUsage,
              fmt::format("source '{}': {}={} - expected {}", uri.text(), key, value, expected));
}

/// Switches off all noises but those that are listed.
void keep_noises(const Uri& uri, const std::string& words, SensorNoise& noise) {
  SensorNoise kept{.shot = false, .read_noise_e = 0.0};
  std::size_t begin = words == "off" ? words.size() + 1 : 0;
  while (begin <= words.size()) {
    const std::size_t end = std::min(words.find(',', begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    begin = end + 1;
    if (word == "shot") {
      kept.shot = noise.shot;
    } else if (word == "read") {
      kept.read_noise_e = noise.read_noise_e;
    } else if (word == "prnu") {
      kept.prnu = noise.prnu;
    } else if (word == "speckle") {
      kept.speckle = noise.speckle;
    } else {
      refuse(uri, "noise", words, "off, or those to keep of shot, read, prnu, speckle");
    }
  }
  noise = kept;
}

ScanMode scan_mode(const Uri& uri, const std::string& word) {
  if (word == "progressive") return ScanMode::kProgressive;
  if (word == "split-top") return ScanMode::kTopFirst;
  if (word == "split-bottom") return ScanMode::kBottomFirst;
  if (word == "alternate-top") return ScanMode::kAlternateTopFirst;
  if (word == "alternate-bottom") return ScanMode::kAlternateBottomFirst;
  refuse(uri, "fields", word,
         "progressive, split-top, split-bottom, alternate-top or alternate-bottom");
}

void apply_query(Uri& uri, Scene& scene, SimulatedSourceOptions& options) {
  if (const auto frames = uri.take_integer("frames", 0, kMostFrames)) {
    options.frames = static_cast<std::uint64_t>(*frames);
  }
  if (const auto rate = uri.take_number("fps", 1e-3, 1e6)) scene.timing.picture_rate_hz = *rate;
  if (const auto seed = uri.take_integer("seed", 0, kMostFrames)) {
    scene.seed = static_cast<std::uint64_t>(*seed);
  }
  if (const auto noise = uri.take("noise")) keep_noises(uri, *noise, scene.imager.noise);
  if (const auto pattern = take_pattern(uri)) {
    options.pattern_given = true;
    if (!pattern->is_automatic()) scene.timing.pattern = *pattern;
  }
  if (const auto word = uri.take("illumination")) {
    if (*word != "unknown" && *word != "known") {
      refuse(uri, "illumination", *word, "known or unknown");
    }
    options.illumination_known = *word == "known";
  }
  if (const auto fields = uri.take("fields")) scene.timing.scan = scan_mode(uri, *fields);
  options.realtime = uri.take_bool("realtime").value_or(false);
  options.encoder_counts_per_m = uri.take_number("encoder", 1e-3, 1e9).value_or(0.0);
  const long bits = uri.take_integer("encoder_bits", 8, 32).value_or(options.encoder_bits);
  if (bits != 8 && bits != 16 && bits != 32)
    refuse(uri, "encoder_bits", std::to_string(bits), "8, 16 or 32");
  options.encoder_bits = static_cast<int>(bits);
  uri.refuse_unused(
      "frames, fps, seed, noise, laser, illumination, fields, realtime, encoder, encoder_bits");
}

Field field_of(ScanMode scan) {
  switch (scan) {
    case ScanMode::kTopFirst:
      return Field::kInterlacedTopFirst;
    case ScanMode::kBottomFirst:
      return Field::kInterlacedBottomFirst;
    case ScanMode::kAlternateTopFirst:
    case ScanMode::kAlternateBottomFirst:
      return Field::kTop;
    case ScanMode::kProgressive:
      break;
  }
  return Field::kProgressive;
}

}  // namespace

SimulatedSource::SimulatedSource(Simulator simulator, SimulatedSourceOptions options,
                                 std::string uri)
    : simulator_(std::move(simulator)),
      options_(options),
      uri_(uri.empty() ? "sim:" + simulator_.scene().name : std::move(uri)),
      controls_(std::make_unique<detail::SimulatedControls>(uri_, simulator_.scene())) {}

SimulatedSource::~SimulatedSource() = default;

Controls& SimulatedSource::controls() { return controls_->controls(); }

std::unique_ptr<SimulatedSource> SimulatedSource::open(Uri uri) {
  Scene scene = load_scene(uri.path());
  SimulatedSourceOptions options;
  apply_query(uri, scene, options);
  try {
    return std::make_unique<SimulatedSource>(Simulator(std::move(scene)), options, uri.text());
  } catch (const Error& error) {
    throw Error(ErrorKind::kUsage, fmt::format("source '{}': {}", uri.text(), error.what()));
  }
}

SourceInfo SimulatedSource::info() const {
  const Scene& scene = simulator_.scene();
  const Imager& imager = scene.imager;
  SourceInfo info;
  info.uri = uri_;
  info.description = fmt::format("simulated striper '{}'", scene.name);
  info.image_size = {imager.region.width / imager.binning.width,
                     imager.region.height / imager.binning.height / simulator_.parts_per_frame()};
  info.sensor_size = {scene.camera.width(), scene.camera.height()};
  info.bit_depth = imager.bit_depth;
  info.channels = 1;
  info.field = field_of(scene.timing.scan);
  info.picture_rate_hz = scene.timing.picture_rate_hz;
  info.pictures = options_.frames;
  if (options_.illumination_known || options_.pattern_given) info.pattern = scene.timing.pattern;
  return info;
}

void SimulatedSource::start() {
  const std::lock_guard lock(mutex_);
  if (running_) return;
  running_ = true;
  next_frame_ = 0;
  statistics_ = {};
  start_time_ = std::chrono::steady_clock::now();
}

NextStatus SimulatedSource::next(Frame& frame, std::chrono::milliseconds timeout) {
  const auto per_frame = static_cast<std::uint64_t>(simulator_.parts_per_frame());
  const std::uint64_t sequence = next_frame_ / per_frame;
  const int part = static_cast<int>(next_frame_ % per_frame);
  {
    std::unique_lock lock(mutex_);
    if (!running_) return NextStatus::kStopped;
    if (options_.frames && sequence >= *options_.frames) return NextStatus::kEnd;
    if (options_.realtime) {
      const auto due = start_time_ + std::chrono::nanoseconds(
                                         std::llround(1e9 * simulator_.time_s(sequence, part)));
      const auto end = std::chrono::steady_clock::now() + timeout;
      stopped_.wait_until(lock, std::min(due, end), [this] { return !running_; });
      if (!running_) return NextStatus::kStopped;
      if (due > end) return NextStatus::kTimeout;
    }
  }
  controls_->apply_to(simulator_);
  frame = simulator_.render(sequence, part);
  frame.encoder_counts = encoder_counts(sequence, part);
  if (!options_.illumination_known) frame.illumination = Illumination::unknown();
  ++next_frame_;
  const std::lock_guard lock(mutex_);
  ++statistics_.delivered;
  return NextStatus::kFrame;
}

// The length of the device's path: its velocity is constant.
std::optional<std::int64_t> SimulatedSource::encoder_counts(std::uint64_t sequence,
                                                            int part) const {
  if (options_.encoder_counts_per_m == 0.0) return std::nullopt;
  const double speed_m_s = simulator_.scene().device_motion.velocity_m_s.norm();
  const double path_m = speed_m_s * simulator_.time_s(sequence, part);
  const auto counts = static_cast<std::int64_t>(std::floor(options_.encoder_counts_per_m * path_m));
  return counts & ((std::int64_t{1} << options_.encoder_bits) - 1);
}

void SimulatedSource::stop() {
  {
    const std::lock_guard lock(mutex_);
    running_ = false;
  }
  stopped_.notify_all();
}

SourceStatistics SimulatedSource::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace striper
