# SPDX-License-Identifier: Apache-2.0
"""Proves end to end, on rendered images, what tests/sdk/profile proves on scans: pieces, corners and tools are where
the scene has them, by their error bars; and so they are with calibrations made from images.

STRIPER_FULL_TRIALS=1: 20 scenes of each kind and 20 calibrations, which decide the goals; 3 scenes and none otherwise.
"""
import math
import os

import numpy as np
import pytest
import striper

from conftest import ROOT

FULL = "STRIPER_FULL_TRIALS" in os.environ
SCENES = 20 if FULL else 3
CALIBRATIONS = 20
POSES = 16

# The camera and laser of data/scenes/calibration.yaml: the laser plane is level, so that the scan's x and y are the world's.
HEAD = """striper_scene: 1
camera: {{width: 480, height: 360, fov_deg: 55, lens: plumb_bob, distortion: [-0.24, 0.09, 0, 0, 0],
         rotation_deg: [0, 14, 0]}}
imager: {{blur_px: 0.5, dn_per_electron: 0.02, black_level_dn: 8, shutter_us: 2.5}}
noise: {{shot: yes, read_e: 20, seed: {seed}}}
lasers:
  - {{position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.2, wavelength_nm: 900, pulse_uj: 10.4}}
objects:
"""


def scan_of(folder, objects, seed):
    """A scan of objects, each (size_x, size_y, x, y, yaw_deg), by the perfect model."""
    return scan_of_text(folder, "".join(
        f"  - {{name: box {number}, shape: box, size_m: [{size_x}, {size_y}, 1.2], position_m: [{x}, {y}, -0.5],"
        f" rotation_deg: [0, 0, {yaw}], reflectance: 0.6}}\n" for number, (size_x, size_y, x, y, yaw) in enumerate(objects)), seed)


def scan_of_text(folder, objects, seed):
    path = folder / f"{seed}.yaml"
    path.write_text(HEAD.format(seed=seed) + objects)
    return striper.scan(f"sim:{path}", model=striper.simulated_model(path)).next()


def scan_without_noise(folder, seed):
    path = folder / f"{seed}.yaml"
    return striper.scan(f"sim:{path}?noise=off", model=striper.simulated_model(path)).next()


def long_pieces(scan):
    return [piece for piece in striper.segments(scan).pieces if piece.points >= 20]


def rms(pulls):
    return math.sqrt(np.mean(np.square(pulls)))


def assert_true_bars(pulls):
    """Within three sigmas of what so many true pulls of a normal distribution have: chi2 by Wilson and Hilferty."""
    count = len(pulls)
    spread = 3.0 * math.sqrt(2.0 / (9.0 * count))
    low, high = ((1.0 - 2.0 / (9.0 * count) + side * spread) ** 1.5 for side in (-1.0, 1.0))
    print(f"\n{count} pulls, rms {rms(pulls):.3f}, {low:.2f} to {high:.2f} is three sigmas")
    assert low < rms(pulls) < high


def assert_true_body(pulls):
    """Half of the pulls are within .67, as of a normal distribution, to three sigmas of such a part.

    Where a surface ends or bends the tails are longer: a column that shows both sides of a corner lies between them, and
    a column that shows the last bit of a surface gives a return or none.
    """
    inside = np.mean(np.abs(pulls) < 0.6745)
    spread = 3.0 * 0.5 / math.sqrt(len(pulls))
    print(f"\n{len(pulls)} pulls, {inside:.2f} of them within .6745, rms {rms(pulls):.3f}")
    assert 0.5 - spread < inside < 0.5 + spread
    assert np.max(np.abs(pulls)) < 6.0


def test_a_wall_is_one_piece_and_smoother_than_its_returns(tmp_path):
    pulls, ratios = [], []
    for seed in range(SCENES):
        distance = np.random.default_rng(seed).uniform(1.2, 2.0)
        scan = scan_of(tmp_path, [(0.2, 4.0, distance + 0.1, 0.0, 0.0)], seed)
        (wall,) = long_pieces(scan)
        # A laser plane has a thickness, within which what is nearer is brighter: tens of micrometres on a wall, more
        # than the noise of 480 columns leaves of its distance.
        (exact,) = long_pieces(scan_without_noise(tmp_path, seed))
        assert abs(exact.line.distance_m - distance) < 50e-6
        pulls.append((wall.line.distance_m - exact.line.distance_m) / math.sqrt(wall.line.covariance[1, 1]))
        ok = scan.returns["status"] == striper.Status.OK
        smooth = striper.smooth(scan).returns
        ratios.append(rms(smooth["x_m"][ok] - distance) / rms(scan.returns["x_m"][ok] - distance))
    assert_true_bars(pulls)
    assert np.median(ratios) < 0.26


def test_a_step_is_two_pieces_and_as_deep_as_the_scene_has_it(tmp_path):
    pulls = []
    for seed in range(100, 100 + SCENES):
        random = np.random.default_rng(seed)
        near = random.uniform(1.2, 1.5)
        depth = random.uniform(0.02, 0.2)
        scan = scan_of(tmp_path, [(0.2, 2.0, near + 0.1, 1.0, 0.0), (0.2, 4.0, near + depth + 0.1, 0.0, 0.0)], seed)
        assert len(long_pieces(scan)) == 2
        (row,) = striper.measure(scan, "depth:step")
        assert row.status == "ok"
        pulls.append((abs(row.value) - depth) / row.sigma)
    assert_true_bars(pulls)


def test_a_corner_is_where_the_scene_has_it(tmp_path):
    pulls = []
    for seed in range(200, 200 + SCENES):
        random = np.random.default_rng(seed)
        side = 0.5
        yaw = math.radians(random.uniform(35.0, 55.0))
        middle = np.array([random.uniform(1.6, 1.9), random.uniform(-0.1, 0.1)])
        scan = scan_of(tmp_path, [(side, side, middle[0], middle[1], math.degrees(yaw))], seed)
        corners = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5], [0.5, 0.5]]) * side
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        nearest = min((middle + turn @ corner for corner in corners), key=lambda corner: corner[0])
        joints = [joint for joint in striper.segments(scan).joints if joint.kind == "corner"]
        joint = min(joints, key=lambda joint: np.linalg.norm(joint.corner_m - nearest))
        whitened = np.linalg.solve(np.linalg.cholesky(joint.covariance), joint.corner_m - nearest)
        pulls += list(whitened)
    assert_true_body(pulls)
    assert_true_bars(pulls)


def test_a_wave_is_followed(tmp_path):
    """A corrugated wall, 30 columns a wave and 10 sigmas high: the smoothed returns against the exact ones, less what the
    laser plane's thickness moves all of them by."""
    single, pulls, ratios, biases = [], [], [], []
    for seed in range(400, 400 + SCENES):
        distance = np.random.default_rng(seed).uniform(1.4, 1.8)
        # A column is distance / focal length wide, 461 pixels; what a sigma is, a flat wall there says.
        flat = scan_of(tmp_path, [(0.2, 4.0, distance + 0.1, 0.0, 0.0)], seed).returns
        period, height = 30.0 * distance / 461.0, 10.0 * np.median(flat["sigma_m"][flat["status"] == striper.Status.OK])
        across = np.arange(-1.0, 1.0, period / 60.0)
        profile = ", ".join(f"[{y:.5f}, {height * math.sin(2.0 * math.pi * y / period):.6f}]" for y in across)
        wave = (f"  - {{name: wave, shape: sweep, profile_m: [{profile}], length_m: 1.2, position_m: [{distance}, 0, -0.5],"
                " rotation_deg: [0, -90, 0], reflectance: 0.6}\n")
        scan = scan_of_text(tmp_path, wave, seed)
        (_, truth), = striper.simulate(tmp_path / f"{seed}.yaml", 1)
        smooth = striper.smooth(scan).returns
        ok = (smooth["status"] == striper.Status.OK) & np.isfinite(truth.lines["range_m"])
        assert np.count_nonzero(ok) > 400
        error = (scan.returns["range_m"] - truth.lines["range_m"])[ok]
        thickness = np.mean(error)
        error_smooth = (smooth["range_m"] - truth.lines["range_m"])[ok] - thickness
        assert abs(thickness) < 50e-6
        single.append(rms((error - thickness) / scan.returns["sigma_m"][ok]))
        pulls.append(rms(error_smooth / smooth["sigma_m"][ok]))
        ratios.append(rms(error_smooth) / rms(error - thickness))
        biases.append(np.mean(error_smooth / scan.returns["sigma_m"][ok]))
    print(f"\nwaves: pulls {rms(pulls):.3f} (of single columns {rms(single):.3f}), rms {rms(ratios):.3f} of a single column's")
    assert rms(ratios) < 0.6
    assert np.max(np.abs(biases)) < 1.0
    assert abs(rms(pulls) - rms(single)) < (0.05 if FULL else 0.1)
    assert abs(rms(single) - 1.0) < 0.1


def test_an_arc_is_the_circle_of_the_scene(tmp_path):
    """Pipes before nothing. Where a pipe turns away a column sees less of it than it is wide, so the tool measures what
    faces the sensor; the exact circle is that of the same returns without noise, which the scene's must be to 50 um."""
    pulls = []
    for seed in range(500, 500 + SCENES):
        random = np.random.default_rng(seed)
        radius, x, y = random.uniform(0.1, 0.3), random.uniform(1.5, 1.8), random.uniform(-0.2, 0.2)
        pipe = (f"  - {{name: pipe, shape: cylinder, radius_m: {radius}, length_m: 1.2, position_m: [{x}, {y}, -0.5],"
                " reflectance: 0.6}\n")
        scan = scan_of_text(tmp_path, pipe, seed)
        tool = f"pipe:circle:y={y - 0.7 * radius}..{y + 0.7 * radius}"
        rows = striper.measure(scan, tool)
        exact = striper.measure(scan_without_noise(tmp_path, seed), tool)
        for row, without_noise, truth in zip(rows, exact, (radius, x, y)):
            assert row.status == "ok"
            print(f"{row.tool} {truth:.4f} off {1e6 * (without_noise.value - truth):.0f} um, sigma {1e6 * row.sigma:.0f} um")
            pulls.append((row.value - without_noise.value) / row.sigma)
    assert_true_bars(pulls)


TOOLS = [
    "near:line:x=1.1..1.25,y=0.2..0.4",
    "step:step:x=1.1..1.25,y=0.17..0.43;x=1.5..1.75,y=-0.4..-0.1",
    "angle:angle:x=1.1..1.25,y=0.17..0.43;x=1.5..1.75,y=-0.4..-0.1",
    "width:width:x=1.1..1.25,y=0.1..0.5",
    "gap:gap:x=1.1..1.25,y=0.1..0.5;x=1.5..1.75,y=-0.48..0.03",
]


def boxes_before_a_wall(seed):
    """Two boxes, each time a bit elsewhere, so that their edges are anywhere between two columns; and what of them is known:
    the width of the near one, and the gap from it to the other's corner."""
    random = np.random.default_rng(1000 + seed)
    width, y, other_y, yaw = 0.3 + random.uniform(-0.01, 0.01), 0.3 + random.uniform(-0.01, 0.01), -0.25, math.radians(15.0)
    other_y += random.uniform(-0.01, 0.01)
    boxes = [(0.2, width, 1.3, y, 0.0), (0.2, 0.5, 1.7, other_y, math.degrees(yaw)), (0.2, 4.0, 2.3, 0.0, 0.0)]
    corner_y = other_y + 0.25 * math.cos(yaw) - 0.1 * math.sin(yaw)
    return boxes, {"width.width": width, "gap.gap": y - 0.5 * width - corner_y}


def test_a_surface_ends_where_the_scene_has_it(tmp_path):
    """An end is anywhere between two columns: uniform, so that .39 of the pulls are within .6745 for one end, none beyond 1.73."""
    pulls = []
    for seed in range(300, 300 + SCENES):
        boxes, truth = boxes_before_a_wall(seed)
        scan = scan_of(tmp_path, boxes, seed)
        near = boxes[0]
        (piece,) = [piece for piece in long_pieces(scan) if abs(piece.line.distance_m - 1.2) < 0.02]
        ends = sorted([(piece.begin_m[1], piece.sigma_begin_m), (piece.end_m[1], piece.sigma_end_m)])
        for (at, sigma), side in zip(ends, (-0.5, 0.5)):
            pulls.append((at - near[3] - side * near[1]) / sigma)
    print(f"\n{len(pulls)} ends, pulls {np.mean(pulls):.2f} in the mean, rms {rms(pulls):.2f}, greatest {np.max(np.abs(pulls)):.2f}")
    assert np.max(np.abs(pulls)) < 2.5
    if FULL:
        assert 0.8 < rms(pulls) < 1.2
        assert abs(np.mean(pulls)) < 3.0 / math.sqrt(len(pulls))


def measured(path, seed, noise, model):
    scan = striper.scan(f"sim:{path}?seed={seed}{noise}", model=model).next()
    return {row.tool: row for row in striper.measure(scan, TOOLS, model) if "straightness" not in row.tool}


@pytest.mark.skipif(not FULL, reason="20 calibrations take two minutes")
def test_tools_are_right_with_whole_calibrations(tmp_path):
    session = ROOT / "data" / "scenes" / "calibration.yaml"
    pulls = {}
    for seed in range(1, 1 + CALIBRATIONS):
        boxes, known = boxes_before_a_wall(seed)
        path = tmp_path / f"{seed}.yaml"
        scan_of(tmp_path, boxes, seed)
        exact = measured(path, seed, "&noise=off", striper.simulated_model(path))
        assert all(row.status == "ok" for row in exact.values())
        truth = {tool: known.get(tool, row.value) for tool, row in exact.items()}
        images = [frame.image.copy() for frame, _ in striper.simulate(f"{session}?seed={seed}", POSES)]
        result = striper.calibrate(lasers=[images], board="9x6", square=0.06, lens="plumb_bob")
        assert not result.refused, result.verdict
        for tool, row in measured(path, seed, "", result.model).items():
            if row.status == "ok":
                pulls.setdefault(tool, []).append((row.value - truth[tool]) / math.hypot(row.sigma, row.sigma_cal))
    for tool, of_tool in pulls.items():
        print(f"\n{tool}: {len(of_tool)} ok", end="")
        assert len(of_tool) >= 0.9 * CALIBRATIONS, tool
        assert_true_bars(of_tool)
