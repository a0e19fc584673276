// SPDX-License-Identifier: Apache-2.0
// What docs/accuracy.md says after its tables.
#pragma once

namespace striper {

constexpr const char* kAccuracyNotes = R"(
## Beyond the tables

What the tests that are named measured besides; each fails beyond a bound that is somewhat wider than its figure.

- **Speed.** A frame of 640x480 takes `refined` 1.13 times as long as `fast` on a core with AVX-512, one of 2048x1088 1.12 times; with the
  stripe along rows 3 and 12 us longer, because what lies side by side there must be turned. `striper bench` measures your machine.
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
- **Curbs along the way** (`curb_detector_full_tests`; exact geometry, .27 px, 5 m of way at 5 m/s and 20 Hz, 2000 streets of each kind). Up, 5 to
  25 cm high, 1 to 2 m away, faces of 0 to 20 degrees: at most 9 missed; down, 10 to 20 cm: at most 40. Called a curb: at most 4 of a flat road,
  a crown, a ramp, a gutter, a pothole, a hump, a wall; none of boxes and a wheel of .4 m, at the end or with .9 on the way; at most 40 of grass
  at the road's level (blades of 2.5 cm each way) and of grass of 0 to 5 cm, of which only the tips are seen, which scatter by 4 mm: 37; of grass of 2 to
  6 cm, which is level more often, 48. A stone of 6 cm with grass behind it is taken for grass. Place and height have pulls of .85 to 1.15 after ten
  scans. Confidence, on streets made hard to tell (ridges of 0 to 30 cm, boxes of any length, .5 px, up to 2.8 m): of what was said to be a
  curb with .99 on average 99 % are, with .86 90 %, with .77 86 %, with .65 67 %, with .54 65 %, with .35 37 %, with .15 16 %; beside asphalt and pavements
  of 1.5 mm all of 2000 are found; Brier score .03. On the rendered curb of
  data/scenes/curb.yaml: foot within .1 mm, height within .1 mm after 20 scans. Of single scans (5 to 25 cm at 1 to 2 m)
  all 300 are found with .9 mm rms, by the strongest published rule (Zhang et al. 2018) 243 with 71 mm; of 450 humps, holes and ramps none is called
  a curb, by that rule 161.
- **Curbs, foot and height in one scan** (`curb_bound_full_tests`; 1000 draws each of .05, .1, .27 and .5 px, 1, 2 and 3 m, 5, 10, 15 and 25 cm, tilted by
  up to 5 degrees, beside the Cramer-Rao bound of the four-vertex line). Whole scans: rms at most 1.14 of the bound, pulls .95 to 1.09. With 30 % of the
  returns missing and 2 % gross outliers, beside the bound of those that are left: at most 1.25 in 41 of 48 cells, up to 1.32 in five, 2.1 and 2.5 at .1
  and .05 px, 3 m, 5 cm: of a face of ten returns one draw in some hundreds loses some as speckle, and its error bar says so (pulls .95 to 1.16). At 2 m, .27 px: foot 1.2, 1.0, .8 mm, height .15 mm at 10, 15,
  25 cm. With stripers drawn from a calibration's covariance pulls are within .9 to 1.1 with `sigma_cal` (`CurbCalibration`).
- **Curbs in real streets** (`CurbReal`). Of 275 places where rings of a turning lidar cross a curb that people drew, 248 are found within .2 m, none is said
  to be beyond .5 m; what is missed are faces that noise makes flat and curbs behind parked vehicles. (What stands
  behind an edge is told from grass by two lengths that were chosen on these rings: by what was chosen before them it were 234.) The same curb from one place, six recordings pooled
  over a metre: place 2 mm at 1 m, 19 mm at 6 m (17 at 4 m), height 1.4 to 4.0 mm, -83 mm on average (published for it: -79).
- **Curbs in rendered streets** (`rendered_streets_tests`, data/scenes/street). All that have one are found, the others are not called one, but
  for grass of 5 cm (one of 20 drives, with .52) and, **not held, a steep ridge of snow**: 15 of 20 drives, with up to .98. It has a curb's face and height. Asphalt that is mottled by 20 % at
  8 mm, finer than the stripe is wide, is taken for rough ground, and the pavement beyond it for the road.
- **Objects** (`detect_tests`). What comes at 100 km/h from 4 m, at 30 Hz and .1 px: closing speed within .009 m/s by its third scan, the error
  bars .02, pull 1.0 over 300 draws; a vehicle that brakes lags by less than two scans. 50 us a scan with nine objects. Of real vehicles, by a
  turning lidar against motion capture: .060 and .039 m/s (robust rms) overtaking, .14 at a crossing, one track each, pulls .8 to 1.1
  (with their tails: the plain rms is .2 m/s) where roughness and acceleration are told; where they are learnt .07, .05 and .27,
  and the error bars are too small by 1.5, 1.7 and 3.4.
)";

}  // namespace striper
