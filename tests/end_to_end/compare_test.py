# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper compare` promises on the command line: where the other scanner stands, in the JSON with the
agreed members, and in text; the plot; --repeat; exit codes and words for what cannot be compared. What the figures
are worth is proved by compare_tests and compared_rooms_tests.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 compare_test.py
"""
import csv
import json
import math
import unittest

from program import InScratch, scene_path, striper

X_M, Y_M, YAW = 0.2, -0.22, math.radians(5)


class Compare(InScratch):
    def setUp(self):
        super().setUp()
        self.scans = self.path("scans.csv")
        room = self.path("room")
        striper("simulate", scene_path("room.yaml"), "-o", room, "--frames", 4)
        striper("capture", f"images:{room}", "--model", self.path("room", "model.yaml"), "-o", self.scans)

    def seen_from_elsewhere(self, quantum_m):
        """The first scan's returns as a scanner has them that stands elsewhere and rounds its ranges."""
        with open(self.scans, newline="") as file:
            points = [(float(row["x_m"]), float(row["y_m"])) for row in csv.DictReader(file) if row["frame"] == "0"]
        rays = []
        for x, y in points:
            along = math.cos(YAW) * (x - X_M) + math.sin(YAW) * (y - Y_M)
            across = -math.sin(YAW) * (x - X_M) + math.cos(YAW) * (y - Y_M)
            rays.append((math.atan2(across, along), quantum_m * round(math.hypot(along, across) / quantum_m)))
        lines = ["frame,time_s,bearing_rad,range_m"] + [f"0,0,{bearing},{r}" for bearing, r in sorted(rays)]
        return self.write("reference.csv", "\n".join(lines) + "\n")

    def test_says_where_the_other_stands(self):
        reference = self.seen_from_elsewhere(0.01)
        plot = self.path("compare.svg")
        done = striper("compare", self.scans, reference, "--reference-quantum", 0.01, "--plot", plot, "--json")
        found = json.loads(done.stdout)
        self.assertAlmostEqual(found["pose"]["x_m"], X_M, delta=0.004)
        self.assertAlmostEqual(found["pose"]["y_m"], Y_M, delta=0.004)
        self.assertAlmostEqual(found["pose"]["yaw_deg"], 5.0, delta=0.1)
        self.assertLess(found["pose"]["sigma_x_m"], 0.005)
        self.assertIsNone(found["reference_offset_m"])
        self.assertGreater(found["pairs"], 1200)
        self.assertGreater(found["outliers"]["ok"]["compared"], 1200)
        self.assertEqual({"not_visible", "no_segment", "status"}, set(found["dropped"]))
        for key in ("pull_mean", "pull_sd", "inside_1_96", "expected_inside_1_96"):
            self.assertTrue(math.isfinite(found[key]), key)
        self.assertEqual(len(found["bias_by_bearing"]), 20)
        self.assertEqual(len(found["bias_by_range"]), 20)
        with open(plot) as file:
            self.assertIn("Seen from above", file.read())

    def test_text_says_it_in_words(self):
        done = striper("compare", self.scans, self.seen_from_elsewhere(0.01), "--reference-offset",
                       "--reference-quantum", 0.01)
        for words in ("the reference stands at x 0.2", "its ranges are too short by", "within 1.96 sigma"):
            self.assertIn(words, done.stdout)

    def test_repeat_of_a_still_scene(self):
        found = json.loads(striper("compare", "--repeat", self.scans, "--json").stdout)
        self.assertGreater(found["changes"], 1000)
        self.assertGreater(found["mean_pixel_m"], 0.002)
        self.assertLess(found["ratio"], 0.3)
        self.assertAlmostEqual(found["mean_change_m"] / found["mean_pixel_m"], found["ratio"], delta=1e-9)

    def test_scans_a_source_on_the_way(self):
        room = ("compare", "--repeat", f"images:{self.path('room')}")
        scanned = json.loads(striper(*room, "--model", self.path("room", "model.yaml"), "--json").stdout)
        read = json.loads(striper("compare", "--repeat", self.scans, "--json").stdout)
        self.assertEqual(scanned["changes"], read["changes"])
        self.assertAlmostEqual(scanned["mean_change_m"], read["mean_change_m"], delta=1e-9)
        self.assertIn("a model makes scans of them", striper(*room, code=2).stderr)

    def test_takes_an_error_for_ranges_without_one(self):
        reference = self.seen_from_elsewhere(0.001)
        found = [json.loads(striper("compare", self.scans, reference, "--sigma", sigma_m, "--json").stdout)
                 for sigma_m in (0.0005, 0.01)]
        self.assertGreater(found[0]["pull_sd"], 1.5 * found[1]["pull_sd"])

    def test_asks_for_errors_and_pixels_that_are_not_there(self):
        reference = self.seen_from_elsewhere(0.001)
        for scans in ((self.scans, reference), (reference, self.scans)):
            self.assertIn(f"{reference} come without sigma_m", striper("compare", *scans, code=2).stderr)
        self.assertIn("do not say their pixels", striper("compare", "--repeat", self.without_pixels(), code=2).stderr)

    def without_pixels(self):
        columns = "frame", "time_s", "bearing_rad", "range_m", "sigma_m"
        with open(self.scans, newline="") as file:
            lines = [",".join(row[name] for name in columns) for row in csv.DictReader(file)]
        return self.write("bare.csv", "\n".join([",".join(columns), *lines]) + "\n")

    def test_refuses_what_cannot_be_compared(self):
        one_wall = "frame,time_s,bearing_rad,range_m\n" + "".join(
            f"0,0,{0.01 * n},{2 / math.cos(0.01 * n)}\n" for n in range(-80, 81))
        self.assertIn("stands", striper("compare", self.scans, self.write("wall.csv", one_wall), "--sigma", 0.001,
                                       code=3).stderr)
        box = "frame,time_s,bearing_rad,range_m\n" + "".join(
            f"0,0,{0.01 * n},{min(3 / math.cos(0.01 * n), 1.5 / max(abs(math.sin(0.01 * n)), 1e-9))}\n"
            for n in range(-150, 151))
        self.assertIn("do not agree", striper("compare", self.scans, self.write("box.csv", box), "--sigma", 0.001,
                                             code=3).stderr)
        self.assertIn("REFERENCE", striper("compare", self.scans, code=2).stderr)
        self.assertIn("nothing.csv", striper("compare", self.scans, self.path("nothing.csv"), code=None).stderr)
        refused = striper("compare", self.scans, self.scans, "--reference-quantum", "nan", code=2)
        self.assertIn("--reference-quantum", refused.stderr)


if __name__ == "__main__":
    unittest.main()
