// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <ostream>
#include <utility>

#include <striper/core/error.hpp>
#include <striper/wire/point_file.hpp>

#include "wire/point_formats.hpp"

namespace striper::wire {
namespace {

std::unique_ptr<PointLayout> make_layout(PointFormat format, const PointFileOptions& options) {
  switch (format) {
    case PointFormat::kPly:
      return std::make_unique<PlyLayout>();
    case PointFormat::kPcd:
      return std::make_unique<PcdLayout>();
    case PointFormat::kLas:
      return std::make_unique<LasLayout>(options.full_scale_dn);
  }
  throw Error(ErrorKind::kBadValue, "no such format of points");
}

class LaidOutFile : public PointFile {
 public:
  LaidOutFile(std::unique_ptr<PointLayout> layout, std::ostream& stream)
      : layout_(std::move(layout)), stream_(stream), begin_(stream.tellp()) {
    put_header();
    send();
  }

  void write(std::span<const CloudPoint> scan) override {
    buffer_.clear();
    for (const CloudPoint& point : scan) add(point);
    counts_.is_organised =
        counts_.is_organised && (counts_.scans == 0 || scan.size() == counts_.scan_points);
    counts_.scan_points = scan.size();
    ++counts_.scans;
    send();
  }

  void flush() override {
    const std::ostream::pos_type end = stream_.tellp();
    stream_.seekp(begin_);
    put_header();
    send();
    stream_.seekp(end);
    stream_.flush();
    require_good();
  }

  std::uint64_t points() const noexcept override { return counts_.points; }
  std::uint64_t left_out() const noexcept override { return left_out_; }

 private:
  void add(const CloudPoint& point) {
    const std::array<double, 3> place = {point.x_m, point.y_m, point.z_m};
    const bool is_there =
        std::all_of(place.begin(), place.end(), [](double value) { return std::isfinite(value); });
    if (!is_there && !layout_->keeps_missing()) return;
    if (!layout_->put_point(point, buffer_)) {
      ++left_out_;
      return;
    }
    ++counts_.points;
    for (std::size_t axis = 0; is_there && axis < 3; ++axis) {
      counts_.least[axis] = std::min(counts_.least[axis], place[axis]);
      counts_.greatest[axis] = std::max(counts_.greatest[axis], place[axis]);
    }
  }

  void put_header() {
    buffer_.clear();
    layout_->put_header(counts_, buffer_);
  }

  void send() {
    stream_.write(reinterpret_cast<const char*>(buffer_.data()),
                  static_cast<std::streamsize>(buffer_.size()));
    require_good();
  }

  void require_good() const {
    if (!stream_)
      throw Error(ErrorKind::kIo,
                  "a file of points cannot be written: the disk is full, or it is a pipe");
  }

  std::unique_ptr<PointLayout> layout_;
  std::ostream& stream_;
  std::ostream::pos_type begin_;
  Bytes buffer_;
  PointCounts counts_;
  std::uint64_t left_out_ = 0;
};

}  // namespace

std::optional<PointFormat> point_format_from_extension(std::string_view extension) noexcept {
  if (extension == ".ply") return PointFormat::kPly;
  if (extension == ".pcd") return PointFormat::kPcd;
  if (extension == ".las") return PointFormat::kLas;
  return std::nullopt;
}

std::unique_ptr<PointFile> make_point_file(PointFormat format, std::ostream& stream,
                                           const PointFileOptions& options) {
  if (!(options.full_scale_dn > 0.0))
    throw Error(ErrorKind::kBadValue, "full_scale_dn must be above 0");
  return std::make_unique<LaidOutFile>(make_layout(format, options), stream);
}

}  // namespace striper::wire
