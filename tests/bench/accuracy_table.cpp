// SPDX-License-Identifier: Apache-2.0
// Writes docs/accuracy.md: truth against every method and the usual estimators, in units of the
// Cramer-Rao bound; what the document says beyond its tables is copied from the one that there is.
//
//     accuracy_table TRIALS docs/accuracy.md > new.md; mv new.md docs/accuracy.md
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "support/stripe_trials.hpp"

namespace striper {
namespace {

using testing::RenderedTrials;
using testing::StripeTrials;
using testing::TrialScore;
using Noise = StripeTrials::Noise;
using Column = std::vector<double>;

// More than this off is another thing than the stripe.
constexpr double kGrossPx = 3.0;

// The column's values less its straight background, and the pixel where an estimator begins.
struct PeakColumn {
  Column values;
  int peak = 0;
};

using Estimator = std::function<double(const PeakColumn&, double sigma_px)>;

struct Reference {
  std::string name;
  Estimator estimate;
};

double at(const Column& f, int k) { return f[static_cast<std::size_t>(k)]; }

// The brightest of the pixel and its neighbours, where three-point formulae want to begin.
int brightest_beside(const Column& f, int pixel) {
  int best = pixel;
  for (const int k : {pixel - 1, pixel + 1}) {
    if (at(f, k) > at(f, best)) best = k;
  }
  return best;
}

double gauss_3(const PeakColumn& column, double /*sigma*/) {
  const Column& f = column.values;
  const int p = column.peak;
  const double a = std::log(std::max(1e-3, at(f, p - 1)));
  const double b = std::log(std::max(1e-3, at(f, p)));
  const double c = std::log(std::max(1e-3, at(f, p + 1)));
  const double bend = a - 2.0 * b + c;
  return bend < 0.0 ? p + std::clamp((a - c) / (2.0 * bend), -1.0, 1.0) : p;
}

double parabola(const PeakColumn& column, double /*sigma*/) {
  const Column& f = column.values;
  const int p = column.peak;
  const double bend = at(f, p - 1) - 2.0 * at(f, p) + at(f, p + 1);
  return bend < 0.0 ? p + (at(f, p - 1) - at(f, p + 1)) / (2.0 * bend) : p;
}

// Blais & Rioux 1986: the zero crossing of a derivative over `reach` pixels on either side.
double blais_rioux(const PeakColumn& column, int reach) {
  const Column& f = column.values;
  const auto derivative = [&](int k) {
    double sum = 0.0;
    for (int i = 1; i <= reach; ++i) sum += at(f, k + i) - at(f, k - i);
    return sum;
  };
  const int p = column.peak;
  for (int k = p - 2; k <= p + 1; ++k) {
    const double here = derivative(k);
    const double next = derivative(k + 1);
    if (here >= 0.0 && next < 0.0) return k + here / (here - next);
  }
  return p;
}

double wide_centroid(const PeakColumn& column, double /*sigma*/) {
  const Column& f = column.values;
  const int p = column.peak;
  double sum = 0.0;
  double moment = 0.0;
  for (int k = p - 5; k <= p + 5; ++k) {
    sum += at(f, k);
    moment += k * at(f, k);
  }
  return sum > 0.0 ? moment / sum : p;
}

// Steger 1998 in one dimension, plain: -r' / r'' of the column smoothed by a Gaussian of the
// stripe's width, at the ridge pixel; without his correction of the bias.
double plain_steger(const PeakColumn& column, double sigma_px) {
  const Column& f = column.values;
  const double s = std::max(0.8, sigma_px);
  const int reach = static_cast<int>(std::ceil(4.0 * s));
  const int p = column.peak;
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
      {"Blais-Rioux 4", [](const PeakColumn& c, double) { return blais_rioux(c, 2); }},
      {"Blais-Rioux 8", [](const PeakColumn& c, double) { return blais_rioux(c, 4); }},
      {"centroid 11", wide_centroid},
      {"plain Steger", plain_steger},
  }};
  return kReferences;
}

// What a method says of every column: NaN where it finds nothing.
struct Answers {
  std::vector<double> positions;
  std::vector<double> sigmas;  // Empty where it states none.
};

struct MethodScore {
  double found_percent = 0.0;
  double gross_percent = 0.0;  // Of all columns; not in what follows.
  TrialScore score;
};

MethodScore judge(const RenderedTrials& trials, Answers answers) {
  MethodScore result;
  const double one_percent = 100.0 / static_cast<double>(answers.positions.size());
  for (std::size_t i = 0; i < answers.positions.size(); ++i) {
    double& position = answers.positions[i];
    if (!std::isfinite(position)) continue;
    const bool is_gross = std::abs(position - trials.truth[i]) > kGrossPx;
    (is_gross ? result.gross_percent : result.found_percent) += one_percent;
    if (is_gross) position = std::nan("");
  }
  result.score = testing::score(trials, answers.positions, answers.sigmas);
  return result;
}

// Of columns that are no surface: told that, and the camera's noise.
Answers answers_of(const RenderedTrials& trials, ExtractMethod method) {
  Stripe stripe = testing::extract(trials, method);
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (stripe.status[i] != ReturnStatus::kOk) stripe.across_px[i] = std::nan("");
  }
  return {stripe.across_px, {stripe.sigma_px.begin(), stripe.sigma_px.end()}};
}

double pixel(const cv::Mat& image, int row, int column) {
  return image.depth() == CV_8U ? static_cast<double>(image.at<std::uint8_t>(row, column))
                                : static_cast<double>(image.at<std::uint16_t>(row, column));
}

// The column less the straight line through 12 pixels on either side, 5 widths off.
Column without_background(const cv::Mat& image, int c, double sigma_px) {
  const int gap = static_cast<int>(std::ceil(5.0 * sigma_px));
  double level = 0.0;
  double slope = 0.0;
  double squares = 0.0;
  int count = 0;
  for (int q = gap; q < gap + 12; ++q) {
    const double above = pixel(image, testing::kTrialCentre + q, c);
    const double below = pixel(image, testing::kTrialCentre - q, c);
    level += above + below;
    slope += q * (above - below);
    squares += 2.0 * q * q;
    count += 2;
  }
  level /= count;
  slope /= squares;
  Column values;
  for (int r = 0; r < image.rows; ++r) {
    values.push_back(pixel(image, r, c) - level - slope * (r - testing::kTrialCentre));
  }
  return values;
}

// A reference begins at the pixel where ours found the stripe; where it found none, neither does
// the reference. It is given where the background is, and plain Steger the width.
Answers answers_of(const RenderedTrials& trials, const Reference& reference,
                   const std::vector<double>& candidates, double sigma_px) {
  constexpr int kReach = 16;
  const cv::Mat& image = trials.frame.lit;
  Answers answers;
  for (int c = 0; c < image.cols; ++c) {
    const double candidate = candidates[static_cast<std::size_t>(c)];
    double& position = answers.positions.emplace_back(std::nan(""));
    if (!(candidate > kReach && candidate < image.rows - kReach)) continue;
    PeakColumn column{without_background(image, c, sigma_px), 0};
    column.peak = brightest_beside(column.values, static_cast<int>(std::lround(candidate)));
    position = reference.estimate(column, sigma_px);
  }
  return answers;
}

void table_head() {
  std::string head =
      "| sigma px | SNR | bound px | found %: paper, fast, refined | gross % | paper | fast | "
      "refined | pull of refined | beyond 3 |";
  std::string rule = "|---|---|---|---|---|---|---|---|---|---|";
  for (const Reference& r : references()) {
    head += " " + r.name + " |";
    rule += "---|";
  }
  fmt::print("{}\n{}\n", head, rule);
}

std::string cell(const TrialScore& s, double bound) {
  if (s.rms_px == 0.0) return "-";
  const bool is_biased = std::abs(s.bias_px) > 0.1 * s.rms_px && std::abs(s.bias_px) > 0.001;
  return is_biased ? fmt::format("{:.2f} ({:+.3f} px)", s.rms_px / bound, s.bias_px)
                   : fmt::format("{:.2f}", s.rms_px / bound);
}

std::string reference_cell(const MethodScore& s, double bound) {
  const std::string text = cell(s.score, bound);
  return s.gross_percent < 0.005 ? text : fmt::format("{}, gross {:.2f} %", text, s.gross_percent);
}

// Fewer trials know a pull less well than it is asked for.
TrialScore pulls_of_refined(StripeTrials t) {
  constexpr int kLeastTrials = 20000;
  t.trials = std::max(t.trials, kLeastTrials);
  const RenderedTrials trials = testing::render(t);
  return judge(trials, answers_of(trials, ExtractMethod::kRefined)).score;
}

void table_row(const StripeTrials& t) {
  const RenderedTrials trials = testing::render(t);
  const double bound = trials.bound_px;
  const MethodScore paper = judge(trials, answers_of(trials, ExtractMethod::kPaper));
  const Answers fast_answers = answers_of(trials, ExtractMethod::kFast);
  const MethodScore fast = judge(trials, fast_answers);
  const MethodScore refined = judge(trials, answers_of(trials, ExtractMethod::kRefined));
  const TrialScore pulls = pulls_of_refined(t);
  fmt::print("| {:.1f} | {:.0f} | {:.4f} | {:.1f}, {:.1f}, {:.1f} | {:.2f}, {:.2f}, {:.2f} |",
             t.sigma_px, t.snr, bound, paper.found_percent, fast.found_percent,
             refined.found_percent, paper.gross_percent, fast.gross_percent, refined.gross_percent);
  fmt::print(" {} | {} | **{}** | {:.2f} | {:.2f} % |", cell(paper.score, bound),
             cell(fast.score, bound), cell(refined.score, bound), pulls.pull_sigma,
             100.0 * pulls.beyond_3_sigma);
  for (const Reference& r : references()) {
    const Answers answers = answers_of(trials, r, fast_answers.positions, t.sigma_px);
    fmt::print(" {} |", reference_cell(judge(trials, answers), bound));
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
      fmt::print(" {:.4f} |", judge(rendered, answers_of(rendered, method)).score.locking_px);
    }
    const std::vector<double> found = answers_of(rendered, ExtractMethod::kFast).positions;
    for (const Reference& r : references()) {
      const Answers answers = answers_of(rendered, r, found, sigma);
      fmt::print(" {:.4f} |", judge(rendered, answers).score.locking_px);
    }
    fmt::print("\n");
  }
}

void all_tables(int trials) {
  StripeTrials base;
  base.trials = trials;
  fmt::print(
      "# How accurate the stripe's position is\n\n"
      "Written by `accuracy_table {} docs/accuracy.md > new.md`, all but what is beyond the "
      "tables: {} "
      "columns a line, each with the stripe "
      "at a random phase of the pixel. SNR is the amplitude over the noise of the peak pixel.\n\n"
      "- **Found**: the part of the columns in which the method says `ok` and is within {:.0f} px. "
      "**Gross**: `ok` and farther off, another thing than the stripe. All other figures are of "
      "what is found.\n"
      "- **Errors** are root mean squares in units of the Cramer-Rao bound "
      "(`striper/stripe/crlb.hpp`), in brackets the bias where it counts. The bound takes the "
      "width as unknown: who knows it may be below 1.\n"
      "- **Pull**: error over predicted error, of 20000 columns or more: its robust standard "
      "deviation, 1 "
      "if "
      "the error bars are true, and the part beyond 3, 0.27 % of a normal distribution.\n"
      "- **What each is told**: `paper`, `fast` and `refined` the camera's noise, and that each "
      "column "
      "stands by itself; place, background and width they find. The references (Gauss-3 to plain "
      "Steger) begin at the brightest pixel beside the one where `fast` found the stripe, in the "
      "columns where it did; they are given the straight background, from pixels five true widths "
      "and more from the true place, and plain Steger (one dimension, without his correction of "
      "the "
      "bias) the true width, 0.8 px at least. So where found differs the errors are of different "
      "columns.\n",
      trials, trials, kGrossPx);
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
}

constexpr const char* kBeyond = "## Beyond the tables";

// What a document says from there on.
std::string beyond_tables(const std::string& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t from = text.find(fmt::format("\n{}\n", kBeyond));
  return from == std::string::npos ? "" : text.substr(from);
}

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  const int trials = argc > 2 ? std::atoi(argv[1]) : 0;
  const std::string rest = argc > 2 ? striper::beyond_tables(argv[2]) : "";
  if (trials < 100 || rest.empty()) {
    fmt::print(stderr,
               "usage: accuracy_table TRIALS DOCUMENT > NEW - at least 100 trials; DOCUMENT has a "
               "heading \"{}\", and is not NEW\n",
               striper::kBeyond);
    return 2;
  }
  striper::all_tables(trials);
  fmt::print("{}", rest);
  return 0;
}
