# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper guide` promises of its files and its words: a road of data/roads is simulated, guided and held against its
truth, table by table to the letter; the same run gives the same bytes; another method another answer; and what is wrong is said with
its place. The figures themselves are tests/sdk/guidance's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper STRIPER_SOURCE_DIR=. python3 guide_test.py
"""
import csv
import json
import os
import re
import shutil
import unittest

from program import InScratch, striper

ROADS = os.path.join(os.environ["STRIPER_SOURCE_DIR"], "data/roads")
TABLES = {
    "lateral.csv": "time_s,odometer_counts,distance_m,lateral_m,sigma_m,volts,beams,state",
    "guns.csv": "gun,state,from_counts,to_counts,from_m,to_m,length_m,total_m",
    "seen.csv": "time_s,odometer_counts,distance_m,beam,kind,lateral_m,length_m,reason",
    "faults.csv": "time_s,code,action,latency_s",
}


class Guide(InScratch):
    def simulated(self, road):
        run = self.path(f"run-{road}")
        if not os.path.exists(run):
            striper("guide", "simulate", os.path.join(ROADS, road + ".yaml"), "-o", run)
        return run

    def guided(self, road, *arguments, to="job"):
        job = self.path(to)
        done = striper("guide", "run", self.simulated(road), "-o", job, "--json", *arguments)
        return job, json.loads(done.stdout), done.stderr

    def table(self, job, name):
        with open(os.path.join(job, name), encoding="utf-8", newline="") as file:
            self.assertEqual(file.readline().rstrip("\n"), TABLES[name])
            file.seek(0)
            return list(csv.DictReader(file))

    def evaluated(self, job, road, *arguments):
        truth = os.path.join(self.simulated(road), "truth.csv")
        return json.loads(striper("guide", "evaluate", job, "--truth", truth, "--json", *arguments).stdout)

    def test_dashes_from_the_road_to_table_1(self):
        job, summary, stderr = self.guided("dashes")
        lateral = self.table(job, "lateral.csv")
        self.assertEqual(summary["scans"], len(lateral))
        self.assertEqual({row["state"] for row in lateral}, {"tracking", "bridging", "lost"})
        guns = self.table(job, "guns.csv")
        self.assertEqual([row["state"] for row in guns], ["OFF", "ON"] * (len(guns) // 2) + ["OFF"] * (len(guns) % 2))
        for before, row in zip(guns, guns[1:]):
            self.assertEqual(before["to_counts"], row["from_counts"])
            self.assertAlmostEqual(float(row["total_m"]), float(row["length_m"]) + float(before["length_m"]), places=9)
        seen = self.table(job, "seen.csv")
        kinds = {row["kind"] for row in seen}
        self.assertLessEqual({"start", "end", "line"}, kinds)
        self.assertEqual(self.table(job, "faults.csv"), [])
        self.assertIn("a pattern of", stderr)
        self.assertAlmostEqual(summary["guns"][0]["pattern"]["dash_m"], 3.0, delta=0.1)
        # Of 9.1 m of gap the next beam sees the next dash .9 m earlier or, of the rear beam, the one before.
        self.assertGreater(summary["longest_gap_m"], 1.0)
        self.assertLess(summary["longest_gap_m"], 9.5)
        self.assertEqual(summary["gap_limit_m"], 15.0)
        found = self.evaluated(job, "dashes", "--from", "25")
        self.assertLess(found["lateral"]["rms_m"], 0.003)
        self.assertEqual(found["ends"]["missed"], 0)
        self.assertEqual(found["ends"]["invented"], 0)
        self.assertGreaterEqual(found["ends"]["within_4_in"], 0.97 * found["ends"]["counted"])
        words = striper("guide", "evaluate", job, "--truth", os.path.join(self.simulated("dashes"), "truth.csv")).stdout
        self.assertIn("ends within 4 in:", words)
        self.assertIn("begin", words)

    def test_the_same_run_gives_the_same_bytes(self):
        one, _, _ = self.guided("double", to="one")
        two, _, _ = self.guided("double", to="two")
        again, _, _ = self.guided("double", "--config", os.path.join(one, "guidance.yaml"), to="again")
        for name in TABLES:
            with open(os.path.join(one, name), "rb") as file:
                first = file.read()
            for other in (two, again):
                with open(os.path.join(other, name), "rb") as file:
                    self.assertEqual(first, file.read(), name)

    def test_the_report_s_method_is_worse(self):
        ours = self.evaluated(self.guided("solid", to="ours")[0], "solid", "--from", "25")
        job, _, _ = self.guided("solid", "--method", "report", to="theirs")
        theirs = self.evaluated(job, "solid", "--from", "25")
        self.assertLess(ours["lateral"]["rms_m"], theirs["lateral"]["rms_m"] / 3)
        self.assertTrue(all(row["sigma_m"] == "" for row in self.table(job, "lateral.csv")))
        self.assertIsNone(theirs["lateral"]["pull"])
        integer, _, _ = self.guided("solid", "--method", "integer", to="integer")
        self.assertLess(self.evaluated(integer, "solid", "--from", "25")["lateral"]["rms_m"], 0.02)

    def test_every_road_is_followed(self):
        for road, most_m in (("nuisance", 0.0025), ("double", 0.0025), ("yellow_diffuse", 0.0025), ("bend", 0.006)):
            job, summary, _ = self.guided(road, to="job-" + road)
            found = self.evaluated(job, road, "--from", "25")
            self.assertLess(found["lateral"]["rms_m"], most_m, road)
            self.assertEqual(found["ends"]["invented"], 0, road)
            if road == "nuisance":
                self.assertLessEqual({"marker", "tape", "spot", "cross", "letter"},
                                     {kind for kind, number in summary["seen"].items() if number})

    def test_what_is_wrong_is_said(self):
        run = self.simulated("dashes")
        broken = self.path("broken")
        shutil.copytree(run, broken)
        with open(os.path.join(broken, "guidance.yaml"), encoding="utf-8") as file:
            text = file.read()
        self.write("broken/guidance.yaml", text.replace("kind: retro", "kind: radar", 1))
        said = striper("guide", "run", broken, "-o", self.path("x"), code=1).stderr
        self.assertIn("guidance.yaml:3", said)
        self.assertIn("retro or diffuse", said)
        self.write("broken/guidance.yaml", text.replace('name: "', 'name: "another '))
        said = striper("guide", "run", broken, "-o", self.path("x"), code=1).stderr
        self.assertIn("has no sweeps of the beams", said)
        self.write("broken/guidance.yaml", text)
        with open(os.path.join(broken, "sweeps.csv"), "a", encoding="utf-8") as file:
            file.write("99,1,front,x\n")
        said = striper("guide", "run", broken, "-o", self.path("x"), code=1).stderr
        self.assertIn("sweeps.csv", said)
        self.assertIn("s0", said)
        self.assertIn("hold what was guided until then", said)  # All but the last line, which is wrong.
        self.assertGreater(len(self.table(self.path("x"), "lateral.csv")), 100)
        self.assertIn("have no scan in common", striper("guide", "evaluate", self.path("x"), "--truth", os.path.join(run, "truth.csv"),
                                                         "--from", "99999", code=1).stderr)
        for field, wrong in (("height_m", 34), ("threshold", 4096), ("on_delay_s", 20), ("dash_min_m", 1e308)):
            changed, count = re.subn(rf"\b{field}: [^,}}\n]+", f"{field}: {wrong}", text, count=1)
            self.assertEqual(count, 1, field)
            said = striper("guide", "run", run, "--config", self.write("wrong.yaml", changed), "-o", self.path("y"), code=1).stderr
            self.assertIn(f"{field}", said)
        self.assertIn("cannot make", striper("guide", "run", run, "-o", self.write("a-file", ""), code=1).stderr)
        self.assertIn("names a run: its guidance.yaml would be replaced", striper("guide", "run", run, "-o", run, code=2).stderr)
        self.assertIn("guidance.yaml", striper("guide", "run", self.path("nowhere"), "-o", self.path("x"), code=1).stderr)
        road = self.write("road.yaml", "striper_road: 1\nlength_m: 10\nobjects: [{kind: cat, at_m: 3}]\n")
        self.assertIn("road.yaml:3", striper("guide", "simulate", road, "-o", self.path("x"), code=1).stderr)
        striper("guide", code=2)

    def test_a_drive_along_a_tape_aligns_beams_and_gun(self):
        run = self.simulated("taped")
        with open(os.path.join(run, "volts.csv"), "w", encoding="utf-8") as file:
            file.write("volts,lateral_m\n" + "".join(f"{v},{0.01 - v / 9.8}\n" for v in (-3, -1, 1, 3)))
        with open(os.path.join(run, "painted.csv"), "w", encoding="utf-8") as file:
            file.write("gun,state,signal_m,speed_m_s,painted_m\n")
            for k in range(20):
                speed, late = (3, 0.06) if k < 10 else (12, 0.06)
                file.write(f"gun,{'ON' if k % 2 else 'OFF'},{8 * k},{speed},{8 * k - 0.1 + speed * late}\n")
        aligned = self.path("aligned.yaml")
        done = json.loads(striper("guide", "align", run, "-o", aligned, "--json").stdout)
        for beam, zero_m, scale in zip(done["beams"], (0.0254, -0.0127, 0.0), (1.0, 1.03, 0.98)):
            self.assertLess(abs(beam["zero_m"] - zero_m), 4 * beam["sigma_zero_m"], beam)
            self.assertLess(abs(beam["scale"] - scale), 4 * beam["sigma_scale"], beam)
        self.assertAlmostEqual(done["output"]["volts_per_m"], -9.8, places=6)
        self.assertAlmostEqual(done["guns"][0]["on_delay_s"], 0.06, places=6)
        self.assertAlmostEqual(done["guns"][0]["x_m"], -0.1, places=6)
        errors, sigmas = [], []
        for config in (os.path.join(run, "guidance.yaml"), aligned):
            job = self.path("job-aligned")
            striper("guide", "run", run, "--config", config, "-o", job)
            errors.append(abs(self.evaluated(job, "taped", "--from", "15")["lateral"]["mean_m"]))
            sigmas.append(min(float(row["sigma_m"]) for row in self.table(job, "lateral.csv") if row["sigma_m"]))
        self.assertLess(errors[1], 0.05 * 0.0254)
        self.assertGreater(errors[0], 5 * errors[1])
        self.assertGreater(sigmas[1], sigmas[0])

        self.write("tape.csv", "time_s,x_m,lateral_m\n5,0,0.01\n")
        refused = striper("guide", "align", run, "--tape", self.path("tape.csv"), "-o", self.path("no.yaml"), code=3)
        self.assertIn("refused: beam front: its zero is known to", refused.stderr)
        self.assertFalse(os.path.exists(self.path("no.yaml")))
        self.write("one-speed.csv", "gun,state,signal_m,speed_m_s,painted_m\ngun,ON,1,3,1.1\ngun,OFF,4,3,4.1\n")
        refused = striper("guide", "align", run, "--painted", self.path("one-speed.csv"), "-o", self.path("no.yaml"), code=3)
        self.assertIn("paint at two speeds", refused.stderr)
        said = striper("guide", "align", self.simulated("dashes"), "-o", self.path("no.yaml"), code=1).stderr
        self.assertIn("there is no tape.csv", said)

        tape = os.path.join(run, "tape.csv")
        with open(tape, encoding="utf-8") as file:
            before = file.read()
        self.assertIn("is read by this command", striper("guide", "align", run, "-o", tape, code=2).stderr)
        with open(tape, encoding="utf-8") as file:
            self.assertEqual(file.read(), before)

    def test_a_plan_says_what_limits(self):
        plan = json.loads(striper("guide", "plan", "--json").stdout)
        self.assertAlmostEqual(plan["noise_gain"], 1.8505, places=4)
        self.assertAlmostEqual(plan["bend_error_m"] / 0.0254, -0.01955, places=5)
        self.assertEqual({"acceleration", "feedback", "odometer"}, {one["code"] for one in plan["warnings"]})
        self.assertEqual(plan["limits"][0]["by"], "bend")
        words = striper("guide", "plan", os.path.join(ROADS, "diffuse_truck.yaml"), "--speed", "10", "--radius", "100").stdout
        self.assertRegex(words, r"front +7\.9 +-?[0-9.]+ +45\.5 +90\.9")
        self.assertRegex(words, r"what limits, the slowest first\n +bend +35\.0 mph\n +beam front +45\.5 mph")
        self.assertNotIn("warning", words)
        striper("guide", "plan", "--speed", "0", code=2)
        self.assertIn("nowhere.yaml", striper("guide", "plan", "nowhere.yaml", code=1).stderr)

    def test_a_cut_run_is_guided_to_its_end(self):
        run = self.path("cut")
        shutil.copytree(self.simulated("dashes"), run)
        with open(os.path.join(run, "sweeps.csv"), "rb+") as file:
            file.truncate(os.path.getsize(os.path.join(run, "sweeps.csv")) // 2 + 11)
        striper("guide", "run", run, "-o", self.path("cut-job"))
        self.assertGreater(len(self.table(self.path("cut-job"), "lateral.csv")), 1000)


if __name__ == "__main__":
    unittest.main()
