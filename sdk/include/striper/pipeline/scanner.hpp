// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core/types.hpp>

#include <striper/ambient/ambient_options.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/core/frame_source.hpp>
#include <striper/model/striper_model.hpp>
#include <striper/pipeline/scan_explanation.hpp>
#include <striper/pipeline/scan_mask.hpp>
#include <striper/pipeline/scanner_status.hpp>
#include <striper/scan/scan_options.hpp>
#include <striper/scan/scan_span.hpp>
#include <striper/stripe/extractor.hpp>

namespace striper {

/// How a Scanner works, stage by stage; each part's defaults are in its own header. What is not
/// asked for here the model says: axis, channels, noise, which end is near, how many lasers.
struct ScannerOptions {
  AmbientOptions ambient;
  ExtractOptions stripe;
  ScanOptions scan;
  /// Of the full sensor's pixels what is scanned; empty: all. Interlaced rows come in pairs.
  std::optional<cv::Rect> region;
  std::shared_ptr<const ScanMask> mask;  ///< What of it is ignored; null: nothing.
  /// Whoever reads the source for this scanner (a Head) sets its exposure by the stripe, where it
  /// can be set: see ExposureControl.
  bool adapts_exposure = false;
  std::string head{kDefaultHead};  ///< What the striper is called; its scans say so.

  /// Hears of the pattern, the stripe, refused frames and what does not fit; all stages send there.
  EventPort events;

  /// The options as a Scanner with this model takes them: what was not asked for is the model's.
  static ScannerOptions for_model(const StriperModel& model, ScannerOptions asked);
  static ScannerOptions for_model(const StriperModel& model);
};

/// Turns frames into polar scans: the whole pipeline, a stage a line (pipeline/scanner.cpp).
///
/// Where the pattern is an exposure bracket, what one laser lights in a round of it is one scan: of
/// each scan line the return with the smallest error bar of those that are not clipped: the short
/// exposure's on what is bright and the long one's on what is dark. `explain` tells of the last of
/// its exposures.
///
/// One scanner serves one stream, in order: not thread-safe, one thread at a time.
class Scanner {
 public:
  /// An axis that `options` asks for rules, for the scan frame too.
  /// @throws Error{kBadValue} where the model has no laser or lacks one that the pattern fires, the
  ///         plane has no scan frame for that axis, or an option is out of its bounds.
  explicit Scanner(const StriperModel& model);
  /// For the frames of a source, in the pattern that was given with it.
  Scanner(const StriperModel& model, const SourceInfo& source);
  Scanner(const StriperModel& model, const ScannerOptions& options);

  /// Without a model: scans carry what the image alone gives; the metric values are NaN.
  explicit Scanner(const ScannerOptions& options);

  Scanner(Scanner&&) noexcept;
  Scanner& operator=(Scanner&&) noexcept;
  ~Scanner();

  /// Processes the next frame. Usually gives one scan; none for a dark or refused frame or while
  /// frames are held until the illumination pattern is known; two for two lit fields; more when
  /// held frames are released. What is given stays valid until the next call; `ScanSpan::shared`
  /// keeps a scan for as long as one likes, in any thread. No allocation after the first frames of
  /// a stream, once scans come back as fast as they are made, but see AmbientStage. Never throws
  /// for what a frame is: one that cannot be used is refused and counted, and, unless its source
  /// had called it bad, `frame_refused` is sent.
  ScanSpan process(const Frame& frame);

  /// Gives what is still held, at the end of a stream.
  ScanSpan finish();

  const ScannerStatistics& statistics() const noexcept;

  /// Why a scan line (column or row) of the image that the last scan came from gave what it gave.
  /// For people: 5 us, allocates. Needs `options.stripe.can_explain`; of `peak = all` the element
  /// is not told.
  /// @throws Error{kBadValue} where there is no scan or no such scan line, Error{kUnsupported} for
  /// method
  ///         `paper`.
  ScanExplanation explain(int line) const;

  /// How it stands: what the stages decided by themselves (pattern, channel, method), and counts.
  ScannerStatus status() const;

 private:
  struct Stages;
  std::unique_ptr<Stages> stages_;
};

}  // namespace striper
