// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <striper/guidance/guidance.hpp>

#include "guidance/align/alignment_sigma.hpp"
#include "guidance/beam/beam_reader.hpp"
#include "guidance/beam/stripe_choice.hpp"
#include "guidance/dashes/dash_book.hpp"
#include "guidance/dashes/gun_post.hpp"
#include "guidance/path/path_follower.hpp"
#include "guidance/watch/fault_watch.hpp"
#include "guidance/watch/thing_watch.hpp"

namespace striper {
namespace {

using detail::AlignmentSigma;
using detail::BeamReader;
using detail::DashBook;
using detail::ExpectedLine;
using detail::FaultWatch;
using detail::GunMoment;
using detail::GunPost;
using detail::PaintLook;
using detail::PathFollower;
using detail::SeenPaint;
using detail::StripeFound;
using detail::ThingWatch;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Guns are decided so often: at 40 mph every 2 mm.
constexpr double kGunStep_s = 1e-4;
// Seen within so much way, the path is being tracked.
constexpr double kTracking_m = 1.0;
// A sweep's time may be off by a tenth of its period; further back, or a second ahead, it jumped.
constexpr double kEarlyShare = 0.5;
constexpr double kJump_s = 1.0;
constexpr double kClockStep_s = 1e-3;
// A beam may be a period late and its sweep a period long; then all of them are silent.
constexpr double kSilentPeriods = 2.0;
// Speed is the way of the last moments: a count more or less matters little, brakes show soon.
constexpr double kSpeedOver_s = 0.2;
// What lies wholly within so many widths of the stripe's middle is of the stripe.
constexpr double kStripeWidths = 0.75;
// How far apart the two of a double line are is learnt over some fifty sights of both; it is known
// to some millimetres, as lines were painted.
constexpr double kApartShare = 0.02;
constexpr double kApartSigma_m = 0.005;
// What a gyroscope's reading is good for where the file says nothing.
constexpr double kYawRateSigma_rad_s = 0.005;

// One beam, and what is known of its sweeps.
struct Beam {
  Beam(const GuidanceBeam& how, const GuidanceStripe& stripe)
      : beam(how), reader(how, stripe.width_m), things(how.kind, stripe) {}

  GuidanceBeam beam;
  BeamReader reader;
  ThingWatch things;
  std::optional<std::size_t> forward;  // Its place among the forward beams, the farthest first.
  double last_s = kUnknown;
  double last_at_m = kUnknown;
  bool is_in_scan = false;
  double wet_from_m = kUnknown;
};

// What one sweep of a beam shows, and where.
struct SweepLook {
  std::size_t beam = 0;
  double sweep_s = 0.0;  // When it began,
  double now_s = 0.0;    // and when it was over.
  double here_m = 0.0;   // The truck's way then.
  std::span<const SeenPaint> seen;
  StripeFound found;
  double at_m = kUnknown;  // Where on the road the followed line was met, or would have been,
  double lateral_m = kUnknown;
  bool is_marker = false;  // What was found lies on the line and is none.
  bool is_path = false;    // The path took it.
};

// Where on the road something is, and when it was met.
struct SeenAt {
  double time_s;
  double at_m;
  double lateral_m;
};

PathState state_of(const PathFollower::Answer& answer, bool is_fault) {
  if (is_fault) return PathState::kFault;
  if (std::isnan(answer.lateral_m)) return PathState::kLost;
  return answer.unseen_m <= kTracking_m ? PathState::kTracking : PathState::kBridging;
}

}  // namespace

struct Guidance::Impl {
  Impl(const GuidanceConfig& how, GuidanceListener& who);

  // The clock.
  GunMoment moment_at(double time_s) const;
  void hold_back(GunMoment& moment) const;
  void run_guns(double until_s);
  void close_guns(double now_s);
  void run_faults(double now_s);

  // Sweeps.
  void process(Beam& beam, std::size_t index, const BeamSweep& sweep);
  double way_at(double time_s) const { return odometer.at(time_s).distance_m; }
  void take_followed(Beam& beam, SweepLook& look);
  void take_things(Beam& beam, const SweepLook& look) const;
  void take_other(Beam& beam, const SweepLook& look);
  void look_at_dashes(Beam& beam, const SweepLook& look, bool is_other_known);
  bool is_fresh(const Beam& beam, double at_m) const;
  void end_scan_where_due(const Beam& beam, double now_s);
  void end_scan(double now_s);
  void end_silent_scan(double now_s);

  // What is seen, to who listens.
  void tell_look(const Beam& beam, std::size_t line, const PaintLook& look, const SweepLook& sweep);
  void tell_things(Beam& beam, double at_m, double time_s);
  void tell(const Beam& beam, SeenKind kind, const SeenAt& where, double length_m = kUnknown,
            std::string_view reason = {});

  GuidanceConfig config;
  GuidanceListener& listener;
  Odometer odometer;
  bool has_odometer = false;
  std::int64_t first_counts = 0;
  bool has_counts = false;
  PathFollower path;
  AlignmentSigma alignment;
  FaultWatch faults;
  std::vector<Beam> beams;
  std::vector<double> aligned_m;  // Where the line is under each beam, by its zero and scale.
  std::vector<GunPost> guns;
  std::vector<DashBook> books;  // Of line 0 and, of a double line, line 1.
  double apart_m = 0.0;         // The other line of a double one, to the left of the followed.
  GunMoment known;              // Where it was last known.
  double clock_s = kUnknown;
  double scan_s = kUnknown;      // Of the scan that is under way.
  double scan_end_s = kUnknown;  // Of the one before.
  double silence_s = 0.0;        // After so long the next one is ended by the clock.
  int beams_seen = 0;            // Of it, that saw the stripe.
  double held_volts = 0.0;
  bool is_laser_off = false;
  GuidanceTotals totals;
  SeenLine seen_line;  // Its strings are used again.
};

Guidance::Impl::Impl(const GuidanceConfig& how, GuidanceListener& who)
    : config(how), listener(who), odometer(how.odometer), path(how), alignment(how), faults(how) {
  aligned_m.resize(how.beams.size());
  for (const GuidanceBeam& beam : config.beams) {
    beams.emplace_back(beam, config.stripe);
    if (beam.use != BeamUse::kOff) silence_s = std::max(silence_s, kSilentPeriods / beam.rate_hz);
  }
  for (const GuidanceGun& gun : config.guns) {
    guns.emplace_back(config, gun);
    totals.guns.push_back({});
    totals.guns.back().name = gun.name;
  }
  // Forward of the foremost gun, and used.
  double gun_x_m = 0.0;
  for (const GuidanceGun& gun : config.guns) gun_x_m = std::max(gun_x_m, gun.gun.x_m);
  std::vector<std::size_t> forward;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    if (beams[i].beam.x_m > gun_x_m && beams[i].beam.use != BeamUse::kOff) forward.push_back(i);
  }
  std::sort(forward.begin(), forward.end(),
            [&](std::size_t a, std::size_t b) { return beams[a].beam.x_m > beams[b].beam.x_m; });
  for (std::size_t i = 0; i < forward.size(); ++i) beams[forward[i]].forward = i;
  const std::size_t lines = config.stripe.follow == FollowLine::kSingle ? 1 : 2;
  for (std::size_t line = 0; line < lines; ++line) {
    std::vector<PaintGun*> of_line;
    for (GunPost& gun : guns) {
      if (gun.line() == static_cast<int>(line)) of_line.push_back(&gun.gun());
    }
    const auto& given = config.stripe.lines;
    books.emplace_back(
        forward.size(),
        detail::PaintEndsOptions{config.stripe.marker_max_m, config.stripe.gap_min_m},
        line < given.size() ? given[line] : GuidanceLine{}, std::move(of_line));
  }
  held_volts = config.output.volts_safe;
  apart_m =
      (config.stripe.follow == FollowLine::kRight ? 1.0 : -1.0) * config.stripe.line_spacing_m();
}

Guidance::Guidance(const GuidanceConfig& config, GuidanceListener& listener) {
  config.validate();
  impl_ = std::make_unique<Impl>(config, listener);
}
Guidance::Guidance(Guidance&&) noexcept = default;
Guidance& Guidance::operator=(Guidance&&) noexcept = default;
Guidance::~Guidance() = default;

const GuidanceConfig& Guidance::config() const noexcept { return impl_->config; }

GunMoment Guidance::Impl::moment_at(double time_s) const {
  const Motion motion = odometer.at(time_s);
  GunMoment moment{time_s, motion.distance_m, motion.speed_m_s, first_counts};
  const double before_m = odometer.at(time_s - kSpeedOver_s).distance_m;
  if (std::isfinite(before_m)) moment.speed_m_s = (motion.distance_m - before_m) / kSpeedOver_s;
  if (std::isfinite(motion.distance_m)) {
    moment.counts += std::llround(std::floor(motion.distance_m * config.odometer.counts_per_m));
  }
  return moment;
}

// What was predicted and then is corrected by less than a count is no way back.
void Guidance::Impl::hold_back(GunMoment& moment) const {
  const double back_m = known.distance_m - moment.distance_m;
  if (back_m > 0.0 && back_m * std::abs(config.odometer.counts_per_m) < 1.0) {
    moment.distance_m = known.distance_m;
  }
}

// Between two inputs the vehicle moves evenly.
void Guidance::Impl::run_guns(double until_s) {
  GunMoment from = moment_at(clock_s);
  GunMoment to = moment_at(until_s);
  hold_back(from);
  hold_back(to);
  const double passed_s = until_s - clock_s;
  if (!std::isfinite(to.distance_m) || !std::isfinite(from.distance_m)) return close_guns(until_s);
  const bool is_allowed = !faults.action();
  if (!is_allowed) {
    for (DashBook& book : books) book.forget();
  }
  known = to;
  const auto steps = static_cast<int>(std::ceil(passed_s / kGunStep_s));
  for (int step = 1; step <= steps; ++step) {
    const double share = static_cast<double>(step) / steps;
    GunMoment now = to;
    now.time_s = clock_s + share * passed_s;
    now.distance_m = from.distance_m + share * (to.distance_m - from.distance_m);
    now.counts =
        first_counts + std::llround(std::floor(now.distance_m * config.odometer.counts_per_m));
    for (std::size_t i = 0; i < guns.size(); ++i) {
      const auto ended = guns[i].update(now, is_allowed);
      if (!ended) continue;
      listener.switch_gun(i, guns[i].is_on(), now.time_s);
      listener.gun(*ended);
    }
  }
  const double behind_m = 2.0;
  for (DashBook& book : books) {
    while (book.take_before(to.distance_m - behind_m)) {
    }
  }
}

// Where nobody knows where the truck is, no gun paints. The stretch ends where it was known last.
void Guidance::Impl::close_guns(double now_s) {
  for (DashBook& book : books) book.forget();
  for (std::size_t i = 0; i < guns.size(); ++i) {
    guns[i].gun().stop();
    if (!guns[i].is_on()) continue;
    const auto ended = guns[i].update(known, false);
    listener.switch_gun(i, false, now_s);
    if (ended) listener.gun(*ended);
  }
}

void Guidance::Impl::run_faults(double now_s) {
  while (const auto fault = faults.take(now_s)) {
    ++totals.faults[static_cast<std::size_t>(fault->code)];
    listener.fault(*fault);
  }
  const bool must_be_off = faults.must_switch_laser_off();
  if (must_be_off && !is_laser_off) listener.switch_laser_off(now_s);
  is_laser_off = must_be_off;
}

void Guidance::go_to(double time_s) {
  Impl& m = *impl_;
  if (!std::isfinite(time_s)) return;
  if (std::isnan(m.clock_s)) m.clock_s = time_s;
  // Until the clock was set back has come again nobody knows where the truck is.
  if (time_s < m.clock_s - kJump_s) m.close_guns(m.clock_s);
  if (time_s <= m.clock_s) return;
  // What is silent is found in time, however long the next input takes; after a second all is said.
  const double until_s = std::min(time_s, m.clock_s + kJump_s);
  while (m.clock_s < until_s) {
    const double next_s = std::min(until_s, m.clock_s + kClockStep_s);
    m.run_faults(next_s);
    m.run_guns(next_s);
    m.end_silent_scan(next_s);
    m.clock_s = next_s;
  }
  m.clock_s = time_s;
}

void Guidance::take(const OdometerReading& reading) {
  Impl& m = *impl_;
  go_to(reading.time_s);  // By what was known until now.
  m.has_odometer = true;
  if (!m.has_counts) m.first_counts = reading.counts;
  m.has_counts = true;
  const OdometerVerdict verdict = m.odometer.update(reading);
  const bool is_plausible =
      verdict != OdometerVerdict::kImplausible && verdict != OdometerVerdict::kOutOfOrder;
  m.faults.odometer(reading.time_s, is_plausible);
  const Motion motion = m.odometer.at(reading.time_s);
  if (std::isfinite(reading.yaw_rate_rad_s)) {
    const double given = m.config.odometer.yaw_rate_sigma_rad_s;
    m.path.advance(motion.distance_m);
    m.path.see_yaw_rate(reading.yaw_rate_rad_s, std::isfinite(given) ? given : kYawRateSigma_rad_s,
                        m.moment_at(reading.time_s).speed_m_s);
  }
}

void Guidance::take(const TruckState& state) {
  go_to(state.time_s);
  impl_->faults.truck(state);
  impl_->run_faults(state.time_s);
}

void Guidance::take(const BeamSweep& sweep) {
  Impl& m = *impl_;
  const auto found = std::find_if(m.beams.begin(), m.beams.end(),
                                  [&](const Beam& one) { return one.beam.name == sweep.beam; });
  if (found == m.beams.end()) {
    ++m.totals.unknown_sweeps;
    return;
  }
  Beam& beam = *found;
  const double step_s = sweep.time_s - beam.last_s;
  const bool is_early = step_s < kEarlyShare / beam.beam.rate_hz;
  if (is_early || step_s > kJump_s) m.faults.time_jumped(sweep.time_s);
  beam.last_s = sweep.time_s;
  if (is_early && step_s <= 0.0) {
    m.run_faults(sweep.time_s);
    return;
  }
  // A head's scans count nothing.
  if (!m.has_odometer && beam.beam.head.empty()) {
    if (!m.has_counts) m.first_counts = sweep.odometer_counts;
    m.has_counts = true;
    m.odometer.update({sweep.time_s, sweep.odometer_counts, kUnknown});
  }
  ++m.totals.sweeps;
  go_to(sweep.time_s + beam.beam.sweep_s);
  m.process(beam, static_cast<std::size_t>(found - m.beams.begin()), sweep);
}

void Guidance::Impl::process(Beam& beam, std::size_t index, const BeamSweep& sweep) {
  SweepLook look;
  look.beam = index;
  look.sweep_s = sweep.time_s;
  look.now_s = sweep.time_s + beam.beam.sweep_s;
  look.seen = beam.reader.read(sweep.samples);
  const detail::SweepFlaw flaw = beam.reader.flaw();
  faults.sweep(index, sweep.time_s, flaw.is_constant || flaw.is_clipped);
  run_faults(look.now_s);
  if (std::isnan(scan_s)) scan_s = look.now_s;
  if (beam.is_in_scan) end_scan(look.now_s);
  beam.is_in_scan = true;
  look.here_m = way_at(look.now_s);
  if (beam.beam.use == BeamUse::kOff || !std::isfinite(look.here_m))
    return end_scan_where_due(beam, look.now_s);

  path.advance(look.here_m);
  // When the sweep's middle was met; each line's own time is beside it by less than half a sweep.
  const double middle_m = way_at(sweep.time_s + 0.5 * beam.beam.sweep_s);
  const ExpectedLine expected = path.expected(index, look.here_m - middle_m);
  look.found = choose_stripe(look.seen, config.stripe, expected);
  look.at_m = middle_m + beam.beam.x_m;
  look.lateral_m = expected.lateral_m;

  take_followed(beam, look);
  take_things(beam, look);
  take_other(beam, look);
  tell_things(beam, look.at_m, look.now_s);
  look_at_dashes(beam, look, look.found.followed || std::isfinite(expected.lateral_m));
  beam.last_at_m = look.at_m;
  end_scan_where_due(beam, look.now_s);
}

void Guidance::Impl::take_followed(Beam& beam, SweepLook& look) {
  if (!look.found.followed) return;
  const SeenPaint& paint = look.seen[*look.found.followed];
  const double met_s = look.sweep_s + paint.delay_s;
  const double met_m = way_at(met_s);
  look.at_m = met_m + beam.beam.x_m;
  look.lateral_m = paint.lateral_m();
  look.is_marker = config.smoothing.method == PathMethod::kFilter &&
                   beam.things.is_marker(paint.height, look.at_m);
  if (look.is_marker) {
    beam.things.see(paint, look.lateral_m, look.at_m, look.at_m - beam.last_at_m);
  } else if (!is_fresh(beam, look.at_m)) {
    look.is_path =
        path.see({look.beam, look.lateral_m, paint.sigma_m, paint.width_m(), look.here_m - met_m});
    if (look.is_path) ++beams_seen;
    beam.things.see_stripe(paint.height);
    tell(beam, SeenKind::kLine, {met_s, look.at_m, look.lateral_m});
  } else if (!(std::abs(look.at_m - beam.wet_from_m) < 1.0)) {
    beam.wet_from_m = look.at_m;
    tell(beam, SeenKind::kWet, {look.now_s, look.at_m, look.lateral_m}, kUnknown,
         "the gun has painted it");
  }
}

// Pieces of a worn stripe are no things.
void Guidance::Impl::take_things(Beam& beam, const SweepLook& look) const {
  for (std::size_t i = 0; i < look.seen.size(); ++i) {
    if (look.found.followed == i || look.found.other == i) continue;
    const SeenPaint& paint = look.seen[i];
    const double off_m = std::abs(paint.lateral_m() - look.lateral_m);
    if (off_m + 0.5 * paint.width_m() < kStripeWidths * config.stripe.width_m) continue;
    const double at_m = way_at(look.sweep_s + paint.delay_s) + beam.beam.x_m;
    beam.things.see(paint, look.lateral_m, at_m, at_m - beam.last_at_m);
  }
}

// In a gap of the followed line the other one tells where it would be.
void Guidance::Impl::take_other(Beam& beam, const SweepLook& look) {
  if (!look.found.other) return;
  const SeenPaint& other = look.seen[*look.found.other];
  tell(beam, SeenKind::kLine, {look.now_s, look.at_m, other.lateral_m()});
  if (look.is_path) {
    apart_m += kApartShare * (other.lateral_m() - look.lateral_m - apart_m);
  } else if (!look.found.followed && !is_fresh(beam, look.at_m)) {
    const double sigma_m = std::hypot(other.sigma_m, kApartSigma_m);
    const double since_m = look.here_m - way_at(look.sweep_s + other.delay_s);
    const double lateral_m = other.lateral_m() - apart_m;
    if (path.see({look.beam, lateral_m, sigma_m, kUnknown, since_m})) ++beams_seen;
  }
}

bool Guidance::Impl::is_fresh(const Beam& beam, double at_m) const {
  if (beam.beam.use != BeamUse::kOldOnly) return false;
  return std::any_of(guns.begin(), guns.end(),
                     [&](const GunPost& gun) { return gun.has_painted(at_m, known.distance_m); });
}

// A marker is no paint; what lies under it is not known, and it is short.
void Guidance::Impl::look_at_dashes(Beam& beam, const SweepLook& look, bool is_other_known) {
  if (!beam.forward) return;
  const StripeFound& found = look.found;
  if (!found.is_followed_hidden && !look.is_marker) {
    const bool is_paint = found.followed.has_value() || found.is_followed_worn;
    tell_look(beam, 0, books[0].look(*beam.forward, is_paint, look.at_m), look);
  }
  if (books.size() < 2 || !is_other_known || found.is_other_hidden) return;
  const bool is_paint = found.other.has_value() || found.is_other_worn;
  tell_look(beam, 1, books[1].look(*beam.forward, is_paint, look.at_m), look);
}

void Guidance::Impl::tell_look(const Beam& beam, std::size_t line, const PaintLook& look,
                               const SweepLook& sweep) {
  const char* const of = line == 0 ? "the followed line" : "the other line";
  const SeenAt where{sweep.now_s, look.at_m, sweep.lateral_m};
  switch (look.news) {
    case PaintLook::News::kBegin:
      return tell(beam, SeenKind::kStart, where, kUnknown, of);
    case PaintLook::News::kEnd:
      return tell(beam, SeenKind::kEnd, where, kUnknown, of);
    case PaintLook::News::kShort:
      return tell(beam, SeenKind::kMarker, where, look.length_m, "shorter than a dash can be");
    case PaintLook::News::kPaint:
    case PaintLook::News::kNothing:
      return;
  }
}

void Guidance::Impl::tell_things(Beam& beam, double at_m, double time_s) {
  while (const auto thing = beam.things.take(at_m)) {
    tell(beam, thing->kind, {time_s, thing->from_m, thing->lateral_m()}, thing->length_m(),
         thing->reason);
  }
}

void Guidance::Impl::tell(const Beam& beam, SeenKind kind, const SeenAt& where, double length_m,
                          std::string_view reason) {
  if (kind == SeenKind::kLine || beam.forward == std::size_t{0}) {
    ++totals.seen[static_cast<std::size_t>(kind)];
  }
  seen_line.time_s = where.time_s;
  seen_line.odometer_counts = moment_at(where.time_s).counts;
  seen_line.distance_m = where.at_m;
  seen_line.beam = beam.beam.name;
  seen_line.kind = kind;
  seen_line.lateral_m = where.lateral_m;
  seen_line.length_m = length_m;
  seen_line.reason = reason;
  listener.seen(seen_line);
}

// A scan is one sweep of every beam; one that is silent is not waited for longer than half a
// period.
void Guidance::Impl::end_scan_where_due(const Beam& beam, double now_s) {
  const bool is_whole =
      std::all_of(beams.begin(), beams.end(), [](const Beam& one) { return one.is_in_scan; });
  if (is_whole || now_s - scan_s > kEarlyShare / beam.beam.rate_hz) end_scan(now_s);
}

// Where all beams are silent the truck goes on all the same: blind, by its odometer.
void Guidance::Impl::end_silent_scan(double now_s) {
  const double here_m = odometer.at(now_s).distance_m;
  if (!(now_s - scan_end_s > silence_s) || !std::isfinite(here_m)) return;
  path.advance(here_m);
  end_scan(now_s);
}

void Guidance::Impl::end_scan(double now_s) {
  for (Beam& beam : beams) beam.is_in_scan = false;
  scan_s = kUnknown;
  scan_end_s = now_s;
  path.end_scan();
  const GunMoment here = moment_at(now_s);
  const PathFollower::Answer answer = path.at_gun();
  const bool is_missing =
      answer.unseen_m > config.stripe.gap_limit_m && here.distance_m > config.stripe.gap_limit_m;
  faults.stripe(is_missing, now_s);
  if (std::isfinite(answer.unseen_m)) {
    totals.longest_gap_m = std::max(totals.longest_gap_m, answer.unseen_m);
  }
  std::uint64_t lost = 0;
  for (GunPost& gun : guns) lost += gun.gun().lost();
  faults.queue(lost > totals.dashes_lost, now_s);
  totals.dashes_lost = lost;
  run_faults(now_s);

  LateralLine line;
  line.time_s = now_s;
  line.odometer_counts = here.counts;
  line.distance_m = here.distance_m;
  line.lateral_m = answer.lateral_m;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const GuidanceBeam& beam = beams[i].beam;
    aligned_m[i] = (path.expected(i, 0.0).lateral_m - beam.zero_m) / beam.scale;
  }
  line.sigma_m = std::hypot(answer.sigma_m, alignment.at(aligned_m));
  line.beams = std::exchange(beams_seen, 0);
  const auto action = faults.action();
  line.state = state_of(answer, action.has_value());
  const bool is_known = line.state == PathState::kTracking || line.state == PathState::kBridging;
  if (is_known) held_volts = config.output.volts(answer.lateral_m);
  line.volts = is_known || action == FaultAction::kHold ? held_volts : config.output.volts_safe;
  ++totals.scans;
  ++totals.scans_of_state[static_cast<std::size_t>(line.state)];
  if (std::isfinite(here.distance_m)) totals.way_m = here.distance_m;
  listener.lateral(line);
}

void Guidance::finish() {
  Impl& m = *impl_;
  if (std::isnan(m.clock_s)) return;
  GunMoment here = m.moment_at(m.clock_s);
  if (!std::isfinite(here.distance_m)) here = m.known;
  for (GunPost& gun : m.guns) m.listener.gun(gun.stretch_to(here));
}

double Guidance::lateral_after(double way_m) const noexcept { return impl_->path.after(way_m); }

GuidanceTotals Guidance::totals() const {
  const Impl& m = *impl_;
  GuidanceTotals totals = m.totals;
  const GunMoment here = m.moment_at(m.clock_s);
  for (std::size_t i = 0; i < m.guns.size(); ++i) {
    GuidanceTotals::Gun& gun = totals.guns[i];
    gun.on_m = m.guns[i].on_m();
    if (m.guns[i].is_on() && std::isfinite(here.distance_m)) {
      gun.on_m += m.guns[i].stretch_to(here).length_m;
    }
    gun.dashes = m.guns[i].dashes();
    const auto line = static_cast<std::size_t>(m.guns[i].line());
    if (line >= m.books.size()) continue;
    const detail::DashPattern& pattern = m.books[line].pattern();
    if (!pattern.is_locked()) continue;
    gun.dash_m = pattern.dash_m();
    gun.cycle_m = pattern.cycle_m();
    gun.pattern_quality = pattern.quality();
  }
  for (const DashBook& book : m.books) totals.dashes_not_allowed += book.unpainted();
  return totals;
}

}  // namespace striper
