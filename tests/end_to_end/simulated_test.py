# SPDX-License-Identifier: Apache-2.0
"""Proves with the simulated striper that a recording gives the same scans as its source, byte for
byte, whatever the fields and the laser do; that `striper simulate` writes what can be scanned, with a
truth that the scans agree with; and that the first example runs.

Run by ctest; by hand: STRIPER=.../striper STRIPER_EXAMPLE=.../01_stream_scans python3 simulated_test.py
"""
import collections
import csv
import json
import math
import os
import random
import signal
import subprocess
import tempfile
import unittest

from program import SOURCE_DIR, STRIPER, run, scene_path, striper

EXAMPLE = os.environ["STRIPER_EXAMPLE"]
WALL = scene_path("wall.yaml")


class Simulated(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="striper-test-")
        cls.room = os.path.join(cls.scratch.name, "wall")
        striper("simulate", WALL, "-o", cls.room, "--frames", "3")
        cls.model = os.path.join(cls.room, "model.yaml")

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def path(self, name):
        return os.path.join(self.scratch.name, name)


class Replay(Simulated):
    def check(self, name, query, *options, scene=WALL):
        source = f"sim:{scene}?frames=5{query}"
        live = striper("capture", source, *options).stdout
        striper("record", source, "-o", self.path(name))
        again = striper("capture", "images:" + self.path(name), *options).stdout
        self.assertEqual(again, live)
        striper("record", source, "-o", self.path(name + ".mcap"))
        again = striper("capture", "mcap:" + self.path(name + ".mcap"), *options).stdout
        self.assertEqual(again, live)
        self.assertGreater(len(live.splitlines()), 500, "there is something to compare")

    def test_every_column(self):
        self.check("plain", "", "-m", self.model, "--missing")

    def test_without_a_model(self):
        self.check("bare", "")

    def test_twelve_bits(self):
        scene = self.path("twelve.yaml")
        with open(WALL, encoding="utf-8") as wall, open(scene, "w", encoding="utf-8") as file:
            text = wall.read()
            self.assertIn("imager: {", text)
            file.write(text.replace("imager: {", "imager: {bits: 12, dn_per_electron: 0.8, "))
        self.check("bits", "", "-m", self.model, "--doubtful", scene=scene)
        with open(self.path("bits/frames.csv"), encoding="utf-8") as file:
            self.assertEqual({row["bit_depth"] for row in csv.DictReader(file)}, {"12"})

    def test_sixteen_bits_and_two_lasers(self):
        scene = self.path("two.yaml")
        with open(WALL, encoding="utf-8") as wall, open(scene, "w", encoding="utf-8") as file:
            text = wall.read().replace("imager: {", "imager: {bits: 16, dn_per_electron: 8, ")
            laser = [line for line in text.splitlines() if line.startswith("  - {position_m")][0]
            self.assertIn("-0.5]", laser)
            file.write(text.replace(laser, laser + "\n" + laser.replace("-0.5]", "-0.7]")))
        self.check("two", "&laser=0,1,dark", "--missing", scene=scene)

    def colour_images(self, folder, count=4):
        """Red stripes on uneven grounds, each another one."""
        random.seed(7)
        for number in range(count):
            pixels = bytearray()
            for v in range(96):
                for u in range(128):
                    ground = 30 + (u * 7 + v * 3 + number) % 11 + random.randrange(3)
                    stripe = round(180 * math.exp(-0.5 * ((v - 48 - number - 4 * math.sin(u / 20)) / 1.2) ** 2))
                    pixels += bytes((min(255, ground + stripe), ground, ground + 5))
            os.makedirs(self.path(folder), exist_ok=True)
            with open(self.path(f"{folder}/{number:03}.ppm"), "wb") as file:
                file.write(b"P6 128 96 255\n" + bytes(pixels))
        return "images:" + self.path(folder)

    def check_images(self, source, name, code=0):
        live = striper("capture", source, "--missing", code=code)
        striper("record", source, "-o", self.path(name + ".mcap"), code=code)
        again = striper("capture", "mcap:" + self.path(name + ".mcap"), "--missing", code=code)
        self.assertEqual(again.stdout, live.stdout)
        self.assertGreater(live.stdout.count(",ok"), 200)
        return live, again

    def test_colour(self):
        self.check_images(self.colour_images("colour"), "colour")

    def test_corrupt_images(self):
        source = self.colour_images("corrupt", 6)
        for number in (1, 4):
            path = self.path(f"corrupt/{number:03}.ppm")
            with open(path, "rb") as file:
                content = file.read()
            with open(path, "wb") as file:
                file.write(content[:len(content) // 2])
        live, again = self.check_images(source, "corrupt", code=1)
        for run in (live, again):
            self.assertIn("2 corrupt", run.stderr)

    def test_scans_in_the_file_are_those_of_a_capture(self):
        source = f"sim:{WALL}?frames=5"
        live = striper("capture", source, "-m", self.model, "-o", self.path("live.jsonl")).stdout
        self.assertEqual(live, "")
        done = striper("record", source, "-m", self.model, "-o", self.path("run.mcap"), "--json")
        self.assertEqual(json.loads(done.stdout)["scans"], 5)
        compared = striper("compare", "--repeat", self.path("run.mcap"), "--json")
        expected = striper("compare", "--repeat", self.path("live.jsonl"), "--json")
        self.assertEqual(json.loads(compared.stdout), json.loads(expected.stdout))

    def test_never_over_a_file_that_is_there(self):
        with open(self.path("there.mcap"), "w", encoding="utf-8") as file:
            file.write("mine")
        done = striper("record", f"sim:{WALL}?frames=1", "-o", self.path("there.mcap"), code=2)
        self.assertIn("there.mcap' is already there", done.stderr)

    def test_rotation_gives_files_that_stand_alone(self):
        striper("record", f"sim:{WALL}?frames=40&fps=20", "-o", self.path("part.mcap") + "?rotate=1s")
        first = striper("capture", self.path("part_0000.mcap"), "--json", "-o", self.path("0.csv"))
        second = striper("capture", self.path("part_0001.mcap"), "--json", "-o", self.path("1.csv"))
        self.assertEqual(sum(json.loads(d.stdout)["pictures"] for d in (first, second)), 40)

    def test_laser_in_every_other_frame(self):
        self.check("alternate", "&laser=0,dark", "-m", self.model)

    def test_laser_in_the_top_field(self):
        self.check("interlaced", "&fields=split-top&laser=0,dark", "-m", self.model)

    def test_a_frame_per_field(self):
        self.check("fields", "&fields=alternate-bottom&laser=0", "-m", self.model)

    def test_pattern_to_be_found(self):
        self.check("unknown", "&laser=0,dark&illumination=unknown", "-m", self.model)


class Simulate(Simulated):
    def test_scans_agree_with_the_truth(self):
        scans = striper("capture", self.room, "-m", self.model).stdout
        with open(os.path.join(self.room, "truth.csv"), encoding="utf-8") as file:
            truth = {(r["frame"], r["u_px"]): r for r in csv.DictReader(file)}
        self.assertEqual(len(truth), 3 * 640)
        inside = total = 0
        for row in csv.DictReader(scans.splitlines()):
            true = truth[row["frame"], row["u_px"]]
            self.assertEqual(true["status"], "ok")
            total += 1
            near, far = float(row["range_near_m"]), float(row["range_far_m"])
            inside += near <= float(true["range_m"]) <= far
        self.assertGreater(total, 1800)
        self.assertGreater(inside, 0.95 * total)

    def test_same_seed_same_files(self):
        again = self.path("again")
        striper("simulate", WALL, "-o", again, "--frames", "3")
        for name in sorted(os.listdir(self.room)):
            with open(os.path.join(self.room, name), "rb") as a, open(
                os.path.join(again, name), "rb"
            ) as b:
                self.assertEqual(a.read(), b.read(), name)

    def test_missing_scene(self):
        done = striper("simulate", "none.yaml", "-o", self.path("x"), code=1)
        self.assertIn("none.yaml", done.stderr)

    def test_wrong_key(self):
        done = striper("simulate", WALL + "?sead=1", "-o", self.path("y"), code=2)
        self.assertIn("sead", done.stderr)

    def test_endless_source_ends_with_ctrl_c(self):
        program = subprocess.Popen(
            [STRIPER, "capture", "sim:" + WALL, "-m", self.model],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        self.assertTrue(program.stdout.readline().startswith("frame,"))
        program.stdout.readline()  # It is at work.
        program.send_signal(signal.SIGINT)
        scans, message = program.communicate(timeout=20)
        self.assertEqual(program.returncode, 0, message)
        self.assertTrue(scans.endswith("\n"))
        self.assertIn("interrupted", message)


class Ntsc(Simulated):
    """The paper's hard case as anybody would have it: a directory of interlaced frames, bright sun."""

    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory(prefix="striper-test-")
        scene = os.path.join(cls.scratch.name, "ntsc.yaml")
        with open(scene_path("ntsc_sun.yaml"), encoding="utf-8") as file:
            text = file.read()
        with open(scene, "w", encoding="utf-8") as file:
            file.write(text.replace("scan: bottom-first", "scan: top-first"))
        cls.room = os.path.join(cls.scratch.name, "simulated")
        striper("simulate", scene, "-o", cls.room, "--frames", "6")
        cls.model = os.path.join(cls.room, "model.yaml")
        cls.images = os.path.join(cls.scratch.name, "images")  # And nothing that explains them.
        os.mkdir(cls.images)
        for name in os.listdir(cls.room):
            if name.endswith(".png"):
                os.rename(os.path.join(cls.room, name), os.path.join(cls.images, name))

    def check(self, query, *options, least, in_first):
        with open(os.path.join(self.room, "truth.csv"), encoding="utf-8") as file:
            truth = {(r["frame"], r["u_px"]): r for r in csv.DictReader(file)}
        visible = collections.Counter(r["frame"] for r in truth.values() if r["status"] == "ok")
        done = striper("capture", self.images + query, "-m", self.model, *options)
        scans = list(csv.DictReader(done.stdout.splitlines()))
        right = collections.Counter()
        for row in scans:
            true = truth[row["frame"], row["u_px"]]
            if true["status"] != "ok":
                continue
            right[row["frame"]] += abs(float(row["range_m"]) - float(true["range_m"])) < 0.05
        self.assertGreater(min(visible.values()), 550)
        found = {frame: right[frame] / count for frame, count in visible.items()}
        self.assertGreater(found.pop("0"), in_first)
        self.assertGreater(min(found.values()), least)
        self.assertLess(len(scans) - right.total(), 0.001 * len(scans))
        self.assertIn("ambient fields", done.stderr)
        return done.stderr

    def test_fields_and_nothing_else_is_said(self):
        # The light_sources cover 3 % of the columns, in 3 % the stripe is too weak for a column by itself: more
        # in the first scan, which has no dark field before it.
        self.assertIn("pattern 0,dark (found)", self.check("?fields=split-top", least=0.9, in_first=0.65))

    def test_the_tracker_finds_all_that_no_lamp_covers(self):
        self.check("?fields=split-top", "--peak", "continuous", least=0.96, in_first=0.9)

    def test_the_pattern_may_be_said_too(self):
        self.check("?fields=split-top&laser=0,dark", least=0.9, in_first=0.65)

    def test_laser_and_shutter_run_together(self):
        interlaced = scene_path("ntsc_sun.yaml")
        for query, verdict, laser, code in (("", "locked", "0,dark", 0), ("?laser=0", "no_difference", None, 3)):
            watch = ("--check-sync", f"sim:{interlaced}{query}", "--seconds", "0.8", "--json")
            report = json.loads(striper("devices", *watch, code=code).stdout)
            self.assertEqual((report["verdict"], report["laser"]), (verdict, laser), report)


class WhenBoard(Simulated):
    """A board before the camera, 30 px a square; 0.1 m/s is half a square a frame."""

    SCENE = """striper_scene: 1
camera: {width: 640, height: 480, fov_deg: 55, lens: plumb_bob}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.2, wavelength_nm: 900, pulse_uj: 10.4}
imager: {blur_px: 0.6, shutter_us: 1000}
daylight: {ambient_w_m2_nm: 0.02}
timing: {picture_rate_hz: 5}
objects:
  - {name: board, shape: rectangle, size_m: [0.6, 0.5], position_m: [0.8, 0.1, 0], VELOCITY
     reflectance: 0.8, checkerboard: {columns: 8, rows: 6, square_m: 0.04, black: 0.05, white: 0.85}}
"""

    def record(self, name, velocity, code=0, board="8x6", frames=6, live=False):
        scene = self.path(name + ".yaml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(self.SCENE.replace("VELOCITY", velocity))
        source = [f"sim:{scene}", "--frames", str(frames)] if live else [f"sim:{scene}?frames={frames}"]
        done = striper(
            "record", *source, "-o", self.path(name), "--json", "--when-board", board,
            code=code,
        )
        return done if code else json.loads(done.stdout)["recorded"]

    def test_board_at_rest_is_kept_once(self):
        self.assertEqual(self.record("rest", ""), 1)

    def test_board_that_moves_is_kept_in_every_new_pose(self):
        self.assertIn(self.record("moving", "velocity_m_s: [0, -0.1, 0],"), range(3, 7))

    def test_live_source_is_looked_at_quickly_and_gives_the_same(self):
        self.assertEqual(self.record("live_rest", "", live=True), 1)
        moving = "velocity_m_s: [0, -0.1, 0],"
        self.assertIn(self.record("live_moving", moving, live=True), range(3, 7))

    def test_board_that_is_not_there_is_never_kept(self):
        self.assertEqual(self.record("absent", "", board="9x5", frames=1), 0)

    def test_wrong_board_leaves_no_directory(self):
        self.assertIn("8by6", self.record("wrong", "", code=2, board="8by6").stderr)
        self.assertFalse(os.path.exists(self.path("wrong")))


class Plot(Simulated):
    """The plots that ./demo.sh draws. That one recognises the scene in them is for people."""

    SCRIPTS = os.path.join(SOURCE_DIR, "apps/plot")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scans = os.path.join(cls.scratch.name, "scans.csv")
        striper("capture", cls.room, "-m", cls.model, "-o", cls.scans)

    def gnuplot(self, script, *arguments, code=0):
        return run("gnuplot", "-c", os.path.join(self.SCRIPTS, script), *arguments, code=code)

    def test_scan_from_above(self):
        done = self.gnuplot("scan.gp", self.scans, self.path("scan.svg"), "1")
        self.assertEqual(done.stderr, "")
        with open(self.path("scan.svg"), encoding="utf-8") as file:
            drawing = file.read()
        self.assertIn("Frame 1: 640 returns", drawing)
        self.assertTrue(drawing.rstrip().endswith("</svg>"))

    def test_stripe_in_the_image(self):
        camera = os.path.join(self.room, "00000000.png")
        done = self.gnuplot("picture.gp", camera, self.scans, self.path("camera.png"))
        self.assertEqual(done.stderr, "")
        with open(self.path("camera.png"), "rb") as file:
            header = file.read(24)
        self.assertEqual(header[16:24], (760).to_bytes(4, "big") + (610).to_bytes(4, "big"))

    def test_scan_without_ranges_is_refused(self):
        bare = self.path("bare.csv")
        striper("capture", self.room, "-o", bare)
        done = self.gnuplot("scan.gp", bare, self.path("none.svg"), code=1)
        self.assertIn("has no ranges (was there a model?)", done.stderr)


class Example(Simulated):
    def test_streams_a_line_per_return(self):
        lines = run(EXAMPLE, f"sim:{WALL}?frames=2", self.model).stdout.splitlines()
        self.assertGreater(len(lines), 2 * 600)
        bearing_rad, range_m, _, sigma_m = lines[320].split()
        self.assertAlmostEqual(float(bearing_rad), 0.0, delta=0.01)
        self.assertAlmostEqual(float(range_m), 2.0, delta=0.01)
        self.assertGreater(float(sigma_m), 0.0)

    def test_says_what_is_wrong(self):
        self.assertIn("none.yaml", run(EXAMPLE, WALL, "none.yaml", code=1).stderr)
        self.assertIn("usage", run(EXAMPLE, code=1).stderr)

    @staticmethod
    def other(name):
        return os.path.join(os.path.dirname(EXAMPLE), name)

    def test_gives_scans_to_sinks(self):
        source = f"sim:{WALL}?frames=3"
        striper("capture", source, "-m", self.model, "-o", self.path("capture.csv"))
        run(self.other("02_scans_to_sinks"), source, self.model, self.path("a.csv"), self.path("b.jsonl"))
        run(self.other("02_scans_to_sinks"), self.path("b.jsonl"), self.model, self.path("c.csv"))
        for name in ("a.csv", "c.csv"):
            with open(self.path(name), "rb") as file, open(self.path("capture.csv"), "rb") as expected:
                self.assertEqual(file.read(), expected.read())
        failed = run(self.other("02_scans_to_sinks"), source, self.model, "csv:/dev/full", code=1)
        self.assertIn("disk_full: ", failed.stderr)

    def test_sets_controls_and_reads_them_back(self):
        controls = self.other("03_controls")
        shown = run(controls, f"sim:{WALL}", "exposure_us=150", "laser=off", "sim.pose.wall=0.5,0,0,0,0,10").stdout
        self.assertIn("exposure_us=150 us (", shown)
        self.assertIn("laser=off ", shown)
        self.assertIn("sim.pose.wall=0.5,0,0,0,0,10 ", shown)
        self.assertIn("read only", shown)
        self.assertIn("no control", run(controls, f"sim:{WALL}", "focus=1", code=1).stderr)


if __name__ == "__main__":
    unittest.main()
