// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/types.hpp>

#include <striper/stripe/extractor.hpp>

namespace striper::speed {

/// Something else to be timed on the same image, columns.
struct SpeedCall {
  std::string name;
  std::function<void(const LitFrame&)> call;
};

struct SpeedOptions {
  double seconds_per_row = 0.3;                     ///< And about as long for the roofline beside.
  std::size_t ring_bytes = std::size_t{400} << 20;  ///< Images too many for any cache.
  bool with_rivals = true;
  /// Allocations of the whole program so far; empty where nobody counts them.
  std::function<std::uint64_t()> allocations;
  std::vector<SpeedCall> parts_of_fast;  ///< Rows before that of `fast`.
  std::function<bool()> should_stop;     ///< Asked between runs; empty: never.
};

/// What `measure_speed` throws where it was told to stop.
struct Stopped {};

/// Medians over 5 to 31 runs.
struct SpeedTime {
  double us = 0.0;       ///< Of one call.
  double of_roof = 0.0;  ///< The time of only reading, right before, over it.
};

/// Time of one call on one image.
struct SpeedRow {
  std::string name;
  SpeedTime hot;                       ///< The same image again and again.
  std::optional<SpeedTime> streaming;  ///< Images that come from memory.
  int pictures = 1;                    ///< Read in one call.
};

/// What one size and depth of image takes, in one run: compare rows of a table, not tables.
struct SpeedTable {
  cv::Size size;
  int bits = 8;  ///< Significant ones: 8, or 12 in pixels of 16.
  double megabytes = 0.0;
  /// The first is the roofline, what `of_roof` refers to: reading the image, adding it up.
  std::vector<SpeedRow> rows;

  double frames_per_s = 0.0;    ///< Scanner::process, refined, one core.
  double latency_p50_us = 0.0;  ///< Of one frame, end to end.
  double latency_p99_us = 0.0;
  double latency_worst_us = 0.0;
  /// The slowest of a stream's first frames, while the pattern is looked at.
  double first_frames_worst_us = 0.0;
  std::optional<double> allocations_per_frame;

  double refined_over_fast = 0.0;
  std::optional<double> argmax_over_pass;  ///< cv::reduceArgMax over the candidate pass.
};

/// The best instruction set that this machine has and the library uses.
std::string instruction_set();

/// Measures the candidate pass, the whole extraction and Scanner::process beside the read roofline
/// and what one would write with OpenCV, on a noisy image of a bent stripe with a step. Some
/// seconds, one thread.
SpeedTable measure_speed(cv::Size size, int bits, const SpeedOptions& options);

}  // namespace striper::speed
