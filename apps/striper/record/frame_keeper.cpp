// SPDX-License-Identifier: Apache-2.0
#include "record/frame_keeper.hpp"

#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/images/recorder.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/sink_uri.hpp>

#include "options/scanner_arguments.hpp"

namespace striper::program {
namespace {

namespace fs = std::filesystem;

class DirectoryKeeper : public FrameKeeper {
 public:
  DirectoryKeeper(const std::string& directory, const SourceInfo& source)
      : directory_(directory), recorder_(directory, source) {}

  void write(const Frame& frame) override { recorder_.write(frame); }
  std::uint64_t frames() const override { return recorder_.frames(); }
  std::string address() const override { return "images:" + directory_; }

 private:
  std::string directory_;
  Recorder recorder_;
};

void require_absent(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return;
  throw Error(
      ErrorKind::kUsage,
      fmt::format("'{}' is already there: name another file, or remove it first", path.string()));
}

// One file, made with the first frame.
class FileKeeper : public FrameKeeper {
 public:
  FileKeeper(SinkUri uri, const std::optional<std::string>& model, SourceInfo source,
             HeldEvents events)
      : path_(uri.path()),
        rotation_(take_rotation(uri)),
        source_(std::move(source)),
        events_(std::move(events)),
        recording_(path_, rotation_) {
    uri.refuse_unused("rotate");
    require_absent(path_);
    require_absent(rotation_.file(path_, 0));
    if (model) prepare_scans(*model);
  }

  void write(const Frame& frame) override {
    if (frames_ == 0) {
      recording_.open(head_info(kDefaultHead, source_, model_, axis_));
    }
    write_events();
    recording_.write(frame);
    ++frames_;
    if (scanner_) write_scans(scanner_->process(frame));
  }

  void finish() override {
    if (frames_ > 0 && scanner_) write_scans(scanner_->finish());
    if (frames_ > 0) write_events();
    recording_.close();
  }

  std::uint64_t frames() const override { return frames_; }
  std::uint64_t scans() const override { return scans_; }
  std::string address() const override {
    const auto paths = recording_.paths();
    return "mcap:" + (paths.empty() ? path_ : paths.front()).string();
  }

 private:
  static wire::McapRotation take_rotation(SinkUri& uri) {
    const auto text = uri.take("rotate");
    return text ? wire::McapRotation::parse(*text) : wire::McapRotation{};
  }

  void prepare_scans(const std::string& path) {
    ScannerArguments arguments;
    arguments.model = path;
    const ScannerSetup setup = scanner_setup(arguments, source_, events_.port());
    model_ = shared_model(setup);
    axis_ = setup.options.stripe.axis;
    scanner_.emplace(make_scanner(setup));
  }

  void write_scans(ScanSpan scans) {
    for (const PolarScan& scan : scans) {
      recording_.write(scan);
      ++scans_;
    }
  }

  void write_events() {
    for (const Event& event : events_.take()) recording_.write(event);
  }

  fs::path path_;
  wire::McapRotation rotation_;
  SourceInfo source_;
  HeldEvents events_;
  McapRecording recording_;
  std::shared_ptr<const StriperModel> model_;
  StripeAxis axis_ = StripeAxis::kColumns;
  std::optional<Scanner> scanner_;
  std::uint64_t frames_ = 0;
  std::uint64_t scans_ = 0;
};

}  // namespace

HeldEvents::HeldEvents(EventPort onward)
    : shared_(std::make_shared<Shared>()),
      port_([shared = shared_, onward = std::move(onward)](const Event& event) {
        onward.send(event);
        const std::lock_guard lock(shared->mutex);
        // Nobody takes them where a directory is written.
        constexpr std::size_t kMost = 1000;
        if (shared->events.size() < kMost) shared->events.push_back(event);
      }) {}

std::vector<Event> HeldEvents::take() {
  const std::lock_guard lock(shared_->mutex);
  return std::exchange(shared_->events, {});
}

bool is_recording_file(const std::string& output) {
  const std::string address = output.substr(0, output.rfind('?'));
  return output.starts_with("mcap:") || address.ends_with(".mcap");
}

std::unique_ptr<FrameKeeper> make_frame_keeper(const std::string& output,
                                               const std::optional<std::string>& model,
                                               const SourceInfo& source, const HeldEvents& events) {
  if (is_recording_file(output)) {
    return std::make_unique<FileKeeper>(SinkUri::parse(output), model, source, events);
  }
  if (model) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("--model keeps scans beside the frames, in a file: -o {}.mcap", output));
  }
  return std::make_unique<DirectoryKeeper>(output, source);
}

}  // namespace striper::program
