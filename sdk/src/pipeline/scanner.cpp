// SPDX-License-Identifier: Apache-2.0
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/core/error.hpp>
#include <striper/pipeline/expect_stripe.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/scan/scan_pool.hpp>
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

// The stripe runs the same way for every stage, the scan frame included: as the extractor is told.
template <typename Described>
Described with_axis(Described described, StripeAxis axis) {
  described.axis = axis;
  return described;
}

ScannerOptions with_cadence(ScannerOptions options, const Cadence& cadence) {
  options.ambient.cadence = cadence;
  return options;
}

// And so is the noise.
AmbientOptions ambient_options(const ScannerOptions& options) {
  AmbientOptions ambient = with_axis(options.ambient, options.stripe.axis);
  ambient.noise = options.stripe.noise;
  ambient.events = options.events;
  return ambient;
}

// What the model knows of its stripes, unless the caller knows better.
ScannerOptions with_expected_stripes(ScannerOptions options, const StriperModel& model) {
  if (!options.stripe.expected.empty()) return options;
  for (int laser = 0; laser < static_cast<int>(model.lasers.size()); ++laser) {
    options.stripe.expected.push_back(expect_stripe(model, laser, options.scan));
  }
  return options;
}

void require_lasers(const Cadence& cadence, std::size_t count) {
  for (const Illumination entry : cadence.pattern()) {
    if (!entry.is_lit() || static_cast<std::size_t>(entry.laser_index()) < count) continue;
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("the cadence '{}' fires laser {}, but the model has {} laser{}, counted "
                    "from 0",
                    cadence.to_string(), entry.laser_index(), count, count == 1 ? "" : "s"));
  }
}

// What no stage could read; empty where all is well. The stages behind rely on it.
std::string why_unreadable(const Frame& frame) {
  const cv::Mat& image = frame.image;
  if (image.empty()) return "the frame has no pixels";
  const bool is_known_type = (image.depth() == CV_8U || image.depth() == CV_16U) &&
                             (image.channels() == 1 || image.channels() == 3);
  if (!is_known_type) {
    return fmt::format("the frame has pixels of type {}; expected 1 or 3 channels of 8 or 16 bits",
                       cv::typeToString(image.type()));
  }
  if (frame.bit_depth < 8 || frame.bit_depth > 16) {
    return fmt::format("the frame has {} significant bits; expected 8 to 16", frame.bit_depth);
  }
  if (frame.is_interlaced() && image.rows < 2) return "one row is not two fields";
  return {};
}

ExtractOptions extract_options(const ScannerOptions& options) {
  ExtractOptions stripe = options.stripe;
  stripe.events = options.events;
  return stripe;
}

// So many scans in a row tell a laser that is off, or on again, from a gap in the stripe.
constexpr int kScansToTell = 3;

}  // namespace

ScannerOptions ScannerOptions::for_model(const StriperModel& model) {
  ScannerOptions options;
  options.ambient.channel = model.channel;
  options.ambient.difference_channel = model.difference_channel;
  options.ambient.lasers = static_cast<int>(model.lasers.size());
  options.stripe.axis = model.axis;
  options.stripe.noise = model.noise;
  options.stripe.near_end = near_end_of(model);
  return options;
}

struct Scanner::Stages {
  Stages(ScanProjector projector_in, const ScannerOptions& options)
      : events(options.events),
        axis(options.stripe.axis),
        ambient(ambient_options(options)),
        extractor(make_extractor(extract_options(options))),
        projector(std::move(projector_in)),
        head(options.head) {}

  bool accepts(const Frame& frame);
  std::string why_refused(const Frame& frame) const;
  void note_stripe(bool is_seen);
  ScanSpan scan_what_is_ready();
  std::shared_ptr<PolarScan> new_scan(const LitFrame& lit);
  const std::shared_ptr<const ScanFrame>& frame_of(int laser);

  EventPort events;
  StripeAxis axis;
  AmbientStage ambient;
  std::unique_ptr<StripeExtractor> extractor;
  ScanProjector projector;
  std::optional<cv::Size> model_size;  // Empty without a model.

  Stripe stripe;
  ScanPool pool;
  std::vector<std::shared_ptr<const PolarScan>> scans;  // This call's.
  std::string head;
  std::shared_ptr<const StriperModel> model;             // Null without one.
  std::vector<std::shared_ptr<const ScanFrame>> frames;  // One per laser that was seen.
  ScannerStatistics statistics;
  bool is_stripe_seen = false;  // In the last scan.
  bool is_stripe_said = true;   // As events have it.
  int scans_otherwise = 0;      // In a row.
};

// The whole product, a stage a line.
ScanSpan Scanner::process(const Frame& frame) {
  Stages& s = *stages_;
  s.scans.clear();
  ++s.statistics.frames;
  if (!s.accepts(frame)) return {};

  s.ambient.push(frame);
  return s.scan_what_is_ready();
}

ScanSpan Scanner::Stages::scan_what_is_ready() {
  while (const LitFrame* const lit = ambient.next()) {
    extractor->extract(*lit, stripe);
    const std::shared_ptr<PolarScan> scan = new_scan(*lit);
    projector.project(stripe, lit->laser, *scan);
    scans.push_back(scan);
    note_stripe(stripe.is_seen);
  }

  statistics.dark = ambient.dark_exposures();
  statistics.unpaired = ambient.unpaired_exposures();
  statistics.scans += scans.size();
  return ScanSpan(scans);
}

Scanner::Scanner(const StriperModel& model) : Scanner(model, ScannerOptions::for_model(model)) {}

Scanner::Scanner(const StriperModel& model, const SourceInfo& source)
    : Scanner(model, with_cadence(ScannerOptions::for_model(model), source.cadence)) {}

Scanner::Scanner(const StriperModel& model, const ScannerOptions& options)
    : stages_(std::make_unique<Stages>(
          ScanProjector(with_axis(model, options.stripe.axis), options.scan),
          with_expected_stripes(options, with_axis(model, options.stripe.axis)))) {
  require_lasers(options.ambient.cadence, model.lasers.size());
  stages_->model = std::make_shared<const StriperModel>(with_axis(model, options.stripe.axis));
  stages_->model_size = cv::Size(model.camera.width(), model.camera.height());
}

Scanner::Scanner(const ScannerOptions& options)
    : stages_(std::make_unique<Stages>(ScanProjector(), options)) {}

Scanner::Scanner(Scanner&&) noexcept = default;
Scanner& Scanner::operator=(Scanner&&) noexcept = default;
Scanner::~Scanner() = default;

ScanSpan Scanner::finish() {
  stages_->scans.clear();
  stages_->ambient.finish();
  return stages_->scan_what_is_ready();
}

const ScannerStatistics& Scanner::statistics() const noexcept { return stages_->statistics; }

ScanExplanation Scanner::explain(int line) const {
  if (stages_->scans.empty())
    throw Error(ErrorKind::kBadValue, "explain: the last frame gave no scan");
  return explain_return(stages_->extractor->explain(line), *stages_->scans.back());
}

ScannerStatus Scanner::status() const {
  const Stages& s = *stages_;
  return {s.head, SourceState::kStreaming, s.ambient.status(),
          s.axis, s.is_stripe_seen,        s.statistics};
}

// Says once that no stripe is seen, and once that one is seen again.
void Scanner::Stages::note_stripe(bool is_seen) {
  is_stripe_seen = is_seen;
  if (!is_seen) ++statistics.without_stripe;
  scans_otherwise = is_seen == is_stripe_said ? 0 : scans_otherwise + 1;
  if (scans_otherwise < kScansToTell) return;
  scans_otherwise = 0;
  is_stripe_said = is_seen;
  events.send(is_seen
                  ? Event("stripe_seen", "a laser's stripe is seen again")
                  : Event("no_stripe", fmt::format("no laser's stripe along {}", to_string(axis)),
                          "is the laser on, in view, along this axis and in this channel?"));
}

bool Scanner::Stages::accepts(const Frame& frame) {
  std::string reason = why_refused(frame);
  if (reason.empty()) return true;
  ++statistics.refused;
  // Of a frame that its source calls bad the source, or who reads it, has told.
  if (frame.status == FrameStatus::kOk) {
    events.send({"frame_refused", fmt::format("frame {}: {}", frame.sequence, reason)});
  }
  return false;
}

std::string Scanner::Stages::why_refused(const Frame& frame) const {
  if (frame.status != FrameStatus::kOk) {
    return frame.status_detail.empty() ? "its source says that it is bad" : frame.status_detail;
  }
  std::string reason = why_unreadable(frame);
  if (reason.empty() && model_size && frame.sensor_size != *model_size) {
    return fmt::format("the picture is of a {}x{} sensor and the model of a {}x{} one",
                       frame.sensor_size.width, frame.sensor_size.height, model_size->width,
                       model_size->height);
  }
  return reason;
}

std::shared_ptr<PolarScan> Scanner::Stages::new_scan(const LitFrame& lit) {
  std::shared_ptr<PolarScan> scan = pool.take();
  scan->frame = frame_of(lit.laser);
  scan->sequence = lit.sequence;
  scan->time = lit.time;
  scan->laser = lit.laser;
  scan->field = lit.field;
  return scan;
}

const std::shared_ptr<const ScanFrame>& Scanner::Stages::frame_of(int laser) {
  for (const auto& frame : frames) {
    if (frame->laser == laser) return frame;
  }
  return frames.emplace_back(make_scan_frame(head, laser, model));
}

}  // namespace striper
