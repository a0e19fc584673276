// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/cadence_finder.hpp>
#include <striper/ambient/channel_choice.hpp>
#include <striper/ambient/fields.hpp>
#include <striper/core/log.hpp>

#include "ambient/background.hpp"
#include "ambient/exposure_numbers.hpp"
#include "ambient/exposure_queue.hpp"
#include "ambient/temporal_background.hpp"

namespace striper {
namespace {

// Exposures between two checks of a cadence that was found, or of a scene that showed no line.
constexpr int kBetweenChecks = 250;
constexpr int kBetweenLooks = 12;

// Where pictures are lost, those that come tell less.
constexpr std::size_t kMostPictures = 2 * CadenceFinder::kPictures;

// Fields in the right order give about 0, in the wrong one 2, or less where a lot moves.
constexpr double kWrongFieldOrder = 0.35;

// A difference of colours is not needed where dark exposures take the white light off.
Channel without_difference(Channel channel) {
  if (channel == Channel::kGreenMinusRed) return Channel::kGreen;
  if (channel == Channel::kRedMinusGreen) return Channel::kRed;
  return channel;
}

// Whether two cadences call the same exposures dark.
bool agree(const Cadence& a, const Cadence& b) {
  const std::uint64_t whole = a.pattern().size() * b.pattern().size();
  for (std::uint64_t n = 0; n < whole; ++n) {
    if (a.at(n).is_dark() != b.at(n).is_dark()) return false;
  }
  return true;
}

// The shortest pattern that the exposures' own illumination follows; automatic if there is none.
Cadence pattern_of_labels(const std::vector<std::unique_ptr<detail::HeldExposure>>& held) {
  constexpr std::size_t kLongest = 8;
  for (std::size_t period = 1; period <= kLongest && period < held.size(); ++period) {
    std::vector<Illumination> pattern(period);
    bool is_consistent = true;
    for (const auto& exposure : held) {
      Illumination& entry = pattern[exposure->number % period];
      const Illumination own = exposure->frame.illumination;
      if (own.is_unknown() || !(entry.is_unknown() || entry == own)) is_consistent = false;
      entry = own;
    }
    const auto is_lit = [](Illumination entry) { return entry.is_lit(); };
    const auto is_unknown = [](Illumination entry) { return entry.is_unknown(); };
    const bool is_whole = std::none_of(pattern.begin(), pattern.end(), is_unknown) &&
                          std::any_of(pattern.begin(), pattern.end(), is_lit);
    if (is_consistent && is_whole) return Cadence(std::move(pattern));
  }
  return {};
}

}  // namespace

struct AmbientStage::State {
  explicit State(const AmbientOptions& options_in)
      : options(options_in),
        finder(options_in.axis, options_in.lasers),
        background(options_in.noise) {
    if (!options.cadence.is_automatic()) settle(options.cadence, "given");
    if (options.channel != Channel::kAuto) channel = options.channel;
  }

  // ---- What comes in.
  void push_exposure(const Frame& exposure);
  void look(const Frame& exposure, std::uint64_t number);
  void conclude(const CadenceFinder::Finding& finding);
  void conclude_from_labels();
  void check_field_order();
  void settle(const Cadence& cadence, const char* how);
  void warn(const std::string& message);

  // ---- What goes out.
  detail::DarkChoice choice() const noexcept;
  void give(detail::HeldExposure& exposure, const detail::Neighbours& darks);
  void subtract(detail::HeldExposure& exposure, const detail::Neighbours& darks);
  void subtract_background(detail::HeldExposure& exposure);
  void choose_channel_from(const detail::HeldExposure& exposure, const detail::HeldExposure* dark);
  void take_channel(detail::HeldExposure& exposure, Channel wanted) const;
  bool background_waits(const detail::HeldExposure& exposure);
  detail::TemporalBackground& background_of(const detail::HeldExposure& exposure);

  AmbientOptions options;
  detail::ExposureNumbers numbers;
  detail::ExposureQueue queue;

  CadenceFinder finder;
  bool is_looking = true;
  int until_next_look = 0;
  bool is_settled = false;
  bool has_own_illumination = false;
  const char* cadence_origin = "";
  std::vector<std::string> warnings;

  std::optional<Channel> channel;
  bool is_finished = false;
  detail::Background background;
  std::vector<detail::TemporalBackground> temporal;  // Per laser and parity.
  bool subtracts_fields = false;
  bool subtracts_pictures = false;

  LitFrame lit;
  std::uint64_t unpaired = 0;
};

void AmbientStage::State::push_exposure(const Frame& exposure) {
  const auto [number, is_restart] = numbers.next(exposure);
  if (is_restart && options.cadence.is_automatic() && !has_own_illumination) {
    // The laser's phase may be another one now: hold what comes until it is known again.
    is_settled = false;
    queue.hold_unlabelled();
    finder.clear();
    is_looking = true;
  }
  is_finished = false;
  const Illumination own = exposure.illumination;
  if (!own.is_unknown()) {
    has_own_illumination = true;
    const Illumination expected = queue.cadence().at(number);
    // What the frames say wins; they follow no pattern that could tell what is to come.
    if (is_settled && !expected.is_unknown() && own != expected) settle({}, "from the frames");
  }
  queue.add(exposure, number);
  const bool is_always_on = !options.cadence.is_automatic() && !options.cadence.has_dark();
  if (is_always_on && exposure.exposures_per_picture == 1) is_looking = false;
  if (is_looking) {
    look(exposure, number);
  } else if (until_next_look > 0 && --until_next_look == 0) {
    is_looking = true;
  }
}

void AmbientStage::State::look(const Frame& exposure, std::uint64_t number) {
  finder.add(exposure, number);
  if (finder.pictures() < CadenceFinder::kPictures) return;
  if (has_own_illumination) {
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
  is_looking = false;
}

void AmbientStage::State::conclude(const CadenceFinder::Finding& finding) {
  const bool found = !finding.cadence.is_automatic();
  if (!options.cadence.is_automatic()) {
    if (found && !agree(finding.cadence, options.cadence)) {
      warn(fmt::format("the cadence '{}' was given, but the pictures show '{}'",
                       options.cadence.to_string(), finding.cadence.to_string()));
    }
    return;
  }
  if (found) {
    if (is_settled && queue.cadence().has_dark() && !agree(finding.cadence, queue.cadence())) {
      warn("the cadence slipped and was found again: pictures were lost without being counted");
    }
    if (!is_settled || !agree(finding.cadence, queue.cadence())) settle(finding.cadence, "found");
    until_next_look = kBetweenChecks;
    return;
  }
  if (!is_settled) settle(Cadence({Illumination::laser(0)}), "no dark exposure seen");
  const bool is_sure = finding.always_lit || queue.cadence().has_dark();
  until_next_look = is_sure ? kBetweenChecks : kBetweenLooks;
}

// The frames say themselves which laser fired; a pattern says in advance what is to come.
void AmbientStage::State::conclude_from_labels() {
  settle(pattern_of_labels(queue.held()), "from the frames");
}

void AmbientStage::State::check_field_order() {
  const std::optional<double> disorder = finder.field_disorder();
  if (disorder && *disorder > kWrongFieldOrder) {
    warn("the fields seem to be in the wrong order: in time, the second one comes first");
  }
}

void AmbientStage::State::settle(const Cadence& cadence, const char* how) {
  queue.set_cadence(cadence);
  is_settled = true;
  cadence_origin = how;
}

void AmbientStage::State::warn(const std::string& message) {
  if (std::find(warnings.begin(), warnings.end(), message) != warnings.end()) return;
  log(LogLevel::kWarning, message);
  warnings.push_back(message);
}

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
  lit.variance = cv::Mat();
  lit.blind = cv::Mat();
  lit.dark_noise_gain = 1.0F;
  lit.dark_noise_correlation = {};
  lit.full_scale_dn = frame.full_scale_dn();
  lit.grid = frame.grid;
  lit.sequence = frame.sequence;
  lit.time = frame.time;
  lit.laser = exposure.light.laser_index();
  lit.field = frame.field;
  subtract(exposure, darks);
  exposure.is_done = true;
}

void AmbientStage::State::subtract(detail::HeldExposure& exposure,
                                   const detail::Neighbours& darks) {
  const detail::HeldExposure* const any = darks.before != nullptr ? darks.before : darks.after;
  if (!channel) choose_channel_from(exposure, any);
  const bool subtracts = any != nullptr || options.method == AmbientMethod::kTemporal;
  const Channel wanted = subtracts ? without_difference(*channel) : *channel;
  take_channel(exposure, wanted);
  lit.lit = exposure.channel.lit;
  lit.dark = exposure.channel.dark;
  if (options.method == AmbientMethod::kTemporal) return subtract_background(exposure);
  if (any == nullptr) return;

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
      take_channel(*held, without_difference(*channel));
      first.push_back(held->channel.lit);
    }
    slow.begin(first);
  }
  lit.dark = slow.follow(lit.lit, std::max(1, lit.full_scale_dn / 255));
  lit.dark_noise_gain = detail::TemporalBackground::kNoiseGain;
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
  if (frame.is_interlaced()) {
    for (const Frame& field : split_fields(frame)) state_->push_exposure(field);
  } else {
    state_->push_exposure(frame);
  }
}

void AmbientStage::finish() {
  State& s = *state_;
  s.is_finished = true;
  if (s.is_settled || s.queue.size() == 0) return;
  if (s.has_own_illumination) {
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
      continue;
    }
    s.give(*exposure, darks);
    return &s.lit;
  }
  s.queue.forget(s.choice());
  return nullptr;
}

std::uint64_t AmbientStage::dark_exposures() const noexcept {
  return state_->queue.dark_exposures();
}
std::uint64_t AmbientStage::unpaired_exposures() const noexcept { return state_->unpaired; }

std::string AmbientStage::decisions() const {
  const State& s = *state_;
  if (!s.is_settled || !s.channel) return {};
  const char* method = s.options.method == AmbientMethod::kTemporal ? "temporal"
                       : s.subtracts_fields                         ? "fields"
                       : s.subtracts_pictures                       ? "alternate"
                                                                    : "none";
  std::string text = fmt::format("channel {}\ncadence {} ({})\nambient {}\n", to_string(*s.channel),
                                 s.queue.cadence().to_string(), s.cadence_origin, method);
  if (s.unpaired > 0) {
    text +=
        fmt::format("{} lit exposures gave no scan: every dark neighbour was lost\n", s.unpaired);
  }
  for (const std::string& warning : s.warnings) text += warning + '\n';
  return text;
}

}  // namespace striper
