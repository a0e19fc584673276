// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/illumination_tracker.hpp"

#include <optional>

#include <fmt/format.h>

#include "ambient/illumination/pattern_rules.hpp"

namespace striper::detail {
namespace {

// A source that does not know what lights its exposures may have begun anew where so many are
// missing: what a network loses of a frame or two is fewer.
constexpr std::uint64_t kLongGap = 3;

// Where frames are lost, those that come tell less.
constexpr std::size_t kMostFrames = 2 * PatternFinder::kFrames;

// Fields in the right order give about 0, in the wrong one 2, or less where a lot moves.
constexpr double kWrongFieldOrder = 0.35;

// Words of what was or was not found out; what to do about it is part of each.
constexpr const char* kNoDarkSeen =
    "no exposure without the laser could be told from the others: all are scanned as lit, and no "
    "daylight is subtracted; say laser=0 if it is always on, or in which it is off (laser=0,dark: "
    "in every other one)";
constexpr const char* kAlwaysLit =
    "ambient {} needs exposures without the laser, and it shows in every one: nothing is "
    "subtracted";
constexpr const char* kRowsNeverDark =
    "ambient alternate needs dark exposures of the same rows, and with the pattern '{}' a field "
    "that is lit is never dark: nothing is scanned; ambient fields takes the other field";
constexpr const char* kSlipped =
    "the pattern slipped and was found again: frames were lost without being counted";
constexpr const char* kPhaseUnknown =
    "the source no longer knows which exposures the laser lights (a camera that was opened again "
    "begins anywhere in the pattern), and the images do not show it: they are not scanned until "
    "they do";
constexpr const char* kWrongOrder =
    "the fields seem to be in the wrong order: in time, the second one comes first";

Teller first_teller(const AmbientOptions& options) {
  return options.pattern.is_automatic() ? Teller::kImages : Teller::kGiven;
}

}  // namespace

IlluminationTracker::IlluminationTracker(const AmbientOptions& options, OnceEvents& events)
    : options_(options),
      events_(events),
      finder_(options.axis, options.lasers),
      state_(first_teller(options)),
      given_(options.pattern, events),
      lines_(options.axis) {
  if (state_.is_given()) settle(options.pattern, PatternOrigin::kGiven);
}

void IlluminationTracker::push(const Frame& exposure, bool is_of_interlaced_frame) {
  const auto [number, is_restart, is_reopened] = numbers_.next(exposure);
  // The laser's phase may be another one now: hold what comes until it is known again.
  if ((is_restart || is_reopened) && state_.is_of_images()) {
    search_anew(TrackingSignal::kRestarted);
  }
  is_finished_ = false;
  if (!exposure.illumination.is_unknown()) {
    apply_stated_illumination(exposure, number);
  } else if ((state_.was_of_frames() && !is_of_interlaced_frame) || is_reopened) {
    apply_unstated_illumination(number, is_reopened);
  }
  before_.number = number;
  queue_.add(exposure, number);
  if (until_next_doubt_ > 0) --until_next_doubt_;
  if (looks_.is_looking()) {
    look(exposure, number);
  } else {
    looks_.count();
  }
}

void IlluminationTracker::finish() {
  is_finished_ = true;
  if (state_.is_given()) given_.judge_at_end(looks_.is_looking(), finder_);
  const bool is_any = queue_.size() != 0 || (state_.is_of_images() && finder_.exposures() != 0);
  if (state_.is_settled() || !is_any) return;
  if (state_.is_of_frames()) {
    conclude_from_labels();
  } else {
    conclude(finder_.find());
  }
  check_field_order();
}

void IlluminationTracker::search_anew(TrackingSignal why) {
  state_.on(why);
  queue_.hold_unlabelled();
  finder_.clear();
  looks_.look_now();
}

void IlluminationTracker::apply_stated_illumination(const Frame& exposure, std::uint64_t number) {
  const bool had_no_place = state_.has_no_place();
  state_.on(TrackingSignal::kLabelsHeard);
  if (had_no_place) {
    unpaired_ += queue_.drop_unlabelled();
    settle(before_.pattern,
           options_.pattern.is_automatic() ? PatternOrigin::kFrames : PatternOrigin::kGiven);
  }
  const Illumination own = exposure.illumination;
  const Illumination expected = queue_.pattern().at(number);
  // What the frames say wins; they follow no pattern that could tell what is to come.
  const bool is_other = !expected.is_unknown() && own != expected;
  if (state_.is_settled() && is_other) settle({}, PatternOrigin::kFrames);
}

// A source that said what lights its exposures does not know any more, as after a camera was lost
// and opened again: what comes is held until its place in the pattern is known.
void IlluminationTracker::apply_unstated_illumination(std::uint64_t number, bool is_reopened) {
  if (state_.is_of_images()) return;  // It was found, and will be.
  if (state_.has_no_place()) {
    const bool is_gap = number > before_.number + kLongGap + 1;
    if (!is_gap && !is_reopened) return;
    unpaired_ += queue_.drop_unlabelled();
  } else {
    before_.pattern = options_.pattern.is_automatic() ? queue_.pattern() : options_.pattern;
    if (before_.pattern.entries().size() <= 1) return;  // There is no phase.
  }
  search_anew(TrackingSignal::kPlaceLost);
}

// A laser that is always on need not be waited for: while every exposure shows its stripe by
// itself, each is scanned as it comes, and the first that does not is held with all that follow.
// Where dark exposures are asked for, or are to tell lasers or colours apart, all are held.
bool IlluminationTracker::is_given_at_once(const Frame& exposure) const noexcept {
  const bool needs_dark =
      options_.method != AmbientMethod::kAuto && options_.method != AmbientMethod::kNone;
  const bool is_colour_known = exposure.image.channels() == 1 || options_.channel != Channel::kAuto;
  return state_.is_of_images() && state_.phase() == TrackingPhase::kSearching && !needs_dark &&
         options_.lasers <= 1 && is_colour_known && exposure.exposures_per_picture == 1;
}

void IlluminationTracker::look(const Frame& exposure, std::uint64_t number) {
  finder_.add(exposure, number);
  if (are_all_lit_so_far_ && is_given_at_once(exposure)) {
    are_all_lit_so_far_ = finder_.newest_shows_a_line();
    if (are_all_lit_so_far_) queue_.take_newest_as_lit();
  }
  if (!state_.is_of_frames()) finder_.compare();
  if (finder_.frames() < PatternFinder::kFrames) return;
  if (state_.is_of_frames()) {
    if (!state_.is_settled()) conclude_from_labels();
  } else {
    const PatternFinder::Finding finding = finder_.find();
    const bool is_unclear = finding.pattern.is_automatic() && !finding.always_lit;
    const bool may_wait = finder_.has_gaps() && finder_.frames() < kMostFrames;
    if (is_unclear && may_wait) return;
    conclude(finding);
  }
  check_field_order();
  finder_.clear();
  const bool is_phase_searched = state_.has_no_place() && !state_.is_settled();
  if (!is_phase_searched && !given_.is_to_be_confirmed()) looks_.stop_looking();
}

void IlluminationTracker::conclude(const PatternFinder::Finding& finding) {
  if (state_.has_no_place()) return find_phase(finding);
  if (!options_.pattern.is_automatic()) return judge_given(finding);
  if (!finding.pattern.is_automatic()) return conclude_found(finding.pattern);
  conclude_not_found(finding);
}

void IlluminationTracker::conclude_found(const IlluminationPattern& found) {
  const bool is_other = queue_.pattern().is_automatic() || !agree(found, queue_.pattern());
  const bool was_found = state_.is_settled() || state_.is_suspect();
  if (was_found && is_other && queue_.pattern().has_dark()) {
    events_.send("pattern_slipped", kSlipped);
  }
  // What looked like a stripe was something else, and may again.
  if (state_.is_suspect() && !is_other) until_next_doubt_ = LookTimer::kBetweenChecks;
  if (!state_.is_settled() || is_other) settle(found, PatternOrigin::kFound);
  looks_.look_after(LookTimer::kBetweenChecks);
}

// What came shows that the laser lights what the pattern in doubt calls dark; or nothing at all.
void IlluminationTracker::conclude_not_found(const PatternFinder::Finding& finding) {
  if (state_.is_suspect() && finder_.shows_lines_in_dark(queue_.pattern())) {
    state_.on(TrackingSignal::kUnfounded);
  } else if (state_.is_suspect()) {
    settle(queue_.pattern(), PatternOrigin::kFound);
    if (is_finished_) unpaired_ += queue_.give_up();
  }
  if (!state_.is_settled()) {
    settle(IlluminationPattern({Illumination::laser(0)}), PatternOrigin::kAssumed);
    say_nothing_is_taken_off(finding);
  }
  const bool is_sure = finding.always_lit || queue_.pattern().has_dark();
  looks_.look_after(is_sure ? LookTimer::kBetweenChecks : LookTimer::kBetweenLooks);
}

void IlluminationTracker::judge_given(const PatternFinder::Finding& finding) {
  const std::optional<int> until_next = given_.judge(finding, finder_);
  if (until_next) looks_.look_after(*until_next);
}

// The pattern is known and where it began is not: where the images do not show it, none is
// scanned.
void IlluminationTracker::find_phase(const PatternFinder::Finding& finding) {
  const std::optional<IlluminationPattern> turned =
      finding.pattern.is_automatic() ? std::nullopt : turned_to(before_.pattern, finding.pattern);
  if (turned) {
    const bool is_same = agree(*turned, queue_.pattern());
    if (state_.is_suspect() && is_same) until_next_doubt_ = LookTimer::kBetweenChecks;
    if (state_.is_suspect() && !is_same) events_.send("pattern_slipped", kSlipped);
    if (!state_.is_settled() || !is_same) settle(*turned, PatternOrigin::kPhase);
  } else if (!state_.is_settled()) {
    state_.on(TrackingSignal::kUnfounded);
    unpaired_ += queue_.drop_unlabelled();
    events_.send("pattern_lost", kPhaseUnknown);
  }
  looks_.look_after(LookTimer::kBetweenChecks);
}

// One exposure shows nothing of others.
void IlluminationTracker::say_nothing_is_taken_off(const PatternFinder::Finding& finding) {
  const bool is_asked_for =
      options_.method == AmbientMethod::kFields || options_.method == AmbientMethod::kAlternate;
  if (finding.always_lit) {
    if (is_asked_for) {
      events_.send_once({"always_lit", fmt::format(kAlwaysLit, to_string(options_.method))});
    }
  } else if (finder_.exposures() > 1 && is_asked_for) {
    events_.send_once({Severity::kWarning, "no_dark_exposure", kNoDarkSeen});
  } else if (finder_.exposures() > 1 && options_.method == AmbientMethod::kAuto) {
    // A laser that is always on is nothing wrong.
    events_.send_once({"no_dark_exposure", kNoDarkSeen});
  }
}

// The frames say themselves which laser fired; a pattern says in advance what is to come.
void IlluminationTracker::conclude_from_labels() {
  settle(pattern_of_labels(queue_.held()), PatternOrigin::kFrames);
}

void IlluminationTracker::check_field_order() {
  const std::optional<double> disorder = finder_.field_disorder();
  if (disorder && *disorder > kWrongFieldOrder) events_.send_once({"field_order", kWrongOrder});
}

void IlluminationTracker::settle(const IlluminationPattern& pattern, PatternOrigin how) {
  queue_.set_pattern(pattern);
  state_.on(TrackingSignal::kSettled);
  origin_ = how;
  const bool is_shown = how == PatternOrigin::kFound || how == PatternOrigin::kPhase;
  if (is_shown) {
    events_.send("pattern_found", fmt::format("the pattern is '{}'", pattern.to_string()));
  }
}

DarkChoice IlluminationTracker::dark_choice() const noexcept {
  const bool is_searched = state_.is_of_images() && state_.phase() == TrackingPhase::kSearching;
  if (is_searched && are_all_lit_so_far_) return DarkChoice::kNone;
  const IlluminationPattern& pattern = queue_.pattern();
  if (!pattern.is_automatic() && !pattern.has_dark()) return DarkChoice::kNone;
  switch (options_.method) {
    case AmbientMethod::kNone:
    case AmbientMethod::kTemporal:
      return DarkChoice::kNone;
    case AmbientMethod::kAlternate:
      return DarkChoice::kSameRows;
    case AmbientMethod::kAuto:
    case AmbientMethod::kFields:
      break;
  }
  return DarkChoice::kAny;
}

Neighbours IlluminationTracker::neighbours_of(const HeldExposure& lit) noexcept {
  return queue_.neighbours_of(lit, dark_choice(), is_finished_);
}

bool IlluminationTracker::pass_over_unpaired(HeldExposure& lit, const Neighbours& darks) {
  const bool is_alone = darks.before == nullptr && darks.after == nullptr;
  if (!is_alone || dark_choice() == DarkChoice::kNone || !queue_.pattern().has_dark()) return false;
  lit.is_done = true;
  ++unpaired_;
  check_rows(lit);
  return true;
}

// Whether a lit field could ever have got dark rows of its own.
void IlluminationTracker::check_rows(const HeldExposure& unpaired) {
  const bool is_field = unpaired.frame.exposures_per_picture == 2;
  if (!is_field || dark_choice() != DarkChoice::kSameRows) return;
  if (has_dark_of_same_rows(queue_.pattern())) return;
  events_.send_once({"rows_never_dark", fmt::format(kRowsNeverDark, queue_.pattern().to_string())});
}

// Fields are lost in twos, and an even pattern goes on across that.
bool IlluminationTracker::is_refuted_by(const LitFrame& made, const HeldExposure& lit,
                                        const Neighbours& darks) {
  const bool is_field = queue_.held().back()->frame.exposures_per_picture == 2;
  if (is_field && queue_.pattern().entries().size() % 2 == 0) return false;
  const bool is_compared = darks.before != nullptr || darks.after != nullptr;
  if (state_.is_of_frames() || !is_compared || until_next_doubt_ > 0) return false;
  if (!lines_.refutes(made, darks)) return false;
  if (state_.is_given()) {
    doubt_given();
    return false;
  }
  look_again_after(lit);
  return true;
}

// It is followed nevertheless.
void IlluminationTracker::doubt_given() {
  until_next_doubt_ = LookTimer::kBetweenChecks;
  if (looks_.is_looking()) return;
  finder_.clear();
  looks_.look_now();
}

// Frames were lost before it or with it: what follows is held until the pattern is known again,
// as after a restart.
void IlluminationTracker::look_again_after(const HeldExposure& refuted) {
  ++unpaired_;
  state_.on(TrackingSignal::kRefuted);
  looks_.look_now_and_on();
  queue_.hold_from(refuted.number + 1);
  finder_.clear();
  for (const auto& held : queue_.held()) finder_.add(held->frame, held->number);
  if (is_finished_) conclude(finder_.find());
}

}  // namespace striper::detail
