// SPDX-License-Identifier: Apache-2.0
#include "serve/playback.hpp"

#include <fmt/format.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/error.hpp>

namespace striper::program {
namespace {

std::string source_of(const std::filesystem::path& file) {
  return fmt::format("mcap:{}?realtime=yes", file.string());
}

HeadParts parts_of(const std::string& source, ScannerSettings& settings) {
  HeadParts parts;
  parts.open = [source](const EventPort& port) { return open_source(source, port); };
  parts.make_scanner =
      parts.remake_scanner = [&settings](const SourceInfo& info, const EventPort& port) {
        return settings.make(info, port);
      };
  return parts;
}

HeadOptions options_of(const EventPort& events) {
  HeadOptions options;
  options.name = Playback::kHead;
  options.events = events;
  return options;
}

}  // namespace

struct Playback::Played {
  Played(const std::filesystem::path& file, const ScannerArguments& arguments, EventPort port)
      : path(file),
        model(arguments.model.value_or("")),
        events(std::move(port)),
        bus(events),
        settings(arguments, std::string(kHead), true),
        head(parts_of(source_of(file), settings), options_of(events), bus),
        desk(std::string(kHead), {head, settings, nullptr, events}, false) {}

  const std::filesystem::path path;
  const std::string model;
  const EventPort events;
  ScanBus bus;
  ScannerSettings settings;
  Head head;
  HeadDesk desk;
};

Playback::Playback(const EventPort& events) : events_(events.of_head(std::string(kHead))) {}
Playback::~Playback() { stop(); }

void Playback::play(const std::filesystem::path& file, const ScannerArguments& arguments,
                    const Screens& screens) {
  stop();
  auto played = std::make_shared<Played>(file, arguments, events_);
  for (const auto& [address, sink] : screens) played->bus.add(address, sink.guest());
  played->head.start();
  const std::lock_guard lock(mutex_);
  played_ = std::move(played);
}

bool Playback::stop() {
  std::shared_ptr<Played> over;
  {
    const std::lock_guard lock(mutex_);
    over = std::exchange(played_, nullptr);
  }
  if (over) over->head.request_stop();
  return over != nullptr;
}

std::shared_ptr<Playback::Played> Playback::now() const {
  const std::lock_guard lock(mutex_);
  if (played_) return played_;
  throw Error(ErrorKind::kNotFound, "no recording is played back");
}

HeadDesk& Playback::desk(const std::shared_ptr<Played>& played) { return played->desk; }

std::optional<ServedHead> Playback::served() const {
  const std::lock_guard lock(mutex_);
  if (!played_) return std::nullopt;
  return ServedHead{std::string(kHead), source_of(played_->path), played_->model,
                    played_->head.health(), played_->path.filename().string()};
}

}  // namespace striper::program
