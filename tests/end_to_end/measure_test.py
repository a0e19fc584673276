# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper noise` and `striper bench` promise: the simulator's own noise found again and
written into a model, frames that do not tell refused with the reason and exit code 3, tables that a
program can read. Does not prove that any speed is reached: that depends on the machine.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 measure_test.py
"""
import json
import random
import re
import unittest

from program import InScratch, striper

# Panels from dark to bright in daylight, every other frame without the laser.
SCENE = """striper_scene: 1
camera: {width: 320, height: 240, fov_deg: 60}
imager: {blur_px: 0.6, dn_per_electron: 0.06, black_level_dn: 6, shutter_us: 20}
noise: {shot: yes, read_e: 25, seed: 7}
timing: {cadence: "0,dark"}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 70, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
daylight: {ambient_w_m2_nm: %s}
device: {position_m: [0, 0, 1]}
objects:
""" + "".join(
    f"  - {{name: panel {i}, shape: rectangle, position_m: [2, {0.9 - 0.3 * i}, 0.7], normal: [-1, 0, 0],"
    f" size_m: [0.3, 3], reflectance: {0.05 + 0.13 * i:.2f}}}\n" for i in range(7))


class Noise(InScratch):
    def write_image(self, name, value):
        """A grey image of 64x48, value(u, v) in DN."""
        pixels = bytes(max(0, min(255, round(value(u, v)))) for v in range(48) for u in range(64))
        return self.write(name, b"P5 64 48 255\n" + pixels)

    def test_finds_the_simulators_noise_and_writes_it_into_the_model(self):
        scene = self.write("scene.yaml", SCENE % "1.2")
        striper("simulate", scene, "-o", self.path("images"), "--frames", 1)
        model = self.path("images/model.yaml")
        measured = self.path("measured.yaml")
        run = striper("noise", "sim:" + scene, "--model", model, "--black", 6, "-o", measured, "--json",
                      "--frames", 40)
        result = json.loads(run.stdout)
        self.assertEqual(result["pictures"], 20)
        self.assertAlmostEqual(result["dn_per_electron"], 0.06, delta=0.03 * 0.06)
        self.assertAlmostEqual(result["read_noise_dn"], 25 * 0.06, delta=0.05 * 25 * 0.06)
        self.assertLess(result["misfit"], 0.06)
        with open(measured) as file:
            text = file.read()
        block = re.search(r"^noise:.*?read_noise_dn: ([0-9.e-]+).*?dn_per_electron: ([0-9.e-]+).*?"
                          r"black_level_dn: ([0-9.e-]+)", text, re.M | re.S)
        self.assertIsNotNone(block, text)
        self.assertEqual(float(block.group(1)), result["read_noise_dn"])
        self.assertEqual(float(block.group(2)), result["dn_per_electron"])
        self.assertEqual(float(block.group(3)), 6)
        self.assertIn("bit_depth: 8}", text)
        striper("capture", "images:" + self.path("images"), "--model", measured)

    def test_covered_frames_tell_the_black_level(self):
        scene = self.write("scene.yaml", SCENE % "1.2")
        covered = self.write("covered.yaml", SCENE % "0")
        run = striper("noise", "sim:" + scene, "--covered", "sim:" + covered, "--json", "--frames", 16)
        self.assertAlmostEqual(json.loads(run.stdout)["black_level_dn"], 6.0, delta=0.1)

    def test_prints_the_block_without_a_model(self):
        scene = self.write("scene.yaml", SCENE % "1.2")
        run = striper("noise", "sim:" + scene, "--black", 6, "--frames", 16)
        self.assertRegex(run.stdout, r"^noise: \{read_noise_dn: 1\.[45]\d*, dn_per_electron: 0\.0[56]\d*, "
                                     r"black_level_dn: 6, bit_depth: 8\}\n$")

    def refused(self, reason, *arguments):
        run = striper("noise", *arguments, code=3)
        self.assertIn(reason, run.stderr)
        self.assertEqual(run.stdout, "")

    def test_refuses_lit_exposures(self):
        scene = self.write("scene.yaml", (SCENE % "1.2").replace("0,dark", "0"))
        self.refused("the laser is on in all 6 exposures", "sim:" + scene, "--frames", 6)

    def test_refuses_a_stripe_that_nobody_spoke_of(self):
        for n in range(6):
            self.write_image(f"lit/{n}.pgm", lambda u, v: random.gauss(20, 2) + 150 * (abs(v - 30) < 2))
        self.refused("there is a stripe in 100 % of the image", "images:" + self.path("lit"))

    def test_refuses_too_few_and_copies(self):
        for n in range(2):
            self.write_image(f"few/{n}.pgm", lambda u, v: random.gauss(20 + 2 * u, 2))
        self.refused("2 dark images; at least 4 are needed", "images:" + self.path("few"))
        for n in range(8):
            self.write_image(f"copies/{n}.pgm", lambda u, v: 20 + 40 * (u // 16))
        self.refused("copies of one image", "images:" + self.path("copies"))

    def test_wrong_usage(self):
        striper("noise", "sim:x.yaml", "-o", "out.yaml", code=2)
        striper("noise", "sim:x.yaml", "--black", 1, "--covered", "sim:y", code=2)


class Bench(InScratch):
    def test_tables_for_programs(self):
        run = striper("bench", "--quick", "--size", "96x64", "--memory", 1, "--bits", 8, 16, "--json")
        result = json.loads(run.stdout)
        self.assertTrue(result["instruction_set"])
        self.assertEqual([table["bits"] for table in result["tables"]], [8, 12])
        for table in result["tables"]:
            self.assertEqual((table["width"], table["height"]), (96, 64))
            names = [row["name"] for row in table["rows"]]
            for name in ("read roofline (sum)", "candidate pass, columns", "fast, whole extraction",
                         "refined, whole extraction", "Scanner::process, refined", "cv::reduceArgMax"):
                self.assertIn(name, names)
            self.assertTrue(all(row["hot_us"] > 0 for row in table["rows"]))
            self.assertTrue(all(row["hot_of_roof"] > 0 for row in table["rows"]))
            self.assertGreater(table["frames_per_s"], 0)
            self.assertGreaterEqual(table["latency_p99_us"], table["latency_p50_us"])

    def test_tables_for_people(self):
        run = striper("bench", "--quick", "--size", "96x64", "--memory", 1)
        self.assertIn("96x64, 8 bits", run.stdout)
        self.assertIn("frames/s; latency p50", run.stdout)

    def test_refuses_sizes_that_are_none(self):
        for size in ("640", "640x", "x480", "8x8", "640x480x3", "99999x99999"):
            run = striper("bench", "--size", size, code=2)
            self.assertIn("as in 640x480", run.stderr)


if __name__ == "__main__":
    unittest.main()
