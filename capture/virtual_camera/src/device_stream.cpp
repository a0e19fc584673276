// SPDX-License-Identifier: Apache-2.0
// The virtual camera's frames: when they are taken, what lights them, how they are sent.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <opencv2/core.hpp>

#include <striper/core/frame.hpp>

#include "device.hpp"
#include "gige/pictures/pixel_layout.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

constexpr std::size_t kPacketOverhead = 36;  // IP, UDP and GVSP

std::chrono::steady_clock::time_point at_ns(std::int64_t monotonic_ns) {
  return std::chrono::steady_clock::time_point(std::chrono::nanoseconds(monotonic_ns));
}

/// Block ids are 1 to 65535 and then 1 again.
std::uint16_t block_id_of(std::uint64_t number) {
  return static_cast<std::uint16_t>(number % 0xffff + 1);
}

cv::Mat binned(const cv::Mat& image, cv::Size binning) {
  if (binning == cv::Size(1, 1)) return image;
  cv::Mat result(image.rows / binning.height, image.cols / binning.width, image.type());
  const auto value = [&](int v, int u) {
    return image.depth() == CV_8U ? static_cast<int>(image.at<std::uint8_t>(v, u))
                                  : static_cast<int>(image.at<std::uint16_t>(v, u));
  };
  for (int v = 0; v < result.rows; ++v) {
    for (int u = 0; u < result.cols; ++u) {
      int sum = 0;
      for (int y = 0; y < binning.height; ++y) {
        for (int x = 0; x < binning.width; ++x) {
          sum += value(v * binning.height + y, u * binning.width + x);
        }
      }
      const int mean = sum / binning.area();
      if (image.depth() == CV_8U) {
        result.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(mean);
      } else {
        result.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(mean);
      }
    }
  }
  return result;
}

/// To the format's bits: the most significant ones are kept.
cv::Mat at_depth(const cv::Mat& image, int from_bits, const PixelLayout& layout, double gain,
                 double black) {
  const double scale = std::ldexp(gain, layout.bit_depth - from_bits);
  if (scale == 1.0 && black == 0.0 && image.type() == layout.mat_type()) return image;
  cv::Mat result;
  image.convertTo(result, layout.mat_type(), scale, black);
  const int full_scale = full_scale_dn(layout.bit_depth);
  if (result.depth() == CV_16U && layout.bit_depth < 16) cv::min(result, full_scale, result);
  return result;
}

}  // namespace

/// The camera's own clock or, where it follows the network's, PTP's: this host's UTC as TAI.
std::int64_t Device::device_time_ns(const CameraState& state, std::int64_t host_ns) const {
  constexpr std::int64_t kTaiAhead_ns = 37'000'000'000;
  if (state.ptp_status_at(host_ns) == PtpStatus::kSlave) {
    return host_ns + utc_offset_now_ns() + kTaiAhead_ns + faults_.ptp_offset_ns;
  }
  return host_ns + faults_.clock_offset_ns +
         static_cast<std::int64_t>(options_.clock_skew * static_cast<double>(host_ns));
}

void Device::acquire(bool is_acquiring) {
  if (is_acquiring && !state_.is_acquiring) {
    next_number_ = 0;
    triggers_ = 0;
    sequencer_at_ = state_.sequencer_start;
    due_ns_ = monotonic_now_ns();
  }
  state_.is_acquiring = is_acquiring;
}

void Device::trigger(TriggerSource source) {
  if (state_.trigger_source == source) ++triggers_;
}

void Device::run_stream() {
  std::unique_lock lock(mutex_);
  while (!is_ending_) {
    if (!wait_for_exposure(lock)) continue;
    const Exposure exposure = open_shutter();
    lock.unlock();
    take_and_send(exposure);
    lock.lock();
  }
}

/// @return false where something else happened than an exposure that is due.
bool Device::wait_for_exposure(std::unique_lock<std::mutex>& lock) {
  if (!state_.is_acquiring) {
    changed_.wait(lock, [this] { return is_ending_ || state_.is_acquiring; });
    return false;
  }
  if (state_.is_triggered) {
    changed_.wait(lock, [this] {
      return is_ending_ || !state_.is_acquiring || !state_.is_triggered || triggers_ > 0;
    });
    if (triggers_ == 0) return false;
    --triggers_;
    return !is_ending_ && state_.is_acquiring;
  }
  if (monotonic_now_ns() < due_ns_) {
    changed_.wait_until(lock, at_ns(due_ns_));
    return false;
  }
  return true;
}

/// A camera's shutter keeps time even where the computer that plays it is busy: a free-running
/// exposure began when it was due, and those that follow are not put off.
std::int64_t Device::begin_exposure_ns() {
  constexpr std::int64_t kHopelessly_ns = 1'000'000'000;
  const std::int64_t now_ns = monotonic_now_ns();
  if (state_.is_triggered) return now_ns;
  if (now_ns - due_ns_ > kHopelessly_ns) due_ns_ = now_ns;
  const std::int64_t begin_ns = due_ns_;
  due_ns_ += static_cast<std::int64_t>(1e12 / state_.rate_mhz);
  return begin_ns;
}

Device::Exposure Device::open_shutter() {
  Exposure exposure;
  exposure.number = next_number_++;
  exposure.block_id = block_id_of(exposure.number);
  exposure.begin_ns = begin_exposure_ns();
  if (state_.sequencer_is_on) {
    const SequencerSet& set = state_.sets[sequencer_at_];
    state_.sources = set.sources;
    state_.exposure_ns = set.exposure_ns;
    sequencer_at_ = set.next;
  }
  exposure.state = state_;
  exposure.line_status = state_.line_status(state_.sources);
  exposure.light = light_of(exposure);
  exposure.packet_bytes = word(gvcp::kStreamPacketSize) & 0xffff;
  exposure.packet_delay_ns = word(gvcp::kStreamPacketDelay);
  exposure.to = stream_destination();
  ++frames_;
  return exposure;
}

Illumination Device::light_of(const Exposure& exposure) const {
  if (!exposure.state.lines_are_commanded) return scene_->pattern().at(exposure.number);
  const std::uint32_t lasers = exposure.line_status >> kFirstLaserLine;
  if ((lasers & 1) != 0) return Illumination::laser(0);
  return (lasers & 2) != 0 ? Illumination::laser(1) : Illumination::dark();
}

void Device::take_and_send(const Exposure& exposure) {
  const std::int64_t exposure_ns = exposure.state.exposure_ns;
  const bool is_own = exposure_ns == std::llround(1e3 * scene_->shutter_us());
  const cv::Mat sensor = scene_->image(exposure.number, exposure.light,
                                       is_own ? 0.0 : 1e-3 * static_cast<double>(exposure_ns));
  const std::shared_ptr<SentFrame> frame = sender_.make_frame(payload_bytes(exposure.state));
  frame->timestamp = static_cast<std::uint64_t>(device_time_ns(exposure.state, exposure.begin_ns));
  frame->pixel_format = exposure.state.pixel_format;
  frame->region = exposure.state.region;
  frame->has_chunks = exposure.state.chunk_mode;
  frame->packet_payload = exposure.packet_bytes - kPacketOverhead;
  fill_payload(exposure, sensor, *frame);

  const std::int64_t shutter_closes_ns = exposure.begin_ns + exposure_ns;
  {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, at_ns(shutter_closes_ns),
                        [&] { return is_ending_ || monotonic_now_ns() >= shutter_closes_ns; });
    if (is_ending_ || !state_.is_acquiring || exposure.to.sin_port == 0) return;
  }
  if (exposure.packet_bytes <= static_cast<std::size_t>(options_.mtu)) {
    sender_.send(frame, exposure.block_id, exposure.to, exposure.packet_delay_ns);
  }
}

void Device::fill_payload(const Exposure& exposure, const cv::Mat& sensor, SentFrame& frame) {
  const CameraState& state = exposure.state;
  const PixelLayout& layout = *find_layout(state.pixel_format);
  const double gain = std::pow(10.0, 1e-3 * state.gain / 20.0);
  const cv::Mat region = binned(sensor, state.binning)(state.region);
  const cv::Mat pixels =
      at_depth(region, scene_->bit_depth(), layout, gain, static_cast<double>(state.black_level));
  frame.payload.resize(payload_bytes(state));
  pack(layout, pixels, frame.payload.data());
  if (!state.chunk_mode) return;

  const std::size_t image_bytes =
      layout.row_bytes(pixels.cols) * static_cast<std::size_t>(pixels.rows);
  std::uint8_t* at = frame.payload.data() + image_bytes;
  gvcp::put32(at, kImageChunk);
  gvcp::put32(at + 4, static_cast<std::uint32_t>(image_bytes));
  at += 8;
  const auto put_word = [&at](std::uint32_t id, std::uint32_t value) {
    gvcp::put32(at, value);
    gvcp::put32(at + 4, id);
    gvcp::put32(at + 8, 4);
    at += 12;
  };
  if (state.line_chunk) put_word(kLineChunk, exposure.line_status);
  if (state.encoder_chunk) put_word(kEncoderChunk, encoder_counts(exposure.begin_ns));
}

/// Of a wheel that turns evenly, since the camera was made; 32 bits, it wraps.
std::uint32_t Device::encoder_counts(std::int64_t time_ns) const noexcept {
  const double elapsed_s = 1e-9 * static_cast<double>(time_ns - born_ns_);
  const auto counts = std::llround(std::floor(options_.encoder_counts_per_s * elapsed_s));
  return static_cast<std::uint32_t>(counts);
}

}  // namespace striper::detail
