// SPDX-License-Identifier: Apache-2.0
// Says against exact truth how often an `ok` return is the stripe, and whether a confidence is a
// probability, on random scenes (tests/support/random_scene.hpp):
//
//     stripe_choice_table rooms|off|sessions|SCENE.yaml FIRST_SEED COUNT [--peak RULE]
//         [--width given|learnt] [--colour grey|red|green|mixed] [--channel CHANNEL] [--frames N]
//         [--threads N] [--csv FILE] [--light whole|shaded]
//
// A line per scene: columns; those with a stripe of SNR 8 and more; of them those with an `ok`
// return within max(0.5 px, 3 sigma) of it; the same of those that stand out 8 times from noise and
// texture together, and of all stripes; then in percent of all
// columns, `ok` and wrong, of these those in columns without a stripe and those less than 2 px from
// it; `ok` between the two stripes of an edge, and on light of the laser plane's side, which are
// not called wrong; the Brier score of the confidences; scans that say that there is no stripe.
//
// Seeds 10000 to 19999 are held out: nothing is tuned on them. The others are for development.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include <striper/core/error.hpp>

#include "support/choice_trial.hpp"

namespace striper {
namespace {

using testing::ChoiceScore;
using testing::ChoiceTrial;
using testing::JudgedReturn;
using testing::StripeScore;

struct Settings {
  ChoiceTrial trial;
  std::uint64_t first_seed = 1;
  int count = 20;
  int threads = 1;
  std::string csv;
};

PeakRule peak_rule(const std::string& word) {
  if (word == "brightest") return PeakRule::kBrightest;
  if (word == "continuous") return PeakRule::kContinuous;
  if (word == "nearest") return PeakRule::kNearest;
  if (word == "farthest") return PeakRule::kFarthest;
  throw Error(ErrorKind::kUsage,
              "--peak " + word + " - expected brightest, continuous, nearest or farthest");
}

void read_option(Settings& settings, const std::string& key, const std::string& value) {
  if (key == "--peak")
    settings.trial.peak = peak_rule(value);
  else if (key == "--width")
    settings.trial.knows_stripe = value == "given";
  else if (key == "--frames")
    settings.trial.frames = std::atoi(value.c_str());
  else if (key == "--threads")
    settings.threads = std::atoi(value.c_str());
  else if (key == "--colour")
    settings.trial.colour = value;
  else if (key == "--channel")
    settings.trial.channel = channel_from_string(value);
  else if (key == "--light" && (value == "whole" || value == "shaded"))
    settings.trial.is_shaded = value == "shaded";
  else if (key == "--csv")
    settings.csv = value;
  else
    throw Error(ErrorKind::kUsage, key + " " + value + " - not an option");
}

Settings read_arguments(const std::vector<std::string>& words) {
  Settings settings;
  if (words.size() < 3) throw Error(ErrorKind::kUsage, "expected rooms|off FIRST_SEED COUNT");
  settings.trial.kind = words[0];
  settings.first_seed = std::strtoull(words[1].c_str(), nullptr, 10);
  settings.count = std::atoi(words[2].c_str());
  for (std::size_t i = 3; i + 1 < words.size(); i += 2)
    read_option(settings, words[i], words[i + 1]);
  return settings;
}

const char* word(const JudgedReturn& r) {
  if (!r.has_values()) return "none";
  constexpr const char* kWords[] = {"right", "mixed", "wrong", "phantom", "side"};
  return kWords[static_cast<int>(r.judgement)];
}

void append_rows(std::string& rows, std::uint64_t seed, int frame,
                 const std::vector<JudgedReturn>& returns) {
  for (const JudgedReturn& r : returns) {
    rows +=
        fmt::format("{},{},{},{},{:.5f},{:.3f},{:.3f},{:.3f},{:.2f},{:.2f},{:.2f},{},{},{}\n", seed,
                    frame, r.line, to_string(r.status), r.confidence, r.across_px, r.error_px,
                    r.sigma_px, r.truth_amplitude, r.truth_snr, r.truth_distinctness,
                    to_string(r.truth_status), r.near_edge ? 1 : 0, word(r));
  }
}

ChoiceScore score_of(const Settings& settings, std::uint64_t seed, std::string& rows) {
  ChoiceTrial trial = settings.trial;
  trial.seed = seed;
  if (settings.csv.empty()) return testing::run_trial(trial);
  return testing::run_trial(trial, [&](int frame, const std::vector<JudgedReturn>& returns) {
    append_rows(rows, seed, frame, returns);
  });
}

std::string figures(const StripeScore& s) {
  return fmt::format(
      "{:>8} {:>7} {:8.2f} {:8.2f} {:8.2f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.4f} "
      "{:>4}/{}",
      s.columns, s.clear, s.found_percent(), s.found_distinct_percent(),
      StripeScore::percent(s.found_visible, s.visible), s.wrong_percent(), s.phantom_percent(),
      StripeScore::percent(s.biased, s.columns), StripeScore::percent(s.mixed, s.columns),
      StripeScore::percent(s.side, s.columns), s.brier(), s.unseen, s.scans);
}

void print_reliability(const StripeScore& score) {
  std::cout << "\nconfidence        returns   are the stripe %   mean confidence %\n";
  for (std::size_t i = 0; i < score.bins.size(); ++i) {
    const auto& bin = score.bins[i];
    const double high = i + 1 < score.bins.size() ? StripeScore::kBins[i + 1] : 1.0;
    std::cout << fmt::format(
        "{:5.3f} to {:5.3f} {:10} {:18.2f} {:19.2f}\n", StripeScore::kBins[i], high, bin.count,
        StripeScore::percent(bin.stripe, bin.count),
        bin.count == 0 ? 0.0 : 100.0 * bin.sum / static_cast<double>(bin.count));
  }
  std::cout << fmt::format("Brier score {:.5f} of {} returns\n", score.brier(), score.judged);
}

void write_rows(const std::string& path, const std::vector<std::string>& rows) {
  std::ofstream csv(path);
  csv << "seed,frame,line,status,confidence,across_px,error_px,sigma_px,truth_amplitude,truth_snr,"
         "truth_distinctness,"
         "truth_status,near_edge,is\n";
  for (const std::string& row : rows) csv << row;
}

void run(const Settings& settings) {
  std::cout << fmt::format(
      "{:5} {:>7} {:>7} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6}\n", "seed",
      "columns", "clear", "found %", "distinct", "any SNR", "wrong %", "phantom%", "biased %",
      "mixed %", "side %", "Brier", "unseen");
  std::vector<std::string> rows(static_cast<std::size_t>(settings.count));
  std::vector<ChoiceScore> scores(static_cast<std::size_t>(settings.count));
  std::atomic<int> next = 0;
  std::mutex printing;
  const auto work = [&] {
    for (int i = next++; i < settings.count; i = next++) {
      const std::uint64_t seed = settings.first_seed + static_cast<std::uint64_t>(i);
      const auto place = static_cast<std::size_t>(i);
      scores[place] = score_of(settings, seed, rows[place]);
      const std::lock_guard lock(printing);
      std::cout << fmt::format("{:5}", seed) << figures(scores[place].all) << std::endl;
    }
  };
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(settings.threads));
  for (int i = 0; i < settings.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  ChoiceScore sum;
  for (const ChoiceScore& score : scores) {
    sum.first.add(score.first);
    sum.all.add(score.all);
  }
  if (!settings.csv.empty()) write_rows(settings.csv, rows);
  std::cout << "\nfirst" << figures(sum.first) << "\nall  " << figures(sum.all) << "\n";
  print_reliability(sum.all);
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  try {
    striper::run(striper::read_arguments({argv + 1, argv + argc}));
  } catch (const std::exception& error) {
    std::cerr << "stripe_choice_table: " << error.what() << "\n";
    return 1;
  }
}
