// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <striper/core/error.hpp>
#include <striper/stream/scan_files.hpp>

#include "stream/files/line_reader.hpp"
#include "stream/files/read_number.hpp"

namespace striper {
namespace {

using detail::ScanColumn;

/// Takes one line's values as they come: the text of a number is needed as it stands, since a float
/// that went through a double may not be the same bits.
class LineHandler : public nlohmann::json_sax<nlohmann::json> {
 public:
  void begin(PolarScan& scan) {
    *this = LineHandler();
    scan_ = &scan;
    scan.returns.clear();
    scan.field = Field::kProgressive;
    scan.is_stripe_seen = true;
  }

  /// Whether it is an event, or what was found in a scan.
  bool is_no_scan() const noexcept { return is_no_scan_; }
  const std::string& problem() const noexcept { return problem_; }
  const std::string& head() const noexcept { return head_; }
  const std::string& frame_id() const noexcept { return frame_id_; }
  /// What is wrong with the time of a scan; other lines may have any.
  std::string problem_of_time() const {
    if (bad_time_.empty()) return {};
    return fmt::format("time_s is {} - expected seconds, {:g} at most (not milliseconds)",
                       bad_time_, FrameTime::kMostSeconds);
  }
  /// What a scan has to say, and that its arrays are as long as each other.
  bool is_whole() const noexcept {
    return has_sequence_ && has_time_ && has_status_ && rows_ == scan_->returns.size();
  }

  bool null() override { return number(""); }
  bool boolean(bool value) override {
    if (key_ == "is_stripe_seen") scan_->is_stripe_seen = value;
    return true;
  }
  bool number_integer(number_integer_t value) override { return number(std::to_string(value)); }
  bool number_unsigned(number_unsigned_t value) override { return number(std::to_string(value)); }
  bool number_float(number_float_t /*value*/, const string_t& text) override {
    return number(text);
  }
  bool string(string_t& text) override {
    if (is_in_array_ && column_ != nullptr) return number(text);
    if (is_in_array_ && key_ == "status") return status(text);
    if (key_ == "head") head_ = text;
    if (key_ == "frame_id") frame_id_ = text;
    if (key_ == "field") scan_->field = text == "top" ? Field::kTop : Field::kBottom;
    if (key_ != "axis") return true;
    const std::optional<StripeAxis> axis = stripe_axis_from_string(text);
    if (axis) scan_->axis = *axis;
    return axis || fail(text, "columns or rows");
  }
  bool binary(binary_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*elements*/) override { return true; }
  bool key(string_t& name) override {
    key_ = name;
    if (name == "event" || name == "curbs" || name == "objects") is_no_scan_ = true;
    column_ = detail::find_scan_column(name);
    return true;
  }
  bool end_object() override { return true; }
  bool start_array(std::size_t /*elements*/) override {
    is_in_array_ = true;
    at_ = 0;
    return true;
  }
  bool end_array() override {
    is_in_array_ = false;
    const bool is_ours = column_ != nullptr || key_ == "status";
    if (!is_ours) return true;
    if (rows_ == kNone) rows_ = at_;
    return rows_ == at_ || fail(fmt::format("{} elements", at_), fmt::format("{}", rows_));
  }
  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& error) override {
    problem_ = fmt::format("is no JSON: {}", error.what());
    return false;
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  bool fail(std::string_view found, std::string_view expected) {
    problem_ = fmt::format("{} is '{}' - expected {}", key_, found, expected);
    return false;
  }

  Return& next_return() {
    if (at_ == scan_->returns.size()) scan_->returns.emplace_back();
    return scan_->returns[at_++];
  }

  bool number(std::string_view text) {
    if (is_in_array_ && column_ != nullptr) {
      Return& r = next_return();
      if (!detail::read_into(text, *column_, r)) return fail(text, "a number");
      problem_ = detail::problem_of_bearing(r.bearing_rad);
      return problem_.empty();
    }
    if (key_ == "laser") return detail::read_number(text, scan_->laser) || fail(text, "an index");
    if (key_ == "sequence") {
      has_sequence_ = true;
      return detail::read_number(text, scan_->sequence) || fail(text, "a number of a frame");
    }
    if (key_ != "time_s") return true;
    double seconds = 0.0;
    const bool is_number = detail::read_number(text, seconds);
    has_time_ = is_number && std::abs(seconds) <= FrameTime::kMostSeconds;
    scan_->time = FrameTime::at_seconds(seconds);
    if (!has_time_) bad_time_ = is_number ? text : "no number";
    return true;
  }

  bool status(std::string_view text) {
    has_status_ = true;
    const auto status = return_status_from_string(text);
    if (status) next_return().status = *status;
    return status || fail(text, "a status");
  }

  PolarScan* scan_ = nullptr;
  std::string key_;
  const ScanColumn* column_ = nullptr;
  bool is_in_array_ = false;
  std::size_t at_ = 0;
  std::size_t rows_ = kNone;
  bool is_no_scan_ = false;
  bool has_sequence_ = false;
  bool has_time_ = false;
  bool has_status_ = false;
  std::string head_{kDefaultHead};
  std::string frame_id_;
  std::string problem_;
  std::string bad_time_;
};

class JsonlScans : public ScanSource {
 public:
  JsonlScans(const std::filesystem::path& path, std::shared_ptr<const StriperModel> model)
      : reader_(path), model_(std::move(model)) {
    has_pending_ = read(pending_);
    SourceInfo source;
    source.uri = path.string();
    source.description = "scans in " + source.uri;
    source.has_clock = has_pending_ && pending_.time.utc_offset_ns;
    info_ = head_info(pending_.head(), source, model_, pending_.axis);
  }

  HeadInfo info() const override { return info_; }

  std::string loss() const override {
    if (!is_cut_) return {};
    return fmt::format("{}: the last line is cut off and left out", reader_.path().string());
  }

  NextStatus next(PolarScan& scan, std::chrono::milliseconds /*timeout*/) override {
    if (has_pending_) {
      std::swap(scan, pending_);
      has_pending_ = false;
      return NextStatus::kFrame;
    }
    return read(scan) ? NextStatus::kFrame : NextStatus::kEnd;
  }

 private:
  bool read(PolarScan& scan) {
    while (reader_.next(text_)) {
      if (text_.empty()) continue;
      handler_.begin(scan);
      const bool is_read = nlohmann::json::sax_parse(text_, &handler_);
      if (handler_.is_no_scan()) continue;
      if (const std::string wrong = handler_.problem_of_time(); is_read && !wrong.empty())
        reader_.fail(wrong);
      const bool is_good = is_read && handler_.is_whole();
      is_cut_ = !is_good && !reader_.is_ended();
      if (is_cut_) return false;  // Its writer was killed.
      if (!is_read) reader_.fail(handler_.problem());
      if (!handler_.is_whole()) reader_.fail("expected sequence, time_s, status and its columns");
      scan.frame = frame_of(scan.laser);
      return true;
    }
    return false;
  }

  const std::shared_ptr<const ScanFrame>& frame_of(int laser) {
    for (const auto& frame : frames_) {
      if (frame->laser == laser && frame->head == handler_.head()) return frame;
    }
    auto made = std::make_shared<ScanFrame>(*make_scan_frame(handler_.head(), laser, model_));
    if (!handler_.frame_id().empty()) made->frame_id = handler_.frame_id();
    return frames_.emplace_back(std::move(made));
  }

  detail::LineReader reader_;
  std::shared_ptr<const StriperModel> model_;
  std::vector<std::shared_ptr<const ScanFrame>> frames_;
  LineHandler handler_;
  std::string text_;
  PolarScan pending_;
  bool has_pending_ = false;
  bool is_cut_ = false;
  HeadInfo info_;
};

}  // namespace

std::unique_ptr<ScanSource> read_jsonl_scans(const std::filesystem::path& path,
                                             std::shared_ptr<const StriperModel> model) {
  return std::make_unique<JsonlScans>(path, std::move(model));
}

}  // namespace striper
