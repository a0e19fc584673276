// SPDX-License-Identifier: Apache-2.0
// What an AmbientStage makes of the exposures that come in: which are lit, and what is wrong with
// them or with what was said of them.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <striper/core/event.hpp>

#include "ambient/ambient_state.hpp"
#include "ambient/illumination/cadence_rules.hpp"
#include "ambient/pixels/woven_picture.hpp"

namespace striper {
namespace {

// Exposures between two checks of a cadence that was found, or of a scene that showed no line.
constexpr int kBetweenChecks = 250;
constexpr int kBetweenLooks = 12;

// Looks at a cadence that was given are twice as far apart each time, at most so often.
constexpr int kMostDoublings = 16;
constexpr std::size_t kLongestSeenInOneLook = 4;

// A source that does not know what lights its exposures may have begun anew where so many are
// missing.
constexpr std::uint64_t kLongGap = 3;

// Where pictures are lost, those that come tell less.
constexpr std::size_t kMostPictures = 2 * CadenceFinder::kPictures;

// Fields in the right order give about 0, in the wrong one 2, or less where a lot moves.
constexpr double kWrongFieldOrder = 0.35;

// Words of what was or was not found out; what to do about it is part of each.
constexpr const char* kNoDarkSeen =
    "no exposure without the laser could be told from the others: all are scanned as lit, and no "
    "daylight is taken off; say laser=0 if it is always on, or in which it is off (laser=0,dark: "
    "in every other one)";
constexpr const char* kAlwaysLit =
    "ambient {} needs exposures without the laser, and it shows in every one: nothing is taken off";
constexpr const char* kNoFields =
    "ambient fields needs pictures of two fields, and these are whole: if they are woven of two, "
    "say so with fields=split-top or fields=split-bottom (the field exposed first)";
constexpr const char* kWoven =
    "the pictures look woven of two fields: every other row differs; if they are, say so with "
    "fields=split-top or fields=split-bottom (the field exposed first; NTSC has the bottom one "
    "first, PAL the top one)";
constexpr const char* kRowsNeverDark =
    "ambient alternate needs dark exposures of the same rows, and with the cadence '{}' a field "
    "that is lit is never dark: nothing is scanned; ambient fields takes the other field";
constexpr const char* kSlipped =
    "the cadence slipped and was found again: pictures were lost without being counted";
constexpr const char* kNothingTellsApart =
    "nothing in the pictures tells its lit exposures from its dark ones: the laser is off, out of "
    "view, or on in all of them";
constexpr const char* kPhaseUnknown =
    "the source no longer knows which exposures the laser lights (a camera that was opened again "
    "begins anywhere in the cadence), and the pictures do not show it: they are not scanned until "
    "they do";
constexpr const char* kWrongOrder =
    "the fields seem to be in the wrong order: in time, the second one comes first";

}  // namespace

void AmbientStage::State::push_exposure(const Frame& exposure, bool is_of_woven_picture) {
  const auto [number, is_restart, is_reopened] = numbers.next(exposure);
  if ((is_restart || is_reopened) && options.cadence.is_automatic() && !has_own_illumination) {
    // The laser's phase may be another one now: hold what comes until it is known again.
    is_settled = is_in_doubt = false;
    queue.hold_unlabelled();
    finder.clear();
    is_looking = true;
  }
  is_finished = false;
  if (!exposure.illumination.is_unknown()) {
    heed_own_illumination(exposure, number);
  } else if ((has_own_illumination && !is_of_woven_picture) || is_reopened) {
    heed_unknown_illumination(number, is_reopened);
  }
  last_number = number;
  queue.add(exposure, number);
  if (until_next_doubt > 0) --until_next_doubt;
  if (looks_for_weave > 0) check_method(exposure);
  if (is_looking) {
    look(exposure, number);
  } else if (until_next_look > 0 && --until_next_look == 0) {
    is_looking = true;
  }
}

void AmbientStage::State::heed_own_illumination(const Frame& exposure, std::uint64_t number) {
  const Illumination own = exposure.illumination;
  has_own_illumination = true;
  if (is_source_unsure) {
    is_source_unsure = is_in_doubt = false;
    unpaired += queue.drop_unlabelled();
    settle(surely, options.cadence.is_automatic() ? PatternOrigin::kFrames : PatternOrigin::kGiven);
  }
  const Illumination expected = queue.cadence().at(number);
  // What the frames say wins; they follow no pattern that could tell what is to come.
  if (is_settled && !expected.is_unknown() && own != expected) settle({}, PatternOrigin::kFrames);
}

// A source that said what lights its exposures does not know any more, as after a camera was lost
// and opened again: what comes is held until its place in the cadence is known.
void AmbientStage::State::heed_unknown_illumination(std::uint64_t number, bool is_reopened) {
  if (options.cadence.is_automatic() && !has_own_illumination)
    return;  // It was found, and will be.
  const bool is_gap = number > last_number + kLongGap + 1;
  const bool may_be_another = is_source_unsure && (is_gap || is_reopened);
  if (is_source_unsure && !may_be_another) return;
  if (!is_source_unsure) {
    surely = options.cadence.is_automatic() ? queue.cadence() : options.cadence;
    if (surely.pattern().size() <= 1) return;  // There is no phase.
  }
  if (may_be_another) unpaired += queue.drop_unlabelled();
  is_source_unsure = true;
  is_settled = is_in_doubt = false;
  queue.hold_unlabelled();
  finder.clear();
  is_looking = true;
}

void AmbientStage::State::look(const Frame& exposure, std::uint64_t number) {
  const bool is_said = has_own_illumination && !is_source_unsure;
  finder.add(exposure, number);
  if (!is_said) finder.compare();
  if (finder.pictures() < CadenceFinder::kPictures) return;
  if (is_said) {
    if (!is_settled) conclude_from_labels();
  } else {
    const CadenceFinder::Finding finding = finder.find();
    const bool is_unclear = finding.cadence.is_automatic() && !finding.always_lit;
    const bool may_wait = finder.has_gaps() && finder.pictures() < kMostPictures;
    if (is_unclear && may_wait) return;
    conclude(finding);
  }
  check_field_order();
  finder.clear();
  is_looking = is_phase_searched() || is_to_be_confirmed();
}

void AmbientStage::State::conclude(const CadenceFinder::Finding& finding) {
  if (is_source_unsure) return find_phase(finding);
  if (!options.cadence.is_automatic()) return judge_given(finding);
  const bool found = !finding.cadence.is_automatic();
  if (found) {
    const bool is_other =
        queue.cadence().is_automatic() || !detail::agree(finding.cadence, queue.cadence());
    const bool was_found = is_settled || is_in_doubt;
    if (was_found && is_other && queue.cadence().has_dark()) send("pattern_slipped", kSlipped);
    // What looked like a line was something else, and may again.
    if (is_in_doubt && !is_other) until_next_doubt = kBetweenChecks;
    if (!is_settled || is_other) settle(finding.cadence, PatternOrigin::kFound);
    until_next_look = kBetweenChecks;
    return;
  }
  // What came shows that the laser lights what the cadence in doubt calls dark; or nothing at all.
  if (is_in_doubt && finder.shows_lines_in_dark(queue.cadence())) {
    is_in_doubt = false;
  } else if (is_in_doubt) {
    settle(queue.cadence(), PatternOrigin::kFound);
    if (is_finished) unpaired += queue.give_up();
  }
  if (!is_settled) {
    settle(Cadence({Illumination::laser(0)}), PatternOrigin::kAssumed);
    say_nothing_is_taken_off(finding);
  }
  const bool is_sure = finding.always_lit || queue.cadence().has_dark();
  until_next_look = is_sure ? kBetweenChecks : kBetweenLooks;
}

// A cadence that was given is followed whatever the pictures show, and they are asked until they
// confirm or refute it: at once where they do so plainly, else when they say the same twice.
void AmbientStage::State::judge_given(const CadenceFinder::Finding& finding) {
  const Cadence& given = options.cadence;
  const Cadence before = std::exchange(otherwise, {});
  const bool found = !finding.cadence.is_automatic();
  if (found && finder.tells_apart(finding.cadence, given)) {
    const bool is_said_twice = !before.is_automatic() && detail::agree(before, finding.cadence);
    if (finding.is_plain || is_said_twice) return contradict_given(finding.cadence);
    otherwise = finding.cadence;
  } else if (finding.always_lit && given.has_dark()) {
    contradict_given("always_lit", "the laser shows in every picture");
  } else if (found || finding.always_lit) {
    is_judged = true;
  } else if (finder.pictures() >= CadenceFinder::kPictures) {
    if (++unclear_looks == 2) say_that_nothing_tells_apart();
    // An empty street is not worth a look again and again.
    until_next_look = kBetweenLooks << std::min(unclear_looks - 1, kMostDoublings);
  }
}

// There may have been pictures for one look only.
void AmbientStage::State::judge_given_at_end() {
  Cadence other = otherwise;
  if (is_looking && finder.exposures() > 1) {
    judge_given(finder.find());
    if (finder.pictures() >= CadenceFinder::kPictures) other = otherwise;
  }
  if (is_judged) return;
  if (!other.is_automatic()) return contradict_given(other);
  if (unclear_looks > 0) say_that_nothing_tells_apart();
}

void AmbientStage::State::contradict_given(EventCode code, const std::string& what) {
  is_judged = true;
  send_once(
      {code, fmt::format("the cadence '{}' was given, but {}", options.cadence.to_string(), what)});
}

void AmbientStage::State::contradict_given(const Cadence& shown) {
  contradict_given("pattern_contradicted",
                   fmt::format("the pictures show '{}'", shown.to_string()));
}

// What a period is too long for, six pictures do not show either.
void AmbientStage::State::say_that_nothing_tells_apart() {
  const bool is_short = options.cadence.pattern().size() <= kLongestSeenInOneLook;
  if (options.cadence.has_dark() && is_short) {
    contradict_given("pattern_unseen", kNothingTellsApart);
  }
}

void AmbientStage::State::doubt_given() {
  until_next_doubt = kBetweenChecks;
  if (is_looking) return;
  finder.clear();
  is_looking = true;
}

// The cadence is known and where it began is not: where the pictures do not show it, none is
// scanned.
void AmbientStage::State::find_phase(const CadenceFinder::Finding& finding) {
  const std::optional<Cadence> turned =
      finding.cadence.is_automatic() ? std::nullopt : detail::turned_to(surely, finding.cadence);
  if (turned) {
    const bool is_same = detail::agree(*turned, queue.cadence());
    if (is_in_doubt && is_same) until_next_doubt = kBetweenChecks;
    if (is_in_doubt && !is_same) send("pattern_slipped", kSlipped);
    if (!is_settled || !is_same) settle(*turned, PatternOrigin::kPhase);
  } else if (!is_settled) {
    is_in_doubt = false;
    unpaired += queue.drop_unlabelled();
    send("pattern_lost", kPhaseUnknown);
  }
  until_next_look = kBetweenChecks;
}

// One exposure shows nothing of others.
void AmbientStage::State::say_nothing_is_taken_off(const CadenceFinder::Finding& finding) {
  const bool is_asked_for =
      options.method == AmbientMethod::kFields || options.method == AmbientMethod::kAlternate;
  if (finding.always_lit) {
    if (is_asked_for) {
      send_once({"always_lit", fmt::format(kAlwaysLit, to_string(options.method))});
    }
  } else if (finder.exposures() > 1 && is_asked_for) {
    send_once({Severity::kWarning, "no_dark_exposure", kNoDarkSeen});
  } else if (finder.exposures() > 1 && options.method == AmbientMethod::kAuto) {
    send_once({"no_dark_exposure", kNoDarkSeen});  // A laser that is always on is nothing wrong.
  }
}

// The frames say themselves which laser fired; a pattern says in advance what is to come.
void AmbientStage::State::conclude_from_labels() {
  settle(detail::pattern_of_labels(queue.held()), PatternOrigin::kFrames);
}

void AmbientStage::State::check_field_order() {
  const std::optional<double> disorder = finder.field_disorder();
  if (disorder && *disorder > kWrongFieldOrder) send_once({"field_order", kWrongOrder});
}

// What was asked for, or not, and the pictures.
void AmbientStage::State::check_method(const Frame& exposure) {
  --looks_for_weave;
  if (exposure.field != Field::kProgressive) return;
  if (options.method == AmbientMethod::kFields) send_once({"not_two_fields", kNoFields});
  if (detail::looks_woven(exposure.image)) send_once({"woven_fields", kWoven});
}

// Whether a lit field could ever have got dark rows of its own.
void AmbientStage::State::check_rows(const detail::HeldExposure& unpaired_exposure) {
  const bool is_field = unpaired_exposure.frame.exposures_per_picture == 2;
  if (!is_field || choice() != detail::DarkChoice::kSameRows) return;
  if (detail::has_dark_of_same_rows(queue.cadence())) return;
  send_once({"rows_never_dark", fmt::format(kRowsNeverDark, queue.cadence().to_string())});
}

void AmbientStage::State::settle(const Cadence& cadence, PatternOrigin how) {
  queue.set_cadence(cadence);
  is_settled = true;
  is_in_doubt = false;
  origin = how;
  const bool is_shown = how == PatternOrigin::kFound || how == PatternOrigin::kPhase;
  if (is_shown) send("pattern_found", fmt::format("the cadence is '{}'", cadence.to_string()));
}

void AmbientStage::State::send(EventCode code, const std::string& message) {
  options.events.send({code, message});
}

// What stays as it is is said once.
void AmbientStage::State::send_once(Event event) {
  if (std::find(said.begin(), said.end(), event.code) != said.end()) return;
  said.push_back(event.code);
  options.events.send(std::move(event));
}

}  // namespace striper
