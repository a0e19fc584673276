# SPDX-License-Identifier: Apache-2.0
"""Proves that `striper guide run` guides live: a simulated truck whose three lasers cross the road before it, seen by one camera with
a wheel's encoder. What it says live is to the letter what a recorded run of the same inputs gives; a job that is resumed keeps its totals; an odometer at a serial line.
Simulated: the frames come from the simulator itself; Camera: from the virtual camera over GigE Vision, at its frame rate. Does not
prove a real camera, nor a real road.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper STRIPER_SOURCE_DIR=. python3 guide_live_test.py
"""
import csv
import filecmp
import json
import os
import threading
import time
import unittest

from gige_test import VirtualCamera
from program import InScratch, striper

# The truck drives 2 m/s along dashes of 2 m and gaps of 3; its camera is 1 m above the road and looks 30 degrees down; lasers 0.4 m
# below it meet the road 2.4, 1.8 and 1.2 m ahead, in turn.
SCENE = """striper_scene: 1
camera: {width: 240, height: 180, fov_deg: 55, rotation_deg: [0, 30, 0]}
imager: {blur_px: 0.5, black_level_dn: 8, dn_per_electron: 0.05, shutter_us: 2.5}
noise: {shot: yes, read_e: 20, seed: 7}
timing: {picture_rate_hz: RATE, cadence: "0,1,2"}
lasers:
  - {position_m: [0, 0, -0.4], rotation_deg: [0, 14.0362, 0], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
  - {position_m: [0, 0, -0.4], rotation_deg: [0, 18.4349, 0], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
  - {position_m: [0, 0, -0.4], rotation_deg: [0, 26.5651, 0], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
device: {position_m: [0, 0.05, 1.0], velocity_m_s: [2, 0, 0]}
objects:
  - {name: road, shape: plane, normal: [0, 0, 1], reflectance: 0.15,
     stripe: {width_m: 0.1, dash_m: 2, gap_m: 3, reflectance: 0.7}}
"""
# Laser by laser the camera sees each third picture.
TRUCK = """striper_guidance: 1
beams:
  - {name: far, kind: diffuse, head: truck, laser: 0, x_m: 2.4, y_left_m: 0.4, y_right_m: -0.4, rate_hz: HZ, samples: 100, threshold: auto}
  - {name: middle, kind: diffuse, head: truck, laser: 1, x_m: 1.8, y_left_m: 0.4, y_right_m: -0.4, rate_hz: HZ, samples: 100, threshold: auto}
  - {name: near, kind: diffuse, head: truck, laser: 2, x_m: 1.2, y_left_m: 0.4, y_right_m: -0.4, rate_hz: HZ, samples: 100, threshold: auto}
odometer: {counts_per_m: 500, bits: 32ODOMETER}
guns: [{name: gun}]
stripe: {width_m: 0.1, gap_limit_m: 8}
"""
TABLES = ("lateral.csv", "guns.csv", "seen.csv", "faults.csv")
RATE = 24


class Live(InScratch):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.yaml", SCENE.replace("RATE", str(RATE)))
        striper("simulate", self.scene, "-o", self.path("made"), "--frames", "1")
        self.model = self.path("made", "model.yaml")

    def truck(self, odometer=""):
        return self.write("truck.yaml", TRUCK.replace("HZ", str(RATE / 3)).replace("ODOMETER", odometer))

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

    def painted_m(self, *path):
        return sum(float(row["length_m"]) for row in self.table(*path, "guns.csv") if row["state"] == "ON")


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
        self.assertAlmostEqual(self.job("job")["guns"][0]["on_m"], self.painted_m("job"), places=9)
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
        self.assertAlmostEqual(self.painted_m("job") + self.painted_m("job", "part-2"), both["guns"][0]["on_m"], places=9)

    def test_what_is_wrong_is_said(self):
        command = self.command(self.source(10), "job")
        self.assertIn("expected --model truck=FILE", striper(*[c for c in command if c not in ("--model", f"truck={self.model}")], code=2).stderr)
        other = [c.replace("truck=sim", "lorry=sim").replace("truck=/", "lorry=/") for c in command]
        self.assertIn("expected --head truck=SOURCE", striper(*other, code=2).stderr)
        self.assertIn("job.json", striper(*command, "--resume", code=1).stderr)
        wrong = self.command(self.source(10), "job", odometer=', source: "wheel:1"')
        self.assertIn("expected encoder, or serial:DEVICE", striper(*wrong, code=1).stderr)
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


if __name__ == "__main__":
    unittest.main()
