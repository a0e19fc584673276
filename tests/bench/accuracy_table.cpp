// SPDX-License-Identifier: Apache-2.0
// Writes docs/accuracy.md: truth against every method and the usual estimators, in units of the
// Cramer-Rao bound. `accuracy_table [TRIALS] > docs/accuracy.md`
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "accuracy_notes.hpp"
#include "support/stripe_trials.hpp"

namespace striper {
namespace {

using testing::RenderedTrials;
using testing::StripeTrials;
using testing::TrialScore;
using Noise = StripeTrials::Noise;
using Column = std::vector<double>;

// An estimator of the position in one column, from its values less their local background.
using Estimator = std::function<double(const Column&, double sigma_px)>;

struct Reference {
  std::string name;
  Estimator estimate;
};

int peak_of(const Column& f) {
  int best = 8;
  double most = -1e30;
  for (int k = 8; k + 8 < static_cast<int>(f.size()); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double box = f[i - 1] + f[i] + f[i + 1];
    if (box > most) {
      most = box;
      best = k;
    }
  }
  const auto i = static_cast<std::size_t>(best);
  if (f[i - 1] > f[i] && f[i - 1] >= f[i + 1]) return best - 1;
  return f[i + 1] > f[i] ? best + 1 : best;
}

double at(const Column& f, int k) { return f[static_cast<std::size_t>(k)]; }

double gauss_3(const Column& f, double /*sigma*/) {
  const int p = peak_of(f);
  const double a = std::log(std::max(1e-3, at(f, p - 1)));
  const double b = std::log(std::max(1e-3, at(f, p)));
  const double c = std::log(std::max(1e-3, at(f, p + 1)));
  const double bend = a - 2.0 * b + c;
  return bend < 0.0 ? p + std::clamp((a - c) / (2.0 * bend), -1.0, 1.0) : p;
}

double parabola(const Column& f, double /*sigma*/) {
  const int p = peak_of(f);
  const double bend = at(f, p - 1) - 2.0 * at(f, p) + at(f, p + 1);
  return bend < 0.0 ? p + (at(f, p - 1) - at(f, p + 1)) / (2.0 * bend) : p;
}

// Blais & Rioux 1986: the zero crossing of a derivative over `reach` pixels on either side.
double blais_rioux(const Column& f, int reach) {
  const auto derivative = [&](int k) {
    double sum = 0.0;
    for (int i = 1; i <= reach; ++i) sum += at(f, k + i) - at(f, k - i);
    return sum;
  };
  const int p = peak_of(f);
  for (int k = p - 2; k <= p + 1; ++k) {
    const double here = derivative(k);
    const double next = derivative(k + 1);
    if (here >= 0.0 && next < 0.0) return k + here / (here - next);
  }
  return p;
}

double wide_centroid(const Column& f, double /*sigma*/) {
  const int p = peak_of(f);
  double sum = 0.0;
  double moment = 0.0;
  for (int k = p - 5; k <= p + 5; ++k) {
    sum += at(f, k);
    moment += k * at(f, k);
  }
  return sum > 0.0 ? moment / sum : p;
}

// Steger 1998 in one dimension: -r' / r'' of the smoothed column at its ridge pixel.
double steger_1d(const Column& f, double sigma_px) {
  const double s = std::max(0.8, sigma_px);
  const int reach = static_cast<int>(std::ceil(4.0 * s));
  const int p = peak_of(f);
  double best = -1e30;
  double result = p;
  for (int c = p - 3; c <= p + 3; ++c) {
    double value = 0.0;
    double first = 0.0;
    double second = 0.0;
    for (int i = -reach; i <= reach; ++i) {
      const double x = i / s;
      const double g = std::exp(-0.5 * x * x);
      value += g * at(f, c + i);
      first += x / s * g * at(f, c + i);
      second += (x * x - 1.0) / (s * s) * g * at(f, c + i);
    }
    if (value > best && second < 0.0) {
      best = value;
      result = c - first / second;
    }
  }
  return result;
}

const std::array<Reference, 6>& references() {
  static const std::array<Reference, 6> kReferences{{
      {"Gauss-3", gauss_3},
      {"parabola", parabola},
      {"Blais-Rioux 4", [](const Column& f, double) { return blais_rioux(f, 2); }},
      {"Blais-Rioux 8", [](const Column& f, double) { return blais_rioux(f, 4); }},
      {"centroid 11", wide_centroid},
      {"Steger 1-D", steger_1d},
  }};
  return kReferences;
}

// Every reference is given the straight line through the background on either side.
TrialScore score(const RenderedTrials& trials, const Reference& reference, double sigma_px) {
  const cv::Mat& image = trials.frame.lit;
  std::vector<double> positions;
  Column column(static_cast<std::size_t>(image.rows));
  const int gap = static_cast<int>(std::ceil(5.0 * sigma_px));
  for (int c = 0; c < image.cols; ++c) {
    const auto pixel = [&](int r) {
      return image.depth() == CV_8U ? static_cast<double>(image.at<std::uint8_t>(r, c))
                                    : static_cast<double>(image.at<std::uint16_t>(r, c));
    };
    double level = 0.0;
    double slope = 0.0;
    double squares = 0.0;
    int count = 0;
    for (int q = gap; q < gap + 12; ++q) {
      const double above = pixel(testing::kTrialCentre + q);
      const double below = pixel(testing::kTrialCentre - q);
      level += above + below;
      slope += q * (above - below);
      squares += 2.0 * q * q;
      count += 2;
    }
    level /= count;
    slope /= squares;
    for (int r = 0; r < image.rows; ++r) {
      column[static_cast<std::size_t>(r)] = pixel(r) - level - slope * (r - testing::kTrialCentre);
    }
    positions.push_back(reference.estimate(column, sigma_px));
  }
  return testing::score(trials, positions, {});
}

void table_head() {
  std::string head =
      "| sigma px | SNR | bound px | paper | fast | refined | pull of refined | beyond 3 |";
  std::string rule = "|---|---|---|---|---|---|---|---|";
  for (const Reference& r : references()) {
    head += " " + r.name + " |";
    rule += "---|";
  }
  fmt::print("{}\n{}\n", head, rule);
}

std::string cell(const TrialScore& s, double bound) {
  const bool is_biased = std::abs(s.bias_px) > 0.1 * s.rms_px && std::abs(s.bias_px) > 0.001;
  return is_biased ? fmt::format("{:.2f} ({:+.3f} px)", s.rms_px / bound, s.bias_px)
                   : fmt::format("{:.2f}", s.rms_px / bound);
}

// Fewer trials know a pull less well than it is asked for.
TrialScore pulls_of_refined(StripeTrials t) {
  constexpr int kLeastTrials = 20000;
  t.trials = std::max(t.trials, kLeastTrials);
  return testing::score(testing::render(t), ExtractMethod::kRefined);
}

void table_row(const StripeTrials& t) {
  const RenderedTrials trials = testing::render(t);
  const TrialScore pulls = pulls_of_refined(t);
  const auto of = [&](ExtractMethod method) { return testing::score(trials, method); };
  fmt::print("| {:.1f} | {:.0f} | {:.4f} | {} | {} | **{}** | {:.2f} | {:.2f} % |", t.sigma_px,
             t.snr, trials.bound_px, cell(of(ExtractMethod::kPaper), trials.bound_px),
             cell(of(ExtractMethod::kFast), trials.bound_px),
             cell(of(ExtractMethod::kRefined), trials.bound_px), pulls.pull_sigma,
             100.0 * pulls.beyond_3_sigma);
  for (const Reference& r : references()) {
    fmt::print(" {} |", cell(score(trials, r, t.sigma_px), trials.bound_px));
  }
  fmt::print("\n");
}

void table(const std::string& title, const std::string& text, StripeTrials base,
           const std::vector<double>& snrs) {
  fmt::print("\n## {}\n\n{}\n\n", title, text);
  table_head();
  for (const double sigma : {0.7, 1.0, 1.5, 2.0, 3.0}) {
    for (const double snr : snrs) {
      base.sigma_px = sigma;
      base.snr = snr;
      table_row(base);
    }
  }
}

void locking_table(int trials) {
  fmt::print(
      "\n## Pixel locking\n\nPeak to peak of the mean error over the phase of the pixel, without "
      "noise worth naming, px.\n\n| sigma px | paper | fast | refined |");
  for (const Reference& r : references()) fmt::print(" {} |", r.name);
  fmt::print("\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const double sigma : {0.7, 1.0, 1.5, 2.0, 3.0}) {
    StripeTrials t;
    t.trials = trials;
    t.sigma_px = sigma;
    t.snr = 2000.0;
    const RenderedTrials rendered = testing::render(t);
    fmt::print("| {:.1f} |", sigma);
    for (const ExtractMethod method :
         {ExtractMethod::kPaper, ExtractMethod::kFast, ExtractMethod::kRefined}) {
      fmt::print(" {:.4f} |", testing::score(rendered, method).locking_px);
    }
    for (const Reference& r : references()) {
      fmt::print(" {:.4f} |", score(rendered, r, sigma).locking_px);
    }
    fmt::print("\n");
  }
}

void all_tables(int trials) {
  StripeTrials base;
  base.trials = trials;
  fmt::print(
      "# How accurate the stripe's position is\n\n"
      "Written by `accuracy_table {} > docs/accuracy.md`: {} columns a line, each with the stripe "
      "at "
      "a random phase of the pixel. Numbers are the root mean square error in units of the "
      "Cramer-Rao bound (`striper/stripe/crlb.hpp`), in brackets the bias where it counts. SNR is "
      "the amplitude over the noise of the peak pixel. The pull is error over predicted error, of "
      "20000 columns: its robust standard deviation, 1 if the error bars are true, and the part "
      "beyond 3, 0.27 % of a normal distribution. The references are given the straight "
      "background; `paper`, `fast` and `refined` find it, and the width, by themselves. A ratio "
      "below 1 is an estimator that knows the width, which the bound takes as unknown.\n",
      trials, trials);
  const std::vector<double> all{7.0, 10.0, 20.0, 50.0, 100.0};
  const std::vector<double> some{20.0, 100.0};
  table("White noise", "16 bits, constant background.", base, all);
  base.noise = Noise::kShot;
  table("Shot noise", "Nine tenths of the variance at the peak is the stripe's own light.", base,
        all);
  base.noise = Noise::kEightBitsBright;
  table("8 bits, amplitude 200 DN", "Quantised to whole DN.", base, all);
  base.noise = Noise::kEightBitsDim;
  table("8 bits, amplitude 20 DN", "Read noise 1 and 0.2 DN: quantisation rules.", base, all);
  base.noise = Noise::kWhite;
  base.saturation = 2.0;
  table("Twice saturated", "The stripe is twice full scale; SNR is full scale over noise.", base,
        some);
  base.saturation = 0.0;
  base.ramp = 0.02;
  table("Sloping background", "2 % of the amplitude per pixel; the bound has the slope unknown.",
        base, some);
  base.ramp = 0.0;
  base.tilt = 1.0;
  table("Tilted surface",
        "The stripe climbs one pixel per column: the profile is smeared by one pixel.", base, some);
  base.tilt = 0.0;
  base.albedo = 0.5;
  table("Albedo edge",
        "The surface is half as bright on one side of the stripe's centre. Every estimator moves "
        "towards the bright side: no error bar of a single profile can know of it.",
        base, {100.0});
  base.albedo = 1.0;
  locking_table(trials);
  fmt::print("{}", kAccuracyNotes);
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 4000;
  if (trials < 100) {
    fmt::print(stderr, "usage: accuracy_table [TRIALS, at least 100] > docs/accuracy.md\n");
    return 2;
  }
  striper::all_tables(trials);
  return 0;
}
