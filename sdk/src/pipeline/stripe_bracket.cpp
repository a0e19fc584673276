// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stripe_bracket.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <striper/core/return_status.hpp>

namespace striper::detail {
namespace {

// Two good returns of a scan line that are so far apart, in sigmas and in widths, are two things.
constexpr double kSigmasApart = 5.0;
constexpr double kWidthsApart = 2.0;

// A peak that rises higher than this part of full scale is clipped, or nearly so.
constexpr double kNearlyFull = 0.95;

// How much a return is worth.
enum class Worth { kNone, kReason, kDoubtful, kClipped, kGood };

// A clipped profile is known by its flanks and ends alone: clipped ten times over its error is
// several times as large as its error bar says (exposure_bracket_tests), so that any whole one goes
// before it.
Worth worth(ReturnStatus status, bool is_clipped) {
  switch (verdict(status)) {
    case Verdict::kGood:
      return is_clipped ? Worth::kClipped : Worth::kGood;
    case Verdict::kDoubtful:
      return Worth::kDoubtful;
    case Verdict::kMissing:
      break;
  }
  return status == ReturnStatus::kNoStripe ? Worth::kNone : Worth::kReason;
}

bool are_two_things(const Stripe& a, const Stripe& b, std::size_t i) {
  const bool are_good =
      verdict(a.status[i]) == Verdict::kGood && verdict(b.status[i]) == Verdict::kGood;
  if (!are_good) return false;
  const double apart_px = std::abs(a.across_px[i] - b.across_px[i]);
  const double sigma_px = std::hypot(a.sigma_px[i], b.sigma_px[i]);
  const double width_px = std::max(a.width_px[i], b.width_px[i]);
  return apart_px > kSigmasApart * sigma_px && apart_px > kWidthsApart * width_px;
}

void take_line(const Stripe& from, std::size_t i, double amplitude_factor, Stripe& into) {
  into.across_px[i] = from.across_px[i];
  into.sigma_px[i] = from.sigma_px[i];
  into.amplitude_dn[i] = static_cast<float>(amplitude_factor * from.amplitude_dn[i]);
  into.width_px[i] = from.width_px[i];
  into.confidence[i] = from.confidence[i];
  into.status[i] = from.status[i];
}

// All of a frame but its pixels.
void describe(const LitFrame& lit, LitFrame& described) {
  described.full_scale_dn = lit.full_scale_dn;
  described.grid = lit.grid;
  described.sequence = lit.sequence;
  described.time = lit.time;
  described.exposure_number = lit.exposure_number;
  described.exposure_ns = lit.exposure_ns;
  described.laser = lit.laser;
  described.field = lit.field;
}

}  // namespace

StripeBracket::StripeBracket(const IlluminationPattern& pattern) : pattern_(pattern) {
  const std::vector<Illumination>& entries = pattern_.entries();
  for (std::size_t entry = 0; entry < entries.size(); ++entry) {
    if (!entries[entry].is_lit()) continue;
    const auto laser = static_cast<std::size_t>(entries[entry].laser_index());
    if (rounds_.size() <= laser) rounds_.resize(laser + 1);
    rounds_[laser].entries.push_back(entry);
  }
}

std::size_t StripeBracket::place_of(const LitFrame& lit) const noexcept {
  const auto laser = static_cast<std::size_t>(lit.laser);
  if (laser >= rounds_.size()) return 0;
  const std::vector<std::size_t>& entries = rounds_[laser].entries;
  const std::size_t entry = lit.exposure_number % pattern_.entries().size();
  const auto at = std::lower_bound(entries.begin(), entries.end(), entry);
  return at == entries.end() ? 0 : static_cast<std::size_t>(at - entries.begin());
}

void StripeBracket::add(const LitFrame& lit, const Stripe& stripe) {
  ready_.clear();
  const auto laser = static_cast<std::size_t>(lit.laser);
  if (laser >= rounds_.size()) rounds_.resize(laser + 1);
  Round& round = rounds_[laser];
  const std::uint64_t number = lit.exposure_number / pattern_.entries().size();
  // Rows of another region or field are another stripe's.
  const bool is_same = round.taken > 0 && number == round.number &&
                       stripe.size() == round.open.stripe.size() &&
                       stripe.grid == round.open.stripe.grid;
  if (!is_same) close(round);

  const std::size_t first = round.entries.empty() ? 0 : round.entries.front();
  const double own_us = pattern_.exposure_us_at(lit.exposure_number);
  const double factor = own_us > 0.0 ? pattern_.exposure_us_at(first) / own_us : 1.0;
  if (round.taken == 0) {
    round.number = number;
    round.sum_ns = 0;
    describe(lit, round.open.first);
    round.open.stripe.reset(static_cast<int>(stripe.size()));
    round.open.stripe.axis = stripe.axis;
    round.open.stripe.grid = stripe.grid;
    round.open.stripe.line_count = stripe.line_count;
    round.open.stripe.is_seen = false;
    round.clipped.assign(stripe.size(), 0);
  } else {
    round.sum_ns += lit.time.monotonic_ns - round.open.first.time.monotonic_ns;
  }
  merge(lit, stripe, factor, round);
  ++round.taken;
  if (place_of(lit) + 1 >= round.entries.size()) close(round);
}

void StripeBracket::finish() {
  ready_.clear();
  for (Round& round : rounds_) close(round);
}

void StripeBracket::merge(const LitFrame& lit, const Stripe& stripe, double amplitude_factor,
                          Round& round) {
  const double highest_dn = kNearlyFull * lit.full_scale_dn;
  Stripe& into = round.open.stripe;
  for (std::size_t i = 0; i < into.size(); ++i) {
    const bool is_clipped = stripe.amplitude_dn[i] >= highest_dn;
    const Worth here = worth(stripe.status[i], is_clipped);
    const Worth there = worth(into.status[i], round.clipped[i] != 0);
    const bool is_better = here != there ? here > there : stripe.sigma_px[i] < into.sigma_px[i];
    const bool is_ambiguous = are_two_things(stripe, into, i);
    if (is_better) {
      take_line(stripe, i, amplitude_factor, into);
      round.clipped[i] = is_clipped ? 1 : 0;
    }
    if (is_ambiguous) into.status[i] = ReturnStatus::kAmbiguous;
  }
  into.is_seen = into.is_seen || stripe.is_seen;
}

void StripeBracket::close(Round& round) {
  if (round.taken == 0) return;
  round.open.first.time.monotonic_ns += round.sum_ns / static_cast<std::int64_t>(round.taken);
  BracketedStripe& done = round.done[ready_.size() % round.done.size()];
  std::swap(round.open, done);
  round.taken = 0;
  ready_.push_back(&done);
}

}  // namespace striper::detail
