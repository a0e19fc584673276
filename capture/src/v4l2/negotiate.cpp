// SPDX-License-Identifier: Apache-2.0
#include "v4l2/negotiate.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "v4l2/controls.hpp"

namespace striper::v4l2 {
namespace {

constexpr std::uint32_t kAnyField = V4L2_FIELD_ANY;
constexpr std::uint32_t kNoField = V4L2_FIELD_NONE;

struct StandardName {
  std::string_view word;
  v4l2_std_id bits;
};

constexpr std::array kStandards{
    StandardName{"ntsc", V4L2_STD_NTSC},
    StandardName{"ntsc-m", V4L2_STD_NTSC_M},
    StandardName{"ntsc-j", V4L2_STD_NTSC_M_JP},
    StandardName{"ntsc-m-jp", V4L2_STD_NTSC_M_JP},
    StandardName{"ntsc-m-kr", V4L2_STD_NTSC_M_KR},
    StandardName{"ntsc-443", V4L2_STD_NTSC_443},
    StandardName{"pal", V4L2_STD_PAL},
    StandardName{"pal-bg", V4L2_STD_PAL_BG},
    StandardName{"pal-i", V4L2_STD_PAL_I},
    StandardName{"pal-dk", V4L2_STD_PAL_DK},
    StandardName{"pal-m", V4L2_STD_PAL_M},
    StandardName{"pal-n", V4L2_STD_PAL_N},
    StandardName{"pal-nc", V4L2_STD_PAL_Nc},
    StandardName{"pal-60", V4L2_STD_PAL_60},
    StandardName{"secam", V4L2_STD_SECAM},
};

struct FieldName {
  std::string_view word;
  std::uint32_t field;
};

constexpr std::array kFields{
    FieldName{"none", V4L2_FIELD_NONE},
    FieldName{"top", V4L2_FIELD_TOP},
    FieldName{"bottom", V4L2_FIELD_BOTTOM},
    FieldName{"interlaced", V4L2_FIELD_INTERLACED},
    FieldName{"seq-tb", V4L2_FIELD_SEQ_TB},
    FieldName{"seq-bt", V4L2_FIELD_SEQ_BT},
    FieldName{"alternate", V4L2_FIELD_ALTERNATE},
    FieldName{"interlaced-tb", V4L2_FIELD_INTERLACED_TB},
    FieldName{"interlaced-bt", V4L2_FIELD_INTERLACED_BT},
};

bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

bool has_standard(const v4l2_input& input) {
  return (input.capabilities & V4L2_IN_CAP_STD) != 0 || input.std != 0;
}

v4l2_input find_input(const VideoDevice& device, const std::vector<v4l2_input>& inputs,
                      const std::string& wanted) {
  for (const v4l2_input& input : inputs) {
    if (wanted == std::to_string(input.index) || same_word(wanted, text_of(input.name))) {
      return input;
    }
  }
  std::vector<std::string> names;
  names.reserve(inputs.size());
  for (const v4l2_input& input : inputs)
    names.push_back(fmt::format("{} ({})", input.index, text_of(input.name)));
  device.fail(ErrorKind::kUsage,
              fmt::format("input={} - '{}' has {}", wanted, device.card(), fmt::join(names, ", ")));
}

v4l2_input choose_input(const VideoDevice& device, const std::string& wanted) {
  const std::vector<v4l2_input> inputs = list_inputs(device);
  if (inputs.empty()) return {};  // Cameras of the simplest kind have no inputs to choose from.
  int current = 0;
  if (!wanted.empty()) {
    current = static_cast<int>(find_input(device, inputs, wanted).index);
    device.require(VIDIOC_S_INPUT, current, fmt::format("choose input {}", wanted));
  } else if (device.attempt(VIDIOC_G_INPUT, current) != 0) {
    current = 0;
  }
  v4l2_input input{};
  input.index = static_cast<std::uint32_t>(current);
  device.require(VIDIOC_ENUMINPUT, input, fmt::format("ask about input {}", current));
  return input;
}

v4l2_std_id detect_standard(const VideoDevice& device, const v4l2_input& input, bool is_asked_for) {
  v4l2_std_id seen = 0;
  const int error = device.attempt(VIDIOC_QUERYSTD, seen);
  seen &= input.std;
  const bool is_decided = ((seen & V4L2_STD_525_60) == 0) != ((seen & V4L2_STD_625_50) == 0);
  if (error == 0 && is_decided) return seen;

  const std::string trouble = signal_trouble(input.status);
  if (is_asked_for || error == ENOLINK || !trouble.empty()) {
    device.fail(
        ErrorKind::kDevice,
        fmt::format("cannot tell the standard of input {} ('{}'): it {}", input.index,
                    text_of(input.name),
                    trouble.empty() ? "may be any of several; say standard=ntsc or standard=pal"
                                    : trouble));
  }
  v4l2_std_id current = 0;
  device.require(VIDIOC_G_STD, current, "ask for the standard");
  return current;
}

v4l2_std_id choose_standard(const VideoDevice& device, const v4l2_input& input,
                            const std::string& wanted) {
  if (!has_standard(input)) {
    if (!wanted.empty() && wanted != "auto") {
      device.fail(
          ErrorKind::kUnsupported,
          fmt::format("standard={} - input {} ('{}') is no television input; leave it out or "
                      "choose another input=",
                      wanted, input.index, text_of(input.name)));
    }
    return 0;
  }
  v4l2_std_id standard = 0;
  if (wanted.empty() || wanted == "auto") {
    standard = detect_standard(device, input, wanted == "auto");
  } else {
    standard = standard_from_string(wanted) & input.std;
  }
  if (standard == 0) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("standard={} - input {} ('{}') has auto, {}", wanted, input.index,
                            text_of(input.name), fmt::join(standards_to_strings(input.std), ", ")));
  }
  device.require(VIDIOC_S_STD, standard,
                 fmt::format("set standard={}", standard_to_string(standard)));
  return standard;
}

void require_signal(const VideoDevice& device, std::uint32_t index) {
  v4l2_input input{};
  input.index = index;
  if (device.attempt(VIDIOC_ENUMINPUT, input) != 0) return;
  if (const std::string trouble = signal_trouble(input.status); !trouble.empty()) {
    device.fail(ErrorKind::kDevice,
                fmt::format("input {} ('{}') {} (signal=ignore opens it all the same)", index,
                            text_of(input.name), trouble));
  }
}

std::vector<std::uint32_t> list_codes(const VideoDevice& device) {
  constexpr std::uint32_t kAtMost = 256;
  std::vector<std::uint32_t> codes;
  for (std::uint32_t index = 0; index < kAtMost; ++index) {
    v4l2_fmtdesc description{};
    description.index = index;
    description.type = device.buffer_type();
    if (device.attempt(VIDIOC_ENUM_FMT, description) != 0) break;
    codes.push_back(description.pixelformat);
  }
  return codes;
}

const PixelFormat& choose_format(const VideoDevice& device, const std::string& wanted) {
  const std::vector<std::uint32_t> offered = list_codes(device);
  const auto is_offered = [&](std::uint32_t code) {
    return std::find(offered.begin(), offered.end(), code) != offered.end();
  };
  std::vector<std::string> usable;
  for (const PixelFormat& format : pixel_formats()) {
    if (!is_offered(format.fourcc)) continue;
    if (wanted.empty()) return format;
    usable.push_back(fourcc_to_string(format.fourcc));
  }
  if (const PixelFormat* const format = find_pixel_format(fourcc_from_string(wanted));
      format != nullptr && is_offered(format->fourcc)) {
    return *format;
  }
  if (usable.empty()) {
    std::vector<std::string> names;
    names.reserve(offered.size());
    for (const std::uint32_t code : offered) names.push_back(fourcc_to_string(code));
    device.fail(ErrorKind::kUnsupported,
                fmt::format("'{}' has no pixel format that striper knows; it has {}", device.card(),
                            fmt::join(names, ", ")));
  }
  device.fail(ErrorKind::kUnsupported, fmt::format("format={} - '{}' has {}", wanted, device.card(),
                                                   fmt::join(usable, ", ")));
}

double fastest_rate(const VideoDevice& device, std::uint32_t code, std::uint32_t width,
                    std::uint32_t height) {
  constexpr std::uint32_t kAtMost = 256;
  double fastest = 0.0;
  for (std::uint32_t index = 0; index < kAtMost; ++index) {
    v4l2_frmivalenum interval{};
    interval.index = index;
    interval.pixel_format = code;
    interval.width = width;
    interval.height = height;
    if (device.attempt(VIDIOC_ENUM_FRAMEINTERVALS, interval) != 0) break;
    const bool is_discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract shortest = is_discrete ? interval.discrete : interval.stepwise.min;
    if (shortest.numerator > 0)
      fastest = std::max(fastest, static_cast<double>(shortest.denominator) / shortest.numerator);
    if (!is_discrete) break;
  }
  return fastest;
}

// The largest size that still comes at 15 pictures a second; where there is no list, what is set.
cv::Size choose_size(const VideoDevice& device, std::uint32_t code, cv::Size current) {
  constexpr double kEnough_hz = 15.0;
  constexpr std::uint32_t kAtMost = 256;
  cv::Size best;
  for (std::uint32_t index = 0; index < kAtMost; ++index) {
    v4l2_frmsizeenum size{};
    size.index = index;
    size.pixel_format = code;
    if (device.attempt(VIDIOC_ENUM_FRAMESIZES, size) != 0) break;
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) return current;
    const double rate = fastest_rate(device, code, size.discrete.width, size.discrete.height);
    const cv::Size candidate(static_cast<int>(size.discrete.width),
                             static_cast<int>(size.discrete.height));
    const bool is_fast = rate == 0.0 || rate >= kEnough_hz;
    if (is_fast && candidate.area() > best.area()) best = candidate;
  }
  return best.area() > 0 ? best : current;
}

v4l2_format make_format(const VideoDevice& device, std::uint32_t code, cv::Size size,
                        std::uint32_t field) {
  v4l2_format format{};
  format.type = device.buffer_type();
  if (device.is_multiplanar()) {
    format.fmt.pix_mp.width = static_cast<std::uint32_t>(size.width);
    format.fmt.pix_mp.height = static_cast<std::uint32_t>(size.height);
    format.fmt.pix_mp.pixelformat = code;
    format.fmt.pix_mp.field = field;
  } else {
    format.fmt.pix.width = static_cast<std::uint32_t>(size.width);
    format.fmt.pix.height = static_cast<std::uint32_t>(size.height);
    format.fmt.pix.pixelformat = code;
    format.fmt.pix.field = field;
  }
  return format;
}

struct FormatView {
  std::uint32_t code, field, stride, bytes;
  int width, height, planes;
};

FormatView read(const v4l2_format& format) {
  if (format.type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
    const v4l2_pix_format_mplane& pix = format.fmt.pix_mp;
    return {pix.pixelformat,
            pix.field,
            pix.plane_fmt[0].bytesperline,
            pix.plane_fmt[0].sizeimage,
            static_cast<int>(pix.width),
            static_cast<int>(pix.height),
            pix.num_planes};
  }
  const v4l2_pix_format& pix = format.fmt.pix;
  return {pix.pixelformat,
          pix.field,
          pix.bytesperline,
          pix.sizeimage,
          static_cast<int>(pix.width),
          static_cast<int>(pix.height),
          1};
}

cv::Size buffer_size(cv::Size picture, std::uint32_t field) {
  return V4L2_FIELD_HAS_T_OR_B(field) ? cv::Size(picture.width, picture.height / 2) : picture;
}

cv::Size current_size(const VideoDevice& device) {
  v4l2_format format{};
  format.type = device.buffer_type();
  device.require(VIDIOC_G_FMT, format, "ask for the size");
  const FormatView now = read(format);
  return V4L2_FIELD_HAS_T_OR_B(now.field) ? cv::Size(now.width, 2 * now.height)
                                          : cv::Size(now.width, now.height);
}

cv::Size wanted_size(const VideoDevice& device, const V4l2Options& options,
                     const Agreement& agreed) {
  if (options.width > 0) return {options.width, options.height};
  if (agreed.standard != 0)
    return (agreed.standard & V4L2_STD_525_60) != 0 ? cv::Size(720, 480) : cv::Size(720, 576);
  return choose_size(device, agreed.format->fourcc, current_size(device));
}

void require_field(const VideoDevice& device, std::uint32_t wanted, std::uint32_t got) {
  if (wanted == got) return;
  device.fail(ErrorKind::kUnsupported,
              fmt::format("field={} - the driver makes it {}; leave field= out to take what it has",
                          field_to_string(wanted), field_to_string(got)));
}

// Cropping and scaling survive the program that set them; where the driver has them, undo them.
void use_whole_sensor(const VideoDevice& device) {
  v4l2_selection whole{};
  whole.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  whole.target = V4L2_SEL_TGT_CROP_DEFAULT;
  if (device.attempt(VIDIOC_G_SELECTION, whole) != 0) return;
  whole.target = V4L2_SEL_TGT_CROP;
  device.attempt(VIDIOC_S_SELECTION, whole);
}

void fill_whole_picture(const VideoDevice& device, const v4l2_format& format) {
  const FormatView picture = read(format);
  v4l2_selection whole{};
  whole.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  whole.target = V4L2_SEL_TGT_COMPOSE;
  whole.r.width = static_cast<std::uint32_t>(picture.width);
  whole.r.height = static_cast<std::uint32_t>(picture.height);
  device.attempt(VIDIOC_S_SELECTION, whole);
}

void choose_picture(const VideoDevice& device, const V4l2Options& options, Agreement& agreed) {
  const std::uint32_t code = agreed.format->fourcc;
  const cv::Size wanted = wanted_size(device, options, agreed);
  std::uint32_t field = options.field.empty() ? kAnyField : field_from_string(options.field);
  if (options.field.empty() && agreed.standard == 0) field = V4L2_FIELD_NONE;

  use_whole_sensor(device);
  v4l2_format format = make_format(device, code, buffer_size(wanted, field), field);
  device.require(VIDIOC_S_FMT, format, "set the picture format");
  // A driver left to choose may give one field alone, which has no dark partner.
  if (field == V4L2_FIELD_ANY && !V4L2_FIELD_HAS_BOTH(read(format).field)) {
    v4l2_format woven = make_format(device, code, wanted, V4L2_FIELD_INTERLACED);
    if (device.attempt(VIDIOC_S_FMT, woven) == 0) format = woven;
  }

  fill_whole_picture(device, format);

  const FormatView got = read(format);
  if (got.code != code) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("format={} - the driver gives {} here", fourcc_to_string(code),
                            fourcc_to_string(got.code)));
  }
  if (!options.field.empty()) require_field(device, field, got.field);
  agreed.field = got.field == kAnyField ? kNoField : got.field;
  agreed.width = got.width;
  agreed.buffer_height = got.height;
  agreed.stride = std::max<std::size_t>(got.stride, agreed.format->row_bytes(got.width));
  if (agreed.format->has_wide_pixels() && agreed.stride % 2 != 0) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("its rows of {} bytes split a 16-bit pixel; try "
                            "another size= or format=",
                            agreed.stride));
  }
  agreed.planes = got.planes;
  if (options.width > 0 && agreed.picture_size() != wanted) {
    device.fail(
        ErrorKind::kUnsupported,
        fmt::format("size={}x{} - the nearest that the driver has is {}x{}", wanted.width,
                    wanted.height, agreed.picture_size().width, agreed.picture_size().height));
  }
}

double choose_rate(const VideoDevice& device, double wanted_hz, v4l2_std_id standard) {
  v4l2_streamparm parameters{};
  parameters.type = device.buffer_type();
  v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (wanted_hz > 0.0) {
    constexpr double kDenominator = 1e6;
    period.numerator = static_cast<std::uint32_t>(kDenominator);
    period.denominator = static_cast<std::uint32_t>(std::llround(wanted_hz * kDenominator));
    if (const int error = device.attempt(VIDIOC_S_PARM, parameters); error != 0)
      device.refuse(fmt::format("set fps={}", wanted_hz), error);
  }
  const bool is_told = device.attempt(VIDIOC_G_PARM, parameters) == 0 && period.numerator > 0 &&
                       period.denominator > 0;
  const double rate_hz = is_told ? static_cast<double>(period.denominator) / period.numerator : 0.0;
  if (wanted_hz > 0.0 && is_told && std::abs(rate_hz - wanted_hz) > 0.05 * wanted_hz) {
    device.fail(ErrorKind::kUnsupported,
                fmt::format("fps={} - the nearest that the driver has at this size is {:.4g}",
                            wanted_hz, rate_hz));
  }
  if ((standard & V4L2_STD_525_60) != 0) return 30000.0 / 1001.0;
  if ((standard & V4L2_STD_625_50) != 0) return 25.0;
  return rate_hz;
}

}  // namespace

Field Agreement::first_field() const noexcept {
  switch (field) {
    case V4L2_FIELD_INTERLACED_TB:
    case V4L2_FIELD_SEQ_TB:
    case V4L2_FIELD_TOP:
      return Field::kTop;
    case V4L2_FIELD_INTERLACED_BT:
    case V4L2_FIELD_SEQ_BT:
    case V4L2_FIELD_BOTTOM:
      return Field::kBottom;
    default:
      return (standard & V4L2_STD_525_60) != 0 ? Field::kBottom : Field::kTop;
  }
}

cv::Size Agreement::picture_size() const noexcept {
  return {width, is_one_field_a_buffer() ? 2 * buffer_height : buffer_height};
}

std::int64_t Agreement::picture_period_ns() const noexcept {
  return picture_rate_hz > 0.0 ? static_cast<std::int64_t>(std::llround(1e9 / picture_rate_hz)) : 0;
}

std::string Agreement::describe() const {
  const cv::Size size = picture_size();
  std::string text;
  if (!input_name.empty()) text += fmt::format("input {} ({}), ", input, input_name);
  if (standard != 0) text += fmt::format("{}, ", standard_to_string(standard));
  text += fmt::format("{}x{} {}", size.width, size.height, fourcc_to_string(format->fourcc));
  if (field != V4L2_FIELD_NONE) {
    text += fmt::format(", {} ({} field first)", field_to_string(field),
                        first_field() == Field::kTop ? "top" : "bottom");
  }
  if (picture_rate_hz > 0.0) text += fmt::format(", {:.2f} pictures/s", picture_rate_hz);
  return text;
}

void set_format(const VideoDevice& device, const Agreement& agreement) {
  const cv::Size size(agreement.width, agreement.buffer_height);
  v4l2_format format = make_format(device, agreement.format->fourcc, size, agreement.field);
  device.require(VIDIOC_S_FMT, format, "set the picture format");
  const FormatView got = read(format);
  if (got.code != agreement.format->fourcc || got.width != agreement.width ||
      got.height != agreement.buffer_height || got.field != agreement.field) {
    device.fail(ErrorKind::kDevice,
                fmt::format("it no longer gives {}: another program changed its input or standard; "
                            "open it again",
                            agreement.describe()));
  }
}

Agreement negotiate(const VideoDevice& device, const V4l2Options& options) {
  Agreement agreed;
  const v4l2_input input = choose_input(device, options.input);
  agreed.input = static_cast<int>(input.index);
  agreed.input_name = text_of(input.name);
  agreed.standard = choose_standard(device, input, options.standard);
  if (options.require_signal) require_signal(device, input.index);
  agreed.format = &choose_format(device, options.format);
  choose_picture(device, options, agreed);
  agreed.picture_rate_hz = choose_rate(device, options.fps, agreed.standard);
  set_controls(device, options.controls);
  agreed.exposure_ns = options.exposure_us > 0.0 ? set_exposure(device, options.exposure_us)
                                                 : read_exposure_ns(device);
  return agreed;
}

v4l2_std_id standard_from_string(std::string_view word) noexcept {
  const auto* const found =
      std::find_if(kStandards.begin(), kStandards.end(),
                   [&](const auto& name) { return same_word(name.word, word); });
  return found == kStandards.end() ? 0 : found->bits;
}

std::string standard_to_string(v4l2_std_id standard) {
  for (const StandardName& name : kStandards) {
    if (name.bits == standard) return std::string(name.word);
  }
  for (const StandardName& name : kStandards) {
    if ((name.bits & standard) != 0) return std::string(name.word);
  }
  return (standard & V4L2_STD_525_60) != 0 ? "525 lines" : "625 lines";
}

std::vector<std::string> standards_to_strings(v4l2_std_id standards) {
  std::vector<std::string> words;
  words.reserve(kStandards.size());
  for (const StandardName& name : kStandards) {
    if ((name.bits & standards) != 0) words.emplace_back(name.word);
  }
  return words;
}

std::uint32_t field_from_string(std::string_view word) noexcept {
  const auto* const found = std::find_if(
      kFields.begin(), kFields.end(), [&](const auto& name) { return same_word(name.word, word); });
  return found == kFields.end() ? kAnyField : found->field;
}

std::string field_to_string(std::uint32_t field) {
  const auto* const found = std::find_if(kFields.begin(), kFields.end(),
                                         [&](const auto& name) { return name.field == field; });
  return found == kFields.end() ? fmt::format("field order {}", field) : std::string(found->word);
}

}  // namespace striper::v4l2
