// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <striper/session/calibrate.hpp>

namespace striper::detail {

// The steps of `calibrate` before and after the adjustment, each of which fills its part of the
// Calibration. session_pictures.cpp, find_stripes.cpp, swapped_lists.cpp, outlier_views.cpp,
// measure_look.cpp, judgement.cpp.

/// Every board image once, every laser image once per laser.
void list_images(const CalibrationInput& input, Calibration& calibration);

/// Finds the board in all images, on `options.threads`, and makes views of what was found.
/// @throws Error{kBadValue} where sizes differ; Error{kUntrustworthy} where no board was found.
void find_boards(const CalibrationInput& input, const CalibrationOptions& options,
                 Calibration& calibration);

/// A laser image with its board's pose, read from its files.
LaserImage laser_image(const Calibration& calibration, const ImageResult& result);

/// Finds the stripes: every plausible way of reading them is tried on all images, and the one
/// whose stripes lie on planes best is taken. Fills settings, observations.stripes, and the
/// channels of the model.
/// @throws Error{kUntrustworthy} where no way shows a stripe, or the lists are swapped.
void find_stripes(const CalibrationInput& input, const CalibrationOptions& options,
                  Calibration& calibration);

/// Tries some ways of reading the stripe on images that `load` gives; in the order of `settings`.
struct SettingsTrial {
  SettingsScore score;
  std::vector<BoardStripe> stripes;  ///< One per image.
};
std::vector<SettingsTrial> try_compared_settings(
    const std::vector<ExtractionSettings>& compared_settings,
    const std::vector<const ImageResult*>& images,
    const std::function<LaserImage(const ImageResult&)>& load, const CalibrationOptions& options,
    const Calibration& calibration);

/// Refuses lists that are swapped: the stripe is in the images that should be without it.
/// @param on_plane how many stripes were found where they should be.
/// @throws Error{kUntrustworthy} saying which lists.
void refuse_swapped_lists(const CalibrationInput& input, const CalibrationOptions& options,
                          const Calibration& calibration, int on_plane);

/// What the stripe of a laser looks like: its width, brightness on white paper and colour, and
/// their course over the depth at which it was seen. Needs the finished model.
StripeLook measure_look(const Calibration& calibration, int laser);

/// Which part of a laser's returns is clipped, 0 to 1.
double clipped_share(const Calibration& calibration, int laser);

/// Takes out a view whose corners fit far worse than the others' (another camera's, or wrongly
/// found), or a stripe that lies off the plane of all the others (a reflection, another laser), and
/// adjusts again.
void leave_out_bad_views(Calibration& calibration);
void leave_out_bad_stripes(Calibration& calibration);

/// Warns where the stripes have moved the camera further from where the corners alone put it than
/// the corners' own error allows: then the board is not what it is taken for where the stripe lies.
void compare_cameras(const JointSolution& from_corners, Calibration& calibration);

/// Warns where a camera that was given is not the one that these images' corners show; refuses
/// another lens where a laser is calibrated with it.
void compare_with_known_camera(const CalibrationOptions& options, Calibration& calibration);

/// Cross-validates, widens the covariance if it must be, collects the findings, predicts ranges.
void judge(const CalibrationOptions& options, Calibration& calibration);

void report_progress(const CalibrationOptions& options, const std::string& stage, double fraction);

void note(Calibration& calibration, Severity severity, EventCode code, std::string message,
          std::string advice);

}  // namespace striper::detail
