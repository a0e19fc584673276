// SPDX-License-Identifier: Apache-2.0
// Says against exact truth how often an `ok` return is the stripe, and whether a confidence is a
// probability, on random scenes (tests/support/random_scene.hpp):
//
//     stripe_choice_table rooms|off|sessions|SCENE.yaml FIRST_SEED COUNT [--peak RULE] [--width
//     given|learnt]
//         [--colour grey|red|green|mixed] [--channel CHANNEL] [--frames N] [--threads N] [--csv
//         FILE]
//
// A line per scene: columns; those with a stripe of SNR 8 and more; of them those with an `ok`
// return within max(0.5 px, 3 sigma) of it; the same of all stripes; then in percent of all
// columns, `ok` and wrong, of these those in columns without a stripe and those less than 3 px from
// it; `ok` between the two stripes of an edge, which is not called wrong; the Brier score of the
// confidences; scans that say that there is no stripe.
//
// Seeds 1 to 9999 are for development; 10000 and above are held out: nothing is tuned on them.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/colour_camera.hpp"
#include "support/random_scene.hpp"
#include "support/stripe_score.hpp"

namespace striper {
namespace {

using testing::ColourCamera;
using testing::JudgedReturn;
using testing::Judgement;
using testing::StripeScore;

struct Settings {
  std::string kind = "rooms";
  std::uint64_t first_seed = 1;
  int count = 20;
  int frames = 0;  ///< 0: 3, or as many as a session has.
  int threads = 1;
  PeakRule peak = PeakRule::kBrightest;
  bool is_width_given = true;
  /// The camera's colours: grey, red or green for those of a laser; mixed: grey, red and green in
  /// turn.
  std::string colour = "grey";
  std::optional<Channel> channel;  ///< Instead of the laser's own.
  std::string csv;
};

struct SceneScore {
  StripeScore first;  ///< Of the first frame alone.
  StripeScore all;
  std::string rows;  ///< CSV.
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
    settings.peak = peak_rule(value);
  else if (key == "--width")
    settings.is_width_given = value == "given";
  else if (key == "--frames")
    settings.frames = std::atoi(value.c_str());
  else if (key == "--threads")
    settings.threads = std::atoi(value.c_str());
  else if (key == "--colour")
    settings.colour = value;
  else if (key == "--channel")
    settings.channel = channel_from_string(value);
  else if (key == "--csv")
    settings.csv = value;
  else
    throw Error(ErrorKind::kUsage, key + " - not an option");
}

Settings read_arguments(const std::vector<std::string>& words) {
  Settings settings;
  if (words.size() < 3) throw Error(ErrorKind::kUsage, "expected rooms|off FIRST_SEED COUNT");
  settings.kind = words[0];
  settings.first_seed = std::strtoull(words[1].c_str(), nullptr, 10);
  settings.count = std::atoi(words[2].c_str());
  for (std::size_t i = 3; i + 1 < words.size(); i += 2)
    read_option(settings, words[i], words[i + 1]);
  return settings;
}

Scene scene_of(const Settings& settings, std::uint64_t seed) {
  if (settings.kind.ends_with(".yaml")) {
    Scene scene = load_scene(settings.kind);
    scene.seed = seed;
    return scene;
  }
  if (settings.kind == "sessions") return testing::random_session(seed);
  return testing::random_room(seed);
}

std::string colour_of(const Settings& settings, std::uint64_t seed) {
  constexpr const char* kInTurn[] = {"grey", "red", "green"};
  return settings.colour == "mixed" ? kInTurn[seed % 3] : settings.colour;
}

// A grey or a colour camera before a scene.
class Camera {
 public:
  Camera(const Settings& settings, std::uint64_t seed)
      : looked_at_(scene_of(settings, seed)),
        simulator_(settings.kind == "off" ? testing::without_laser(looked_at_) : looked_at_),
        frames_(settings.frames > 0           ? settings.frames
                : settings.kind == "sessions" ? testing::kSessionPictures
                                              : 3) {
    const std::string colour = colour_of(settings, seed);
    if (colour == "grey") return;
    const bool is_red = colour == "red";
    channel_ = is_red ? Channel::kRed : Channel::kGreen;
    colour_.emplace(simulator_.scene(),
                    is_red ? ColourCamera::Laser::kRed : ColourCamera::Laser::kGreen);
  }

  int frames() const { return frames_; }
  const std::string& name() const { return simulator_.scene().name; }

  /// As a calibration would find it.
  StriperModel model(bool knows_stripe) const {
    StriperModel model = simulator_.model();
    model.channel = channel_;
    if (knows_stripe) model.lasers.front().look = testing::look_of(looked_at_);
    return model;
  }

  Frame render(std::uint64_t picture) {
    Frame frame = colour_ ? colour_->render(picture) : simulator_.render(picture);
    frame.illumination = Illumination::unknown();
    return frame;
  }

  cv::Mat expected_dn(std::uint64_t picture) {
    return colour_ ? colour_->expected_dn(picture) : simulator_.expected_dn(picture);
  }

  // Where the laser is off there is nothing to be found, whatever meets its plane.
  Truth truth(std::uint64_t picture) {
    Truth truth = simulator_.truth(picture).front();
    if (simulator_.scene().lasers.front().pulse_energy_j > 0.0) return truth;
    for (TrueLine& line : truth.lines) line = TrueLine{};
    return truth;
  }

 private:
  Scene looked_at_;
  Simulator simulator_;
  int frames_;
  Channel channel_ = Channel::kGrey;
  std::optional<ColourCamera> colour_;
};

const char* word(const JudgedReturn& r) {
  if (!r.has_values()) return "none";
  constexpr const char* kWords[] = {"right", "mixed", "wrong", "phantom"};
  return kWords[static_cast<int>(r.judgement)];
}

void append_rows(std::string& rows, const std::string& scene, int frame,
                 const std::vector<JudgedReturn>& returns) {
  for (const JudgedReturn& r : returns) {
    rows += fmt::format("{},{},{},{},{:.5f},{:.3f},{:.3f},{:.3f},{:.2f},{:.2f},{},{},{}\n", scene,
                        frame, r.line, to_string(r.status), r.confidence, r.across_px, r.error_px,
                        r.sigma_px, r.truth_amplitude, r.truth_snr, to_string(r.truth_status),
                        r.near_edge ? 1 : 0, word(r));
  }
}

ScannerOptions options_of(const Settings& settings, const StriperModel& model) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.cadence = Cadence({Illumination::laser(0)});
  if (settings.channel) options.ambient.channel = *settings.channel;
  options.stripe.peak = settings.peak;
  if (!options.stripe.stripe_sigma_px) {
    options.stripe.stripe_sigma_px = model.lasers.front().look.width_px;
  }
  return options;
}

SceneScore score_of(const Settings& settings, std::uint64_t seed) {
  Camera camera(settings, seed);
  const StriperModel model = camera.model(settings.is_width_given);
  Scanner scanner(model, options_of(settings, model));
  SceneScore score;
  for (int i = 0; i < camera.frames(); ++i) {
    const auto picture = static_cast<std::uint64_t>(i);
    const Truth truth = camera.truth(picture);
    const cv::Mat expected_dn = camera.expected_dn(picture);
    for (const PolarScan& scan : scanner.process(camera.render(picture))) {
      const auto returns = testing::judge(scan, truth, expected_dn, *model.noise);
      score.all.add(scan, returns);
      if (i == 0) score.first.add(scan, returns);
      if (!settings.csv.empty()) append_rows(score.rows, camera.name(), i, returns);
    }
  }
  return score;
}

std::string figures(const StripeScore& s) {
  return fmt::format("{:>8} {:>7} {:8.2f} {:8.2f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.4f} {:>4}/{}",
                     s.columns, s.clear, s.found_percent(),
                     StripeScore::percent(s.found_visible, s.visible), s.wrong_percent(),
                     s.phantom_percent(), StripeScore::percent(s.biased, s.columns),
                     StripeScore::percent(s.mixed, s.columns), s.brier(), s.unseen, s.scans);
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

void run(const Settings& settings) {
  std::cout << fmt::format("{:5} {:>7} {:>7} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>6}\n",
                           "seed", "columns", "clear", "found %", "any SNR", "wrong %", "phantom%",
                           "biased %", "mixed %", "Brier", "unseen");
  std::vector<SceneScore> scores(static_cast<std::size_t>(settings.count));
  std::atomic<int> next = 0;
  std::mutex printing;
  const auto work = [&] {
    for (int i = next++; i < settings.count; i = next++) {
      const std::uint64_t seed = settings.first_seed + static_cast<std::uint64_t>(i);
      scores[static_cast<std::size_t>(i)] = score_of(settings, seed);
      const std::lock_guard lock(printing);
      std::cout << fmt::format("{:5}", seed) << figures(scores[static_cast<std::size_t>(i)].all)
                << std::endl;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < settings.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  StripeScore first;
  StripeScore all;
  std::ofstream csv;
  if (!settings.csv.empty()) csv.open(settings.csv);
  csv << "scene,frame,line,status,confidence,across_px,error_px,sigma_px,truth_amplitude,truth_snr,"
         "truth_status,near_edge,is\n";
  for (const SceneScore& score : scores) {
    first.add(score.first);
    all.add(score.all);
    csv << score.rows;
  }
  std::cout << "\nfirst" << figures(first) << "\nall  " << figures(all) << "\n";
  print_reliability(all);
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
