// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cmath>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include <striper/core/error.hpp>
#include <striper/core/event.hpp>
#include <striper/core/frame.hpp>
#include <striper/images/image_source.hpp>
#include <striper/images/picture_files.hpp>

#include "capture/common_keys.hpp"
#include "capture/frame_counts.hpp"
#include "capture/frame_shapes.hpp"
#include "images/decode.hpp"
#include "images/frame_table.hpp"
#include "images/picture_numbers.hpp"

namespace striper {
namespace {

namespace fs = std::filesystem;
using detail::FrameRow;

constexpr double kNsPerSecond = 1e9;

std::vector<FrameRow> rows_of_plain_images(const std::string& pattern, double rate_hz) {
  const std::vector<fs::path> files = image_files(pattern);
  const std::vector<std::uint64_t> numbers = detail::image_numbers(files);
  std::vector<FrameRow> rows;
  for (std::size_t i = 0; i < files.size(); ++i) {
    FrameRow& row = rows.emplace_back();
    row.file = files[i].string();
    row.frame.sequence = numbers[i];
    row.frame.time.monotonic_ns =
        std::llround(static_cast<double>(row.frame.sequence) * kNsPerSecond / rate_hz);
  }
  return rows;
}

std::vector<FrameRow> rows_of_recording(const fs::path& directory, double rate_hz,
                                        const EventPort& events) {
  std::vector<FrameRow> rows = detail::read_frame_table(
      directory / detail::kFrameTableName, std::llround(kNsPerSecond / rate_hz), events);
  if (rows.empty()) {
    throw Error(ErrorKind::kNotFound,
                fmt::format("recording '{}' has no frames", directory.string()));
  }
  for (FrameRow& row : rows) {
    if (!row.file.empty()) row.file = (directory / row.file).string();
  }
  return rows;
}

// Frames a second as their times say; 0 where they do not.
double rate_of(const std::vector<FrameRow>& rows) {
  const Frame& first = rows.front().frame;
  const Frame& last = rows.back().frame;
  const auto elapsed_ns = static_cast<double>(last.time.monotonic_ns - first.time.monotonic_ns);
  if (last.sequence <= first.sequence || elapsed_ns <= 0.0) return 0.0;
  return static_cast<double>(last.sequence - first.sequence) * kNsPerSecond / elapsed_ns;
}

std::uint64_t count_frames(const std::vector<FrameRow>& rows) {
  std::uint64_t count = rows.empty() ? 0 : 1;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].frame.sequence != rows[i - 1].frame.sequence) ++count;
  }
  return count;
}

}  // namespace

ImageOptions ImageOptions::from_uri(SourceUri uri) {
  ImageOptions options;
  const auto common = detail::CommonKeys::take(uri);
  options.pattern = common.pattern;
  options.fields = common.fields;
  options.fps = uri.take_number("fps", 1e-3, 1e6).value_or(options.fps);
  if (const auto given = uri.take_integer("bits", 9, 16)) options.bits = static_cast<int>(*given);
  uri.refuse_unused(fmt::format("fps, bits, {}", detail::CommonKeys::kKnown));
  options.path = uri.path();
  options.uri = uri.text();
  return options;
}

struct ImageSource::State {
  EventPort events;

  SourceInfo info;
  detail::CommonKeys common;
  std::optional<int> bits;  // That were asked for.
  std::int64_t frame_period_ns = 0;
  std::vector<FrameRow> rows;
  detail::FrameShapes shapes;

  std::atomic<bool> is_streaming = false;
  std::size_t next_row = 0;
  DecodedImage decoded;
  std::vector<std::uint8_t> bytes;

  detail::FrameCounts counts;

  void list_frames(const ImageOptions& options);
  void look_at_first_image();
  void check_bits(const FrameRow& row) const;
  detail::Fault read(const FrameRow& row);
  void fill(const FrameRow& row, Frame& frame);
  void take_image(const FrameRow& row, Frame& frame);
};

void ImageSource::State::list_frames(const ImageOptions& options) {
  events = options.events;
  common = {options.pattern, options.fields};
  bits = options.bits;
  info.uri = options.uri.empty() ? "images:" + options.path : options.uri;
  if (!(options.fps > 0.0)) {
    throw Error(ErrorKind::kUsage,
                fmt::format("source '{}': fps={} - expected more than 0", info.uri, options.fps));
  }
  const fs::path path = options.path;
  std::error_code ignored;
  const bool is_recording = fs::exists(path / detail::kFrameTableName, ignored);
  rows = is_recording ? rows_of_recording(path, options.fps, events)
                      : rows_of_plain_images(options.path, options.fps);

  info.pictures = count_frames(rows);
  info.description =
      fmt::format("{} frame{} of '{}'{}", *info.pictures, *info.pictures == 1 ? "" : "s",
                  options.path, is_recording ? " (a recording)" : "");
  info.picture_rate_hz = is_recording ? rate_of(rows) : options.fps;
  info.has_clock = rows.front().frame.time.utc_offset_ns.has_value();
  info.pattern = rows.front().pattern;
  info.field = rows.front().frame.field;
  if (info.field == Field::kBottom) info.field = Field::kTop;  // Stands for single fields.
  common.apply(info);
  if (info.picture_rate_hz > 0.0) {
    frame_period_ns = std::llround(kNsPerSecond / info.picture_rate_hz);
  }
}

// The first one that decodes says what the stream is. Where none does, the size stays 0x0 and every
// frame will say why.
void ImageSource::State::look_at_first_image() {
  for (const FrameRow& row : rows) {
    if (row.frame.status != FrameStatus::kOk || !read(row).empty()) continue;
    check_bits(row);
    Frame frame = row.frame;
    take_image(row, frame);
    info.image_size = frame.image.size();
    info.sensor_size = frame.sensor_size;
    info.bit_depth = frame.bit_depth;
    info.channels = frame.image.channels();
    return;
  }
}

// Against the image that was read for the row: the one that decides.
void ImageSource::State::check_bits(const FrameRow& row) const {
  const cv::Mat& image = decoded.image;
  const bool is_recording = !row.frame.sensor_size.empty();
  if (!bits && (is_recording || decoded.bit_depth != 16)) return;
  double highest = 0.0;
  cv::minMaxIdx(image.reshape(1), nullptr, &highest);
  if (bits && (image.depth() != CV_16U ||
               highest >= static_cast<double>(1U << static_cast<unsigned>(*bits)))) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("source '{}': bits={} - but '{}' is {} with values up to {}", info.uri, *bits,
                    row.file, detail::shape_words(image.size(), image.type()), highest));
  }
  constexpr double kHighestOfTwelveBits = 4095.0;
  if (!bits && highest <= kHighestOfTwelveBits) {
    events.send(
        {"bits_unknown",
         fmt::format(
             "'{}' has 16 bits and no value above {}: if its camera gives fewer bits, say so "
             "(?bits=12), or its saturated pixels are not known",
             row.file, highest)});
  }
}

// Decodes a row's image file into `decoded`.
detail::Fault ImageSource::State::read(const FrameRow& row) {
  if (row.file.empty()) return "the recording has no image for this frame";
  const int failure = detail::read_whole_file(row.file, bytes);
  const detail::Fault fault = failure != 0 ? std::generic_category().message(failure)
                                           : detail::decode_image(bytes, decoded);
  if (fault.empty()) return {};
  return fmt::format("image file '{}'{} {}", row.file, failure != 0 ? ":" : "", fault);
}

void ImageSource::State::fill(const FrameRow& row, Frame& frame) {
  decoded.image = is_sole_owner(frame.image) ? std::move(frame.image) : cv::Mat();
  frame = row.frame;
  detail::Fault fault = read(row);
  if (fault.empty()) {
    take_image(row, frame);
  } else if (frame.status == FrameStatus::kOk) {
    frame.status = FrameStatus::kCorrupt;
    frame.status_detail = std::move(fault);
  }
  decoded.image.release();
  common.apply(frame, frame_period_ns);
}

void ImageSource::State::take_image(const FrameRow& row, Frame& frame) {
  frame.image = decoded.image;
  if (frame.sensor_size.empty()) {  // Not a recording: the image is all there is.
    frame.sensor_size = frame.image.size();
    frame.bit_depth = decoded.bit_depth;
  }
  if (bits) frame.bit_depth = *bits;
  if (frame.status != FrameStatus::kOk) return;

  const std::string difference = shapes.difference(frame);
  if (difference.empty()) return;
  frame.status = FrameStatus::kWrongSize;
  frame.status_detail = fmt::format("image file '{}' {}", row.file, difference);
}

ImageSource::ImageSource(const ImageOptions& options) : state_(std::make_unique<State>()) {
  state_->list_frames(options);
  state_->look_at_first_image();
}

ImageSource::~ImageSource() = default;

SourceInfo ImageSource::info() const { return state_->info; }

void ImageSource::start() {
  if (state_->is_streaming.exchange(true)) return;
  state_->next_row = 0;
  state_->counts.reset();
}

NextStatus ImageSource::next(Frame& frame, std::chrono::milliseconds /*timeout*/) {
  if (!state_->is_streaming) return NextStatus::kStopped;
  if (state_->next_row == state_->rows.size()) return NextStatus::kEnd;
  state_->fill(state_->rows[state_->next_row], frame);
  state_->counts.deliver_recorded(frame);
  ++state_->next_row;
  return NextStatus::kFrame;
}

void ImageSource::stop() { state_->is_streaming = false; }

SourceStatistics ImageSource::statistics() const { return state_->counts.now(); }

}  // namespace striper
