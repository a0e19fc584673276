// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <striper/road/road_drive.hpp>

#include "light/random.hpp"
#include "road/road_course.hpp"
#include "road/road_paint.hpp"

namespace striper {
namespace {

enum Purpose : std::uint64_t { kSampleNoise = 11, kYawNoise, kTapeNoise };

bool is_within(const std::vector<RoadStretch>& stretches, double along_m) {
  return std::any_of(stretches.begin(), stretches.end(), [&](const RoadStretch& one) {
    return along_m >= one.from_m && along_m < one.to_m;
  });
}

// The truck as it is, not as its file has it.
Road misaligned(Road road) {
  for (GuidanceBeam& beam : road.truck.beams) {
    for (const RoadMisalignment& one : road.misaligned) {
      if (one.beam != beam.name) continue;
      beam.zero_m = one.zero_m;
      beam.scale = one.scale;
    }
  }
  return road;
}

std::int64_t wrapped(double counts, int bits) {
  const auto whole = static_cast<std::int64_t>(std::floor(counts));
  return whole & ((std::int64_t{1} << bits) - 1);
}

}  // namespace

struct RoadDrive::Impl {
  explicit Impl(const Road& how) : road(misaligned(how)), course(how), paint(how) {
    double longest_s = 0.0;
    for (const GuidanceBeam& one : road.truck.beams) longest_s = std::max(longest_s, one.sweep_s);
    end_s = course.duration_s() - longest_s;
  }

  void fill(const GuidanceBeam& beam, double time_s, BeamSweep& sweep);
  double light_at(const GuidanceBeam& beam, const detail::BesideRoad& at, double side);
  std::int64_t counts_at(double time_s) const;

  Road road;
  detail::RoadCourse course;
  detail::RoadPaint paint;
  double end_s = 0.0;
  std::uint64_t scan = 0;
  std::size_t next_beam = 0;
  std::uint64_t reading = 0;
  std::vector<detail::RoadPaint::Cut> cuts;
};

RoadDrive::RoadDrive(const Road& road) {
  road.validate();
  impl_ = std::make_unique<Impl>(road);
}
RoadDrive::RoadDrive(RoadDrive&&) noexcept = default;
RoadDrive& RoadDrive::operator=(RoadDrive&&) noexcept = default;
RoadDrive::~RoadDrive() = default;

std::int64_t RoadDrive::Impl::counts_at(double time_s) const {
  const double way_m = course.way_at_along(course.along_at_time(time_s));
  return wrapped(way_m * road.truck.odometer.counts_per_m, road.truck.odometer.bits);
}

// What a spot returns: road, paint, daylight; of which cuts hold the paint.
double RoadDrive::Impl::light_at(const GuidanceBeam& beam, const detail::BesideRoad& at,
                                 double side) {
  const RoadLight& light = road.light;
  double paint_share = 0.0;
  for (const auto& cut : cuts) {
    const double half = 0.5 * light.spot_m;
    const double covered = std::clamp((cut.left_m - at.lateral_m + half) / light.spot_m, 0.0, 1.0) -
                           std::clamp((cut.right_m - at.lateral_m + half) / light.spot_m, 0.0, 1.0);
    paint_share = std::max(paint_share, covered * cut.brightness);
  }
  const bool is_wet = is_within(road.wet, at.along_m);
  if (is_wet && beam.kind == BeamKind::kRetro) paint_share *= light.wet_share;
  const double texture = 2.0 * paint.texture(at.along_m, at.lateral_m) - 1.0;
  const double road_dn = light.road_dn * (1.0 + light.road_texture * texture);
  const double gain = 1.0 - light.fall_off * side * side;
  const double sun_dn = is_within(road.shadows, at.along_m) ? 0.0 : light.sun_dn;
  return light.dark_dn + sun_dn + gain * (road_dn + light.paint_dn * paint_share);
}

void RoadDrive::Impl::fill(const GuidanceBeam& beam, double time_s, BeamSweep& sweep) {
  sweep.time_s = time_s;
  sweep.odometer_counts = counts_at(time_s);
  sweep.beam = beam.name;
  const auto samples = static_cast<std::size_t>(beam.samples);
  sweep.samples.resize(samples);
  // Between the window's ends and its middle the way beside the road is a parabola.
  std::array<detail::BesideRoad, 3> at;
  for (std::size_t k = 0; k < 3; ++k) {
    const double index = 0.5 * static_cast<double>(k) * (beam.samples - 1);
    const double along_m = course.along_at_time(time_s + beam.delay_s(index));
    at[k] =
        course.beside(course.pose(along_m), {beam.x_m, beam.lateral_m(index)}, along_m + beam.x_m);
  }
  const double spot_m = road.light.spot_m * std::hypot(1.0, beam.x_m / beam.height_m);
  const double full = std::ldexp(1.0, beam.bits) - 1.0;
  const double middle_m = beam.lateral_m(0.5 * (beam.samples - 1));
  const double half_m = 0.5 * (beam.lateral_m(0.0) - beam.lateral_m(beam.samples - 1));
  const auto place = static_cast<std::uint64_t>(&beam - road.truck.beams.data());
  detail::PixelRandom random(road.seed, kSampleNoise + 16 * place, scan, 0);
  paint.cut(at[1].along_m, spot_m, cuts);
  double cut_at_m = at[1].along_m;
  for (std::size_t i = 0; i < samples; ++i) {
    const double y_m = beam.lateral_m(static_cast<double>(i));
    const double side = (y_m - middle_m) / half_m;  // 1 at the left end.
    const double left = 0.5 * side * (side + 1.0);
    const double middle = 1.0 - side * side;
    const double right = 0.5 * side * (side - 1.0);
    const detail::BesideRoad here{
        left * at[0].along_m + middle * at[1].along_m + right * at[2].along_m,
        left * at[0].lateral_m + middle * at[1].lateral_m + right * at[2].lateral_m};
    if (std::abs(here.along_m - cut_at_m) > 0.002) {
      paint.cut(here.along_m, spot_m, cuts);
      cut_at_m = here.along_m;
    }
    const double dn = light_at(beam, here, side) + road.light.noise_dn * random.normal();
    sweep.samples[i] = std::clamp(std::round(dn), 0.0, full);
  }
}

RoadDrive::Next RoadDrive::next(BeamSweep& sweep, OdometerReading& reading) {
  Impl& m = *impl_;
  const GuidanceConfig& truck = m.road.truck;
  const double sweep_s = static_cast<double>(m.scan) / truck.beams.front().rate_hz;
  const double reading_s = static_cast<double>(m.reading) / m.road.odometer_rate_hz;
  if (std::min(sweep_s, reading_s) > m.end_s) return Next::kEnd;
  if (reading_s <= sweep_s) {
    reading.time_s = reading_s;
    reading.counts = m.counts_at(reading_s);
    reading.yaw_rate_rad_s = std::numeric_limits<double>::quiet_NaN();
    if (std::isfinite(m.road.yaw_rate_sigma_rad_s)) {
      const double along_m = m.course.along_at_time(reading_s);
      const double speed_m_s = (distance_at(reading_s + 0.01) - distance_at(reading_s)) / 0.01;
      detail::PixelRandom random(m.road.seed, kYawNoise, m.reading, 0);
      reading.yaw_rate_rad_s = speed_m_s * m.course.curvature_of_way(along_m) +
                               m.road.yaw_rate_sigma_rad_s * random.normal();
    }
    ++m.reading;
    return Next::kOdometer;
  }
  m.fill(truck.beams[m.next_beam], sweep_s, sweep);
  if (++m.next_beam == truck.beams.size()) {
    m.next_beam = 0;
    ++m.scan;
  }
  return Next::kSweep;
}

double RoadDrive::duration_s() const noexcept { return impl_->course.duration_s(); }
double RoadDrive::way_m() const noexcept { return impl_->course.way_m(); }
double RoadDrive::time_at(double distance_m) const noexcept {
  return impl_->course.time_at_along(impl_->course.along_at_way(distance_m));
}
double RoadDrive::distance_at(double time_s) const noexcept {
  return impl_->course.way_at_along(impl_->course.along_at_time(time_s));
}

double RoadDrive::lateral_at(double distance_m, double x_m, int line) const noexcept {
  const RoadLine* const of = impl_->paint.line(line);
  return impl_->course.lateral_in_truck(impl_->course.along_at_way(distance_m), x_m,
                                        of == nullptr ? 0.0 : of->lateral_m);
}

bool RoadDrive::is_painted(double distance_m, int line) const noexcept {
  const double along_m = impl_->course.along_at_way(distance_m);
  const detail::BesideRoad at = impl_->course.beside(
      impl_->course.pose(along_m), {0.0, lateral_at(distance_m, 0.0, line)}, along_m);
  return impl_->paint.is_painted(at.along_m, line);
}

RoadTruth RoadDrive::truth_at(double distance_m) const noexcept {
  const double gun_x_m =
      impl_->road.truck.guns.empty() ? 0.0 : impl_->road.truck.guns.front().gun.x_m;
  return {distance_m, lateral_at(distance_m, gun_x_m, 0), is_painted(distance_m, 0) ? 1 : 0,
          is_painted(distance_m, 1) ? 1 : 0};
}

std::vector<TapeReading> RoadDrive::tape_readings() const {
  const RoadTape& tape = impl_->road.tape;
  std::vector<TapeReading> readings;
  if (!(tape.every_m > 0.0)) return readings;
  detail::PixelRandom random(impl_->road.seed, kTapeNoise, 0, 0);
  for (double at_m = tape.every_m; at_m < way_m(); at_m += tape.every_m) {
    for (const double x_m : tape.x_m) {
      const double lateral_m = lateral_at(at_m, x_m) + tape.sigma_m * random.normal();
      readings.push_back({time_at(at_m), x_m, lateral_m, tape.sigma_m});
    }
  }
  return readings;
}

void RoadDrive::paint(double from_m, double to_m, double lateral_m) {
  const auto beside = [&](double distance_m) {
    const double along_m = impl_->course.along_at_way(distance_m);
    return impl_->course.beside(impl_->course.pose(along_m), {0.0, lateral_m}, along_m);
  };
  const detail::BesideRoad from = beside(from_m);
  impl_->paint.paint(from.along_m, beside(to_m).along_m, from.lateral_m);
}

}  // namespace striper
