// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/capture/sync_check.hpp>

namespace striper {
namespace {

using std::chrono::milliseconds;

// One exposure alone, grey, some of its columns, with the lines that it has.
struct Exposure {
  cv::Mat image;  ///< CV_32FC1.
  std::uint64_t number = 0;
  Field field = Field::kProgressive;
  double first_line = 0.0;  ///< Of the full picture.
  double line_step = 1.0;
};

cv::Mat to_grey(const cv::Mat& image) {
  cv::Mat grey;
  if (image.channels() == 3) {
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  } else {
    grey = image;
  }
  // Two hundred columns tell as much as all of them.
  constexpr int kEnough = 200;
  const int step = std::max(1, grey.cols / kEnough);
  cv::Mat columns;
  cv::resize(grey, columns, {grey.cols / step, grey.rows}, 0, 0, cv::INTER_NEAREST);
  cv::Mat numbers;
  columns.convertTo(numbers, CV_32F);
  return numbers;
}

// The lines of one field out of a woven picture.
cv::Mat every_second_line(const cv::Mat& image, int first) {
  cv::Mat lines((image.rows - first + 1) / 2, image.cols, image.type());
  for (int line = 0; line < lines.rows; ++line) image.row(2 * line + first).copyTo(lines.row(line));
  return lines;
}

std::vector<Exposure> exposures_of(const Frame& frame) {
  const cv::Mat grey = to_grey(frame.image);
  const std::uint64_t number = frame.exposure_number();
  if (!frame.is_interlaced())
    return {{grey, number, frame.field, frame.grid.v.offset, frame.grid.v.step}};
  const bool is_top_first = frame.field == Field::kInterlacedTopFirst;
  const Exposure top{every_second_line(grey, 0), number + (is_top_first ? 0 : 1), Field::kTop, 0,
                     2};
  const Exposure bottom{every_second_line(grey, 1), number + (is_top_first ? 1 : 0), Field::kBottom,
                        1, 2};
  if (is_top_first) return {top, bottom};
  return {bottom, top};
}

// `other` at the lines that `like` has.
cv::Mat resampled(const Exposure& other, const Exposure& like) {
  const double shift = (like.first_line - other.first_line) / other.line_step;
  if (shift == 0.0) return other.image;
  const cv::Mat map = (cv::Mat_<double>(2, 3) << 1, 0, 0, 0, 1, shift);
  cv::Mat result;
  cv::warpAffine(other.image, result, map, like.image.size(),
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return result;
}

double median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How high the highest narrow thing of a column stands above the column's median, averaged over the
// upper half of the columns: a stripe need not cross the whole picture.
double stripe_height(const cv::Mat& difference) {
  constexpr int kNarrow_px = 3;
  cv::Mat narrow;
  cv::blur(difference, narrow, {1, kNarrow_px});
  const cv::Mat columns = narrow.t();
  std::vector<float> heights(static_cast<std::size_t>(columns.rows));
  std::vector<float> column;
  for (int index = 0; index < columns.rows; ++index) {
    column.assign(columns.ptr<float>(index), columns.ptr<float>(index) + columns.cols);
    const double highest = *std::max_element(column.begin(), column.end());
    heights[static_cast<std::size_t>(index)] = static_cast<float>(highest - median_of(column));
  }
  median_of(heights);  // The upper half is behind the middle now.
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  const double sum = std::accumulate(middle, heights.end(), 0.0);
  return sum / static_cast<double>(heights.end() - middle);
}

// Compares neighbouring exposures and counts which of them is lit.
class PhaseCounter {
 public:
  explicit PhaseCounter(SyncReport& report) : report_(report) {}

  void add(Exposure exposure) {
    if (last_ && last_->number + 1 == exposure.number &&
        last_->image.size() == exposure.image.size()) {
      compare(*last_, exposure);
    }
    last_ = std::move(exposure);
  }

  void finish() {
    constexpr std::uint64_t kEnough = 8;
    constexpr double kNearlyAll = 0.9;
    constexpr double kSome = 0.05;
    const auto share = [&](std::uint64_t count) {
      return static_cast<double>(count) / static_cast<double>(report_.pairs);
    };
    const std::uint64_t decided = report_.lit_even + report_.lit_odd;
    if (decided > 0) report_.stripe_contrast = contrast_sum_ / static_cast<double>(decided);
    if (report_.pairs < kEnough) return;
    const std::uint64_t fewer = std::min(report_.lit_even, report_.lit_odd);
    if (share(fewer) > kSome) {
      report_.verdict = SyncVerdict::kSlipping;
    } else if (share(decided - fewer) >= kNearlyAll) {
      report_.verdict = SyncVerdict::kLocked;
      report_.lit_phase = report_.lit_even > report_.lit_odd ? 0 : 1;
      report_.lit_field = fields_[report_.lit_phase];
    } else {
      report_.verdict = share(decided) < 0.5 ? SyncVerdict::kNoDifference : SyncVerdict::kSlipping;
    }
  }

 private:
  void compare(const Exposure& a, const Exposure& b) {
    constexpr double kFarAbove = 2.0;
    constexpr double kQuantum_dn = 0.5;  // Below this it is rounding, not light.
    const cv::Mat difference = a.image - resampled(b, a);
    const double in_a = stripe_height(difference) + kQuantum_dn;
    const double in_b = stripe_height(-difference) + kQuantum_dn;
    ++report_.pairs;
    const bool is_a = in_a > kFarAbove * in_b;
    const bool is_b = in_b > kFarAbove * in_a;
    if (!is_a && !is_b) {
      ++report_.undecided;
      return;
    }
    contrast_sum_ += is_a ? in_a / in_b : in_b / in_a;
    const Exposure& lit = is_a ? a : b;
    const bool is_odd = lit.number % 2 == 1;
    ++(is_odd ? report_.lit_odd : report_.lit_even);
    fields_[is_odd ? 1 : 0] = lit.field;
  }

  SyncReport& report_;
  std::optional<Exposure> last_;
  Field fields_[2] = {Field::kProgressive, Field::kProgressive};
  double contrast_sum_ = 0.0;
};

// Least squares of time over picture number: the rate, and how uneven the times are.
class Beat {
 public:
  void add(const Frame& frame) {
    if (!points_.empty() && points_.back().first == static_cast<double>(frame.sequence)) return;
    points_.emplace_back(static_cast<double>(frame.sequence),
                         1e-9 * static_cast<double>(frame.time.monotonic_ns - origin(frame)));
  }

  void finish(SyncReport& report) const {
    const auto count = static_cast<double>(points_.size());
    if (points_.size() < 3) return;
    double mean_n = 0.0;
    double mean_t = 0.0;
    for (const auto& [n, t] : points_) mean_n += n / count, mean_t += t / count;
    double nn = 0.0;
    double nt = 0.0;
    for (const auto& [n, t] : points_) {
      nn += (n - mean_n) * (n - mean_n);
      nt += (n - mean_n) * (t - mean_t);
    }
    const double period_s = nt / nn;
    double squares = 0.0;
    for (const auto& [n, t] : points_) {
      const double late_s = t - mean_t - period_s * (n - mean_n);
      squares += late_s * late_s;
    }
    report.rate_hz = period_s > 0.0 ? 1.0 / period_s : 0.0;
    report.jitter_ms = 1e3 * std::sqrt(squares / count);
  }

 private:
  std::int64_t origin(const Frame& frame) {
    if (points_.empty()) origin_ns_ = frame.time.monotonic_ns;
    return origin_ns_;
  }

  std::vector<std::pair<double, double>> points_;
  std::int64_t origin_ns_ = 0;
};

}  // namespace

SyncReport check_sync(FrameSource& source, const SyncCheckOptions& options) {
  constexpr milliseconds kPatience{200};
  constexpr int kSilences = 25;
  SyncReport report;
  PhaseCounter phases(report);
  Beat beat;
  source.start();
  report.nominal_rate_hz = source.info().picture_rate_hz;
  std::optional<std::int64_t> begin_ns;
  Frame frame;
  int silences = 0;
  while (silences < kSilences && !(options.is_cancelled && options.is_cancelled())) {
    const NextStatus status = source.next(frame, kPatience);
    if (status == NextStatus::kTimeout) {
      ++silences;
      continue;
    }
    if (status != NextStatus::kFrame) break;
    silences = 0;
    if (!begin_ns) begin_ns = frame.time.monotonic_ns;
    if (1e-9 * static_cast<double>(frame.time.monotonic_ns - *begin_ns) > options.seconds) break;
    if (frame.status != FrameStatus::kOk) continue;
    report.field = frame.field;
    report.exposures_per_picture = frame.exposures_per_picture;
    beat.add(frame);
    for (Exposure& exposure : exposures_of(frame)) phases.add(std::move(exposure));
  }
  report.statistics = source.statistics();
  frame = {};
  source.stop();
  phases.finish();
  beat.finish(report);
  return report;
}

}  // namespace striper
