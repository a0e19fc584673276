// SPDX-License-Identifier: Apache-2.0
#include "support/choice_trial.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include <striper/core/error.hpp>
#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/colour_camera.hpp"
#include "support/random_scene.hpp"

namespace striper::testing {
namespace {

Scene usual_scene_of(const ChoiceTrial& trial) {
  if (trial.kind.ends_with(".yaml")) {
    Scene scene = load_scene(trial.kind);
    scene.seed = trial.seed;
    return scene;
  }
  if (trial.kind.ends_with("sessions")) return random_session(trial.seed);
  if (trial.kind == "bare rooms") return random_bare_room(trial.seed);
  if (trial.kind == "rooms" || trial.kind == "off") return random_room(trial.seed);
  throw Error(ErrorKind::kUsage, trial.kind + " - no kind of scene: see choice_trial.hpp");
}

Scene scene_of(const ChoiceTrial& trial) {
  Scene scene = usual_scene_of(trial);
  return trial.is_overexposed ? overexposed(std::move(scene)) : scene;
}

std::string colour_of(const ChoiceTrial& trial) {
  constexpr const char* kInTurn[] = {"grey", "red", "green"};
  return trial.colour == "mixed" ? kInTurn[trial.seed % 3] : trial.colour;
}

// To a quality of 70 to 95, and back.
void compress(std::uint64_t seed, cv::Mat& image) {
  if (image.depth() != CV_8U) return;
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes,
               {cv::IMWRITE_JPEG_QUALITY, 70 + static_cast<int>(seed * 7 % 26)});
  image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

// Blocks of columns that the laser does not reach, by the scene's seed.
std::vector<cv::Range> shaded_columns(std::uint64_t seed, int columns) {
  SceneDice dice(seed + 0x5ADE);
  std::vector<cv::Range> blocks(static_cast<std::size_t>(dice.whole(2, 6)));
  for (cv::Range& block : blocks) {
    const int count = dice.whole(3, columns / 12);
    const int first = dice.whole(0, columns - count);
    block = {first, first + count};
  }
  return blocks;
}

}  // namespace

// A grey or a colour camera before a scene.
struct TrialCamera::Parts {
  Parts(const ChoiceTrial& asked, bool has_laser)
      : trial(asked),
        looked_at(scene_of(trial)),
        simulator(has_laser ? looked_at : without_laser(looked_at)) {
    const std::string word = colour_of(trial);
    if (word == "grey") return;
    const bool is_red = word == "red";
    channel = is_red ? Channel::kRed : Channel::kGreen;
    colour.emplace(simulator.scene(),
                   is_red ? ColourCamera::Laser::kRed : ColourCamera::Laser::kGreen);
  }

  Frame render(std::uint64_t number) {
    return colour ? colour->render(number) : simulator.render(number);
  }

  cv::Mat expected_dn(std::uint64_t number) {
    return colour ? colour->expected_dn(number) : simulator.expected_dn(number);
  }

  ChoiceTrial trial;
  Scene looked_at;
  Simulator simulator;
  Channel channel = Channel::kGrey;
  std::optional<ColourCamera> colour;
};

TrialCamera::TrialCamera(const ChoiceTrial& trial)
    : parts_(std::make_unique<Parts>(trial, !trial.kind.starts_with("off"))) {
  if (!trial.is_shaded) return;
  unlit_ = std::make_unique<Parts>(trial, false);
  shaded_ = shaded_columns(trial.seed, parts_->simulator.scene().camera.width());
}

TrialCamera::~TrialCamera() = default;

void TrialCamera::shade(const cv::Mat& unlit, cv::Mat& image) const {
  for (const cv::Range& block : shaded_) unlit.colRange(block).copyTo(image.colRange(block));
}

int TrialCamera::frames() const {
  if (parts_->trial.frames > 0) return parts_->trial.frames;
  return parts_->trial.kind.ends_with("sessions") ? kSessionFrames : 3;
}

StriperModel TrialCamera::model() const {
  StriperModel model = parts_->simulator.model();
  model.channel = parts_->channel;
  if (parts_->trial.knows_stripe) model.lasers.front().look = look_of(parts_->looked_at);
  return model;
}

ScannerOptions TrialCamera::options() const {
  const StriperModel own = model();
  ScannerOptions options = ScannerOptions::for_model(own);
  options.ambient.pattern = IlluminationPattern({Illumination::laser(0)});
  if (parts_->trial.channel) options.ambient.channel = *parts_->trial.channel;
  options.stripe.peak = parts_->trial.peak;
  if (!options.stripe.stripe_sigma_px) {
    options.stripe.stripe_sigma_px = own.lasers.front().look.width_px;
  }
  return options;
}

Frame TrialCamera::render(std::uint64_t number) {
  Frame frame = parts_->render(number);
  if (unlit_) shade(unlit_->render(number).image, frame.image);
  if (parts_->trial.is_compressed) compress(parts_->trial.seed, frame.image);
  frame.illumination = Illumination::unknown();
  return frame;
}

cv::Mat TrialCamera::expected_dn(std::uint64_t number) {
  cv::Mat expected_dn = parts_->expected_dn(number);
  if (unlit_) shade(unlit_->expected_dn(number), expected_dn);
  return expected_dn;
}

cv::Mat TrialCamera::background_dn(std::uint64_t number) {
  if (parts_->colour) return {};
  return Simulator(without_laser(parts_->simulator.scene())).expected_dn(number);
}

Truth TrialCamera::truth(std::uint64_t number) {
  Truth truth = parts_->simulator.truth(number).front();
  for (const cv::Range& block : shaded_) {
    std::fill(truth.lines.begin() + block.start, truth.lines.begin() + block.end, TrueLine{});
  }
  if (parts_->simulator.scene().lasers.front().pulse_energy_j > 0.0) return truth;
  for (TrueLine& line : truth.lines) line = TrueLine{};
  return truth;
}

ChoiceScore run_trial(const ChoiceTrial& trial, const JudgedFrame& visit) {
  TrialCamera camera(trial);
  const StriperModel model = camera.model();
  Scanner scanner(model, camera.options());
  ChoiceScore score;
  for (int i = 0; i < camera.frames(); ++i) {
    const auto number = static_cast<std::uint64_t>(i);
    const Truth truth = camera.truth(number);
    const cv::Mat expected_dn = camera.expected_dn(number);
    const cv::Mat background_dn = camera.background_dn(number);
    for (const PolarScan& scan : scanner.process(camera.render(number))) {
      const std::vector<JudgedReturn> returns =
          judge(scan, truth, expected_dn, *model.noise, background_dn);
      score.all.add(scan, returns);
      if (i == 0) score.first.add(scan, returns);
      if (visit) visit(i, returns);
    }
  }
  return score;
}

}  // namespace striper::testing
