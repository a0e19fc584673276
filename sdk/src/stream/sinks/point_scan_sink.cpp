// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <chrono>
#include <cmath>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/whole_file.hpp>
#include <striper/wire/point_file.hpp>
#include <striper/wire/return_code.hpp>

#include "stream/sinks/built_in.hpp"
#include "stream/sinks/scan_motion.hpp"

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;

// How often the number of points in the file's front is brought up to date: what a killed program
// leaves lacks no more.
constexpr std::chrono::seconds kFlushEvery{1};

// The points of one head, in its frame.
class PointScanSink final : public ScanSink {
 public:
  using ScanSink::write;

  PointScanSink(std::string path, wire::PointFormat format, bool doubtful,
                detail::ScanMotion motion)
      : path_(std::move(path)), format_(format), doubtful_(doubtful), motion_(std::move(motion)) {
    if (path_.empty() || path_ == "-") {
      throw Error(ErrorKind::kUsage, "points go to a file: its front is written last");
    }
    require_replaceable(path_, {"ply\n", "# .PCD", "VERSION", "LASF"}, "scans");
  }

  ~PointScanSink() override { finish_quietly(); }

  void open(const HeadInfo& head) override {
    if (!file_) begin(head);
    if (head.head != head_) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("'{}' is of head {}: a file of points is of one head, not of {} too",
                              path_, head_, head.head));
    }
    // One direction for all lasers: it is the same vehicle.
    if (!head.frames.empty()) forward_ = head.frames.front()->T_head_scan.linear().col(2);
  }

  void write(const PolarScan& scan) override {
    const Eigen::Vector3d moved = motion_.distance_m(scan) * forward_;
    const Eigen::Isometry3d T_head_scan =
        scan.frame ? scan.frame->T_head_scan : Eigen::Isometry3d::Identity();
    points_.clear();
    for (const Return& one : scan.returns) {
      wire::CloudPoint& point = points_.emplace_back(point_of(one));
      point.time_s = scan.time.seconds();
      if (is_wanted(one.status))
        place(T_head_scan * Eigen::Vector3d(one.x_m, one.y_m, 0) + moved, point);
    }
    guarded([&] {
      file_->write(points_);
      if (Clock::now() < flush_at_) return;
      file_->flush();
      flush_at_ = Clock::now() + kFlushEvery;
    });
  }

  void finish() override {
    if (!file_) return;
    guarded([&] {
      file_->flush();
      file_.reset();
      stream_.close();
    });
  }

 private:
  void begin(const HeadInfo& head) {
    errno = 0;
    stream_.open(path_, std::ios::binary | std::ios::trunc);
    if (!stream_) fail(errno);
    wire::PointFileOptions options;
    options.full_scale_dn = full_scale_dn(head.source.bit_depth);
    guarded([&] { file_ = wire::make_point_file(format_, stream_, options); });
    head_ = head.head;
    flush_at_ = Clock::now() + kFlushEvery;
  }

  bool is_wanted(ReturnStatus status) const noexcept {
    const Verdict value = verdict(status);
    return value == Verdict::kGood || (value == Verdict::kDoubtful && doubtful_);
  }

  static wire::CloudPoint point_of(const Return& one) {
    wire::CloudPoint point;
    point.intensity = one.intensity_dn;
    point.sigma_m = static_cast<float>(one.sigma_m);
    point.sigma_cal_m = static_cast<float>(one.sigma_cal_m);
    point.width_px = one.width_px;
    point.confidence = one.confidence;
    point.status = wire::return_code(one.status);
    return point;
  }

  static void place(const Eigen::Vector3d& p, wire::CloudPoint& point) {
    point.x_m = static_cast<float>(p.x());
    point.y_m = static_cast<float>(p.y());
    point.z_m = static_cast<float>(p.z());
  }

  // What fails says which file it is, and the system's reason.
  template <typename Action>
  void guarded(Action action) {
    errno = 0;
    try {
      action();
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kIo) throw;
      fail(errno);
    }
    if (!stream_) fail(errno);
  }

  [[noreturn]] void fail(int reason) const {
    throw Error(ErrorKind::kIo,
                fmt::format("cannot write '{}': {}", path_,
                            reason == 0 ? "the disk is full, or it is a pipe"
                                        : std::generic_category().message(reason)),
                reason);
  }

  void finish_quietly() noexcept {
    try {
      finish();
    } catch (...) {  // Whoever wanted to know has called finish.
    }
  }

  std::string path_;
  wire::PointFormat format_;
  bool doubtful_;
  detail::ScanMotion motion_;
  std::string head_;
  Eigen::Vector3d forward_ = Eigen::Vector3d::UnitZ();
  std::ofstream stream_;
  std::unique_ptr<wire::PointFile> file_;
  std::vector<wire::CloudPoint> points_;
  Clock::time_point flush_at_;
};

}  // namespace

std::unique_ptr<ScanSink> detail::make_point_sink(SinkUri uri) {
  const auto format = wire::point_format_from_extension("." + uri.scheme());
  const bool doubtful = uri.take_bool("doubtful").value_or(false);
  ScanMotion motion = ScanMotion::take(uri);
  uri.refuse_unused(fmt::format("doubtful, {}", ScanMotion::kKeys));
  return std::make_unique<PointScanSink>(uri.path(), *format, doubtful, std::move(motion));
}

}  // namespace striper
