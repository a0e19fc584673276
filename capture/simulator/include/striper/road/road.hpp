// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <striper/guidance/guidance_config.hpp>

namespace striper {

/// A stretch of the way along which the stripe was laid out.
struct RoadBend {
  double length_m = 0.0;
  double radius_m = 0.0;      ///< To the left positive; 0 is straight.
  double transition_m = 0.0;  ///< Over its first metres curvature changes evenly to that.
};

/// How the truck moves beside the stripe: a sine; several add up.
struct RoadWander {
  double amplitude_m = 0.0;
  double period_m = 60.0;
  double phase_rad = 0.0;
};

/// From here on the truck goes so fast.
struct RoadSpeed {
  double at_m = 0.0;
  double speed_m_s = 10.0;
};

/// A painted line. Its figures are those of the line as it was painted once.
struct RoadLine {
  int line = 0;  ///< As guidance counts: 0 is followed, 1 the other of a double line; -1 neither.
  double lateral_m = 0.0;  ///< To the left of the road's course.
  double width_m = 0.1016;
  double dash_m = 0.0;  ///< 0: solid.
  double gap_m = 0.0;
  double begin_m = 0.0;  ///< Where the first dash begins, or the line.
  double end_m = std::numeric_limits<double>::infinity();
  double brightness = 0.5;  ///< Beside new white paint: .4 to .6 of beads (retro), 1 of yellow .7.
};

/// How worn paint is.
struct RoadWear {
  double edge_sd_m = 0.0;         ///< Of each edge; the report's figure: 0.3 in.
  double edge_length_m = 0.076;   ///< Over which wear is alike: 3 in.
  double chunks_per_m = 0.0;      ///< Pieces broken off an edge,
  double chunk_depth_m = 0.0254;  ///< up to so deep.
  double end_sd_m = 0.0;          ///< What is worn off the ends of dashes, half of a Gaussian.
};

/// Something else on the road. `kind` is as in seen.csv: marker, tape, spot, cross, letter.
struct RoadObject {
  std::string kind = "spot";
  double at_m = 0.0;  ///< Where it begins, along the road.
  double lateral_m = 0.0;
  double length_m = std::numeric_limits<double>::quiet_NaN();  ///< NaN: as usual for its kind.
  double width_m = std::numeric_limits<double>::quiet_NaN();
  double brightness = std::numeric_limits<double>::quiet_NaN();
};

/// A stretch of road that is wet, in the shadow, or the like.
struct RoadStretch {
  double from_m = 0.0;
  double to_m = 0.0;
};

/// What a beam's light and its detector do.
struct RoadLight {
  double paint_dn = 3000.0;   ///< What new paint returns in the window's middle.
  double road_dn = 60.0;      ///< What bare road does,
  double road_texture = 0.2;  ///< give or take this share, from spot to spot.
  double dark_dn = 20.0;      ///< What the converter shows without light.
  double noise_dn = 12.0;
  double sun_dn = 0.0;    ///< Of daylight that passes the filter, except in the shadow.
  double fall_off = 0.3;  ///< By how much the window's ends are darker than its middle.
  double spot_m =
      0.00635;  ///< Across: 1/4 in; along the road longer by 1 / sin of the beam's angle.
  double wet_share = 0.25;   ///< Of what beads return, where the road is wet.
  double fresh_share = 0.3;  ///< Of what paint returns, where it is wet itself.
};

/// How a beam really lies, where the truck's own file does not know it.
struct RoadMisalignment {
  std::string beam;
  double zero_m = 0.0;
  double scale = 1.0;
};

/// A mechanic with a tape measure, who says where line 0 is beside the truck.
struct RoadTape {
  double every_m = 0.0;          ///< Of the truck's way; 0: nobody does.
  std::vector<double> x_m{0.0};  ///< Where along the truck.
  double sigma_m = 0.001;
};

/// All that `guide simulate` needs: a road, what lies on it, a truck and how it is driven.
struct Road {
  std::uint64_t seed = 1;
  double length_m = 200.0;
  std::vector<RoadBend> course;  ///< Straight after its end.
  std::vector<RoadSpeed> speeds{{0.0, 10.0}};
  std::vector<RoadWander> wander;
  std::vector<RoadLine> lines{RoadLine{}};
  RoadWear wear;
  std::vector<RoadObject> objects;
  std::vector<RoadStretch> wet;
  std::vector<RoadStretch> shadows;
  RoadLight light;
  double odometer_rate_hz = 500.0;
  double yaw_rate_sigma_rad_s = std::numeric_limits<double>::quiet_NaN();  ///< NaN: no gyroscope.
  GuidanceConfig truck = report_truck();
  std::vector<RoadMisalignment> misaligned;
  RoadTape tape;

  /// @throws Error{kBadValue} naming field, value and bound.
  void validate() const;
};

/// Reads `ROAD.yaml` (data/roads/README.md). @throws Error{kBadFile} naming file, line, field,
/// value and what was expected; Error{kNotFound, kIo}.
Road load_road(const std::filesystem::path& path);
Road parse_road(const std::string& text, const std::string& name);

}  // namespace striper
