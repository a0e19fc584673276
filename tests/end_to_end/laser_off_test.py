# SPDX-License-Identifier: Apache-2.0
"""Proves that images of real texture and simulated rooms without a laser are said to have none: `capture` with the
event no_stripe, `doctor` by failing, and neither with a word of a stripe's brightness or focus. The boards are other
people's photographs (optional, `../shared`). How often single columns are wrong is measured elsewhere.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 laser_off_test.py
"""
import json
import os
import re
import unittest

from program import SOURCE_DIR, InScratch, scene_path, striper

SHARED = os.path.join(SOURCE_DIR, "../shared/realdata")
BOARDS = ("bouguet-calib-example", "opencv-left-right")


class LaserOff(InScratch):
    def check_capture(self, source):
        done = striper("capture", source, "-o", self.path("scans.csv"), "--json", code=None)
        summary = json.loads(done.stdout)
        self.assertGreaterEqual(summary["without_stripe"], 0.9 * summary["scans"], source)
        self.assertIn("no_stripe: no laser's stripe in the first", done.stderr)
        self.assertIn("no_stripe: nor along the other axis, nor in any other channel", done.stderr)

    def check_doctor(self, source):
        findings = json.loads(striper("doctor", source, "--json", code=1).stdout)["findings"]
        self.assertIn("no_stripe", [one["code"] for one in findings if one["severity"] == "bad"], findings)
        for one in findings:
            self.assertNotIn("focus", one["cure"])
            self.assertFalse(one["what"].startswith("a stripe in"), one)


class Rooms(LaserOff):
    def without_laser(self, name):
        with open(scene_path(name), encoding="utf-8") as file:
            text = re.sub(r"pulse_uj: [0-9.]+", "pulse_uj: 1e-9", file.read())
        return "sim:" + self.write(name, text) + "?frames=4&laser=0"

    def test_rooms(self):
        for scene in ("room.yaml", "wall.yaml", "curb.yaml"):
            with self.subTest(scene=scene):
                self.check_capture(self.without_laser(scene))
                self.check_doctor(self.without_laser(scene))


class Boards(LaserOff):
    def boards(self):
        there = [os.path.join(SHARED, name) for name in BOARDS if os.path.isdir(os.path.join(SHARED, name))]
        if not there:
            self.skipTest(f"the boards of {SHARED} are not here")
        return ["images:" + path for path in there]

    def test_captured(self):
        for source in self.boards():
            with self.subTest(source=source):
                self.check_capture(source)

    def test_examined(self):
        for source in self.boards():
            with self.subTest(source=source):
                self.check_doctor(source)


if __name__ == "__main__":
    unittest.main()
