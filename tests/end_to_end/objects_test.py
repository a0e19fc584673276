# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper objects` promises: objects.csv to the letter, of tables made elsewhere and of frames that are
scanned on the way, own motion by an odometer, and words for what cannot be done. The figures themselves are
tests/sdk/detect/objects_test.cpp's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 objects_test.py
"""
import csv
import json
import math
import random
import unittest

from program import InScratch, striper
from tools_test import SCENE

COLUMNS = ("frame time_s head laser track x_m y_m sigma_x_m sigma_y_m corr_xy bearing_rad range_m width_m vx_m_s vy_m_s "
           "sigma_v_m_s observable_rad closing_m_s time_to_contact_s ttc_low_s ttc_high_s zone confidence").split()
RATE = 30.0


def faces_csv(faces_at, scans, sigma=0.005, field_deg=27.5, step_deg=0.1):
    """A table made elsewhere of faces (x, y from, y to), each across x, at every scan."""
    noise = random.Random(7)
    lines = ["frame,time_s,bearing_rad,range_m"]
    for k in range(scans):
        for i in range(int(2 * field_deg / step_deg) + 1):
            bearing = math.radians(-field_deg + i * step_deg)
            ranges = [x / math.cos(bearing) for x, low, high in faces_at(k / RATE) if low <= x * math.tan(bearing) <= high]
            if ranges:
                lines.append(f"{k},{k / RATE:.6f},{bearing:.6f},{min(ranges) + noise.gauss(0, sigma):.5f}")
    return "\n".join(lines) + "\n"


class Objects(InScratch):
    def objects(self, *arguments, **options):
        done = striper("objects", *arguments, "-o", self.path("objects.csv"), **options)
        with open(self.path("objects.csv"), encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        with open(self.path("objects.csv"), encoding="utf-8") as file:
            self.assertEqual(file.readline().rstrip("\n").split(","), COLUMNS)
        return rows, done

    def test_a_table_made_elsewhere_gives_speed_and_time_to_contact(self):
        table = self.write("scans.csv", faces_csv(lambda t: [(4 - 10 * t, -0.3, 0.3), (8 + t, -9, 9)], 10))
        rows, done = self.objects(table, "--sigma", "0.005", "--json")
        summary = json.loads(done.stdout)
        self.assertEqual(summary["scans"], 10)
        self.assertEqual(summary["lines"], len(rows))
        near = [row for row in rows if float(row["x_m"]) < 5]
        self.assertEqual(len(near), 10)
        self.assertEqual(len({row["track"] for row in near}), 1)
        self.assertEqual(near[0]["closing_m_s"], "")  # One scan tells no speed.
        for k, row in enumerate(near):
            x = 4 - 10 * k / RATE
            self.assertAlmostEqual(float(row["range_m"]), x, delta=5 * float(row["sigma_x_m"]))
            self.assertEqual((row["frame"], row["zone"], row["laser"]), (str(k), "unknown", "0"))
            if k < 2:
                continue
            sigma = float(row["sigma_v_m_s"])
            self.assertAlmostEqual(float(row["closing_m_s"]), 10, delta=4 * sigma)
            self.assertAlmostEqual(float(row["vx_m_s"]), -10, delta=4 * sigma)
            self.assertLess(sigma, 0.15)
            self.assertLess(float(row["ttc_low_s"]), float(row["time_to_contact_s"]))
            self.assertLess(float(row["time_to_contact_s"]), float(row["ttc_high_s"]))
            self.assertAlmostEqual(float(row["time_to_contact_s"]), x / 10, delta=0.05)
        confidence = [float(row["confidence"]) for row in near]
        self.assertEqual(confidence, sorted(confidence))
        self.assertGreater(confidence[-1], 0.99)
        self.assertAlmostEqual(summary["soonest_contact_s"], 0.1, delta=0.03)

    def test_an_odometer_takes_the_own_motion_out(self):
        # It stands; the vehicle drives up to it with 6 m/s.
        table = self.write("scans.csv", faces_csv(lambda t: [(6 - 6 * t, -0.3, 0.3)], 15))
        counts = [f"{t / 100:.2f},{round(6 * t / 100 * 1000)}" for t in range(-20, 80)]
        odometer = self.write("odometer.csv", "time_s,counts\n" + "\n".join(counts) + "\n")
        rows, _ = self.objects(table, "--sigma", "0.005", "--odometer", odometer, "--counts-per-m", "1000")
        for row in rows[3:]:
            self.assertAlmostEqual(float(row["vx_m_s"]), 0.0, delta=0.25)
            self.assertAlmostEqual(float(row["closing_m_s"]), 6.0, delta=0.25)
        late = self.write("late.csv", "time_s,counts\n1000,0\n1001,5\n")
        self.assertIn("says nothing at the times of",
                      striper("objects", table, "--sigma", "0.005", "--odometer", late, "--counts-per-m", "1000",
                              "--json", code=1).stderr)

    def test_up_divides_the_zones_at_the_curb(self):
        # A vertical plane across the road, .5 m over it, looking down by 28 degrees: a curb of .15 m at 1.5 m, a
        # post behind it at 2.2 m.
        down, height = math.radians(28), 0.5
        noise = random.Random(3)
        lines = ["frame,time_s,bearing_rad,range_m,sigma_m"]
        for k in range(10):
            for i in range(641):
                bearing = math.radians(-27.5 + 55 * i / 640)
                dx, dy = math.cos(bearing - down), math.sin(bearing - down)
                hits = []
                if dy < 0:
                    road, top = -height / dy, (0.15 - height) / dy
                    hits += [road] if road * dx < 1.5 else []
                    hits += [top] if 1.5 <= top * dx <= 5 else []
                for face, low, high in ((1.5, 0, 0.15), (2.2, 0.15, 2)):
                    hits += [face / dx] if low <= height + face / dx * dy <= high else []
                if hits:
                    lines.append(f"{k},{k / RATE:.6f},{bearing:.6f},{min(hits) + noise.gauss(0, 0.001):.5f},0.001")
        table = self.write("street.csv", "\n".join(lines) + "\n")
        rows, _ = self.objects(table, "--up", str(90 + 28))
        self.assertEqual(len(rows), 10)
        for row in rows:
            self.assertEqual(row["zone"], "behind_curb")
            out = math.cos(float(row["bearing_rad"]) - down) * float(row["range_m"])
            self.assertAlmostEqual(out, 2.2, delta=0.02)

    def test_frames_scanned_on_the_way_and_their_table_say_the_same(self):
        # What stands there stands still.
        striper("simulate", self.write("scene.yaml", SCENE), "-o", self.path("shots"), "--frames", "4")
        model = self.path("shots", "model.yaml")
        source = ("images:" + self.path("shots"), "--model", model)
        rows, _ = self.objects(*source)
        striper("capture", *source, "-o", self.path("scans.csv"))
        again, _ = self.objects(self.path("scans.csv"))
        self.assertEqual(again, rows)
        last = [row for row in rows if row["frame"] == rows[-1]["frame"] and float(row["confidence"]) > 0.9]
        ranges = sorted(float(row["range_m"]) for row in last)
        self.assertGreaterEqual(len(ranges), 3)  # Pipe, board, wall on both sides of it.
        self.assertAlmostEqual(min(ranges), math.hypot(1.6, 0.4) - 0.1, delta=0.02)
        for row in last:
            self.assertLess(abs(float(row["closing_m_s"])), 5 * float(row["sigma_v_m_s"]) + 0.02, row)

    def test_whoever_to_names_gets_scans_objects_and_events(self):
        table = self.write("scans.csv", faces_csv(lambda t: [(4 - 10 * t, -0.3, 0.3)] if t < 0.3 else [(9, -9, 9)], 14))
        lines, recording, plot = self.path("run.jsonl"), self.path("run.mcap"), self.path("objects.svg")
        rows, done = self.objects(table, "--sigma", "0.005", "--json", "--contact", "0.2", "--to", lines, "--to", recording,
                                  "--plot", plot)
        with open(lines, encoding="utf-8") as file:
            said = [json.loads(line) for line in file]
        told = [(line["sequence"], one["track"], one["range_m"], one["zone"])
                for line in said if "objects" in line for one in line["objects"]]
        self.assertEqual(told, [(int(r["frame"]), int(r["track"]), float(r["range_m"]), r["zone"]) for r in rows])
        events = [line for line in said if "event" in line]
        self.assertEqual([event["event"] for event in events][:2], ["object_found", "contact_near"])
        self.assertIn("object_lost", [event["event"] for event in events])
        near = next(event for event in events if event["event"] == "contact_near")
        self.assertEqual(near["severity"], "warning")
        self.assertLess((4 - 10 * near["time_s"]) / 10, 0.21)
        self.assertIn("warning", done.stderr)
        topics = {topic["name"]: topic for topic in json.loads(striper("info", recording, "--json").stdout)["topics"]}
        self.assertEqual(topics["/striper/objects"]["count"], 14)
        with open(plot, encoding="utf-8") as file:
            drawn = file.read()
        for text in ("from above", "Their ranges", "closest point of an object"):
            self.assertIn(text, drawn)

    def test_says_what_is_wrong(self):
        table = self.write("scans.csv", faces_csv(lambda t: [(4, -0.3, 0.3)], 2))
        self.assertIn("--sigma", striper("objects", table, code=2).stderr)
        for arguments in (("--sigma", "0"), ("--sigma", "0.01", "--up", "up"), ("--roughness", "-1"),
                          ("--acceleration", "0"), ("--odometer", table),
                          ("--counts-per-m", "5")):
            striper("objects", table, *arguments, code=2)
        odometer = self.write("odometer.csv", "time_s,counts\n0,0\n1,5\n")
        self.assertIn("--counts-per-m", striper("objects", table, "--odometer", odometer, "--counts-per-m", "0", code=2).stderr)
        self.assertIn("time_to_contact_s", striper("objects", "--help").stdout)
        bad = self.write("bad.csv", "frame,time_s,range_m\n0,0,1\n")
        self.assertIn("bearing_rad", striper("objects", bad, "--sigma", "0.01", code=1).stderr)

    def test_says_that_no_track_can_go_on(self):
        def table(*times_of_lasers):
            rows = [f"{k},{t},{laser},{0.01 * i:.2f},3" for k, times in enumerate(zip(*times_of_lasers))
                    for laser, t in enumerate(times) for i in range(20)]
            return self.write("times.csv", "frame,time_s,laser,bearing_rad,range_m\n" + "\n".join(rows) + "\n")

        well = [0, 0.1, 0.2, 0.3, 0.4]
        no_later = "4 of 5 scans of laser %d are no later than the one before: no track goes on there"
        late = "are more than 1 s later than the one before (the first: 33 s)"
        for lasers, said in (([[5] * 5], no_later % 0), ([[5, 4, 3, 2, 1]], no_later % 0), ([well, [2] * 5], no_later % 1),
                             ([[0, 33, 66, 99]], late)):
            for command in ("objects", "curb"):
                self.assertIn(said, striper(command, table(*lasers), "--sigma", "0.01").stderr, lasers)
        # A recording may have gaps, and two lasers the same times.
        for lasers in ([[0, 0.1, 0.2, 9, 9.1, 9.2]], [well, well], [[3]]):
            self.assertNotIn("no track goes on", striper("objects", table(*lasers), "--sigma", "0.01").stderr, lasers)


if __name__ == "__main__":
    unittest.main()
