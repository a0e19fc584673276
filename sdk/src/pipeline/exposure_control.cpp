// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include <striper/core/error.hpp>
#include <striper/pipeline/exposure_control.hpp>

namespace striper {
namespace {

constexpr const char* kName = "exposure_us";

// Scans come no later than so many frames after theirs: the longest pattern and a few.
constexpr std::size_t kFrames = 16;

// So many rows and columns of an image tell how bright it is.
constexpr int kSampled = 100;
// What most of the pixels do not exceed: the stripe is fewer.
constexpr double kMostPixels = 0.95;

// A tenth of the stripe clipped, and the rest says too little of how bright that is.
constexpr double kManyClipped = 0.1;
constexpr double kFewLines = 0.02;  // Fewer good ones than this are no stripe to go by.

// Of an image without a stripe: so much of it clipped, and light hides it; so dark at most, and it
// may be too short.
constexpr double kBlinded = 0.02;
constexpr double kDark = 0.25;

// Clipped pixels do not say by how much: a step down is a third of the way of light that becomes a
// hundred times as bright, a step up half of one down.
constexpr double kStepDown = 1.0 / 5.0;
constexpr double kStepUp = 2.0;

// A camera rounds what it is told.
constexpr double kSameExposure = 0.1;

// Beside the stripe, out of its flanks: so many of its widths and pixels off.
constexpr double kWidthsBeside = 4.0;
constexpr double kPixelsBeside = 2.0;

bool is_clipped(ReturnStatus status) {
  return status == ReturnStatus::kSaturated || status == ReturnStatus::kBlind;
}

template <typename Pixel>
void sample(const cv::Mat& image, std::vector<std::uint16_t>& pixels) {
  const int row_step = std::max(1, image.rows / kSampled);
  const int step = std::max(1, image.cols / kSampled);
  const int channels = image.channels();
  pixels.clear();
  for (int row = 0; row < image.rows; row += row_step) {
    const auto* const first = image.ptr<Pixel>(row);
    for (int column = 0; column < image.cols; column += step) {
      const auto* const pixel = first + static_cast<std::ptrdiff_t>(column) * channels;
      pixels.push_back(*std::max_element(pixel, pixel + channels));
    }
  }
}

// The brightest channel of the pixel at a place of the sensor; 0 outside of the image.
int pixel_at(const Frame& frame, double u_px, double v_px) {
  const long column = std::lround(frame.grid.u.index(u_px));
  const long row = std::lround(frame.grid.v.index(v_px));
  const cv::Mat& image = frame.image;
  if (column < 0 || row < 0 || column >= image.cols || row >= image.rows) return 0;
  int brightest = 0;
  for (int channel = 0; channel < image.channels(); ++channel) {
    const long at = column * image.channels() + channel;
    const int value = image.depth() == CV_8U ? image.ptr<std::uint8_t>(static_cast<int>(row))[at]
                                             : image.ptr<std::uint16_t>(static_cast<int>(row))[at];
    brightest = std::max(brightest, value);
  }
  return brightest;
}

int level_at(const Frame& frame, double u_px, double v_px, double off_u_px, double off_v_px) {
  return std::max(pixel_at(frame, u_px - off_u_px, v_px - off_v_px),
                  pixel_at(frame, u_px + off_u_px, v_px + off_v_px));
}

}  // namespace

ExposureControl::ExposureControl(Controls& controls, const ExposureOptions& options)
    : controls_(controls), options_(options) {
  const std::vector<Control> all = controls.list();
  const auto exposure =
      std::find_if(all.begin(), all.end(), [](const Control& one) { return one.name == kName; });
  if (exposure == all.end() || !exposure->state.is_writable) {
    throw Error(ErrorKind::kUnsupported,
                "automatic exposure needs a source whose exposure_us can be set");
  }
  shortest_us_ = exposure->state.minimum.front();
  longest_us_ = exposure->state.maximum.front();
  exposure_us_ = exposure->state.value.front();
}

void ExposureControl::update(const Frame& frame, ScanSpan scans) {
  if (frame.status != FrameStatus::kOk || frame.image.empty()) return;
  if (images_.size() == kFrames) images_.erase(images_.begin());
  images_.push_back(look_at(frame));
  for (const PolarScan& scan : scans) {
    const Image* const image = image_of(scan);
    if (image == nullptr) continue;
    remember(scan, *image);
    if (places_.empty() && is_as_set(*image)) set(wanted_without_stripe(*image));
  }
  if (!places_.empty()) set(wanted_for(frame, images_.back()));
}

ExposureControl::Image ExposureControl::look_at(const Frame& frame) {
  Image image;
  image.sequence = frame.sequence;
  image.exposure_us =
      frame.exposure_ns > 0 ? 1e-3 * static_cast<double>(frame.exposure_ns) : exposure_us_;
  if (frame.image.depth() == CV_8U) {
    sample<std::uint8_t>(frame.image, pixels_);
  } else {
    sample<std::uint16_t>(frame.image, pixels_);
  }
  const int full_scale_dn = frame.full_scale_dn();
  const auto clipped = std::count_if(pixels_.begin(), pixels_.end(),
                                     [&](std::uint16_t value) { return value >= full_scale_dn; });
  const auto all = static_cast<double>(pixels_.size());
  const auto most = pixels_.begin() + static_cast<std::ptrdiff_t>(kMostPixels * (all - 1.0));
  std::nth_element(pixels_.begin(), most, pixels_.end());
  image.clipped = static_cast<double>(clipped) / all;
  image.brightness = static_cast<double>(*most) / full_scale_dn;
  return image;
}

const ExposureControl::Image* ExposureControl::image_of(const PolarScan& scan) const noexcept {
  const auto found = std::find_if(images_.rbegin(), images_.rend(),
                                  [&](const Image& one) { return one.sequence == scan.sequence; });
  return found != images_.rend() ? &*found : nullptr;
}

// Of an image that was taken before something else was set nothing new is to be learnt where only
// steps help.
bool ExposureControl::is_as_set(const Image& image) const noexcept {
  return std::abs(image.exposure_us - exposure_us_) <= kSameExposure * exposure_us_;
}

// Where the stripe is and what the laser gives there; what a scan shows that is neither clipped nor
// has a stripe is forgotten.
void ExposureControl::remember(const PolarScan& scan, const Image& image) {
  const auto is_good = [](const Return& one) { return one.status == ReturnStatus::kOk; };
  const auto good = std::count_if(scan.returns.begin(), scan.returns.end(), is_good);
  const auto clipped = std::count_if(scan.returns.begin(), scan.returns.end(),
                                     [](const Return& one) { return is_clipped(one.status); });
  if (static_cast<double>(clipped) > kManyClipped * static_cast<double>(good + clipped)) {
    is_clipped_ = is_as_set(image);
    return;
  }
  places_.clear();
  if (static_cast<double>(good) < kFewLines * static_cast<double>(scan.returns.size())) return;
  const bool columns = scan.axis == StripeAxis::kColumns;
  for (const Return& one : scan.returns) {
    if (!is_good(one)) continue;
    const double off_px = kPixelsBeside + kWidthsBeside * one.width_px;
    places_.push_back({one.u_px, one.v_px, columns ? 0.0 : off_px, columns ? off_px : 0.0,
                       one.intensity_dn / image.exposure_us});
  }
}

// The exposure that would have been right for a frame, lit or dark: by the light beside the stripe,
// and the stripe of late.
double ExposureControl::wanted_for(const Frame& frame, const Image& image) {
  rates_.clear();
  double clipped = 0.0;
  for (const Place& place : places_) {
    const int level_dn = level_at(frame, place.u_px, place.v_px, place.off_u_px, place.off_v_px);
    if (level_dn >= frame.full_scale_dn()) clipped += 1.0;
    rates_.push_back(place.stripe_dn_per_us + level_dn / image.exposure_us);
  }
  const auto count = static_cast<double>(rates_.size());
  const bool is_too_bright = clipped > kManyClipped * count || std::exchange(is_clipped_, false);
  if (is_too_bright) return is_as_set(image) ? kStepDown * image.exposure_us : exposure_us_;
  const auto at = rates_.begin() + static_cast<std::ptrdiff_t>(options_.percentile * (count - 1.0));
  std::nth_element(rates_.begin(), at, rates_.end());
  return options_.target * frame.full_scale_dn() / *at;
}

double ExposureControl::wanted_without_stripe(const Image& image) const {
  if (image.clipped > kBlinded) return kStepDown * image.exposure_us;
  if (image.brightness < kDark) return kStepUp * image.exposure_us;
  return exposure_us_;
}

void ExposureControl::set(double wanted_us) {
  const double within = std::clamp(wanted_us, shortest_us_, longest_us_);
  const double ratio = within / exposure_us_;
  if (ratio < options_.tolerance && ratio > 1.0 / options_.tolerance) return;
  exposure_us_ = controls_.set(kName, {within}).state.value.front();
  ++changes_;
}

}  // namespace striper
