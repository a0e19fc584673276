// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include <striper/adjust/choose_lens.hpp>
#include <striper/adjust/solve_joint.hpp>
#include <striper/board/board.hpp>
#include <striper/board/find_board.hpp>
#include <striper/board/observations.hpp>
#include <striper/core/channel.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/laser_plane/board_stripe.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/validate/cross_validation.hpp>
#include <striper/validate/range_error.hpp>
#include <striper/validate/trust.hpp>

namespace striper {

/// An image of a calibration: a file that is read when it is needed, or an image in memory.
struct SessionImage {
  /// Reads a file as `load` promises; called from several threads.
  using Reader = std::function<cv::Mat(const std::filesystem::path&)>;

  std::string name;            ///< Tells images apart and names them; for files, the path.
  std::filesystem::path file;  ///< Empty where `image` holds it.
  Reader read;  ///< Of `file`; empty: cv::imread, which takes a truncated JPEG for a whole one.
  cv::Mat image;
  int bit_depth = 8;

  SessionImage() = default;
  explicit SessionImage(std::filesystem::path path, Reader reader = {})
      : name(path.string()), file(std::move(path)), read(std::move(reader)) {}
  SessionImage(std::string given_name, cv::Mat pixels, int depth = 8)
      : name(std::move(given_name)), image(std::move(pixels)), bit_depth(depth) {}

  /// The pixels, grey or B, G, R, 8 or 16 bit, as stored (no rotation by EXIF).
  /// @throws Error{kNotFound, kIo, kBadFile} naming the file.
  cv::Mat load() const;
};

/// The images of one laser: with the stripe on, and either none or as many of the same poses with
/// the laser off.
struct LaserImages {
  std::vector<SessionImage> on;
  std::vector<SessionImage> off;
};

/// What a calibration is made from. An image may be in several lists; it is used once for each.
struct CalibrationInput {
  Board board;
  std::vector<SessionImage> boards;  ///< The board alone.
  std::vector<LaserImages> lasers;   ///< One entry per laser, in the order of the model's lasers.
};

/// How it is made. Every default is here and nowhere else.
struct CalibrationOptions {
  std::optional<LensModel> lens;   ///< Empty: chosen by cross-validation.
  std::optional<StripeAxis> axis;  ///< Empty: seen from the images.
  Channel channel = Channel::kAuto;
  std::optional<KnownCamera> known_camera;
  std::optional<NoiseModel> noise;
  /// Corners as OpenCV's calibration sample finds them (BoardSearch::kLikeOpenCv), no corner and no
  /// image left out, no bend: for figures that can be compared with its.
  bool like_opencv = false;
  bool force = false;  ///< Return what must not be trusted too, marked.
  int threads = 2;
  TrustLimits limits;
  std::string date;  ///< For the quality block; empty: left out.

  /// Called between pieces of work, one call at a time, with what is being done and the fraction
  /// done, 0 to 1. An exception that it throws ends the calibration and comes out of `calibrate`.
  std::function<void(const std::string& stage, double fraction)> progress;
};

/// What became of one image.
struct ImageResult {
  SessionImage image;
  SessionImage lit;   ///< With the stripe, where that is another image.
  int laser = -1;     ///< -1: a board image.
  std::string fault;  ///< Why one of the two could not be read; then neither is used.
  BoardView board;
  int view = -1;              ///< Index of the CornerView; -1: not used.
  int stripe_view = -1;       ///< Index of the StripeView; -1: none.
  std::string board_reason;   ///< Why its board was not used; empty if it was.
  std::string stripe_reason;  ///< Why its stripe was not used; empty if it was, or had none.
  BoardStripe stripe;
  /// The stripe as single frames show it, where the model's channel for them is another one.
  std::optional<BoardStripe> single_frame;
};

/// How well one way of reading the stripe does on all laser images.
struct SettingsScore {
  ExtractionSettings settings;
  int stripes = 0;      ///< Images in which it finds one.
  int on_plane = 0;     ///< Of these, on the plane of most of its laser's.
  double rms_px = 0.0;  ///< Of those about it; NaN without a plane.
};

/// How far the boards' middles were from the camera.
struct BoardDistances {
  double nearest_m = 0.0;
  double median_m = 0.0;
  double farthest_m = 0.0;
};

/// A finished calibration, with all that is needed to judge it.
struct Calibration {
  StriperModel model;  ///< With covariance and quality.
  std::vector<Event> findings;
  bool forced = false;  ///< Written against a refusal.

  Observations observations;
  JointSolution solution;
  JointOptions options;  ///< That the solution was made with.
  LensChoice lens;
  ExtractionSettings settings;                   ///< That the stripes were read with,
  std::vector<SettingsScore> compared_settings;  ///< and all that were compared: that one first.
  bool bend_solved = false;
  CrossValidation validation;
  std::vector<std::vector<RangeSigma>> range_sigmas;  ///< Per laser, at 1, 2 and 4 m.
  std::vector<std::pair<double, double>> depths_m;    ///< Per laser: ranges seen on the boards.
  std::vector<ImageResult> images;
  double seconds = 0.0;

  bool trustworthy() const { return worst(findings) != Severity::kRefusal; }
  /// Of the boards that were used; zeros where there is none.
  BoardDistances board_distances() const;
  /// One sentence that says whether to trust it.
  std::string verdict() const;
};

/// Calibrates camera and lasers from images.
///
/// Boards are found, the lens is chosen, the stripes are found on the boards, everything is
/// adjusted together, views that do not fit are left out, and the result is cross-validated and
/// judged.
/// @return the calibration; where it must not be trusted, only with `force` or for the caller to
/// report: look at `trustworthy()`.
/// @throws Error{kUntrustworthy} where no result can be computed at all, saying which image is
/// missing; Error{kBadValue} for images that differ in size; Error{kBadFile} where none can be
/// read: some that cannot are left out and told of among the findings. Cost: calibration_bench.
Calibration calibrate(const CalibrationInput& input, const CalibrationOptions& options);

}  // namespace striper
