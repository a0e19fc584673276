// SPDX-License-Identifier: Apache-2.0
// striper serve: scans for whoever wants them, until told to stop.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/stream/head.hpp>
#include <striper/stream/open_sink.hpp>
#include <striper/stream/recording_info.hpp>
#include <striper/stream/sink_services.hpp>

#include "options/scanner_arguments.hpp"
#include "options/sink_arguments.hpp"
#include "program/program.hpp"
#include "program/terminal.hpp"
#include "program/terminal_events.hpp"
#include "record/info_json.hpp"
#include "run/frame_loop.hpp"
#include "run/service.hpp"
#include "serve/access_token.hpp"
#include "serve/head_desk.hpp"
#include "serve/head_exam.hpp"
#include "serve/head_recorder.hpp"
#include "serve/playback.hpp"
#include "serve/scanner_settings.hpp"
#include "serve/state_folder.hpp"

namespace striper::program {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct ServeArguments {
  std::string source;
  std::vector<std::string> sinks;
  std::string name{kDefaultHead};
  ScannerArguments scanner;
  std::optional<std::string> token;
  std::optional<std::string> recordings;
  bool allow_lasers_on = false;
};

constexpr const char* kDescription =
    "Serve: scans for files and programs, from a camera that may come and go, until told to stop.";

constexpr const char* kExamples =
    "Examples:\n"
    "  striper serve 'gige:STRIPER1?exposure_us=20' -m striper.yaml --to csv:scans.csv\n"
    "      starts before the camera is there, opens it again whenever it was lost\n"
    "  striper serve sim:data/scenes/room.yaml?realtime=yes -m room.yaml --to a.csv --to "
    "b.jsonl\n\n"
    "SIGTERM and Ctrl-C end it cleanly (files whole, exit code 0), as does the end of a source "
    "that\n"
    "has one. SIGHUP reads the model anew; SIGUSR1 has it say how it is, which it does every "
    "minute\n"
    "too. Under systemd (striper@.service) it says when it is ready, and that it is alive.";

constexpr auto kStep = 50ms;         // How late a signal may be noticed.
constexpr auto kHealthEvery = 1min;  // As agreed.
constexpr auto kHeadAsleep = 20s;    // Opening a camera that hangs takes a few seconds.

std::atomic<bool> reload_flag = false;
std::atomic<bool> health_flag = false;

void on_signal(void (*handler)(int), int signal) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(signal, &action, nullptr);
}

void take_signals() {
  on_signal([](int /*signal*/) { reload_flag = true; }, SIGHUP);
  on_signal([](int /*signal*/) { health_flag = true; }, SIGUSR1);
}

void define(Command& command, ServeArguments& arguments) {
  add_source(command, arguments.source);
  add_scanner_arguments(command, arguments.scanner);
  command
      .add_option(
          "--to", arguments.sinks,
          "Who gets the scans: csv:FILE?doubtful=yes&missing=yes, jsonl:FILE, mcap:FILE, or a "
          "path, by its extension; web:PORT for browsers and Foxglove, ros2: for ROS 2; as often "
          "as you like")
      ->type_name("SINK")
      ->required()
      ->one_word_each();
  command.add_option("--name", arguments.name, "What the head is called; default striper")
      ->type_name("HEAD");
  command
      .add_option("--token", arguments.token,
                  "The secret that whoever changes something by web: has to show; made where there "
                  "is none; default $STATE_DIRECTORY/token or ~/.local/state/striper/token")
      ->type_name("FILE");
  command
      .add_option("--recordings", arguments.recordings,
                  "Where recordings go that are asked for by web:; default recordings, beside the "
                  "token")
      ->type_name("DIR");
  command.add_flag("--allow-lasers-on", arguments.allow_lasers_on,
                   "Who has the secret may switch lasers on, too, not off alone");
  command.footer(std::string(kSourceHelp) + "\n\n" + kExamples);
}

std::string describe(const SinkReport& sink) {
  return fmt::format("{} {}, {} written, {} lost", sink.uri, to_string(sink.state), sink.written,
                     sink.lost);
}

// "streaming, 30.0 frames/s, 1200 scans, 2 dropped; csv:a.csv open, 1200 written, 0 lost".
std::string describe(const HeadHealth& head, const std::vector<SinkReport>& sinks) {
  const SourceStatistics& source = head.read.statistics;
  std::string text = fmt::format("{}, {:.1f} frames/s, {}", to_string(head.state), head.rate_hz,
                                 count(head.scanner.counts.scans, "scan"));
  const auto add = [&](std::uint64_t number, const char* what) {
    if (number > 0) text += fmt::format(", {} {}", number, what);
  };
  add(head.scanner.counts.without_stripe, "without a stripe");
  add(head.scanner.counts.refused, "frames refused");
  add(source.dropped + source.overrun, "dropped");
  add(source.corrupt + source.incomplete + source.wrong_size, "bad");
  add(source.reconnects, "reconnections");
  for (const SinkReport& sink : sinks) text += "; " + describe(sink);
  return text;
}

std::filesystem::path recordings_folder(const ServeArguments& arguments) {
  if (arguments.recordings) return *arguments.recordings;
  const std::filesystem::path state = state_folder();
  return state.empty() ? state : state / "recordings";
}

// Those that show scans to people, who ask back.
bool is_screen(const SinkUri& uri) { return uri.scheme() == "web"; }

// Keeping what an explanation needs takes .03 ms a frame.
bool is_asked_why(const ServeArguments& arguments) {
  const std::vector<SinkUri> sinks = parse_sinks(arguments.sinks);
  return std::any_of(sinks.begin(), sinks.end(), is_screen);
}

// A camera may come later, or back; a file that is not there is a wrong name.
bool is_camera(const std::string& source) {
  const std::string scheme = SourceUri::parse(source).scheme();
  return scheme == "v4l2" || scheme == "gige" || scheme == "u3v";
}

/// What goes on for weeks must not fill a log: of each kind so many a minute.
class SaidLately {
 public:
  bool lets_through(const Event& event) {
    constexpr int kMostAMinute = 30;  // A camera that is lost takes 2 s to be found again.
    const Clock::time_point now = Clock::now();
    Kind& kind = kinds_[event.code.word()];
    if (now - kind.since >= 1min) kind = {now, 0};
    return ++kind.said <= kMostAMinute;
  }

 private:
  struct Kind {
    Clock::time_point since;
    int said = 0;
  };
  std::map<std::string_view, Kind> kinds_;
};

/// One head that runs, its sinks, and whoever asks how they are.
class Server {
 public:
  explicit Server(const ServeArguments& arguments)
      : arguments_(arguments),
        events_(EventPort([this](const Event& event) { hear(event); }).of_head(arguments.name)),
        bus_(events_),
        settings_(arguments.scanner, arguments.name, is_asked_why(arguments)),
        exam_(settings_),
        playback_(EventPort([this](const Event& event) { hear(event); })),
        head_(parts(), options(), bus_),
        recorder_(recordings_folder(arguments), arguments.name, bus_, events_),
        desk_(arguments.name, {head_, settings_, &recorder_, events_}, arguments.allow_lasers_on) {
    for (const SinkUri& uri : parse_sinks(arguments.sinks)) add_sink(uri);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server() { bus_.finish(); }  // Sinks ask for the head until then.

  ExitCode run() {
    take_signals();
    head_.start();
    service_.say_ready();
    say("serving");
    while (head_.is_running()) {
      look_around();
      std::this_thread::sleep_for(kStep);
    }
    service_.say_stopping();
    return conclude();
  }

 private:
  void add_sink(const SinkUri& uri) {
    std::unique_ptr<ScanSink> sink = open_sink(uri);
    sink->set_services(services());
    if (!is_screen(uri)) return bus_.add(uri.text(), std::move(sink));
    screens_.emplace_back(uri.text(), SharedSink(std::move(sink)));
    bus_.add(uri.text(), screens_.back().second.owner());
  }

  template <typename Do>
  auto at_desk(std::string_view head, Do what) {
    const bool is_played = head == Playback::kHead && head != arguments_.name;
    return is_played ? playback_.with_desk(what) : what(desk_);
  }

  SinkServices services() {
    SinkServices services;
    services.heads = [this] { return served(); };
    services.sinks = [this] { return bus_.sinks(); };
    services.token = [this] { return token(); };
    services.recordings = [this] { return recorder_.list(); };
    services.recording_path = [this](std::string_view name) {
      return recorder_.path_of(name).string();
    };
    services.recording_info = [this](std::string_view name) {
      return to_json(inspect_recording(recorder_.path_of(name))).dump();
    };
    services.play = [this](std::string_view name) { return play(name); };
    services.findings = [this](std::string_view head) { return findings(head); };
    add_desk(services);
    return services;
  }

  void add_desk(SinkServices& services) {
    services.parameters = [this](std::string_view head) {
      return at_desk(head, [&](const HeadDesk& desk) { return desk.parameters(head); });
    };
    services.parameter_forms = [this](std::string_view head) {
      return at_desk(head, [&](const HeadDesk& desk) { return desk.forms(head); });
    };
    services.set_parameter = [this](std::string_view head, const Parameter& wanted) {
      at_desk(head, [&](HeadDesk& desk) { desk.set(head, wanted); });
    };
    services.command = [this](std::string_view head, HeadCommand command, double seconds) {
      return at_desk(head, [&](HeadDesk& desk) { return desk.command(head, command, seconds); });
    };
    services.why = [this](std::string_view head, int line) {
      return at_desk(head, [&](const HeadDesk& desk) { return desk.why(head, line); });
    };
  }

  std::vector<ServedHead> served() const {
    std::vector<ServedHead> all{{arguments_.name, arguments_.source,
                                 arguments_.scanner.model.value_or(""), head_.health(), ""}};
    if (auto played = playback_.served()) all.push_back(std::move(*played));
    return all;
  }

  std::string play(std::string_view name) {
    if (name.empty()) return playback_.stop() ? "playback ended" : "nothing was played back";
    playback_.play(recorder_.path_of(name), settings_.arguments(), screens_);
    return fmt::format("playing {} back, as head {}", name, Playback::kHead);
  }

  std::vector<Event> findings(std::string_view head) {
    if (head == arguments_.name) return exam_.findings(head_.health(), bus_.sinks());
    if (head == Playback::kHead && playback_.served()) return {};
    throw Error(ErrorKind::kNotFound, fmt::format("there is no head '{}'", head));
  }

  // Of all sinks that want one.
  std::string token() {
    if (!token_) token_ = access_token(arguments_.token, events_);
    return *token_;
  }

  HeadParts parts() {
    HeadParts parts;
    parts.open = [this](const EventPort& port) { return open_source(arguments_.source, port); };
    parts.make_scanner =
        parts.remake_scanner = [this](const SourceInfo& source, const EventPort& port) {
          exam_.note(source);
          return settings_.make(source, port);
        };
    parts.before_scan = [this](const Frame& frame) { exam_.keep(frame); };
    return parts;
  }

  HeadOptions options() {
    HeadOptions options;
    options.name = arguments_.name;
    options.reopens = is_camera(arguments_.source);
    options.events = events_;
    return options;
  }

  // Each to the log and to the sinks; the bus never sends what it is given.
  void hear(const Event& event) {
    if (said_.lets_through(event)) say(fmt::format("{}: {}", event.code.word(), sentence(event)));
    if (event.head == arguments_.name) exam_.hear(event);
    bus_.event(event);
  }

  void look_around() {
    if (stop_requested() || !bus_.is_any_open()) head_.request_stop();
    if (reload_flag.exchange(false)) head_.reload();
    recorder_.look();
    const HeadHealth health = head_.health();
    exam_.look(health);
    const Clock::time_point now = Clock::now();
    if (now - health.time < kHeadAsleep) service_.say_alive();
    if (!health_flag.exchange(false) && now - last_health_ < kHealthEvery) return;
    last_health_ = now;
    const std::string text = describe(health, bus_.sinks());
    say(text);
    service_.say_status(text);
  }

  ExitCode conclude() {
    playback_.stop();
    const FrameReport report = head_.wait();
    bus_.finish();
    say(fmt::format("read {}", program::describe(report)));
    bool is_any_whole = false;
    for (const SinkReport& sink : bus_.sinks()) {
      say(describe(sink));
      is_any_whole = is_any_whole || sink.state == SinkReport::State::kFinished;
    }
    // Of cameras that were lost, and of sinks that never returned.
    if (report.is_lost || bus_.failure()) leave_threads_behind();
    return is_any_whole ? ExitCode::kDone : ExitCode::kFailed;
  }

  const ServeArguments& arguments_;
  SaidLately said_;
  EventPort events_;
  ScanBus bus_;
  ScannerSettings settings_;
  HeadExam exam_;
  Playback::Screens screens_;
  Playback playback_;
  Head head_;
  HeadRecorder recorder_;
  HeadDesk desk_;
  std::optional<std::string> token_;
  Service service_;
  Clock::time_point last_health_ = Clock::now();
};

ExitCode serve(const ServeArguments& arguments) {
  if (arguments.scanner.model) load_model(*arguments.scanner.model);  // Before the camera is there.
  return Server(arguments).run();
}

}  // namespace

void add_serve(Command& striper, Action& action) {
  add_command<ServeArguments>(striper, action, "serve", kDescription, define, serve);
}

}  // namespace striper::program
