// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <striper/scan/scan_csv.hpp>
#include <striper/stream/scan_files.hpp>

namespace striper {
namespace {

// One scan ahead: its first tells whether there is a clock, and the axis.
class CsvScans : public ScanSource {
 public:
  CsvScans(const std::filesystem::path& path, std::shared_ptr<const StriperModel> model)
      : reader_(path), model_(std::move(model)) {
    is_pending_ = reader_.next(pending_);
    SourceInfo source;
    source.uri = path.string();
    source.description = "scans in " + source.uri;
    source.has_clock = is_pending_ && pending_.time.utc_offset_ns.has_value();
    info_ = head_info(kDefaultHead, source, model_, pending_.axis);
  }

  HeadInfo info() const override { return info_; }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (!is_pending_) return NextStatus::kEnd;
    std::swap(scan, pending_);
    scan.frame = frame_of(scan.laser);
    is_pending_ = reader_.next(pending_);
    return NextStatus::kFrame;
  }

 private:
  const std::shared_ptr<const ScanFrame>& frame_of(int laser) {
    for (const auto& frame : info_.frames) {
      if (frame->laser == laser) return frame;
    }
    return info_.frames.emplace_back(make_scan_frame(kDefaultHead, laser, model_));
  }

  ScanCsvReader reader_;
  std::shared_ptr<const StriperModel> model_;
  PolarScan pending_;
  bool is_pending_ = false;
  HeadInfo info_;
};

}  // namespace

std::unique_ptr<ScanSource> read_csv_scans(const std::filesystem::path& path,
                                           std::shared_ptr<const StriperModel> model) {
  return std::make_unique<CsvScans>(path, std::move(model));
}

}  // namespace striper
