// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <striper/guidance/scan_sweep.hpp>

namespace striper {
namespace {

constexpr double kNearSamples = 5.0;

struct Spot {
  double y_m;
  double intensity;
};

}  // namespace

bool sweep_of_scan(const PolarScan& scan, const GuidanceBeam& beam, BeamSweep& sweep) {
  std::vector<Spot> spots;
  for (const Return& r : scan.returns) {
    const bool is_in = r.y_m >= beam.y_right_m - 0.1 && r.y_m <= beam.y_left_m + 0.1;
    if (r.status == ReturnStatus::kOk && is_in && std::isfinite(r.intensity_dn)) {
      spots.push_back({r.y_m, static_cast<double>(r.intensity_dn)});
    }
  }
  if (spots.size() < 2) return false;
  std::vector<double> values;
  values.reserve(spots.size());
  for (const Spot& spot : spots) values.push_back(spot.intensity);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double median = *middle;
  std::sort(spots.begin(), spots.end(), [](const Spot& a, const Spot& b) { return a.y_m > b.y_m; });

  sweep.time_s = scan.time.seconds();
  sweep.beam = beam.name;
  sweep.samples.resize(static_cast<std::size_t>(beam.samples));
  const double near_m = kNearSamples * (beam.window_m(0.0) - beam.window_m(1.0));
  std::size_t next = 0;  // The first spot right of the place.
  for (std::size_t i = 0; i < sweep.samples.size(); ++i) {
    const double y_m = beam.window_m(static_cast<double>(i));
    while (next < spots.size() && spots[next].y_m > y_m) ++next;
    const bool is_between = next > 0 && next < spots.size();
    if (!is_between || spots[next - 1].y_m - spots[next].y_m > near_m) {
      sweep.samples[i] = median;
      continue;
    }
    const Spot& left = spots[next - 1];
    const Spot& right = spots[next];
    const double apart_m = left.y_m - right.y_m;
    const double share = apart_m > 0.0 ? (left.y_m - y_m) / apart_m : 0.0;
    sweep.samples[i] = left.intensity + share * (right.intensity - left.intensity);
  }
  return true;
}

}  // namespace striper
