# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper convert` and `striper info` promise: scans come back to the byte through every kind of file; a
part is the part that was asked for, frames with it; a file whose writer was killed reads to its last whole chunk and is
saved; what makes no sense is refused in words. Does not prove what other people's programs read: tests/foreign does.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 convert_test.py
"""
import csv
import json
import os
import pathlib
import random
import signal
import subprocess
import time
import unittest

from program import SOURCE_DIR, STRIPER, InScratch, scene_path, slowed, striper

SCENES = sorted(pathlib.Path(SOURCE_DIR, "data/scenes").glob("*.yaml"))


def info(path, code=0):
    return json.loads(striper("info", path, "--json", code=code).stdout)


class Recorded(InScratch):
    def model_of(self, scene):
        """The model without error that comes with a simulation."""
        folder = self.path(f"simulated-{pathlib.Path(scene).stem}")
        striper("simulate", scene, "-o", folder, "--frames", 1)
        return os.path.join(folder, "model.yaml")

    def record(self, name, frames=12, scene=scene_path("room.yaml")):
        """A recording with frames and scans, and the model that they are of."""
        model = self.model_of(scene)
        striper("record", f"sim:{scene}", "-o", self.path(name), "--model", model, "--frames", frames)
        return self.path(name), model

    def read(self, path):
        return pathlib.Path(path).read_bytes()

    def sequences(self, path):
        with open(path) as file:
            return sorted({int(row["frame"]) for row in csv.DictReader(file)})


class Identity(Recorded):
    def assert_comes_back(self, scene, frames):
        model = self.model_of(scene)
        first = self.path("1.csv")
        striper("capture", f"sim:{scene}", "--model", model, "--missing", "-o", first, "--frames", frames)
        striper("convert", first, "-o", self.path("2.mcap"))
        striper("convert", self.path("2.mcap"), "-o", self.path("3.jsonl"))
        striper("convert", self.path("3.jsonl"), "-o", self.path("4.csv"), "--missing")
        self.assertGreater(len(self.read(first)), 1000)
        self.assertEqual(self.read(first), self.read(self.path("4.csv")), scene)

    def test_csv_to_mcap_to_jsonl_to_csv(self):
        self.assert_comes_back(scene_path("room.yaml"), 5)


class IdentityOften(Identity):
    def test_csv_to_mcap_to_jsonl_to_csv(self):
        self.assertGreaterEqual(len(SCENES), 7)
        for scene in SCENES:
            with self.subTest(scene=scene.name):
                self.assert_comes_back(scene, 12)


class Parts(Recorded):
    def test_start_and_end_count_from_the_beginning(self):
        recording, model = self.record("a.mcap")
        rate_hz = next(t for t in info(recording)["topics"] if t["name"].endswith("frame_info"))["rate_hz"]
        part = self.path("part.mcap")
        # Between frames, so that rounding decides nothing.
        striper("convert", recording, "-o", part, "--start", 2.5 / rate_hz, "--end", 6.5 / rate_hz)
        kept = info(part)
        self.assertEqual((kept["frames"], kept["scans"]), (4, 4))
        self.assertEqual(list(kept["model"]), ["striper"])
        self.assertTrue(any(t["name"] == "/tf_static" and t["count"] == 1 for t in kept["topics"]))
        self.assertAlmostEqual(kept["duration_s"], 3.5 / rate_hz, places=6)
        # The part replays, and gives the scans that it holds.
        striper("capture", f"mcap:{part}", "--model", model, "-o", self.path("replayed.csv"), "--missing")
        striper("convert", part, "-o", self.path("held.csv"), "--missing")
        self.assertEqual(self.sequences(self.path("held.csv")), [3, 4, 5, 6])
        self.assertEqual(self.sequences(self.path("replayed.csv")), [3, 4, 5, 6])
        # A table's part is the same.
        striper("convert", recording, "-o", self.path("all.csv"))
        striper("convert", self.path("all.csv"), "-o", self.path("part.csv"), "--start", 2.5 / rate_hz, "--end",
                6.5 / rate_hz)
        self.assertEqual(self.sequences(self.path("part.csv")), [3, 4, 5, 6])

    def test_several_outputs_in_one_pass(self):
        recording, _ = self.record("a.mcap", 4)
        run = striper("convert", recording, "-o", self.path("b.mcap"), "-o", self.path("b.csv"), "-o",
                      self.path("b.ply"), "-o", self.path("b.jsonl"), "--speed", 2, "--json")
        summary = json.loads(run.stdout)
        self.assertEqual([s["written"] for s in summary["sinks"]], [4, 4, 4])
        self.assertEqual(info(self.path("b.mcap"))["frames"], 4)
        striper("convert", self.path("b.jsonl"), "-o", self.path("c.csv"))
        self.assertEqual(self.read(self.path("b.csv")), self.read(self.path("c.csv")))

    def test_frames_alone_are_scanned(self):
        recording, model = self.record("a.mcap", 4)
        striper("convert", recording, "-o", self.path("held.csv"))
        frames = self.path("frames.mcap")
        striper("record", "mcap:" + recording, "-o", frames)
        self.assertEqual((info(frames)["frames"], info(frames)["scans"], info(frames)["heads"]), (4, 0, ["striper"]))
        striper("convert", frames, "--model", model, "-o", self.path("made.csv"))
        self.assertEqual(self.read(self.path("made.csv")), self.read(self.path("held.csv")))
        run = striper("convert", frames, "-o", self.path("none.csv"), code=1)
        self.assertIn("frames need a model", run.stderr)

    def test_shaped_scans_are_others(self):
        recording, _ = self.record("a.mcap", 6)
        striper("convert", recording, "-o", self.path("mean.mcap"), "--average", 3)
        kept = info(self.path("mean.mcap"))
        self.assertEqual((kept["scans"], kept["frames"]), (2, 0))


class Damaged(Recorded):
    def cut(self, recording, part):
        content = self.read(recording)
        return self.write("cut.mcap", content[:int(part * len(content))])

    def test_a_cut_recording_is_saved(self):
        recording, _ = self.record("a.mcap")
        cut = self.cut(recording, 0.6)
        known = info(cut, code=1)
        self.assertLess(known["damage"]["offset"], os.path.getsize(cut))
        self.assertEqual(known["damage"]["offset"] + known["damage"]["lost_bytes"], os.path.getsize(cut))
        self.assertIn("without its end", known["damage"]["reason"])
        run = striper("convert", cut, "-o", self.path("whole.mcap"), "-o", self.path("whole.csv"))
        self.assertIn("lost: ", run.stderr)
        whole = info(self.path("whole.mcap"))
        self.assertIsNone(whole["damage"])
        self.assertGreater(whole["frames"], 2)
        for key in ("frames", "scans", "model", "heads", "lasers"):
            self.assertEqual(whole[key], known[key], key)
        self.assertEqual(len(self.sequences(self.path("whole.csv"))), whole["scans"])

    def test_a_flipped_bit_costs_its_chunk(self):
        recording, _ = self.record("a.mcap")
        content = bytearray(self.read(recording))
        content[len(content) // 2] ^= 4
        broken = self.write("broken.mcap", bytes(content))
        known = info(broken, code=1)
        self.assertGreater(known["damage"]["lost_bytes"], 0)
        striper("convert", broken, "-o", self.path("whole.mcap"))
        whole = info(self.path("whole.mcap"))
        self.assertIsNone(whole["damage"])
        self.assertLess(whole["frames"], 12)
        self.assertGreater(whole["frames"], 2)

    def test_a_table_is_saved_up_to_its_damage(self):
        recording, _ = self.record("a.mcap", 4)
        striper("convert", recording, "-o", self.path("a.csv"))
        lines = self.read(self.path("a.csv")).splitlines(keepends=True)
        at = len(lines) * 3 // 4
        broken = self.write("broken.csv", b"".join([*lines[:at], b"3,what,is,this\n", *lines[at:]]))
        self.assertIsNone(info(broken, code=1)["damage"]["offset"])
        run = striper("convert", broken, "-o", self.path("b.csv"))
        self.assertIn(f"line {at + 1}: 4 fields", run.stderr)
        saved = self.read(self.path("b.csv"))
        self.assertTrue(self.read(self.path("a.csv")).startswith(saved))
        self.assertGreater(len(saved.splitlines()), at // 2)

    def test_a_line_of_json_that_was_cut_is_said(self):
        recording, _ = self.record("a.mcap", 4)
        striper("convert", recording, "-o", self.path("a.jsonl"))
        content = self.read(self.path("a.jsonl"))
        cut = self.write("cut.jsonl", content[:-100])
        known = info(cut, code=1)
        self.assertEqual(known["scans"], 3)
        self.assertEqual(known["damage"]["offset"] + known["damage"]["lost_bytes"], len(content) - 100)

    def kill(self, moments):
        """Kills a recorder at random moments; what is there is read, saved, and whole."""
        scene = self.write("scene.yaml", pathlib.Path(scene_path("room.yaml")).read_bytes().replace(
            b"width: 640, height: 480", b"width: 320, height: 240"))
        random.seed(20)
        saved = 0
        for moment in range(moments):
            recording = self.path(f"{moment}.mcap")
            recorder = subprocess.Popen([STRIPER, "record", f"sim:{scene}?realtime=yes", "-o", recording],
                                        stderr=subprocess.DEVNULL)
            time.sleep(slowed(random.uniform(0.3, 2.0)))
            recorder.send_signal(signal.SIGKILL)
            recorder.wait()
            if not os.path.exists(recording) or os.path.getsize(recording) < 100:
                continue
            known = info(recording, code=1)
            if known["frames"] == 0:
                continue
            whole = self.path(f"{moment}-whole.mcap")
            striper("convert", recording, "-o", whole)
            after = info(whole)
            self.assertIsNone(after["damage"])
            self.assertEqual(after["frames"], known["frames"])
            self.assertLess(known["duration_s"], slowed(3.0))
            saved += 1
        self.assertGreater(saved, moments // 3)

    def test_killed_writers(self):
        self.kill(6)


class DamagedOften(Damaged):
    def test_killed_writers(self):
        self.kill(200)


class Refusals(Recorded):
    def refused(self, reason, *arguments, code=2):
        run = striper(*arguments, code=code)
        self.assertIn(reason, run.stderr)

    def test_what_makes_no_sense_is_said(self):
        recording, _ = self.record("a.mcap", 2)
        out = self.path("b.csv")
        self.refused("is read: name another file", "convert", recording, "-o", recording)
        self.refused("expected an end behind the start", "convert", recording, "-o", out, "--start", 3, "--end", 2)
        self.refused("has no head left: expected striper", "convert", recording, "-o", out, "--head", "left")
        self.refused("expected an output .ply, .pcd or .las", "convert", recording, "-o", out, "--speed", 1)
        self.refused("--counts-per-m", "convert", recording, "-o", self.path("b.ply"), "--odometer", "o.csv")
        self.refused("are the same", "convert", recording, "-o", out, "-o", out)
        self.refused("rotate", "convert", recording, "-o", self.path("b.mcap?rotate=1GB"))
        self.refused("--start 100: ", "convert", recording, "-o", out, "--start", 100)
        striper("convert", recording, "-o", self.path("all.csv"))
        self.refused("between --start and --end", "convert", self.path("all.csv"), "-o", out, "--start", 100, code=1)
        self.refused("No such file", "convert", self.path("none.mcap"), "-o", out, code=1)
        self.refused("expected a recording or scans: .mcap, .csv or .jsonl", "info", os.path.join(SOURCE_DIR, "README.md"), code=1)
        self.refused("does not begin as an MCAP file", "info", self.write("c.mcap", b"frame,time_s\n"), code=1)


class Told(Recorded):
    def test_info_has_the_keys_of_the_contract(self):
        recording, _ = self.record("a.mcap", 4)
        known = info(recording)
        self.assertEqual(set(known), {"format", "duration_s", "start_s", "heads", "topics", "frames", "scans", "lasers",
                                      "model", "bytes", "damage"})
        self.assertEqual(known["format"], "mcap")
        self.assertEqual(known["bytes"], os.path.getsize(recording))
        self.assertEqual((known["frames"], known["scans"], known["lasers"]), (4, 4, [0]))
        for topic in known["topics"]:
            self.assertEqual(set(topic), {"name", "type", "count", "rate_hz", "largest_gap_s"})
        scans = next(t for t in known["topics"] if t["name"] == "/striper/polar_scan")
        self.assertAlmostEqual(scans["rate_hz"], 3 / known["duration_s"], places=4)
        self.assertAlmostEqual(scans["largest_gap_s"], 1 / scans["rate_hz"], places=4)

    def test_info_for_people(self):
        recording, _ = self.record("a.mcap", 4)
        text = striper("info", recording).stdout
        self.assertRegex(text, r"a\.mcap: mcap, [0-9.]+ kB, 0\.\d+ s from")
        self.assertIn("frames  4\n", text)
        self.assertIn("model   striper/striper.yaml\n", text)
        self.assertRegex(text, r"/striper/polar_scan +striper_msgs/msg/PolarScan +4 ")


if __name__ == "__main__":
    unittest.main()
