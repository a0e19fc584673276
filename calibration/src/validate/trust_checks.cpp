// SPDX-License-Identifier: Apache-2.0
#include <iterator>

#include <striper/validate/trust.hpp>

namespace striper {
namespace {

constexpr TrustCheck kChecks[] = {
    {"too_few_views", Severity::kRefusal, "images that show the board", "below",
     [](const TrustLimits& limits) -> double { return limits.fewest_views; }, "",
     "add images of the board at different tilts, ten or more in all"},
    {"few_views", Severity::kWarning, "the same", "below",
     [](const TrustLimits& limits) -> double { return limits.few_views; }, "",
     "ten to twenty images at different tilts, distances and places halve the error bars"},
    {"boards_parallel", Severity::kRefusal,
     "rms tilt of the boards about their mean, both ways together", "below",
     [](const TrustLimits& limits) -> double { return limits.least_tilt_deg; }, "degrees",
     "add images with the board turned by 30 to 45 degrees: its top towards the camera, its "
     "bottom, its left side, its right side"},
    {"boards_tilted_one_way", Severity::kWarning, "the same, up and down or left and right alone",
     "below", [](const TrustLimits& limits) -> double { return limits.least_tilt_deg; }, "degrees",
     ""},
    {"boards_tilted_little", Severity::kWarning, "the same, both ways together", "below",
     [](const TrustLimits& limits) -> double { return limits.low_tilt_deg; }, "degrees",
     "turn the board further, by 30 to 45 degrees each way"},
    {"singular", Severity::kRefusal, "reciprocal condition of the adjustment", "below",
     [](const TrustLimits& limits) -> double { return limits.least_rcond; }, "",
     "add images with the board at other tilts and distances"},
    {"focal_length_unknown", Severity::kRefusal,
     "error of the focal length, as the images are placed", "above",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.most_focal_error; }, "%",
     "tilt the board more (30 to 45 degrees, both ways) and fill the image with it"},
    {"focal_length_uncertain", Severity::kWarning, "error of the focal length, as the images fit",
     "above", [](const TrustLimits& limits) -> double { return 100.0 * limits.high_focal_error; },
     "%", "tilt the board more (30 to 45 degrees, both ways) and fill the image with it"},
    {"board_bent", Severity::kWarning,
     "height of the board's middle over its ends, of half its extent", "above",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.high_bend; }, "%",
     "glue the print to something flat: glass, aluminium, thick board"},
    {"corners_do_not_fit", Severity::kWarning, "rms of the corners, per 640 pixels of image width",
     "above", [](const TrustLimits& limits) -> double { return limits.high_corner_rms_px; }, "px",
     "hold the board still, expose shorter; look at the residual plots"},
    {"stripes_do_not_fit", Severity::kRefusal,
     "rms of the stripes to their planes, per 640 pixels of image width", "above",
     [](const TrustLimits& limits) -> double { return limits.most_stripe_rms_px; }, "px",
     "of pairs: are the images with the laser off and on in the same order, each pair of one "
     "pose? Were camera and laser fixed to each other all the time?"},
    {"scale_unlikely", Severity::kWarning, "distance of the middle board (or 0.05 m and below)",
     "above", [](const TrustLimits& limits) -> double { return limits.most_depth_m; }, "m",
     "the square is given in metres: is it right?"},
    {"planes_coincident", Severity::kRefusal, "width over length of a laser's stripes in space",
     "below", [](const TrustLimits& limits) -> double { return limits.least_plane_spread; }, "",
     "add images with the stripe on the board at other distances"},
    {"stripe_in_corner", Severity::kRefusal,
     "part of the image that the stripe covers, along it and across it", "below",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.least_coverage; }, "%", ""},
    {"stripe_covers_little", Severity::kWarning, "the same, along it", "below",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.low_coverage; }, "%", ""},
    {"few_stripes", Severity::kRefusal, "images with a laser's stripe on the board", "below",
     [](const TrustLimits& limits) -> double { return limits.fewest_stripes; }, "",
     "ten images with the stripe on the board, near and far, are a good number"},
    {"range_unknown", Severity::kRefusal,
     "error of the range at the stripes' middle, as the images are placed", "above",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.most_range_error; }, "%",
     "add images with the stripe on the board over the ranges that matter, the board tilted"},
    {"range_uncertain", Severity::kWarning, "the same, as the images fit", "above",
     [](const TrustLimits& limits) -> double { return 100.0 * limits.high_range_error; }, "%",
     "add images with the stripe on the board over the ranges that matter, the board tilted"},
};

}  // namespace

std::span<const TrustCheck> trust_checks() noexcept { return kChecks; }

}  // namespace striper
