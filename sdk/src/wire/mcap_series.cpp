// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/wire/mcap_series.hpp>

namespace striper::wire {
namespace {

struct Unit {
  std::string_view word;
  std::uint64_t bytes;
  std::uint64_t ns;
};
constexpr std::array<Unit, 6> kUnits = {{{"kB", 1'000, 0},
                                         {"MB", 1'000'000, 0},
                                         {"GB", 1'000'000'000, 0},
                                         {"s", 0, 1'000'000'000},
                                         {"min", 0, 60'000'000'000},
                                         {"h", 0, 3'600'000'000'000}}};

}  // namespace

McapRotation McapRotation::parse(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view word = text.substr(static_cast<std::size_t>(end - text.data()));
  for (const Unit& unit : kUnits) {
    const bool fits = number > 0 && number < 1'000'000;
    if (error == std::errc{} && fits && word == unit.word)
      return {number * unit.bytes, number * unit.ns};
  }
  throw Error(
      ErrorKind::kUsage,
      fmt::format("rotate={}: a size or a time expected, such as 500MB, 1GB, 90s, 10min or 2h",
                  text));
}

std::filesystem::path McapRotation::file(const std::filesystem::path& path,
                                         std::size_t index) const {
  if (!is_wanted()) return path;
  std::filesystem::path one = path;
  return one.replace_filename(
      fmt::format("{}_{:04}{}", path.stem().string(), index, path.extension().string()));
}

McapSeries::McapSeries(std::filesystem::path path, McapRotation rotation,
                       const McapWriterOptions& options)
    : path_(std::move(path)), rotation_(rotation), options_(options) {
  open_next();
}

void McapSeries::open_next() {
  const std::filesystem::path path = rotation_.file(path_, paths_.size());
  if (writer_) writer_->close();
  writer_ = std::make_unique<McapWriter>(path, options_);
  paths_.push_back(path);
  for (const McapChannel& channel : channels_) writer_->add_channel(channel);
  for (const McapAttachment& attachment : attachments_) writer_->attach(attachment);
  for (const McapMetadata& metadata : metadata_) writer_->add_metadata(metadata);
}

bool McapSeries::is_full(const McapMessage& message) const noexcept {
  if (writer_->statistics().messages == 0) return false;
  if (rotation_.bytes > 0 && writer_->bytes() + message.data.size() > rotation_.bytes) return true;
  // Until the first chunk is closed the file has no start; it is younger than any rotation then.
  const McapStatistics& so_far = writer_->statistics();
  return rotation_.ns > 0 && so_far.chunks > 0 &&
         message.log_time_ns >= so_far.start_ns + rotation_.ns;
}

std::uint16_t McapSeries::add_channel(const McapChannel& channel) {
  channels_.push_back(channel);
  return writer_->add_channel(channel);
}

void McapSeries::write(const McapMessage& message) {
  if (is_full(message)) open_next();
  writer_->write(message);
}

void McapSeries::attach(const McapAttachment& attachment) {
  attachments_.push_back(attachment);
  writer_->attach(attachment);
}

void McapSeries::add_metadata(const McapMetadata& metadata) {
  metadata_.push_back(metadata);
  writer_->add_metadata(metadata);
}

void McapSeries::flush() { writer_->flush(); }
void McapSeries::close() { writer_->close(); }

}  // namespace striper::wire
