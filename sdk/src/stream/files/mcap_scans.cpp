// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/model/model_yaml.hpp>
#include <striper/stream/mcap_recording.hpp>
#include <striper/stream/messages/scan_messages.hpp>
#include <striper/stream/scan_files.hpp>
#include <striper/wire/mcap_reader.hpp>

namespace striper {
namespace {

// "left" of "/left/polar_scan".
std::string head_of_topic(std::string_view topic) {
  if (topic.ends_with(kPolarScanTopic)) topic.remove_suffix(kPolarScanTopic.size());
  if (topic.starts_with("/")) topic.remove_prefix(1);
  return std::string(topic);
}

// The one attached last: that of a head whose model was read anew.
std::shared_ptr<const StriperModel> model_in(wire::McapReader& reader, const std::string& path,
                                             std::string_view head) {
  const auto& attachments = reader.attachments();
  for (std::size_t i = attachments.size(); i-- > 0;) {
    const std::string& name = attachments[i].name;
    if (name != fmt::format("{}{}", head, kModelAttachment)) continue;
    auto model = parse_model(reader.read_attachment(i).data, fmt::format("{}: {}", path, name));
    return std::make_shared<const StriperModel>(std::move(model));
  }
  return nullptr;
}

// The scans of a recording, of one head or of all.
class McapScans : public ScanSource {
 public:
  McapScans(const std::filesystem::path& path, std::shared_ptr<const StriperModel> model,
            std::string head, bool skip_damaged)
      : path_(path.string()),
        reader_(path, {.skip_damaged = skip_damaged}),
        head_(std::move(head)),
        model_(std::move(model)) {
    has_pending_ = read(pending_);
    if (!has_pending_ && reader_.is_cut_at_beginning()) {
      throw Error(
          ErrorKind::kNotFound,
          fmt::format("'{}' holds no scans: it was cut off before its first message", path_));
    }
    if (!has_pending_) {
      throw Error(
          ErrorKind::kNotFound,
          fmt::format("'{}' holds no scans{}: frames need a model to make scans of (mcap:{} "
                      "is the source of its frames)",
                      path_, head_.empty() ? "" : " of head " + head_, path_));
    }
    source_.uri = path_;
    source_.description = "scans in " + path_;
    source_.has_clock = pending_.time.utc_offset_ns.has_value();
    axis_ = pending_.axis;
    info_ = McapScans::info_of(pending_.head());
  }

  HeadInfo info() const override { return info_; }

  std::string loss() const override {
    if (reader_.end() != wire::McapEnd::kCut) return {};
    return fmt::format(
        "{}: the recording is cut off; what is behind its last whole part is lost "
        "(striper info says where)",
        path_);
  }

  HeadInfo info_of(std::string_view head) override {
    HeadInfo info = head_info(head, source_, model_of(std::string(head)), axis_);
    if (info.model) return info;
    info.frames.clear();
    for (const auto& frame : frames_) {
      if (frame->head == head) info.frames.push_back(frame);
    }
    return info;
  }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (std::exchange(has_pending_, false)) {
      std::swap(scan, pending_);
      return NextStatus::kFrame;
    }
    return read(scan) ? NextStatus::kFrame : NextStatus::kEnd;
  }

 private:
  bool read(PolarScan& scan) {
    wire::McapMessage message;
    while (reader_.next(message)) {
      const wire::McapChannel& channel = reader_.channels().at(message.channel);
      if (channel.schema.name != "striper_msgs/msg/PolarScan") continue;
      const std::string head = head_of_topic(channel.topic);
      if (!head_.empty() && head != head_) continue;
      wire::read_cdr(message.data, message_);
      from_message(message_, scan);
      scan.frame = frame_of(head, scan.laser);
      return true;
    }
    return false;
  }

  const std::shared_ptr<const ScanFrame>& frame_of(const std::string& head, int laser) {
    for (const auto& frame : frames_) {
      if (frame->laser == laser && frame->head == head) return frame;
    }
    auto made = std::make_shared<ScanFrame>(*make_scan_frame(head, laser, model_of(head)));
    made->frame_id = message_.header.frame_id;
    return frames_.emplace_back(std::move(made));
  }

  // The one that was given, else the one attached.
  std::shared_ptr<const StriperModel> model_of(const std::string& head) {
    if (model_) return model_;
    const auto [known, is_new] = attached_.try_emplace(head);
    if (is_new) known->second = model_in(reader_, path_, head);
    return known->second;
  }

  std::string path_;
  wire::McapReader reader_;
  std::string head_;
  std::shared_ptr<const StriperModel> model_;
  std::map<std::string, std::shared_ptr<const StriperModel>> attached_;
  std::vector<std::shared_ptr<const ScanFrame>> frames_;
  wire::PolarScan message_;
  PolarScan pending_;
  bool has_pending_ = false;
  SourceInfo source_;
  StripeAxis axis_ = StripeAxis::kColumns;
  HeadInfo info_;
};

}  // namespace

std::unique_ptr<ScanSource> read_mcap_scans(const std::filesystem::path& path,
                                            std::shared_ptr<const StriperModel> model,
                                            std::string head, bool skip_damaged) {
  return std::make_unique<McapScans>(path, std::move(model), std::move(head), skip_damaged);
}

std::shared_ptr<const StriperModel> attached_model(const std::filesystem::path& path,
                                                   std::string_view head) {
  wire::McapReader reader(path, {.skip_damaged = true});
  std::string first;
  for (const wire::McapAttachment& attachment : reader.attachments()) {
    if (!attachment.name.ends_with(kModelAttachment)) continue;
    first = attachment.name.substr(0, attachment.name.size() - kModelAttachment.size());
    break;
  }
  return model_in(reader, path.string(), head.empty() ? std::string_view(first) : head);
}

}  // namespace striper
