// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include <striper/ambient/ambient_options.hpp>
#include <striper/ambient/ambient_status.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/lit_frame.hpp>

namespace striper {

/// Turns frames into lit frames: takes interlaced frames apart, finds out which exposures are lit
/// and by which laser, pairs each with the dark exposures before and after, picks the channel.
///
///     stage.push(frame);
///     while (const LitFrame* lit = stage.next()) ...
///
/// A lit exposure is given when the dark one after it has arrived or is known to be lost. While the
/// pattern is unknown all are held, at most six frames, twelve where some are lost; but of a
/// single laser, or of nobody knows how many, while every whole frame so far shows a clear stripe
/// by itself, each is given as it comes, without a dark one. A pattern that was found is doubted
/// where a stripe shows dark instead of bright, or in one dark exposure and not in the other (but
/// for fields, whose order goes on across a lost frame): that lit exposure gives nothing and what
/// follows is held again. A lit exposure whose dark neighbours are all lost gives nothing either;
/// both are counted in `AmbientStatus::unpaired`.
///
/// A pattern that was given is followed, and reported where the images show another one: at once
/// where they do so plainly, else when they do so twice. They are asked until they have confirmed
/// it, ever less often, and again where a stripe shows in a wrong place.
///
/// A source that said of its frames what lights them and then says `unknown`, or that begins a new
/// epoch, has lost its place in the pattern (a camera that was opened again): what comes is held
/// until the images show that place, and counted there too where they do not.
///
/// Frames are kept by reference where cv::Mat or a lease keeps their pixels, so those must not be
/// written to later on; other pixels are copied. One stage serves one stream, in order; not
/// thread-safe. No allocation after the first frames of a stream, but for a pattern that is found.
///
/// While the pattern is looked for in the images a frame costs more: at 640x480 .1 to 1 ms, and
/// 2 ms the sixth, which decides. That is so for the first six of a stream; then, where the source
/// does not know its own pattern, for six every 250 exposures if it was found, and of one that was
/// given for six after 12, 24, 48, ... exposures, until they have confirmed it.
class AmbientStage {
 public:
  /// @throws Error{kBadValue} where a method needs dark exposures and the pattern has none.
  explicit AmbientStage(const AmbientOptions& options);
  AmbientStage(AmbientStage&&) noexcept;
  AmbientStage& operator=(AmbientStage&&) noexcept;
  ~AmbientStage();

  /// Takes the next frame. Precondition: frame.status is kOk and the image is not empty.
  void push(const Frame& frame);

  /// Says that no more frames will come: what is held is given by `next`.
  void finish();

  /// The next lit exposure that is complete, in order; null if there is none. Valid until the next
  /// call of anything here.
  const LitFrame* next();

  /// How it stands. 1 us; allocates.
  AmbientStatus status() const;

  // The counts in it, for every frame.
  std::uint64_t dark_exposures() const noexcept;
  std::uint64_t unpaired_exposures() const noexcept;
  /// How long the shutter was open for lit exposures, in all, those that gave nothing included.
  double lit_s() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace striper
