// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <striper/ambient/cadence_finder.hpp>
#include <striper/core/robust.hpp>

#include "ambient/band_profiles.hpp"
#include "ambient/field_order.hpp"
#include "ambient/line_path.hpp"

namespace striper {
namespace {

// Exposures further apart than this are not compared: the scene may have moved on.
constexpr std::uint64_t kFarthestPair = 5;
constexpr int kLongestPeriod = 6;
constexpr std::uint64_t kFarthestTriple = 3;
constexpr std::size_t kLongestPeriodOfTriples = 4;
constexpr int kLeastTriples = 3;

// How much more line there must be in lit exposures than in dark ones: of what a clear line gives,
// and of what the period leaves unexplained, the more so the more freedom the period has.
constexpr double kLeastSurplus = 0.12;
double clear_of_residual(std::size_t period) { return 0.5 + 0.5 * static_cast<double>(period); }

// Where a laser's line comes and goes it explains the pictures to a few per cent, whatever passes
// by: in simulated daylight at up to 100 km/h the surplus is 0.82 and more, the rest 0.07 of it.
// Real stripes that move without ever being off leave 0.6 or less, and a third of it.
constexpr double kPlainSurplus = 0.7;
constexpr double kPlainRest = 0.15;
constexpr std::size_t kLeastForPlain = 4;

// Texture alone has lines too, if not as clear ones.
constexpr double kLineAlone = 0.85;

// Exposures between which the same line would be found again, if it were the only one.
constexpr std::uint64_t kFarthestDark = 2;

// What an exposure without the laser shows over one with it is noise and what moves: in the hardest
// of simulated daylight a quarter of a clear line, and a third of what the laser's line is.
constexpr double kLineInDark = 0.35;
constexpr double kLineInDarkOfLit = 0.55;

// A longer period must explain the pictures this much better than a shorter one.
constexpr double kBetterFit = 0.6;

// White noise, once interpolated between rows, differs by up to 2.2 times what its second
// differences say.
constexpr double kLeastMotion = 3.0;

// What moves along the road does so along the columns' bands, or the samples of rows.
constexpr detail::OrderSearch kSearchColumns{18, 4};
constexpr detail::OrderSearch kSearchRows{4, 40};
constexpr int kLeastVotes = 8;

struct Surplus {
  std::size_t i;
  std::size_t j;
  double value;
  double weight;
};

// How much each position of a period shows the line, relative to the position that shows it least.
struct PeriodFit {
  std::size_t period = 0;
  std::vector<double> level;
  double residual = 0.0;     // Mean square.
  bool is_complete = false;  // Every position was seen and compared.
};

PeriodFit fit_period(std::size_t period, const std::vector<std::uint64_t>& numbers,
                     const std::vector<Surplus>& surpluses) {
  const auto n = static_cast<Eigen::Index>(period);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const Surplus& s : surpluses) {
    const auto p = static_cast<Eigen::Index>(numbers[s.i] % period);
    const auto q = static_cast<Eigen::Index>(numbers[s.j] % period);
    if (p == q) continue;
    normal(p, p) += s.weight;
    normal(q, q) += s.weight;
    normal(p, q) -= s.weight;
    normal(q, p) -= s.weight;
    right(p) += s.weight * s.value;
    right(q) -= s.weight * s.value;
  }
  PeriodFit fit;
  fit.period = period;
  fit.is_complete = (normal.diagonal().array() > 0.0).all();
  // Levels are known up to a constant; a faint pull towards zero picks one.
  normal.diagonal().array() += 1e-6;
  const Eigen::VectorXd level = normal.ldlt().solve(right);
  fit.level.assign(level.data(), level.data() + n);
  const double least = *std::min_element(fit.level.begin(), fit.level.end());
  for (double& value : fit.level) value -= least;
  double weights = 0.0;
  for (const Surplus& s : surpluses) {
    const double expected = fit.level[numbers[s.i] % period] - fit.level[numbers[s.j] % period];
    fit.residual += s.weight * (s.value - expected) * (s.value - expected);
    weights += s.weight;
  }
  fit.residual /= std::max(1e-9, weights);
  return fit;
}

// Which exposures of a period one laser lights: bit p of `lit` for position p.
struct Pattern {
  std::size_t period = 0;
  unsigned lit = 0;

  bool is_lit(std::uint64_t number) const { return (lit >> (number % period) & 1U) != 0; }
};

// How much more line an exposure shows over one before and one after it than both over it.
struct Triple {
  std::uint64_t before;
  std::uint64_t number;
  std::uint64_t after;
  double surplus;
  double weight;

  double expected(const Pattern& pattern) const {
    const bool are_lit = pattern.is_lit(before) && pattern.is_lit(after);
    const bool are_dark = !pattern.is_lit(before) && !pattern.is_lit(after);
    if (pattern.is_lit(number)) return are_dark ? 1.0 : 0.0;
    return are_lit ? -1.0 : 0.0;
  }
};

struct PatternFit {
  Pattern pattern;
  double surplus = 0.0;
  double residual = 0.0;  // Mean square.
  int explained = 0;      // Triples in which the pattern expects a line.
};

PatternFit fit_pattern(const Pattern& pattern, const std::vector<Triple>& triples) {
  PatternFit fit;
  fit.pattern = pattern;
  double sum = 0.0;
  double weight = 0.0;
  double all = 0.0;
  for (const Triple& triple : triples) {
    const double expected = triple.expected(pattern);
    all += triple.weight;
    if (expected == 0.0) continue;
    sum += triple.weight * expected * triple.surplus;
    weight += triple.weight;
    ++fit.explained;
  }
  if (fit.explained == 0) return fit;
  fit.surplus = sum / weight;
  for (const Triple& triple : triples) {
    const double rest = triple.surplus - fit.surplus * triple.expected(pattern);
    fit.residual += triple.weight * rest * rest / all;
  }
  return fit;
}

// The shortest pattern that repeats to the same.
std::vector<Illumination> without_repetition(const std::vector<Illumination>& pattern) {
  for (std::size_t period = 1; period < pattern.size(); ++period) {
    if (pattern.size() % period != 0) continue;
    bool repeats = true;
    for (std::size_t i = period; i < pattern.size(); ++i) {
      repeats = repeats && pattern[i] == pattern[i - period];
    }
    if (repeats) return {pattern.begin(), pattern.begin() + static_cast<std::ptrdiff_t>(period)};
  }
  return pattern;
}

void trim(detail::BandProfiles& bands, int length) {
  for (cv::Mat* const profiles :
       {&bands.plain, &bands.smooth, &bands.side, &bands.interpolation_variance}) {
    if (!profiles->empty()) *profiles = profiles->colRange(0, length);
  }
}

}  // namespace

struct CadenceFinder::Profile {
  std::uint64_t number = 0;
  int exposures_per_picture = 1;
  int parity = 0;  // 1: the bottom field.
  detail::BandProfiles bands;
};

CadenceFinder::CadenceFinder(StripeAxis axis, int lasers) : axis_(axis), lasers_(lasers) {}
CadenceFinder::CadenceFinder(CadenceFinder&&) noexcept = default;
CadenceFinder& CadenceFinder::operator=(CadenceFinder&&) noexcept = default;
CadenceFinder::~CadenceFinder() = default;

std::size_t CadenceFinder::exposures() const noexcept { return profiles_.size(); }
void CadenceFinder::clear() noexcept { profiles_.clear(); }

void CadenceFinder::add(const Frame& exposure, std::uint64_t number) {
  const bool is_field = axis_ == StripeAxis::kColumns && exposure.field != Field::kProgressive;
  Profile profile;
  profile.number = number;
  profile.exposures_per_picture = exposure.exposures_per_picture;
  profile.parity = exposure.field == Field::kBottom ? 1 : 0;
  profile.bands = detail::filter_profiles(detail::band_profiles(exposure, axis_), is_field);
  if (!profiles_.empty()) {
    const cv::Size had = profiles_.front().bands.plain.size();
    const cv::Size has = profile.bands.plain.size();
    // Of the two fields of an odd number of rows one is a row longer. Pictures that differ more are
    // of another stream.
    if (has.height != had.height || std::abs(has.width - had.width) > 1) {
      profiles_.clear();
    } else if (has.width != had.width) {
      const int length = std::min(has.width, had.width);
      trim(profile.bands, length);
      for (Profile& earlier : profiles_) trim(earlier.bands, length);
    }
  }
  bands_ = profile.bands.plain.rows / exposure.image.channels();
  const bool columns = axis_ == StripeAxis::kColumns;
  most_jump_ =
      detail::LinePath::most_jump(columns ? exposure.image.cols : exposure.image.rows, bands_);
  profiles_.push_back(std::move(profile));
}

std::size_t CadenceFinder::pictures() const noexcept {
  if (profiles_.empty()) return 0;
  return profiles_.size() / static_cast<std::size_t>(profiles_.front().exposures_per_picture);
}

bool CadenceFinder::has_gaps() const noexcept {
  return !profiles_.empty() &&
         profiles_.back().number - profiles_.front().number >= profiles_.size();
}

// How much more line a shows over b than b over a, as a fraction of what a clear line gives.
CadenceFinder::Strength CadenceFinder::compare(const Profile& a, const Profile& b) const {
  const bool interpolated = a.parity != b.parity;
  const auto strength = [&](const detail::ProfilePair& pair) {
    return detail::line_strength({&pair, 1}, bands_, most_jump_) / detail::LinePath::kClear;
  };
  return {strength({a.bands, b.bands, interpolated}), strength({b.bands, a.bands, interpolated})};
}

// The same of an exposure over both of two others, and of both over it.
CadenceFinder::Strength CadenceFinder::compare(const Profile& before, const Profile& middle,
                                               const Profile& after) const {
  const auto strength = [&](const std::array<detail::ProfilePair, 2>& pairs) {
    return detail::line_strength(pairs, bands_, most_jump_) / detail::LinePath::kClear;
  };
  const bool to_before = before.parity != middle.parity;
  const bool to_after = after.parity != middle.parity;
  return {
      strength({{{middle.bands, before.bands, to_before}, {middle.bands, after.bands, to_after}}}),
      strength({{{before.bands, middle.bands, to_before}, {after.bands, middle.bands, to_after}}})};
}

CadenceFinder::Finding CadenceFinder::find() const {
  const auto is_plain = [this](const Finding& finding) {
    return profiles_.size() >= kLeastForPlain && !finding.cadence.is_automatic() &&
           finding.surplus >= kPlainSurplus && finding.residual_rms <= kPlainRest * finding.surplus;
  };
  const auto is_refuted = [&](const Finding& finding) {
    return !is_plain(finding) && shows_lines_in_dark(finding.cadence);
  };
  Finding finding = find_in_triples();
  if (finding.cadence.is_automatic() || is_refuted(finding)) finding = find_in_pairs();
  if (is_refuted(finding)) finding.cadence = {};
  finding.is_plain = is_plain(finding);
  finding.always_lit = finding.cadence.is_automatic() && every_exposure_shows_a_line();
  return finding;
}

CadenceFinder::Finding CadenceFinder::find_in_pairs() const {
  std::vector<std::uint64_t> numbers;
  for (const Profile& profile : profiles_) numbers.push_back(profile.number);
  std::vector<Surplus> surpluses;
  for (std::size_t i = 0; i < profiles_.size(); ++i) {
    for (std::size_t j = i + 1; j < profiles_.size(); ++j) {
      if (numbers[j] - numbers[i] > kFarthestPair) break;
      const Strength strength = compare(profiles_[i], profiles_[j]);
      // The longer between them, the less of the scene is the same.
      const auto distance = static_cast<double>(numbers[j] - numbers[i]);
      surpluses.push_back({i, j, strength.forth - strength.back, 1.0 / (distance * distance)});
    }
  }

  PeriodFit best;
  const std::size_t longest = std::min<std::size_t>(
      kLongestPeriod,
      profiles_.size() >= 2 * kLongestPeriod ? kLongestPeriod : profiles_.size() / 2 + 1);
  for (std::size_t period = 2; period <= longest; ++period) {
    const PeriodFit fit = fit_period(period, numbers, surpluses);
    if (!fit.is_complete) continue;
    const bool improves = best.period == 0 || fit.residual < kBetterFit * best.residual - 1e-4;
    if (improves) best = fit;
  }
  Finding finding;
  if (best.period != 0) {
    finding.surplus = *std::max_element(best.level.begin(), best.level.end());
    finding.residual_rms = std::sqrt(best.residual);
    const bool is_clear = finding.surplus > clear_of_residual(best.period) * finding.residual_rms;
    if (finding.surplus >= kLeastSurplus && is_clear) finding.cadence = pattern_of(best.level);
  }
  return finding;
}

CadenceFinder::Finding CadenceFinder::find_in_triples() const {
  std::vector<Triple> triples;
  for (std::size_t i = 0; i < profiles_.size(); ++i) {
    const Profile& middle = profiles_[i];
    for (std::size_t b = i; b-- > 0 && middle.number - profiles_[b].number <= kFarthestTriple;) {
      for (std::size_t a = i + 1; a < profiles_.size(); ++a) {
        const Profile& before = profiles_[b];
        const Profile& after = profiles_[a];
        if (after.number - middle.number > kFarthestTriple) break;
        const Strength strength = compare(before, middle, after);
        const auto span = static_cast<double>(after.number - before.number);
        triples.push_back({before.number, middle.number, after.number,
                           strength.forth - strength.back, 1.0 / (span * span)});
      }
    }
  }
  PatternFit best;
  for (std::size_t period = 2; period <= kLongestPeriodOfTriples; ++period) {
    for (unsigned lit = 1; lit + 1 < 1U << period; ++lit) {
      const PatternFit fit = fit_pattern({period, lit}, triples);
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
  std::vector<double> level;
  for (std::size_t p = 0; p < best.pattern.period; ++p) {
    level.push_back(best.pattern.is_lit(p) ? 1.0 : 0.0);
  }
  finding.cadence = pattern_of(level);
  return finding;
}

bool CadenceFinder::tells_apart(const Cadence& a, const Cadence& b) const {
  return std::any_of(profiles_.begin(), profiles_.end(), [&](const Profile& profile) {
    return a.at(profile.number).is_dark() != b.at(profile.number).is_dark();
  });
}

bool CadenceFinder::shows_lines_in_dark(const Cadence& cadence) const {
  if (cadence.is_automatic()) return false;
  Strength all;
  int pairs = 0;
  for (const Profile& dark : profiles_) {
    for (const Profile& lit : profiles_) {
      const auto distance =
          dark.number > lit.number ? dark.number - lit.number : lit.number - dark.number;
      if (distance > kFarthestDark) continue;
      if (!cadence.at(dark.number).is_dark() || !cadence.at(lit.number).is_lit()) continue;
      const Strength strength = compare(dark, lit);
      all.forth += strength.forth;
      all.back += strength.back;
      ++pairs;
    }
  }
  const double least = kLineInDark * pairs;
  return pairs > 0 && all.forth > least && all.back > least &&
         all.forth > kLineInDarkOfLit * all.back;
}

bool CadenceFinder::every_exposure_shows_a_line() const {
  return !profiles_.empty() &&
         std::all_of(profiles_.begin(), profiles_.end(), [&](const Profile& profile) {
           const cv::Mat nothing = cv::Mat::zeros(profile.bands.plain.size(), CV_32F);
           const detail::BandProfiles dark = detail::filter_profiles(nothing, false);
           const detail::ProfilePair pair{profile.bands, dark, false};
           const double strength = detail::line_strength({&pair, 1}, bands_, most_jump_);
           return strength > kLineAlone * detail::LinePath::kClear;
         });
}

Cadence CadenceFinder::pattern_of(const std::vector<double>& level) const {
  const double lit_level = 0.5 * *std::max_element(level.begin(), level.end());
  const std::size_t period = level.size();
  std::vector<Illumination> pattern(period, Illumination::dark());
  std::size_t after_dark = 0;
  for (std::size_t p = 0; p < period; ++p) {
    const bool is_lit = level[p] >= lit_level;
    if (is_lit) pattern[p] = Illumination::laser(0);
    if (is_lit && level[(p + period - 1) % period] < lit_level) after_dark = p;
  }
  if (lasers_ != 1) number_the_lasers(pattern, after_dark);
  return Cadence(without_repetition(pattern));
}

void CadenceFinder::number_the_lasers(std::vector<Illumination>& pattern,
                                      std::size_t after_dark) const {
  const std::size_t period = pattern.size();
  std::vector<std::size_t> first_of_laser;  // Position in the pattern.
  for (std::size_t k = 0; k < period; ++k) {
    const std::size_t p = (after_dark + k) % period;
    if (pattern[p].is_dark()) continue;
    const auto same =
        std::find_if(first_of_laser.begin(), first_of_laser.end(),
                     [&](std::size_t q) { return !shows_another_line(p, q, pattern); });
    pattern[p] = Illumination::laser(static_cast<int>(same - first_of_laser.begin()));
    if (same == first_of_laser.end()) first_of_laser.push_back(p);
  }
}

// Whether the exposures at position p of the period have a line where those at q have none, and the
// other way round: as strong as a line is over a dark exposure rather than as noise is.
bool CadenceFinder::shows_another_line(std::size_t p, std::size_t q,
                                       const std::vector<Illumination>& pattern) const {
  const std::size_t period = pattern.size();
  double both_ways = 0.0;
  double line = 0.0;
  double noise = 0.0;
  int lit_pairs = 0;
  int dark_pairs = 0;
  for (const Profile& a : profiles_) {
    for (const Profile& b : profiles_) {
      const auto distance = a.number > b.number ? a.number - b.number : b.number - a.number;
      if (distance == 0 || distance > kFarthestPair || a.number % period != p) continue;
      if (b.number % period == q) {
        const Strength strength = compare(a, b);
        both_ways += std::min(strength.forth, strength.back);
        ++lit_pairs;
      } else if (pattern[b.number % period].is_dark()) {
        const Strength strength = compare(a, b);
        line += strength.forth;
        noise += strength.back;
        ++dark_pairs;
      }
    }
  }
  if (lit_pairs == 0 || dark_pairs == 0) return false;
  return both_ways / lit_pairs > 0.5 * (line + noise) / dark_pairs;
}

std::optional<double> CadenceFinder::field_disorder() const {
  const detail::OrderSearch search = axis_ == StripeAxis::kColumns ? kSearchColumns : kSearchRows;
  detail::OrderVotes votes;
  std::vector<double> disorders;
  for (std::size_t i = 0; i + 2 < profiles_.size(); ++i) {
    const Profile& first = profiles_[i];
    const Profile& second = profiles_[i + 1];
    const Profile& next = profiles_[i + 2];
    const bool consecutive = second.number == first.number + 1 && next.number == first.number + 2;
    if (!consecutive || first.exposures_per_picture != 2 || first.number % 2 != 0) continue;
    const auto difference = [](const Profile& a, const Profile& b) {
      return detail::mean_square_difference(a.bands.plain, b.bands.plain);
    };
    const double moved = difference(first, next);
    const double noise = detail::white_variance_of_difference(first.bands.plain, next.bands.plain);
    if (moved <= kLeastMotion * noise || moved == 0.0) continue;
    disorders.push_back((difference(second, next) - difference(first, second)) / (moved - noise));
    const detail::OrderVotes these =
        detail::vote_on_order(first.bands.plain, second.bands.plain, next.bands.plain, search);
    votes.right += these.right;
    votes.wrong += these.wrong;
  }
  if (disorders.empty()) return std::nullopt;
  if (votes.all() >= kLeastVotes) return 2.0 * votes.wrong / votes.all();
  // Of a picture in which something comes into view, the second field is no more like one
  // neighbour than like the other: it takes most of the pictures.
  return upper_median(disorders);
}

}  // namespace striper
