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

/// Which image files are given as frames, and how.
struct ImageOptions {
  std::string path;         ///< A directory, a pattern or a single image file.
  double fps = 30.0;        ///< Frames a second; recordings keep their own times.
  std::optional<int> bits;  ///< Significant bits of 16-bit images; empty: as the file says.

  std::string uri;              ///< What it was opened by; made from `path` when empty.
  EventPort events;             ///< Hears what is odd about the images.
  IlluminationPattern pattern;  ///< `laser=`
  std::optional<Field> fields;  ///< `fields=`: the frames are two fields each.

  /// Reads `images:PATH?key=value&...`; the keys are ImageSource's.
  /// @throws Error{kUsage} quoting the value that makes no sense.
  static ImageOptions from_uri(SourceUri uri);
};

/// Gives the image files of a directory, in natural order, as frames:
///
///     images:DIR                       the directory's image files
///     images:shots/img_*.png           those that match
///     images:shot.jpg                  a single one
///
/// Keys: `fps=` frames a second (default 30; recordings keep their own times), `bits=`
/// significant bits of 16-bit images (default: what the file says), `laser=` and `fields=` as for
/// every source (open_source.hpp).
///
/// What a Recorder wrote is replayed exactly (`frames.csv` in the directory): pixels, numbers,
/// times, illumination, field, grid, bit depth and status. Without it files are numbered from 0
/// and timed by `fps`; where the names of six or more count (`shot_007, shot_008, shot_010, ...`),
/// a number that is missing is a lost frame, so that the illumination pattern goes on across it.
///
/// An image file that is missing, does not decode to its end or is unreadable is a frame with
/// status kCorrupt, one of another size or pixel type than the first that decodes has kWrongSize;
/// both name the file in `status_detail`, both are counted and neither ends the stream.
///
/// Cost: one file read and decode per frame, on the caller's thread; a frame handed in again gets
/// its memory reused when nobody else holds it.
class ImageSource final : public FrameSource {
 public:
  /// @throws Error{kUsage} where `bits` cannot be, Error{kNotFound} where there are no image files,
  ///         Error{kIo} where the directory cannot be read, Error{kBadFile} on a malformed
  ///         frames.csv.
  explicit ImageSource(const ImageOptions& options);
  ~ImageSource() override;

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
