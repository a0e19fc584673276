// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <future>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>
#include <striper/gige/gige_source.hpp>

#include "capture/common_keys.hpp"
#include "capture/frame_counts.hpp"
#include "gige/pictures/frame_numbers.hpp"
#include "gige/session.hpp"
#include "gige/source_controls.hpp"
#include "live/host_clock.hpp"
#include "live/reopening.hpp"

namespace striper {
namespace {

using namespace std::chrono_literals;
using detail::PoolSlot;
using detail::Session;

constexpr auto kRound = 100ms;                   // of the supervisor
constexpr std::int64_t kQuiet_ns = 500'000'000;  // without a frame: ask the camera
constexpr detail::Reopening::Pauses kPauses{100ms, 2000ms};

/// What the stream says of a frame that is not whole.
struct FrameFault {
  FrameStatus status;
  const char* detail;
};

FrameFault fault_of(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_SUCCESS:
      return {FrameStatus::kOk, ""};
    case ARV_BUFFER_STATUS_TIMEOUT:
      return {FrameStatus::kIncomplete, "packets did not arrive in time"};
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return {FrameStatus::kIncomplete, "packets are missing"};
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return {FrameStatus::kWrongSize, "more data than the image has"};
    case ARV_BUFFER_STATUS_ABORTED:
      return {FrameStatus::kIncomplete, "the stream was stopped"};
    default:
      return {FrameStatus::kCorrupt, "a packet that does not belong there"};
  }
}

std::string image_name(const detail::FrameSetup& setup) {
  return fmt::format("{} {}x{}", setup.layout->name, setup.size.width, setup.size.height);
}

detail::StreamKind kind_of(const detail::FrameSetup& setup) {
  return {setup.size,    setup.sensor_size, setup.layout->bit_depth, setup.layout->channels(),
          /*layout=*/"", image_name(setup)};
}

// What is likely to be meant otherwise, while nothing in the images speaks against it.
void say_what_keys_mean(const detail::CommonKeys& common, const GigeOptions& options) {
  const bool is_triggered = !options.trigger.empty() && options.trigger != "off";
  if (common.pattern.has_dark() && options.strobe_lines.empty() && !is_triggered) {
    options.events.send(
        {"laser_not_switched",
         fmt::format("'{}': laser={} without strobe= switches nothing; it says what something else "
                     "does with the laser, in step with the frames. For a laser on one of the "
                     "camera's own lines name that: strobe=Line2",
                     options.uri, common.pattern.to_string())});
  }
  if (common.fields) {
    options.events.send(
        {"setting_unlikely",
         fmt::format("'{}': fields= takes each frame as two fields, exposed one after the other. "
                     "Nearly all cameras of this kind expose whole frames, in which both show the "
                     "same moment: then leave it out",
                     options.uri)});
  }
}

}  // namespace

struct GigeSource::State {
  explicit State(GigeOptions given);

  Controls make_controls();
  std::shared_ptr<Session> open_session();

  void begin();
  void end();
  void wake();
  bool wait_for_news(std::uint64_t seen, std::chrono::steady_clock::time_point deadline);

  void supervise();
  bool pause(std::chrono::milliseconds time);
  void look_after(Session& camera);
  void close_in_background(std::shared_ptr<Session> camera);
  bool try_reopen();
  void end_stream(const Session& camera);

  bool give_next(Frame& frame);
  bool fill(Frame& frame, PoolSlot& slot);
  void describe(Frame& frame, PoolSlot& slot, std::uint64_t since_start);
  void fill_image(Frame& frame, PoolSlot& slot);
  void count(const Frame& frame, ArvBufferStatus status, std::uint64_t missing);

  GigeOptions options;
  detail::CommonKeys common;
  SourceInfo info;

  std::mutex lifecycle;  // one start or stop at a time

  // News are what `next` waits for: a frame, or the end. Their mutex is held for moments only,
  // since the stream's thread takes it.
  std::mutex news_mutex;
  std::condition_variable news_came;
  std::uint64_t news = 0;
  std::atomic<bool> is_running = false;
  std::atomic<bool> has_ended = false;  // A lost camera that is not to be opened again.

  mutable std::mutex mutex;          // of all that follows
  std::shared_ptr<Session> session;  // null while the camera is lost
  detail::FrameNumbers numbers;
  std::uint64_t next_arrival = 0;
  std::uint32_t epoch = 0;
  std::int64_t completed_ns = 0;
  GigeStatistics causes;
  detail::KeptSettings kept;

  detail::FrameCounts counts;
  Controls controls;

  std::thread supervisor;                  // and what only it uses
  std::vector<std::future<void>> closing;  // Of lost cameras; the supervisor's alone.
  std::optional<detail::Reopening> reopening;
  std::int64_t numbered_until_ns = 0;  // of a camera that is lost
};

GigeSource::State::State(GigeOptions given)
    : options(std::move(given)), common{options.pattern, options.fields} {
  if (options.uri.empty()) options.uri = (options.is_usb ? "u3v:" : "gige:") + options.name;
  options.validate();
  say_what_keys_mean(common, options);
  session = std::make_shared<Session>(options);

  const detail::FrameSetup& setup = session->setup();
  info.uri = options.uri;
  info.description = fmt::format("{}, {}", session->description(), image_name(setup));
  info.image_size = setup.size;
  info.sensor_size = setup.sensor_size;
  info.bit_depth = setup.layout->bit_depth;
  info.channels = setup.layout->channels();
  info.is_live = true;
  info.has_clock = true;
  info.picture_rate_hz = setup.rate_hz;
  common.apply(info);
  controls = make_controls();
  constexpr double kForever_s = std::numeric_limits<double>::infinity();
  reopening.emplace(options.events, "camera " + session->description(), kind_of(setup), kPauses,
                    options.reconnect ? kForever_s : 0.0);
}

Controls GigeSource::State::make_controls() {
  detail::ControlledCamera camera;
  camera.session = [this] {
    const std::lock_guard lock(mutex);
    if (session && !session->is_lost()) return session;
    throw Error(ErrorKind::kDevice,
                fmt::format("source '{}': the camera is lost: nothing can be read or set until it "
                            "is back",
                            options.uri));
  };
  camera.keep = [this](const auto& change) {
    const std::lock_guard lock(mutex);
    change(kept);
  };
  return detail::make_controls(options.uri, camera);
}

/// With what was set by hand since it was opened first.
std::shared_ptr<Session> GigeSource::State::open_session() {
  GigeOptions as_set = options;
  bool lasers_on = true;
  {
    const std::lock_guard lock(mutex);
    if (kept.exposure_us) as_set.exposure_us = kept.exposure_us;
    if (kept.gain_db) as_set.gain = kept.gain_db;
    lasers_on = kept.lasers_on;
  }
  auto opened = std::make_shared<Session>(as_set);
  if (!lasers_on) opened->switch_lasers(false);
  return opened;
}

GigeSource::GigeSource(GigeOptions options) : state_(std::make_unique<State>(std::move(options))) {}

GigeSource::~GigeSource() { state_->end(); }

SourceInfo GigeSource::info() const { return state_->info; }

void GigeSource::start() { state_->begin(); }

void GigeSource::stop() { state_->end(); }

void GigeSource::State::begin() {
  const std::lock_guard one_at_a_time(lifecycle);
  if (is_running) return;
  if (session && session->is_lost()) session.reset();
  if (!session) session = open_session();
  numbers = detail::FrameNumbers(std::max<std::size_t>(common.pattern.entries().size(), 1));
  next_arrival = 0;
  epoch = 0;
  completed_ns = 0;
  counts.reset();
  causes = {};
  session->start([this] { wake(); });
  has_ended = false;
  is_running = true;
  supervisor = std::thread(&State::supervise, this);
}

void GigeSource::State::end() {
  const std::lock_guard one_at_a_time(lifecycle);
  if (!is_running) return;
  is_running = false;
  wake();
  supervisor.join();
  const std::lock_guard lock(mutex);
  if (session) session->stop();
}

void GigeSource::State::wake() {
  {
    const std::lock_guard lock(news_mutex);
    ++news;
  }
  news_came.notify_all();
}

/// @return false when the time is over.
bool GigeSource::State::wait_for_news(std::uint64_t seen,
                                      std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(news_mutex);
  return news_came.wait_until(lock, deadline, [&] { return news != seen; });
}

NextStatus GigeSource::next(Frame& frame, std::chrono::milliseconds timeout) {
  State& s = *state_;
  frame.image = cv::Mat();
  frame.lease.reset();
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (s.is_running) {
    std::uint64_t seen = 0;
    {
      const std::lock_guard lock(s.news_mutex);
      seen = s.news;
    }
    if (s.give_next(frame)) return NextStatus::kFrame;
    if (s.has_ended) return NextStatus::kEnd;
    if (!s.wait_for_news(seen, deadline)) {
      return s.is_running ? NextStatus::kTimeout : NextStatus::kStopped;
    }
  }
  return NextStatus::kStopped;
}

bool GigeSource::State::give_next(Frame& frame) {
  const std::lock_guard lock(mutex);
  if (!is_running || !session) return false;
  while (PoolSlot* const slot = session->pop()) {
    if (fill(frame, *slot)) return true;
  }
  return false;
}

/// @return false for what is left of a frame that was given already, or given up.
bool GigeSource::State::fill(Frame& frame, PoolSlot& slot) {
  const ArvBufferStatus status = arv_buffer_get_status(slot.buffer.get());
  const std::uint64_t id =
      session->numbers_by_trigger() ? slot.trigger + 1 : arv_buffer_get_frame_id(slot.buffer.get());
  const detail::FrameNumbers::Number number = numbers.next(id);
  const std::uint64_t discarded = slot.arrival - next_arrival;
  next_arrival = slot.arrival + 1;
  if (number.is_late) {
    session->pool().give_back(slot);
    return false;
  }

  const FrameFault fault = fault_of(status);
  frame.status = fault.status;
  frame.status_detail = fault.detail;
  frame.sequence = number.sequence;
  completed_ns = slot.completed_ns;
  describe(frame, slot, number.since_start);
  if (frame.status == FrameStatus::kOk) fill_image(frame, slot);
  if (!frame.lease) session->pool().give_back(slot);
  count(frame, status, number.missing > discarded ? number.missing - discarded : 0);
  return true;
}

void GigeSource::State::describe(Frame& frame, PoolSlot& slot, std::uint64_t since_start) {
  const detail::FrameSetup& setup = session->setup();
  frame.bit_depth = setup.layout->bit_depth;
  frame.sensor_size = setup.sensor_size;
  frame.grid = setup.grid;
  frame.exposure_in_picture = 0;
  frame.exposures_per_picture = 1;
  frame.field = Field::kProgressive;
  frame.field_period_ns = 0;
  frame.exposure_ns = session->exposure_ns();
  frame.illumination = Illumination::unknown();
  const double period_ns = setup.rate_hz > 0.0 ? 1e9 / setup.rate_hz : 0.0;
  common.apply(frame, static_cast<std::int64_t>(period_ns));
  const std::int64_t start_ns = session->exposure_start_ns(slot, frame.exposure_ns);
  frame.time.monotonic_ns = start_ns + frame.exposure_ns / 2;
  frame.time.utc_offset_ns = session->utc_offset_ns(slot, start_ns);
  frame.epoch = epoch;
  frame.encoder_counts.reset();
  if (frame.status == FrameStatus::kOk) frame.encoder_counts = session->encoder_counts(slot);
  const bool lasers_are_ours = !options.strobe_lines.empty();
  if (lasers_are_ours && frame.status == FrameStatus::kOk) {
    frame.illumination = session->illumination(slot, since_start);
  }
}

void GigeSource::State::fill_image(Frame& frame, PoolSlot& slot) {
  const detail::FrameSetup& setup = session->setup();
  ArvBuffer* const buffer = slot.buffer.get();
  const cv::Size size(arv_buffer_get_image_width(buffer), arv_buffer_get_image_height(buffer));
  const auto format = static_cast<std::uint32_t>(arv_buffer_get_image_pixel_format(buffer));
  std::size_t bytes = 0;
  const void* const data = arv_buffer_get_image_data(buffer, &bytes);
  const std::size_t needed =
      setup.layout->row_bytes(setup.size.width) * static_cast<std::size_t>(setup.size.height);
  if (size != setup.size || format != setup.layout->code || bytes < needed || data == nullptr) {
    frame.status = FrameStatus::kWrongSize;
    frame.status_detail = fmt::format("{}x{} pixels of format 0x{:08x}, {} bytes", size.width,
                                      size.height, format, bytes);
    return;
  }
  if (setup.layout->is_direct()) {
    // OpenCV wants a mutable pointer; frames are read-only by agreement.
    frame.image = detail::wrap(*setup.layout, size, const_cast<void*>(data));
  } else {
    detail::unpack(*setup.layout, size, static_cast<const std::uint8_t*>(data), slot.scratch,
                   slot.unpacked);
    frame.image = slot.unpacked;
  }
  if (session->pool().can_lease()) {
    frame.lease = session->pool().lease(slot);
  } else {
    frame.image = frame.image.clone();  // a reader that keeps many frames
  }
}

void GigeSource::State::count(const Frame& frame, ArvBufferStatus status, std::uint64_t missing) {
  counts.deliver(frame);
  counts.drop(missing);
  if (status == ARV_BUFFER_STATUS_TIMEOUT) ++causes.timeouts;
  if (status == ARV_BUFFER_STATUS_MISSING_PACKETS) ++causes.missing_packets;
  if (status == ARV_BUFFER_STATUS_ABORTED) ++causes.aborted;
  if (frame.status == FrameStatus::kWrongSize) ++causes.size_mismatch;
}

SourceStatistics GigeSource::statistics() const {
  const std::lock_guard lock(state_->mutex);
  SourceStatistics result = state_->counts.now();
  if (state_->session) result.overrun += state_->session->overrun();
  return result;
}

Controls& GigeSource::controls() { return state_->controls; }

GigeStatistics GigeSource::stream_statistics() const {
  const std::lock_guard lock(state_->mutex);
  GigeStatistics result = state_->causes;
  result.last_completed_ns = state_->completed_ns;
  if (state_->session) {
    state_->session->add_to(result);
    if (state_->session->is_lost()) ++result.losses;  // not yet laid to rest, or never to be
  }
  return result;
}

/// @return false at the end.
bool GigeSource::State::pause(std::chrono::milliseconds time) {
  const auto until = std::chrono::steady_clock::now() + time;
  while (is_running && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::min<std::chrono::milliseconds>(time, 20ms));
  }
  return is_running;
}

void GigeSource::State::supervise() {
  std::chrono::milliseconds rest = kRound;
  while (pause(rest)) {
    const std::shared_ptr<Session> camera = [&] {
      const std::lock_guard lock(mutex);
      return session;
    }();
    rest = kRound;
    if (camera) {
      look_after(*camera);
      if (camera->is_lost()) camera->darken();
      if (camera->is_lost() && options.reconnect) close_in_background(camera);
      if (camera->is_lost() && !options.reconnect) end_stream(*camera);
    } else if (!try_reopen()) {
      rest = std::max<std::chrono::milliseconds>(rest, reopening->pause());
    }
  }
}

void GigeSource::State::look_after(Session& camera) {
  if (detail::monotonic_now_ns() - camera.last_arrival_ns() > kQuiet_ns) camera.check_alive();
}

/// Closing a camera that does not answer takes seconds: nobody waits for that.
void GigeSource::State::close_in_background(std::shared_ptr<Session> camera) {
  reopening->lose(camera->loss());
  const bool is_timed_by_others =
      !camera->numbers_by_trigger() && !options.trigger.empty() && options.trigger != "off";
  {
    const std::lock_guard lock(mutex);
    // The numbering goes on from the last frame that was given. Where frames come when somebody
    // else wants them the time since then tells nothing of their number.
    numbered_until_ns =
        completed_ns == 0 || is_timed_by_others ? detail::monotonic_now_ns() : completed_ns;
    counts.overrun(session->overrun());
    session->add_to(causes);
    ++causes.losses;
    session.reset();
  }
  const auto is_closed = [](const std::future<void>& close) {
    return close.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  };
  std::erase_if(closing, is_closed);  // To drop any other would wait for it.
  try {
    closing.push_back(
        std::async(std::launch::async, [dead = std::move(camera)]() mutable { dead.reset(); }));
  } catch (const std::system_error&) {  // No thread for it: it was closed here.
  }
}

/// Its laser was commanded off, if it answers: whoever reads may leave now.
void GigeSource::State::end_stream(const Session& camera) {
  if (has_ended.exchange(true)) return;
  reopening->lose(camera.loss());
  wake();
}

bool GigeSource::State::try_reopen() {
  const auto open = [this] {
    auto camera = open_session();
    reopening->require_same(kind_of(camera->setup()));
    camera->start([this] { wake(); });
    const double gone_s =
        1e-9 * static_cast<double>(detail::monotonic_now_ns() - numbered_until_ns);
    const std::lock_guard lock(mutex);
    numbers.restart(static_cast<std::uint64_t>(gone_s * info.picture_rate_hz));
    next_arrival = 0;
    ++epoch;
    counts.reconnect();
    session = std::move(camera);
  };
  return reopening->attempt(open) == detail::Reopening::Outcome::kBack;
}

}  // namespace striper
