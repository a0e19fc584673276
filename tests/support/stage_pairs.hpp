// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>

namespace striper::testing {

inline AmbientOptions with_pattern(const char* pattern) {
  AmbientOptions options;
  options.pattern = IlluminationPattern::parse(pattern);
  return options;
}

/// A frame whose pixels tell its number and whether it is lit.
inline Frame tagged(std::uint64_t sequence, const IlluminationPattern& pattern) {
  Frame frame;
  frame.image = cv::Mat(32, 48, CV_8UC1);
  frame.image.setTo(pattern.at(sequence).is_dark() ? sequence % 100 : 100 + sequence % 100);
  frame.sensor_size = frame.image.size();
  frame.sequence = sequence;
  return frame;
}

/// What a stage made of a lit exposure.
struct StagePair {
  std::uint64_t lit;
  int laser;
  int dark_value;  ///< -1: nothing subtracted.
};
inline bool operator==(const StagePair& a, const StagePair& b) {
  return a.lit == b.lit && a.laser == b.laser && a.dark_value == b.dark_value;
}
inline void PrintTo(const StagePair& pair, std::ostream* out) {
  *out << pair.lit << " laser " << pair.laser << " minus " << pair.dark_value;
}

using StagePairs = std::vector<StagePair>;

/// Adds what the stage has ready.
inline void take(AmbientStage& stage, StagePairs& pairs) {
  while (const LitFrame* const lit = stage.next()) {
    pairs.push_back({lit->sequence, lit->laser,
                     lit->dark.empty() ? -1 : static_cast<int>(lit->dark.at<std::uint8_t>(3, 3))});
  }
}

}  // namespace striper::testing
