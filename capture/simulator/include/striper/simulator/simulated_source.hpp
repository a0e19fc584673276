// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <striper/core/frame_source.hpp>
#include <striper/core/uri.hpp>
#include <striper/simulator/simulator.hpp>

namespace striper {

/// How the simulator serves frames.
struct SimulatedSourceOptions {
  std::optional<std::uint64_t> frames;  ///< Ends after so many; otherwise it never ends.
  bool illumination_known =
      true;                    ///< Frames and info say which laser fired; else one must find out.
  bool pattern_given = false;  ///< Info says the pattern even where the frames do not.
  bool realtime = false;       ///< `next` waits until the frame is due, or times out.
  /// Frames carry what an encoder on a wheel of the device shows; 0: there is none.
  double encoder_counts_per_m = 0.0;
  int encoder_bits = 32;  ///< After which it wraps.
};

namespace detail {
class SimulatedControls;
}

/// The simulated striper as a source of frames:
///
///     sim:scene.yaml?frames=100&fps=30&seed=7&noise=off
///
/// - `frames` how many frames (default: no end), `fps` frames per second, `seed` of the noise
/// - `noise` = `off`, or those that stay on: `noise=shot,read,prnu,speckle`
/// - `laser` the pattern that the lasers follow: `0`, `0,dark`, `0,1,dark`
/// - `illumination=unknown` the frames do not say which laser fired, as with a real grabber
/// - `fields` = `progressive`, `split-top`, `split-bottom` (frames of two fields, the named
///   one first), `alternate-top`, `alternate-bottom` (each field a frame)
/// - `realtime=yes` frames come when they are due, not when they are ready: `next` waits for that,
///   as long as its timeout
/// - `encoder=100` frames carry the counts of a wheel's encoder, so many for each metre of the
///   device's own motion; `encoder_bits=8|16|32` it wraps after
///
/// Controls: exposure_us, gain_db (over the scene's), laser, region (read only), and
/// `sim.pose.NAME` for each object whose name no other has. They hold from the next frame on, for
/// the truth as well; `start` does not put them back.
class SimulatedSource : public FrameSource {
 public:
  explicit SimulatedSource(Simulator simulator, SimulatedSourceOptions options = {},
                           std::string uri = {});
  ~SimulatedSource() override;

  /// Loads the scene that the address names and applies its query.
  /// @throws Error as `load_scene` does, and Error{kUsage} quoting a key that is wrong.
  static std::unique_ptr<SimulatedSource> open(Uri uri);

  SourceInfo info() const override;
  void start() override;
  NextStatus next(Frame& frame, std::chrono::milliseconds timeout) override;
  void stop() override;
  SourceStatistics statistics() const override;
  Controls& controls() override;

  /// For the truth and the model of what is served. Not while another thread is in `next`.
  Simulator& simulator() noexcept { return simulator_; }

 private:
  std::optional<std::int64_t> encoder_counts(std::uint64_t sequence, int part) const;

  Simulator simulator_;
  SimulatedSourceOptions options_;
  std::string uri_;
  std::unique_ptr<detail::SimulatedControls> controls_;
  std::uint64_t next_frame_ = 0;

  mutable std::mutex mutex_;  // Guards what follows.
  std::condition_variable stopped_;
  bool running_ = false;
  SourceStatistics statistics_;
  std::chrono::steady_clock::time_point start_time_;
};

}  // namespace striper
