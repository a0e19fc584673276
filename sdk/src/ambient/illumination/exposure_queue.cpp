// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/exposure_queue.hpp"

#include <algorithm>
#include <utility>

namespace striper::detail {
namespace {

// Where the illumination follows no pattern, a dark exposure this near serves.
constexpr std::uint64_t kReachWithoutPattern = 2;

// Whether two exposures can be subtracted: as long as each other, the same pixels or the rows
// between them.
bool fits(const Frame& lit, const Frame& dark) {
  const bool is_known = lit.exposure_ns > 0 && dark.exposure_ns > 0;
  if (is_known && lit.exposure_ns != dark.exposure_ns) return false;
  const bool same_pixels = lit.image.type() == dark.image.type() &&
                           lit.image.cols == dark.image.cols && lit.bit_depth == dark.bit_depth &&
                           lit.grid.u == dark.grid.u;
  if (lit.field != dark.field) return same_pixels && lit.field != Field::kProgressive;
  return same_pixels && lit.image.rows == dark.image.rows && lit.grid.v == dark.grid.v;
}

bool is_kept_alive(const Frame& frame) {
  return frame.image.u != nullptr || frame.lease != nullptr;
}

}  // namespace

void ExposureQueue::add(const Frame& frame, std::uint64_t number) {
  if (free_.empty()) free_.push_back(std::make_unique<HeldExposure>());
  std::unique_ptr<HeldExposure> exposure = std::move(free_.back());
  free_.pop_back();
  exposure->frame = frame;
  if (!is_kept_alive(frame)) {
    frame.image.copyTo(exposure->own);
    exposure->frame.image = exposure->own;
  }
  exposure->number = number;
  exposure->is_done = false;
  exposure->has_channel = false;
  exposure->light = Illumination::unknown();
  if (is_labelled_) label(*exposure);
  held_.push_back(std::move(exposure));
}

void ExposureQueue::set_pattern(const IlluminationPattern& pattern) {
  pattern_ = pattern;
  is_labelled_ = true;
  for (const auto& exposure : held_) {
    if (!exposure->is_done) label(*exposure);
  }
  reach_ = expected(0, false).before;
  reach_of_fields_ = std::max(reach_, expected(0, true).before);
  for (std::uint64_t n = 1; n < 2 * pattern.entries().size(); ++n) {
    reach_ = std::max(reach_, expected(n, false).before);
    reach_of_fields_ = std::max({reach_of_fields_, reach_, expected(n, true).before});
  }
}

void ExposureQueue::label(HeldExposure& exposure) noexcept {
  const bool was_dark = exposure.light.is_dark();
  exposure.light = exposure.frame.illumination;
  if (exposure.light.is_unknown()) exposure.light = pattern_.at(exposure.number);
  if (exposure.light.is_unknown()) exposure.light = Illumination::laser(0);
  if (exposure.light.is_dark() && !was_dark) ++dark_exposures_;
}

void ExposureQueue::hold_from(std::uint64_t number) noexcept {
  is_labelled_ = false;
  std::size_t kept = 0;
  for (auto& exposure : held_) {
    if (exposure->number < number) continue;
    if (exposure->light.is_dark()) --dark_exposures_;
    exposure->light = Illumination::unknown();
    std::swap(held_[kept++], exposure);
  }
  while (held_.size() > kept) release_newest();
}

std::uint64_t ExposureQueue::drop_unlabelled() noexcept {
  std::uint64_t dropped = 0;
  std::size_t kept = 0;
  for (auto& exposure : held_) {
    if (exposure->frame.illumination.is_unknown()) {
      if (!exposure->is_done && !exposure->light.is_dark()) ++dropped;
    } else {
      std::swap(held_[kept++], exposure);
    }
  }
  while (held_.size() > kept) release_newest();
  return dropped;
}

std::uint64_t ExposureQueue::give_up() noexcept {
  std::uint64_t lit = 0;
  for (const auto& exposure : held_) {
    if (exposure->is_done || !exposure->light.is_lit()) continue;
    exposure->is_done = true;
    ++lit;
  }
  return lit;
}

HeldExposure* ExposureQueue::next_lit() noexcept {
  for (const auto& exposure : held_) {
    if (exposure->light.is_unknown()) return nullptr;
    if (exposure->light.is_lit() && !exposure->is_done) return exposure.get();
  }
  return nullptr;
}

HeldExposure* ExposureQueue::find_dark(std::uint64_t number) noexcept {
  for (const auto& exposure : held_) {
    if (exposure->number == number && exposure->light.is_dark()) return exposure.get();
  }
  return nullptr;
}

// How far from an exposure the pattern has the nearest dark ones.
ExposureQueue::Distances ExposureQueue::expected(std::uint64_t number,
                                                 bool even_only) const noexcept {
  const std::uint64_t step = even_only ? 2 : 1;
  if (pattern_.is_automatic()) return {kReachWithoutPattern, kReachWithoutPattern};
  const std::uint64_t period = pattern_.entries().size();
  Distances distances;
  // Twice the period: an odd period meets both parities.
  for (std::uint64_t d = step; d <= 2 * period && distances.after == 0; d += step) {
    if (pattern_.at(number + d).is_dark()) distances.after = d;
  }
  for (std::uint64_t d = step; d <= 2 * period && distances.before == 0; d += step) {
    if (pattern_.at(number + 2 * period - d).is_dark()) distances.before = d;
  }
  return distances;
}

// The dark exposure on one side of a lit one: where the pattern has it, or, without a pattern, the
// nearest.
HeldExposure* ExposureQueue::dark_beside(const HeldExposure& lit, std::uint64_t distance,
                                         std::int64_t direction, DarkChoice choice) noexcept {
  const bool is_field = lit.frame.exposures_per_picture == 2;
  const std::uint64_t step = is_field && choice == DarkChoice::kSameRows ? 2 : 1;
  const std::uint64_t first = pattern_.is_automatic() ? step : distance;
  for (std::uint64_t d = first; d <= distance && d != 0; d += step) {
    if (direction < 0 && d > lit.number) return nullptr;
    HeldExposure* const dark = find_dark(direction < 0 ? lit.number - d : lit.number + d);
    if (dark != nullptr && fits(lit.frame, dark->frame)) return dark;
  }
  return nullptr;
}

Neighbours ExposureQueue::neighbours_of(const HeldExposure& lit, DarkChoice choice,
                                        bool is_last) noexcept {
  Neighbours found;
  if (choice == DarkChoice::kNone) return found;
  const bool is_field = lit.frame.exposures_per_picture == 2;
  Distances distances = expected(lit.number, is_field);
  // Rows of the other parity serve only where the same rows are not dark two fields away.
  const bool same_rows_near = !pattern_.is_automatic() && distances == Distances{2, 2};
  if (is_field && choice == DarkChoice::kAny && !same_rows_near) {
    distances = expected(lit.number, false);
  }
  found.before = dark_beside(lit, distances.before, -1, choice);
  found.after = dark_beside(lit, distances.after, +1, choice);
  found.must_wait = found.after == nullptr && !is_last && distances.after != 0 &&
                    held_.back()->number < lit.number + distances.after;

  if (found.before != nullptr && found.after != nullptr) {
    const std::uint64_t to_before = lit.number - found.before->number;
    const std::uint64_t to_after = found.after->number - lit.number;
    if (found.before->frame.field != found.after->frame.field) {
      // Rows of two parities have no mean; the nearer one serves.
      (to_before <= to_after ? found.after : found.before) = nullptr;
    } else {
      found.weight_after =
          static_cast<double>(to_before) / static_cast<double>(to_before + to_after);
    }
  }
  const HeldExposure* const any = found.before != nullptr ? found.before : found.after;
  found.is_between_rows = any != nullptr && any->frame.field != lit.frame.field;
  return found;
}

void ExposureQueue::forget(DarkChoice choice) noexcept {
  if (held_.empty()) return;
  const bool is_field = held_.back()->frame.exposures_per_picture == 2;
  const std::uint64_t reach = choice == DarkChoice::kNone ? 0
                              : is_field                  ? reach_of_fields_
                                                          : reach_;
  const HeldExposure* const waiting = next_lit();
  const std::uint64_t oldest_lit = waiting != nullptr ? waiting->number : held_.back()->number + 1;
  std::size_t kept = 0;
  for (auto& exposure : held_) {
    const bool is_waiting = !exposure->light.is_dark() && !exposure->is_done;
    const bool may_serve = exposure->light.is_dark() && exposure->number + reach >= oldest_lit;
    if (is_waiting || may_serve) {
      std::swap(held_[kept++], exposure);
    }
  }
  while (held_.size() > kept) release_newest();
}

// Gives the camera its buffer back and keeps our own memory for the next exposure.
void ExposureQueue::release_newest() noexcept {
  HeldExposure& exposure = *held_.back();
  if (exposure.frame.image.channels() == 1) exposure.channel.lit.release();
  exposure.frame.image.release();
  exposure.frame.lease.reset();
  free_.push_back(std::move(held_.back()));
  held_.pop_back();
}

void ExposureQueue::clear() noexcept {
  while (!held_.empty()) release_newest();
}

}  // namespace striper::detail
