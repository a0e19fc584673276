// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/simulator/ideal_look.hpp>
#include <striper/simulator/simulator.hpp>

#include "view/sensor.hpp"
#include "view/truth_finder.hpp"

namespace striper {
namespace {

using detail::Beam;
using detail::Charge;
using detail::RowRange;
using detail::View;

bool is_interlaced(ScanMode scan) { return scan != ScanMode::kProgressive; }
bool comes_by_field(ScanMode scan) {
  return scan == ScanMode::kAlternateTopFirst || scan == ScanMode::kAlternateBottomFirst;
}
bool is_top_first(ScanMode scan) {
  return scan == ScanMode::kTopFirst || scan == ScanMode::kAlternateTopFirst;
}

Scene checked(Scene scene) {
  scene.validate();
  const cv::Rect sensor(0, 0, scene.camera.width(), scene.camera.height());
  if (scene.imager.region.empty()) scene.imager.region = sensor;
  return scene;
}

/// The region that is read and around it the pixels whose light the lens spreads into it: so that a
/// region of interest is a piece of the whole image to the last bit.
cv::Rect lit_region(const Scene& scene) {
  const Imager& imager = scene.imager;
  const double flare_px = imager.bloom.fraction > 0.0 ? imager.bloom.sigma_px : 0.0;
  const int reach = 3 + static_cast<int>(std::ceil(5.0 * imager.blur_sigma_px)) +
                    static_cast<int>(std::ceil(5.0 * flare_px));
  const cv::Rect wide(imager.region.x - reach, imager.region.y - reach,
                      imager.region.width + 2 * reach, imager.region.height + 2 * reach);
  return wide & cv::Rect(0, 0, scene.camera.width(), scene.camera.height());
}

/// All that is rendered of one moment; the images appear when they are first asked for.
struct Moment {
  Moment(const Scene& scene, const detail::RayGrid& rays, double time_s)
      : view(scene, rays, time_s) {}

  View view;
  cv::Mat daylight;               // Electrons per sensor pixel.
  std::map<int, cv::Mat> lasers;  // The same, per laser.
};

/// The same matrix where it stays as it is.
cv::Mat times(const cv::Mat& electrons, double factor) {
  return factor == 1.0 ? electrons : cv::Mat(electrons * factor);
}

}  // namespace

class Simulator::Impl {
 public:
  explicit Impl(Scene scene)
      : scene_(checked(std::move(scene))),
        rays_(scene_.camera, lit_region(scene_)),
        is_static_(scene_.is_static()),
        gains_(detail::pixel_gains(whole_size(), scene_.imager, scene_.seed)) {
    make_beams();
  }

  const Scene& scene() const noexcept { return scene_; }

  void apply(const SceneSettings& settings) {
    Scene changed = scene_;
    for (SimulatedLaser& laser : changed.lasers) {
      const double longer = settings.shutter_s / changed.imager.shutter_s;
      if (laser.is_continuous) laser.pulse_energy_j *= longer;
    }
    changed.imager.shutter_s = settings.shutter_s;
    changed.imager.dn_per_electron = settings.dn_per_electron;
    for (std::size_t i = 0; i < changed.objects.size(); ++i) {
      changed.objects[i].T_world_object = settings.T_world_object.at(i);
    }
    changed.validate();
    scene_ = std::move(changed);
    make_beams();
    lasers_on_ = settings.lasers_on;
    model_.reset();
    for (auto& [number, moment] : moments_) moment.reset();
  }

  int exposures_per_picture() const noexcept { return is_interlaced(scene_.timing.scan) ? 2 : 1; }
  int parts_per_frame() const noexcept { return comes_by_field(scene_.timing.scan) ? 2 : 1; }

  std::uint64_t exposure_number(std::uint64_t sequence, int exposure) const noexcept {
    return sequence * static_cast<std::uint64_t>(exposures_per_picture()) +
           static_cast<std::uint64_t>(exposure);
  }
  Illumination illumination(std::uint64_t sequence, int exposure) const noexcept {
    if (!lasers_on_) return Illumination::dark();
    return scene_.timing.pattern.at(exposure_number(sequence, exposure));
  }
  double time_s(std::uint64_t sequence, int exposure) const noexcept {
    const double frames =
        static_cast<double>(sequence) + exposure / static_cast<double>(exposures_per_picture());
    return frames / scene_.timing.picture_rate_hz;
  }

  Frame render(std::uint64_t sequence, int part) {
    Frame frame = describe(sequence, part);
    const int type = scene_.imager.bit_depth > 8 ? CV_16UC1 : CV_8UC1;
    frame.image.create(frame_size(), type);
    for_each_exposure(part, [&](int exposure, const RowRange& rows) {
      detail::read_out(charge(sequence, exposure), scene_.imager, scene_.seed, rows, frame.image);
    });
    return frame;
  }

  cv::Mat expected_dn(std::uint64_t sequence, int part) {
    cv::Mat image(frame_size(), CV_32FC1);
    for_each_exposure(part, [&](int exposure, const RowRange& rows) {
      detail::read_out_expected(charge(sequence, exposure), scene_.imager, rows, image);
    });
    return image;
  }

  std::vector<Truth> truth(std::uint64_t sequence) {
    std::vector<Truth> truths;
    for (int exposure = 0; exposure < exposures_per_picture(); ++exposure) {
      const Illumination light = illumination(sequence, exposure);
      if (light.is_lit()) truths.push_back(truth_of(sequence, exposure, light.laser_index()));
    }
    return truths;
  }

  const StriperModel& model() {
    if (!model_) model_ = make_model();
    return *model_;
  }

 private:
  void make_beams() {
    beams_.clear();
    for (const SimulatedLaser& laser : scene_.lasers) beams_.emplace_back(laser, scene_);
  }

  StriperModel make_model() const {
    StriperModel model;
    model.camera = scene_.camera;
    model.axis = scene_.axis;
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      model.lasers.push_back({beams_[i].plane(), {}, {}, ideal_look(scene_, static_cast<int>(i))});
    }
    const Imager& imager = scene_.imager;
    model.noise = NoiseModel{imager.noise.read_noise_e * imager.dn_per_electron,
                             imager.noise.shot ? imager.dn_per_electron : 0.0,
                             imager.black_level_dn, imager.bit_depth};
    return model;
  }
  cv::Size whole_size() const noexcept {
    const Imager& imager = scene_.imager;
    return {imager.region.width / imager.binning.width,
            imager.region.height / imager.binning.height};
  }
  cv::Size frame_size() const noexcept {
    const cv::Size whole = whole_size();
    return {whole.width, whole.height / parts_per_frame()};
  }
  PixelGrid whole_grid() const noexcept {
    const Imager& imager = scene_.imager;
    return PixelGrid::region(imager.region.x, imager.region.y)
        .then(PixelGrid::binned(imager.binning.width, imager.binning.height));
  }
  bool is_top(int exposure) const noexcept {
    return is_top_first(scene_.timing.scan) == (exposure == 0);
  }
  PixelGrid exposure_grid(int exposure) const noexcept {
    if (!is_interlaced(scene_.timing.scan)) return whole_grid();
    return whole_grid().then(is_top(exposure) ? PixelGrid::top_field() : PixelGrid::bottom_field());
  }
  Field exposure_field(int exposure) const noexcept {
    if (!is_interlaced(scene_.timing.scan)) return Field::kProgressive;
    return is_top(exposure) ? Field::kTop : Field::kBottom;
  }

  /// Calls action(exposure, rows) for each exposure that a frame is made of.
  template <typename Action>
  void for_each_exposure(int part, Action action) const {
    if (!is_interlaced(scene_.timing.scan)) return action(0, RowRange{});
    for (int exposure = 0; exposure < 2; ++exposure) {
      const int first = is_top(exposure) ? 0 : 1;
      if (!comes_by_field(scene_.timing.scan)) {
        action(exposure, RowRange{first, 2, first, 2});
      } else if (exposure == part) {
        action(exposure, RowRange{first, 2, 0, 1});
      }
    }
  }

  /// Everything of a frame but its pixels.
  Frame describe(std::uint64_t sequence, int part) const {
    const ScanMode scan = scene_.timing.scan;
    if (part < 0 || part >= parts_per_frame()) {
      throw Error(ErrorKind::kBadValue, fmt::format("part {} of a frame - expected 0 to {}", part,
                                                    parts_per_frame() - 1));
    }
    Frame frame;
    frame.bit_depth = scene_.imager.bit_depth;
    frame.sensor_size = {scene_.camera.width(), scene_.camera.height()};
    frame.grid = comes_by_field(scan) ? exposure_grid(part) : whole_grid();
    frame.sequence = sequence;
    frame.exposure_in_picture = part;
    frame.exposures_per_picture = exposures_per_picture();
    if (is_interlaced(scan)) {
      frame.field_period_ns = std::llround(0.5e9 / scene_.timing.picture_rate_hz);
    }
    frame.time.monotonic_ns =
        std::llround(1e9 * time_s(sequence, 0)) + part * frame.field_period_ns;
    frame.exposure_ns = std::llround(1e9 * scene_.imager.shutter_s * longer(sequence, part));
    frame.illumination = illumination(sequence, part);
    frame.field = exposure_field(part);
    if (scan == ScanMode::kTopFirst || scan == ScanMode::kBottomFirst) {
      frame.field =
          scan == ScanMode::kTopFirst ? Field::kInterlacedTopFirst : Field::kInterlacedBottomFirst;
      if (illumination(sequence, 0) != illumination(sequence, 1)) {
        frame.illumination = Illumination::unknown();
      }
    }
    return frame;
  }

  Moment& moment(std::uint64_t sequence, int exposure) {
    const std::uint64_t number = is_static_ ? 0 : exposure_number(sequence, exposure);
    auto& [key, kept] = moments_[number % moments_.size()];
    if (!kept || key != number) {
      key = number;
      kept = std::make_unique<Moment>(scene_, rays_, is_static_ ? 0.0 : time_s(sequence, exposure));
    }
    return *kept;
  }

  /// With the lens' flare, and without what is not read.
  cv::Mat as_read(const cv::Mat& electrons) const {
    const cv::Rect& region = scene_.imager.region;
    const cv::Rect read(region.tl() - rays_.region().tl(), region.size());
    return detail::bloomed(electrons, scene_.imager.bloom)(read).clone();
  }
  const cv::Mat& daylight(Moment& moment) const {
    if (moment.daylight.empty()) {
      moment.daylight = as_read(moment.view.daylight());
    }
    return moment.daylight;
  }
  const cv::Mat& laser_light(Moment& moment, int laser) const {
    cv::Mat& light = moment.lasers[laser];
    if (light.empty()) {
      light = as_read(moment.view.laser(beams_[static_cast<std::size_t>(laser)], laser));
    }
    return light;
  }

  /// How many times as long as the scene's shutter this exposure is: of a bracket.
  double longer(std::uint64_t sequence, int exposure) const noexcept {
    const double exposure_us =
        scene_.timing.pattern.exposure_us_at(exposure_number(sequence, exposure));
    return exposure_us > 0.0 ? 1e-6 * exposure_us / scene_.imager.shutter_s : 1.0;
  }
  /// How many times as much light of a laser comes in: of a pulsed one as much as ever.
  double more_laser(std::uint64_t sequence, int exposure, int laser) const noexcept {
    const bool is_continuous = scene_.lasers[static_cast<std::size_t>(laser)].is_continuous;
    return is_continuous ? longer(sequence, exposure) : 1.0;
  }

  Charge charge(std::uint64_t sequence, int exposure) {
    Moment& now = moment(sequence, exposure);
    const Illumination light = illumination(sequence, exposure);
    Charge charge;
    charge.exposure_number = exposure_number(sequence, exposure);
    charge.gains = gains_;
    charge.daylight =
        detail::binned(times(daylight(now), longer(sequence, exposure)), scene_.imager.binning);
    if (light.is_lit()) {
      const int laser = light.laser_index();
      const double more = more_laser(sequence, exposure, laser);
      charge.laser = detail::binned(times(laser_light(now, laser), more), scene_.imager.binning);
    }
    return charge;
  }

  Truth truth_of(std::uint64_t sequence, int exposure, int laser) {
    Moment& now = moment(sequence, exposure);
    Truth truth;
    truth.sequence = sequence;
    truth.time_s = time_s(sequence, exposure);
    truth.laser = laser;
    truth.field = exposure_field(exposure);
    truth.axis = scene_.axis;
    cv::Size size = whole_size();
    size.height /= exposures_per_picture();
    truth.lines = detail::find_truth(
        {now.view, beams_[static_cast<std::size_t>(laser)], laser, exposure_grid(exposure), size,
         times(daylight(now), longer(sequence, exposure)),
         times(laser_light(now, laser), more_laser(sequence, exposure, laser))});
    return truth;
  }

  Scene scene_;
  detail::RayGrid rays_;
  bool is_static_;
  bool lasers_on_ = true;
  cv::Mat gains_;
  std::vector<Beam> beams_;
  std::optional<StriperModel> model_;  // Once it has been asked for.
  // The latest two moments (the two fields of a frame) of a moving scene, the only one of a
  // static one.
  std::array<std::pair<std::uint64_t, std::unique_ptr<Moment>>, 2> moments_;
};

SceneSettings SceneSettings::of(const Scene& scene) {
  SceneSettings settings;
  settings.shutter_s = scene.imager.shutter_s;
  settings.dn_per_electron = scene.imager.dn_per_electron;
  for (const SceneObject& object : scene.objects) {
    settings.T_world_object.push_back(object.T_world_object);
  }
  return settings;
}

Simulator::Simulator(Scene scene) : impl_(std::make_unique<Impl>(std::move(scene))) {}
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;
Simulator::~Simulator() = default;

const Scene& Simulator::scene() const noexcept { return impl_->scene(); }
void Simulator::apply(const SceneSettings& settings) { impl_->apply(settings); }
int Simulator::exposures_per_picture() const noexcept { return impl_->exposures_per_picture(); }
int Simulator::parts_per_frame() const noexcept { return impl_->parts_per_frame(); }
Frame Simulator::render(std::uint64_t sequence, int part) { return impl_->render(sequence, part); }
cv::Mat Simulator::expected_dn(std::uint64_t sequence, int part) {
  return impl_->expected_dn(sequence, part);
}
std::vector<Truth> Simulator::truth(std::uint64_t sequence) { return impl_->truth(sequence); }
StriperModel Simulator::model() const { return impl_->model(); }
double Simulator::time_s(std::uint64_t sequence, int exposure) const noexcept {
  return impl_->time_s(sequence, exposure);
}

Eigen::Isometry3d Simulator::T_cam_object(int object, std::uint64_t sequence, int exposure) const {
  const Scene& scene = impl_->scene();
  if (object < 0 || object >= static_cast<int>(scene.objects.size())) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("object {} - the scene has {} objects", object, scene.objects.size()));
  }
  return detail::T_cam_object_at(scene, scene.objects[static_cast<std::size_t>(object)],
                                 time_s(sequence, exposure));
}

}  // namespace striper
