// SPDX-License-Identifier: Apache-2.0
#include "speed_table.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include <hwy/targets.h>
#include <opencv2/core.hpp>

#include <striper/pipeline/scanner.hpp>
#include <striper/stripe/candidates.hpp>
#include <striper/stripe/extractor.hpp>

#include "keep.hpp"
#include "rivals.hpp"

namespace striper::speed {
namespace {

using Clock = std::chrono::steady_clock;
using Call = std::function<void(const cv::Mat&)>;

constexpr int kRuns = 5;
constexpr int kLatencies = 2000;
constexpr int kProbes = 8;
constexpr int kFirstFrames = 64;

double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// Median over the runs of the mean time of one call, microseconds.
double time_of(double seconds_per_run, const std::function<void(int)>& call) {
  // The first calls may do what later ones need not.
  double once = std::numeric_limits<double>::max();
  for (int n = 0; n < kProbes; ++n) {
    const Clock::time_point probe = Clock::now();
    call(n);
    once = std::min(once, std::max(0.05, microseconds_since(probe)));
  }
  const int calls = std::clamp(static_cast<int>(1e6 * seconds_per_run / once), 1, 100000);
  std::vector<double> runs;
  for (int run = 0; run < kRuns; ++run) {
    const Clock::time_point start = Clock::now();
    for (int n = 0; n < calls; ++n) call(n);
    runs.push_back(microseconds_since(start) / calls);
  }
  std::sort(runs.begin(), runs.end());
  return runs[kRuns / 2];
}

// The clone is chosen while the program is loaded, before ThreadSanitizer is there to be called.
#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__)
__attribute__((target_clones("avx512f", "avx2", "default")))
#endif
std::uint64_t
sum_of(const std::uint64_t* words, std::size_t count) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += words[i];
  return sum;
}

std::uint64_t sum_of(const cv::Mat& image) {
  const std::size_t words = image.total() * image.elemSize() / sizeof(std::uint64_t);
  return sum_of(reinterpret_cast<const std::uint64_t*>(image.data), words);
}

// A stripe on a noisy background: a curve with a step.
cv::Mat picture(cv::Size size, int bits) {
  cv::Mat light(size, CV_32F);
  cv::theRNG().state = 0x5DEECE66DULL;
  cv::randn(light, 20.0, 2.0);
  for (int u = 0; u < size.width; ++u) {
    const double v = size.height * (0.5 + 0.15 * std::sin(2.0 * CV_PI * u / size.width)) +
                     (u > size.width / 2 ? 0.04 * size.height : 0.0);
    const int first = std::max(0, static_cast<int>(v) - 12);
    const int last = std::min(size.height, static_cast<int>(v) + 12);
    for (int row = first; row < last; ++row) {
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

Frame whole_frame(const cv::Mat& image, std::uint64_t sequence) {
  Frame frame;
  frame.image = image;
  frame.bit_depth = image.depth() == CV_8U ? 8 : 12;
  frame.sensor_size = image.size();
  frame.sequence = sequence;
  return frame;
}

// The camera half a metre above a level laser plane.
StriperModel model_for(cv::Size size) {
  StriperModel model;
  model.camera = CameraModel(size.width, size.height, size.width, size.width, 0.5 * size.width,
                             0.1 * size.height);
  model.lasers.push_back({LaserPlane(Eigen::Vector3d::UnitY(), 0.5), {}, {}});
  return model;
}

ScannerOptions always_lit(const StriperModel& model) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.cadence = Cadence::parse("0");
  return options;
}

Call extraction(ExtractMethod method, StripeAxis axis) {
  ExtractOptions options;
  options.method = method;
  options.axis = axis;
  const std::shared_ptr<StripeExtractor> extractor = make_extractor(options);
  const auto stripe = std::make_shared<Stripe>();
  return [=](const cv::Mat& image) { extractor->extract(lit_frame(image), *stripe); };
}

// One size and depth: a picture, and a ring of copies of it.
class Bench {
 public:
  Bench(cv::Size size, int bits, const SpeedOptions& options)
      : options_(options), hot_(picture(size, bits)) {
    const std::size_t bytes = hot_.total() * hot_.elemSize();
    const std::size_t count = std::max<std::size_t>(2, options.ring_bytes / bytes);
    for (std::size_t n = 0; n < count; ++n) ring_.push_back(hot_.clone());
    table_.size = size;
    table_.bits = bits == 8 ? 8 : 12;
    table_.megabytes = 1e-6 * static_cast<double>(bytes);
  }

  SpeedTable run() {
    add("read roofline (sum)", [](const cv::Mat& image) { keep(sum_of(image)); });
    const double pass_us = add_candidate_passes();
    add_subtraction();
    for (const SpeedCall& part : options_.parts_of_fast) {
      add(part.name, [&](const cv::Mat& image) { part.call(lit_frame(image)); });
    }
    const double fast_us =
        add("fast, whole extraction", extraction(ExtractMethod::kFast, StripeAxis::kColumns));
    const double refined_us =
        add("refined, whole extraction", extraction(ExtractMethod::kRefined, StripeAxis::kColumns));
    table_.refined_over_fast = refined_us / fast_us;
    const cv::Mat turned = hot_.t();
    const Call rows = extraction(ExtractMethod::kRefined, StripeAxis::kRows);
    add_hot("refined, rows (picture turned)", [&](const cv::Mat& /*image*/) { rows(turned); });
    add_scanner();
    if (options_.with_rivals) add_rivals(pass_us);
    return table_;
  }

 private:
  double add_hot(const std::string& name, const Call& call) {
    if (options_.should_stop && options_.should_stop()) throw Stopped();
    const double us = time_of(options_.seconds_per_run, [&](int) { call(hot_); });
    table_.rows.push_back({name, us, std::nullopt, 1});
    return us;
  }

  double add(const std::string& name, const Call& call) {
    const double us = add_hot(name, call);
    table_.rows.back().streaming_us = time_of(options_.seconds_per_run, [&](int n) {
      call(ring_[static_cast<std::size_t>(n) % ring_.size()]);
    });
    return us;
  }

  double add_candidate_passes() {
    ChunkMaxima chunks;
    const auto find = [&](StripeAxis axis) {
      return [&chunks, axis](const cv::Mat& image) { chunks.find(lit_frame(image), axis); };
    };
    const double us = add("candidate pass, columns", find(StripeAxis::kColumns));
    add("candidate pass, rows", find(StripeAxis::kRows));
    return us;
  }

  // Two pictures at a time: what is lit and what is taken off it. Subtracting is part of the pass.
  void add_subtraction() {
    const cv::Mat hot_dark = hot_.clone();
    std::size_t next = ring_.size() / 2;
    const auto dark_of = [&](const cv::Mat& lit) -> const cv::Mat& {
      return lit.data == hot_.data ? hot_dark : ring_[next++ % ring_.size()];
    };
    add("two pictures, roofline (sum)",
        [&](const cv::Mat& lit) { keep(sum_of(lit) + sum_of(dark_of(lit))); });
    table_.rows.back().pictures = 2;
    ChunkMaxima chunks;
    add("candidate pass, lit - dark", [&](const cv::Mat& lit) {
      LitFrame frame = lit_frame(lit);
      frame.dark = dark_of(lit);
      chunks.find(frame, StripeAxis::kColumns);
    });
    table_.rows.back().pictures = 2;
  }

  void add_scanner() {
    const StriperModel model = model_for(hot_.size());
    Scanner scanner(model, always_lit(model));
    std::uint64_t sequence = 0;
    const Call process = [&](const cv::Mat& image) {
      keep(scanner.process(whole_frame(image, sequence++)));
    };
    for (int n = 0; n < kFirstFrames; ++n) {
      table_.first_frames_worst_us = std::max(table_.first_frames_worst_us, time_once(process));
    }
    table_.frames_per_s = 1e6 / add("Scanner::process, refined", process);
    measure_latencies(process);
  }

  double time_once(const Call& process) const {
    const Clock::time_point start = Clock::now();
    process(hot_);
    return microseconds_since(start);
  }

  void measure_latencies(const Call& process) {
    const int count = std::clamp(
        static_cast<int>(20.0 * options_.seconds_per_run * table_.frames_per_s), 100, kLatencies);
    std::vector<double> latencies;
    latencies.reserve(static_cast<std::size_t>(count));
    const std::uint64_t before = options_.allocations ? options_.allocations() : 0;
    for (int n = 0; n < count; ++n) latencies.push_back(time_once(process));
    if (options_.allocations) {
      table_.allocations_per_frame =
          static_cast<double>(options_.allocations() - before) / static_cast<double>(count);
    }
    std::sort(latencies.begin(), latencies.end());
    table_.latency_p50_us = latencies[latencies.size() / 2];
    table_.latency_p99_us = latencies[latencies.size() * 99 / 100];
    table_.latency_worst_us = latencies.back();
  }

  void add_rivals(double pass_us) {
    table_.argmax_over_pass = add_hot("cv::reduceArgMax", reduce_argmax) / pass_us;
    add_hot("transpose + minMaxLoc", transpose_and_search);
    add_hot("GaussianBlur 1x7 + reduceArgMax", blur_and_search);
    add_hot("Steger with OpenCV", [](const cv::Mat& image) { keep(steger(image)); });
  }

  SpeedOptions options_;
  cv::Mat hot_;
  std::vector<cv::Mat> ring_;
  SpeedTable table_;
};

}  // namespace

std::string instruction_set() {
  return hwy::TargetName(hwy::SupportedTargets() & -hwy::SupportedTargets());
}

SpeedTable measure_speed(cv::Size size, int bits, const SpeedOptions& options) {
  cv::setNumThreads(1);
  return Bench(size, bits, options).run();
}

}  // namespace striper::speed
