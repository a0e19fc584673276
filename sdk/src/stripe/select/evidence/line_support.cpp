// SPDX-License-Identifier: Apache-2.0
#include "stripe/select/evidence/line_support.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/select/piece_traits.hpp"

namespace striper::detail {
namespace {

constexpr int kFarPart = 10;
constexpr int kNearPart = 40;
constexpr int kMostToASide = 64;  // Of more, every second one votes, or fewer.
constexpr std::size_t kMostOfLine = 8;
constexpr float kSteepest = 1.25F;  // Pixels a scan line.
constexpr float kTolerance_px = 1.25F;

}  // namespace

void LineSupport::reserve(std::size_t most, int lines) {
  supports_.reserve(most);
  voters_.reserve(most);
  first_of_.reserve(static_cast<std::size_t>(lines) + 1);
}

void LineSupport::find(const StripePieces& pieces, const std::vector<float>& odds, float hopeless) {
  find_voters(pieces, odds, hopeless);
  reach_ = std::max(8, pieces.lines() / kFarPart);
  near_reach_ = std::max(4, pieces.lines() / kNearPart);
  supports_.assign(pieces.size(), Support{});
  for (const Voter& own : voters_) {
    vote(pieces.candidate(own.candidate).line, own.across, pieces.lines());
    supports_[own.candidate] = best();
  }
}

// The best of each scan line.
void LineSupport::find_voters(const StripePieces& pieces, const std::vector<float>& odds,
                              float hopeless) {
  const int lines = pieces.lines();
  voters_.clear();
  first_of_.resize(static_cast<std::size_t>(lines) + 1);
  for (int line = 0; line < lines; ++line) {
    const std::size_t first = voters_.size();
    first_of_[static_cast<std::size_t>(line)] = first;
    for (std::size_t i = pieces.first_of(line); i < pieces.first_of(line + 1); ++i) {
      if (odds[i] >= hopeless)
        voters_.push_back({i, pieces.candidate(i).across, odds[i], logistic(odds[i])});
    }
    if (voters_.size() - first <= kMostOfLine) continue;
    const auto begin = voters_.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(kMostOfLine);
    std::nth_element(begin, end, voters_.end(), [](const Voter& a, const Voter& b) {
      return a.odds != b.odds ? a.odds > b.odds : a.candidate < b.candidate;
    });
    voters_.erase(end, voters_.end());
  }
  first_of_[static_cast<std::size_t>(lines)] = voters_.size();
}

void LineSupport::vote(int line, float across, int lines) {
  constexpr float kPerSlope = static_cast<float>(kBins) / (2.0F * kSteepest);
  far_.fill(0.0F);
  near_.fill(0.0F);
  hits_.fill(0.0F);
  far_lines_ = 0;
  near_lines_ = 0;
  const int stride = std::max(1, reach_ / kMostToASide);
  const int first = line - std::min(line, reach_) / stride * stride;
  const int last = std::min(lines - 1, line + reach_);
  for (int other = first; other <= last; other += stride) {
    if (other == line) continue;
    const bool is_near = std::abs(other - line) <= near_reach_;
    ++far_lines_;
    near_lines_ += is_near ? 1 : 0;
    const auto away = static_cast<float>(other - line);
    const float per_px = kPerSlope / std::abs(away);
    const float sign = away > 0.0F ? 1.0F : -1.0F;
    const auto at = static_cast<std::size_t>(other);
    for (std::size_t k = first_of_[at]; k < first_of_[at + 1]; ++k) {
      const Voter& v = voters_[k];
      const float middle = sign * (v.across - across) * per_px + 0.5F * static_cast<float>(kBins);
      const float half = std::max(0.5F, kTolerance_px * per_px);
      const float from = std::max(0.0F, middle - half);
      const float to = std::min(static_cast<float>(kBins), middle + half);
      if (!(from < to)) continue;
      const auto begin = static_cast<std::size_t>(from);
      const auto end = std::max(begin + 1, static_cast<std::size_t>(to));
      far_[begin] += v.probability;
      far_[end] -= v.probability;
      hits_[begin] += 1.0F;
      hits_[end] -= 1.0F;
      if (!is_near) continue;
      near_[begin] += v.probability;
      near_[end] -= v.probability;
    }
  }
}

LineSupport::Support LineSupport::best() const {
  float far = 0.0F;
  float near = 0.0F;
  float hits = 0.0F;
  float sum_far = 0.0F;
  float sum_near = 0.0F;
  float sum_hits = 0.0F;
  float all = 0.0F;
  for (std::size_t b = 0; b < kBins; ++b) {
    sum_far += far_[b];
    sum_near += near_[b];
    sum_hits += hits_[b];
    far = std::max(far, sum_far);
    near = std::max(near, sum_near);
    hits = std::max(hits, sum_hits);
    all += sum_hits;
  }
  const float mean = all / static_cast<float>(kBins);
  Support support;
  support.far = far / static_cast<float>(std::max(1, far_lines_));
  support.near = near / static_cast<float>(std::max(1, near_lines_));
  support.hits = hits / static_cast<float>(std::max(1, far_lines_));
  support.stand = fast_log2((1.0F + hits) / (1.0F + mean));
  return support;
}

}  // namespace striper::detail
