// SPDX-License-Identifier: Apache-2.0
#include "speed_table.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include <hwy/targets.h>
#include <opencv2/core.hpp>

#include <striper/core/robust.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/stripe/extractor.hpp>

#include "keep.hpp"
#include "read_roofline.hpp"
#include "rivals.hpp"
#include "stripe/candidates/block_maxima.hpp"

namespace striper::speed {
namespace {

using detail::BlockMaxima;

using Clock = std::chrono::steady_clock;
using Call = std::function<void(const cv::Mat&)>;
using Timed = std::function<void()>;

constexpr int kRuns = 5;  // At the least,
constexpr int kMostRuns = 31;
constexpr int kMostCalls = 100000;  // In a run.
constexpr int kLatencies = 2000;
constexpr int kProbes = 8;
constexpr int kFirstFrames = 64;

double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// The mean of so many calls.
double microseconds_of(int calls, const Timed& call) {
  const Clock::time_point start = Clock::now();
  for (int n = 0; n < calls; ++n) call();
  return microseconds_since(start) / calls;
}

// Times runs of `call` and of `roof` in turn, so that a clock that changes meanwhile changes both.
SpeedTime time_of(double seconds, const Timed& call, const Timed& roof, const Timed& between) {
  // The first calls may do what later ones need not.
  const auto once = [&](const Timed& timed) {
    double us = std::numeric_limits<double>::max();
    for (int n = 0; n < kProbes; ++n) {
      between();
      us = std::min(us, microseconds_of(1, timed));
    }
    return std::max(0.05, us);
  };
  const auto fitting = [](double us, double once_us, int most) {
    return std::clamp(static_cast<int>(us / once_us), 1, most);
  };
  const double run_us = 1e6 * seconds / kMostRuns;
  const double call_us = once(call);
  const int calls = fitting(run_us, call_us, kMostCalls);
  const int roof_calls = fitting(run_us, once(roof), kMostCalls);
  const int runs = std::max(kRuns, fitting(1e6 * seconds, calls * call_us, kMostRuns));
  std::vector<double> times;
  std::vector<double> ratios;
  for (int run = 0; run < runs; ++run) {
    between();
    const double roof_us = microseconds_of(roof_calls, roof);
    times.push_back(microseconds_of(calls, call));
    ratios.push_back(roof_us / times.back());
  }
  return {upper_median(times), upper_median(ratios)};
}

// A stripe on a noisy background: a curve with a step.
cv::Mat noisy_stripe(cv::Size size, int bits) {
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
  options.ambient.pattern = IlluminationPattern::parse("0");
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

// One size and depth: an image, and a ring of copies of it.
class Bench {
 public:
  Bench(cv::Size size, int bits, const SpeedOptions& options)
      : options_(options), hot_(noisy_stripe(size, bits)), hot_dark_(hot_.clone()) {
    const std::size_t bytes = hot_.total() * hot_.elemSize();
    const std::size_t count = std::max<std::size_t>(2, options.ring_bytes / bytes);
    for (std::size_t n = 0; n < count; ++n) {
      end_if_stopped();
      ring_.push_back(hot_.clone());
    }
    table_.size = size;
    table_.bits = bits == 8 ? 8 : 12;
    table_.megabytes = 1e-6 * static_cast<double>(bytes);
  }

  SpeedTable run() {
    add("read roofline (sum)", [](const cv::Mat& image) { keep(sum_of_words(image)); });
    add("sum of bytes", [](const cv::Mat& image) { keep(sum_of_bytes(image)); });
    add_candidate_passes();
    for (const SpeedCall& part : options_.parts_of_fast) {
      add(part.name, [&](const cv::Mat& image) { part.call(lit_frame(image)); });
    }
    add("fast, whole extraction", extraction(ExtractMethod::kFast, StripeAxis::kColumns));
    const double fast = of_roof();
    add("refined, whole extraction", extraction(ExtractMethod::kRefined, StripeAxis::kColumns));
    table_.refined_over_fast = fast / of_roof();
    const cv::Mat turned = hot_.t();
    const Call rows = extraction(ExtractMethod::kRefined, StripeAxis::kRows);
    add_hot("refined, rows (image turned)", [&](const cv::Mat& /*image*/) { rows(turned); });
    add_scanner();
    if (options_.with_rivals) add_rivals();
    return table_;
  }

 private:
  void add_hot(const std::string& name, const Call& call, int images = 1) {
    const SpeedTime time = time_of(
        options_.seconds_per_row, [&] { call(hot_); }, [&] { read(hot_, images); },
        [&] { end_if_stopped(); });
    table_.rows.push_back({name, time, std::nullopt, images});
  }

  // All calls take the images of the ring in turn, so that each was read long ago.
  void add(const std::string& name, const Call& call, int images = 1) {
    add_hot(name, call, images);
    table_.rows.back().streaming = time_of(
        options_.seconds_per_row, [&] { call(next_of_ring()); },
        [&] { read(next_of_ring(), images); }, [&] { end_if_stopped(); });
  }

  void end_if_stopped() const {
    if (options_.should_stop && options_.should_stop()) throw Stopped();
  }

  double of_roof() const { return table_.rows.back().hot.of_roof; }

  const cv::Mat& next_of_ring() { return ring_[next_++ % ring_.size()]; }

  // What is subtracted from a lit image.
  const cv::Mat& dark_of(const cv::Mat& lit) {
    return lit.data == hot_.data ? hot_dark_ : next_of_ring();
  }

  void read(const cv::Mat& lit, int images) {
    keep(sum_of_words(lit));
    if (images > 1) keep(sum_of_words(dark_of(lit)));
  }

  void add_candidate_passes() {
    BlockMaxima blocks;
    const auto find = [&](StripeAxis axis) {
      return [&blocks, axis](const cv::Mat& image) { blocks.find(lit_frame(image), axis); };
    };
    add("candidate pass, columns", find(StripeAxis::kColumns));
    pass_of_roof_ = of_roof();
    add("candidate pass, rows", find(StripeAxis::kRows));
    // Two images at a time: what is lit and what is subtracted from it, which is part of the
    // pass.
    add(
        "two images, roofline (sum)", [&](const cv::Mat& lit) { read(lit, 2); }, 2);
    const auto find_difference = [&](const cv::Mat& lit) {
      LitFrame frame = lit_frame(lit);
      frame.dark = dark_of(lit);
      blocks.find(frame, StripeAxis::kColumns);
    };
    add("candidate pass, lit - dark", find_difference, 2);
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
    add("Scanner::process, refined", process);
    table_.frames_per_s = 1e6 / table_.rows.back().hot.us;
    measure_latencies(process);
  }

  double time_once(const Call& process) const {
    end_if_stopped();
    const Clock::time_point start = Clock::now();
    process(hot_);
    return microseconds_since(start);
  }

  void measure_latencies(const Call& process) {
    const int count = std::clamp(
        static_cast<int>(4.0 * options_.seconds_per_row * table_.frames_per_s), 100, kLatencies);
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

  void add_rivals() {
    add_hot("cv::reduceArgMax", reduce_argmax);
    table_.argmax_over_pass = pass_of_roof_ / of_roof();
    add_hot("transpose + minMaxLoc", transpose_and_search);
    add_hot("GaussianBlur 1x7 + reduceArgMax", blur_and_search);
    add_hot("Steger with OpenCV", [](const cv::Mat& image) { keep(steger(image)); });
  }

  SpeedOptions options_;
  cv::Mat hot_, hot_dark_;
  std::vector<cv::Mat> ring_;
  std::size_t next_ = 0;  // Of the ring, forever.
  double pass_of_roof_ = 0.0;
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
