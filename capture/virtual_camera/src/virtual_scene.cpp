// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include <striper/simulator/simulator.hpp>
#include <striper/virtual_camera/virtual_scene.hpp>

namespace striper {
namespace {

/// Image n with a given light is that of a simulator whose pattern has the light there: a lit one
/// of the constant pattern, a dark one of whichever alternation is dark at n.
class SimulatedVirtualScene : public VirtualScene {
 public:
  explicit SimulatedVirtualScene(const Scene& scene) : scene_(scene) {
    // The sensor is read whole; what of it is sent is the client's to say.
    scene_.imager.region = {};
    scene_.imager.binning = {1, 1};
    scene_.validate();
  }

  cv::Size sensor_size() const override { return {scene_.camera.width(), scene_.camera.height()}; }
  int bit_depth() const override { return scene_.imager.bit_depth; }
  double rate_hz() const override { return scene_.timing.picture_rate_hz; }
  double shutter_us() const override { return 1e6 * scene_.imager.shutter_s; }
  IlluminationPattern pattern() const override { return scene_.timing.pattern; }

  cv::Mat image(std::uint64_t n, Illumination light, double exposure_us) override {
    return simulator_for(n, light, exposure_us).render(n).image;
  }

 private:
  Simulator& simulator_for(std::uint64_t n, Illumination light, double exposure_us) {
    // A line that no laser is wired to lights nothing.
    const bool is_lit =
        light.is_lit() && light.laser_index() < static_cast<int>(scene_.lasers.size());
    IlluminationPattern pattern({Illumination::laser(is_lit ? light.laser_index() : 0)});
    if (!is_lit) {
      pattern = n % 2 == 0 ? IlluminationPattern({Illumination::dark(), Illumination::laser(0)})
                           : IlluminationPattern({Illumination::laser(0), Illumination::dark()});
    }
    if (exposure_us > 0.0) {
      const std::vector<double> exposures(
          pattern.entries().size(), std::min(exposure_us, scene_.timing.longest_exposure_us()));
      pattern = IlluminationPattern(pattern.entries(), exposures);
    }
    // Whoever varies the exposure without end has them made again.
    if (simulators_.size() > kMostSimulators) simulators_.clear();
    const std::string key = pattern.to_string();
    auto found = simulators_.find(key);
    if (found == simulators_.end()) {
      Scene scene = scene_;
      scene.timing.pattern = pattern;
      found = simulators_.emplace(key, Simulator(std::move(scene))).first;
    }
    return found->second;
  }

  static constexpr std::size_t kMostSimulators = 64;  // Lit and dark at 16 exposures, and as many.

  Scene scene_;
  std::map<std::string, Simulator> simulators_;
};

class LoopedScene final : public VirtualScene {
 public:
  LoopedScene(std::shared_ptr<VirtualScene> scene, int count)
      : scene_(std::move(scene)), count_(static_cast<std::uint64_t>(count)) {
    // The lights that it has of its own are made now, others when they are first asked for.
    for (std::uint64_t n = 0; n < count_; ++n) image(n, scene_->pattern().at(n), 0.0);
  }

  cv::Size sensor_size() const override { return scene_->sensor_size(); }
  int bit_depth() const override { return scene_->bit_depth(); }
  double rate_hz() const override { return scene_->rate_hz(); }
  IlluminationPattern pattern() const override { return scene_->pattern(); }

  double shutter_us() const override { return scene_->shutter_us(); }

  cv::Mat image(std::uint64_t n, Illumination light, double /*exposure_us*/) override {
    const int laser = light.is_lit() ? light.laser_index() : -1;
    cv::Mat& made = made_[{n % count_, laser}];
    if (made.empty()) made = scene_->image(n % count_, light).clone();
    return made;
  }

 private:
  std::shared_ptr<VirtualScene> scene_;
  std::uint64_t count_;
  std::map<std::pair<std::uint64_t, int>, cv::Mat> made_;
};

}  // namespace

std::shared_ptr<VirtualScene> make_virtual_scene(const Scene& scene) {
  return std::make_shared<SimulatedVirtualScene>(scene);
}

std::shared_ptr<VirtualScene> make_looped_scene(std::shared_ptr<VirtualScene> scene, int count) {
  return std::make_shared<LoopedScene>(std::move(scene), count);
}

}  // namespace striper
