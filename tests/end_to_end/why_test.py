# SPDX-License-Identifier: Apache-2.0
"""Proves that `striper why` explains the return that `striper capture` gives: the same numbers, the candidate it
comes from, the others and what became of them, its error by cause; and that what cannot be explained is said.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 why_test.py
"""
import csv
import io
import json
import math
import os
import unittest

from program import InScratch, scene_path, striper

ROOM = scene_path("room.yaml")


class Why(InScratch):
    def setUp(self):
        super().setUp()
        striper("simulate", ROOM, "-o", self.path("room"), "--frames", "3")
        self.source = "images:" + self.path("room")
        self.model = os.path.join(self.path("room"), "model.yaml")

    def why(self, line, *arguments):
        done = striper("why", self.source, "--model", self.model, "--line", line, "--json", *arguments)
        return json.loads(done.stdout)

    def test_it_explains_what_capture_gives(self):
        rows = csv.DictReader(io.StringIO(striper("capture", self.source, "--model", self.model, "--missing").stdout))
        returns = {(int(row["frame"]), int(float(row["u_px"]))): row for row in rows}
        explained = 0
        for frame, column in ((0, 40), (1, 200), (2, 320), (2, 500), (1, 610)):
            why = self.why(column, "--frame", str(frame))
            row = returns[(frame, column)]
            self.assertEqual(why["frame"], frame)
            self.assertEqual(why["status"], row["status"])
            chosen = [one for one in why["candidates"] if one["fate"] == "chosen"]
            if not row["range_m"]:
                continue
            explained += 1
            self.assertEqual(why["range_m"], float(row["range_m"]))
            self.assertEqual(why["v_px"], float(row["v_px"]))
            self.assertEqual(len(chosen), 1)
            # A step of reflectance may have moved it since it was measured.
            self.assertLess(abs(chosen[0]["across_px"] - why["v_px"]), 2.0)
            self.assertTrue(why["from_px"] <= why["v_px"] <= why["to_px"])
            sigma = why["sigma_px"]
            self.assertAlmostEqual(sigma["total"], float(row["row_sigma_px"]), 5)
            causes = math.hypot(*(sigma[cause] for cause in ("read", "shot", "speckle", "locking", "other")))
            self.assertAlmostEqual(causes / sigma["total"], 1.0, 1)
            self.assertGreater(sigma["read"], 0.0)
            # A pixel's worth, against the range that the same column has half a pixel up and down.
            step = float(row["range_far_m"]) - float(row["range_near_m"])
            self.assertAlmostEqual(why["range_m_per_px"] / step, 1.0, 1)
            at = round((why["v_px"] - why["first_px"]) / why["step_px"])
            brightest = max(why["lit_dn"][at - 3 : at + 4])
            self.assertGreater(brightest, 0.5 * chosen[0]["amplitude_dn"])
        self.assertGreaterEqual(explained, 3)

    def test_people_get_a_table(self):
        text = striper("why", self.source, "--model", self.model, "--line", "320").stdout
        self.assertIn("frame 0, scan line 320: searched from", text)
        self.assertIn("what became of it", text)
        self.assertIn("chosen", text)
        self.assertIn("a pixel", text)

    def test_what_cannot_be_explained_is_said(self):
        for arguments, code, words in (
            (("--line", "640"), 2, "line 640 - expected 0 to 639, the image's columns"),
            (("--line", "-1"), 2, "line -1 - expected 0 to 639"),
            (("--line", "3", "--frame", "7"), 1, "frame 7 gave no scan"),
            (("--line", "3", "--method", "paper"), 1, "method paper has no candidates"),
        ):
            done = striper("why", self.source, "--model", self.model, *arguments, code=code)
            self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
