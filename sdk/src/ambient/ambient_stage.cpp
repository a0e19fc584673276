// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/channel_choice.hpp>
#include <striper/ambient/fields.hpp>

#include "ambient/ambient_state.hpp"

namespace striper {
namespace {

// A scene moves where more than this part of it is darker than what stands, in so many pictures in
// a row; where a stripe was long, less is.
constexpr double kMovingPart = 0.08;
constexpr int kMovingPictures = 3;

constexpr const char* kMoves =
    "ambient temporal is for a sensor that stands still, and what it sees moves: the scans are not "
    "to be trusted";

// A difference of colours is not needed where dark exposures take the white light off.
Channel without_difference(Channel channel) {
  if (channel == Channel::kGreenMinusRed) return Channel::kGreen;
  if (channel == Channel::kRedMinusGreen) return Channel::kRed;
  return channel;
}

}  // namespace

detail::DarkChoice AmbientStage::State::choice() const noexcept {
  const Cadence& cadence = queue.cadence();
  if (!cadence.is_automatic() && !cadence.has_dark()) return detail::DarkChoice::kNone;
  switch (options.method) {
    case AmbientMethod::kNone:
    case AmbientMethod::kTemporal:
      return detail::DarkChoice::kNone;
    case AmbientMethod::kAlternate:
      return detail::DarkChoice::kSameRows;
    case AmbientMethod::kAuto:
    case AmbientMethod::kFields:
      break;
  }
  return detail::DarkChoice::kAny;
}

void AmbientStage::State::give(detail::HeldExposure& exposure, const detail::Neighbours& darks) {
  const Frame& frame = exposure.frame;
  // What nobody else holds is written into again.
  for (cv::Mat* const image : {&lit.lit, &lit.dark, &lit.variance, &lit.blind}) image->release();
  lit.dark_noise_gain = 1.0F;
  lit.dark_noise_correlation = {};
  lit.full_scale_dn = frame.full_scale_dn();
  lit.grid = frame.grid;
  lit.sequence = frame.sequence;
  lit.time = frame.time;
  lit.laser = exposure.light.laser_index();
  lit.field = frame.field;
  subtract(exposure, darks);
}

// Whether a cadence that was found or given cannot be: the line is dark in `lit - dark`, or was
// plain and is gone, or shows in one dark exposure and not in the other. Fields are lost in twos,
// and an even cadence goes on across that.
bool AmbientStage::State::is_refuted(const detail::Neighbours& darks) {
  const bool is_known = has_own_illumination && !is_source_unsure;
  const bool is_field = queue.held().back()->frame.exposures_per_picture == 2;
  if (is_field && queue.cadence().pattern().size() % 2 == 0) return false;
  const bool is_compared = darks.before != nullptr || darks.after != nullptr;
  if (is_known || !is_compared || until_next_doubt > 0) return false;
  // Between rows edges leave a line of either sign, which the variance knows of.
  const cv::Mat edges = darks.is_between_rows ? lit.variance : cv::Mat();
  const auto line = line_sign.of(lit.lit, lit.dark, edges, options.axis);
  const auto laser = static_cast<std::size_t>(lit.laser);
  if (was_plain.size() <= laser) was_plain.resize(laser + 1);
  const bool is_gone = was_plain[laser] && line.is_nothing();
  was_plain[laser] = line.is_plainly_bright();
  if (line.is_dark() || is_gone) return true;
  if (darks.before == nullptr || darks.after == nullptr) return false;
  const auto between =
      line_sign.of(darks.after->channel.lit, darks.before->channel.lit, {}, options.axis);
  return between.is_dark() || between.is_bright();
}

// Pictures were lost before it or with it: what follows is held until the cadence is known again,
// as after a restart.
void AmbientStage::State::look_again_after(const detail::HeldExposure& refuted) {
  ++unpaired;
  is_settled = false;
  is_in_doubt = true;
  is_looking = true;
  until_next_look = 0;
  queue.hold_from(refuted.number + 1);
  finder.clear();
  for (const auto& held : queue.held()) finder.add(held->frame, held->number);
  if (is_finished) conclude(finder.find());
}

void AmbientStage::State::subtract(detail::HeldExposure& exposure,
                                   const detail::Neighbours& darks) {
  const detail::HeldExposure* const any = darks.before != nullptr ? darks.before : darks.after;
  if (!channel) choose_channel_from(exposure, any);
  const bool is_difference = any != nullptr || options.method == AmbientMethod::kTemporal;
  const Channel wanted = is_difference ? channel_of_differences() : *channel;
  take_channel(exposure, wanted);
  lit.lit = exposure.channel.lit;
  lit.dark = exposure.channel.dark;
  lit.is_dark_a_channel = any == nullptr && !lit.dark.empty();
  if (options.method == AmbientMethod::kTemporal) return subtract_background(exposure);
  if (any == nullptr) {
    if (!lit.dark.empty()) colour_difference.mend(lit, options.axis);
    return;
  }

  detail::DarkPair pair;
  for (detail::HeldExposure* const dark : {darks.before, darks.after}) {
    if (dark != nullptr) take_channel(*dark, wanted);
  }
  if (darks.before != nullptr) pair.before = &darks.before->channel.lit;
  if (darks.after != nullptr) pair.after = &darks.after->channel.lit;
  if (pair.has_both()) pair.weight_after = darks.weight_after;
  pair.is_between_rows = darks.is_between_rows;
  pair.row_above = exposure.frame.grid.v.offset < any->frame.grid.v.offset ? -1 : 0;
  background.subtract(pair, lit);
  (darks.is_between_rows ? subtracts_fields : subtracts_pictures) = true;
}

void AmbientStage::State::subtract_background(detail::HeldExposure& exposure) {
  detail::TemporalBackground& slow = background_of(exposure);
  if (slow.is_empty()) {
    std::vector<cv::Mat> first;
    for (const auto& held : queue.held()) {
      const bool is_alike = held->light == exposure.light &&
                            held->frame.field == exposure.frame.field &&
                            held->frame.image.size() == exposure.frame.image.size();
      if (!is_alike || first.size() == detail::TemporalBackground::kFirstPictures) continue;
      take_channel(*held, channel_of_differences());
      first.push_back(held->channel.lit);
    }
    slow.begin(first);
  }
  const cv::Mat& slow_background = slow.follow(lit.lit, std::max(1, lit.full_scale_dn / 255));
  const double moving =
      background.subtract_standing(slow_background, detail::TemporalBackground::kNoiseGain, lit);
  moving_pictures = moving > kMovingPart ? moving_pictures + 1 : 0;
  if (moving_pictures >= kMovingPictures) send_once({"scene_moves", kMoves});
}

// A background begins with a few pictures.
bool AmbientStage::State::background_waits(const detail::HeldExposure& exposure) {
  if (options.method != AmbientMethod::kTemporal || is_finished) return false;
  if (!background_of(exposure).is_empty()) return false;
  const auto alike = std::count_if(queue.held().begin(), queue.held().end(), [&](const auto& held) {
    return held->light == exposure.light && held->frame.field == exposure.frame.field;
  });
  return static_cast<std::size_t>(alike) < detail::TemporalBackground::kFirstPictures;
}

detail::TemporalBackground& AmbientStage::State::background_of(
    const detail::HeldExposure& exposure) {
  const auto index = static_cast<std::size_t>(2 * exposure.light.laser_index() +
                                              (exposure.frame.field == Field::kBottom ? 1 : 0));
  if (temporal.size() <= index) temporal.resize(index + 1);
  return temporal[index];
}

void AmbientStage::State::choose_channel_from(const detail::HeldExposure& exposure,
                                              const detail::HeldExposure* dark) {
  if (dark == nullptr || dark->frame.image.size() != exposure.frame.image.size()) {
    channel = choose_channel(exposure.frame.image, options.axis);
    return;
  }
  cv::Mat difference;
  cv::subtract(exposure.frame.image, dark->frame.image, difference);
  channel = without_difference(choose_channel(difference, options.axis));
}

Channel AmbientStage::State::channel_of_differences() const noexcept {
  const bool is_given = options.difference_channel && *options.difference_channel != Channel::kAuto;
  return without_difference(is_given ? *options.difference_channel : *channel);
}

bool AmbientStage::State::subtracts() const noexcept {
  return subtracts_fields || subtracts_pictures || options.method == AmbientMethod::kTemporal;
}

void AmbientStage::State::take_channel(detail::HeldExposure& exposure, Channel wanted) const {
  if (exposure.has_channel) return;
  select_channel(exposure.frame.image, wanted, exposure.channel);
  exposure.has_channel = true;
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
    state_->push_exposure(exposure, frame.is_interlaced());
  });
}

void AmbientStage::finish() {
  State& s = *state_;
  s.is_finished = true;
  if (s.is_given()) s.judge_given_at_end();
  if (s.is_settled || s.queue.size() == 0) return;
  if (s.has_own_illumination && !s.is_source_unsure) {
    s.conclude_from_labels();
  } else {
    s.conclude(s.finder.find());
  }
  s.check_field_order();
}

const LitFrame* AmbientStage::next() {
  State& s = *state_;
  while (detail::HeldExposure* const exposure = s.queue.next_lit()) {
    const detail::DarkChoice choice = s.choice();
    const detail::Neighbours darks = s.queue.neighbours_of(*exposure, choice, s.is_finished);
    if (darks.must_wait || s.background_waits(*exposure)) break;
    const bool is_unpaired =
        choice != detail::DarkChoice::kNone && darks.before == nullptr && darks.after == nullptr;
    if (is_unpaired && s.queue.cadence().has_dark()) {
      exposure->is_done = true;
      ++s.unpaired;
      s.check_rows(*exposure);
      continue;
    }
    s.give(*exposure, darks);
    if (s.is_refuted(darks)) {
      if (!s.is_given()) {
        s.look_again_after(*exposure);
        continue;
      }
      s.doubt_given();
    }
    exposure->is_done = true;
    return &s.lit;
  }
  s.queue.forget(s.choice());
  return nullptr;
}

std::uint64_t AmbientStage::dark_exposures() const noexcept {
  return state_->queue.dark_exposures();
}
std::uint64_t AmbientStage::unpaired_exposures() const noexcept { return state_->unpaired; }

TrackingPhase AmbientStage::State::phase() const noexcept {
  if (is_settled) return is_given() ? TrackingPhase::kGiven : TrackingPhase::kLocked;
  if (is_in_doubt) return TrackingPhase::kSuspect;
  return is_source_unsure ? TrackingPhase::kLost : TrackingPhase::kSearching;
}

AmbientStatus AmbientStage::status() const {
  const State& s = *state_;
  AmbientStatus status;
  status.phase = s.phase();
  status.dark = s.queue.dark_exposures();
  status.unpaired = s.unpaired;
  status.channel = s.channel;
  if (s.channel && s.subtracts() && s.options.difference_channel) {
    status.channel = s.channel_of_differences();
  }
  if (!s.is_settled) return status;
  status.pattern = s.queue.cadence();
  status.origin = s.origin;
  status.method = s.options.method == AmbientMethod::kTemporal ? AmbientMethod::kTemporal
                  : s.subtracts_fields                         ? AmbientMethod::kFields
                  : s.subtracts_pictures                       ? AmbientMethod::kAlternate
                                                               : AmbientMethod::kNone;
  return status;
}

std::string_view to_string(PatternOrigin origin) noexcept {
  switch (origin) {
    case PatternOrigin::kGiven:
      return "given";
    case PatternOrigin::kFrames:
      return "frames";
    case PatternOrigin::kFound:
      return "found";
    case PatternOrigin::kPhase:
      return "phase";
    case PatternOrigin::kAssumed:
      return "assumed";
    case PatternOrigin::kNone:
      break;
  }
  return "none";
}

std::string_view to_string(TrackingPhase phase) noexcept {
  switch (phase) {
    case TrackingPhase::kLocked:
      return "locked";
    case TrackingPhase::kSuspect:
      return "suspect";
    case TrackingPhase::kLost:
      return "lost";
    case TrackingPhase::kGiven:
      return "given";
    case TrackingPhase::kSearching:
      break;
  }
  return "searching";
}

}  // namespace striper
