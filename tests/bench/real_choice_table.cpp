// SPDX-License-Identifier: Apache-2.0
// Says how often an `ok` return is the stripe in the real pictures of ../shared/realdata, a line
// per picture: those with a laser, against hand-checked paths
// (tests/support/real_stripe_paths.txt), and boards that no laser was near, where every `ok` is
// wrong. Without a model.
//
//     real_choice_table [--channel CHANNEL] [--peak brightest|continuous] [--each yes]
//
// A scanner sees all pictures of a folder, one after the other, as `capture images:` does; with
// --each a new one sees each picture.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner.hpp>

#include "support/real_stripe.hpp"
#include "support/shared_data.hpp"

namespace striper {
namespace {

using testing::RealPicture;
using testing::RealScore;

struct Settings {
  Channel channel = Channel::kAuto;
  PeakRule peak = PeakRule::kBrightest;
  bool is_each = false;
};

Settings read_arguments(const std::vector<std::string>& words) {
  Settings settings;
  for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
    const std::string& value = words[i + 1];
    if (words[i] == "--channel") {
      settings.channel = channel_from_string(value).value();
    } else if (words[i] == "--peak") {
      settings.peak = value == "continuous" ? PeakRule::kContinuous : PeakRule::kBrightest;
    } else if (words[i] == "--each") {
      settings.is_each = value == "yes";
    } else {
      throw Error(ErrorKind::kUsage, words[i] + " - not an option");
    }
  }
  return settings;
}

// One scanner for the pictures of a folder.
class FolderScanner {
 public:
  explicit FolderScanner(const Settings& settings) : settings_(settings) {}

  RealScore score(const RealPicture& picture) {
    const auto folder = std::filesystem::path(picture.file).parent_path();
    if (!scanner_ || settings_.is_each || folder != folder_ || picture.axis != axis_) {
      folder_ = folder;
      axis_ = picture.axis;
      sequence_ = 0;
      scanner_ = std::make_unique<Scanner>(options());
    }
    Frame frame;
    frame.image = cv::imread(testing::real_data(picture.file).string(),
                             cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH);
    frame.sensor_size = frame.image.size();
    frame.sequence = sequence_++;
    RealScore score;
    for (const PolarScan& scan : scanner_->process(frame)) score.add(scan, picture);
    if (score.pictures == 0) {
      throw Error(ErrorKind::kBadFile, picture.file + ": no scan, " + scanner_->last_refusal());
    }
    return score;
  }

 private:
  ScannerOptions options() const {
    ScannerOptions options;
    options.ambient.cadence = Cadence({Illumination::laser(0)});
    options.ambient.channel = settings_.channel;
    options.stripe.axis = axis_;
    options.stripe.peak = settings_.peak;
    return options;
  }

  Settings settings_;
  std::filesystem::path folder_;
  StripeAxis axis_ = StripeAxis::kColumns;
  std::uint64_t sequence_ = 0;
  std::unique_ptr<Scanner> scanner_;
};

// All lines of boards are without a stripe.
std::vector<RealPicture> boards(const std::string& set, const std::string& extension,
                                StripeAxis axis) {
  std::vector<RealPicture> pictures;
  for (const auto& entry : std::filesystem::directory_iterator(testing::real_data(set))) {
    if (entry.path().extension() != extension) continue;
    RealPicture& picture = pictures.emplace_back();
    picture.file = set + "/" + entry.path().filename().string();
    picture.axis = axis;
    picture.empty = {{0, 1 << 20}};
  }
  std::sort(pictures.begin(), pictures.end(),
            [](const RealPicture& a, const RealPicture& b) { return a.file < b.file; });
  return pictures;
}

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

void print_row(const std::string& name, StripeAxis axis, const RealScore& score) {
  std::cout << fmt::format(
      "{:66} {:7} {:6} {:6} {:8.2f} {:8.2f} {:8} {:4}/{}\n", name, to_string(axis),
      score.with_stripe, score.empty, percent(score.found, score.with_stripe),
      percent(score.wrong, score.judged()), score.unjudged, score.unseen, score.pictures);
}

void print_set(const Settings& settings, const std::vector<RealPicture>& pictures,
               std::vector<std::string>& summary) {
  FolderScanner scanner(settings);
  RealScore sum;
  for (const RealPicture& picture : pictures) {
    const RealScore score = scanner.score(picture);
    print_row(picture.file, picture.axis, score);
    sum.add(score);
  }
  summary.push_back(fmt::format(
      "{:40} {:7} found {:6.2f} %  wrong {:6.2f} %  no stripe said in {} of {}",
      pictures.front().set(), to_string(pictures.front().axis), percent(sum.found, sum.with_stripe),
      percent(sum.wrong, sum.judged()), sum.unseen, sum.pictures));
}

void run(const Settings& settings) {
  std::cout << fmt::format("{:66} {:7} {:>6} {:>6} {:>8} {:>8} {:>8} {:>6}\n", "picture", "axis",
                           "stripe", "empty", "found %", "wrong %", "unjudged", "unseen");
  std::vector<std::string> summary;
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    print_set(settings, boards("bouguet-calib-example", ".tif", axis), summary);
    print_set(settings, boards("opencv-left-right", ".jpg", axis), summary);
  }
  const auto pictures =
      testing::load_real_pictures(testing::source_path("tests/support/real_stripe_paths.txt"));
  for (auto first = pictures.begin(); first != pictures.end();) {
    const auto last = std::find_if(first, pictures.end(), [&](const RealPicture& picture) {
      return picture.set() != first->set();
    });
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
