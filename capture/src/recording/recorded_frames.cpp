// SPDX-License-Identifier: Apache-2.0
#include "recording/recorded_frames.hpp"

#include <charconv>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <striper/core/error.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/messages/frame_messages.hpp>
#include <striper/wire/cdr.hpp>

namespace striper::detail {
namespace {

constexpr std::string_view kImage = "sensor_msgs/msg/Image";
constexpr std::string_view kFrameInfo = "striper_msgs/msg/FrameInfo";
constexpr std::int64_t kNsPerSecond = 1'000'000'000;

// "left" of "/left/image_raw", "a/b" of "/a/b/image".
std::string namespace_of(std::string_view topic) {
  if (topic.starts_with("/")) topic.remove_prefix(1);
  const std::size_t slash = topic.rfind('/');
  return std::string(slash == std::string_view::npos ? topic : topic.substr(0, slash));
}

// A number of the metadata; they are hints of the first moment, so one that is none counts as 0.
template <typename Number>
Number number_of(const std::map<std::string, std::string>& values, const char* key) {
  const auto found = values.find(key);
  Number number{};
  if (found == values.end()) return number;
  const std::string& text = found->second;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

IlluminationPattern pattern_of(const std::map<std::string, std::string>& values) {
  const auto found = values.find("cadence");
  if (found == values.end() || found->second.empty()) return {};
  try {
    return IlluminationPattern::parse(found->second);
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

RecordedFrames::RecordedFrames(const std::filesystem::path& path, std::string head)
    : path_(path.string()), reader_(path, {.skip_damaged = true}), head_(std::move(head)) {
  choose_head();
}

// Of a file without a summary only the metadata are known before its messages.
void RecordedFrames::choose_head() {
  std::set<std::string> with_images;
  std::set<std::string> with_info;
  for (const auto& [number, channel] : reader_.channels()) {
    if (channel.schema.name == kImage) with_images.insert(namespace_of(channel.topic));
    if (channel.schema.name == kFrameInfo) with_info.insert(namespace_of(channel.topic));
  }
  for (const wire::McapMetadata& one : reader_.metadata()) {
    if (one.name.ends_with(kSourceMetadata) && one.values.count("frame_info_version") > 0) {
      with_info.insert(one.name.substr(0, one.name.size() - kSourceMetadata.size()));
    }
  }
  std::set<std::string> all = with_images;
  all.insert(with_info.begin(), with_info.end());
  if (head_.empty() && all.size() > 1) {
    throw Error(
        ErrorKind::kUsage,
        fmt::format("'{}' holds frames of {}: name one with ?head=", path_, fmt::join(all, ", ")));
  }
  if (head_.empty() && all.size() == 1) head_ = *all.begin();
  if (!head_.empty() && !all.empty() && all.count(head_) == 0) {
    throw Error(ErrorKind::kNotFound, fmt::format("'{}' holds frames of {} and none of head '{}'",
                                                  path_, fmt::join(all, ", "), head_));
  }
  has_info_ = with_info.count(head_) > 0;
  for (const auto& [number, channel] : reader_.channels()) {
    if (channel.topic == "/" + head_ + std::string(kImageTopic)) image_topic_ = channel.topic;
  }
}

bool RecordedFrames::tell_of_source(SourceInfo& info) const {
  for (const wire::McapMetadata& one : reader_.metadata()) {
    if (one.name != head_ + std::string(kSourceMetadata)) continue;
    info.image_size = {number_of<int>(one.values, "image_width"),
                       number_of<int>(one.values, "image_height")};
    info.sensor_size = {number_of<int>(one.values, "sensor_width"),
                        number_of<int>(one.values, "sensor_height")};
    info.bit_depth = number_of<int>(one.values, "bit_depth");
    info.channels = number_of<int>(one.values, "channels");
    info.picture_rate_hz = number_of<double>(one.values, "picture_rate_hz");
    info.pattern = pattern_of(one.values);
    return true;
  }
  return false;
}

std::optional<std::uint64_t> RecordedFrames::count() const {
  const auto& statistics = reader_.statistics();
  if (!statistics) return std::nullopt;
  std::uint64_t count = 0;
  for (const auto& [number, messages] : statistics->channel_messages) {
    const auto channel = reader_.channels().find(number);
    if (channel == reader_.channels().end()) continue;
    const bool is_frame = channel->second.schema.name == (has_info_ ? kFrameInfo : kImage);
    if (is_frame && namespace_of(channel->second.topic) == head_) count += messages;
  }
  return count;
}

RecordedFrames::Kind RecordedFrames::kind_of(const wire::McapChannel& channel) {
  const bool is_image = channel.schema.name == kImage;
  const bool is_info = has_info_ && channel.schema.name == kFrameInfo;
  if (!is_image && !is_info) return Kind::kOther;
  const std::string head = namespace_of(channel.topic);
  if (head_.empty()) head_ = head;  // A cut file of other people's: the first that comes.
  if (head != head_) return Kind::kOther;
  if (is_image && image_topic_.empty()) image_topic_ = channel.topic;
  if (is_image && channel.topic != image_topic_) return Kind::kOther;  // image_rect and the like.
  return is_image ? Kind::kImage : Kind::kFrameInfo;
}

bool RecordedFrames::next(Frame& frame) {
  wire::McapMessage message;
  while (reader_.next(message)) {
    auto known = kinds_.find(message.channel);
    if (known == kinds_.end()) {
      known =
          kinds_.emplace(message.channel, kind_of(reader_.channels().at(message.channel))).first;
    }
    if (known->second == Kind::kOther) continue;
    if (known->second == Kind::kFrameInfo) {
      take_info(message, frame);
      return true;
    }
    take_image(message);
    if (has_info_) continue;
    take_alone(message, frame);
    return true;
  }
  return false;
}

void RecordedFrames::take_image(const wire::McapMessage& message) {
  image_time_ns_ = message.log_time_ns;
  image_.release();
  image_fault_.clear();
  try {
    wire::read_cdr(message.data, image_message_);
    Frame holder;
    from_message(image_message_, holder);
    image_ = holder.image;
  } catch (const Error& error) {
    image_fault_ = error.what();
  }
}

void RecordedFrames::take_info(const wire::McapMessage& message, Frame& frame) {
  frame = Frame();
  try {
    wire::read_cdr(message.data, info_message_);
    from_message(info_message_, frame, pattern_);
  } catch (const Error& error) {
    frame = Frame();
    frame.status = FrameStatus::kCorrupt;
    frame.status_detail = error.what();
  }
  if (image_time_ns_ != message.log_time_ns) {
    image_.release();
    image_fault_.clear();
  }
  frame.image = std::exchange(image_, cv::Mat());
  if (frame.image.empty() && frame.status == FrameStatus::kOk) {
    frame.status = FrameStatus::kCorrupt;
    frame.status_detail =
        image_fault_.empty() ? "the recording has no image for this frame" : image_fault_;
  }
}

// Nobody says more of it than its stamp.
void RecordedFrames::take_alone(const wire::McapMessage& message, Frame& frame) {
  frame = Frame();
  frame.image = std::exchange(image_, cv::Mat());
  frame.sequence = images_alone_++;
  const wire::Time& stamp = image_message_.header.stamp;
  const std::int64_t stamp_ns = stamp.sec * kNsPerSecond + stamp.nanosec;
  frame.time.monotonic_ns =
      stamp_ns > 0 ? stamp_ns : static_cast<std::int64_t>(message.log_time_ns);
  frame.time.utc_offset_ns = 0;
  frame.sensor_size = frame.image.size();
  frame.bit_depth = frame.image.depth() == CV_16U ? 16 : 8;
  if (!frame.image.empty()) return;
  frame.status = FrameStatus::kCorrupt;
  frame.status_detail = image_fault_;
}

}  // namespace striper::detail
