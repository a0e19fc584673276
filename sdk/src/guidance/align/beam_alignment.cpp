// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/guidance/beam_alignment.hpp>
#include <striper/motion/odometer.hpp>

#include "guidance/align/alignment_solver.hpp"
#include "guidance/beam/beam_reader.hpp"

namespace striper {
namespace {

using detail::LinePlace;

constexpr std::array<std::string_view, 6> kWords{"no_tape", "not_seen", "zero",
                                                 "scale",   "tape",     "line"};

// Between two sights so far apart in time nothing is known of a beam.
constexpr double kGap_s = 0.1;

// NOLINTBEGIN(bugprone-macro-parentheses): a lambda.
#define STRIPER_CELL(member) \
  [](auto& r) -> auto& { return r.member; }
// NOLINTEND(bugprone-macro-parentheses)

constexpr std::array kTapeColumns{
    csv_column<TapeReading>("time_s", STRIPER_CELL(time_s), CsvNeed::kRequired),
    csv_column<TapeReading>("x_m", STRIPER_CELL(x_m), CsvNeed::kRequired),
    csv_column<TapeReading>("lateral_m", STRIPER_CELL(lateral_m), CsvNeed::kRequired),
    csv_column<TapeReading>("sigma_m", STRIPER_CELL(sigma_m)),
};

#undef STRIPER_CELL

// The line as one beam saw it, at the moment it met it.
struct Sight {
  double time_s;
  double seen_m;
  double sigma_m;
};

// Straight between the sights around a time.
std::optional<Sight> sight_at(const std::vector<Sight>& sights, double time_s) {
  const auto after = std::lower_bound(sights.begin(), sights.end(), time_s,
                                      [](const Sight& s, double t) { return s.time_s < t; });
  if (after == sights.begin() || after == sights.end()) return {};
  const Sight& before = *(after - 1);
  const double gap_s = after->time_s - before.time_s;
  if (!(gap_s > 0.0) || gap_s > kGap_s) return {};
  const double share = (time_s - before.time_s) / gap_s;
  return Sight{time_s, (1.0 - share) * before.seen_m + share * after->seen_m,
               (1.0 - share) * before.sigma_m + share * after->sigma_m};
}

void find_flaws(const GuidanceConfig& config, const BeamAlignmentOptions& options,
                BeamAlignment& out) {
  for (std::size_t i = 0; i < config.beams.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    const double zero_m = std::sqrt(out.covariance(at, at));
    const double scale = std::sqrt(out.covariance(at + 1, at + 1));
    const std::string& name = config.beams[i].name;
    if (zero_m > options.zero_sigma_m) {
      out.findings.push_back({AlignmentFlaw::kZero, name, zero_m, options.zero_sigma_m});
    }
    if (scale > options.scale_sigma) {
      out.findings.push_back({AlignmentFlaw::kScale, name, scale, options.scale_sigma});
    }
  }
  if (out.tape_rms > options.tape_misfit) {
    out.findings.push_back({AlignmentFlaw::kTape, {}, out.tape_rms, options.tape_misfit});
  }
  if (out.line_rms_m > options.line_misfit_m) {
    out.findings.push_back({AlignmentFlaw::kLine, {}, out.line_rms_m, options.line_misfit_m});
  }
}

// Beams as the drive has them: without what is to be found.
GuidanceConfig unaligned(GuidanceConfig config) {
  for (GuidanceBeam& beam : config.beams) {
    beam.zero_m = 0.0;
    beam.scale = 1.0;
  }
  config.alignment_covariance.clear();
  return config;
}

}  // namespace

std::string_view to_string(AlignmentFlaw flaw) noexcept {
  return kWords[static_cast<std::size_t>(flaw)];
}

std::span<const CsvColumn<TapeReading>> tape_columns() { return kTapeColumns; }

struct AlignmentDrive::Impl {
  explicit Impl(const GuidanceConfig& how) : config(unaligned(how)), odometer(how.odometer) {
    for (const GuidanceBeam& beam : config.beams) {
      readers.emplace_back(beam, config.stripe.width_m);
      beam_x_m.push_back(beam.x_m);
    }
    sights.resize(config.beams.size());
  }

  void move_to(double time_s);
  LinePlace place_at(double time_s) const;

  GuidanceConfig config;
  Odometer odometer;
  bool has_odometer = false;
  std::vector<detail::BeamReader> readers;
  std::vector<double> beam_x_m;
  std::vector<std::vector<Sight>> sights;      // Of each beam.
  std::vector<std::pair<double, double>> way;  // When, how far.
};

AlignmentDrive::AlignmentDrive(const GuidanceConfig& config) {
  config.validate();
  impl_ = std::make_unique<Impl>(config);
}
AlignmentDrive::AlignmentDrive(AlignmentDrive&&) noexcept = default;
AlignmentDrive& AlignmentDrive::operator=(AlignmentDrive&&) noexcept = default;
AlignmentDrive::~AlignmentDrive() = default;

void AlignmentDrive::Impl::move_to(double time_s) {
  const double way_m = odometer.at(time_s).distance_m;
  constexpr double kStep_m = 0.01;
  if (!std::isfinite(way_m) || (!way.empty() && way_m < way.back().second + kStep_m)) return;
  way.emplace_back(time_s, way_m);
}

void AlignmentDrive::take(const OdometerReading& reading) {
  impl_->has_odometer = true;
  impl_->odometer.update(reading);
  impl_->move_to(reading.time_s);
}

void AlignmentDrive::take(const BeamSweep& sweep) {
  Impl& m = *impl_;
  const auto& beams = m.config.beams;
  const auto found = std::find_if(beams.begin(), beams.end(), [&](const GuidanceBeam& beam) {
    return beam.name == sweep.beam;
  });
  if (found == beams.end()) return;
  if (!m.has_odometer) {
    m.odometer.update(
        {sweep.time_s, sweep.odometer_counts, std::numeric_limits<double>::quiet_NaN()});
    m.move_to(sweep.time_s);
  }
  const auto index = static_cast<std::size_t>(found - beams.begin());
  std::vector<Sight>& sights = m.sights[index];
  const double last_m = sights.empty() ? 0.0 : sights.back().seen_m;
  const detail::SeenPaint* nearest = nullptr;
  for (const detail::SeenPaint& paint : m.readers[index].read(sweep.samples)) {
    if (!paint.is_line) continue;
    const bool is_nearer = nearest == nullptr || std::abs(paint.lateral_m() - last_m) <
                                                     std::abs(nearest->lateral_m() - last_m);
    if (is_nearer) nearest = &paint;
  }
  if (nearest == nullptr) return;
  const double met_s = sweep.time_s + nearest->delay_s;
  if (!sights.empty() && met_s <= sights.back().time_s) return;
  sights.push_back({met_s, nearest->lateral_m(), nearest->sigma_m});
}

LinePlace AlignmentDrive::Impl::place_at(double time_s) const {
  LinePlace place;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const auto sight = sight_at(sights[i], time_s);
    if (sight) place.sights.push_back({i, sight->seen_m, sight->sigma_m});
  }
  return place;
}

BeamAlignment AlignmentDrive::solve(std::span<const TapeReading> tape,
                                    const BeamAlignmentOptions& options) const {
  const Impl& m = *impl_;
  BeamAlignment out;
  std::vector<LinePlace> places;
  double last_m = -std::numeric_limits<double>::infinity();
  for (const auto& [time_s, way_m] : m.way) {
    if (way_m < last_m + options.every_m) continue;
    LinePlace place = m.place_at(time_s);
    if (place.sights.size() < 3) continue;
    last_m = way_m;
    places.push_back(std::move(place));
  }
  out.places = places.size();
  // Readings of one moment are of one line.
  std::vector<TapeReading> readings(tape.begin(), tape.end());
  std::stable_sort(readings.begin(), readings.end(),
                   [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  for (std::size_t i = 0; i < readings.size();) {
    LinePlace place = m.place_at(readings[i].time_s);
    const double time_s = readings[i].time_s;
    for (; i < readings.size() && readings[i].time_s == time_s; ++i) {
      const TapeReading& one = readings[i];
      if (!std::isfinite(one.lateral_m) || !std::isfinite(one.x_m) || !(one.sigma_m > 0.0)) {
        throw Error(ErrorKind::kBadValue,
                    fmt::format("the tape reading at {} s: lateral_m {}, x_m {}, sigma_m {}; "
                                "expected numbers, sigma_m above 0",
                                one.time_s, one.lateral_m, one.x_m, one.sigma_m));
      }
      place.tapes.push_back({one.x_m, one.lateral_m, one.sigma_m});
    }
    if (place.sights.empty()) continue;
    out.tape_readings += place.tapes.size();
    places.push_back(std::move(place));
  }
  const detail::AlignmentFit fit = detail::fit_alignment(m.beam_x_m, places);
  for (Eigen::Index i = 0; i < fit.zeros_scales.size(); i += 2) {
    out.zero_m.push_back(fit.zeros_scales[i]);
    out.scale.push_back(fit.zeros_scales[i + 1]);
  }
  out.covariance = fit.covariance;
  out.tape_rms = fit.tape_rms;
  out.line_rms_m = fit.line_rms_m;
  if (out.tape_readings == 0) out.findings.push_back({AlignmentFlaw::kNoTape, {}, 0.0, 1.0});
  for (std::size_t i = 0; i < m.sights.size(); ++i) {
    if (m.sights[i].empty()) {
      out.findings.push_back({AlignmentFlaw::kNotSeen, m.config.beams[i].name, 0.0, 1.0});
    }
  }
  find_flaws(m.config, options, out);
  return out;
}

void apply(const BeamAlignment& alignment, GuidanceConfig& config) {
  for (std::size_t i = 0; i < config.beams.size(); ++i) {
    config.beams[i].zero_m = alignment.zero_m[i];
    config.beams[i].scale = alignment.scale[i];
  }
  config.alignment_covariance.assign(alignment.covariance.data(),
                                     alignment.covariance.data() + alignment.covariance.size());
}

}  // namespace striper
