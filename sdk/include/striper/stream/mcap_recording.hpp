// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include <striper/stream/scan_sink.hpp>
#include <striper/wire/mcap_series.hpp>

namespace striper {

// What stands behind a head's name in a recording: its topics (after a slash), metadata,
// attachment.
inline constexpr std::string_view kPolarScanTopic = "/polar_scan";
inline constexpr std::string_view kImageTopic = "/image_raw";
inline constexpr std::string_view kSourceMetadata = "/source";
inline constexpr std::string_view kModelAttachment = "/striper.yaml";

/// Writes one run as an MCAP file that ROS 2's and Foxglove's tools open, and that reads back to
/// the bit: scans as /HEAD/polar_scan (beside them /HEAD/points and /HEAD/scan, for viewers),
/// frames as /HEAD/image_raw with /HEAD/frame_info, /HEAD/camera_info, /HEAD/events, /diagnostics,
/// /tf_static; each head's model as the attachment HEAD/striper.yaml, its source as the metadata
/// HEAD/source.
///
/// The file is made by the first `open`. A frame's Image stands in front of its FrameInfo, so that
/// a file that was cut never gives a frame without its image. Nothing is allocated per scan in
/// steady state. Not thread-safe.
class McapRecording {
 public:
  explicit McapRecording(std::filesystem::path path, wire::McapRotation rotation = {});
  McapRecording(const McapRecording&) = delete;
  McapRecording& operator=(const McapRecording&) = delete;
  ~McapRecording();  ///< Closes without reporting.

  /// A head; again where its model changed. What follows is of heads that were opened. @throws
  /// Error{kIo}.
  void open(const HeadInfo& head);

  /// @throws Error{kIo}, as all of these.
  void write(const PolarScan& scan);
  /// A frame of `frame.head` (`striper` where that is empty), without loss; one without an image,
  /// or with one of another type than cameras give, as its FrameInfo alone.
  void write(const Frame& frame);
  void write(const ScannerStatus& status);
  void write(const Event& event);       ///< Before the first head: kept until then.
  void write(const CurbsSeen& seen);    ///< As /HEAD/curbs.
  void write(const ObjectsSeen& seen);  ///< As /HEAD/objects.

  void close();

  /// The file, or with rotation the files.
  std::vector<std::filesystem::path> paths() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
