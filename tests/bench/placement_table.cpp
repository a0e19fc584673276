// SPDX-License-Identifier: Apache-2.0
// Says against exact truth how far off the stripe is placed, and how far it says it may be, where
// it is known which thing is the stripe (the search is limited to some pixels about the truth), on
// random scenes (tests/support/random_scene.hpp):
//
//     placement_table rooms|sessions FIRST_SEED COUNT [--dark 1]
//
// A line per kind of surface, without what is within 4 px of an object's edge: `ok` returns; the
// pull by the median; beyond 3 sigma; off by more than .5 px, and by more than 3 sigma too; the
// median error and sigma, pixels, and what 90 % are below.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <striper/simulator/simulator.hpp>
#include <striper/stripe/extractor.hpp>

#include "support/random_scene.hpp"

namespace striper {
namespace {

constexpr float kReach_px = 5.0F;  // About the truth.
constexpr std::uint64_t kFrames = 2;

struct Placed {
  double error_px;
  double sigma_px;
};

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(part * (values.size() - 1.0));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double percent(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

std::string row(const std::string& kind, const std::vector<Placed>& placed) {
  std::vector<double> pulls;
  std::vector<double> errors;
  std::vector<double> sigmas;
  std::size_t beyond = 0;
  std::size_t far = 0;
  std::size_t both = 0;
  for (const Placed& p : placed) {
    const double error = std::abs(p.error_px);
    errors.push_back(error);
    sigmas.push_back(p.sigma_px);
    pulls.push_back(error / p.sigma_px);
    const bool is_beyond = error > 3.0 * p.sigma_px;
    const bool is_far = error > 0.5;
    beyond += is_beyond ? 1 : 0;
    far += is_far ? 1 : 0;
    both += is_far && is_beyond ? 1 : 0;
  }
  return fmt::format("{:8} {:7} {:6.2f} {:7.2f} {:8.2f} {:7.2f} {:7.3f} {:7.3f} {:7.3f} {:7.3f}\n",
                     kind, placed.size(), quantile(pulls, 0.5) / 0.6745,
                     percent(beyond, placed.size()), percent(far, placed.size()),
                     percent(both, placed.size()), quantile(errors, 0.5), quantile(errors, 0.9),
                     quantile(sigmas, 0.5), quantile(sigmas, 0.9));
}

std::string kind_of(const Material& material) {
  constexpr const char* kWords[] = {"plain", "checker", "paint", "wood", "poster"};
  if (material.texture.index() == 0 && material.mottle_contrast > 0.0) return "mottle";
  return kWords[material.texture.index()];
}

struct Settings {
  std::string kind = "rooms";
  std::uint64_t first_seed = 1;
  int count = 10;
  bool has_dark = false;
};

class Table {
 public:
  explicit Table(const Settings& settings) : settings_(settings) {}

  void run() {
    for (int i = 0; i < settings_.count; ++i) {
      run(settings_.first_seed + static_cast<std::uint64_t>(i));
    }
    std::cout << fmt::format("{:8} {:>7} {:>6} {:>7} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7}\n",
                             "surface", "ok", "pull", ">3 s %", ">.5 px %", "both %", "error",
                             "90 %", "sigma", "90 %");
    for (const auto& [kind, placed] : placed_) std::cout << row(kind, placed);
  }

 private:
  void run(std::uint64_t seed) {
    const Scene scene =
        settings_.kind == "sessions" ? testing::random_session(seed) : testing::random_room(seed);
    Simulator simulator(scene);
    Simulator off(testing::without_laser(scene));
    const StripeLook look = testing::look_of(scene);
    ExtractOptions options;
    options.each_line_by_itself = true;
    options.noise = simulator.model().noise;
    options.stripe_sigma_px = look.width_px;
    options.expected.resize(1);
    for (std::uint64_t n = 0; n < kFrames; ++n) {
      const Frame frame = simulator.render(n);
      const Truth truth = simulator.truth(n).front();
      LitFrame lit;
      lit.lit = frame.image;
      lit.full_scale_dn = frame.full_scale_dn();
      if (settings_.has_dark) lit.dark = off.render(n + 7).image.clone();
      limit(truth, options.expected.front());
      Stripe stripe;
      make_extractor(options)->extract(lit, stripe);
      take(scene, truth, stripe);
    }
  }

  static void limit(const Truth& truth, ExpectedStripe& expected) {
    expected.first_px.assign(truth.lines.size(), 1.0F);
    expected.last_px.assign(truth.lines.size(), 0.0F);
    for (std::size_t i = 0; i < truth.lines.size(); ++i) {
      if (!is_taken(truth.lines[i])) continue;
      const auto v = static_cast<float>(truth.lines[i].brightest.v_px);
      expected.first_px[i] = v - kReach_px;
      expected.last_px[i] = v + kReach_px;
    }
  }

  static bool is_taken(const TrueLine& line) {
    return line.status == TruthStatus::kVisible && line.others.empty() && !line.brightest.near_edge;
  }

  void take(const Scene& scene, const Truth& truth, const Stripe& stripe) {
    for (std::size_t i = 0; i < stripe.size(); ++i) {
      const TrueReturn& t = truth.lines[i].brightest;
      if (stripe.status[i] != ReturnStatus::kOk || !is_taken(truth.lines[i])) continue;
      const Placed placed{stripe.across_px[i] - t.v_px, static_cast<double>(stripe.sigma_px[i])};
      const std::string kind = kind_of(scene.objects[static_cast<std::size_t>(t.object)].material);
      placed_[kind].push_back(placed);
      placed_["~ all"].push_back(placed);
    }
  }

  Settings settings_;
  std::map<std::string, std::vector<Placed>> placed_;
};

}  // namespace
}  // namespace striper

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "placement_table rooms|sessions FIRST_SEED COUNT [--dark 1]\n";
    return 2;
  }
  striper::Settings settings;
  settings.kind = argv[1];
  settings.first_seed = std::strtoull(argv[2], nullptr, 10);
  settings.count = std::atoi(argv[3]);
  for (int i = 4; i + 1 < argc; i += 2) {
    if (std::string(argv[i]) == "--dark") settings.has_dark = std::string(argv[i + 1]) == "1";
  }
  striper::Table(settings).run();
}
