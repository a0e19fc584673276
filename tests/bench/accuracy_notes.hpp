// SPDX-License-Identifier: Apache-2.0
// What docs/accuracy.md says after its tables.
#pragma once

namespace striper {

constexpr const char* kAccuracyNotes = R"(
## Beyond the tables

What the tests that are named measure besides; each fails where its figure no longer holds.

- **Speed.** A frame of 640x480 takes `refined` 1.8 times as long as `fast` on a core with AVX-512, one of 2048x1088 1.4 times. With the
  stripe along rows both take about 6 us longer, because what lies side by side there must be turned. `striper bench` measures your machine.
- **Steps of reflectance.** On a black and white print 2.8 m away, in daylight of 15 to 60 DN, the pulls are 1.0 with a median error of at
  most 3 mm; 4 % are beyond 3 sigma with dark exposures, 9 % without (`reflectance_edge_tests`).
- **Thickness of the laser plane.** A surface that rises along the profile moves the middle of a plane with thickness: no error bar has
  that. `calibrate` models it, scans leave it: at a focal length of 461 px a plane .4 degrees thick is off by at most .018 px on
  slopes up to 55 degrees, one of another thickness with its square (`calibration_cost_tests`).
- **Edges of the background**, without dark exposures. A peak beside an edge must rise above the brighter side. In columns without a
  stripe, edges of 8 to 60 times the noise, sharp or blurred by up to 3 px, give false returns in at most 1 %. Beside an edge of 20
  times the noise 99 % of a stripe of 12 times are found from 10 px off on the brighter side, and on the darker one where it lies
  in another of the column's 32-pixel blocks; of a stripe of 9 times, from 90 px off (`BackgroundEdge` in `candidates_tests`).
- **Which thing is the stripe**, one laser always on, no dark exposure (`stripe_choice_table rooms 25 40 --frames 1`, `sessions 1 6 --frames 4`). In random
  rooms with wood, print, checkers and light sources .07 % of all columns are `ok` and wrong, nearly all of them the stripe itself, placed less than 2 px off; .003 % are
  phantoms. Of the columns whose stripe is at least 8 times as high as the pixel's noise 60 % are `ok`, of those in which it is 8 times as high as noise and
  texture of its own width together 84 %. In calibration sessions 70 and 94 %. The others say `outlier`, with their probability: what is said to be the
  stripe with .95 to .99 is it in 98.7 %.
- **Motion and light sources**, with dark fields (docs/ambient.md has the table). In bright sun on asphalt, with snow, grass, rear lights and a
  specular highlight in the same columns, method `paper` finds 6 % of the stripe and .135 false points a column; `fields` with
  `--peak continuous` finds all of it and none. Along a wall all is found up to 36 km/h, 96 % at 60 and 92 % at 100 km/h, without false
  points. With light sources always in view 98 % of the columns are found at 5 km/h, 95 % at 11, 93 % at 36, 90 % at 60 and 87 % at
  100; the others say `blind`, but for 2 % of the columns at 60 and 4 % at 100 km/h; at most one column in a thousand has a false point.
- **Cost of the sun.** .3 ms a scan of 640x480 where the source knows which exposures are lit, twice that where the pattern is checked,
  .5 ms with fields of 640x240, 19 ms at 4096x3000 (`ambient_bench`): motion, light sources, a pattern that slipped. Subtracting
  costs nothing but reading the dark image.
- **A scene that moves is said** where its texture is at least 1.5 times as strong as a pixel's noise (both as rms).
)";

}  // namespace striper
