// SPDX-License-Identifier: Apache-2.0
#include "boosted_trees.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <future>
#include <iostream>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace striper::bench {
namespace {

using detail::ChoiceForest;
using detail::ChoiceQuestion;

constexpr std::size_t kBins = 64;
constexpr std::size_t kSamples = 100000;  // Of all and of the stripes, for the quantiles.
constexpr double kLargestStep = 3.0;
constexpr float kLeastHessian = 1e-6F;
// Of a normal distribution: what is beyond three sigmas, and the density of the log square there.
constexpr double kBeyondThree = 0.0027;
constexpr double kDensityAtThree = 0.0133;
constexpr double kThreeSquared = 9.0;
constexpr double kLeastSquare = 1e-6;
// Squares of errors of more than ten sigmas are another thing than the stripe: to a mean square
// they count as ten.
constexpr float kLargestSquare = 100.0F;

// The evidence in quantiles: bin > b where it is above limits[b].
struct Binned {
  std::vector<std::vector<float>> limits;       // Of each kind.
  std::vector<std::vector<std::uint8_t>> bins;  // [kind][example]
};

// Half of the samples are stripes: it is among them that limits matter.
std::vector<float> samples_of(const Examples& examples, std::size_t kind) {
  std::vector<float> values;
  std::size_t stripes = 0;
  for (const std::uint8_t is : examples.is_stripe) stripes += is;
  const std::size_t size = examples.evidence.size();
  const std::size_t step = std::max<std::size_t>(1, size / kSamples);
  for (std::size_t i = 0; i < size; i += step) values.push_back(examples.evidence[i].of[kind]);
  const std::size_t stripe_step = std::max<std::size_t>(1, stripes / kSamples);
  std::size_t n = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (examples.is_stripe[i] == 0 || n++ % stripe_step != 0) continue;
    values.push_back(examples.evidence[i].of[kind]);
  }
  std::sort(values.begin(), values.end());
  return values;
}

Binned binned(const Examples& examples) {
  Binned data;
  data.limits.resize(examples.kinds);
  data.bins.resize(examples.kinds);
  for (std::size_t kind = examples.first_kind; kind < examples.kinds; ++kind) {
    const std::vector<float> values = samples_of(examples, kind);
    std::vector<float>& limits = data.limits[kind];
    for (std::size_t b = 1; b < kBins; ++b) {
      const float limit = values[values.size() * b / kBins];
      if ((limits.empty() || limit > limits.back()) && limit < values.back()) {
        limits.push_back(limit);
      }
    }
    for (const detail::Evidence& e : examples.evidence) {
      const auto at = std::lower_bound(limits.begin(), limits.end(), e.of[kind]);
      data.bins[kind].push_back(static_cast<std::uint8_t>(at - limits.begin()));
    }
  }
  return data;
}

struct Sums {
  double gradient = 0.0;
  double hessian = 0.0;
  void add(const Sums& other) {
    gradient += other.gradient;
    hessian += other.hessian;
  }
  double gain(double prior) const { return gradient * gradient / (hessian + prior); }
};

struct Question {
  std::size_t kind = 0;
  std::size_t bin = 0;
  double gain = -1.0;
};

// Calls `body(first, end)` of equal parts of so many, one for each core.
template <typename Body>
void in_parts(std::size_t count, const Body& body) {
  const std::size_t parts = std::max(1U, std::thread::hardware_concurrency());
  std::vector<std::future<void>> running;
  for (std::size_t part = 0; part < parts; ++part) {
    running.push_back(std::async(
        std::launch::async, [&, part] { body(count * part / parts, count * (part + 1) / parts); }));
  }
  for (std::future<void>& part : running) part.get();
}

class Booster {
 public:
  Booster(const Examples& examples, const BoostOptions& options)
      : examples_(examples), options_(options), data_(binned(examples)) {
    if (options.depth < 1 || options.depth > ChoiceForest::kMostDepth)
      throw std::invalid_argument("boost: trees of no such depth");
    if (std::all_of(data_.limits.begin(), data_.limits.end(),
                    [](const std::vector<float>& limits) { return limits.empty(); }))
      throw std::invalid_argument("boost: no evidence differs from example to example");
    const std::size_t size = examples.evidence.size();
    double stripes = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < size; ++i) {
      all += examples.weight[i];
      stripes += examples.is_stripe[i] * examples.weight[i];
    }
    trees_.bias = fits_squares() ? 0.0F : static_cast<float>(std::log(stripes / (all - stripes)));
    odds_.assign(size, trees_.bias);
    gradients_.resize(size);
    hessians_.resize(size);
    leaves_.resize(size);
    trees_.depth = options.depth;
  }

  // From here on trees are fitted to the tails of the errors that `forest` leaves.
  void begin_tails(const detail::ChoiceForest& forest) {
    is_of_tails_ = true;
    for (const detail::Evidence& evidence : examples_.evidence) {
      log_variances_.push_back(detail::weigh(forest, evidence));
    }
  }

  BoostedTrees run() {
    for (int t = 0; t < options_.trees; ++t) {
      differentiate();
      grow();
      if (t % 20 == 19)
        std::cout << fmt::format("{:4} trees: loss {:.5f}", t + 1, loss()) << std::endl;
    }
    return trees_;
  }

 private:
  bool fits_squares() const { return !examples_.squares.empty(); }

  void differentiate() {
    in_parts(odds_.size(), [this](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) differentiate(i);
    });
    draw_sample();
  }

  // What the questions of a tree are found on, side by side in memory.
  void draw_sample() {
    sample_.clear();
    slopes_.clear();
    for (std::size_t i = 0; i < odds_.size(); ++i) {
      if (dice_() % options_.one_in != 0) continue;
      sample_.push_back(static_cast<std::uint32_t>(i));
      slopes_.push_back({gradients_[i], hessians_[i]});
    }
    sampled_bins_.resize(examples_.kinds);
    in_parts(examples_.kinds, [this](std::size_t first, std::size_t end) {
      for (std::size_t kind = first; kind < end; ++kind) {
        if (data_.limits[kind].empty()) continue;
        sampled_bins_[kind].resize(sample_.size());
        for (std::size_t n = 0; n < sample_.size(); ++n)
          sampled_bins_[kind][n] = data_.bins[kind][sample_[n]];
      }
    });
  }

  void differentiate(std::size_t i) {
    if (is_of_tails_) {
      differentiate_tail(i);
    } else if (fits_squares()) {
      differentiate_variance(i);
    } else {
      differentiate_odds(i);
    }
  }

  void differentiate_odds(std::size_t i) {
    const float p = 1.0F / (1.0F + std::exp(-odds_[i]));
    gradients_[i] = examples_.weight[i] * (static_cast<float>(examples_.is_stripe[i]) - p);
    hessians_[i] = examples_.weight[i] * std::max(kLeastHessian, p * (1.0F - p));
  }

  // Of half the log variance and half the square over it; the expected Hessian, which is safe.
  void differentiate_variance(std::size_t i) {
    const float over = std::min(kLargestSquare, examples_.squares[i]) * std::exp(-odds_[i]);
    gradients_[i] = examples_.weight[i] * 0.5F * (over - 1.0F);
    hessians_[i] = examples_.weight[i] * 0.5F;
  }

  // Of the pinball loss of the quantile at three sigmas; its Hessian is the density of the log
  // square there.
  void differentiate_tail(std::size_t i) {
    const bool is_beyond = over_three(i) > 0.0;
    const double gradient = (is_beyond ? 1.0 : 0.0) - kBeyondThree;
    gradients_[i] = examples_.weight[i] * static_cast<float>(gradient);
    hessians_[i] = examples_.weight[i] * static_cast<float>(kDensityAtThree);
  }

  // Log of the square over that of three sigmas, which are widened but never narrowed.
  double over_three(std::size_t i) const {
    const auto square = static_cast<double>(examples_.squares[i]);
    const float log_variance = log_variances_[i] + std::max(0.0F, odds_[i]);
    return std::log(std::max(kLeastSquare, square) / kThreeSquared) -
           static_cast<double>(log_variance);
  }

  void grow() {
    std::fill(leaves_.begin(), leaves_.end(), std::uint8_t{0});
    for (std::size_t level = 0; level < options_.depth; ++level) {
      const auto [kind, bin] = best_question(std::size_t{1} << level);
      trees_.questions.push_back({static_cast<std::uint8_t>(kind), data_.limits[kind][bin]});
      const std::vector<std::uint8_t>& bins = data_.bins[kind];
      in_parts(leaves_.size(), [&, bin = bin](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
          const int is_above = bins[i] > bin ? 1 : 0;
          leaves_[i] = static_cast<std::uint8_t>(leaves_[i] | (is_above << level));
        }
      });
    }
    step();
  }

  // Of all leaves of the tree whose questions were found.
  void step() {
    std::vector<Sums> sums(std::size_t{1} << options_.depth);
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      sums[leaves_[i]].add({gradients_[i], hessians_[i]});
    }
    const std::size_t first = trees_.leaves.size();
    for (const Sums& of_leaf : sums) {
      const double newton = of_leaf.gradient / (of_leaf.hessian + 2.0 * options_.prior);
      const double odds = std::clamp(options_.rate * newton, -kLargestStep, kLargestStep);
      const double units = odds / static_cast<double>(ChoiceForest::kUnit);
      trees_.leaves.push_back(static_cast<std::int32_t>(std::lround(units)));
    }
    in_parts(leaves_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        odds_[i] += ChoiceForest::kUnit * static_cast<float>(trees_.leaves[first + leaves_[i]]);
    });
  }

  // Of which evidence and beyond which bin, asked of all leaves that there are.
  std::pair<std::size_t, std::size_t> best_question(std::size_t leaves) {
    std::vector<std::size_t> asked;
    while (asked.empty()) {
      for (std::size_t kind = 0; kind < examples_.kinds; ++kind) {
        if (!data_.limits[kind].empty() && dice_() % 4 != 0) asked.push_back(kind);
      }
    }
    sampled_leaves_.resize(sample_.size());
    for (std::size_t n = 0; n < sample_.size(); ++n) sampled_leaves_[n] = leaves_[sample_[n]];
    std::vector<Question> questions(asked.size());
    in_parts(asked.size(), [&](std::size_t first, std::size_t end) {
      for (std::size_t i = first; i < end; ++i) questions[i] = best_question_of(asked[i], leaves);
    });
    Question best;
    for (const Question& question : questions) {
      if (question.gain > best.gain) best = question;
    }
    return {best.kind, best.bin};
  }

  Question best_question_of(std::size_t kind, std::size_t leaves) const {
    const std::vector<double> gains = gains_of(kind, leaves);
    const auto highest = std::max_element(gains.begin(), gains.end());
    return {kind, static_cast<std::size_t>(highest - gains.begin()), *highest};
  }

  std::vector<double> gains_of(std::size_t kind, std::size_t leaves) const {
    std::vector<Sums> sums(leaves * kBins);
    const std::vector<std::uint8_t>& bins = sampled_bins_[kind];
    for (std::size_t n = 0; n < slopes_.size(); ++n)
      sums[sampled_leaves_[n] * kBins + bins[n]].add(slopes_[n]);
    std::vector<double> gains(data_.limits[kind].size());
    for (std::size_t l = 0; l < leaves; ++l) {
      Sums all;
      for (std::size_t b = 0; b < kBins; ++b) all.add(sums[l * kBins + b]);
      Sums below;
      for (std::size_t b = 0; b < gains.size(); ++b) {
        below.add(sums[l * kBins + b]);
        const Sums above{all.gradient - below.gradient, all.hessian - below.hessian};
        gains[b] += below.gain(options_.prior) + above.gain(options_.prior);
      }
    }
    return gains;
  }

  double pinball_of(std::size_t i) const {
    const double over = over_three(i);
    return std::max((1.0 - kBeyondThree) * over, -kBeyondThree * over);
  }

  double loss_of(std::size_t i) const {
    const auto odds = static_cast<double>(odds_[i]);
    if (is_of_tails_) return pinball_of(i);
    if (fits_squares()) {
      const auto square = static_cast<double>(std::min(kLargestSquare, examples_.squares[i]));
      return 0.5 * (odds + square * std::exp(-odds));
    }
    return std::log1p(std::exp(examples_.is_stripe[i] != 0 ? -odds : odds));
  }

  double loss() const {
    double sum = 0.0;
    double weights = 0.0;
    for (std::size_t i = 0; i < odds_.size(); ++i) {
      sum += examples_.weight[i] * loss_of(i);
      weights += examples_.weight[i];
    }
    return sum / weights;
  }

  const Examples& examples_;
  BoostOptions options_;
  Binned data_;
  BoostedTrees trees_;
  bool is_of_tails_ = false;
  std::vector<float> log_variances_;  // To which tails are added.
  std::vector<float> odds_, gradients_, hessians_;
  std::vector<std::uint8_t> leaves_;
  std::vector<std::uint32_t> sample_;
  std::vector<Sums> slopes_;  // Of the sample: each one's derivatives,
  std::vector<std::vector<std::uint8_t>> sampled_bins_;
  std::vector<std::uint8_t> sampled_leaves_;
  std::mt19937 dice_{7};
};

}  // namespace

BoostedTrees boost(const Examples& examples, const BoostOptions& options) {
  return Booster(examples, options).run();
}

BoostedTrees boost_tails(const Examples& held_out, const BoostOptions& options,
                         const BoostedTrees& scatter) {
  Booster booster(held_out, options);
  booster.begin_tails(scatter.forest());
  return booster.run();
}

BoostedTrees no_trees() { return {.questions = {{0, 0.0F}}, .leaves = {0, 0}}; }

// A tree a line.
void write_trees(const BoostedTrees& trees, const std::string& name, const std::string& path) {
  std::ofstream file(path);
  file << fmt::format("constexpr float k{}Bias = {:.4f}F;\n", name, trees.bias);
  file << fmt::format("constexpr std::size_t k{}Depth = {};\n", name, trees.depth);
  file << fmt::format("constexpr ChoiceQuestion k{}Questions[] = {{\n", name);
  for (std::size_t n = 0; n < trees.questions.size(); ++n) {
    const ChoiceQuestion& question = trees.questions[n];
    const bool is_last = (n + 1) % trees.depth == 0;
    file << fmt::format("{{{},{:.8e}F}},{}", question.kind, question.limit, is_last ? "\n" : "");
  }
  file << fmt::format("}};\nconstexpr std::int32_t k{}Leaves[] = {{\n", name);
  const std::size_t leaves_of_tree = std::size_t{1} << trees.depth;
  for (std::size_t n = 0; n < trees.leaves.size(); ++n) {
    file << trees.leaves[n] << ((n + 1) % leaves_of_tree == 0 ? ",\n" : ",");
  }
  file << "};\n";
}

}  // namespace striper::bench
