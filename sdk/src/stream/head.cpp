// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <exception>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/pipeline/exposure_control.hpp>
#include <striper/stream/head.hpp>

namespace striper {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// How often a head says how it is: a person sees it at once, and it costs nothing.
constexpr auto kTick = 100ms;
constexpr auto kStep = 50ms;         // How late a stop may be noticed while waiting.
constexpr auto kSilentAfter = 1s;    // The lowest usual rates are 5 a second.
constexpr double kRateSpan_s = 1.0;  // Over which the rate is counted.

// A camera that is not there, held or out of order may be there later; a wrong address never will.
bool may_come(const Error& error) {
  return error.kind() == ErrorKind::kNotFound || error.kind() == ErrorKind::kDevice ||
         error.kind() == ErrorKind::kIo;
}

void add(FrameReport& sum, const FrameReport& one) {
  sum.pictures += one.pictures;
  sum.frames += one.frames;
  sum.elapsed_s += one.elapsed_s;
  sum.interrupted = one.interrupted;
  sum.is_lost = one.is_lost;
  sum.statistics.delivered += one.statistics.delivered;
  sum.statistics.dropped += one.statistics.dropped;
  sum.statistics.overrun += one.statistics.overrun;
  sum.statistics.corrupt += one.statistics.corrupt;
  sum.statistics.incomplete += one.statistics.incomplete;
  sum.statistics.wrong_size += one.statistics.wrong_size;
  sum.statistics.reconnects += one.statistics.reconnects;
}

}  // namespace

class Head::Impl {
 public:
  Impl(HeadParts parts, HeadOptions options, ScanBus& bus)
      : parts_(std::move(parts)), options_(std::move(options)), bus_(bus) {
    health_.time = Clock::now();
  }

  FrameReport run();
  void start();
  FrameReport wait();
  HeadHealth health() const;
  std::vector<Control> controls() const;
  Control set_control(std::string_view name, const ControlValue& value);
  void switch_lasers(bool are_on);
  ScanExplanation explain(int line, std::chrono::milliseconds timeout);

  std::atomic<bool> should_stop = false;
  std::atomic<bool> should_reload = false;  // Where its model's file may be another.
  std::atomic<bool> should_remake = false;  // Where its options are others.
  std::atomic<bool> is_paused = false;
  std::atomic<bool> is_running = false;
  static_assert(std::atomic<bool>::is_always_lock_free, "set in signal handlers");

 private:
  bool is_told_to_stop() const {
    return should_stop || (options_.should_stop && options_.should_stop());
  }
  bool should_close() const { return is_told_to_stop() || is_paused; }
  void wait_while_paused();
  std::unique_ptr<FrameSource> open_or_wait();
  void set_open_source(FrameSource* source);
  void set_kept_controls(FrameSource& source);
  FrameSource& open_source() const;
  FrameReport read(std::unique_ptr<FrameSource> source);
  void take(const Frame& frame, const FrameReader& reader);
  void give(ScanSpan scans);
  void adapt_exposure(const Frame& frame, ScanSpan scans);
  void announce();
  void retire_scanner();
  void make_scanner();
  void answer_questions();
  void look_for_changes();
  void remake(bool is_reload);
  void tick(const FrameReport& report, bool is_frame);
  void note(SourceState state);

  HeadParts parts_;
  HeadOptions options_;
  ScanBus& bus_;

  // Of the thread that runs.
  SourceInfo source_;
  std::optional<HeadScanner> scanner_;
  std::optional<ExposureControl> exposure_;  // Of the source that is open.
  ScannerStatistics counts_before_;          // Of the scanners before this one.
  bool is_announced_ = false;
  bool was_awaited_ = false;
  bool has_run_ = false;
  Clock::time_point last_frame_;
  Clock::time_point last_tick_;
  Clock::time_point rate_since_;
  std::uint64_t rate_frames_ = 0;

  mutable std::mutex mutex_;  // Guards what follows.
  HeadHealth health_;

  mutable std::mutex source_mutex_;     // Held while a camera is asked; guards what follows.
  FrameSource* open_source_ = nullptr;  // Set by the thread that runs.
  std::map<std::string, ControlValue, std::less<>> kept_controls_;

  // Why a scan line gave what it gave, to be answered by the thread that runs.
  struct Question {
    int line = 0;
    std::promise<ScanExplanation> answer;
  };
  std::mutex questions_mutex_;
  std::vector<std::shared_ptr<Question>> questions_;

  std::thread thread_;
  FrameReport report_;
  std::exception_ptr failure_;
};

FrameReport Head::Impl::run() {
  FrameReport sum;
  while (!is_told_to_stop()) {
    wait_while_paused();
    std::unique_ptr<FrameSource> source = open_or_wait();
    if (!source) continue;
    add(sum, read(std::move(source)));
    const bool is_over = !sum.is_lost || !options_.reopens;
    if (is_over && !is_paused) break;
  }
  note(SourceState::kEnded);
  if (!is_told_to_stop() && !sum.is_lost)
    options_.events.send({"source_ended", "the source has ended"});
  sum.interrupted = is_told_to_stop();
  return sum;
}

void Head::Impl::wait_while_paused() {
  if (is_paused) {
    options_.events.send({"source_paused", "the source is closed until it is started again"});
  }
  while (is_paused && !is_told_to_stop()) {
    note(SourceState::kPaused);
    std::this_thread::sleep_for(kStep);
  }
}

// Null where it was told to stop or to pause.
std::unique_ptr<FrameSource> Head::Impl::open_or_wait() {
  while (!should_close()) {
    note(SourceState::kWaiting);
    try {
      std::unique_ptr<FrameSource> source = parts_.open(options_.events);
      source_ = source->info();
      make_scanner();
      set_kept_controls(*source);
      return source;
    } catch (const Error& error) {
      if (!options_.reopens || !(has_run_ || may_come(error))) throw;
      if (!std::exchange(was_awaited_, true)) {
        options_.events.send({"source_waiting", error.what()});
      }
    }
    const Clock::time_point next = Clock::now() + options_.retry_every;
    while (!should_close() && Clock::now() < next) {
      note(SourceState::kWaiting);
      std::this_thread::sleep_for(kStep);
    }
  }
  return nullptr;
}

// What the head's scanner counted so far goes on with the next one.
void Head::Impl::retire_scanner() {
  if (scanner_) counts_before_ += scanner_->scanner.status().counts;
  scanner_.reset();
}

void Head::Impl::make_scanner() {
  retire_scanner();
  scanner_.emplace(parts_.make_scanner(source_, options_.events));
  is_announced_ = false;
}

void Head::Impl::set_open_source(FrameSource* source) {
  const std::lock_guard lock(source_mutex_);
  open_source_ = source;
}

void Head::Impl::set_kept_controls(FrameSource& source) {
  const std::lock_guard lock(source_mutex_);
  for (const auto& [name, value] : kept_controls_) {
    try {
      source.controls().set(name, value);
    } catch (const Error& error) {
      options_.events.send({"control_refused", error.what()});
    }
  }
}

// The mutex is locked.
FrameSource& Head::Impl::open_source() const {
  if (open_source_ != nullptr) return *open_source_;
  throw Error(ErrorKind::kDevice, fmt::format("head '{}': its source is not open, it is {}",
                                              options_.name, to_string(health().state)));
}

std::vector<Control> Head::Impl::controls() const {
  const std::lock_guard lock(source_mutex_);
  return open_source().controls().list();
}

Control Head::Impl::set_control(std::string_view name, const ControlValue& value) {
  const std::lock_guard lock(source_mutex_);
  Control now = open_source().controls().set(name, value);
  kept_controls_.insert_or_assign(now.name, value);
  return now;
}

void Head::Impl::switch_lasers(bool are_on) {
  const ControlValue value{are_on ? 1.0 : 0.0};
  const std::lock_guard lock(source_mutex_);
  if (open_source_ != nullptr) open_source_->controls().set("laser", value);
  kept_controls_.insert_or_assign("laser", value);
}

FrameReport Head::Impl::read(std::unique_ptr<FrameSource> source) {
  set_open_source(source.get());
  {
    const std::lock_guard lock(mutex_);
    ++health_.times_opened;
  }
  last_frame_ = rate_since_ = Clock::now();
  rate_frames_ = 0;
  FrameReading how{options_.limits, options_.events, [this] { return should_close(); }, {}};
  FrameReader* reading = nullptr;
  how.on_wait = [&] {
    look_for_changes();
    tick(reading->report(), false);
  };
  FrameReader reader(*source, std::move(how));
  reading = &reader;
  const FrameReport report = reader.read([&](const Frame& frame) { take(frame, reader); });
  give(scanner_->scanner.finish());
  exposure_.reset();
  last_tick_ = {};
  tick(report, false);
  set_open_source(nullptr);
  if (report.is_lost) {
    if (options_.reopens && !std::exchange(was_awaited_, true)) {
      options_.events.send({"source_waiting", "the camera was lost: it is waited for"});
    }
    std::thread([lost = std::move(source)]() mutable { lost.reset(); }).detach();
  }
  return report;
}

void Head::Impl::take(const Frame& frame, const FrameReader& reader) {
  if (std::exchange(was_awaited_, false)) {
    options_.events.send({"source_back", source_.description});
  }
  look_for_changes();
  if (!is_announced_) announce();
  if (parts_.before_scan) parts_.before_scan(frame);
  bus_.write(frame, options_.name);
  const ScanSpan scans = scanner_->scanner.process(frame);
  if (!scans.empty()) answer_questions();
  give(scans);
  adapt_exposure(frame, scans);
  tick(reader.report(), true);
}

// A camera that was lost meanwhile takes nothing; the one that comes back begins anew.
void Head::Impl::adapt_exposure(const Frame& frame, ScanSpan scans) {
  if (!scanner_->adapts_exposure) return exposure_.reset();
  try {
    if (!exposure_) {
      const std::lock_guard lock(source_mutex_);
      exposure_.emplace(open_source().controls());
    }
    exposure_->update(frame, scans);
  } catch (const Error& error) {
    exposure_.reset();
    if (error.kind() == ErrorKind::kDevice) return;
    scanner_->adapts_exposure = false;
    options_.events.send({"control_refused", error.what()});
  }
}

void Head::Impl::answer_questions() {
  std::vector<std::shared_ptr<Question>> asked;
  {
    const std::lock_guard lock(questions_mutex_);
    asked.swap(questions_);
  }
  for (const auto& one : asked) {
    try {
      one->answer.set_value(scanner_->scanner.explain(one->line));
    } catch (...) {
      one->answer.set_exception(std::current_exception());
    }
  }
}

ScanExplanation Head::Impl::explain(int line, std::chrono::milliseconds timeout) {
  const auto question = std::make_shared<Question>();
  question->line = line;
  std::future<ScanExplanation> answer = question->answer.get_future();
  {
    const std::lock_guard lock(questions_mutex_);
    questions_.push_back(question);
  }
  if (answer.wait_for(timeout) == std::future_status::ready) return answer.get();
  {
    const std::lock_guard lock(questions_mutex_);
    std::erase(questions_, question);
  }
  throw Error(ErrorKind::kDevice,
              fmt::format("head '{}': no scan came for {} ms, it is {}", options_.name,
                          timeout.count(), to_string(health().state)));
}

void Head::Impl::announce() {
  is_announced_ = has_run_ = true;
  bus_.open(head_info(options_.name, source_, scanner_->model, scanner_->axis));
}

void Head::Impl::give(ScanSpan scans) {
  bus_.write(scans);
  if (parts_.after_scan) parts_.after_scan(scans);
}

void Head::Impl::look_for_changes() {
  const bool is_reload = should_reload.exchange(false);
  if (should_remake.exchange(false) || is_reload) remake(is_reload);
}

void Head::Impl::remake(bool is_reload) {
  try {
    if (!parts_.remake_scanner) return;
    HeadScanner fresh = parts_.remake_scanner(source_, options_.events);
    give(scanner_->scanner.finish());
    retire_scanner();
    scanner_.emplace(std::move(fresh));
    is_announced_ = false;
    if (is_reload) options_.events.send({"model_reloaded", "the model was read anew"});
  } catch (const std::exception& error) {
    options_.events.send(
        {"model_refused", fmt::format("the model is used as it was before: {}", error.what())});
  }
}

void Head::Impl::tick(const FrameReport& report, bool is_frame) {
  const Clock::time_point now = Clock::now();
  if (is_frame) last_frame_ = now;
  if (now - last_tick_ < kTick) return;
  last_tick_ = now;
  ScannerStatus status = scanner_->scanner.status();
  status.head = options_.name;
  status.counts += counts_before_;
  const bool is_silent = now - last_frame_ >= kSilentAfter;
  status.source = is_silent ? SourceState::kSilent : SourceState::kStreaming;
  bus_.status(status);

  const double span_s = std::chrono::duration<double>(now - rate_since_).count();
  const std::lock_guard lock(mutex_);
  if (span_s >= kRateSpan_s) {
    health_.rate_hz = static_cast<double>(report.pictures - rate_frames_) / span_s;
    rate_since_ = now;
    rate_frames_ = report.pictures;
  }
  health_.state = status.source;
  health_.read = report;
  if (open_source_ != nullptr) health_.read.statistics = open_source_->statistics();
  health_.scanner = std::move(status);
  health_.time = now;
}

// Where no frames come that would say so.
void Head::Impl::note(SourceState state) {
  ScannerStatus status;
  {
    const std::lock_guard lock(mutex_);
    health_.state = health_.scanner.source = state;
    health_.scanner.head = options_.name;
    health_.rate_hz = 0.0;
    health_.time = Clock::now();
    status = health_.scanner;
  }
  bus_.status(status);
}

HeadHealth Head::Impl::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

void Head::Impl::start() {
  is_running = true;
  thread_ = std::thread([this] {
    try {
      report_ = run();
    } catch (...) {
      failure_ = std::current_exception();
    }
    is_running = false;
  });
}

FrameReport Head::Impl::wait() {
  if (thread_.joinable()) thread_.join();
  if (failure_) std::rethrow_exception(failure_);
  return report_;
}

Head::Head(HeadParts parts, HeadOptions options, ScanBus& bus)
    : impl_(std::make_unique<Impl>(std::move(parts), std::move(options), bus)) {}

Head::~Head() {
  request_stop();
  try {
    impl_->wait();
  } catch (...) {  // NOLINT(bugprone-empty-catch): who wants to know has waited.
  }
}

FrameReport Head::run() { return impl_->run(); }
void Head::start() { impl_->start(); }
bool Head::is_running() const noexcept { return impl_->is_running; }
FrameReport Head::wait() { return impl_->wait(); }
void Head::request_stop() noexcept { impl_->should_stop = true; }
void Head::reload() noexcept { impl_->should_reload = true; }
void Head::remake_scanner() noexcept { impl_->should_remake = true; }
void Head::pause() noexcept { impl_->is_paused = true; }
void Head::resume() noexcept { impl_->is_paused = false; }
std::vector<Control> Head::controls() const { return impl_->controls(); }
Control Head::set_control(std::string_view name, const ControlValue& value) {
  return impl_->set_control(name, value);
}
void Head::switch_lasers(bool are_on) { impl_->switch_lasers(are_on); }
ScanExplanation Head::explain(int line, std::chrono::milliseconds timeout) const {
  return impl_->explain(line, timeout);
}
HeadHealth Head::health() const { return impl_->health(); }

}  // namespace striper
