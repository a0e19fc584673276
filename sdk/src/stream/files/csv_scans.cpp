// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/scan/scan_csv.hpp>
#include <striper/stream/scan_files.hpp>

namespace striper {
namespace {

// A table of scans, each with its frame.
class CsvScans : public ScanSource {
 public:
  CsvScans(const std::filesystem::path& path, std::shared_ptr<const StriperModel> model)
      : reader_(path), model_(std::move(model)) {
    has_pending_ = reader_.next(pending_);
    SourceInfo source;
    source.uri = path.string();
    source.description = "scans in " + source.uri;
    source.has_clock = has_pending_ && pending_.time.utc_offset_ns;
    info_ = head_info(kDefaultHead, source, model_, pending_.axis);
    pending_.frame = frame_of(pending_.laser);
  }

  HeadInfo info() const override { return info_; }

  std::string loss() const override {
    if (reader_.cut_line() == 0) return {};
    return fmt::format("{}:{}: the line is cut off and left out", info_.source.uri,
                       reader_.cut_line());
  }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (std::exchange(has_pending_, false)) {
      std::swap(scan, pending_);
      return NextStatus::kFrame;
    }
    if (!reader_.next(scan)) return NextStatus::kEnd;
    scan.frame = frame_of(scan.laser);
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
  PolarScan pending_;  // The first, which says what the others are.
  bool has_pending_ = false;
  HeadInfo info_;
};

}  // namespace

std::unique_ptr<ScanSource> read_csv_scans(const std::filesystem::path& path,
                                           std::shared_ptr<const StriperModel> model) {
  return std::make_unique<CsvScans>(path, std::move(model));
}

}  // namespace striper
