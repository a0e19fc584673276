// SPDX-License-Identifier: Apache-2.0
#include "support/real_stripe.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>

#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>

#include "support/shared_data.hpp"

namespace striper::testing {
namespace {

void read_line(const std::string& text, std::vector<RealImage>& images) {
  std::istringstream words(text);
  std::string key;
  words >> key;
  if (key.empty() || key[0] == '#') return;
  const auto refuse = [&] { throw Error(ErrorKind::kBadFile, "real_stripe_paths.txt: " + text); };
  if (key == "picture") {
    RealImage& image = images.emplace_back();
    std::string axis;
    if (!(words >> image.file >> axis)) refuse();
    image.axis = stripe_axis_from_string(axis).value();
    return;
  }
  if (images.empty() || (key != "stripe" && key != "empty")) refuse();
  std::vector<Eigen::Vector2d> pairs;
  for (Eigen::Vector2d pair; words >> pair.x() >> pair.y();) pairs.push_back(pair);
  if (pairs.empty() || !words.eof()) refuse();
  if (key == "stripe") {
    images.back().stripes.push_back(pairs);
  } else {
    images.back().empty.emplace_back(static_cast<int>(pairs[0].x()),
                                     static_cast<int>(pairs[0].y()));
  }
}

}  // namespace

std::optional<double> RealImage::stripe_at(int line) const {
  for (const auto& knots : stripes) {
    for (std::size_t i = 1; i < knots.size(); ++i) {
      if (line < knots[i - 1].x() || line > knots[i].x()) continue;
      const double share = (line - knots[i - 1].x()) / (knots[i].x() - knots[i - 1].x());
      return knots[i - 1].y() + share * (knots[i].y() - knots[i - 1].y());
    }
  }
  return std::nullopt;
}

bool RealImage::is_empty_at(int line) const {
  if (stripe_at(line)) return false;
  return std::any_of(empty.begin(), empty.end(), [line](const std::pair<int, int>& part) {
    return line >= part.first && line <= part.second;
  });
}

Frame RealImage::frame(std::uint64_t sequence) const {
  Frame frame;
  frame.image = cv::imread(real_data(file).string(), cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
  if (frame.image.empty()) throw Error(ErrorKind::kBadFile, file);
  frame.sensor_size = frame.image.size();
  frame.sequence = sequence;
  return frame;
}

std::vector<RealImage> real_images() {
  const auto path = source_path("tests/support/real_stripe_paths.txt");
  std::ifstream file(path);
  if (!file) throw Error(ErrorKind::kNotFound, path.string());
  std::vector<RealImage> images;
  for (std::string line; std::getline(file, line);) read_line(line, images);
  return images;
}

void RealScore::add(const PolarScan& scan, const RealImage& image) {
  ++images;
  unseen += scan.is_stripe_seen ? 0 : 1;
  for (std::size_t i = 0; i < scan.returns.size(); ++i) {
    const Return& r = scan.returns[i];
    const bool is_ok = r.status == ReturnStatus::kOk;
    const double at = r.across_px(scan.axis);
    const auto stripe = image.stripe_at(static_cast<int>(i));
    const bool has_none = image.is_empty_at(static_cast<int>(i));
    const bool is_right = is_ok && stripe && std::abs(at - *stripe) <= kRightPx;
    ++lines;
    with_stripe += stripe ? 1 : 0;
    empty += has_none ? 1 : 0;
    ok += is_ok ? 1 : 0;
    found += is_right ? 1 : 0;
    wrong += is_ok && !is_right && (stripe || has_none) ? 1 : 0;
    unjudged += is_ok && !stripe && !has_none ? 1 : 0;
  }
}

void RealScore::add(const RealScore& other) {
  lines += other.lines;
  with_stripe += other.with_stripe;
  empty += other.empty;
  ok += other.ok;
  found += other.found;
  wrong += other.wrong;
  unjudged += other.unjudged;
  images += other.images;
  unseen += other.unseen;
}

std::vector<RealImage> real_boards(const std::string& set, const std::string& extension,
                                   StripeAxis axis) {
  std::vector<RealImage> images;
  for (const auto& entry : std::filesystem::directory_iterator(real_data(set))) {
    if (entry.path().extension() != extension) continue;
    RealImage& image = images.emplace_back();
    image.file = set + "/" + entry.path().filename().string();
    image.axis = axis;
    image.empty = {{0, 1 << 20}};
  }
  std::sort(images.begin(), images.end(),
            [](const RealImage& a, const RealImage& b) { return a.file < b.file; });
  return images;
}

RealScore RealScanner::score(const RealImage& image) {
  const auto folder = std::filesystem::path(image.file).parent_path();
  if (!scanner_ || settings_.is_each || folder != folder_ || image.axis != axis_) {
    folder_ = folder;
    axis_ = image.axis;
    sequence_ = 0;
    scanner_ = std::make_unique<Scanner>(settings_.options(axis_));
  }
  const Frame frame = image.frame(sequence_++);
  RealScore score;
  for (const PolarScan& scan : scanner_->process(frame)) score.add(scan, image);
  if (score.images == 0) {
    throw Error(ErrorKind::kBadFile, image.file + ": no scan");
  }
  return score;
}

ScannerOptions RealSettings::options(StripeAxis axis) const {
  ScannerOptions options;
  options.ambient.pattern = IlluminationPattern({Illumination::laser(0)});
  options.ambient.channel = channel;
  options.stripe.axis = axis;
  options.stripe.peak = peak;
  options.stripe.expected = expected;
  return options;
}

ExpectedStripe stripe_of_look(double sigma_px, float amplitude_dn) {
  constexpr std::size_t kLongest = 4096;  // Of the sets' scan lines.
  ExpectedStripe expected;
  expected.sigma_px = sigma_px;
  expected.amplitude_dn.assign(kLongest, amplitude_dn);
  return expected;
}

}  // namespace striper::testing
