// SPDX-License-Identifier: Apache-2.0
#include "capture/v4l2/interlaced_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include <opencv2/core.hpp>

#include <striper/ambient/fields.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/shared_data.hpp"
#include "v4l2/device/names.hpp"
#include "v4l2/format/pixel_format.hpp"

namespace striper::testing {
namespace {

struct Rendered {
  Frame whole;
  StriperModel model;
};

Rendered render(const Television& way) {
  constexpr int kColumns = 720;
  constexpr double kFov_deg = 55.0;
  Scene scene = load_scene(source_path("data/scenes/ntsc_grabber.yaml"));
  if (way.lines() != scene.camera.height())
    scene.camera = Scene::pinhole(kColumns, way.lines(), kFov_deg);
  scene.timing.scan = way.is_bottom_first() ? ScanMode::kBottomFirst : ScanMode::kTopFirst;
  scene.timing.picture_rate_hz = way.picture_rate_hz();
  Simulator simulator(std::move(scene));
  return {simulator.render(0), simulator.model()};
}

// Rendered once each: in an emulated machine it takes its time.
const Rendered& rendered(const Television& way) {
  static std::map<std::pair<int, bool>, Rendered> known;
  const std::pair key(way.lines(), way.is_bottom_first());
  const auto found = known.find(key);
  return found != known.end() ? found->second : known.emplace(key, render(way)).first->second;
}

// 8 bits, or the same spread over 16.
Frame as_camera_gives_it(const Frame& rendered, std::uint32_t code) {
  Frame frame = rendered;
  frame.illumination = Illumination::unknown();
  if (code == V4L2_PIX_FMT_Y16) {
    rendered.image.convertTo(frame.image, CV_16U, 256.0);
    frame.bit_depth = 16;
  }
  return frame;
}

ScannerOptions options_for(const StriperModel& model, const IlluminationPattern& pattern) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.pattern = pattern;
  return options;
}

// The last scan of a frame that comes over and over.
PolarScan scan_undisturbed(const InterlacedScene& scene) {
  Scanner scanner(scene.model, options_for(scene.model, IlluminationPattern::parse("0,dark")));
  PolarScan last;
  for (std::uint64_t number = 0; number < 4; ++number) {
    Frame frame = scene.whole;
    frame.sequence = number;
    frame.time.monotonic_ns = static_cast<std::int64_t>(number) * 2 * frame.field_period_ns;
    for (const PolarScan& scan : scanner.process(frame)) last = scan;
  }
  return last;
}

// Infinite where the scans are not the same returns.
double largest_difference_m(const PolarScan& a, const PolarScan& b) {
  constexpr double kNotTheSame = std::numeric_limits<double>::infinity();
  if (a.returns.size() != b.returns.size() || a.sequence != b.sequence) return kNotTheSame;
  double largest = 0.0;
  for (std::size_t at = 0; at < a.returns.size(); ++at) {
    const Return& x = a.returns[at];
    const Return& y = b.returns[at];
    if (x.status != y.status || std::isnan(x.range_m) != std::isnan(y.range_m)) return kNotTheSame;
    if (!std::isnan(x.range_m)) largest = std::max(largest, std::abs(x.range_m - y.range_m));
  }
  return largest;
}

// Of good returns; infinite where fewer than 500 columns are good in both.
double largest_difference_sigmas(const PolarScan& a, const PolarScan& b) {
  constexpr int kEnough = 500;
  int compared = 0;
  double largest = 0.0;
  for (std::size_t at = 0; at < std::min(a.returns.size(), b.returns.size()); ++at) {
    const Return& x = a.returns[at];
    const Return& y = b.returns[at];
    if (x.status != ReturnStatus::kOk || y.status != ReturnStatus::kOk) continue;
    ++compared;
    largest = std::max(largest, std::abs(x.range_m - y.range_m) / y.sigma_m);
  }
  return compared >= kEnough ? largest : std::numeric_limits<double>::infinity();
}

void append_lines(const cv::Mat& image, std::uint32_t code, int first, int step,
                  std::vector<std::uint8_t>& bytes) {
  constexpr std::uint8_t kNoColour = 128;
  const std::size_t count = static_cast<std::size_t>(image.cols) * image.elemSize();
  for (int row = first; row < image.rows; row += step) {
    const std::uint8_t* const from = image.ptr(row);
    for (std::size_t at = 0; at < count; ++at) {
      bytes.push_back(from[at]);
      if (code == V4L2_PIX_FMT_YUYV) bytes.push_back(kNoColour);
    }
  }
}

}  // namespace

bool Television::is_bottom_first() const noexcept {
  if (field == V4L2_FIELD_INTERLACED_TB || field == V4L2_FIELD_SEQ_TB) return false;
  if (field == V4L2_FIELD_INTERLACED_BT || field == V4L2_FIELD_SEQ_BT) return true;
  return is_525();
}

std::string Television::query() const {
  std::string text = std::string("standard=") + (is_525() ? "ntsc-m" : "pal");
  text += "&format=" + detail::v4l2::fourcc_to_string(code);
  if (field != V4L2_FIELD_INTERLACED) text += "&field=" + detail::v4l2::field_to_string(field);
  return text;
}

std::vector<Television> ways_of_television() {
  constexpr std::uint32_t kGrey = V4L2_PIX_FMT_GREY;
  constexpr v4l2_std_id kPal = V4L2_STD_PAL;
  return {
      {"grey_interlaced", kGrey, V4L2_FIELD_INTERLACED},
      {"grey_top_first", kGrey, V4L2_FIELD_INTERLACED_TB},
      {"grey_bottom_first", kGrey, V4L2_FIELD_INTERLACED_BT},
      {"grey_sequential_top_first", kGrey, V4L2_FIELD_SEQ_TB},
      {"grey_sequential_bottom_first", kGrey, V4L2_FIELD_SEQ_BT},
      {"grey_alternate", kGrey, V4L2_FIELD_ALTERNATE},
      {"yuyv_interlaced", V4L2_PIX_FMT_YUYV, V4L2_FIELD_INTERLACED},
      {"yuyv_sequential", V4L2_PIX_FMT_YUYV, V4L2_FIELD_SEQ_BT},
      {"y16_interlaced", V4L2_PIX_FMT_Y16, V4L2_FIELD_INTERLACED},
      {"y16_alternate", V4L2_PIX_FMT_Y16, V4L2_FIELD_ALTERNATE},
      {"pal_interlaced", kGrey, V4L2_FIELD_INTERLACED, kPal},
      {"pal_sequential", kGrey, V4L2_FIELD_SEQ_TB, kPal},
      {"pal_alternate", kGrey, V4L2_FIELD_ALTERNATE, kPal},
  };
}

InterlacedScene::InterlacedScene(const Television& way)
    : whole(as_camera_gives_it(rendered(way).whole, way.code)), model(rendered(way).model) {}

Frame InterlacedScene::as_if_simulated(const Frame& came) const {
  if (came.status != FrameStatus::kOk) return came;
  Frame frame = whole;
  if (!came.is_interlaced())
    frame = split_fields(whole)[static_cast<std::size_t>(came.exposure_in_picture)];
  frame.sequence = came.sequence;
  frame.time = came.time;
  return frame;
}

SideBySide::SideBySide(const InterlacedScene& scene, const IlluminationPattern& pattern)
    : scene_(scene),
      of_camera_(scene.model, options_for(scene.model, pattern)),
      of_simulator_(scene.model, options_for(scene.model, pattern)),
      undisturbed_(scan_undisturbed(scene)) {}

void SideBySide::process(const Frame& came) {
  compare(of_camera_.process(came), of_simulator_.process(scene_.as_if_simulated(came)));
}

void SideBySide::finish() { compare(of_camera_.finish(), of_simulator_.finish()); }

void SideBySide::compare(ScanSpan camera, ScanSpan simulator) {
  if (camera.size() != simulator.size()) worst_m_ = std::numeric_limits<double>::infinity();
  for (std::size_t at = 0; at < std::min(camera.size(), simulator.size()); ++at) {
    worst_m_ = std::max(worst_m_, largest_difference_m(camera[at], simulator[at]));
    worst_sigmas_ = std::max(worst_sigmas_, largest_difference_sigmas(camera[at], undisturbed_));
    scanned_.push_back(camera[at].sequence);
  }
}

int SideBySide::good_columns() const noexcept {
  return static_cast<int>(
      std::count_if(undisturbed_.returns.begin(), undisturbed_.returns.end(),
                    [](const Return& r) { return r.status == ReturnStatus::kOk; }));
}

std::vector<std::vector<std::uint8_t>> buffers_of(const cv::Mat& image, const Television& way) {
  const int first = way.is_bottom_first() ? 1 : 0;
  std::vector<std::vector<std::uint8_t>> buffers(1);
  if (way.field == V4L2_FIELD_ALTERNATE) {
    buffers.resize(2);
    append_lines(image, way.code, first, 2, buffers[0]);
    append_lines(image, way.code, 1 - first, 2, buffers[1]);
  } else if (V4L2_FIELD_IS_SEQUENTIAL(way.field)) {
    append_lines(image, way.code, first, 2, buffers[0]);
    append_lines(image, way.code, 1 - first, 2, buffers[0]);
  } else {
    append_lines(image, way.code, 0, 1, buffers[0]);
  }
  return buffers;
}

int lines_of(const Frame& frame, const cv::Mat& image) {
  if (frame.image.type() != image.type() || frame.image.cols != image.cols) return 0;
  int lines = 0;
  for (int line = 0; line < frame.image.rows; ++line) {
    const int row = static_cast<int>(frame.grid.sensor_v(line));
    if (row >= image.rows) continue;
    if (cv::norm(frame.image.row(line), image.row(row), cv::NORM_INF) == 0.0) ++lines;
  }
  return lines;
}

bool is_part_of(const Frame& frame, const cv::Mat& image) {
  return lines_of(frame, image) == frame.image.rows;
}

std::vector<std::uint64_t> frames_with_a_pair(const std::vector<Frame>& frames) {
  std::set<std::uint64_t> whole;  // Exposures.
  for (const Frame& frame : frames) {
    if (frame.status != FrameStatus::kOk) continue;
    whole.insert(frame.exposure_number());
    if (frame.is_interlaced()) whole.insert(frame.exposure_number() + 1);
  }
  std::vector<std::uint64_t> numbers;
  for (const std::uint64_t exposure : whole) {
    const bool is_lit = exposure % 2 == 0;
    const bool has_dark = whole.contains(exposure + 1) || whole.contains(exposure - 1);
    if (is_lit && has_dark) numbers.push_back(exposure / 2);
  }
  return numbers;
}

Frame without_pixels(const Frame& frame) {
  Frame bare = frame;
  bare.image.release();
  bare.lease.reset();
  return bare;
}

}  // namespace striper::testing
