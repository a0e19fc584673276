// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/ridges/clipped_runs.hpp"

#include <algorithm>
#include <cstdint>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// Pixels of a scan line, first and last.
struct Run {
  int first;
  int last;

  int length() const { return last - first + 1; }
};

template <typename Pixel>
class RunsOfLine {
 public:
  RunsOfLine(const LitFrame& frame, StripeAxis axis, int number, const ClippedRuns::Limits& limits)
      : line_(frame, axis, number), number_(number), limits_(limits) {}

  void add_to(Ridges& ridges) const {
    for (int k = 0; k < line_.length(); ++k) {
      if (!is_clipped(k)) continue;
      Run run{k, k};
      while (run.last + 1 < line_.length() && is_clipped(run.last + 1)) ++run.last;
      if (run.length() <= limits_.most_px) add(run, ridges);
      k = run.last;
    }
  }

 private:
  bool is_clipped(int k) const { return line_.clipped(k) && !line_.masked(k); }

  void add(const Run& run, Ridges& ridges) const {
    const int rise_dn = line_.value((run.first + run.last) / 2) - brighter_side_dn(run);
    if (rise_dn >= limits_.least_dn) ridges.add_run(number_, run.first, run.last, rise_dn);
  }

  // At the image's borders the one side that there is decides.
  int brighter_side_dn(const Run& run) const {
    const int before = run.first - limits_.distance_px;
    const int after = run.last + limits_.distance_px;
    const int last = line_.length() - 1;
    if (before < 0) return line_.value(std::min(after, last));
    if (after > last) return line_.value(before);
    return std::max(line_.value(before), line_.value(after));
  }

  LitLine<Pixel> line_;
  int number_;
  const ClippedRuns::Limits& limits_;
};

// Of each scan line, in the order of memory.
template <typename Pixel>
void find_brightest(const cv::Mat& image, StripeAxis axis, cv::Mat& brightest) {
  auto* const of_line = brightest.ptr<Pixel>();
  std::fill_n(of_line, brightest.cols, Pixel{0});
  for (int row = 0; row < image.rows; ++row) {
    const Pixel* const pixels = image.ptr<Pixel>(row);
    if (axis == StripeAxis::kRows) {
      of_line[row] = row_maximum(pixels, image.cols);
      continue;
    }
    for (int col = 0; col < image.cols; ++col) of_line[col] = std::max(of_line[col], pixels[col]);
  }
}

template <typename Pixel>
void add_runs(const LitFrame& frame, StripeAxis axis, const ClippedRuns::Limits& limits,
              const cv::Mat& brightest, Ridges& ridges) {
  const auto* const of_line = brightest.ptr<Pixel>();
  for (int line = 0; line < line_count(frame.lit, axis); ++line) {
    if (of_line[line] < frame.full_scale_dn) continue;
    RunsOfLine<Pixel>(frame, axis, line, limits).add_to(ridges);
  }
}

}  // namespace

void ClippedRuns::reserve(const LitFrame& frame, StripeAxis axis) {
  brightest_.create(1, line_count(frame.lit, axis), frame.lit.type());
}

void ClippedRuns::add_to(Ridges& ridges, const LitFrame& frame, StripeAxis axis,
                         const Limits& limits) {
  reserve(frame, axis);
  if (frame.lit.depth() == CV_8U) {
    find_brightest<std::uint8_t>(frame.lit, axis, brightest_);
    add_runs<std::uint8_t>(frame, axis, limits, brightest_, ridges);
  } else {
    find_brightest<std::uint16_t>(frame.lit, axis, brightest_);
    add_runs<std::uint16_t>(frame, axis, limits, brightest_, ridges);
  }
}

}  // namespace striper::detail
