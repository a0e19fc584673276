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

#include "pipeline/frame_part.hpp"
#include "pipeline/stripe_bracket.hpp"

namespace striper {
namespace {

// Which end of a scan line through the image's middle sees the laser plane nearer: where the
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

ScannerOptions with_pattern(ScannerOptions options, const IlluminationPattern& pattern) {
  options.ambient.pattern = pattern;
  return options;
}

// And so is the noise.
AmbientOptions ambient_options(const ScannerOptions& options) {
  AmbientOptions ambient = with_axis(options.ambient, options.stripe.axis);
  ambient.noise = options.stripe.noise;
  ambient.events = options.events;
  return ambient;
}

ScannerOptions with_mask(ScannerOptions options, const StriperModel* model) {
  if (!options.mask) return options;
  std::vector<ExpectedStripe>& expected = options.stripe.expected;
  if (expected.empty()) expected.resize(1);
  for (std::size_t laser = 0; laser < expected.size(); ++laser) {
    expected[laser].ignored = ignored_pixels(*options.mask, model, static_cast<int>(laser));
  }
  return options;
}

// What the model knows of its stripes, unless the caller knows better.
ScannerOptions with_expected_stripes(ScannerOptions options, const StriperModel& model) {
  std::vector<ExpectedStripe>& expected = options.stripe.expected;
  const int lasers = expected.empty() ? static_cast<int>(model.lasers.size()) : 0;
  for (int laser = 0; laser < lasers; ++laser) {
    expected.push_back(expect_stripe(model, laser, options.scan));
  }
  return with_mask(std::move(options), &model);
}

void require_region(const ScannerOptions& options, const cv::Size& sensor) {
  if (!options.region) return;
  const cv::Rect& region = *options.region;
  const cv::Rect seen = region & cv::Rect(cv::Point(0, 0), sensor);
  if (region.width > 0 && region.height > 0 && seen == region) return;
  throw Error(
      ErrorKind::kBadValue,
      fmt::format("the region {},{},{},{} is not within the model's sensor of {}x{} pixels",
                  region.x, region.y, region.width, region.height, sensor.width, sensor.height));
}

void require_lasers(const IlluminationPattern& pattern, std::size_t count) {
  for (const Illumination entry : pattern.entries()) {
    if (!entry.is_lit() || static_cast<std::size_t>(entry.laser_index()) < count) continue;
    throw Error(
        ErrorKind::kBadValue,
        fmt::format("the pattern '{}' fires laser {}, but the model has {} laser{}, counted "
                    "from 0",
                    pattern.to_string(), entry.laser_index(), count, count == 1 ? "" : "s"));
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

std::vector<std::unique_ptr<StripeExtractor>> make_extractors(const ScannerOptions& options) {
  const IlluminationPattern& pattern = options.ambient.pattern;
  const std::size_t count = pattern.is_bracket() ? pattern.entries().size() : 1;
  if (count > 1 && options.stripe.peak == PeakRule::kAll) {
    throw Error(ErrorKind::kUsage,
                fmt::format("--peak all gives no one return of a scan line, which the exposures of "
                            "laser={} are put together by - leave one of them out",
                            pattern.to_string()));
  }
  std::vector<std::unique_ptr<StripeExtractor>> extractors;
  for (std::size_t i = 0; i < count; ++i) {
    extractors.push_back(make_extractor(extract_options(options)));
  }
  return extractors;
}

// So many scans in a row tell a laser that is off, or on again, from a gap in the stripe.
constexpr int kScansToTell = 3;

}  // namespace

ScannerOptions ScannerOptions::for_model(const StriperModel& model) {
  return for_model(model, ScannerOptions());
}

ScannerOptions ScannerOptions::for_model(const StriperModel& model, ScannerOptions asked) {
  AmbientOptions& ambient = asked.ambient;
  if (!ambient.channel.is_asked() && !ambient.difference_channel) {
    ambient.difference_channel = model.difference_channel;
  }
  ambient.channel.give_way_to(model.channel);
  if (ambient.lasers == 0) ambient.lasers = static_cast<int>(model.lasers.size());
  ExtractOptions& stripe = asked.stripe;
  stripe.axis.give_way_to(model.axis);
  stripe.near_end.give_way_to(near_end_of(with_axis(model, stripe.axis)));
  if (!stripe.noise) stripe.noise = model.noise;
  return asked;
}

struct Scanner::Stages {
  Stages(ScanProjector projector_in, const ScannerOptions& options)
      : events(options.events),
        axis(options.stripe.axis),
        ambient(ambient_options(options)),
        extractors(make_extractors(options)),
        projector(std::move(projector_in)),
        region(options.region),
        head(options.head) {
    if (options.ambient.pattern.is_bracket()) bracket.emplace(options.ambient.pattern);
  }

  static std::unique_ptr<Stages> with(const StriperModel& model, const ScannerOptions& options);

  bool accepts(const Frame& frame);
  std::string why_refused(const Frame& frame) const;
  void note_stripe(bool is_seen);
  ScanSpan scan_what_is_ready(bool is_last = false);
  void find_stripe(const LitFrame& lit);
  void scan_bracket();
  void add_scan(const LitFrame& lit, const Stripe& found);
  std::shared_ptr<PolarScan> new_scan(const LitFrame& lit);
  const std::shared_ptr<const ScanFrame>& frame_of(int laser);

  EventPort events;
  StripeAxis axis;
  AmbientStage ambient;
  // One, or one for each of a laser's exposures in a bracket: what they learn differs.
  std::vector<std::unique_ptr<StripeExtractor>> extractors;
  StripeExtractor* asked = nullptr;  // The one of the last scan.
  std::optional<detail::StripeBracket> bracket;
  ScanProjector projector;
  std::optional<cv::Size> model_size;  // Empty without a model.
  std::optional<cv::Rect> region;

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

std::unique_ptr<Scanner::Stages> Scanner::Stages::with(const StriperModel& given,
                                                       const ScannerOptions& options) {
  require_region(options, {given.camera.width(), given.camera.height()});
  const auto model = std::make_shared<const StriperModel>(with_axis(given, options.stripe.axis));
  auto stages = std::make_unique<Stages>(ScanProjector(*model, options.scan),
                                         with_expected_stripes(options, *model));
  require_lasers(options.ambient.pattern, model->lasers.size());
  stages->model = model;
  stages->model_size = cv::Size(model->camera.width(), model->camera.height());
  return stages;
}

// The whole product, a stage a line.
ScanSpan Scanner::process(const Frame& frame) {
  Stages& s = *stages_;
  s.scans.clear();
  ++s.statistics.frames;
  if (!s.accepts(frame)) return {};

  if (s.region) {
    s.ambient.push(detail::part_of(frame, *s.region));
  } else {
    s.ambient.push(frame);
  }
  return s.scan_what_is_ready();
}

ScanSpan Scanner::Stages::scan_what_is_ready(bool is_last) {
  while (const LitFrame* const lit = ambient.next()) {
    find_stripe(*lit);
    if (bracket) {
      bracket->add(*lit, stripe);
      scan_bracket();
    } else {
      add_scan(*lit, stripe);
    }
  }
  if (bracket && is_last) {
    bracket->finish();
    scan_bracket();
  }

  statistics.dark = ambient.dark_exposures();
  statistics.unpaired = ambient.unpaired_exposures();
  statistics.scans += scans.size();
  statistics.lit_s = ambient.lit_s();
  return ScanSpan(scans);
}

void Scanner::Stages::find_stripe(const LitFrame& lit) {
  const std::size_t place = bracket ? bracket->place_of(lit) : 0;
  asked = extractors[place].get();
  asked->extract(lit, stripe);
}

void Scanner::Stages::scan_bracket() {
  for (const detail::BracketedStripe* const made : bracket->ready()) {
    add_scan(made->first, made->stripe);
  }
}

void Scanner::Stages::add_scan(const LitFrame& lit, const Stripe& found) {
  const std::shared_ptr<PolarScan> scan = new_scan(lit);
  projector.project(found, lit.laser, *scan);
  scans.push_back(scan);
  note_stripe(found.is_seen);
}

Scanner::Scanner(const StriperModel& model) : Scanner(model, ScannerOptions()) {}

Scanner::Scanner(const StriperModel& model, const SourceInfo& source)
    : Scanner(model, with_pattern(ScannerOptions(), source.pattern)) {}

Scanner::Scanner(const StriperModel& model, const ScannerOptions& options)
    : stages_(Stages::with(model, ScannerOptions::for_model(model, options))) {}

Scanner::Scanner(const ScannerOptions& options)
    : stages_(std::make_unique<Stages>(ScanProjector(), with_mask(options, nullptr))) {}

Scanner::Scanner(Scanner&&) noexcept = default;
Scanner& Scanner::operator=(Scanner&&) noexcept = default;
Scanner::~Scanner() = default;

ScanSpan Scanner::finish() {
  stages_->scans.clear();
  stages_->ambient.finish();
  return stages_->scan_what_is_ready(true);
}

const ScannerStatistics& Scanner::statistics() const noexcept { return stages_->statistics; }

ScanExplanation Scanner::explain(int line) const {
  if (stages_->scans.empty())
    throw Error(ErrorKind::kBadValue, "explain: the last frame gave no scan");
  return explain_return(stages_->asked->explain(line), *stages_->scans.back());
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
    return fmt::format("the image is of a {}x{} sensor and the model of a {}x{} one",
                       frame.sensor_size.width, frame.sensor_size.height, model_size->width,
                       model_size->height);
  }
  if (reason.empty() && region && detail::part_of(frame, *region).image.empty()) {
    return "it shows nothing of the region that is to be scanned";
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
