// SPDX-License-Identifier: Apache-2.0
// How fast the stripe is found: the candidate pass, the whole extraction and Scanner::process
// beside the read roofline and what one would write with OpenCV, on the same pictures in the same
// run. Prints tables; each time is the median of five runs of many frames. Hot: one picture again
// and again. Streaming: pictures from a ring too large for any cache.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <hwy/targets.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/pipeline/scanner.hpp>
#include <striper/stripe/candidates.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/allocation_counter.hpp"

namespace striper {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRuns = 5;
constexpr double kSecondsPerRun = 0.06;
constexpr std::size_t kRingBytes = std::size_t{400} << 20;

double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// Median over the runs of the mean time of one call, microseconds.
double time_of(const std::function<void(int)>& call) {
  call(0);
  const Clock::time_point probe = Clock::now();
  call(1);
  const double once = std::max(0.05, microseconds_since(probe));
  const int calls = std::clamp(static_cast<int>(1e6 * kSecondsPerRun / once), 1, 100000);
  std::vector<double> runs;
  for (int run = 0; run < kRuns; ++run) {
    const Clock::time_point start = Clock::now();
    for (int n = 0; n < calls; ++n) call(n);
    runs.push_back(microseconds_since(start) / calls);
  }
  std::sort(runs.begin(), runs.end());
  return runs[kRuns / 2];
}

#if defined(__x86_64__)
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
std::uint64_t
sum_of(const std::uint64_t* words, std::size_t count) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += words[i];
  return sum;
}

// A stripe on a noisy background: a curve with a step.
cv::Mat picture(cv::Size size, int bits) {
  cv::Mat light(size, CV_32F);
  cv::randn(light, 20.0, 2.0);
  for (int u = 0; u < size.width; ++u) {
    const double v = size.height * (0.5 + 0.15 * std::sin(6.28 * u / size.width)) +
                     (u > size.width / 2 ? 20.0 : 0.0);
    for (int row = static_cast<int>(v) - 12; row < static_cast<int>(v) + 12; ++row) {
      const double x = (row - v) / 1.5;
      light.at<float>(row, u) += static_cast<float>(150.0 * std::exp(-0.5 * x * x));
    }
  }
  cv::Mat image;
  light.convertTo(image, bits == 8 ? CV_8U : CV_16U, bits == 8 ? 1.0 : 16.0);
  return image;
}

LitFrame lit_frame(const cv::Mat& image) {
  LitFrame frame;
  frame.lit = image;
  frame.full_scale_dn = image.depth() == CV_8U ? 255 : 4095;
  return frame;
}

void transpose_and_search(const cv::Mat& image) {
  cv::Mat turned;
  cv::transpose(image, turned);
  for (int line = 0; line < turned.rows; ++line) {
    cv::Point where;
    cv::minMaxLoc(turned.row(line), nullptr, nullptr, nullptr, &where);
    benchmark::DoNotOptimize(where);
  }
}

void reduce_argmax(const cv::Mat& image) {
  cv::Mat rows;
  cv::reduceArgMax(image, rows, 0);
  benchmark::DoNotOptimize(rows.data);
}

void blur_and_search(const cv::Mat& image) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {1, 7}, 0.0, 1.5);
  reduce_argmax(smooth);
}

// Steger 1998 written plainly: derivatives of the smoothed picture, the ridge where the step along
// the Hessian's strongest direction stays inside the pixel.
int steger(const cv::Mat& image) {
  cv::Mat smooth;
  image.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {0, 0}, 1.5);
  cv::Mat dx, dy, dxx, dxy, dyy;
  cv::Sobel(smooth, dx, CV_32F, 1, 0);
  cv::Sobel(smooth, dy, CV_32F, 0, 1);
  cv::Sobel(smooth, dxx, CV_32F, 2, 0);
  cv::Sobel(smooth, dxy, CV_32F, 1, 1);
  cv::Sobel(smooth, dyy, CV_32F, 0, 2);
  int points = 0;
  for (int r = 0; r < image.rows; ++r) {
    for (int c = 0; c < image.cols; ++c) {
      const float a = dxx.at<float>(r, c);
      const float b = dxy.at<float>(r, c);
      const float e = dyy.at<float>(r, c);
      const float root = std::sqrt(0.25F * (a - e) * (a - e) + b * b);
      const float lambda = 0.5F * (a + e) - root;
      if (lambda > -20.0F) continue;
      const float nx = std::abs(b) > 1e-6F ? lambda - e : (a < e ? 1.0F : 0.0F);
      const float ny = std::abs(b) > 1e-6F ? b : (a < e ? 0.0F : 1.0F);
      const float n2 = nx * nx + ny * ny;
      const float t = -(dx.at<float>(r, c) * nx + dy.at<float>(r, c) * ny) /
                      (a * nx * nx + 2.0F * b * nx * ny + e * ny * ny);
      points += std::abs(t) * std::sqrt(n2) * std::max(std::abs(nx), std::abs(ny)) <
                        0.5F * std::sqrt(n2) * 1.0F
                    ? 1
                    : 0;
    }
  }
  return points;
}

struct Row {
  std::string name;
  double hot_us;
  double streaming_us;
};

void print(const Row& row, const Row& roof, double megabytes) {
  std::printf("  %-34s %10.1f %7.1f %6.0f %%", row.name.c_str(), row.hot_us,
              megabytes / row.hot_us * 1e3, 100.0 * roof.hot_us / row.hot_us);
  if (row.streaming_us > 0.0) {
    std::printf("   %10.1f %7.1f %6.0f %%", row.streaming_us, megabytes / row.streaming_us * 1e3,
                100.0 * roof.streaming_us / row.streaming_us);
  }
  std::printf("\n");
  std::fflush(stdout);
}

// One picture and a ring of copies of it.
class Pictures {
 public:
  Pictures(cv::Size size, int bits) : first_(picture(size, bits)) {
    const std::size_t bytes = first_.total() * first_.elemSize();
    const std::size_t count = std::max<std::size_t>(2, kRingBytes / bytes);
    for (std::size_t n = 0; n < count; ++n) ring_.push_back(first_.clone());
  }
  const cv::Mat& hot() const { return first_; }
  const cv::Mat& streamed(int n) const { return ring_[static_cast<std::size_t>(n) % ring_.size()]; }

 private:
  cv::Mat first_;
  std::vector<cv::Mat> ring_;
};

Row measure(const std::string& name, const Pictures& pictures, bool streaming,
            const std::function<void(const cv::Mat&)>& call) {
  Row row{name, time_of([&](int) { call(pictures.hot()); }), 0.0};
  if (streaming) row.streaming_us = time_of([&](int n) { call(pictures.streamed(n)); });
  return row;
}

// The same for two pictures at a time: what is lit and what is taken off it.
Row measure_pairs(const std::string& name, const Pictures& pictures,
                  const std::function<void(const cv::Mat&, const cv::Mat&)>& call) {
  const cv::Mat other = pictures.hot().clone();
  Row row{name, time_of([&](int) { call(pictures.hot(), other); }), 0.0};
  row.streaming_us =
      time_of([&](int n) { call(pictures.streamed(2 * n), pictures.streamed(2 * n + 1)); });
  return row;
}

std::function<void(const cv::Mat&)> extraction(ExtractMethod method, StripeAxis axis) {
  ExtractOptions options;
  options.method = method;
  options.axis = axis;
  const std::shared_ptr<StripeExtractor> extractor = make_extractor(options);
  const auto stripe = std::make_shared<Stripe>();
  return [=](const cv::Mat& image) { extractor->extract(lit_frame(image), *stripe); };
}

Frame whole_frame(const cv::Mat& image, std::uint64_t sequence) {
  Frame frame;
  frame.image = image;
  frame.bit_depth = image.depth() == CV_8U ? 8 : 12;
  frame.sensor_size = image.size();
  frame.sequence = sequence;
  return frame;
}

StriperModel model_for(cv::Size size) {
  StriperModel model;
  model.camera = CameraModel(size.width, size.height, size.width, size.width, 0.5 * size.width,
                             0.1 * size.height);
  model.lasers.push_back({LaserPlane(Eigen::Vector3d::UnitY(), 0.5), {}, {}});
  return model;
}

void bench_scanner(const Pictures& pictures, const Row& roof, double megabytes) {
  const cv::Size size = pictures.hot().size();
  const StriperModel model = model_for(size);
  Scanner scanner(model, [&] {
    ScannerOptions options = ScannerOptions::for_model(model);
    options.ambient.cadence = Cadence::parse("0");
    return options;
  }());
  std::uint64_t sequence = 0;
  const auto process = [&](const cv::Mat& image) {
    benchmark::DoNotOptimize(scanner.process(whole_frame(image, sequence++)));
  };
  const Row row = measure("Scanner::process, refined", pictures, true, process);
  print(row, roof, megabytes);
  const testing::AllocationCounter allocations;
  std::vector<double> latencies;
  latencies.reserve(2000);
  for (int n = 0; n < 2000; ++n) {
    const Clock::time_point start = Clock::now();
    process(pictures.hot());
    latencies.push_back(microseconds_since(start));
  }
  const auto count = allocations.count();
  std::sort(latencies.begin(), latencies.end());
  std::printf("  -> %.0f frames/s; latency p50 %.1f us, p99 %.1f us; %.2f allocations a frame\n",
              1e6 / row.hot_us, latencies[1000], latencies[1980],
              static_cast<double>(count) / 2000);
}

std::uint64_t sum_of(const cv::Mat& image) {
  const std::size_t words = image.total() * image.elemSize() / 8;
  return sum_of(reinterpret_cast<const std::uint64_t*>(image.data), words);
}

// The subtraction of a dark picture is part of the candidate pass: what it costs beside the plain
// pass, for as many bytes.
void bench_subtraction(const Pictures& pictures, const Row& plain, double megabytes) {
  const Row roof = measure_pairs(
      "two-stream read roofline", pictures,
      [](const cv::Mat& a, const cv::Mat& b) { benchmark::DoNotOptimize(sum_of(a) + sum_of(b)); });
  print(roof, roof, 2.0 * megabytes);
  ChunkMaxima chunks;
  const Row pass = measure_pairs("candidate pass, lit - dark", pictures,
                                 [&](const cv::Mat& lit, const cv::Mat& dark) {
                                   LitFrame frame = lit_frame(lit);
                                   frame.dark = dark;
                                   chunks.find(frame, StripeAxis::kColumns);
                                 });
  print(pass, roof, 2.0 * megabytes);
  std::printf("  -> lit - dark / plain pass, per byte: hot %.2f, streaming %.2f\n",
              0.5 * pass.hot_us / plain.hot_us, 0.5 * pass.streaming_us / plain.streaming_us);
}

void bench(cv::Size size, int bits) {
  const Pictures pictures(size, bits);
  const double megabytes =
      1e-6 * static_cast<double>(pictures.hot().total() * pictures.hot().elemSize());
  std::printf("\n%dx%d, %d bit%35s hot us    GB/s   roof      streaming us    GB/s   roof\n",
              size.width, size.height, bits, "");
  const Row roof = measure("read roofline (sum)", pictures, true,
                           [](const cv::Mat& image) { benchmark::DoNotOptimize(sum_of(image)); });
  print(roof, roof, megabytes);
  ChunkMaxima chunks;
  const Row pass = measure("candidate pass, columns", pictures, true, [&](const cv::Mat& image) {
    chunks.find(lit_frame(image), StripeAxis::kColumns);
  });
  print(pass, roof, megabytes);
  print(measure("candidate pass, rows", pictures, true,
                [&](const cv::Mat& image) { chunks.find(lit_frame(image), StripeAxis::kRows); }),
        roof, megabytes);
  bench_subtraction(pictures, pass, megabytes);
  const Row fast = measure("fast, whole extraction", pictures, true,
                           extraction(ExtractMethod::kFast, StripeAxis::kColumns));
  print(fast, roof, megabytes);
  const Row refined = measure("refined, whole extraction", pictures, true,
                              extraction(ExtractMethod::kRefined, StripeAxis::kColumns));
  print(refined, roof, megabytes);
  const auto rows = extraction(ExtractMethod::kRefined, StripeAxis::kRows);
  const cv::Mat turned = pictures.hot().t();
  print(measure("refined, rows (picture turned)", pictures, false,
                [&](const cv::Mat& /*image*/) { rows(turned); }),
        roof, megabytes);
  bench_scanner(pictures, roof, megabytes);
  const Row argmax = measure("cv::reduceArgMax", pictures, false, reduce_argmax);
  print(argmax, roof, megabytes);
  print(measure("transpose + minMaxLoc", pictures, false, transpose_and_search), roof, megabytes);
  print(measure("GaussianBlur 1x7 + reduceArgMax", pictures, false, blur_and_search), roof,
        megabytes);
  print(measure("Steger with OpenCV", pictures, false,
                [](const cv::Mat& image) { benchmark::DoNotOptimize(steger(image)); }),
        roof, megabytes);
  std::printf("  -> cv::reduceArgMax / candidate pass %.0f; refined / fast %.2f\n",
              argmax.hot_us / pass.hot_us, refined.hot_us / fast.hot_us);
}

}  // namespace
}  // namespace striper

int main() {
  cv::setNumThreads(1);
  std::printf("instruction set: %s\n",
              hwy::TargetName(hwy::SupportedTargets() & -hwy::SupportedTargets()));
  for (const int bits : {8, 16}) {
    striper::bench({640, 480}, bits);
    striper::bench({2048, 1088}, bits);
    striper::bench({4096, 3000}, bits);
  }
  return 0;
}
