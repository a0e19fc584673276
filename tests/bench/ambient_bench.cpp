// SPDX-License-Identifier: Apache-2.0
// What it costs to subtract daylight, a scan: the pass that looks for candidates over one image
// (`plain`) and over lit - dark (`fused`), the ambient stage alone (pairs, interpolation, motion,
// blind spots; `unknown`: the source does not know what is lit, so that the pattern is checked) and
// with the fused pass behind it, a colour difference without anything clipped and with a stripe
// that is clipped from side to side (in green and red, 2.5 times as bright in green), beside the
// sum of both images' pixels, which nothing that reads them can beat. Bytes are those of the images
// that a scan needs.
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/ambient/fields.hpp>

#include "ambient/pixels/colour_difference.hpp"
#include "stripe/candidates/block_maxima.hpp"

namespace {

using striper::AmbientStage;
using striper::Frame;
using striper::LitFrame;
using striper::StripeAxis;
using striper::detail::BlockMaxima;

constexpr int kPairs = 4;  // In turn; of the larger sizes no cache holds them.

const std::array<cv::Size, 3> kSizes{cv::Size(640, 480), cv::Size(2048, 1088),
                                     cv::Size(4096, 3000)};

// Lit and dark exposures in turn, as the source knows them to be; nothing moves, nothing saturates.
std::vector<Frame> exposures(cv::Size size, bool are_fields) {
  std::vector<Frame> all;
  cv::RNG random(1);
  for (int n = 0; n < 2 * kPairs; ++n) {
    Frame frame;
    frame.image = cv::Mat(size, CV_8UC1);
    random.fill(frame.image, cv::RNG::NORMAL, 60.0, 2.0);
    frame.sensor_size = size;
    frame.sequence = static_cast<std::uint64_t>(n);
    if (are_fields) {
      frame.sensor_size.height *= 2;
      frame.sequence /= 2;
      frame.exposures_per_picture = 2;
      frame.exposure_in_picture = n % 2;
      frame.field = n % 2 == 0 ? striper::Field::kTop : striper::Field::kBottom;
      frame.grid =
          n % 2 == 0 ? striper::PixelGrid::top_field() : striper::PixelGrid::bottom_field();
    }
    frame.illumination =
        n % 2 == 0 ? striper::Illumination::laser(0) : striper::Illumination::dark();
    all.push_back(frame);
  }
  return all;
}

cv::Size size_of(const benchmark::State& state) {
  return kSizes.at(static_cast<std::size_t>(state.range(0)));
}

void set_bytes(benchmark::State& state, int images) {
  const cv::Size size = size_of(state);
  state.SetLabel(std::to_string(size.width) + "x" + std::to_string(size.height));
  state.SetBytesProcessed(state.iterations() * images * size.area());
}

void roofline(benchmark::State& state) {
  const std::vector<Frame> all = exposures(size_of(state), false);
  std::size_t n = 0;
  for ([[maybe_unused]] auto _ : state) {
    std::uint64_t sum = 0;
    for (int image = 0; image < 2; ++image) {
      const cv::Mat& pixels = all[n++ % all.size()].image;
      const auto* const words = pixels.ptr<std::uint64_t>();
      const std::size_t count = pixels.total() / sizeof(std::uint64_t);
      for (std::size_t i = 0; i < count; ++i) sum += words[i];
    }
    benchmark::DoNotOptimize(sum);
  }
  set_bytes(state, 2);
}

// The candidates of single images, or of lit - dark.
void candidates(benchmark::State& state, bool is_fused) {
  const std::vector<Frame> all = exposures(size_of(state), false);
  BlockMaxima blocks;
  LitFrame lit;
  lit.full_scale_dn = 255;
  std::size_t n = 0;
  for ([[maybe_unused]] auto _ : state) {
    lit.lit = all[n++ % all.size()].image;
    if (is_fused) lit.dark = all[n++ % all.size()].image;
    blocks.find(lit, StripeAxis::kColumns);
  }
  set_bytes(state, is_fused ? 2 : 1);
}

// The stage for a scan, the candidate pass behind it or not.
void stage(benchmark::State& state, bool are_fields, bool with_candidates, bool is_known = true) {
  std::vector<Frame> all = exposures(size_of(state), are_fields);
  for (Frame& frame : all) {
    if (!is_known) frame.illumination = striper::Illumination::unknown();
  }
  striper::AmbientOptions options;
  options.noise = striper::NoiseModel{2.0, 0.0, 0.0};
  options.pattern = striper::IlluminationPattern::parse("0,dark");
  AmbientStage ambient(options);
  BlockMaxima blocks;
  std::size_t n = 0;
  std::size_t scans = 0;
  const auto scan_one = [&] {
    for (int exposure = 0; exposure < 2; ++exposure, ++n) {
      Frame& frame = all[n % all.size()];
      ambient.push(frame);
      frame.sequence += are_fields ? kPairs : 2 * kPairs;
      while (const LitFrame* const lit = ambient.next()) {
        if (with_candidates) blocks.find(*lit, StripeAxis::kColumns);
        ++scans;
      }
    }
  };
  for (int first = 0; first < 2 * kPairs; ++first) scan_one();
  for ([[maybe_unused]] auto _ : state) scan_one();
  if (scans + 1 < static_cast<std::size_t>(state.iterations())) state.SkipWithError("no scans");
  set_bytes(state, 2);
}

// The stripe runs across the columns.
void colour(benchmark::State& state, double line_dn) {
  const cv::Size size = size_of(state);
  LitFrame green_red;
  green_red.full_scale_dn = 255;
  green_red.lit = exposures(size, false).at(0).image;
  green_red.dark = exposures(size, false).at(1).image;
  for (int column = 0; column < size.width; ++column) {
    for (int k = -6; k <= 6; ++k) {
      const double dn = line_dn * std::exp(-0.5 * k * k / 1.7);
      const cv::Point at(column, size.height / 2 + column / 20 + k);
      auto& green = green_red.lit.at<std::uint8_t>(at);
      auto& red = green_red.dark.at<std::uint8_t>(at);
      green = cv::saturate_cast<std::uint8_t>(green + dn);
      red = cv::saturate_cast<std::uint8_t>(red + 0.4 * dn);
    }
  }
  striper::detail::ColourDifference difference;
  for ([[maybe_unused]] auto _ : state) {
    LitFrame frame = green_red;
    difference.correct(frame, StripeAxis::kColumns);
    benchmark::DoNotOptimize(frame.dark.data);
  }
  // The other colour is read where something is clipped.
  set_bytes(state, line_dn > 255.0 ? 2 : 1);
}

BENCHMARK(roofline)->DenseRange(0, 2);
BENCHMARK_CAPTURE(candidates, plain, false)->DenseRange(0, 2);
BENCHMARK_CAPTURE(candidates, fused, true)->DenseRange(0, 2);
BENCHMARK_CAPTURE(colour, plain, 100.0)->DenseRange(0, 2);
BENCHMARK_CAPTURE(colour, clipped, 2000.0)->DenseRange(0, 2);
BENCHMARK_CAPTURE(stage, alternate, false, false)->DenseRange(0, 2);
BENCHMARK_CAPTURE(stage, alternate_unknown, false, false, false)->DenseRange(0, 2);
BENCHMARK_CAPTURE(stage, alternate_and_fused_pass, false, true)->DenseRange(0, 2);
BENCHMARK_CAPTURE(stage, fields, true, false)->DenseRange(0, 2);
BENCHMARK_CAPTURE(stage, fields_and_fused_pass, true, true)->DenseRange(0, 2);

}  // namespace

BENCHMARK_MAIN();
