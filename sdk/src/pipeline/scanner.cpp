// SPDX-License-Identifier: Apache-2.0
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/scan/scan_projector.hpp>

namespace striper {

namespace {

// Which end of a line of pixels through the picture's middle sees the laser plane nearer: where the
// ray comes down on the plane more steeply. The lens bends both ends alike.
NearEnd near_end_of(const StriperModel& model) {
  if (model.lasers.empty()) return ExtractOptions{}.near_end;
  const CameraModel& camera = model.camera;
  const bool columns = model.axis == StripeAxis::kColumns;
  const auto steepness = [&](double part) {
    const double u = (columns ? 0.5 : part) * camera.width();
    const double v = (columns ? part : 0.5) * camera.height();
    const Eigen::Vector3d ray((u - camera.cx()) / camera.fx(), (v - camera.cy()) / camera.fy(),
                              1.0);
    return model.lasers.front().plane.normal().dot(ray);
  };
  return steepness(0.0) > steepness(1.0) ? NearEnd::kFirstPixel : NearEnd::kLastPixel;
}

}  // namespace

ScannerOptions ScannerOptions::for_model(const StriperModel& model) {
  ScannerOptions options;
  options.ambient.channel = model.channel;
  options.ambient.lasers = static_cast<int>(model.lasers.size());
  options.stripe.axis = model.axis;
  options.stripe.noise = model.noise;
  options.stripe.near_end = near_end_of(model);
  return options;
}

namespace {

// The stripe runs the same way for every stage: as the extractor is told.
AmbientOptions with_axis(AmbientOptions options, StripeAxis axis) {
  options.axis = axis;
  return options;
}

}  // namespace

struct Scanner::Stages {
  Stages(ScanProjector projector_in, const ScannerOptions& options)
      : ambient(with_axis(options.ambient, options.stripe.axis)),
        extractor(make_extractor(options.stripe)),
        projector(std::move(projector_in)) {}

  bool accepts(const Frame& frame);
  std::span<const PolarScan> scan_what_is_ready();
  PolarScan& next_scan(const LitFrame& lit);

  AmbientStage ambient;
  std::unique_ptr<StripeExtractor> extractor;
  ScanProjector projector;
  std::optional<cv::Size> model_size;  // Empty without a model.

  Stripe stripe;
  std::vector<PolarScan>
      scans;  // The first scan_count are this call's; the rest keep their memory.
  std::size_t scan_count = 0;
  ScannerStatistics statistics;
  std::string refusal;
};

// The whole product, a stage a line.
std::span<const PolarScan> Scanner::process(const Frame& frame) {
  Stages& s = *stages_;
  s.scan_count = 0;
  ++s.statistics.frames;
  if (!s.accepts(frame)) return {};

  s.ambient.push(frame);
  return s.scan_what_is_ready();
}

std::span<const PolarScan> Scanner::Stages::scan_what_is_ready() {
  while (const LitFrame* const lit = ambient.next()) {
    extractor->extract(*lit, stripe);
    projector.project(stripe, lit->laser, next_scan(*lit));
  }

  statistics.dark = ambient.dark_exposures();
  statistics.unpaired = ambient.unpaired_exposures();
  statistics.scans += scan_count;
  return {scans.data(), scan_count};
}

Scanner::Scanner(const StriperModel& model) : Scanner(model, ScannerOptions::for_model(model)) {}

Scanner::Scanner(const StriperModel& model, const ScannerOptions& options)
    : stages_(std::make_unique<Stages>(ScanProjector(model, options.scan), options)) {
  stages_->model_size = cv::Size(model.camera.width(), model.camera.height());
}

Scanner::Scanner(const ScannerOptions& options)
    : stages_(std::make_unique<Stages>(ScanProjector(), options)) {}

Scanner::Scanner(Scanner&&) noexcept = default;
Scanner& Scanner::operator=(Scanner&&) noexcept = default;
Scanner::~Scanner() = default;

std::span<const PolarScan> Scanner::finish() {
  stages_->scan_count = 0;
  stages_->ambient.finish();
  return stages_->scan_what_is_ready();
}

const ScannerStatistics& Scanner::statistics() const noexcept { return stages_->statistics; }
const std::string& Scanner::last_refusal() const noexcept { return stages_->refusal; }
std::string Scanner::decisions() const { return stages_->ambient.decisions(); }

bool Scanner::Stages::accepts(const Frame& frame) {
  refusal.clear();
  if (frame.status != FrameStatus::kOk) {
    refusal = frame.status_detail;
  } else if (frame.image.empty()) {
    refusal = "the frame has no pixels";
  } else if (model_size && frame.sensor_size != *model_size) {
    refusal = fmt::format("the picture is of a {}x{} sensor and the model of a {}x{} one",
                          frame.sensor_size.width, frame.sensor_size.height, model_size->width,
                          model_size->height);
  } else {
    return true;
  }
  ++statistics.refused;
  return false;
}

PolarScan& Scanner::Stages::next_scan(const LitFrame& lit) {
  if (scan_count == scans.size()) scans.emplace_back();
  PolarScan& scan = scans[scan_count++];
  scan.sequence = lit.sequence;
  scan.time = lit.time;
  scan.laser = lit.laser;
  scan.field = lit.field;
  return scan;
}

}  // namespace striper
