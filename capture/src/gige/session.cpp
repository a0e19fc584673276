// SPDX-License-Identifier: Apache-2.0
#include "gige/session.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <pthread.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>

#include "gige/protocol/stream_socket.hpp"
#include "live/host_clock.hpp"

namespace striper::detail {
namespace {

using namespace std::chrono_literals;

// A camera is lost that is quiet for half a second and then does not answer so often, so long each
// time: within 2 s, with a busy computer's delays within 3 s.
constexpr auto kProbeWithin = 400ms;
constexpr int kProbes = 3;
constexpr auto kFrameBegins = 500ms;  // after the exposure, for a software trigger
constexpr std::int64_t kImplausible_ns = 2'000'000'000;

// A late thread loses packets. Without the right to ask for it this does nothing.
void raise_priority(const EventPort& events) {
  sched_param priority{};
  priority.sched_priority = 10;
  if (pthread_setschedparam(pthread_self(), SCHED_RR, &priority) != 0) {
    events.send({"thread_not_realtime",
                 "the stream thread is not real-time: give the program CAP_SYS_NICE (`setcap "
                 "cap_sys_nice+ep`) if frames are lost"});
  }
}

std::int64_t device_time_ns(const PoolSlot& slot) {
  return static_cast<std::int64_t>(arv_buffer_get_timestamp(slot.buffer.get()));
}

// A program that died may have left the camera streaming: then it takes no settings.
const FeatureAccess& at_rest(const FeatureAccess& features) {
  if (features.has("AcquisitionStop")) features.execute("AcquisitionStop");
  return features;
}

// Of a bracket; else 0.
std::int64_t longest_exposure_ns(const IlluminationPattern& pattern) {
  double longest_us = 0.0;
  for (std::size_t n = 0; n < pattern.entries().size(); ++n) {
    longest_us = std::max(longest_us, pattern.exposure_us_at(n));
  }
  return std::llround(1e3 * longest_us);
}

}  // namespace

Session::Session(const GigeOptions& options)
    : options_(options),
      opened_(open_camera(options)),
      holder_(access_of(opened_.address, kProbeWithin).holder),
      features_(arv_camera_get_device(opened_.camera.get()), "camera " + opened_.description,
                options_.events),
      lasers_(at_rest(features_), options),
      clock_(features_, features_mutex_, opened_.address, options.ptp) {
  try {
    setup_ = set_up_frames(features_, options);
    const std::int64_t longest_ns = longest_exposure_ns(options.pattern);
    exposure_ns_ = longest_ns > 0 ? longest_ns : setup_.exposure_ns;
    is_triggered_by_host_ = lasers_.is_host_switched() || options.trigger == "software";
    set_up_trigger(features_, options, is_triggered_by_host_);
    has_line_chunk_ = lasers_.enable_line_chunk();
    encoder_value_ = enable_encoder_chunk(features_, options);
    packet_bytes_ = set_up_transport(opened_.camera.get(), features_, options);
  } catch (...) {
    lasers_.try_off();
    throw;
  }
  const bool has_chunks = has_line_chunk_ || encoder_value_ != nullptr;
  if (has_chunks) chunks_.reset(arv_camera_create_chunk_parser(opened_.camera.get()));
  control_lost_handler_ = g_signal_connect(features_.device(), "control-lost",
                                           G_CALLBACK(&Session::on_control_lost), this);
}

Session::~Session() {
  stop();
  g_signal_handler_disconnect(features_.device(), control_lost_handler_);
  close_device();
}

/// Ends the heartbeat thread while everything that it may still call is here. While that thread
/// tells of a loss it holds the device: were it the last to let go, it would wait for its own end,
/// for which GLib ends the program.
void Session::close_device() noexcept {
  constexpr auto kToldWithin = 1s;
  const GPtr<ArvDevice> device = share(features_.device());
  chunks_.reset();
  opened_.camera.reset();
  const auto end = std::chrono::steady_clock::now() + kToldWithin;
  const auto is_held = [&] { return g_atomic_int_get(&G_OBJECT(device.get())->ref_count) > 1; };
  while (is_held() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(1ms);
  }
}

void Session::on_control_lost(ArvDevice*, void* self) {
  static_cast<Session*>(self)->lose("control of it was lost");
}

void Session::lose(const std::string& why) {
  std::function<void()> wake;
  {
    const std::lock_guard lock(mutex_);
    if (is_lost_) return;
    is_lost_ = true;
    loss_ = why;
    wake = wake_;
  }
  buffer_done_.notify_all();
  if (wake) wake();
}

std::string Session::loss() const {
  const std::lock_guard lock(mutex_);
  return loss_;
}

void Session::start(std::function<void()> wake) {
  {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
  }
  try {
    begin_streaming();
  } catch (...) {
    stop();  // a sequencer that was half programmed may fire already
    throw;
  }
}

void Session::begin_streaming() {
  CallError error;
  const guint payload = arv_camera_get_payload(opened_.camera.get(), error.slot());
  if (!error) {
    stream_.reset(arv_camera_create_stream(opened_.camera.get(), &Session::on_stream_event, this,
                                           error.slot()));
  }
  if (error || !stream_) {
    throw Error(ErrorKind::kDevice,
                fmt::format("camera {}: cannot stream: {}", description(), error.message()));
  }
  tune_stream();
  {
    const std::lock_guard lock(mutex_);  // Which Aravis' thread takes before it touches a slot.
    pool_ =
        std::make_shared<FramePool>(options_.buffers.value_or(enough_buffers(payload)), payload);
    arrivals_ = popped_ =
        0;  // What was left unread when it was last stopped is gone with its pool.
    is_awaiting_ = false;
    overrun_ = 0;
  }
  pool_->attach(stream_.get());
  clock_.start();
  {
    const std::lock_guard one_at_a_time(features_mutex_);
    if (lasers_on_) lasers_.arm();
    is_armed_ = true;
  }
  arv_camera_start_acquisition(opened_.camera.get(), error.slot());
  if (error) {
    throw Error(ErrorKind::kDevice,
                fmt::format("camera {}: cannot start: {}", description(), error.message()));
  }
  if (is_triggered_by_host_) {
    frame_within_ = frame_patience(payload);
    is_conducting_ = true;
    conductor_ = std::thread(&Session::conduct, this);
  }
}

int Session::enough_buffers(std::size_t payload_bytes) const noexcept {
  constexpr int kLeast = 16;
  constexpr double kReaderLate_s = 0.5;
  constexpr std::size_t kMostBytes = std::size_t{256} << 20;
  const std::size_t affordable_whole = kMostBytes / std::max<std::size_t>(1, payload_bytes);
  const auto affordable = static_cast<double>(affordable_whole);
  return std::max(kLeast, static_cast<int>(std::min(kReaderLate_s * setup_.rate_hz, affordable)));
}

void Session::tune_stream() {
  if (arv_camera_is_gv_device(opened_.camera.get()) == FALSE) return;
  // Aravis leaves the socket's buffer alone then: we set it, past net.core.rmem_max where we may.
  g_object_set(
      stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", 0,
      "packet-resend",
      options_.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
      "frame-retention", static_cast<guint>(1000 * options_.frame_timeout.count()), nullptr);
  const int port = arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get()));
  const int wanted = options_.socket_buffer_mb << 20;
  socket_buffer_bytes_ = set_receive_buffer(port, wanted);
  if (wanted > 0 && socket_buffer_bytes_ < wanted) {
    options_.events.send(
        {"socket_buffer_small",
         fmt::format(
             "camera {}: the socket's buffer is {} kB instead of {} kB, packets may be lost: "
             "`sysctl -w net.core.rmem_max={}`",
             description(), socket_buffer_bytes_ >> 10, wanted >> 10, wanted)});
  }
}

void Session::stop() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_conducting_ = false;
  }
  buffer_done_.notify_all();
  if (conductor_.joinable()) conductor_.join();
  clock_.stop();
  bool is_off = false;
  // Aravis would ask a camera that is gone for three seconds, for each of these.
  if (!is_lost_ && ask().state != AccessState::kSilent) {
    // Both are tried whatever becomes of the other: no exposure, and no line that follows one.
    CallError error;
    if (stream_) arv_camera_stop_acquisition(opened_.camera.get(), error.slot());
    const std::lock_guard one_at_a_time(features_mutex_);
    is_armed_ = false;
    is_off = lasers_.try_off();
  }
  if (!is_off) darken();  // lost, or it is now seen to be
  if (stream_) {
    counted_ = {};
    count_stream(counted_);
  }
  if (pool_) pool_->detach();
  // Ends its thread, which calls us and finds `stream_` as it was.
  if (stream_) g_object_unref(stream_.get());
  static_cast<void>(stream_.release());
}

void Session::darken() noexcept {
  if (!lasers_.is_used() || tries_to_darken_ == 0) return;
  try {
    Access access;
    if (opened_.address != 0) {
      // Aravis asks a silent camera for seconds.
      access = access_of(opened_.address, kProbeWithin);
      if (access.state == AccessState::kSilent) return;
    }
    --tries_to_darken_;
    if (!may_command(access)) return;
    const std::lock_guard one_at_a_time(features_mutex_);
    const bool is_free = opened_.address != 0 && access.state == AccessState::kFree;
    ArvGvDevice* const device = is_free ? ARV_GV_DEVICE(features_.device()) : nullptr;
    if (is_free) arv_gv_device_take_control(device, nullptr);
    if (stream_) arv_camera_stop_acquisition(opened_.camera.get(), nullptr);
    if (lasers_.try_off()) {
      tries_to_darken_ = 0;
      options_.events.send(
          {"laser_off", fmt::format("camera {} is lost but answers: its lasers were commanded off",
                                    description())});
    }
    if (is_free) arv_gv_device_leave_control(device, nullptr);
  } catch (const std::exception& failure) {
    options_.events.send(
        {"laser_not_off", fmt::format("camera {}: cannot command the laser off: {}", description(),
                                      failure.what())});
  }
}

bool Session::may_command(const Access& access) {
  if (access.holder.empty() || access.holder == holder_) return true;
  tries_to_darken_ = 0;
  options_.events.send(
      {"laser_not_off",
       fmt::format("camera {}: its lasers cannot be commanded off: another program ({}) holds it",
                   description(), access.holder)});
  return false;
}

PoolSlot* Session::pop() {
  const std::lock_guard lock(mutex_);
  // Aravis queues a buffer and then tells us of it: one that it has not told of is not ready.
  if (!stream_ || popped_ == arrivals_) return nullptr;
  ArvBuffer* const buffer = arv_stream_try_pop_buffer(stream_.get());
  if (buffer == nullptr) return nullptr;
  ++popped_;
  PoolSlot& slot = FramePool::slot_of(buffer);
  g_object_unref(buffer);  // the slot holds a reference of its own
  return &slot;
}

void Session::on_stream_event(void* self, ArvStreamCallbackType type, ArvBuffer* buffer) {
  auto& session = *static_cast<Session*>(self);
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT) raise_priority(session.options_.events);
  if (type == ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE && buffer != nullptr) {
    session.on_buffer_done(buffer);
  }
}

void Session::on_buffer_done(ArvBuffer* buffer) {
  PoolSlot& slot = FramePool::slot_of(buffer);
  const std::int64_t now_ns = monotonic_now_ns();
  const auto first_packet_ns =
      static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer)) - utc_offset_now_ns();
  const bool is_plausible = first_packet_ns <= now_ns && now_ns - first_packet_ns < kImplausible_ns;
  last_arrival_ns_ = now_ns;
  {
    const std::lock_guard lock(mutex_);
    slot.arrival_ns = is_plausible ? first_packet_ns : now_ns;
    slot.completed_ns = now_ns;
    slot.arrival = arrivals_++;
    // What began to come before the trigger is the frame of an earlier one.
    constexpr std::int64_t kClocksDiffer_ns = 1'000'000;
    const bool is_late = is_awaiting_ && slot.arrival_ns + kClocksDiffer_ns < trigger_.sent_ns;
    const bool is_overdue = is_late && slot.arrival_ns + kClocksDiffer_ns >= overdue_.sent_ns;
    const bool is_awaited = is_awaiting_ && !is_late;
    slot.trigger = is_late ? overdue_.number : trigger_.number;
    slot.commanded = is_awaited   ? trigger_.commanded
                     : is_overdue ? overdue_.commanded
                                  : Illumination::unknown();
    if (is_awaited) is_awaiting_ = false;
  }
  buffer_done_.notify_all();

  // Nobody asks in time: the oldest frame makes room for the next.
  gint to_fill = 0;
  gint filled = 0;
  arv_stream_get_n_buffers(stream_.get(), &to_fill, &filled);
  if (to_fill < 2 && filled > 1) {
    if (PoolSlot* const oldest = pop()) {
      ++overrun_;
      pool_->give_back(*oldest);
    }
  }
  wake_();
}

Access Session::ask() const {
  Access access;
  if (opened_.address == 0) access.state = AccessState::kHeld;  // USB tells by itself.
  for (int probe = 0; probe < kProbes && access.state == AccessState::kSilent; ++probe) {
    access = access_of(opened_.address, kProbeWithin);
  }
  return access;
}

void Session::check_alive() {
  if (is_lost_ || opened_.address == 0) return;
  const Access access = ask();
  if (access.state == AccessState::kSilent) lose("it does not answer");
  if (access.state == AccessState::kFree) {
    lose("it has forgotten us (it was restarted, or our heartbeats did not arrive)");
  }
  // After a restart somebody else may have been faster.
  if (!access.holder.empty() && access.holder != holder_) {
    lose(fmt::format("another program ({}) has taken it", access.holder));
  }
}

std::int64_t Session::exposure_start_ns(const PoolSlot& slot, std::int64_t exposure_ns) {
  return clock_.exposure_start_ns(device_time_ns(slot), slot.arrival_ns, exposure_ns);
}

std::int64_t Session::utc_offset_ns(const PoolSlot& slot, std::int64_t start_ns) const {
  return clock_.utc_offset_ns(device_time_ns(slot), start_ns);
}

Illumination Session::illumination(const PoolSlot& slot, std::uint64_t since_start) {
  if (has_line_chunk_) {
    CallError error;
    const gint64 lines = arv_chunk_parser_get_integer_value(chunks_.get(), slot.buffer.get(),
                                                            "ChunkLineStatusAll", error.slot());
    if (!error) return lasers_.from_line_status(lines);
  }
  if (lasers_.is_host_switched()) return slot.commanded;
  return were_switched_ ? Illumination::unknown() : lasers_.at(since_start);
}

std::optional<std::int64_t> Session::encoder_counts(const PoolSlot& slot) const {
  if (encoder_value_ == nullptr) return std::nullopt;
  CallError error;
  const gint64 counts = arv_chunk_parser_get_integer_value(chunks_.get(), slot.buffer.get(),
                                                           encoder_value_, error.slot());
  if (error) return std::nullopt;
  return counts;
}

void Session::set_exposure_us(double exposure_us) {
  if (options_.pattern.is_bracket()) {
    throw Error(ErrorKind::kUnsupported,
                fmt::format("{}: exposure_us={} - the exposures are those of laser={}, which the "
                            "camera's sequencer holds: open it again with others",
                            features_.device_name(), exposure_us, options_.pattern.to_string()));
  }
  const std::lock_guard one_at_a_time(features_mutex_);
  set_exposure(features_, exposure_us);
  if (const char* const name = features_.first_of({"ExposureTime", "ExposureTimeAbs"})) {
    exposure_ns_ = std::llround(1e3 * features_.number(name));
  }
}

void Session::switch_lasers(bool on) {
  const std::lock_guard one_at_a_time(features_mutex_);
  if (lasers_on_ == on) return;
  lasers_on_ = on;
  were_switched_ = true;
  if (!on) lasers_.off();
  if (on && is_armed_) lasers_.arm();
}

void Session::trigger_once(std::uint64_t number) {
  const std::lock_guard one_at_a_time(features_mutex_);
  const Illumination light = lasers_on_ ? options_.pattern.at(number) : Illumination::dark();
  if (is_lost_) return;  // the lasers may have been turned off for good
  if (lasers_.is_host_switched()) lasers_.command(light);
  {
    const std::lock_guard lock(mutex_);
    overdue_ = trigger_;
    trigger_ = {number, light, monotonic_now_ns()};
    is_awaiting_ = true;
  }
  features_.execute("TriggerSoftware");
}

/// Until a frame has come whole, on a slow link too, or is given up.
std::chrono::nanoseconds Session::frame_patience(std::size_t payload_bytes) const {
  constexpr double kSlowestLink_bytes_s = 100e6 / 8;
  const auto bytes = static_cast<double>(payload_bytes);
  const double packets = bytes / std::max(packet_bytes_, 576);
  const double pauses_s = 1e-6 * packets * options_.packet_delay_us.value_or(0.0);
  const std::chrono::duration<double> transfer(bytes / kSlowestLink_bytes_s + pauses_s);
  return std::chrono::nanoseconds(exposure_ns_) + kFrameBegins + options_.frame_timeout +
         std::chrono::duration_cast<std::chrono::nanoseconds>(transfer);
}

void Session::conduct() {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::nanoseconds(
      options_.frame_rate_hz ? static_cast<std::int64_t>(1e9 / *options_.frame_rate_hz) : 0);
  auto due = Clock::now();
  try {
    for (std::uint64_t number = 0; !is_lost_; ++number) {
      {
        std::unique_lock lock(mutex_);
        buffer_done_.wait_until(lock, due, [this] { return !is_conducting_; });
        if (!is_conducting_) return;
      }
      trigger_once(number);
      std::unique_lock lock(mutex_);
      buffer_done_.wait_for(lock, frame_within_,
                            [this] { return !is_awaiting_ || !is_conducting_ || is_lost_; });
      is_awaiting_ = false;
      due += period;
      if (Clock::now() - due > 1s) due = Clock::now();  // no use in catching up
    }
  } catch (const std::exception& failure) {
    lose(fmt::format("it does not take triggers: {}", failure.what()));
  }
}

void Session::add_to(GigeStatistics& sum) const {
  sum.packet_bytes = packet_bytes_;
  sum.socket_buffer_bytes = socket_buffer_bytes_;
  sum.clock_rate = clock_.rate();
  if (stream_) return count_stream(sum);
  sum.underrun += counted_.underrun;
  sum.resend_requests += counted_.resend_requests;
  sum.resent_packets += counted_.resent_packets;
  sum.socket_drops += counted_.socket_drops;
}

void Session::count_stream(GigeStatistics& sum) const {
  const auto info = [&](const char* name) {
    return arv_stream_get_info_uint64_by_name(stream_.get(), name);
  };
  sum.underrun += info("n_underruns");
  if (!ARV_IS_GV_STREAM(stream_.get())) return;
  sum.resend_requests += info("n_resend_requests");
  sum.resent_packets += info("n_resent_packets");
  const int port = arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get()));
  sum.socket_drops += receive_drops(port).value_or(0);
}

}  // namespace striper::detail
