// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/sinks/csv_sink.hpp>

#include "stream/sinks/built_in.hpp"

namespace striper {
namespace {

// The agreed CSV of one head.
class CsvScanSink : public ScanSink {
 public:
  using ScanSink::write;

  CsvScanSink(std::string path, const CsvOptions& options)
      : path_(std::move(path)), options_(options) {
    require_replaceable_by_scans(path_);
  }

  // Again for a model that was read anew: the file goes on.
  void open(const HeadInfo& head) override {
    if (!file_) {
      head_ = head.head;
      file_.emplace(path_, options_);
    }
    if (head.head == head_) return;
    throw Error(ErrorKind::kUsage,
                fmt::format("'{}' is of head {}: a CSV of scans is of one head, not of {} too",
                            path_, head_, head.head));
  }

  void write(const PolarScan& scan) override { file_->write(scan); }

  void finish() override {
    if (file_) file_->close();
  }

 private:
  std::string path_;
  CsvOptions options_;
  std::string head_;
  std::optional<CsvSink> file_;
};

}  // namespace

std::unique_ptr<ScanSink> detail::make_csv_sink(SinkUri uri) {
  CsvOptions options;
  options.missing = uri.take_bool("missing").value_or(false);
  options.doubtful = uri.take_bool("doubtful").value_or(false) || options.missing;
  uri.refuse_unused("doubtful, missing");
  return std::make_unique<CsvScanSink>(uri.path(), options);
}

}  // namespace striper
