// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <striper/core/frame.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/wire/mcap_reader.hpp>
#include <striper/wire/ros_messages.hpp>
#include <striper/wire/striper_messages.hpp>

namespace striper::detail {

/// The frames of one head of an MCAP file, put together of Image and FrameInfo. Not thread-safe.
class RecordedFrames {
 public:
  /// @param head empty: the only one. @throws Error as RecordingSource.
  RecordedFrames(const std::filesystem::path& path, std::string head);

  /// The next frame; false at the end. What cannot be read is a frame of status kCorrupt.
  /// @throws Error{kIo}.
  bool next(Frame& frame);

  /// What the recording says of the source that it is of; `false` where it is other people's.
  bool tell_of_source(SourceInfo& info) const;

  /// Of the last frame; automatic where it has no FrameInfo.
  const IlluminationPattern& pattern() const noexcept { return pattern_; }

  /// Messages that stand for frames, where the file has a summary.
  std::optional<std::uint64_t> count() const;

  const wire::McapReader& reader() const noexcept { return reader_; }

 private:
  enum class Kind { kOther, kImage, kFrameInfo };

  Kind kind_of(const wire::McapChannel& channel);
  void choose_head();
  void take_image(const wire::McapMessage& message);
  void take_info(const wire::McapMessage& message, Frame& frame);
  void take_alone(const wire::McapMessage& message, Frame& frame);

  std::string path_;
  wire::McapReader reader_;
  std::string head_;
  std::string image_topic_;  // Of several of a head: image_raw, else the first.
  bool has_info_ = false;    // Each frame has a FrameInfo.
  std::map<std::uint16_t, Kind> kinds_;

  IlluminationPattern pattern_;
  wire::Image image_message_;
  wire::FrameInfo info_message_;
  cv::Mat image_;            // Waits for its FrameInfo.
  std::string image_fault_;  // Why there is none.
  std::uint64_t image_time_ns_ = 0;
  std::uint64_t images_alone_ = 0;
};

}  // namespace striper::detail
