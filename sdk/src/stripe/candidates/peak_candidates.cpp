// SPDX-License-Identifier: Apache-2.0
#include "stripe/candidates/peak_candidates.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

// A second candidate is measured where its pixel stands out from the noise: from the blocks next to
// it, and where the first one stands out less than so far, from the pixels about it.
constexpr double kSecondProminence = 4.0;
constexpr double kWeakFirstProminence = 10.0;
// And every candidate where the first one hardly does.
constexpr double kHopelessFirstProminence = 6.0;

// Of a peak's height its ridge rises: .95 for a stripe, whose pixels may share it with another.
constexpr float kLeastOfRidge = 0.4F;

// From scan line to scan line, pixels: a larger step is another thing's.
constexpr double kSteepest = 4.0;
constexpr double kNowhere = -1e9;

// Twice as far as a pixel rises above the brighter of its two sides, two pixels of each.
template <typename Pixel>
int rise_of(const LitLine<Pixel>& line, const BlockMaxima::Peak& peak, int reach) {
  const int last = line.length() - 1;
  const auto two = [&](int nearer, int farther) {
    return line.value(std::clamp(nearer, 0, last)) + line.value(std::clamp(farther, 0, last));
  };
  const int before = two(peak.across - reach, peak.across - reach - 1);
  const int after = two(peak.across + reach, peak.across + reach + 1);
  return 2 * peak.value_dn - std::max(before, after);
}

// The highest ones, highest first.
class Highest {
 public:
  void add(int rise, std::int32_t across) {
    std::size_t at = count_ < kMost ? count_++ : kMost;
    for (; at > 0 && places_[at - 1].rise < rise; --at) {
      if (at < kMost) places_[at] = places_[at - 1];
    }
    if (at < kMost) places_[at] = {rise, across};
  }

  void append_to(std::vector<PeakSeed>& seeds, std::int32_t line) const {
    for (std::size_t i = 0; i < count_; ++i) seeds.push_back({line, places_[i].across});
  }

 private:
  static constexpr std::size_t kMost = BlockMaxima::kBest - 1;
  struct Place {
    int rise;
    std::int32_t across;
  };
  std::array<Place, kMost> places_;
  std::size_t count_ = 0;
};

}  // namespace

void PeakCandidates::choose(const LitFrame& frame, StripeAxis axis, BlockMaxima& blocks,
                            double noise_dn, const ProfilePlan& plan) {
  const auto count = static_cast<std::size_t>(blocks.lines());
  primary.make_room(count);
  primary_rises_.reserve(count);
  secondary_rises_.reserve(count * Ridges::kMost);
  secondary.make_room(count * Ridges::kMost);
  for (auto* some : {&hidden_, &weak_lines_}) {
    some->clear();
    some->reserve(count);
  }
  noise_dn_ = noise_dn;
  limits_.second_dn = std::max(1, static_cast<int>(std::ceil(kSecondProminence * noise_dn)));
  limits_.weak_dn = std::max(1, static_cast<int>(std::ceil(kWeakFirstProminence * noise_dn)));
  limits_.flank_px = plan.core;
  blocks.find_rivals(limits_, rivals_);
  find_weak_rivals(frame, axis, blocks);
  merge_rivals();
  primary.seeds.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    primary.seeds[i] = {static_cast<std::int32_t>(i), blocks.best_across()[i]};
  }
}

void PeakCandidates::look_behind(float significance, const LitFrame& frame, StripeAxis axis,
                                 const BlockMaxima& blocks) {
  find_hidden_lines(significance, blocks);
  if (hidden_.empty()) return;
  std::set_union(rivals_.weak_lines.begin(), rivals_.weak_lines.end(), hidden_.begin(),
                 hidden_.end(), std::back_inserter(weak_lines_));
  rivals_.weak_lines.swap(weak_lines_);
  std::erase_if(rivals_.places, [&](const PeakSeed& place) { return is_hidden(place.line); });
  find_weak_rivals(frame, axis, blocks);
  merge_rivals();
}

void PeakCandidates::find_hidden_lines(float significance, const BlockMaxima& blocks) {
  constexpr std::size_t kTogether = 16;  // Nearly always there are none, a vector at a time.
  for (std::size_t first = 0; first < primary.size(); first += kTogether) {
    const std::size_t last = std::min(first + kTogether, primary.size());
    int any = 0;
    for (std::size_t i = first; i < last; ++i) any |= !(primary.significance[i] >= significance);
    if (any == 0) continue;
    for (std::size_t i = first; i < last; ++i) {
      const auto line = static_cast<std::int32_t>(i);
      if (primary.significance[i] >= significance) continue;
      if (blocks.prominence_dn(0, line) >= limits_.weak_dn) hidden_.push_back(line);
    }
  }
}

bool PeakCandidates::is_hidden(std::int32_t line) const {
  return std::binary_search(hidden_.begin(), hidden_.end(), line);
}

void PeakCandidates::find_weak_rivals(const LitFrame& frame, StripeAxis axis,
                                      const BlockMaxima& blocks) {
  if (frame.lit.depth() == CV_8U) {
    find_weak_rivals_in<std::uint8_t>(frame, axis, blocks);
  } else {
    find_weak_rivals_in<std::uint16_t>(frame, axis, blocks);
  }
}

// Between surfaces as bright as itself a stripe does not rise above the blocks next to it: of weak
// scan lines every block is looked at.
template <typename Pixel>
void PeakCandidates::find_weak_rivals_in(const LitFrame& frame, StripeAxis axis,
                                         const BlockMaxima& blocks) {
  weak_rivals_.clear();
  weak_rivals_.reserve(secondary.seeds.capacity());
  for (const std::int32_t number : rivals_.weak_lines) {
    const LitLine<Pixel> line(frame, axis, number);
    const std::int32_t first = blocks.best_across()[static_cast<std::size_t>(number)];
    const bool is_hopeless =
        blocks.prominence_dn(0, number) < kHopelessFirstProminence * noise_dn_ || is_hidden(number);
    const int least = is_hopeless ? 1 : static_cast<int>(2.0 * kSecondProminence * noise_dn_);
    Highest highest;
    for (int block = 0; block < blocks.blocks(); ++block) {
      const BlockMaxima::Peak peak = blocks.at(block, number);
      const int rise = rise_of(line, peak, limits_.flank_px);
      if (rise >= least && peak.across != first) highest.add(rise, peak.across);
    }
    highest.append_to(weak_rivals_, number);
  }
}

void PeakCandidates::merge_rivals() {
  const std::vector<PeakSeed>& clear = rivals_.places;
  secondary.seeds.resize(clear.size() + weak_rivals_.size());
  const auto is_before = [](const PeakSeed& a, const PeakSeed& b) { return a.line < b.line; };
  std::merge(clear.begin(), clear.end(), weak_rivals_.begin(), weak_rivals_.end(),
             secondary.seeds.begin(), is_before);
}

std::size_t PeakCandidates::unclear_lines(float significance) const {
  std::size_t unclear = 0;
  std::size_t extra = 0;
  double last = kNowhere;
  std::size_t last_line = 0;
  for (std::size_t line = 0; line < primary.size(); ++line) {
    const PeakList* highest = primary.significance[line] >= significance ? &primary : nullptr;
    std::size_t at = line;
    for (;
         extra < secondary.size() && static_cast<std::size_t>(secondary.seeds[extra].line) == line;
         ++extra) {
      if (!(secondary.significance[extra] >= significance)) continue;
      if (highest != nullptr && highest->amplitude[at] >= secondary.amplitude[extra]) continue;
      highest = &secondary;
      at = extra;
    }
    if (highest == nullptr) continue;
    const double now = highest->position(at);
    const double most = kSteepest * static_cast<double>(line - last_line);
    unclear += static_cast<std::size_t>(last != kNowhere && std::abs(now - last) > most);
    last = now;
    last_line = line;
  }
  return unclear;
}

bool PeakCandidates::has_peak(int line, float significance) const {
  if (primary.significance[static_cast<std::size_t>(line)] >= significance) return true;
  for (std::size_t i = first_secondary(line);
       i < secondary.size() && secondary.seeds[i].line == line; ++i) {
    if (secondary.significance[i] >= significance) return true;
  }
  return false;
}

void PeakCandidates::take_ridges(const Ridges& ridges) {
  secondary.seeds.clear();
  secondary.seeds.reserve(primary.size() * Ridges::kMost);
  secondary_rises_.clear();
  secondary_rises_.reserve(primary.size() * Ridges::kMost);
  primary_rises_.assign(primary.size(), 0);
  for (std::size_t i = 0; i < primary.size(); ++i) {
    PeakSeed& first = primary.seeds[i];
    const std::span<const Ridges::Ridge> of_line = ridges.of_line(first.line);
    const auto highest = std::max_element(
        of_line.begin(), of_line.end(),
        [](const Ridges::Ridge& a, const Ridges::Ridge& b) { return a.rise_dn < b.rise_dn; });
    if (highest == of_line.end()) continue;
    first.across = highest->across;
    primary_rises_[i] = highest->rise_dn;
    for (auto ridge = of_line.begin(); ridge != of_line.end(); ++ridge) {
      if (ridge == highest) continue;
      secondary.seeds.push_back({first.line, ridge->across});
      secondary_rises_.push_back(ridge->rise_dn);
    }
  }
  secondary.make_room(secondary.seeds.size());
}

void PeakCandidates::blank_false_ridges() {
  const auto blank = [](PeakList& peaks, const std::vector<std::int32_t>& rises) {
    for (std::size_t i = 0; i < peaks.size(); ++i) {
      const auto rise = static_cast<float>(rises[i]);
      const bool is_clipped = peaks.clipped[i] > 0.0F && rises[i] > 0;
      if (is_clipped || rise > kLeastOfRidge * peaks.amplitude[i]) continue;
      peaks.significance[i] = 0.0F;
    }
  };
  blank(primary, primary_rises_);
  blank(secondary, secondary_rises_);
}

void PeakCandidates::blank_flat_lines() {
  for (const std::int32_t line : rivals_.flat_lines)
    primary.significance[static_cast<std::size_t>(line)] = 0.0F;
}

std::size_t PeakCandidates::first_secondary(int line) const {
  const auto before = [](const PeakSeed& seed, int l) { return seed.line < l; };
  const auto at = std::lower_bound(secondary.seeds.begin(), secondary.seeds.end(), line, before);
  return static_cast<std::size_t>(at - secondary.seeds.begin());
}

}  // namespace striper::detail
