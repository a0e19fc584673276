// SPDX-License-Identifier: Apache-2.0
#include "support/choice_trial.hpp"

#include <striper/pipeline/scanner.hpp>
#include <striper/simulator/scene_yaml.hpp>
#include <striper/simulator/simulator.hpp>

#include "support/colour_camera.hpp"
#include "support/random_scene.hpp"

namespace striper::testing {
namespace {

Scene scene_of(const ChoiceTrial& trial) {
  if (trial.kind.ends_with(".yaml")) {
    Scene scene = load_scene(trial.kind);
    scene.seed = trial.seed;
    return scene;
  }
  if (trial.kind == "sessions") return random_session(trial.seed);
  return random_room(trial.seed);
}

std::string colour_of(const ChoiceTrial& trial) {
  constexpr const char* kInTurn[] = {"grey", "red", "green"};
  return trial.colour == "mixed" ? kInTurn[trial.seed % 3] : trial.colour;
}

// A grey or a colour camera before a scene.
class Camera {
 public:
  explicit Camera(const ChoiceTrial& trial)
      : looked_at_(scene_of(trial)),
        simulator_(trial.kind == "off" ? without_laser(looked_at_) : looked_at_),
        frames_(trial.frames > 0           ? trial.frames
                : trial.kind == "sessions" ? kSessionPictures
                                           : 3) {
    const std::string colour = colour_of(trial);
    if (colour == "grey") return;
    const bool is_red = colour == "red";
    channel_ = is_red ? Channel::kRed : Channel::kGreen;
    colour_.emplace(simulator_.scene(),
                    is_red ? ColourCamera::Laser::kRed : ColourCamera::Laser::kGreen);
  }

  int frames() const { return frames_; }

  /// As a calibration would find it.
  StriperModel model(bool knows_stripe) const {
    StriperModel model = simulator_.model();
    model.channel = channel_;
    if (knows_stripe) model.lasers.front().look = look_of(looked_at_);
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

ScannerOptions options_of(const ChoiceTrial& trial, const StriperModel& model) {
  ScannerOptions options = ScannerOptions::for_model(model);
  options.ambient.cadence = Cadence({Illumination::laser(0)});
  if (trial.channel) options.ambient.channel = *trial.channel;
  options.stripe.peak = trial.peak;
  if (!options.stripe.stripe_sigma_px) {
    options.stripe.stripe_sigma_px = model.lasers.front().look.width_px;
  }
  return options;
}

}  // namespace

ChoiceScore run_trial(const ChoiceTrial& trial, const JudgedFrame& visit) {
  Camera camera(trial);
  const StriperModel model = camera.model(trial.knows_stripe);
  Scanner scanner(model, options_of(trial, model));
  ChoiceScore score;
  for (int i = 0; i < camera.frames(); ++i) {
    const auto picture = static_cast<std::uint64_t>(i);
    const Truth truth = camera.truth(picture);
    const cv::Mat expected_dn = camera.expected_dn(picture);
    for (const PolarScan& scan : scanner.process(camera.render(picture))) {
      const std::vector<JudgedReturn> returns = judge(scan, truth, expected_dn, *model.noise);
      score.all.add(scan, returns);
      if (i == 0) score.first.add(scan, returns);
      if (visit) visit(i, returns);
    }
  }
  return score;
}

}  // namespace striper::testing
