// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace striper {

/// How much an event matters.
enum class Severity : std::uint8_t {
  kInfo,
  kWarning,  ///< The result is good, or marked where it is not; somebody should look.
  kError,    ///< Something is lost.
  kRefusal,  ///< The result must not be trusted.
};

/// `info`, `warning`, `error` or `refusal`.
std::string_view to_string(Severity severity) noexcept;

/// A kind of event: its word is its code, stable and for programs.
struct EventKind {
  std::string_view word;
  Severity severity;         ///< As a rule; an event may be milder or worse.
  std::string_view meaning;  ///< A sentence.
};

/// Every kind of event, by subject. To add one is to add a row; docs/events.md is made from this
/// table (`event_table`), and a code that is not in it does not compile.
inline constexpr EventKind kEventKinds[] = {
    // Sources.
    {"source_opened", Severity::kInfo, "A source was opened and set up."},
    {"source_waiting", Severity::kWarning, "A source is not there yet; it is waited for."},
    {"source_lost", Severity::kWarning, "A camera does not answer any more."},
    {"source_not_open", Severity::kWarning, "A lost camera cannot be opened again yet, and why."},
    {"source_back", Severity::kInfo, "A lost or awaited camera streams."},
    {"source_gone", Severity::kError, "A lost camera did not come back in time."},
    {"source_ended", Severity::kInfo, "A source has no more frames."},
    {"source_paused", Severity::kInfo, "A source was closed, to be opened again when told to."},
    {"control_refused", Severity::kWarning, "A source that came back does not take a setting."},
    {"source_silent", Severity::kWarning, "A camera is open and sends nothing."},
    {"signal_lost", Severity::kWarning, "A grabber's input shows no signal."},
    {"frames_dropped", Severity::kWarning, "Frames are missing between those that came."},
    {"frame_bad", Severity::kWarning, "A frame is corrupt, incomplete or of a wrong size."},
    {"frame_refused", Severity::kWarning, "A frame does not fit the model or cannot be read."},
    {"rate_low", Severity::kWarning, "Frames come slower than was asked for."},
    {"recording_cut", Severity::kWarning, "A recording's last line was cut off."},
    {"bits_unknown", Severity::kWarning, "16-bit images may hold fewer significant bits."},
    {"setting_adjusted", Severity::kWarning, "A camera took another value than was asked for."},
    {"setting_unlikely", Severity::kWarning, "What an address says is seldom what is meant."},
    {"packets_small", Severity::kWarning, "A network path carries small packets only."},
    {"packets_lost", Severity::kError, "Packets of frames were lost."},
    {"socket_buffer_small", Severity::kWarning, "The socket's buffer is smaller than asked for."},
    {"thread_not_realtime", Severity::kInfo, "The stream's thread has no real-time priority."},
    {"timestamps_unusable", Severity::kWarning, "A camera's timestamps are not of its clock."},
    {"clock_reference", Severity::kInfo, "A camera took up or lost the time of a master."},
    {"camera_found", Severity::kInfo, "A camera answers on the network."},
    {"camera_not_found", Severity::kError, "No camera answers, or none of that name."},
    {"camera_held", Severity::kError, "Another program holds the camera."},
    {"camera_free", Severity::kInfo, "No other program holds the camera."},
    {"camera_access_unknown", Severity::kWarning, "Whether a camera is held cannot be told."},
    {"camera_other_subnet", Severity::kError, "The camera's address is not of this subnet."},
    {"answers_filtered", Severity::kError, "This machine threw a camera's answers away."},
    {"stream_blocked", Severity::kError, "The camera answers and its packets do not arrive."},
    {"camera_silent", Severity::kError, "The camera answers and gives no frames."},
    // Lasers.
    {"laser_off", Severity::kInfo, "A laser was commanded off."},
    {"laser_not_off", Severity::kError, "A laser cannot be commanded off."},
    {"laser_not_switched", Severity::kWarning, "A pattern is said and nothing switches the laser."},
    // The pattern of lit and dark exposures.
    {"pattern_found", Severity::kInfo, "The images show in which exposures the laser fires."},
    {"pattern_lost", Severity::kWarning, "Which exposures are lit is not known any more."},
    {"pattern_slipped", Severity::kWarning, "The pattern slipped and was found again."},
    {"pattern_contradicted", Severity::kWarning, "The images show another pattern than was given."},
    {"pattern_unseen", Severity::kWarning, "The images do not show the pattern that was given."},
    {"no_dark_exposure", Severity::kInfo, "No exposure without the laser could be told."},
    {"always_lit", Severity::kWarning,
     "Dark exposures are asked for or given, and the laser is always on."},
    {"not_two_fields", Severity::kWarning, "A method needs fields and the frames are whole."},
    {"woven_fields", Severity::kWarning, "The frames look interlaced."},
    {"rows_never_dark", Severity::kWarning, "A lit field has no dark exposure of its rows."},
    {"scene_moves", Severity::kWarning, "A method is for a still scene, and it moves."},
    {"field_order", Severity::kWarning, "The fields seem to be in the wrong order."},
    // Scans.
    {"no_stripe", Severity::kWarning, "No laser's stripe is in the images."},
    {"stripe_seen", Severity::kInfo, "A laser's stripe is in the images."},
    {"other_axis", Severity::kError, "A stripe is seen along the other axis."},
    {"other_channel", Severity::kError, "A stripe is seen in another channel."},
    {"channel_of_grey", Severity::kWarning, "A colour's channel is asked for of grey images."},
    {"not_in_the_plane", Severity::kError, "A stripe is seen where the model has none."},
    {"picture_overexposed", Severity::kError, "Many pixels are saturated."},
    {"picture_unlit", Severity::kError, "No frame could be scanned."},
    {"stripe_faint", Severity::kWarning, "The stripe is hardly brighter than its surroundings."},
    {"stripe_wide", Severity::kWarning, "The stripe is wide: out of focus."},
    {"stripe_saturated", Severity::kInfo, "The stripe is saturated in most scan lines."},
    {"stripe_doubtful", Severity::kWarning, "Most of what is found is not plainly the stripe."},
    {"noise_depth_assumed", Severity::kWarning, "A model's noise is taken to be of 8-bit images."},
    // Models.
    {"unknown_key", Severity::kWarning, "A file has a key that nothing here knows."},
    {"plane_unseen", Severity::kWarning, "No pixel sees a laser's plane."},
    {"lens_folds", Severity::kWarning, "A lens's distortion folds back inside the image."},
    {"model_reloaded", Severity::kInfo, "A head works with its model file's new content."},
    {"model_refused", Severity::kError, "A model file's new content cannot be used."},
    // Sinks.
    {"sink_slow", Severity::kWarning, "A sink did not keep up: scans were dropped."},
    {"sink_failed", Severity::kError, "A sink was closed: it threw, or did not return."},
    {"disk_full", Severity::kError, "A sink was closed: the disk is full."},
    {"topics_offered", Severity::kInfo, "A sink offers its topics to other programs, and where."},
    {"name_taken", Severity::kWarning, "Another program publishes under the same name."},
    {"command_taken", Severity::kInfo, "Somebody changed something from another program."},
    {"command_refused", Severity::kWarning,
     "Somebody without the right tried to change something."},
    {"token_made", Severity::kInfo,
     "The secret that changing something needs was made, and where."},
    {"token_missing", Severity::kWarning, "There is no such secret: nothing can be changed."},
    {"recording_made", Severity::kInfo, "A recording that was asked for is whole."},
    {"node_announced", Severity::kInfo, "A sink tells ROS 2's programs which node it is."},
    {"node_withheld", Severity::kWarning, "A sink cannot tell ROS 2's programs which node it is."},
    {"topic_heard", Severity::kInfo, "A topic of another program, and who writes and reads it."},
    {"nobody_heard", Severity::kWarning, "No other program answers where a sink offers topics."},
    {"other_domain", Severity::kWarning, "Programs of this machine talk in another domain."},
    {"shared_memory_foreign", Severity::kWarning, "Programs of another user use shared memory."},
    {"interface_unfit", Severity::kError, "A network interface cannot carry a sink's topics."},
    // Applications.
    {"curb_found", Severity::kInfo, "A curb is there with a probability of .9 and more."},
    {"curb_lost", Severity::kInfo, "A curb that was found is no longer tracked."},
    {"object_found", Severity::kInfo, "An object is there with a probability of .9 and more."},
    {"object_lost", Severity::kInfo, "An object that was found is no longer tracked."},
    {"contact_near", Severity::kWarning, "An object that is not behind a curb will be here soon."},
    {"limit_broken", Severity::kWarning, "A measured value is outside its limits."},
    {"drift", Severity::kWarning, "What should stand still moves slowly."},
    {"seam", Severity::kWarning, "Two heads of a rig disagree where they meet."},
    {"cycle_incomplete", Severity::kWarning, "A rig's cycle lacks a scan."},
    // Calibration.
    {"pictures_unreadable", Severity::kWarning, "Image files could not be read."},
    {"boards_not_found", Severity::kWarning, "The board was not found in images."},
    {"stripes_not_found", Severity::kWarning, "The stripe was not found on boards."},
    {"stripe_clipped", Severity::kWarning, "The stripe is clipped."},
    {"camera_error_unknown", Severity::kInfo, "A given camera has no covariance."},
    {"halves_disagree", Severity::kInfo, "Two halves of the images disagree."},
    {"not_cross_validated", Severity::kInfo, "There are too few images to cross-validate."},
    {"boards_parallel", Severity::kRefusal, "The boards are nearly parallel."},
    {"boards_tilted_little", Severity::kWarning, "The boards are tilted little."},
    {"boards_tilted_one_way", Severity::kWarning, "The boards are tilted one way only."},
    {"focal_length_unknown", Severity::kRefusal, "The focal length is not determined."},
    {"focal_length_uncertain", Severity::kWarning, "The focal length is uncertain."},
    {"planes_coincident", Severity::kRefusal, "The boards do not fix a laser's plane."},
    {"range_unknown", Severity::kRefusal, "Ranges are not determined."},
    {"range_uncertain", Severity::kWarning, "Ranges are uncertain."},
    {"singular", Severity::kRefusal, "Parameters cannot be told apart."},
    {"stripe_in_corner", Severity::kRefusal, "The stripe covers a corner of the image only."},
    {"stripe_covers_little", Severity::kWarning, "The stripe covers little of the image."},
    {"stripes_do_not_fit", Severity::kRefusal, "The stripes do not lie on one plane."},
    {"stripes_move_camera", Severity::kWarning, "The stripes disagree with the board's corners."},
    {"stripe_left_out", Severity::kWarning, "A stripe does not fit and was left out."},
    {"view_left_out", Severity::kWarning, "An image does not fit and was left out."},
    {"few_stripes", Severity::kWarning, "There are few images of the stripe."},
    {"known_camera_differs", Severity::kRefusal, "A given camera is not that of the images."},
    {"extrapolated", Severity::kWarning, "Ranges beyond the boards' distances are extrapolated."},
    {"too_few_views", Severity::kRefusal, "There are too few images of the board."},
    {"few_views", Severity::kWarning, "There are few images of the board."},
    {"board_bent", Severity::kWarning, "The board is bent."},
    {"corners_do_not_fit", Severity::kWarning, "The corners do not fit the lens."},
    {"scale_unlikely", Severity::kWarning, "The board's squares are unlikely in size."},
    {"blurred", Severity::kWarning, "Images are blurred."},
};

}  // namespace striper
