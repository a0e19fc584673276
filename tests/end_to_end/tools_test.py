# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper measure` promises: measurements.csv to the letter, of recordings and of sources that are
scanned on the way, values that agree with the simulated scene within their bars, limits as events and exit code,
and words for what cannot be done. The bars themselves are tests/sdk/profile/tools_test.cpp's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 tools_test.py
"""
import csv
import io
import json
import math
import os
import statistics
import unittest

from program import InScratch, striper

# A wall 2 m away, a board of .5 m in front of it, and a pipe.
SCENE = """striper_scene: 1
camera: {width: 640, height: 480, fov_deg: 55, rotation_deg: [0, 14, 0]}
imager: {blur_px: 0.5, dn_per_electron: 0.05, black_level_dn: 8, shutter_us: 2.5}
noise: {shot: yes, read_e: 12, seed: 11}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 70, thickness_deg: 0.25, wavelength_nm: 900, pulse_uj: 10.4}
device: {position_m: [0, 0, 1]}
objects:
  - {name: wall, shape: plane, position_m: [2, 0, 0], reflectance: 0.5}
  - {name: board, shape: box, size_m: [0.05, 0.5, 2], position_m: [1.725, -0.3, 0.5], reflectance: 0.5}
  - {name: pipe, shape: cylinder, radius_m: 0.1, length_m: 2, position_m: [1.6, 0.4, 0.5], reflectance: 0.4}
"""
COLUMNS = ["frame", "time_s", "tool", "value", "sigma", "sigma_cal", "unit", "points", "status"]
TOOLS = ("--tool", "wall:line:x=1.9..2.1", "--tool", "depth:step:x=1.9..2.1;x=1.6..1.8,y=-.6..0",
         "--tool", "board:width:x=1.6..1.8,y=-.7..0.1", "--tool", "pipe:circle:x=1.4..1.62,y=.2..0.6")
TRUTH = {"wall.line.distance": 2.0, "wall.line.angle": 0.0, "depth.step": -0.3, "board.width": 0.5,
         "pipe.circle.radius": 0.1, "pipe.circle.x": 1.6, "pipe.circle.y": 0.4}


class Scene(InScratch):
    def setUp(self):
        super().setUp()
        scene = self.write("scene.yaml", SCENE)
        striper("simulate", scene, "-o", self.path("shots"), "--frames", "3")
        self.source = "images:" + self.path("shots")
        self.model = self.path("shots", "model.yaml")


class Tools(Scene):
    def measure(self, *arguments, **options):
        return striper("measure", self.source, "--model", self.model, *TOOLS, *arguments, **options)

    def test_a_source_gives_the_scenes_sizes_within_their_bars(self):
        rows = list(csv.reader(io.StringIO(self.measure().stdout)))
        self.assertEqual(rows[0], COLUMNS)
        table = [dict(zip(COLUMNS, row)) for row in rows[1:]]
        self.assertEqual(len(table), 3 * 8)
        for row in table:
            if row["tool"] not in TRUTH:
                continue
            self.assertEqual(row["status"], "ok", row)
            self.assertEqual(row["unit"], "rad" if row["tool"].endswith("angle") else "m")
            self.assertLess(abs(float(row["value"]) - TRUTH[row["tool"]]), 5 * float(row["sigma"]) + 1e-4, row)
            self.assertGreater(int(row["points"]), 20)

    def test_recordings_of_all_kinds_give_what_the_source_gives(self):
        scans = [self.path("scans" + kind) for kind in (".csv", ".jsonl", ".mcap")]
        outputs = [word for name in scans for word in ("-o", name)]
        striper("capture", self.source, "--model", self.model, *outputs)
        live = self.measure().stdout
        for name in scans:
            of_model = () if name.endswith(".mcap") else ("--model", self.model)
            self.assertEqual(striper("measure", name, *of_model, *TOOLS).stdout, live, name)

    def test_limits_are_events_and_exit_code(self):
        kept = self.measure("--limit", "depth=-.31..-.29", "--limit", "wall.line.distance=1.9..", "--json", "-o",
                            self.path("m.csv"))
        summary = json.loads(kept.stdout)
        self.assertTrue(summary["kept"])
        self.assertEqual(summary["scans"], 3)
        self.assertEqual([one["broken"] for one in summary["limits"]], [0, 0])
        self.assertTrue(math.isclose(summary["tools"]["depth.step"]["mean"], -0.3, abs_tol=2e-3))
        with open(self.path("m.csv")) as file:
            self.assertEqual(file.readline().strip().split(","), COLUMNS)
        broken = self.measure("--limit", "depth.step=-.2..0", "--json", code=1)
        summary = json.loads(broken.stdout)
        self.assertFalse(summary["kept"])
        self.assertEqual(summary["limits"][0]["broken"], 3)
        self.assertEqual([event["event"] for event in summary["events"]], ["limit_broken"])
        self.assertIn("limit -0.2..0 of depth.step: broken in 3 of 3 scans", broken.stderr)
        never = self.measure("--tool", "no:gap:x=9..10", "--limit", "no=0..1", code=1)
        self.assertIn("limit 0..1 of no.gap: never measured", never.stderr)

    def test_a_plot_shows_pieces_corners_and_measurements(self):
        self.measure("--plot", self.path("m.svg"))
        with open(self.path("m.svg")) as file:
            text = file.read()
        for words in ("straight piece", "its ends, ten sigma", "A scan from above", "depth.step", "one sigma"):
            self.assertIn(words, text)

    def test_a_table_made_elsewhere_needs_a_sigma(self):
        lines = [f"0,0,{b / 100},{2 / math.cos(b / 100)}" for b in range(-40, 41)]
        table = self.write("other.csv", "frame,time_s,bearing_rad,range_m\n" + "\n".join(lines) + "\n")
        done = striper("measure", table, "--tool", "wall:line", "--sigma", "0.002")
        row = dict(zip(COLUMNS, done.stdout.split("\n")[1].split(",")))
        self.assertEqual((row["tool"], row["status"], row["points"]), ("wall.line.distance", "ok", "81"))
        self.assertAlmostEqual(float(row["value"]), 2.0, 6)
        self.assertEqual(row["sigma_cal"], "")
        kept = self.path("kept.csv")
        striper("measure", table, "--tool", "wall:line", "--sigma", "0.002", "-o", kept)
        before = self.bytes_of(kept)
        none = striper("measure", table, "--tool", "wall:line", "-o", kept, code=2)
        self.assertIn("say how good they are by --sigma M", none.stderr)
        self.assertEqual(self.bytes_of(kept), before)

    @staticmethod
    def bytes_of(path):
        with open(path, "rb") as file:
            return file.read()

    def test_files_that_are_something_else_stay(self):
        scans = self.path("scans.csv")
        striper("capture", self.source, "--model", self.model, "-o", scans)
        guidance = self.write("guidance.yaml", "striper_guidance: 1\n")
        picture = self.write("photo.svg", b"\x89PNG\r\n")
        for option, name, words in (("-o", guidance, "holds no table of this kind"),
                                    ("--plot", guidance, "name a FILE.svg"), ("--plot", picture, "holds no SVG"),
                                    ("--plot", self.path("none", "m.svg"), "there is no folder")):
            kept = self.bytes_of(name) if os.path.exists(name) else None
            run = striper("measure", scans, "--model", self.model, *TOOLS, option, name, code=None)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(words, run.stderr)
            self.assertEqual(run.stdout, "")
            if kept is not None:
                self.assertEqual(self.bytes_of(name), kept)
        for _ in range(2):  # Its own are replaced.
            striper("measure", scans, "--model", self.model, *TOOLS, "-o", self.path("m.csv"), "--plot",
                    self.path("m.svg"))

    def test_nonsense_is_refused(self):
        for arguments, code, words in (
            (("--tool", "a:volume"), 2, "TOOL one of line, step, gap"),
            (("--tool", "wall:gap"), 2, "tool 'wall' is there twice"),
            (("--limit", "depth"), 2, "--limit depth: expected NAME=A..B"),
            (("--limit", "wall=1..2"), 2, "expected one of wall.line.distance, wall.line.angle"),
            (("--limit", "x=1..2"), 2, "nothing of that name is measured"),
        ):
            self.assertIn(words, self.measure(*arguments, code=code).stderr)
        self.assertIn("gives frames", striper("measure", self.source, *TOOLS, code=2).stderr)
        self.assertIn("NAME.line.straightness", striper("measure", "--help").stdout)


class Shape(Scene):
    def capture(self, *arguments, **options):
        done = striper("capture", self.source, "--model", self.model, *arguments, **options)
        return [row for row in csv.DictReader(io.StringIO(done.stdout))]

    @staticmethod
    def rms(rows):
        return math.sqrt(sum((float(row["x_m"]) - 2) ** 2 for row in rows) / len(rows))

    @staticmethod
    def sigma(rows):
        return statistics.median(float(row["sigma_m"]) for row in rows)

    def wall(self, rows):
        return [row for row in rows if abs(float(row["x_m"]) - 2) < 0.05]

    def test_scans_are_smoothed_averaged_and_resampled(self):
        plain = self.wall(self.capture())
        smooth = self.wall(self.capture("--smooth", "line"))
        mean = self.wall(self.capture("--average", "3"))
        self.assertEqual({row["frame"] for row in mean}, {"1"})
        # Part of the error is alike in all scans, the scene being still: of that averaging gains nothing.
        self.assertLess(self.rms(mean), 0.9 * self.rms(plain))
        self.assertAlmostEqual(self.sigma(mean) / self.sigma(plain), 1 / math.sqrt(3), 2)
        self.assertLess(self.rms(smooth), 0.6 * self.rms(plain))
        pixels = {(row["u_px"], row["v_px"]) for row in plain}
        self.assertLessEqual({(row["u_px"], row["v_px"]) for row in smooth}, pixels)
        grid = self.capture("--resample", "y=0.005", "--frames", "1")
        for row in grid:
            self.assertAlmostEqual(float(row["y_m"]) / 0.005, round(float(row["y_m"]) / 0.005), 6)
        self.assertWhatCameOut()
        self.assertIn("gaps are filled", striper("capture", self.source, "--fill-gaps", "1", code=2).stderr)
        for asked in (("--smooth", "line"), ("--average", "2"), ("--resample", "y=.1")):
            self.assertIn("need --model", striper("capture", self.source, *asked, code=2).stderr)

    def assertWhatCameOut(self):
        """The counts are of the scans that were written, by capture and by convert."""
        source = ("capture", self.source, "--model", self.model)
        raw = self.path("raw.csv")
        striper(*source, "-o", raw, "--missing")
        for command in (source, ("convert", raw, "-m", self.model)):
            table = self.path("mean.csv")
            done = striper(*command, "--average", "2", "--smooth", "line", "-o", table, "--doubtful", "--json")
            with open(table) as file:
                rows = [row for row in csv.DictReader(file)]
            summary = json.loads(done.stdout)
            shaped = summary["shaped"]
            self.assertEqual((shaped["scans"], shaped["incomplete"], shaped["moved"]), (2, 1, 0))
            for status in ("ok", "outlier"):
                self.assertEqual(shaped["returns"][status], sum(row["status"] == status for row in rows))
            self.assertEqual((summary.get("outputs") if command is source else summary["sinks"])[0]["written"], 2)
            self.assertIn("returns as they were written: ", done.stderr)
            self.assertIn("1 mean of fewer scans than --average asks for", done.stderr)
            self.assertRegex(done.stderr, "wrote 2 scans" + (f", {len(rows)} lines" if command is source else ""))

    def test_tables_without_their_missing_columns_are_not_averaged(self):
        """Rows of ok returns alone are of other columns in each scan."""
        lines = [f"{frame},{frame},{0.01 * k},2,0.001,{k},7" for frame in (0, 1) for k in range(40) if k != 9 + frame]
        table = self.write("ok.csv", "frame,time_s,bearing_rad,range_m,sigma_m,u_px,v_px\n" + "\n".join(lines) + "\n")
        done = striper("convert", table, "--average", "2", "-o", self.path("mean.csv"), code=None)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("write them with --missing", done.stderr)

    def test_a_scene_that_moves_is_refused(self):
        moving = self.path("moving")
        for k, x in enumerate((1.8, 2.0)):
            scene = self.write(f"{k}.yaml", SCENE.replace("[2, 0, 0]", f"[{x}, 0, 0]"))
            striper("simulate", scene, "-o", self.path(f"part{k}"), "--frames", "1")
        os.mkdir(moving)
        for k in range(2):
            name = [one for one in sorted(os.listdir(self.path(f"part{k}"))) if one.endswith(".png")][0]
            os.rename(self.path(f"part{k}", name), os.path.join(moving, f"{k}.png"))
        done = striper("capture", "images:" + moving, "--model", self.model, "--average", "2", "-o",
                       self.path("moved.csv"), code=3)
        self.assertIn("most of what is seen moves", done.stderr)
        striper("capture", "images:" + moving, "--model", self.model, "-o", self.path("raw.csv"), "--missing")
        done = striper("convert", self.path("raw.csv"), "--average", "2", "-o", self.path("moved.csv"), code=3)
        self.assertIn("most of what is seen moves", done.stderr)


class Verify(InScratch):
    """The industry's sheet."""

    def simulate(self, name, scene, frames=6):
        path = self.write(name + ".yaml", scene)
        striper("simulate", path, "-o", self.path(name), "--frames", frames)
        return "images:" + self.path(name)

    def wall(self, x_m):
        return self.simulate(f"wall{x_m}", SCENE.split("  - {name: board")[0].replace("[2, 0, 0]", f"[{x_m}, 0, 0]"))

    def verify(self, source, *arguments, **options):
        model = self.path(source[7:], "model.yaml")
        return striper("verify", source, "--model", model, *arguments, "--json", **options)

    def test_a_wall_at_three_distances(self):
        main, near, far = self.wall(1.5), self.wall(1.2), self.wall(2)
        done = self.verify(main, "--distance", "1.5", "--at", "1.2=" + near, "--at", "2=" + far)
        figures = json.loads(done.stdout)
        sheet = figures["sheet"]
        self.assertTrue(figures["passed"])
        # The paper's geometry: a camera pitched 14 degrees down, 0.5 m above the laser's plane.
        f_px = 320 / math.tan(math.radians(27.5))
        near_m = 0.5 / math.tan(math.radians(14) + math.atan(239.5 / f_px))
        self.assertAlmostEqual(sheet["clearance_m"], near_m, 3)
        depth_m = 1.5 * math.cos(math.radians(14)) + 0.5 * math.sin(math.radians(14))
        self.assertAlmostEqual(sheet["x_spacing_m"], depth_m / f_px, 5)
        self.assertEqual(sheet["repeatability_count"], 6)
        self.assertGreater(sheet["z_resolution_count"], 500)
        self.assertLess(sheet["z_resolution_m"], 1e-3)
        self.assertLess(sheet["repeatability_of_mean_m"], 0.2 * sheet["z_resolution_m"])
        self.assertGreater(sheet["rate_hz"], 1)
        self.assertEqual(sheet["latency_count"], 6)
        self.assertLess(figures["linearity"]["most_m"], 5e-4)
        self.assertAlmostEqual(figures["linearity"]["gain"], 1, 3)
        for words in ("clearance 0.7", "z resolution", "k = 2", "z linearity", "latency", "passed"):
            self.assertIn(words, done.stderr)
        self.assertIn("expected M=SOURCE", self.verify(main, "--at", "far", code=2).stderr)
        elsewhere = self.verify(main, "--distance", "1.5", "--at", "1.2=" + near, "--at", "1.9=" + far, code=1)
        self.assertIn("failed: at 1.9 m the bias of 100", elsewhere.stderr)
        self.assertFalse(json.loads(elsewhere.stdout)["passed"])
        for few in (("--at", "1.2=" + near, "--at", "2=" + far), ("--distance", "1.5", "--at", "2=" + far)):
            self.assertIn("expected --distance and two of these", self.verify(main, *few, code=2).stderr)
        same = self.verify(main, "--distance", "1.5", "--at", "1.5=" + near, "--at", "2=" + far, code=2)
        self.assertIn("expected a distance that no other target has", same.stderr)

    def test_a_step_and_a_pipe(self):
        wall, board, pipe = SCENE.split("objects:\n")[1].splitlines(keepends=True)
        head = SCENE.split("objects:\n")[0] + "objects:\n"
        board = board.replace("[1.725, -0.3, 0.5]", "[1.725, -0.8, 0.5]").replace("[0.05, 0.5, 2]", "[0.05, 1.6, 2]")
        step = self.simulate("step", head + wall + board, 2)
        self.assertAlmostEqual(json.loads(self.verify(step, "--step", "0.3").stdout)["target"]["measured_m"], 0.3, 3)
        off = self.verify(step, "--step", "0.31", code=1)
        self.assertFalse(json.loads(off.stdout)["passed"])
        self.assertRegex(off.stderr, "failed: the step's error of -(9|10).* mm is beyond three sigmas")
        none = self.verify(self.wall(1.5), "--step", "0.3", code=1)
        self.assertIn("failed: the step is found in 0 of 6 scans (6: ", none.stderr)
        self.assertEqual(len(json.loads(none.stdout)["failures"]), 1)
        self.assertNotIn("fill", json.loads(self.verify(step, "--step", "0.3").stdout))
        for flat in (("--distance", "2"), ("--min-fill", "0.5"), ("--max-ratio", "3")):
            self.assertIn(flat[0], self.verify(step, "--step", "0.3", *flat, code=2).stderr)
        alone = self.simulate("pipe", head + pipe.replace("radius_m: 0.1", "radius_m: 0.2"), 2)
        # Where a surface turns away the stripe lies 0.1 mm off, which the bars of two scans do not have.
        target = json.loads(self.verify(alone, "--radius", "0.2", code=None).stdout)["target"]
        self.assertAlmostEqual(target["measured_m"], 0.2, delta=3e-4)


if __name__ == "__main__":
    unittest.main()
