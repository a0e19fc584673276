# SPDX-License-Identifier: Apache-2.0
"""Proves that `striper guide run` guides live: a simulated truck whose three lasers cross the road before it, seen by one camera with
a wheel's encoder. What it says live, in tables and over CAN, is to the letter what a recorded run of the same inputs gives; heads of
a rig; a job that is resumed, or was killed, keeps its totals; an odometer at a serial line and on CAN; pipes that nobody opens and odometers
that are silent: said, and ended by Ctrl-C; a camera that is killed while a gun
is on: safe, back, totals right; a mirror that stops: lasers off, and they stay off.
Simulated: the frames come from the simulator itself; Camera: from the virtual camera over GigE Vision, at its frame rate. Does not
prove a real camera, nor a real road; a real bus is vcan.sh's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper STRIPER_SOURCE_DIR=. python3 guide_live_test.py
"""
import csv
import filecmp
import json
import os
import shutil
import signal
import struct
import subprocess
import threading
import time
import unittest

from gige_test import VirtualCamera
from program import SOURCE_DIR, STRIPER, InScratch, at_most, scene_path, striper

# The truck drives 2 m/s along dashes of 2 m and gaps of 3.
SCENE = scene_path("truck.yaml")
TRUCK = os.path.join(SOURCE_DIR, "data/roads/laser_truck.yaml")
TABLES = ("lateral.csv", "guns.csv", "seen.csv", "faults.csv")
RATE = 24  # The scene's frames a second.


class Live(InScratch):
    def setUp(self):
        super().setUp()
        self.scene = self.path("scene.yaml")
        shutil.copyfile(SCENE, self.scene)
        striper("simulate", self.scene, "-o", self.path("made"), "--frames", "1")
        self.model = self.path("made", "model.yaml")

    def truck(self, odometer=""):
        with open(TRUCK, encoding="utf-8") as file:
            return self.write("truck.yaml", file.read().replace("bits: 32}", f"bits: 32{odometer}}}"))

    def command(self, source, job, *options, odometer=""):
        return ["guide", "run", "--config", self.truck(odometer), "--head", f"truck={source}", "--model", f"truck={self.model}",
                "-o", self.path(job), *options]

    def table(self, *path):
        with open(self.path(*path), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def job(self, job):
        with open(self.path(job, "job.json"), encoding="utf-8") as file:
            return json.load(file)

    def equals_the_recorded_run(self, job, record):
        striper("guide", "run", self.path(record), "-o", self.path("recorded-" + job))
        for name in TABLES:
            self.assertTrue(filecmp.cmp(self.path(job, name), self.path("recorded-" + job, name), shallow=False), name)

    def is_right(self, job):
        """The line is 5 cm to the right of the truck, the paint where it was painted."""
        known = [row for row in self.table(job, "lateral.csv") if row["state"] == "tracking" and float(row["distance_m"]) > 6]
        self.assertGreater(len(known), 10)
        for row in known:
            self.assertAlmostEqual(float(row["lateral_m"]), -0.05, delta=max(0.01, 4 * float(row["sigma_m"])), msg=row)

    def painted(self, *path):
        return [float(row["length_m"]) for row in self.table(*path, "guns.csv") if row["state"] == "ON"]

    def start(self, *command):
        """A run that goes on until it is told to end."""
        program = subprocess.Popen([STRIPER, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def end():
            if program.poll() is None:
                program.kill()
            program.communicate()

        self.addCleanup(end)
        return program

    def wait_for(self, what, seconds=30):
        """Until a function gives something; returns that."""
        end = time.monotonic() + at_most(seconds)
        while not (found := what()):
            if time.monotonic() > end:
                self.fail("it did not come")
            time.sleep(0.01)
        return found

    def lines(self, name):
        """The whole lines of JSON that are there by now."""
        if not os.path.exists(self.path(name)):
            return []
        with open(self.path(name), encoding="utf-8") as file:
            return [json.loads(line) for line in file.read().split("\n")[:-1]]

    def switches(self, name):
        return [line["is_on"] for line in self.lines(name) if line["table"] == "switch"]



class Simulated(Live):
    SOURCE_KEYS = "encoder=500&laser=0,1,2"

    def source(self, frames):
        return f"sim:{self.scene}?frames={frames}&{self.SOURCE_KEYS}"

    def test_live_is_to_the_letter_what_the_recorded_run_is(self):
        done = json.loads(striper(*self.command(self.source(220), "job", "--record", self.path("run"), "--json")).stdout)
        self.assertEqual(done["sweeps"], 220)
        self.assertGreaterEqual(done["guns"][0]["dashes"], 2)
        self.equals_the_recorded_run("job", "run")
        self.is_right("job")
        self.assertAlmostEqual(self.job("job")["guns"][0]["on_m"], sum(self.painted("job")), places=9)
        self.assertEqual(self.job("job")["laser"], "off")

    def test_a_job_that_is_resumed_keeps_its_totals(self):
        striper(*self.command(self.source(150), "job"))
        first = self.job("job")
        said = striper(*self.command(self.source(150), "job", "--resume")).stderr
        self.assertIn("part 2 of the job", said)
        both = self.job("job")
        self.assertEqual(both["part"], 2)
        self.assertAlmostEqual(both["guns"][0]["on_m"], 2 * first["guns"][0]["on_m"], places=9)
        self.assertEqual(both["guns"][0]["dashes"], 2 * first["guns"][0]["dashes"])
        self.assertAlmostEqual(sum(self.painted("job")) + sum(self.painted("job", "part-2")), both["guns"][0]["on_m"], places=9)

    def test_outputs_live_are_those_of_the_recorded_run(self):
        def to(name):
            return ["--to", f"candump:{self.path(name + '.log')}", "--to", f"jsonl:{self.path(name + '.jsonl')}"]

        striper(*self.command(self.source(220), "job", "--record", self.path("run"), *to("live")))
        striper("guide", "run", self.path("run"), "-o", self.path("recorded"), *to("recorded"))
        for ending in (".log", ".jsonl"):
            self.assertTrue(filecmp.cmp(self.path("live" + ending), self.path("recorded" + ending), shallow=False), ending)
        self.assertIn(True, self.switches("live.jsonl"))
        self.assertEqual(self.lines("live.jsonl")[-1]["table"], "safe")

    def test_a_job_that_is_killed_goes_on_with_its_totals(self):
        # At half the simulator's pace: a job of 9 s that is killed in its second dash.
        source = f"sim:{self.scene}?frames=440&realtime=yes&{self.SOURCE_KEYS}"
        program = self.start(*self.command(source, "job", "--to", f"jsonl:{self.path('lines')}"))
        self.wait_for(lambda: os.path.exists(self.path("job", "job.json")) and self.job("job")["guns"][0]["dashes"] == 2)
        program.kill()
        program.wait()
        first = self.job("job")
        self.assertEqual(first["laser"], "on")
        self.assertGreater(first["guns"][0]["on_m"], 1.5)
        striper(*self.command(self.source(150), "job", "--resume"))
        self.assertAlmostEqual(self.job("job")["guns"][0]["on_m"], first["guns"][0]["on_m"] + sum(self.painted("job", "part-2")), places=9)
        self.assertEqual(self.job("job")["guns"][0]["dashes"], 2 + len(self.painted("job", "part-2")))
        self.assertEqual(self.job("job")["part"], 2)

    def test_a_job_and_a_run_that_are_there_are_not_replaced(self):
        striper(*self.command(self.source(60), "job", "--record", self.path("run")))
        again = striper(*self.command(self.source(60), "job"), code=2).stderr
        self.assertIn("holds a job that was driven", again)
        self.assertIn("--resume", again)
        self.assertIn("holds a job", striper("guide", "run", self.path("run"), "-o", self.path("job"), code=2).stderr)
        self.assertIn("already holds a run", striper(*self.command(self.source(60), "other", "--record", self.path("run")), code=2).stderr)
        for same in (self.path("both"), self.path("both") + "/", os.path.relpath(self.path("both"))):
            said = striper(*self.command(self.source(60), "both", "--record", same), code=2).stderr
            self.assertIn("are one directory", said)
        self.assertFalse(os.path.exists(self.path("both")))
        for file in (self.path("run2", "truck.mcap"), self.path("third", "guns.csv"), self.model, self.path("truck.yaml")):
            said = striper(*self.command(self.source(60), "third", "--record", self.path("run2"), "--to", f"jsonl:{file}"), code=2).stderr
            self.assertIn("is read or written by this run", said)

    def test_heads_of_a_rig(self):
        head = "{name: truck, source: 'sim:scene.yaml?frames=220&encoder=500&laser=0,1,2', model: made/model.yaml, options: {threshold: 9}}"
        rig = self.write("rig.yaml", "striper_rig: 1\nname: lorry\nheads:\n  - " + head + "\nodometer: {source: encoder, counts_per_m: 500, bits: 32}\n")
        common = ["guide", "run", "--config", self.truck(), "--rig", rig]
        striper(*common, "-o", self.path("job"), "--record", self.path("run"))
        self.equals_the_recorded_run("job", "run")
        self.is_right("job")
        with open(rig, encoding="utf-8") as file:
            text = file.read()
        for wrong, right, said in (("counts_per_m: 500", "counts_per_m: 400", "400 counts a metre"), ("threshold: 9", "treshold: 9", "rig.yaml:4"),
                                   ("name: truck", "name: lorry", "expected --head truck=SOURCE"), ("made/model", "made/none", "made/none.yaml"),
                                   ("striper_rig: 1", "striper_rig: 2", "rig.yaml:1")):
            self.write("wrong.yaml" if right == "striper_rig: 2" else "rig.yaml", text.replace(wrong, right))
            file = self.path("wrong.yaml") if right == "striper_rig: 2" else rig
            self.assertIn(said.replace("rig.yaml:1", "wrong.yaml:1"),
                          striper(*common[:-1], file, "-o", self.path("no"), code=None).stderr)
        self.assertIn("excludes", striper(*common, "--head", "truck=sim:x", "-o", self.path("no"), code=2).stderr)
        self.assertIn("--head or --rig", striper("guide", "run", self.path("run"), "-o", self.path("no"), "--resume", code=2).stderr)

    def test_what_is_wrong_is_said(self):
        command = self.command(self.source(10), "job")
        self.assertIn("expected --model truck=FILE", striper(*[c for c in command if c not in ("--model", f"truck={self.model}")], code=2).stderr)
        other = [c.replace("truck=sim", "lorry=sim").replace("truck=/", "lorry=/") for c in command]
        self.assertIn("expected --head truck=SOURCE", striper(*other, code=2).stderr)
        self.assertIn("job.json", striper(*command, "--resume", code=1).stderr)
        wrong = self.command(self.source(10), "job", odometer=', source: "wheel:1"')
        self.assertIn("expected encoder, serial:DEVICE", striper(*wrong, code=1).stderr)
        self.assertIn("--head NAME=SOURCE", striper("guide", "run", "-o", self.path("job"), code=2).stderr)

    def test_an_odometer_at_a_serial_line(self):
        host, device = os.openpty()
        self.addCleanup(os.close, host)
        self.addCleanup(os.close, device)
        command = self.command(f"sim:{self.scene}?fps={RATE}&realtime=yes&laser=0,1,2", "job", "--seconds", "3", "--record", self.path("run"),
                               odometer=f', source: "serial:{os.ttyname(device)}?baud=115200"')
        ends = threading.Event()

        def count():
            begin = time.monotonic()
            while not ends.wait(0.01):
                os.write(host, b"%d\r\n" % (1000 * (time.monotonic() - begin)))

        counter = threading.Thread(target=count)
        counter.start()
        try:
            striper(*command, code=None)
        finally:
            ends.set()
            counter.join()
        counts = [int(row["counts"]) for row in self.table("run", "odometer.csv")]
        self.assertGreater(len(counts), 50)
        self.assertEqual(counts, sorted(counts))


    def test_a_pipe_that_nobody_reads_is_said_and_left(self):
        """As an output: said, waited for, left with Ctrl-C; as a log of an odometer: refused."""
        pipe = self.path("pipe")
        os.mkfifo(pipe)
        striper("guide", "simulate", self.write("road.yaml", "striper_road: 1\nlength_m: 5\n"), "-o", self.path("recorded"))
        live = self.command(f"sim:{self.scene}?fps={RATE}&realtime=yes&{self.SOURCE_KEYS}", "job")
        for command in (live, ["guide", "run", self.path("recorded"), "-o", self.path("other")]):
            for address in (f"jsonl:{pipe}", f"candump:{pipe}"):
                program = self.start(*command, "--to", address)
                self.assertIn(f"--to {address}: waits until somebody reads it; Ctrl-C ends", program.stderr.readline())
                self.ends_at_once(program, 1)
                self.assertIn(f"--to {address}: interrupted before anybody read it", program.stderr.read())
                shutil.rmtree(self.path("job"), ignore_errors=True)
        said = striper(*self.command(self.source(60), "job", odometer=f', source: "candump:{pipe}"'), code=1, timeout=20).stderr
        self.assertIn(f"candump:{pipe} is no file", said)

    def test_an_odometer_that_is_silent_is_said_and_holds_nothing_up(self):
        host, device = os.openpty()
        self.addCleanup(os.close, host)
        self.addCleanup(os.close, device)
        pipe = self.path("pipe")
        os.mkfifo(pipe)
        moving = f"sim:{self.scene}?fps={RATE}&realtime=yes&laser=0,1,2"
        for address in (f"serial:{os.ttyname(device)}", f"serial:{pipe}", "encoder"):
            program = self.start(*self.command(moving, "job", odometer=f', source: "{address}"'))
            said = ""
            while "no reading for 1 s" not in said:
                said = program.stderr.readline()
                self.assertNotEqual(said, "", address)
            self.assertIn(f"odometer {address}: no reading for 1 s: nothing is painted without it", said)
            self.ends_at_once(program, 0)
            self.assertEqual(self.painted("job"), [])
            shutil.rmtree(self.path("job"))

    def ends_at_once(self, program, code):
        program.send_signal(signal.SIGINT)
        told = time.monotonic()
        self.assertEqual(program.wait(timeout=at_most(10)), code)
        self.assertLess(time.monotonic() - told, at_most(0.5))


class Camera(Live):
    def test_live_over_the_network_is_to_the_letter_what_the_recorded_run_is(self):
        with VirtualCamera(self.scene, "--loop", "300") as camera:
            # Two wheels' turns a metre: the virtual camera's encoder counts 1000 a second.
            source = camera.uri("encoder=yes&laser=0,1,2&fps=%d" % RATE)
            done = striper(*self.command(source, "job", "--record", self.path("run"), "--seconds", "11", "--json"), timeout=60)
        self.assertGreater(json.loads(done.stdout)["sweeps"], 8 * RATE)
        self.assertNotIn("came too late", done.stderr)
        self.equals_the_recorded_run("job", "run")
        self.is_right("job")

    def test_a_camera_that_is_killed_while_the_gun_is_on(self):
        lines = "lines.jsonl"
        with VirtualCamera(self.scene, "--loop", "300") as camera:
            source = camera.uri("encoder=yes&laser=0,1,2&fps=%d" % RATE)
            program = self.start(*self.command(source, "job", "--record", self.path("run"), "--to", f"jsonl:{self.path(lines)}"))
            self.wait_for(lambda: self.switches(lines).count(True) == 2 and self.switches(lines)[-1])
            time.sleep(0.3)
            camera.program.kill()
            killed = time.monotonic()
            camera.program.communicate()
            self.wait_for(lambda: not self.switches(lines)[-1])
            self.assertLess(time.monotonic() - killed, 0.6)
            safe = self.wait_for(lambda: [line for line in self.lines(lines) if line["table"] == "lateral"][-1])
            self.assertEqual((safe["state"], safe["volts"], safe["lateral_m"]), ("fault", 0.0, None))
            time.sleep(1)
            camera.__enter__()
            before = len(self.switches(lines))
            self.wait_for(lambda: len(self.switches(lines)) >= before + 4)
            program.send_signal(signal.SIGINT)
            _, said = program.communicate(timeout=at_most(20))
        self.assertEqual(program.returncode, 0, said)
        self.assertIn("nothing comes in: guns off, the safe voltage", said)
        self.assertIn("inputs are back", said)
        self.totals_are_right(lines)

    def totals_are_right(self, lines):
        """Of a job whose second dash was cut by a camera that was lost, and that went on for two more."""
        painted = self.painted("job")
        self.assertGreaterEqual(len(painted), 4)
        gun = self.job("job")["guns"][0]
        self.assertAlmostEqual(gun["on_m"], sum(painted), places=9)
        self.assertEqual(gun["dashes"], len(painted))
        self.assertEqual(self.switches(lines).count(True), len(painted))
        # Whole dashes have 2 m, the one that was cut what was driven until then; none is painted blind.
        for length_m in (painted[0], painted[2]):
            self.assertAlmostEqual(length_m, 2.0, delta=0.12)
        self.assertGreater(painted[1], 0.4)
        self.assertLess(painted[1], 1.9)
        self.assertIn("odometer", {row["code"] for row in self.table("job", "faults.csv")})
        states = [row["state"] for row in self.table("job", "lateral.csv")]
        self.assertIn("tracking", states[states.index("fault"):])
        # The way is what the odometer has counted, before and after.
        counts = [int(row["counts"]) for row in self.table("run", "odometer.csv")]
        driven = sum(b - a for a, b in zip(counts, counts[1:]) if 0 <= b - a < 500)
        self.assertAlmostEqual(self.job("job")["way_m"], driven / 500, delta=0.5)
        self.assertEqual(self.lines(lines)[-1]["table"], "safe")

    def can_log(self, seconds, mirror_stops_s):
        """A truck's odometer, 100 times a second at 2 m/s, and its mirror's state, as candump -L writes them."""
        lines = []
        for k in range(100 * seconds):
            lines.append("(%.6f) can0 330#%s" % (1000 + 0.01 * k, struct.pack("<Ih", 10 * k, -32768).hex().upper()))
            if k % 10 == 5:
                mirror = 2200 if 0.01 * k < mirror_stops_s else 0
                lines.append("(%.6f) can0 331#%s" % (1000 + 0.01 * k, struct.pack("<BH", 1, mirror).hex().upper()))
        return self.write("truck.log", "\n".join(lines) + "\n")

    def test_an_odometer_on_can_and_a_mirror_that_stops(self):
        log = self.can_log(14, 8)
        with VirtualCamera(self.scene, "--loop", "300") as camera:
            source = camera.uri("laser=0,1,2&fps=%d" % RATE)
            done = striper(*self.command(source, "job", "--record", self.path("run"), "--seconds", "12", "--json",
                                         odometer=f', source: "candump:{log}"'), timeout=60)
        self.assertIn("lasers off: they stay off until guidance is started again", done.stderr)
        self.assertEqual(json.loads(done.stdout)["laser"], "locked")
        self.assertEqual(self.job("job")["laser"], "locked")
        faults = {row["code"]: float(row["time_s"]) for row in self.table("job", "faults.csv")}
        stopped_s = next(float(row["time_s"]) for row in self.table("run", "state.csv") if row["mirror_hz"] == "0")
        self.assertAlmostEqual(faults["mirror"], stopped_s, delta=0.002)
        # The camera, which fires them, is closed: nothing but what was under way is scanned.
        seen = [float(row["time_s"]) for row in self.table("job", "seen.csv")]
        self.assertGreater(sum(1 for time_s in seen if time_s < stopped_s), 50)
        self.assertEqual([time_s for time_s in seen if time_s > stopped_s + 1], [])
        self.equals_the_recorded_run("job", "run")
        said = striper(*self.command(source, "job", "--resume", "--seconds", "0.5"), code=None).stderr
        self.assertIn("the lasers were locked when the part before ended", said)


if __name__ == "__main__":
    unittest.main()
