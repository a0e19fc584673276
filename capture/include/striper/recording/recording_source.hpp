// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <striper/capture/source_uri.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {

/// Which recording is replayed, and how.
struct RecordingOptions {
  std::string path;          ///< The MCAP file.
  std::string head;          ///< Of several heads one; empty: the only one.
  bool is_realtime = false;  ///< Frames come no sooner than they were recorded: `next` times out.
  std::optional<int> bits;   ///< Significant bits of other people's 16-bit images.

  std::string uri;              ///< What it was opened by; made from `path` when empty.
  EventPort events;             ///< Hears of damage.
  IlluminationPattern pattern;  ///< `laser=`
  std::optional<Field> fields;  ///< `fields=`: the frames are two fields each.

  /// Reads `mcap:FILE?key=value&...`; the keys are RecordingSource's.
  /// @throws Error{kUsage} quoting the value that makes no sense.
  static RecordingOptions from_uri(SourceUri uri);
};

/// Gives the frames of an MCAP recording, in the order in which they were written:
///
///     mcap:run.mcap                    what `striper record -o run.mcap` kept, to the bit
///     mcap:run.mcap?head=left          of several heads one
///     mcap:drive.mcap                  anybody's sensor_msgs/msg/Image
///
/// Keys: `head=` the head, or the namespace of the topic (needed where there are several),
/// `realtime=yes` frames come no sooner than they were recorded, `bits=` significant bits of other
/// people's 16-bit images, `laser=` and `fields=` as for every source (open_source.hpp).
///
/// Images with FrameInfo (CONVENTIONS.md, "Messages") are replayed exactly. Images of other people
/// are numbered from 0 and timed by their stamps; a compressed image is not read.
///
/// An image that cannot be read, or that a recording lacks, is a frame of status kCorrupt; one of
/// another size or type than the first has kWrongSize. Chunks that are damaged are left out, a
/// file that was cut is read to its last whole chunk; `recording_cut` says so at the end.
///
/// Cost: a chunk is read and decompressed at a time, on the caller's thread.
class RecordingSource final : public FrameSource {
 public:
  /// @throws Error{kUsage} where a head must be named or `bits` cannot be, {kNotFound} where there
  /// is no
  ///         such file or no image in it, {kBadFile} where it is no MCAP file.
  explicit RecordingSource(const RecordingOptions& options);
  ~RecordingSource() override;

  SourceInfo info() const override;
  void start() override;
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override;
  void stop() override;
  SourceStatistics statistics() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper
