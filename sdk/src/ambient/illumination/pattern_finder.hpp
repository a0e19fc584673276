// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <striper/core/frame.hpp>
#include <striper/core/illumination_pattern.hpp>
#include <striper/core/stripe_axis.hpp>

namespace striper::detail {

class ExposureComparisons;

/// Finds out from the images themselves which exposures a laser lights.
///
/// Of two exposures the one with the laser on has a narrow bright stripe that the other lacks. What
/// else differs - noise, motion, the half row between two fields - differs both ways, so only
/// the surplus of one direction counts: how strongly a stripe that runs across the whole image
/// shows in one over the other, less how strongly one shows the other way round. An edge that moves
/// on and on makes such a stripe too, in every exposure over the earlier (or later) ones; so first
/// of all a stripe counts only if an exposure shows it over one before and one after it, or both
/// over it, and the pattern of one laser that explains these triples best is taken. Where none does
/// clearly (several lasers, a faint stripe), pairs are asked: a pattern of period P explains the
/// surplus of i over j by V(i mod P) - V(j mod P); the V follow by least squares, and the shortest
/// period that explains the images wins. What was found less than plainly does not count where
/// the exposures that would be dark show a stripe of their own over the lit ones: a stripe that
/// moves from frame to frame before a sensor in someone's hand is no dark exposure. The number of
/// the exposure, not the order of arrival, is the position, so lost frames do no harm.
///
/// Not thread-safe. Cost of six frames of 640x480: 4 ms of a desktop core (30 times one scan),
/// half of it in `add` and `compare`, of 2048x1088 20 ms. No allocation after the first six, but
/// for the pattern that is found.
class PatternFinder {
 public:
  /// So many frames are enough where none is lost; two exposures are the least.
  static constexpr std::size_t kFrames = 6;

  /// What the exposures seen so far say.
  struct Finding {
    IlluminationPattern pattern;  ///< Automatic where no dark exposure can be shown to exist.
    bool always_lit = false;      ///< Every exposure shows a clear stripe.
    bool is_plain = false;        ///< The stripe is so clear that nothing else explains the images.
    double surplus = 0.0;  ///< How much more of a stripe lit exposures show than dark ones, 0 to 1.
    double residual_rms = 0.0;  ///< What the best period leaves unexplained of it.
  };

  /// @param lasers how many there are, 0 if unknown: with one, every lit exposure is laser 0; with
  /// more, lasers are numbered in the order in which they fire after a dark exposure.
  explicit PatternFinder(StripeAxis axis, int lasers = 0);
  PatternFinder(PatternFinder&&) noexcept;
  PatternFinder& operator=(PatternFinder&&) noexcept;
  ~PatternFinder();

  /// Takes one exposure into account. @param number its place in time, gaps included.
  /// Precondition: `exposure.image` has the size and type of the first one; a field may differ by a
  /// row.
  void add(const Frame& exposure, std::uint64_t number);

  /// Compares what was added with what came before it: most of what `find` does, which would else
  /// do it all at once.
  void compare();

  std::size_t exposures() const noexcept;

  /// How many whole frames were added.
  std::size_t frames() const noexcept;

  /// Whether exposures between the first and the last one are missing.
  bool has_gaps() const noexcept;

  Finding find();

  /// Whether two patterns call another one of the exposures that were seen dark.
  bool tells_apart(const IlluminationPattern& a, const IlluminationPattern& b) const;

  /// Whether the exposures that a pattern calls dark show a stripe that its lit ones lack, and the
  /// other way round: the laser lights them all, and its stripe moves.
  bool shows_lines_in_dark(const IlluminationPattern& pattern);

  /// How wrongly the two fields of frames are ordered: near 0 where the order given is right,
  /// near 2 where it is the other way round (down to about a half where little can be told); empty
  /// where nothing moves or no fields were seen.
  ///
  /// Things that are found again in the first field of the next frame were half-way in the second
  /// field of this one; in the wrong order they were as far on the other side. Where nothing is
  /// found again, as where things move by less than a few pixels: in the right order the second
  /// field is as far in time from the next first field as from its own; in the wrong order it is
  /// three times as far.
  std::optional<double> field_disorder();

  /// Whether the exposure that was added last shows a clear stripe by itself. Precondition: there
  /// is one.
  bool newest_shows_a_line();

  void clear() noexcept;

 private:
  Finding find_in_pairs();
  Finding find_in_triples();
  bool every_exposure_shows_a_line();
  IlluminationPattern pattern_of(std::span<const double> level);
  void number_the_lasers(std::vector<Illumination>& entries, std::size_t after_dark);
  bool shows_another_line(std::size_t p, std::size_t q, const std::vector<Illumination>& entries);

  StripeAxis axis_;
  int lasers_;
  std::unique_ptr<ExposureComparisons> comparisons_;
  std::vector<double> disorders_;  // Scratch.
};

}  // namespace striper::detail
