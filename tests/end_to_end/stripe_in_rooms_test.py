# SPDX-License-Identifier: Apache-2.0
"""Proves, against the simulator's exact truth, that one laser which is always on is found in plain rooms by the program:
the first scan is as good as the rest, a black box in the way is never told as what is behind it, and where the laser
is too weak on it nothing is `ok`. How often other rooms' returns are wrong is measured by stripe_choice_table.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 stripe_in_rooms_test.py
"""
import collections
import csv
import tempfile
import unittest

from program import InScratch, scene_path, striper

FRAMES = 6
BLACK_BOX = """
striper_scene: 1
camera: {width: 640, height: 480, fov_deg: 60, rotation_deg: [0, 12, 0]}
imager: {blur_px: 0.5}
daylight: {ambient_w_m2_nm: %g}
lasers:
  - {position_m: [0, 0, -0.4], fan_deg: 80, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
objects:
  - {name: wall, shape: plane, position_m: [3, 0, 0], reflectance: 0.6}
  - {name: floor, shape: plane, position_m: [0, 0, -0.8], rotation_deg: [0, -90, 0], reflectance: 0.6,
     mottle: {contrast: %g, grain_m: 0.03}}
  - {name: box, shape: box, position_m: [1.5, 0, -0.4], size_m: [0.3, 0.6, 0.8], reflectance: %g}
"""
BEHIND_M = 1.8  # Between the box and the wall.


def rows_of(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class StripeInRooms(InScratch):
    def scan(self, scene, frames):
        """The `ok` returns of each frame with the true range of their column, None where it has no stripe."""
        session = tempfile.mkdtemp(dir=self.path())
        striper("simulate", scene, "-o", session, "--frames", frames)
        striper("capture", "images:" + session, "--model", session + "/model.yaml", "-o", self.path("scans.csv"))
        truth = {(row["frame"], row["u_px"]): row for row in rows_of(session + "/truth.csv")}
        scans = collections.defaultdict(list)
        for row in rows_of(self.path("scans.csv")):
            if row["status"] != "ok":
                continue
            true = truth[row["frame"], row["u_px"]]
            true_m = float(true["range_m"]) if true["status"] == "ok" else None
            scans[int(row["frame"])].append((float(row["range_m"]), float(row["sigma_m"]), true_m))
        return truth, scans


class FirstScan(StripeInRooms):
    def test_is_as_good_as_the_rest(self):
        _, scans = self.scan(scene_path("room.yaml"), FRAMES)
        right = [sum(true is not None and abs(seen - true) < max(0.01, 3 * sigma) for seen, sigma, true in scans[n])
                 for n in range(FRAMES)]
        self.assertGreater(right[0], 500)
        self.assertGreater(right[0], 0.99 * max(right), right)
        wrong = [len(scans[n]) - right[n] for n in range(FRAMES)]
        self.assertLessEqual(wrong[0], max(wrong[1:]) + 2, wrong)


class Readme(StripeInRooms):
    def test_image_has_no_phantom(self):
        """Beside the stripe its light spills over a column or two, at its height; nothing else is anything."""
        truth, scans = self.scan(scene_path("room.yaml"), 3)
        heights = {(frame, float(u)): float(row["v_px"]) for (frame, u), row in truth.items() if row["status"] == "ok"}

        def is_of_stripe(row):
            near = [heights.get((row["frame"], float(row["u_px"]) + off)) for off in (-2, -1, 0, 1, 2)]
            return any(v is not None and abs(float(row["v_px"]) - v) < 3 for v in near)

        good = [row for row in rows_of(self.path("scans.csv")) if row["status"] == "ok"]
        self.assertFalse([row for row in good if not is_of_stripe(row)])
        self.assertGreater(sum(len(scan) for scan in scans.values()), 1700)


class BlackBox(StripeInRooms):
    def check(self, ambient, mottle, reflectance):
        scene = self.write("black_box.yaml", BLACK_BOX % (ambient, mottle, reflectance))
        truth, scans = self.scan(scene, 3)
        of_box = sum(row["status"] == "ok" and float(row["range_m"]) < BEHIND_M for row in truth.values())
        self.assertGreater(of_box, 600)
        seen = [(seen_m, true_m) for returns in scans.values() for seen_m, _, true_m in returns
                if true_m is not None and true_m < BEHIND_M]
        self.assertFalse([one for one in seen if one[0] > BEHIND_M])
        wrong = [one for one in seen if abs(one[0] - one[1]) > 0.05]
        self.assertLessEqual(len(wrong), 0.005 * of_box, wrong)
        return len(seen) / of_box

    def test_is_found(self):
        self.assertGreater(self.check(0.02, 0.0, 0.02), 0.95)

    def test_is_not_what_lies_behind_it(self):
        for reflectance in (0.01, 0.005):
            with self.subTest(reflectance=reflectance):
                self.check(0.1, 0.4, reflectance)


if __name__ == "__main__":
    unittest.main()
