// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stripe/candidates/peak_candidates.hpp"
#include "stripe/profile/profile_plan.hpp"

namespace striper::detail {

/// A measured peak of a scan line. Pixels of the image, DN.
struct Candidate {
  const PeakList* list = nullptr;
  std::uint32_t at = 0;  // In that list.
  std::int32_t line = 0;
  float across = 0.0F;
  float sigma = 0.0F;  // Of `across`.
  float amplitude = 0.0F;
  float width = 0.0F;  // Effective sigma; of a clipped peak it tells nothing.
  float snr = 0.0F;
  float tilt = 0.0F;  // What the background rises by over a width, in amplitudes.
  bool is_clipped = false;
};

/// How a candidate goes on from the one before it in its piece.
struct Link {
  std::int32_t before = -1;  // Candidate.
  std::int32_t piece = -1;
  float bend = 0.0F;  // By how much the stripe's direction changed there, pixels per scan line;
  float bend_variance = 0.0F;  // 0: there are not two candidates before it.
  float slope = 0.0F;          // Of the piece so far, pixels per scan line.
  std::int32_t count = 1;      // Candidates of the piece so far.
};

/// How far a candidate lies off the straight line through the candidates two and eight before and
/// after it in its piece, pixels; 0 where there are none.
struct OffLine {
  float near = 0.0F;
  float far = 0.0F;
};

/// Candidates of successive scan lines that continue one another: what one surface, or one thing of
/// the background, shows.
struct Piece {
  std::int32_t first_line = 0;
  std::int32_t last_line = 0;
  std::int32_t first = 0;  // Candidate.
  std::int32_t last = 0;
  std::int32_t count = 0;
  std::int32_t before = -1;  // The piece that this one goes on from, beyond a gap; -1: none.
  std::int32_t support = 0;  // Candidates of all pieces that go on from one another.
};

/// Which candidates may be the stripe, and which of them continue one another.
///
/// From scan line to scan line a piece moves by at most three pixels, and its height and width
/// change little; it bridges up to two scan lines that do not show it. Each candidate continues the
/// nearest one that no nearer candidate continues. Beyond a wider gap a piece goes on from another
/// where a straight line joins them: a wall on both sides of a post. 10 ns a candidate; no
/// allocation after the first frame of a size.
class StripePieces {
 public:
  /// @param threshold which significance a candidate must have.
  void find(const PeakCandidates& candidates, const WidthModel& width, float threshold);

  /// Adds what `off_line` says, which a plain frame does not need.
  void measure_off_line();

  std::size_t size() const noexcept { return candidates_.size(); }
  /// How many candidates and pieces a frame of this size can have.
  std::size_t most() const noexcept { return candidates_.capacity(); }
  const Candidate& candidate(std::size_t i) const noexcept { return candidates_[i]; }
  const Link& link(std::size_t i) const noexcept { return links_[i]; }
  /// Precondition: `measure_off_line` since the last `find`.
  const OffLine& off_line(std::size_t i) const noexcept { return off_line_[i]; }
  const std::vector<Piece>& pieces() const noexcept { return pieces_; }

  int lines() const noexcept { return static_cast<int>(first_of_line_.size()) - 1; }
  /// Candidates of a scan line: from first_of(line) to before first_of(line + 1).
  std::size_t first_of(int line) const noexcept {
    return first_of_line_[static_cast<std::size_t>(line)];
  }

 private:
  void gather(const PeakCandidates& candidates, const WidthModel& width, float threshold);
  void add(const PeakList& list, std::size_t at, const WidthModel& width, float threshold);
  void link_line(int line);
  void link_candidate(std::size_t i);
  bool take_predecessor(std::size_t i);
  float distance_between(std::size_t p, const Candidate& own, float gap) const;
  void bend_at(std::size_t i);
  // Candidates 2, 4, 8 and 16 before one.
  using Jumps = std::array<std::int32_t, 4>;
  Jumps jumps_from(std::size_t i) const;
  float off(std::int32_t middle, std::int32_t before, std::int32_t after) const;
  void number_pieces();
  void join_pieces();
  bool goes_on(const Piece& from, const Piece& to, float& apart) const;
  float slope_before(std::int32_t candidate) const;
  float slope_after(std::int32_t candidate) const;

  std::vector<Candidate> candidates_;  // In order of scan lines.
  std::vector<std::uint32_t> first_of_line_;
  std::vector<Link> links_;
  std::vector<OffLine> off_line_;
  std::vector<Jumps> jumps_;
  std::vector<std::int32_t> next_;    // Candidate that continues each, -1: none.
  std::vector<float> next_distance_;  // And how far off it is.
  std::vector<Piece> pieces_;
};

}  // namespace striper::detail
