// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <striper/capture/source_uri.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/gige/gige_options.hpp>

namespace striper {

/// Why frames did not come whole, and what the network did; counts since `start`.
struct GigeStatistics {
  std::uint64_t missing_packets = 0;  ///< Frames given up on for missing packets.
  std::uint64_t timeouts = 0;         ///< Frames that did not become whole in time.
  std::uint64_t size_mismatch = 0;    ///< Frames of another size than was agreed.
  std::uint64_t aborted = 0;          ///< Frames under way when the stream ended.
  std::uint64_t underrun = 0;         ///< Frames that found no buffer.
  std::uint64_t resend_requests = 0;  ///< Packets asked for again.
  std::uint64_t resent_packets = 0;   ///< Packets that came then.
  std::uint64_t socket_drops = 0;     ///< Packets that the kernel threw away: buffer too small.
  std::uint64_t losses = 0;           ///< Times the camera was found to be gone.
  int packet_bytes = 0;
  int socket_buffer_bytes = 0;  ///< In force, as the kernel counts.
  double clock_rate = 1.0;      ///< Host seconds per camera second.
  /// When the last packet of the frame that `next` gave last had come, on CLOCK_MONOTONIC.
  std::int64_t last_completed_ns = 0;
};

/// A GigE Vision or USB3 Vision camera, through Aravis:
///
///     gige:SERIAL-or-IP?exposure_us=20&fps=200&strobe=Line2&laser=0,dark
///
/// The address is a serial, user name, IP, MAC, model or nothing (the first that answers). Keys:
/// - `pixel_format`, `roi=left,top,width,height`, `binning=2` or `2x1`
/// - `exposure_us`, `gain`, `black_level`, `fps`; any GenICam feature by name: `ExposureTime=20`,
///   `feature.Name=value`. Every value is checked against the camera's range and read back.
/// - `strobe=Line2` the output line that fires the laser during the exposure (`Line2,Line3` for
///   lasers 0 and 1). With a `laser=` that alternates, the line is switched exposure by exposure:
///   by the camera's sequencer, or by the host with software triggers (`switching=`). Frames say
///   what fired, from the line state that came with the frame where the camera reports it.
///   Without it and without a trigger, a `laser=` with dark exposures only says what something else
///   does; that is logged as a warning.
/// - `trigger=off|software|Line1|Action`; with an action also `action=DEVICE_KEY,GROUP_KEY,MASK`,
///   the keys of the commands that it shall act on (`trigger_gige_action`)
/// - `encoder=yes|Encoder0|Counter1` frames carry what the camera's encoder or counter shows, from
///   the frame's chunk data. To expose by it: `trigger=Encoder0`, or the name that the camera has
///   among its trigger sources, and its own features (`EncoderSourceA=Line0`, `EncoderDivider=10`).
/// - `packet_size`, `packet_delay_us`, `resend`, `frame_timeout_ms`, `buffers`, `socket_buffer_mb`,
///   `heartbeat_ms`, `reconnect`, `ptp`
///
/// Time: the camera's timestamps on CLOCK_MONOTONIC by a running fit (ClockMap), from latched
/// timestamps where the camera has them, otherwise from the arrival of the first packet. A
/// timestamp is taken as the start of the exposure, as SFNC has it. With `ptp=yes` the camera
/// follows the network's time, and while it does the time of day is PTP's; before, the host's.
///
/// Lasers are commanded off when the camera is opened, before streaming, after `stop`, after every
/// loss and in the destructor: after a loss as soon as the camera answers, unless another program
/// has taken it, which is logged. A program that a signal ends must let the destructor run.
///
/// A camera that is lost (no answer, control lost or taken by another program) is noticed within
/// 3 s and opened again with growing pauses, its settings put back; `next` times out meanwhile, the
/// sequence goes on. With `reconnect=no` that is logged and it ends: kEnd; to close it then takes
/// seconds, since the camera is waited for.
///
/// Mono8, Mono10 to 16 and BGR8 frames are the camera's buffers themselves, no copy; a Frame that
/// is kept keeps its buffer, and when only three of `buffers` are left the next ones are copies.
/// Other formats are unpacked. No allocation per frame otherwise.
class GigeSource final : public FrameSource {
 public:
  /// Opens and sets up. @throws Error{kUsage, kNotFound, kUnsupported, kDevice} quoting feature,
  /// value and what is allowed.
  explicit GigeSource(GigeOptions options);
  ~GigeSource() override;

  SourceInfo info() const override;
  void start() override;
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override;
  void stop() override;
  SourceStatistics statistics() const override;
  /// `exposure_us`, `gain_db`, `laser` where `strobe=` names a line, `region` (read only). What was
  /// set stays set when the camera is lost and comes back.
  Controls& controls() override;

  /// The network's side of it. Thread-safe.
  GigeStatistics stream_statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper
