// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/fields.hpp>

#include "ambient/illumination/illumination_tracker.hpp"
#include "ambient/pixels/interlaced_picture.hpp"
#include "ambient/pixels/lit_frame_maker.hpp"

namespace striper {
namespace {

constexpr const char* kNoFields =
    "ambient fields needs frames of two fields, and these are whole: if they are interlaced of "
    "two, "
    "say so with fields=split-top or fields=split-bottom (the field exposed first)";
constexpr const char* kInterlaced =
    "the frames look interlaced: every other row differs; if they are, say so with "
    "fields=split-top or fields=split-bottom (the field exposed first; NTSC has the bottom one "
    "first, PAL the top one)";

}  // namespace

struct AmbientStage::State {
  explicit State(const AmbientOptions& options_in)
      : options(options_in),
        events(options_in.events),
        tracker(options, events),
        maker(options, events) {}

  void check_method(const Frame& exposure);

  AmbientOptions options;
  detail::OnceEvents events;
  detail::IlluminationTracker tracker;
  detail::LitFrameMaker maker;
  std::int64_t lit_ns = 0;
  int interlace_checks_left = 3;  // First frames still to be looked at: may they be interlaced?
};

// What was asked for, or not, and the images.
void AmbientStage::State::check_method(const Frame& exposure) {
  if (interlace_checks_left == 0) return;
  --interlace_checks_left;
  if (exposure.field != Field::kProgressive) return;
  if (options.method == AmbientMethod::kFields) events.send_once({"not_two_fields", kNoFields});
  if (detail::looks_interlaced(exposure.image)) events.send_once({"woven_fields", kInterlaced});
}

AmbientStage::AmbientStage(const AmbientOptions& options) {
  options.validate();
  state_ = std::make_unique<State>(options);
}
AmbientStage::AmbientStage(AmbientStage&&) noexcept = default;
AmbientStage& AmbientStage::operator=(AmbientStage&&) noexcept = default;
AmbientStage::~AmbientStage() = default;

void AmbientStage::push(const Frame& frame) {
  for_each_exposure(frame, [&](const Frame& exposure) {
    state_->check_method(exposure);
    state_->tracker.push(exposure, frame.is_interlaced());
  });
}

void AmbientStage::finish() { state_->tracker.finish(); }

const LitFrame* AmbientStage::next() {
  detail::IlluminationTracker& tracker = state_->tracker;
  detail::LitFrameMaker& maker = state_->maker;
  while (detail::HeldExposure* const lit = tracker.next_lit()) {
    const detail::Neighbours darks = tracker.neighbours_of(*lit);
    const bool waits = !tracker.is_finished() && maker.waits_for_background(*lit, tracker.held());
    if (darks.must_wait || waits) break;
    state_->lit_ns += lit->frame.exposure_ns;
    if (tracker.pass_over_unpaired(*lit, darks)) continue;
    const LitFrame& made = maker.make(*lit, darks, tracker.held());
    if (tracker.is_refuted_by(made, *lit, darks)) continue;
    lit->is_done = true;
    return &made;
  }
  tracker.forget();
  return nullptr;
}

std::uint64_t AmbientStage::dark_exposures() const noexcept {
  return state_->tracker.dark_exposures();
}
std::uint64_t AmbientStage::unpaired_exposures() const noexcept {
  return state_->tracker.unpaired_exposures();
}

double AmbientStage::lit_s() const noexcept { return 1e-9 * static_cast<double>(state_->lit_ns); }

AmbientStatus AmbientStage::status() const {
  const detail::IlluminationTracker& tracker = state_->tracker;
  AmbientStatus status;
  status.phase = tracker.state().phase();
  status.dark = tracker.dark_exposures();
  status.unpaired = tracker.unpaired_exposures();
  status.channel = state_->maker.channel();
  if (!tracker.state().is_settled()) return status;
  status.pattern = tracker.pattern();
  status.origin = tracker.origin();
  status.method = state_->maker.method();
  return status;
}

}  // namespace striper
