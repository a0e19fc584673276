// SPDX-License-Identifier: Apache-2.0
#include <deque>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include <striper/capture/open_source.hpp>
#include <striper/capture/source_uri.hpp>
#include <striper/core/error.hpp>
#include <striper/model/source_fit.hpp>
#include <striper/pipeline/exposure_control.hpp>
#include <striper/scans/open_scans.hpp>
#include <striper/stream/scan_files.hpp>

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;

// A source of frames and the scanner behind it.
class ScannedSource : public ScanSource {
 public:
  ScannedSource(std::unique_ptr<FrameSource> source,
                const std::shared_ptr<const StriperModel>& model, const ScannerOptions& options)
      : source_(std::move(source)),
        info_(head_info(options.head, source_->info(), model, options.stripe.axis)),
        scanner_(*model, options) {
    if (options.adapts_exposure) exposure_.emplace(source_->controls());
    source_->start();
  }

  HeadInfo info() const override { return info_; }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds timeout) override {
    const Clock::time_point end = Clock::now() + timeout;
    while (ready_.empty()) {
      if (has_ended_) return NextStatus::kEnd;
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
      const NextStatus status = source_->next(frame_, std::max(left, std::chrono::milliseconds(0)));
      if (status == NextStatus::kTimeout || status == NextStatus::kStopped) return status;
      has_ended_ = status == NextStatus::kEnd;
      const ScanSpan scans = has_ended_ ? scanner_.finish() : scanner_.process(frame_);
      keep(scans);
      if (exposure_ && !has_ended_) adapt_exposure(scans);
      const bool is_late = ready_.empty() && Clock::now() >= end;
      if (is_late && !has_ended_) return NextStatus::kTimeout;
    }
    scan = *ready_.front();
    ready_.pop_front();
    return NextStatus::kFrame;
  }

  void stop() override { source_->stop(); }

 private:
  // A camera that was lost meanwhile takes nothing.
  void adapt_exposure(ScanSpan scans) {
    try {
      exposure_->update(frame_, scans);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kDevice) throw;
    }
  }

  void keep(ScanSpan scans) {
    for (std::size_t i = 0; i < scans.size(); ++i) ready_.push_back(scans.shared(i));
  }

  std::unique_ptr<FrameSource> source_;
  HeadInfo info_;
  Scanner scanner_;
  std::optional<ExposureControl> exposure_;
  Frame frame_;
  std::deque<std::shared_ptr<const PolarScan>> ready_;
  bool has_ended_ = false;
};

// The file that an address names, if it is of that kind: by its scheme or its extension.
std::optional<std::filesystem::path> file_of(std::string_view uri, std::string_view kind) {
  const std::string scheme = fmt::format("{}:", kind);
  if (uri.starts_with(scheme)) return uri.substr(scheme.size());
  if (uri.ends_with(fmt::format(".{}", kind)) && uri.find(':') == std::string_view::npos) {
    return uri;
  }
  return std::nullopt;
}

std::unique_ptr<ScanSource> scan_frames(std::string_view uri,
                                        const std::shared_ptr<const StriperModel>& model,
                                        const std::optional<ScannerOptions>& asked,
                                        const EventPort& events) {
  auto source = open_source(uri, events);
  const std::string why_not = why_not_of_source(*model, source->info());
  if (!why_not.empty()) throw Error(ErrorKind::kBadValue, "the model " + why_not);
  ScannerOptions options = ScannerOptions::for_model(*model, asked.value_or(ScannerOptions()));
  options.events = events;
  options.ambient.pattern = source->info().pattern;
  return std::make_unique<ScannedSource>(std::move(source), model, options);
}

// `action()`, or null where it finds nothing of the kind.
template <typename Action>
std::unique_ptr<ScanSource> if_there(const Action& action) {
  try {
    return action();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kNotFound) throw;
    return nullptr;
  }
}

// A recording has scans, frames or both. A model that is given scans the frames anew; without one
// the scans stand, and frames alone are scanned with the model that is attached to them.
std::unique_ptr<ScanSource> open_recording(std::string_view address,
                                           const std::shared_ptr<const StriperModel>& model,
                                           const std::optional<ScannerOptions>& options,
                                           const EventPort& events) {
  SourceUri uri = SourceUri::parse(address);
  const std::string path = uri.path();
  const std::string head = uri.take("head").value_or("");
  if (model) {
    auto frames = if_there([&] { return scan_frames(address, model, options, events); });
    return frames ? std::move(frames) : read_mcap_scans(path, model, head);
  }
  auto scans = if_there([&] { return read_mcap_scans(path, nullptr, head); });
  if (scans) return scans;
  const auto attached = attached_model(path, head);
  return attached ? scan_frames(address, attached, options, events)
                  : read_mcap_scans(path, nullptr, head);  // Says what is missing.
}

bool is_recording(std::string_view uri) {
  return uri.starts_with("mcap:") || file_of(uri, "mcap").has_value();
}

}  // namespace

std::unique_ptr<ScanSource> open_scans(
    std::string_view uri, const std::shared_ptr<const StriperModel>& model,
    // NOLINTNEXTLINE(performance-unnecessary-value-param): public.
    std::optional<ScannerOptions> options, const EventPort& events) {
  if (const auto path = file_of(uri, "csv")) return read_csv_scans(*path, model);
  if (const auto path = file_of(uri, "jsonl")) return read_jsonl_scans(*path, model);
  if (is_recording(uri)) return open_recording(uri, model, options, events);
  if (!model) {
    throw Error(ErrorKind::kUsage,
                fmt::format("'{}' gives frames: a model makes scans of them", uri));
  }
  return scan_frames(uri, model, options, events);
}

}  // namespace striper
