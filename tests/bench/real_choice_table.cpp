// SPDX-License-Identifier: Apache-2.0
// Says how often an `ok` return is the stripe in the real images of ../shared/realdata, a line
// per image: those with a laser, against hand-checked paths
// (tests/support/real_stripe_paths.txt), and boards that no laser was near, where every `ok` is
// wrong. Without a model.
//
//     real_choice_table [--channel CHANNEL] [--peak brightest|continuous] [--each yes]
//
// A scanner sees all images of a folder, one after the other, as `capture images:` does; with
// --each a new one sees each image.
#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include <striper/core/error.hpp>

#include "support/real_stripe.hpp"

namespace striper {
namespace {

using testing::RealImage;
using testing::RealScanner;
using testing::RealScore;
using testing::RealSettings;

RealSettings read_arguments(const std::vector<std::string>& words) {
  RealSettings settings;
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    const std::string& value = words[i + 1];
    if (words[i] == "--channel") {
      settings.channel = channel_from_string(value).value();
    } else if (words[i] == "--peak") {
      settings.peak = value == "brightest" ? PeakRule::kBrightest : PeakRule::kContinuous;
    } else if (words[i] == "--each") {
      settings.is_each = value == "yes";
    } else {
      throw Error(ErrorKind::kUsage, words[i] + " - not an option");
    }
  }
  return settings;
}

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void print_row(const std::string& name, StripeAxis axis, const RealScore& score) {
  std::cout << fmt::format(
      "{:66} {:7} {:6} {:6} {:8.2f} {:8.2f} {:8} {:4}/{}\n", name, to_string(axis),
      score.with_stripe, score.empty, percent(score.found, score.with_stripe),
      percent(score.wrong, score.judged()), score.unjudged, score.unseen, score.images);
}

void print_set(const RealSettings& settings, const std::vector<RealImage>& images,
               std::vector<std::string>& summary) {
  RealScanner scanner(settings);
  RealScore sum;
  for (const RealImage& image : images) {
    const RealScore score = scanner.score(image);
    print_row(image.file, image.axis, score);
    sum.add(score);
  }
  summary.push_back(fmt::format(
      "{:40} {:7} found {:6.2f} %  wrong {:6.2f} %  no stripe said in {} of {}",
      images.front().set(), to_string(images.front().axis), percent(sum.found, sum.with_stripe),
      percent(sum.wrong, sum.judged()), sum.unseen, sum.images));
}

void run(const RealSettings& settings) {
  std::cout << fmt::format("{:66} {:7} {:>6} {:>6} {:>8} {:>8} {:>8} {:>6}\n", "image", "axis",
                           "stripe", "empty", "found %", "wrong %", "unjudged", "unseen");
  std::vector<std::string> summary;
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    print_set(settings, testing::real_boards("bouguet-calib-example", ".tif", axis), summary);
    print_set(settings, testing::real_boards("opencv-left-right", ".jpg", axis), summary);
  }
  const auto images = testing::real_images();
  for (auto first = images.begin(); first != images.end();) {
    const auto last = std::find_if(
        first, images.end(), [&](const RealImage& image) { return image.set() != first->set(); });
    print_set(settings, {first, last}, summary);
    first = last;
  }
  std::cout << "\n";
  for (const std::string& line : summary) std::cout << line << "\n";
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  try {
    striper::run(striper::read_arguments({argv + 1, argv + argc}));
  } catch (const std::exception& error) {
    std::cerr << "real_choice_table: " << error.what() << "\n";
    return 1;
  }
}
