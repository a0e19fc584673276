// SPDX-License-Identifier: Apache-2.0
// Learns what tells the stripe from the background: makes the trees of
// sdk/src/stripe/select/choice_trees.cpp.
//
//     choice_training rows OUT rooms|off|sessions FIRST COUNT FRAMES [known|unknown] [turned]
//     choice_training real OUT PART PARTS
//     choice_training fit first|second OUT.inc TREES RATE ROWS...
//
// `rows` writes what every candidate of random scenes shows, and whether it is the stripe; with
// `unknown` the model does not say how wide the stripe is; `turned` searches along the other axis,
// where there is none. `real` writes each PARTS-th of the real pictures, from number PART; the
// pictures with an even number are for development, the others held out. The first forest says
// what is within 2.5 pixels or 1.2 widths of a stripe, the second one, whose rows must be written
// by a program that has the first one in it and of other scenes, what is right as `ok` has it.
//
// So were the present ones made: first, of rooms 1000 and sessions 2, of second, 2000:
//     rows rooms_a rooms 1000 110 1; the 50 first ones unknown; all turned, known and unknown;
//     rows sessions_a sessions 1000 10 0; real real_a 0 4; fit first first_forest.inc 100 .25
//     the same from 2000 and real 2 4; fit second second_forest.inc 120 .2
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <opencv2/core/utility.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/core/error.hpp>
#include <striper/pipeline/expect_stripe.hpp>

#include "boosted_trees.hpp"
#include "stripe/profile_extractor.hpp"
#include "support/choice_trial.hpp"
#include "support/real_stripe.hpp"

namespace striper {
namespace {

using detail::Evidence;
using testing::ChoiceTrial;
using testing::Judgement;
using testing::RealPicture;

constexpr double kNearPx = 2.5;
constexpr double kNearWidths = 1.2;
// What the first forest says less of is not looked at again.
constexpr float kHopeless = -5.0F;
// Of what is no stripe the first forest sees one in so many.
constexpr unsigned kSparse = 4;

struct Row {
  Evidence evidence;
  std::uint8_t is_near = 0;
  std::uint8_t is_right = 0;
  std::uint8_t is_known = 1;  // 0: at an edge between two stripes, or of nothing known.
};

// Where a candidate is, as it is or would be reported.
struct Place {
  int line;
  double across_px;
  double sigma_px;
  double width_px;
};
using Judge = std::function<void(const Place& place, Row& row)>;

class RowFile {
 public:
  explicit RowFile(const std::string& path) : file_(path, std::ios::binary) {}

  /// The candidates of the frame that was last extracted.
  void add(const detail::ProfileExtractor& extractor, const Stripe& stripe, const Judge& judge) {
    const detail::StripeChoice& choice = extractor.choice();
    if (choice.is_plain()) return;
    const detail::StripePieces& pieces = choice.pieces();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const detail::Candidate& c = pieces.candidate(i);
      Place place{c.line, static_cast<double>(c.across) + extractor.searched_from_px(),
                  std::hypot(static_cast<double>(c.sigma), choice.scatter_px(i)),
                  static_cast<double>(c.width)};
      const auto line = static_cast<std::size_t>(c.line);
      const bool is_chosen = choice.of_line(c.line).candidate == static_cast<std::int32_t>(i);
      if (is_chosen && std::isfinite(stripe.across_px[line])) {
        place.across_px = stripe.across_px[line];
        place.sigma_px = static_cast<double>(stripe.sigma_px[line]);
      }
      Row row{choice.evidence(i)};
      judge(place, row);
      file_.write(reinterpret_cast<const char*>(&row), sizeof row);
    }
  }

 private:
  std::ofstream file_;
};

void judge_by_truth(const Truth& truth, const Place& place, Row& row) {
  const testing::JudgedPosition judged =
      testing::judge_position(truth, place.line, place.across_px, place.sigma_px);
  const double near_px = std::max(kNearPx, kNearWidths * place.width_px);
  row.is_right = judged.judgement == Judgement::kRight ? 1 : 0;
  row.is_known = judged.judgement != Judgement::kMixed ? 1 : 0;
  row.is_near = row.is_right != 0 || std::abs(judged.error_px) < near_px ? 1 : 0;
}

// Whatever it takes for a stripe is to have a position.
ExtractOptions training_options(ExtractOptions options) {
  options.min_confidence = 0.0;
  return options;
}

void write_trial(const ChoiceTrial& trial, bool is_turned, RowFile& file) {
  testing::TrialCamera camera(trial);
  const ScannerOptions options = camera.options();
  ExtractOptions stripe_options = training_options(options.stripe);
  if (!is_turned) stripe_options.expected = {expect_stripe(camera.model(), 0, options.scan)};
  detail::ProfileExtractor extractor(stripe_options);
  AmbientStage stage(options.ambient);
  Stripe stripe;
  for (int i = 0; i < camera.frames(); ++i) {
    const auto picture = static_cast<std::uint64_t>(i);
    stage.push(camera.render(picture));
    const Truth truth = camera.truth(picture);
    while (const LitFrame* lit = stage.next()) {
      LitFrame frame = *lit;
      if (is_turned) frame.lit = cv::Mat(lit->lit.t());
      extractor.extract(frame, stripe);
      file.add(extractor, stripe, [&](const Place& place, Row& row) {
        if (!is_turned) judge_by_truth(truth, place, row);
      });
    }
  }
}

void write_rows(const std::vector<std::string>& words) {
  RowFile file(words.at(1));
  ChoiceTrial trial{.kind = words.at(2)};
  const std::uint64_t first = std::stoull(words.at(3));
  trial.frames = std::stoi(words.at(5));
  bool is_turned = false;
  for (std::size_t i = 6; i < words.size(); ++i) {
    if (words[i] == "unknown") trial.knows_stripe = false;
    if (words[i] == "turned") is_turned = true;
  }
  for (trial.seed = first; trial.seed < first + std::stoull(words.at(4)); ++trial.seed) {
    write_trial(trial, is_turned, file);
  }
}

std::vector<RealPicture> all_real_pictures() {
  std::vector<RealPicture> all;
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    for (const auto& [set, extension] :
         {std::pair("bouguet-calib-example", ".tif"), std::pair("opencv-left-right", ".jpg")}) {
      const std::vector<RealPicture> boards = testing::real_boards(set, extension, axis);
      all.insert(all.end(), boards.begin(), boards.end());
    }
  }
  const std::vector<RealPicture> pictures = testing::real_pictures();
  all.insert(all.end(), pictures.begin(), pictures.end());
  return all;
}

void judge_by_path(const RealPicture& picture, const Place& place, Row& row) {
  const std::optional<double> at = picture.stripe_at(place.line);
  const bool is_right = at && std::abs(*at - place.across_px) <= testing::RealScore::kRightPx;
  row.is_right = row.is_near = is_right ? 1 : 0;
  row.is_known = at || picture.is_empty_at(place.line) ? 1 : 0;
}

// All of a folder by one extractor, one after the other, as `capture images:` does.
void write_real(const std::vector<std::string>& words) {
  RowFile file(words.at(1));
  const std::size_t part = std::stoul(words.at(2));
  const std::size_t parts = std::stoul(words.at(3));
  const std::vector<RealPicture> all = all_real_pictures();
  std::unique_ptr<detail::ProfileExtractor> extractor;
  std::unique_ptr<AmbientStage> stage;
  std::string last;
  Stripe stripe;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string folder = std::filesystem::path(all[i].file).parent_path().string() +
                               std::string(to_string(all[i].axis));
    if (folder != last) {
      last = folder;
      const ScannerOptions options = testing::RealSettings{}.options(all[i].axis);
      extractor = std::make_unique<detail::ProfileExtractor>(training_options(options.stripe));
      stage = std::make_unique<AmbientStage>(options.ambient);
    }
    stage->push(all[i].frame(i));
    while (const LitFrame* lit = stage->next()) {
      extractor->extract(*lit, stripe);
      if (i % parts != part) continue;
      file.add(*extractor, stripe,
               [&](const Place& place, Row& row) { judge_by_path(all[i], place, row); });
    }
  }
}

bench::Examples examples_of(const std::vector<std::string>& paths, bool is_second) {
  bench::Examples examples;
  examples.kinds = is_second ? Evidence::kCount : Evidence::kFirstKinds;
  std::mt19937 dice(3);
  for (const std::string& path : paths) {
    std::ifstream file(path, std::ios::binary);
    for (Row row; file.read(reinterpret_cast<char*>(&row), sizeof row);) {
      if (row.is_known == 0) continue;
      if (is_second && row.evidence.of[Evidence::kFirst] < kHopeless) continue;
      const std::uint8_t is_stripe = is_second ? row.is_right : row.is_near;
      const bool is_sparse = !is_second && is_stripe == 0;
      if (is_sparse && dice() % kSparse != 0) continue;
      examples.evidence.push_back(row.evidence);
      examples.is_stripe.push_back(is_stripe);
      examples.weight.push_back(is_sparse ? static_cast<float>(kSparse) : 1.0F);
    }
  }
  return examples;
}

void fit(const std::vector<std::string>& words) {
  const bool is_second = words.at(1) == "second";
  const bench::Examples examples = examples_of({words.begin() + 5, words.end()}, is_second);
  std::cout << examples.evidence.size() << " candidates\n";
  const bench::BoostOptions options{.trees = std::stoi(words.at(3)),
                                    .rate = std::stod(words.at(4))};
  bench::write_trees(bench::boost(examples, options), is_second ? "Second" : "First", words.at(2));
}

void run(const std::vector<std::string>& words) {
  const std::string& mode = words.at(0);
  if (mode == "rows") return write_rows(words);
  if (mode == "real") return write_real(words);
  if (mode == "fit") return fit(words);
  throw Error(ErrorKind::kUsage, mode + " - expected rows, real or fit");
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  try {
    striper::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "choice_training: " << error.what() << "\n";
    return 1;
  }
}
