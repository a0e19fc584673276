# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper curb` promises: curbs.csv to the letter, of tables made elsewhere and of frames that are rendered and
scanned on the way, the way by an odometer or a speed, and words for what cannot be done. The figures themselves are
tests/sdk/detect/curb_detector_test.cpp's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 curb_test.py
"""
import csv
import json
import math
import random
import unittest

from program import InScratch, scene_path, striper

COLUMNS = ("frame time_s head laser track kind state foot_x_m foot_y_m top_x_m top_y_m lateral_m sigma_lateral_m sigma_cal_lateral_m "
           "height_m sigma_height_m sigma_cal_height_m confidence").split()
DOWN, OVER = math.radians(28), 0.5
RATE = 20.0
CURB = [(-1, 0), (1.5, 0), (1.5, 0.15), (6, 0.15)]
FLAT = [(-1, 0), (6, 0)]
BOX = [(-1, 0), (1.5, 0), (1.5, 0.15), (1.8, 0.15), (1.8, 0), (6, 0)]


def street_csv(profile_at, scans, sigma=0.001):
    """A table made elsewhere of the road across, (lateral, height) joined by lines, at every scan."""
    noise = random.Random(11)
    lines = ["frame,time_s,bearing_rad,range_m,sigma_m"]
    for k in range(scans):
        profile = profile_at(k / RATE)
        for i in range(641):
            bearing = math.radians(-27.5 + 55 * i / 640)
            dx, dy = math.cos(bearing - DOWN), math.sin(bearing - DOWN)
            hits = []
            for (x0, z0), (x1, z1) in zip(profile, profile[1:]):
                det = dx * (z1 - z0) - dy * (x1 - x0)
                if abs(det) < 1e-12:
                    continue
                along = (x0 * (z1 - z0) - (z0 - OVER) * (x1 - x0)) / det
                part = (x0 * dy - (z0 - OVER) * dx) / det
                if along > 0 and 0 <= part <= 1:
                    hits.append(along)
            if hits:
                lines.append(f"{k},{k / RATE:.6f},{bearing:.6f},{min(hits) + noise.gauss(0, sigma):.5f},{sigma}")
    return "\n".join(lines) + "\n"


class Curb(InScratch):
    def curb(self, *arguments):
        done = striper("curb", *arguments, "-o", self.path("curbs.csv"), "--json")
        with open(self.path("curbs.csv"), encoding="utf-8") as file:
            self.assertEqual(file.readline().rstrip("\n").split(","), COLUMNS)
            file.seek(0)
            return list(csv.DictReader(file)), json.loads(done.stdout), done.stderr

    def test_a_table_made_elsewhere(self):
        table = self.write("street.csv", street_csv(lambda t: CURB, 20))
        rows, summary, _ = self.curb(table)
        self.assertEqual((summary["scans"], summary["lines"], summary["curbs"]), (20, len(rows), 1))
        self.assertEqual(len(rows), 20)
        for k, row in enumerate(rows):
            self.assertEqual((row["frame"], row["track"], row["kind"]), (str(k), "1", "up"))
            self.assertEqual(row["state"], "new" if k < 2 else "tracked")
            self.assertEqual((row["sigma_cal_lateral_m"], row["sigma_cal_height_m"]), ("", ""))
            self.assertAlmostEqual(abs(float(row["lateral_m"])), 1.5, delta=5 * float(row["sigma_lateral_m"]))
            self.assertAlmostEqual(float(row["height_m"]), 0.15, delta=5 * float(row["sigma_height_m"]) + 1e-4)
            foot = (float(row["foot_x_m"]), float(row["foot_y_m"]))
            turned = (foot[0] * math.cos(DOWN) + foot[1] * math.sin(DOWN), -foot[0] * math.sin(DOWN) + foot[1] * math.cos(DOWN) + OVER)
            self.assertAlmostEqual(turned[0], 1.5, delta=0.01)
            self.assertAlmostEqual(turned[1], 0.0, delta=0.01)
        confidence = [float(row["confidence"]) for row in rows]
        self.assertEqual(confidence, sorted(confidence))
        self.assertGreater(confidence[-1], 0.99)

    def test_a_box_dies_and_an_odometer_says_how_far_it_was(self):
        table = self.write("box.csv", street_csv(lambda t: BOX if 0.5 < t < 0.58 else FLAT, 30))
        self.assertEqual(self.curb(table)[1]["curbs"], 0)
        # It stands: what goes on for ever may still be a box.
        table = self.write("street.csv", street_csv(lambda t: CURB, 10))
        stands = self.write("odometer.csv", "time_s,counts\n-1,0\n" + "".join(f"{t / 100:.2f},0\n" for t in range(0, 100)))
        rows, summary, said = self.curb(table, "--odometer", stands, "--counts-per-m", "1000")
        self.assertEqual(summary["curbs"], 0)
        self.assertTrue(0.5 < float(rows[-1]["confidence"]) < 0.9)
        self.assertIn("goes on along the way", said)

    def test_rendered_frames_of_the_papers_curb(self):
        striper("simulate", scene_path("curb.yaml"), "-o", self.path("shots"), "--frames", "6")
        rows, summary, _ = self.curb("images:" + self.path("shots"), "--model", self.path("shots", "model.yaml"), "--up", str(90 + 28))
        self.assertEqual((summary["scans"], summary["scans_without_road"]), (6, 0))
        self.assertAlmostEqual(float(rows[-1]["lateral_m"]), 1.2, delta=0.005)
        self.assertAlmostEqual(float(rows[-1]["height_m"]), 0.15, delta=0.002)
        self.assertGreater(float(rows[-1]["confidence"]), 0.9)

    def test_whoever_to_names_gets_scans_curbs_and_events(self):
        def ends(t):
            return CURB if t < 0.7 else FLAT
        table = self.write("street.csv", street_csv(ends, 24))
        lines, recording, plot = self.path("run.jsonl"), self.path("run.mcap"), self.path("curbs.svg")
        rows, summary, _ = self.curb(table, "--to", lines, "--to", recording, "--plot", plot)
        with open(lines, encoding="utf-8") as file:
            said = [json.loads(line) for line in file]
        found = [line for line in said if "curbs" in line]
        self.assertEqual(len(found), 24)
        self.assertEqual([line["sequence"] for line in said if "status" in line], list(range(24)))
        told = [(line["sequence"], curb["track"], curb["kind"], curb["lateral_m"]) for line in found for curb in line["curbs"]]
        self.assertEqual(told, [(int(r["frame"]), int(r["track"]), r["kind"], float(r["lateral_m"])) for r in rows])
        self.assertIsNone(found[3]["curbs"][0]["sigma_cal_lateral_m"])
        self.assertEqual(list(found[3]["curbs"][0]), COLUMNS[4:])
        codes = [line["event"] for line in said if "event" in line]
        self.assertEqual(codes, ["curb_found", "curb_lost"])
        self.assertEqual([event["event"] for event in summary["events"]], codes)
        topics = {topic["name"]: topic for topic in json.loads(striper("info", recording, "--json").stdout)["topics"]}
        self.assertEqual(topics["/striper/curbs"]["count"], 24)
        self.assertEqual(topics["/striper/curbs"]["type"], "striper_msgs/msg/Curbs")
        # Both files are scans as well.
        for again in (lines, recording):
            self.assertEqual(self.curb(again)[0], rows)
        with open(plot, encoding="utf-8") as file:
            drawn = file.read()
        for text in ("across the road", "Curbs along the way", "Their heights", "face", "one sigma"):
            self.assertIn(text, drawn)

    def test_writes_over_nothing_that_it_reads_or_has_not_opened(self):
        text = street_csv(lambda t: CURB, 5)
        table = self.write("street.csv", text)
        kept = self.write("kept.csv", "of before\n")
        tables = {command: self.path(command + ".csv") for command in ("curb", "objects")}
        for command, file in tables.items():
            striper(command, table, "-o", file)
        lines = self.path("kept.jsonl")
        striper("convert", table, "-o", lines)
        with open(lines, encoding="utf-8") as file:
            recording = file.read()
        found = {}
        for name in tables.values():
            with open(name, encoding="utf-8") as file:
                found[name] = file.read()
        for command in (["curb", "-o", table], ["objects", "-o", table], ["curb", "-o", self.path("x.csv"), "--to", "jsonl:" + table],
                        ["measure", "--tool", "a:line", "-o", table], ["convert", "-o", table]):
            done = striper(command[0], table, *command[1:], code=2)
            self.assertIn("is read: name another file", done.stderr)
        for more, code in ((["--to", "foo:bar"], 2), (["-m", self.path("no.yaml")], 1), (["--plot", self.path("x.png")], 2)):
            for command in ("curb", "objects"):
                striper(command, table, "-o", tables[command], *more, code=code)
        striper("curb", self.path("none.csv"), "-o", tables["curb"], code=1)
        done = striper("curb", table, "-o", self.path("same.svg"), "--plot", self.path("same.svg"), code=2)
        self.assertIn("written twice", done.stderr)
        for command in ("curb", "objects"):
            done = striper(command, table, "-o", kept, "--to", "jsonl:" + lines, code=2)
            self.assertIn("holds no table of this kind: it is not overwritten", done.stderr)
        for file, before in ((table, text), (kept, "of before\n"), (lines, recording), *found.items()):
            with open(file, encoding="utf-8") as now:
                self.assertEqual(now.read(), before)

    def test_says_what_is_cut_off(self):
        whole = street_csv(lambda t: CURB, 5)
        table = self.write("street.csv", whole)
        striper("convert", table, "-o", self.path("street.jsonl"))
        for form in ("csv", "jsonl"):
            with open(self.path("street." + form), "rb") as file:
                content = file.read()
            with open(self.path("cut." + form), "wb") as file:
                file.write(content[: len(content) * 4 // 5 + 3])
            for command in (["curb"], ["objects"], ["measure", "--tool", "a:line"]):
                done = striper(command[0], self.path("cut." + form), *command[1:])
                self.assertIn("lost: " + self.path("cut." + form), done.stderr)
                self.assertNotIn("lost:", striper(command[0], self.path("street." + form), *command[1:]).stderr)

    def test_a_vehicle_that_stands_sees_one_curb(self):
        scene = scene_path("street/up.yaml")
        striper("simulate", scene, "-o", self.path("up"), "--frames", "1")
        rows, _, _ = self.curb(f"sim:{scene}?frames=40", "-m", self.path("up/model.yaml"), "--up", "118", "--speed", "0")
        self.assertEqual([row["track"] for row in rows], 40 * ["1"])

    def test_says_what_is_wrong(self):
        table = self.write("flat.csv", street_csv(lambda t: FLAT, 2))
        rows, summary, said = self.curb(table, "--up", "0")
        self.assertEqual((rows, summary["scans_without_road"]), ([], 2))
        self.assertIn("no road within 20 degrees of --up", said)
        for arguments in (("--up", "up"), ("--speed", "-1"), ("--odometer", table), ("--min-height", "0.4"), ("--max-height", "5")):
            striper("curb", table, *arguments, code=2)
        bare = self.write("bare.csv", "frame,time_s,bearing_rad,range_m\n0,0,0,1\n")
        self.assertIn("--sigma", striper("curb", bare, code=2).stderr)
        self.assertIn("confidence", striper("curb", "--help").stdout)


if __name__ == "__main__":
    unittest.main()
