// SPDX-License-Identifier: Apache-2.0
// Proves that a recording in one file keeps the promises of a source.
#include <filesystem>
#include <string>

#include <striper/capture/open_source.hpp>
#include <striper/recording/recording_source.hpp>
#include <striper/stream/mcap_recording.hpp>

#include "capture/conformance/frame_source_conformance.hpp"
#include "support/scratch_directory.hpp"

namespace striper::testing {
namespace {

constexpr std::int64_t kPeriod_ns = 20'000'000;

// Thirty different frames, written once.
std::string recording() {
  static const ScratchDirectory kScratch;
  const std::filesystem::path path = kScratch / "run.mcap";
  if (std::filesystem::exists(path)) return path.string();
  McapRecording file(path);
  SourceInfo source;
  source.image_size = source.sensor_size = {64, 48};
  source.picture_rate_hz = 50.0;
  file.open(head_info(kDefaultHead, source, nullptr, StripeAxis::kColumns));
  for (int number = 0; number < 30; ++number) {
    Frame frame;
    frame.image = cv::Mat(48, 64, CV_8UC1, cv::Scalar(7.0 * number));
    frame.sensor_size = source.sensor_size;
    frame.sequence = static_cast<std::uint64_t>(number);
    frame.time.monotonic_ns = number * kPeriod_ns;
    file.write(frame);
  }
  file.close();
  return path.string();
}

SourceUnderTest recorded(const std::string& name, const std::string& query) {
  return {name, [query] { return open_source("mcap:" + recording() + query); }, true};
}

SourceUnderTest from_options() {
  const auto open = [] {
    RecordingOptions options;
    options.path = recording();
    options.pattern = IlluminationPattern::parse("0,dark");
    return std::make_unique<RecordingSource>(options);
  };
  return {"options", open, true};
}

INSTANTIATE_TEST_SUITE_P(Recordings, FrameSourceConformance,
                         ::testing::Values(recorded("whole", ""),
                                           recorded("realtime", "?realtime=yes"),
                                           recorded("pattern", "?laser=0,dark"), from_options()),
                         source_name);

}  // namespace
}  // namespace striper::testing
