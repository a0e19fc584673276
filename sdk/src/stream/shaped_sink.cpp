// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <string>
#include <utility>

#include <striper/core/error.hpp>
#include <striper/profile/average.hpp>
#include <striper/profile/smooth.hpp>
#include <striper/stream/shaped_sink.hpp>

namespace striper {
namespace {

class ShapedSink : public ScanSink {
 public:
  ShapedSink(std::unique_ptr<ScanSink> sink, const ShapeOptions& options,
             std::shared_ptr<ShapeCounts> counts)
      : sink_(std::move(sink)),
        options_(options),
        counts_(std::move(counts)),
        averager_(options.average) {}

  SinkNeeds needs() const override { return sink_->needs(); }
  void write(const Frame& frame) override { sink_->write(frame); }
  void status(const ScannerStatus& status) override { sink_->status(status); }
  void event(const Event& event) override { sink_->event(event); }

  void open(const HeadInfo& head) override {
    models_[head.head] = head.model;
    std::erase_if(smoothers_, [&](const auto& one) { return one.first.first == head.head; });
    sink_->open(head);
  }

  void write(const PolarScan& scan) override {
    if (options_.average == 1) return write_shaped(scan);
    if (const PolarScan* const mean = averager_.add(scan)) write_shaped(*mean);
  }

  void finish() override {
    while (options_.average > 1) {
      const PolarScan* const mean = averager_.finish();
      if (mean == nullptr) break;
      write_shaped(*mean);
    }
    if (counts_) {
      counts_->still += averager_.still();
      counts_->moved += averager_.moved();
      counts_->incomplete += averager_.incomplete();
    }
    sink_->finish();
  }

 private:
  void write_shaped(const PolarScan& scan) {
    scan_ = scan;
    if (options_.smooth) smoother_of(scan).smooth(scan_);
    if (options_.resample) scan_ = resampled(scan_, *options_.resample, options_.fill_gaps_m);
    sink_->write(scan_);
    if (!counts_) return;
    ++counts_->scans;
    for (const Return& r : scan_.returns) ++counts_->returns[static_cast<std::size_t>(r.status)];
  }

  Smoother& smoother_of(const PolarScan& scan) {
    const std::pair plane(std::string(scan.head()), scan.laser);
    const auto found = smoothers_.find(plane);
    if (found != smoothers_.end()) return found->second;
    const StriperModel* const model = models_[plane.first].get();
    return smoothers_.emplace(plane, Smoother(options_for(model, scan.laser))).first->second;
  }

  std::unique_ptr<ScanSink> sink_;
  ShapeOptions options_;
  std::shared_ptr<ShapeCounts> counts_;
  ScanAverager averager_;
  std::map<std::string, std::shared_ptr<const StriperModel>> models_;  // By head.
  std::map<std::pair<std::string, int>, Smoother> smoothers_;          // By head and laser.
  PolarScan scan_;
};

}  // namespace

void ShapeOptions::validate() const {
  if (fill_gaps_m && !resample)
    throw Error(ErrorKind::kUsage,
                "gaps are filled where a scan is resampled: say to what by resample (--resample)");
}

std::unique_ptr<ScanSink> shaped_sink(std::unique_ptr<ScanSink> sink, const ShapeOptions& options,
                                      std::shared_ptr<ShapeCounts> counts) {
  options.validate();
  if (!options.is_any()) return sink;
  return std::make_unique<ShapedSink>(std::move(sink), options, std::move(counts));
}

}  // namespace striper
