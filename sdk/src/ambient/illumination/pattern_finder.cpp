// SPDX-License-Identifier: Apache-2.0
#include "ambient/illumination/pattern_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>

#include "ambient/illumination/exposure_comparisons.hpp"
#include "ambient/illumination/field_order.hpp"
#include "ambient/illumination/pattern_fits.hpp"
#include "ambient/pixels/band_profiles.hpp"

namespace striper::detail {
namespace {

// Exposures further apart than this are not compared: the scene may have moved on.
constexpr std::uint64_t kFarthestPair = 5;
constexpr std::size_t kLongestPeriodOfTriples = 4;
constexpr int kLeastTriples = 3;

// How much more of a stripe there must be in lit exposures than in dark ones: of what a clear
// stripe gives, and of what the period leaves unexplained, the more so the more freedom the period
// has.
constexpr double kLeastSurplus = 0.12;
double clear_of_residual(std::size_t period) { return 0.5 + 0.5 * static_cast<double>(period); }

// Where a laser's stripe comes and goes it explains the images to a few per cent, whatever passes
// by: in simulated daylight at up to 100 km/h the surplus is 0.82 and more, the rest 0.07 of it.
// Real stripes that move without ever being off leave 0.6 or less, and a third of it.
constexpr double kPlainSurplus = 0.7;
constexpr double kPlainRest = 0.15;
constexpr std::size_t kLeastForPlain = 4;

// Texture alone has what looks like a stripe too, if not as clear.
constexpr double kLineAlone = 0.85;

// Exposures between which the same stripe would be found again, if it were the only one.
constexpr std::uint64_t kFarthestDark = 2;

// What an exposure without the laser shows over one with it is noise and what moves: in the hardest
// of simulated daylight a quarter of a clear stripe, and a third of what the laser's stripe is.
constexpr double kLineInDark = 0.35;
constexpr double kLineInDarkOfLit = 0.55;

// A longer period must explain the images this much better than a shorter one.
constexpr double kBetterFit = 0.6;

// White noise, once interpolated between rows, differs by up to 2.2 times what its second
// differences say.
constexpr double kLeastMotion = 3.0;

// What moves along the road does so along the columns' bands, or the samples of rows.
constexpr OrderSearch kSearchColumns{18, 4};
constexpr OrderSearch kSearchRows{4, 40};
constexpr int kLeastVotes = 8;

std::uint64_t apart(const ProfiledExposure& a, const ProfiledExposure& b) {
  return a.number > b.number ? a.number - b.number : b.number - a.number;
}

// The shortest pattern that repeats to the same.
std::vector<Illumination> without_repetition(const std::vector<Illumination>& entries) {
  for (std::size_t period = 1; period < entries.size(); ++period) {
    if (entries.size() % period != 0) continue;
    bool repeats = true;
    for (std::size_t i = period; i < entries.size(); ++i) {
      repeats = repeats && entries[i] == entries[i - period];
    }
    if (repeats) return {entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(period)};
  }
  return entries;
}

}  // namespace

PatternFinder::PatternFinder(StripeAxis axis, int lasers)
    : axis_(axis), lasers_(lasers), comparisons_(std::make_unique<ExposureComparisons>(axis)) {}
PatternFinder::PatternFinder(PatternFinder&&) noexcept = default;
PatternFinder& PatternFinder::operator=(PatternFinder&&) noexcept = default;
PatternFinder::~PatternFinder() = default;

std::size_t PatternFinder::exposures() const noexcept { return comparisons_->exposures().size(); }
void PatternFinder::clear() noexcept { comparisons_->clear(); }

void PatternFinder::add(const Frame& exposure, std::uint64_t number) {
  comparisons_->add(exposure, number);
}

void PatternFinder::compare() { comparisons_->compare_triples(); }

std::size_t PatternFinder::frames() const noexcept {
  const auto exposures = comparisons_->exposures();
  if (exposures.empty()) return 0;
  return exposures.size() / static_cast<std::size_t>(exposures.front().exposures_per_picture);
}

bool PatternFinder::has_gaps() const noexcept {
  const auto exposures = comparisons_->exposures();
  return !exposures.empty() &&
         exposures.back().number - exposures.front().number >= exposures.size();
}

PatternFinder::Finding PatternFinder::find() {
  const auto is_plain = [this](const Finding& finding) {
    return exposures() >= kLeastForPlain && !finding.pattern.is_automatic() &&
           finding.surplus >= kPlainSurplus && finding.residual_rms <= kPlainRest * finding.surplus;
  };
  const auto is_refuted = [&](const Finding& finding) {
    return !is_plain(finding) && shows_lines_in_dark(finding.pattern);
  };
  Finding finding = find_in_triples();
  if (finding.pattern.is_automatic() || is_refuted(finding)) finding = find_in_pairs();
  if (is_refuted(finding)) finding.pattern = {};
  finding.is_plain = is_plain(finding);
  finding.always_lit = finding.pattern.is_automatic() && every_exposure_shows_a_line();
  return finding;
}

PatternFinder::Finding PatternFinder::find_in_pairs() {
  const auto surpluses = comparisons_->pairs(kFarthestPair);
  PeriodFit best;
  const std::size_t longest = exposures() >= 2 * kLongestPeriod
                                  ? kLongestPeriod
                                  : std::min(kLongestPeriod, exposures() / 2 + 1);
  for (std::size_t period = 2; period <= longest; ++period) {
    const PeriodFit fit = fit_period(period, surpluses);
    if (!fit.is_complete) continue;
    const bool improves = best.period == 0 || fit.residual < kBetterFit * best.residual - 1e-4;
    if (improves) best = fit;
  }
  Finding finding;
  if (best.period != 0) {
    finding.surplus = best.level.maxCoeff();
    finding.residual_rms = std::sqrt(best.residual);
    const bool is_clear = finding.surplus > clear_of_residual(best.period) * finding.residual_rms;
    if (finding.surplus >= kLeastSurplus && is_clear)
      finding.pattern = pattern_of({best.level.data(), best.period});
  }
  return finding;
}

PatternFinder::Finding PatternFinder::find_in_triples() {
  comparisons_->compare_triples();
  PatternFit best;
  for (std::size_t period = 2; period <= kLongestPeriodOfTriples; ++period) {
    for (unsigned lit = 1; lit + 1 < 1U << period; ++lit) {
      const PatternFit fit = fit_pattern({period, lit}, comparisons_->triples());
      if (fit.explained < kLeastTriples) continue;
      const double better = fit.pattern.period > best.pattern.period ? kBetterFit : 1.0;
      const bool improves = best.explained == 0 || fit.residual < better * best.residual - 1e-6;
      if (improves) best = fit;
    }
  }
  Finding finding;
  if (best.explained == 0) return finding;
  finding.surplus = best.surplus;
  finding.residual_rms = std::sqrt(best.residual);
  const double clear = clear_of_residual(best.pattern.period) * finding.residual_rms;
  if (finding.surplus < kLeastSurplus || finding.surplus <= clear) return finding;
  std::array<double, kLongestPeriodOfTriples> level{};
  for (std::size_t p = 0; p < best.pattern.period; ++p) {
    level[p] = best.pattern.is_lit(p) ? 1.0 : 0.0;
  }
  finding.pattern = pattern_of({level.data(), best.pattern.period});
  return finding;
}

bool PatternFinder::tells_apart(const IlluminationPattern& a, const IlluminationPattern& b) const {
  const auto exposures = comparisons_->exposures();
  return std::any_of(exposures.begin(), exposures.end(), [&](const auto& exposure) {
    return a.at(exposure.number).is_dark() != b.at(exposure.number).is_dark();
  });
}

bool PatternFinder::shows_lines_in_dark(const IlluminationPattern& pattern) {
  if (pattern.is_automatic()) return false;
  const auto exposures = comparisons_->exposures();
  ExposureComparisons::Strength all;
  int pairs = 0;
  for (std::size_t dark = 0; dark < exposures.size(); ++dark) {
    for (std::size_t lit = 0; lit < exposures.size(); ++lit) {
      if (apart(exposures[dark], exposures[lit]) > kFarthestDark) continue;
      if (!pattern.at(exposures[dark].number).is_dark()) continue;
      if (!pattern.at(exposures[lit].number).is_lit()) continue;
      const auto strength = comparisons_->of_pair(dark, lit);
      all.forth += strength.forth;
      all.back += strength.back;
      ++pairs;
    }
  }
  const double least = kLineInDark * pairs;
  return pairs > 0 && all.forth > least && all.back > least &&
         all.forth > kLineInDarkOfLit * all.back;
}

bool PatternFinder::every_exposure_shows_a_line() {
  for (std::size_t i = 0; i < exposures(); ++i) {
    if (comparisons_->alone(i) <= kLineAlone) return false;
  }
  return exposures() > 0;
}

bool PatternFinder::newest_shows_a_line() {
  return comparisons_->alone(exposures() - 1) > kLineAlone;
}

IlluminationPattern PatternFinder::pattern_of(std::span<const double> level) {
  const double lit_level = 0.5 * *std::max_element(level.begin(), level.end());
  const std::size_t period = level.size();
  const auto is_lit = [&](std::size_t p) { return level[p % period] >= lit_level; };
  std::vector<Illumination> entries(period, Illumination::dark());
  std::size_t after_dark = 0;
  for (std::size_t p = 0; p < period; ++p) {
    if (is_lit(p)) entries[p] = Illumination::laser(0);
    if (is_lit(p) && !is_lit(p + period - 1)) after_dark = p;
  }
  if (lasers_ != 1) number_the_lasers(entries, after_dark);
  return IlluminationPattern(without_repetition(entries));
}

void PatternFinder::number_the_lasers(std::vector<Illumination>& entries, std::size_t after_dark) {
  const std::size_t period = entries.size();
  std::vector<std::size_t> first_of_laser;  // Position in the pattern.
  for (std::size_t k = 0; k < period; ++k) {
    const std::size_t p = (after_dark + k) % period;
    if (entries[p].is_dark()) continue;
    const auto same =
        std::find_if(first_of_laser.begin(), first_of_laser.end(),
                     [&](std::size_t q) { return !shows_another_line(p, q, entries); });
    entries[p] = Illumination::laser(static_cast<int>(same - first_of_laser.begin()));
    if (same == first_of_laser.end()) first_of_laser.push_back(p);
  }
}

// Whether the exposures at position p of the period have a stripe where those at q have none, and
// the other way round: as strong as a stripe is over a dark exposure rather than as noise is.
bool PatternFinder::shows_another_line(std::size_t p, std::size_t q,
                                       const std::vector<Illumination>& entries) {
  const std::size_t period = entries.size();
  const auto exposures = comparisons_->exposures();
  double both_ways = 0.0;
  double line = 0.0;
  double noise = 0.0;
  int lit_pairs = 0;
  int dark_pairs = 0;
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    for (std::size_t j = 0; j < exposures.size(); ++j) {
      if (i == j || apart(exposures[i], exposures[j]) > kFarthestPair) continue;
      const std::uint64_t position = exposures[j].number % period;
      if (exposures[i].number % period != p) continue;
      if (position == q) {
        const auto strength = comparisons_->of_pair(i, j);
        both_ways += std::min(strength.forth, strength.back);
        ++lit_pairs;
      } else if (entries[position].is_dark()) {
        const auto strength = comparisons_->of_pair(i, j);
        line += strength.forth;
        noise += strength.back;
        ++dark_pairs;
      }
    }
  }
  if (lit_pairs == 0 || dark_pairs == 0) return false;
  return both_ways / lit_pairs > 0.5 * (line + noise) / dark_pairs;
}

std::optional<double> PatternFinder::field_disorder() {
  const OrderSearch search = axis_ == StripeAxis::kColumns ? kSearchColumns : kSearchRows;
  OrderVotes votes;
  disorders_.clear();
  const auto exposures = comparisons_->exposures();
  for (std::size_t i = 0; i + 2 < exposures.size(); ++i) {
    const ProfiledExposure& first = exposures[i];
    const ProfiledExposure& second = exposures[i + 1];
    const ProfiledExposure& next = exposures[i + 2];
    const bool consecutive = second.number == first.number + 1 && next.number == first.number + 2;
    if (!consecutive || first.exposures_per_picture != 2 || first.number % 2 != 0) continue;
    const auto difference = [](const auto& a, const auto& b) {
      return mean_square_difference(a.bands.plain, b.bands.plain);
    };
    const double moved = difference(first, next);
    const double noise = comparisons_->white_variance_of(i, i + 2);
    if (moved <= kLeastMotion * noise || moved == 0.0) continue;
    disorders_.push_back((difference(second, next) - difference(first, second)) / (moved - noise));
    const OrderVotes these =
        vote_on_order(first.bands.plain, second.bands.plain, next.bands.plain, search);
    votes.right += these.right;
    votes.wrong += these.wrong;
  }
  if (disorders_.empty()) return std::nullopt;
  if (votes.all() >= kLeastVotes) return 2.0 * votes.wrong / votes.all();
  // Of a frame in which something comes into view, the second field is no more like one
  // neighbour than like the other: it takes most of the frames.
  return upper_median(disorders_);
}

}  // namespace striper::detail
