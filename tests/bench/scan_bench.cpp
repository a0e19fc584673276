// SPDX-License-Identifier: Apache-2.0
// What a return costs in the scan stage, against the straightforward triangulation of the same
// pixels and against the bare arithmetic that no scan can do without (one atan2 and one square
// root).
#include <cmath>

#include <benchmark/benchmark.h>

#include <striper/geometry/triangulator.hpp>
#include <striper/scan/scan_projector.hpp>

#include "support/models.hpp"

namespace {

using striper::Stripe;
using striper::StriperModel;

Stripe stripe_of(const StriperModel& model) {
  Stripe stripe;
  stripe.reset(model.camera.width());
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    stripe.across_px[i] = 300.0 + 100.0 * std::sin(0.02 * static_cast<double>(i));
    stripe.sigma_px[i] = 0.1F;
    stripe.status[i] = striper::ReturnStatus::kOk;
  }
  return stripe;
}

void set_time_per_return(benchmark::State& state, const Stripe& stripe) {
  state.counters["per_return"] = benchmark::Counter(
      static_cast<double>(stripe.size()) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

StriperModel model_with_covariance() {
  StriperModel model = striper::testing::typical_model();
  model.covariance = striper::testing::plausible_covariance(model);
  return model;
}

void scan_stage(benchmark::State& state, const StriperModel& model) {
  const Stripe stripe = stripe_of(model);
  striper::ScanProjector projector(model, {});
  striper::PolarScan scan;
  projector.project(stripe, 0, scan);  // Makes the tables, once in a stream.
  for ([[maybe_unused]] auto _ : state) {
    projector.project(stripe, 0, scan);
    benchmark::DoNotOptimize(scan.returns.data());
  }
  set_time_per_return(state, stripe);
}
BENCHMARK_CAPTURE(scan_stage, without_covariance, striper::testing::typical_model());
BENCHMARK_CAPTURE(scan_stage, with_covariance, model_with_covariance());

void exact_triangulation(benchmark::State& state) {
  const StriperModel model = striper::testing::typical_model();
  const Stripe stripe = stripe_of(model);
  const striper::Triangulator triangulator(model, 0);
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      for (const double shift : {-0.5, 0.0, 0.5}) {
        benchmark::DoNotOptimize(
            triangulator.triangulate({stripe.u_px(i), stripe.v_px(i) + shift}));
      }
    }
  }
  set_time_per_return(state, stripe);
}
BENCHMARK(exact_triangulation);

void atan2_and_square_root(benchmark::State& state) {
  const Stripe stripe = stripe_of(striper::testing::typical_model());
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      const double x = stripe.across_px[i];
      const double y = static_cast<double>(i);
      benchmark::DoNotOptimize(std::atan2(y, x));
      benchmark::DoNotOptimize(std::sqrt(x * x + y * y));
    }
  }
  set_time_per_return(state, stripe);
}
BENCHMARK(atan2_and_square_root);

}  // namespace

BENCHMARK_MAIN();
