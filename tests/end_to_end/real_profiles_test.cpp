// SPDX-License-Identifier: Apache-2.0
// Proves on published images of a real stripe that what profiles stand on holds there: that the
// stripe's place on a plane follows the closed form of triangulation over known distances. The
// distances were set by hand, to a millimetre; nothing finer is proven. Skips where the images
// are absent.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <striper/capture/open_source.hpp>
#include <striper/core/robust.hpp>
#include <striper/geometry/line_fit.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/shared_data.hpp"

namespace striper {
namespace {

constexpr std::chrono::milliseconds kTimeout{1000};

// A distance from the device, and where the stripe is there: its column, about the image's middle
// row.
struct KnownPlace {
  double distance_m;
  double u_px;
};

double stripe_column(const std::string& image) {
  const auto source = open_source("images:" + image + "?laser=0");
  ScannerOptions options;
  options.stripe.axis = StripeAxis::kRows;
  options.ambient.channel = Channel::kRed;
  options.ambient.pattern = source->info().pattern;
  Scanner scanner(options);
  source->start();
  std::vector<double> columns;
  const auto keep = [&](ScanSpan scans) {
    for (const PolarScan& scan : scans)
      for (const Return& r : scan.returns)
        if (std::isfinite(r.u_px) && std::abs(r.v_px - 240.0) < 40.0) columns.push_back(r.u_px);
  };
  Frame frame;
  while (source->next(frame, kTimeout) == NextStatus::kFrame) keep(scanner.process(frame));
  keep(scanner.finish());
  EXPECT_GT(columns.size(), 40U) << image;
  return columns.empty() ? NAN : upper_median(columns);
}

// u = u0 + a / (d + d0): of each d0 a straight line in 1 / (d + d0).
struct Triangulation {
  LineFit line;
  double d0_m = 0.0;

  double distance_m(double u_px) const {
    return line.parameters[1] / (u_px - line.parameters[0]) - d0_m;
  }
};

Triangulation fit(const std::vector<KnownPlace>& places) {
  Triangulation best;
  best.line.chi2 = INFINITY;
  for (double d0_m = 0.0; d0_m < 0.2; d0_m += 1e-4) {
    LineSums sums;
    for (const KnownPlace& p : places) sums.add(1.0, 1.0 / (p.distance_m + d0_m), p.u_px, 1.0);
    const LineFit line = sums.solve();
    if (line.chi2 < best.line.chi2) best = {line, d0_m};
  }
  return best;
}

TEST(KnownDistances, SevenPredictTheOtherThree) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("b33-handheld-known-distance");
  const auto set = testing::real_data("b33-handheld-known-distance") / "cal_theta_in";
  std::vector<KnownPlace> places;
  for (int k = 1; k <= 10; ++k) {
    const int distance_cm = 28 - 2 * k;
    const auto image = set / fmt::format("dist_{:02d}_{}cm.png", k, distance_cm);
    places.push_back({0.01 * distance_cm, stripe_column(image.string())});
  }
  // Each of the inner ones is predicted from seven that do not have it.
  for (std::size_t first = 1; first < 4; ++first) {
    std::vector<KnownPlace> known;
    std::vector<KnownPlace> other;
    for (std::size_t k = 0; k < places.size(); ++k)
      (k == first || k == first + 3 || k == first + 5 ? other : known).push_back(places[k]);
    ASSERT_EQ(known.size(), 7U);
    const Triangulation model = fit(known);
    for (const KnownPlace& p : other)
      EXPECT_NEAR(model.distance_m(p.u_px), p.distance_m, 0.003) << p.distance_m;
  }
}

}  // namespace
}  // namespace striper
