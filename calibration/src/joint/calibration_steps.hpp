// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <striper/joint/calibrate.hpp>

namespace striper::detail {

// The steps of `calibrate` before and after the adjustment, each of which fills its part of the
// Calibration. session_pictures.cpp, outlier_views.cpp, judgement.cpp.

/// Every board picture once, every laser picture once per laser.
void list_pictures(const CalibrationInput& input, Calibration& calibration);

/// Finds the board in all pictures, on `options.threads`, and makes views of what was found.
/// @throws Error{kBadValue} where sizes differ; Error{kUntrustworthy} where no board was found.
void find_boards(const CalibrationInput& input, const CalibrationOptions& options,
                 Calibration& calibration);

/// Takes out a view whose corners fit far worse than the others' (another camera's, or wrongly
/// found), or a stripe that lies off the plane of all the others (a reflection, another laser), and
/// adjusts again.
void leave_out_bad_views(Calibration& calibration);
void leave_out_bad_stripes(Calibration& calibration);

/// Warns where the stripes have moved the camera further from where the corners alone put it than
/// the corners' own error allows: then the board is not what it is taken for where the stripe lies.
void compare_cameras(const JointSolution& from_corners, Calibration& calibration);

/// Warns where a camera that was given is not the one that these pictures' corners show.
void compare_with_known_camera(const CalibrationOptions& options, Calibration& calibration);

/// Cross-validates, widens the covariance if it must be, collects the findings, predicts ranges.
void judge(const CalibrationOptions& options, Calibration& calibration);

void report_progress(const CalibrationOptions& options, const std::string& stage, double fraction);

void note(Calibration& calibration, Finding::Severity severity, const char* code,
          std::string message, std::string advice);

}  // namespace striper::detail
