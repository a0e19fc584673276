// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <fstream>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/recording_info.hpp>
#include <striper/stream/scan_files.hpp>
#include <striper/wire/cdr.hpp>
#include <striper/wire/mcap_reader.hpp>

namespace striper {
namespace {

constexpr std::string_view kScanType = "striper_msgs/msg/PolarScan";
constexpr std::string_view kFrameType = "striper_msgs/msg/FrameInfo";

bool is_image(std::string_view type) {
  return type == "sensor_msgs/msg/Image" || type == "sensor_msgs/msg/CompressedImage";
}

// "left" of "/left/polar_scan".
std::string head_of(std::string_view topic) {
  topic = topic.substr(0, topic.rfind('/'));
  if (topic.starts_with("/")) topic.remove_prefix(1);
  return std::string(topic);
}

void add_head(std::vector<std::string>& heads, std::string head) {
  if (std::find(heads.begin(), heads.end(), head) == heads.end()) heads.push_back(std::move(head));
}

// The times of all topics; each by itself grows in what it holds.
void close(RecordingInfo& info) {
  std::optional<double> last_s;
  for (const TopicInfo& topic : info.topics) {
    if (topic.count == 0) continue;
    info.start_s = std::min(info.start_s.value_or(topic.first_s), topic.first_s);
    last_s = std::max(last_s.value_or(topic.last_s), topic.last_s);
  }
  if (last_s) info.duration_s = *last_s - *info.start_s;
  std::sort(info.heads.begin(), info.heads.end());
}

// A recording, message by message.
class McapInspection {
 public:
  explicit McapInspection(const std::filesystem::path& path)
      : reader_(path, {.skip_damaged = true}) {
    for (const auto& [number, channel] : reader_.channels()) topic_of(number, channel);
  }

  RecordingInfo run(const std::function<bool(std::uint64_t)>& go_on) {
    for (wire::McapMessage message; reader_.next(message);) {
      add(message);
      if (go_on && !go_on(reader_.whole_bytes())) break;
    }
    for (const wire::McapAttachment& attachment : reader_.attachments()) add(attachment);
    for (const wire::McapDamage& damage : reader_.damages())
      info_.damages.push_back({damage.offset, damage.bytes, damage.reason});
    // Frames of other programs stand without a FrameInfo.
    if (info_.frames == 0) info_.frames = images_;
    return std::move(info_);
  }

 private:
  std::size_t topic_of(std::uint16_t number, const wire::McapChannel& channel) {
    const auto [found, is_new] = places_.try_emplace(number, info_.topics.size());
    if (is_new) info_.topics.push_back({channel.topic, channel.schema.name});
    return found->second;
  }

  void add(const wire::McapMessage& message) {
    const wire::McapChannel& channel = reader_.channels().at(message.channel);
    TopicInfo& topic = info_.topics[topic_of(message.channel, channel)];
    topic.add(1e-9 * static_cast<double>(message.log_time_ns));
    if (topic.type == kScanType) add_scan(channel.topic, message);
    if (topic.type == kFrameType) {
      ++info_.frames;
      add_head(info_.heads, head_of(channel.topic));
    }
    if (is_image(topic.type)) ++images_;
  }

  void add_scan(std::string_view topic, const wire::McapMessage& message) {
    ++info_.scans;
    wire::read_cdr(message.data, scan_);
    info_.lasers.insert(scan_.laser);
    add_head(info_.heads, head_of(topic));
  }

  void add(const wire::McapAttachment& attachment) {
    if (!attachment.name.ends_with(kModelAttachment)) return;
    const std::string head =
        attachment.name.substr(0, attachment.name.size() - kModelAttachment.size());
    info_.models[head] = attachment.name;
    add_head(info_.heads, head);
  }

  wire::McapReader reader_;
  RecordingInfo info_;
  std::map<std::uint16_t, std::size_t> places_;  // Of a channel's topic.
  std::uint64_t images_ = 0;
  wire::PolarScan scan_;
};

// A table, scan by scan. What is behind a damage is not read: a table has no place to go on from.
RecordingInfo inspect_table(ScanSource& scans, const std::function<bool(std::uint64_t)>& go_on) {
  RecordingInfo info;
  TopicInfo topic{"scans", std::string(kScanType)};
  PolarScan scan;
  try {
    while (scans.next(scan, {}) == NextStatus::kFrame) {
      topic.add(scan.time.seconds());
      info.lasers.insert(scan.laser);
      add_head(info.heads, std::string(scan.head()));
      if (go_on && !go_on(0)) break;
    }
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kBadFile) throw;
    info.damages.push_back({{}, {}, error.what()});
  }
  info.scans = topic.count;
  info.topics = {std::move(topic)};
  return info;
}

// A line of JSON without an end is half a scan, and no reader's: its writer was killed.
std::optional<RecordingDamage> unended_line(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::uint64_t at = 0;
  std::string line;
  while (std::getline(file, line) && !file.eof()) at += line.size() + 1;
  if (line.empty()) return std::nullopt;
  return RecordingDamage{
      at, line.size(), fmt::format("{}: its last line has no end: its writer died", path.string())};
}

RecordingInfo inspect(const std::filesystem::path& path, const std::string& format,
                      const std::function<bool(std::uint64_t)>& go_on) {
  if (format == "mcap") return McapInspection(path).run(go_on);
  if (format == "csv") return inspect_table(*read_csv_scans(path), go_on);
  RecordingInfo info = inspect_table(*read_jsonl_scans(path), go_on);
  if (info.damages.empty()) {
    if (auto damage = unended_line(path)) info.damages.push_back(std::move(*damage));
  }
  return info;
}

}  // namespace

double TopicInfo::rate_hz() const noexcept {
  return count > 1 && last_s > first_s ? static_cast<double>(count - 1) / (last_s - first_s) : 0.0;
}

void TopicInfo::add(double time_s) noexcept {
  if (count++ == 0) first_s = last_s = time_s;
  largest_gap_s = std::max(largest_gap_s, time_s - last_s);
  first_s = std::min(first_s, time_s);
  last_s = std::max(last_s, time_s);
}

std::optional<std::uint64_t> RecordingInfo::lost_bytes() const noexcept {
  std::optional<std::uint64_t> lost = 0;
  for (const RecordingDamage& damage : damages) {
    if (!damage.lost_bytes) return std::nullopt;
    *lost += *damage.lost_bytes;
  }
  return lost;
}

RecordingInfo inspect_recording(const std::filesystem::path& path,
                                const std::function<bool(std::uint64_t)>& go_on) {
  const std::string extension = path.extension().string();
  if (extension != ".mcap" && extension != ".csv" && extension != ".jsonl") {
    throw Error(
        ErrorKind::kUnsupported,
        fmt::format("'{}' - expected a recording or scans: .mcap, .csv or .jsonl", path.string()));
  }
  RecordingInfo info = inspect(path, extension.substr(1), go_on);
  info.format = extension.substr(1);
  info.bytes = std::filesystem::file_size(path);
  close(info);
  return info;
}

}  // namespace striper
