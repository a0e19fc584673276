// SPDX-License-Identifier: Apache-2.0
// Learns what tells the stripe from the background: makes the trees of
// sdk/src/stripe/select/forests/choice_trees.cpp, and writes what fit_patches.py and fit_bridges.py
// learn of.
// train_choice.sh says of what the present ones were made.
//
//     choice_training rows OUT KIND FIRST COUNT FRAMES WORDS...
//     choice_training real OUT PART PARTS [each] [chosen]
//     choice_training patches OUT KIND FIRST COUNT FRAMES WORDS...
//     choice_training bridges OUT KIND FIRST COUNT FRAMES WORDS...
//     choice_training fit FOREST OUT.inc TREES RATE REAL ROWS...
//     choice_training fit none FOREST OUT.inc
//
// FOREST is `first`, `second`, `scatter`, `third`, `fourth`, `clipped` or `fifth`. `fit none` makes
// one that says nothing: `scatter`, `fourth`, `clipped` or `fifth`.
//
// `rows` writes what every candidate of random scenes shows, and whether it is the stripe.
// Words: `unknown`, there is no model that says how wide and high the stripe is and where it can
// be; `turned`, it searches along the other axis, where there is none; `green` or `red`, a
// colour camera's difference, or with `own` after it the laser's own channel; `jpeg`, compressed as
// cameras on USB do; `bright`, so bright that stripes clip; `shaded`, something keeps the laser
// from parts of the image; `chosen`, only what is reported. KIND is that of
// tests/support/choice_trial.hpp. `patches` writes for fit_patches.py what random scenes' images
// show about returns that are doubted, and what else is known of those: OUT.patches, OUT.returns
// and OUT.evidence. `bridges` writes for fit_bridges.py what is known of what was measured in gaps
// between sure returns, and whether it is the stripe. `real` writes each PARTS-th of the real
// images, from number PART; the images with an even number are for development, the others held
// out; with `each`, a new scanner sees each image; `chosen` as above. REAL is the weight of what
// files with "real" in their name hold; scatter has no use for them.
//
// The first and the second forest say what is within near_within_px of a stripe (of a
// real image, what is right). The scatter forest says how much more than reckoned the position
// of what was chosen scatters; the tail forest, written beside it, by how much that must be
// wider for three sigmas to hold. The third forest says what is right as `ok` has it: within .5
// pixels or three of those sigmas; the fourth, what is right of what is reported, by how it was
// measured too; the clipped forest and its tails, what scatter does, of clipped returns; the fifth,
// what is right once those were widened, by what the fourth says of those about it. The rows of
// each must be written by a program that has those before it in it, and of other scenes; those of
// scatter, by one whose scatter forest says nothing (`fit none`). What was chosen there is the
// choice of the third forest of before.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include <striper/ambient/ambient_stage.hpp>
#include <striper/core/error.hpp>

#include "boosted_trees.hpp"
#include "bridge_file.hpp"
#include "patch_files.hpp"
#include "stripe/profile_extractor.hpp"
#include "stripe/report/sigma_limit.hpp"
#include "stripe/report/what_is_right.hpp"
#include "stripe/select/evidence/weighed_candidates.hpp"
#include "support/choice_trial.hpp"
#include "support/extracted_trial.hpp"
#include "support/real_stripe.hpp"

namespace striper {
namespace {

using detail::Evidence;
using testing::ChoiceTrial;
using testing::Judgement;
using testing::RealImage;

// What a forest says less of is not looked at again.
constexpr float kHopeless = detail::WeighedCandidates::kHopeless;
// What was chosen and is less probable has no error that is looked at; there the third forest says
// so, which is not there yet.
constexpr float kHopelessChosen = detail::StripeChoice::kHopelessChosen;
// Of what is no stripe the first forest sees one in so many.
constexpr unsigned kSparse = 4;

struct Row {
  Evidence evidence;
  std::uint8_t is_near = 0;
  std::uint8_t is_right = 0;
  std::uint8_t is_chosen = 0;
  std::uint8_t is_clipped = 0;
  float error_px = 0.0F;  // From the stripe, and the sigma that is or would be reported.
  float sigma_px = 0.0F;
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
  RowFile(const std::string& path, bool is_only_chosen)
      : file_(path, std::ios::binary), is_only_chosen_(is_only_chosen) {}

  /// The candidates of the frame that was last extracted.
  void add(const detail::ProfileExtractor& extractor, const Stripe& stripe, const Judge& judge) {
    const detail::StripeChoice& choice = extractor.choice();
    if (choice.is_plain()) return;
    const detail::StripePieces& pieces = choice.pieces();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const detail::Candidate& c = pieces.candidate(i);
      Place place{
          c.line, static_cast<double>(c.across) + extractor.searched_from_px(),
          static_cast<double>(std::min(std::hypot(c.sigma, choice.scatter_px(i)),
                                       sigma_limit_px(choice, static_cast<std::int32_t>(i), 1.0))),
          static_cast<double>(c.width)};
      Row row;
      row.is_clipped = c.is_clipped ? 1 : 0;
      const auto line = static_cast<std::size_t>(c.line);
      const bool is_chosen = choice.of_line(c.line).candidate == static_cast<std::int32_t>(i);
      const bool is_reported =
          std::isfinite(stripe.across_px[line]) && !extractor.is_bridged(c.line);
      if (is_chosen && is_reported) {
        place.across_px = stripe.across_px[line];
        place.sigma_px = static_cast<double>(stripe.sigma_px[line]);
        row.is_chosen = 1;
      }
      if (is_only_chosen_ && row.is_chosen == 0) continue;
      row.evidence = row.is_chosen != 0 ? extractor.evidence(stripe, c.line) : choice.evidence(i);
      judge(place, row);
      file_.write(reinterpret_cast<const char*>(&row), sizeof row);
    }
  }

 private:
  std::ofstream file_;
  bool is_only_chosen_;
};

void judge_by_truth(const Truth& truth, const Place& place, Row& row) {
  const testing::JudgedPosition judged =
      testing::judge_position(truth, place.line, place.across_px, place.sigma_px);
  row.is_right = judged.judgement == Judgement::kRight ? 1 : 0;
  row.is_known = judged.judgement != Judgement::kMixed ? 1 : 0;
  row.error_px = static_cast<float>(judged.error_px);
  row.sigma_px = static_cast<float>(place.sigma_px);
  const float near_px = detail::near_within_px(static_cast<float>(place.width_px));
  row.is_near = row.is_right != 0 || std::abs(row.error_px) < near_px ? 1 : 0;
}

void write_trial(const ChoiceTrial& trial, bool is_turned, RowFile& file) {
  testing::extract_trial(trial, {.is_turned = is_turned}, [&](const testing::Extracted& e) {
    file.add(e.extractor, e.stripe, [&](const Place& place, Row& row) {
      if (!is_turned) judge_by_truth(e.truth, place, row);
    });
  });
}

void add_word(const std::string& word, ChoiceTrial& trial, bool& is_turned) {
  const std::set<std::string> words{"unknown", "turned", "jpeg",   "green", "red",
                                    "own",     "bright", "chosen", "shaded"};
  if (!words.contains(word)) throw Error(ErrorKind::kUsage, "rows: " + word + " - no word");
  if (word == "unknown") trial.knows_stripe = false;
  if (word == "turned") is_turned = true;
  if (word == "bright") trial.is_overexposed = true;
  if (word == "shaded") trial.is_shaded = true;
  if (word == "jpeg") trial.is_compressed = true;
  if (word == "green") trial.channel = Channel::kGreenMinusRed;
  if (word == "red") trial.channel = Channel::kRedMinusGreen;
  if (word == "green" || word == "red") trial.colour = word;
  if (word == "own") trial.channel.reset();
}

bool has(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

void for_each_trial(const std::vector<std::string>& words,
                    const std::function<void(const ChoiceTrial&, bool is_turned)>& visit) {
  ChoiceTrial trial{.kind = words.at(2)};
  const std::uint64_t first = std::stoull(words.at(3));
  trial.frames = std::stoi(words.at(5));
  bool is_turned = false;
  for (std::size_t i = 6; i < words.size(); ++i) add_word(words[i], trial, is_turned);
  for (trial.seed = first; trial.seed < first + std::stoull(words.at(4)); ++trial.seed) {
    visit(trial, is_turned);
  }
}

void write_rows(const std::vector<std::string>& words) {
  RowFile file(words.at(1), has(words, "chosen"));
  for_each_trial(words, [&](const ChoiceTrial& trial, bool is_turned) {
    write_trial(trial, is_turned, file);
  });
}

void write_patches(const std::vector<std::string>& words) {
  if (has(words, "unknown") || has(words, "turned")) {
    throw Error(ErrorKind::kUsage, "patches: only where it is known what the stripe looks like");
  }
  PatchFiles files(words.at(1));
  for_each_trial(words, [&](const ChoiceTrial& trial, bool is_turned) {
    testing::extract_trial(trial, {.is_turned = is_turned},
                           [&](const testing::Extracted& extracted) { files.add(extracted); });
  });
}

// As frames are searched by default: what was doubted is measured again.
void write_bridges(const std::vector<std::string>& words) {
  if (has(words, "turned")) throw Error(ErrorKind::kUsage, "bridges: turned - there is no stripe");
  BridgeFile file(words.at(1));
  for_each_trial(words, [&](const ChoiceTrial& trial, bool is_turned) {
    testing::extract_trial(trial, {.is_turned = is_turned, .is_for_all_positions = false},
                           [&](const testing::Extracted& extracted) { file.add(extracted); });
  });
}

std::vector<RealImage> all_real_images() {
  std::vector<RealImage> all;
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    for (const auto& [set, extension] :
         {std::pair("bouguet-calib-example", ".tif"), std::pair("opencv-left-right", ".jpg")}) {
      const std::vector<RealImage> boards = testing::real_boards(set, extension, axis);
      all.insert(all.end(), boards.begin(), boards.end());
    }
  }
  const std::vector<RealImage> images = testing::real_images();
  all.insert(all.end(), images.begin(), images.end());
  return all;
}

void judge_by_path(const RealImage& image, const Place& place, Row& row) {
  const std::optional<double> at = image.stripe_at(place.line);
  const bool is_right = at && std::abs(*at - place.across_px) <= testing::RealScore::kRightPx;
  row.is_right = row.is_near = is_right ? 1 : 0;
  row.is_known = at || image.is_empty_at(place.line) ? 1 : 0;
}

// All of a folder by one extractor, one after the other, as `capture images:` does.
void write_real(const std::vector<std::string>& words) {
  RowFile file(words.at(1), has(words, "chosen"));
  for (std::size_t i = 4; i < words.size(); ++i) {
    const bool is_word = words[i] == "each" || words[i] == "chosen";
    if (!is_word) throw Error(ErrorKind::kUsage, "real: " + words[i] + " - no word");
  }
  const std::size_t part = std::stoul(words.at(2));
  const std::size_t parts = std::stoul(words.at(3));
  const std::vector<RealImage> all = all_real_images();
  const bool is_each = has(words, "each");
  std::unique_ptr<detail::ProfileExtractor> extractor;
  std::unique_ptr<AmbientStage> stage;
  std::string last;
  Stripe stripe;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_each && i % parts != part) continue;
    const std::string folder = std::filesystem::path(all[i].file).parent_path().string() +
                               std::string(to_string(all[i].axis));
    if (folder != last || is_each) {
      last = folder;
      const ScannerOptions options = testing::RealSettings{}.options(all[i].axis);
      extractor =
          std::make_unique<detail::ProfileExtractor>(testing::with_all_positions(options.stripe));
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

enum class Learnt { kNear, kNearAgain, kScatter, kRight, kReported, kClipped, kAmongOthers };

Learnt learnt_by(const std::string& word) {
  if (word == "first") return Learnt::kNear;
  if (word == "second") return Learnt::kNearAgain;
  if (word == "scatter") return Learnt::kScatter;
  if (word == "third") return Learnt::kRight;
  if (word == "fourth") return Learnt::kReported;
  if (word == "clipped") return Learnt::kClipped;
  if (word == "fifth") return Learnt::kAmongOthers;
  throw Error(
      ErrorKind::kUsage,
      "fit " + word + " - expected first, second, scatter, third, fourth, clipped or fifth");
}

bool is_of_returns(Learnt learnt) {
  return learnt == Learnt::kReported || learnt == Learnt::kAmongOthers;
}

bool is_of_errors(Learnt learnt) {
  return learnt == Learnt::kScatter || learnt == Learnt::kClipped;
}

bool is_learnt_from(const Row& row, Learnt learnt) {
  const float first = row.evidence.of[Evidence::kFirst];
  const float second = row.evidence.of[Evidence::kSecond];
  if (row.is_known == 0) return false;
  if (learnt == Learnt::kNear) return true;
  if (learnt == Learnt::kNearAgain) return first >= kHopeless;
  if (learnt == Learnt::kRight) return second >= kHopeless;
  if (is_of_returns(learnt)) return row.is_chosen != 0;
  const bool is_of_clipped = learnt == Learnt::kClipped;
  return row.is_near != 0 && row.is_chosen != 0 && (row.is_clipped != 0) == is_of_clipped &&
         row.sigma_px > 0.0F && second >= kHopelessChosen;
}

void add_example(const Row& row, Learnt learnt, float weight, bench::Examples& examples) {
  examples.evidence.push_back(row.evidence);
  const bool is_of_right = learnt == Learnt::kRight || is_of_returns(learnt);
  examples.is_stripe.push_back(is_of_right ? row.is_right : row.is_near);
  examples.weight.push_back(weight);
  if (!is_of_errors(learnt)) return;
  const float pull = row.error_px / row.sigma_px;
  examples.squares.push_back(pull * pull);
}

bool is_real(const std::string& path) {
  return std::filesystem::path(path).filename().string().find("real") != std::string::npos;
}

using Wanted = std::function<bool(std::size_t row)>;

std::size_t kinds_of(Learnt learnt) {
  if (learnt == Learnt::kNear) return Evidence::kFirstKinds;
  if (learnt == Learnt::kNearAgain) return Evidence::kSecondKinds;
  if (learnt == Learnt::kReported || learnt == Learnt::kClipped) return Evidence::kFourthKinds;
  if (learnt == Learnt::kAmongOthers) return Evidence::kCount;
  return Evidence::kThirdKinds;
}

bench::Examples examples_of(const std::vector<std::string>& paths, Learnt learnt, float real_weight,
                            const Wanted& is_wanted) {
  bench::Examples examples;
  examples.first_kind = learnt == Learnt::kAmongOthers ? Evidence::kThirdKinds : 0;
  examples.kinds = kinds_of(learnt);
  std::size_t sparse = 0;
  std::size_t number = 0;
  for (const std::string& path : paths) {
    std::ifstream file(path, std::ios::binary);
    for (Row row; file.read(reinterpret_cast<char*>(&row), sizeof row);) {
      if (!is_wanted(number++) || !is_learnt_from(row, learnt)) continue;
      const bool is_sparse = learnt == Learnt::kNear && row.is_near == 0;
      if (is_sparse && sparse++ % kSparse != 0) continue;
      const float weight = is_sparse ? static_cast<float>(kSparse) : 1.0F;
      add_example(row, learnt, is_real(path) && !is_sparse ? real_weight : weight, examples);
    }
  }
  if (examples.evidence.empty()) throw Error(ErrorKind::kUsage, "fit: no row to learn from");
  return examples;
}

// Of the rows of scatter a third says how long the tails are: about six scenes of eighteen, of
// those that are chosen alone some hundred of three hundred.
bool is_of_tails(std::size_t row) {
  constexpr std::size_t kInARow = 20000;
  return row / kInARow % 3 == 2;
}

std::filesystem::path tails_beside(const std::filesystem::path& forest, bool is_of_clipped) {
  return forest.parent_path() / (is_of_clipped ? "clipped_tail_forest.inc" : "tail_forest.inc");
}

// Writes beside the forest of what scatters what its tails are.
void fit_scatter(const std::vector<std::string>& paths, Learnt learnt,
                 const bench::BoostOptions& options, const std::filesystem::path& out) {
  const auto is_of_trees = [](std::size_t row) { return !is_of_tails(row); };
  const bool is_of_clipped = learnt == Learnt::kClipped;
  const bench::BoostedTrees scatter =
      bench::boost(examples_of(paths, learnt, 1.0F, is_of_trees), options);
  bench::write_trees(scatter, is_of_clipped ? "Clipped" : "Scatter", out);
  constexpr bench::BoostOptions kTails{.trees = 60, .rate = 0.3, .prior = 10.0};
  const bench::Examples held_out = examples_of(paths, learnt, 1.0F, is_of_tails);
  bench::write_trees(bench::boost_tails(held_out, kTails, scatter),
                     is_of_clipped ? "ClippedTail" : "Tail", tails_beside(out, is_of_clipped));
}

void fit_none(const std::string& forest, const std::filesystem::path& out) {
  const bench::BoostedTrees none = bench::no_trees();
  if (forest == "fourth") return bench::write_trees(none, "Fourth", out);
  if (forest == "fifth") return bench::write_trees(none, "Fifth", out);
  if (forest != "scatter" && forest != "clipped") {
    throw Error(ErrorKind::kUsage,
                "fit none " + forest + " - expected scatter, fourth, clipped or fifth");
  }
  const bool is_of_clipped = forest == "clipped";
  bench::write_trees(none, is_of_clipped ? "Clipped" : "Scatter", out);
  bench::write_trees(none, is_of_clipped ? "ClippedTail" : "Tail",
                     tails_beside(out, is_of_clipped));
}

void fit(const std::vector<std::string>& words) {
  if (words.at(1) == "none") return fit_none(words.at(2), words.at(3));
  const std::filesystem::path out = words.at(2);
  const Learnt learnt = learnt_by(words.at(1));
  const std::vector<std::string> paths{words.begin() + 6, words.end()};
  bench::BoostOptions options{.trees = std::stoi(words.at(3)), .rate = std::stod(words.at(4))};
  // Whether a return is right is told by many things at once, of millions of examples.
  if (is_of_returns(learnt)) {
    options.depth = detail::ChoiceForest::kMostDepth;
    options.prior = 30.0;
    options.one_in = 16;
  }
  if (is_of_errors(learnt)) return fit_scatter(paths, learnt, options, out);
  const auto is_any = [](std::size_t) { return true; };
  const bench::BoostedTrees trees =
      bench::boost(examples_of(paths, learnt, std::stof(words.at(5)), is_any), options);
  constexpr std::array kNames{"First", "Second", "Scatter", "Third", "Fourth", "Clipped", "Fifth"};
  bench::write_trees(trees, kNames[static_cast<std::size_t>(learnt)], out);
}

void run(const std::vector<std::string>& words) {
  const std::string& mode = words.at(0);
  if (mode == "rows") return write_rows(words);
  if (mode == "real") return write_real(words);
  if (mode == "patches") return write_patches(words);
  if (mode == "bridges") return write_bridges(words);
  if (mode == "fit") return fit(words);
  throw Error(ErrorKind::kUsage, mode + " - expected rows, real, patches, bridges or fit");
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
