// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <striper/core/frame_source.hpp>

namespace striper {

/// Keeps the frames of any source without loss: one PNG each and a line in `frames.csv` with
/// everything else that a Frame says. `images:DIR` gives the same frames again.
///
/// At every moment what is on the disk is a whole recording: an image file appears under its name
/// once it is complete (written beside and renamed), then its line is added with one write. A frame
/// without an image (a corrupt one) gets its line and no image file.
///
/// Cost: one PNG encoding per frame on the caller's thread. Not
/// thread-safe.
class Recorder {
 public:
  /// Makes the directory where there is none.
  /// @param info of the source to record: its pattern is kept.
  /// @throws Error{kUsage} where the directory already holds a recording or image files, Error{kIo}
  ///         where it cannot be made or written.
  Recorder(std::filesystem::path directory, const SourceInfo& info);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();  ///< Closes; nothing is pending. Where nothing was recorded `frames.csv` goes again,
                ///< so that the directory can be used.

  /// Adds one frame. @throws Error{kIo} naming the file and the system's reason (disk full, ...);
  /// what was recorded before stays whole.
  void write(const Frame& frame);

  std::uint64_t frames() const noexcept { return frames_; }

 private:
  std::string write_image(const Frame& frame);

  struct Table;  // frames.csv
  std::filesystem::path directory_;
  IlluminationPattern pattern_;
  std::unique_ptr<Table> table_;
  std::uint64_t frames_ = 0;
  std::vector<unsigned char> encoded_;
};

}  // namespace striper
