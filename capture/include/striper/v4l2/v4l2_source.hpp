// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <striper/capture/source_uri.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/core/illumination_pattern.hpp>

namespace striper {

/// What is asked of a V4L2 device. Whatever is left empty is chosen: the best that the device has,
/// and `SourceInfo::description` says what that is.
struct V4l2Options {
  std::string
      device;         ///< `/dev/video0`, or better `/dev/v4l/by-id/...`, which survives replugging.
  std::string input;  ///< Number or name of the input (`1`, `S-Video`); its own by default.
  std::string standard;  ///< `ntsc`, `pal`, `secam`, a variant (`ntsc-j`, `pal-60`), or `auto`.
  std::string format;    ///< Four-character code: `GREY`, `Y10`, `Y16`, `YUYV`, `NV12`, `MJPG`, ...
  std::string field;     ///< `none`, `interlaced`, `interlaced-tb`, `seq-bt`, `alternate`, ...
  int width = 0;         ///< Of the whole image; 0: chosen.
  int height = 0;
  double fps = 0.0;          ///< 0: as the device has it.
  double exposure_us = 0.0;  ///< Switches automatic exposure off; 0: as the device has it.

  /// Any control of the device by the name that `striper devices` and v4l2-ctl show, with a number
  /// or, for a menu, the entry's text.
  std::map<std::string, std::string> controls;

  int buffers = 10;  ///< Asked of the driver, 4 to 32.
  int queue = 4;     ///< Frames held for a late reader, 1 to 16; the oldest goes first.

  /// How long a lost device is waited for, in seconds; 0 ends the stream at once, infinite (the
  /// default) waits for ever.
  double reconnect_s = std::numeric_limits<double>::infinity();
  double stall_s = 1.5;         ///< No frame for so long: the device is opened again.
  bool require_signal = true;   ///< Refuse an input without signal; `signal=ignore` in a URI.
  double time_offset_us = 0.0;  ///< Added to every time: the camera's own latency, if known.

  std::string uri;              ///< What it was opened by; made from `device` when empty.
  EventPort events;             ///< Hears what the device does.
  IlluminationPattern pattern;  ///< `laser=`
  std::optional<Field> fields;  ///< `fields=`: what the driver says of the field order is wrong.

  /// Reads `v4l2:DEVICE?key=value&...`. Keys: input, standard, format, field, size (`720x480`),
  /// fps, exposure_us, buffers, queue, reconnect (`yes`, `no` or seconds), stall_s, signal
  /// (`require` or `ignore`), time_offset_us, laser, fields; every other key is a control of the
  /// device.
  /// @throws Error{kUsage} quoting the value that makes no sense.
  static V4l2Options from_uri(SourceUri uri);

  /// @throws Error{kUsage} where a number is outside its bounds.
  void validate() const;
};

/// Opens a camera or grabber through the kernel's Video4Linux API: USB (UVC), composite and S-Video
/// grabbers (NTSC, PAL), CSI cameras; single- and multi-planar drivers.
///
/// Frames. Grey formats, luma planes (NV12 and its like) and BGR are given in the driver's own
/// memory without a copy, held by `Frame::lease`; when a reader holds so many that the driver would
/// run dry, or the format must be rearranged (YUYV, packed, Bayer, RGB, JPEG), the image is
/// copied once, into the memory of the frame handed in where nobody else holds it. An interlaced
/// frame comes interlaced, its field order from the driver and the standard (525 lines: bottom
/// first, others: top first); `seq` and `alternate` come as single fields in the order of their
/// exposure.
///
/// Memory. The driver's buffers are mapped (V4L2_MEMORY_MMAP). Neither user pointers nor DMABUF
/// would save anything here: no byte is copied as it is, and a frame of 640x480 costs 4 us of
/// processor time in all, where a copy alone takes 8 us (tests/capture/v4l2/cost_test.cpp, one core
/// at 2.1 GHz). User pointers bind a driver to pages that it may not reach; DMABUF passes frames
/// on to other devices, and here the processor reads them.
///
/// Times. The kernel's time stamp, at the start of the exposure or the end of the frame as the
/// driver says, turned into the middle of the frame's (field's) time on the wire, or of the
/// exposure where that begins at the stamp and its length is known. Drivers without a monotonic
/// stamp are timed on arrival. `time_offset_us` adds what only a measurement can know.
///
/// Queue. A thread takes frames from the driver as they come; at most `queue` wait for the reader
/// and then the oldest is discarded (`SourceStatistics::overrun`). Gaps in the driver's own
/// numbering are `dropped`. Error-flagged frames and those of an input without signal come as
/// kCorrupt without pixels; a grabber that takes longer than a quarter of an exposure's period to
/// say whether it has signal is asked ten times a second only, so that a loss is seen up to 0.1 s
/// late.
///
/// Faults. A device that vanishes, stalls or fails while it streams is closed and opened again with
/// a growing pause (up to 1 s), counted in `reconnects`; numbering goes on by the time that passed,
/// so that an illumination pattern keeps its phase.
///
/// @throws Error{kNotFound} no such device, Error{kDevice} busy, no permission, not a camera, no
///         signal; Error{kUnsupported} a format, size or standard that it does not have;
///         Error{kUsage} unknown control or bad value. Each says what to do.
std::unique_ptr<FrameSource> open_v4l2(const V4l2Options& options);

}  // namespace striper
