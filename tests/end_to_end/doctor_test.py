# SPDX-License-Identifier: Apache-2.0
"""Proves that `striper doctor` says of images what is wrong with light, laser, focus, fields, numbers and
model, for grey and colour, for a stripe along either axis, for whole and for interlaced frames. What it says of
cameras and networks is in gige_test.py and gige_network_test.py.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 doctor_test.py
"""
import json
import math
import os
import re
import tempfile
import unittest

from program import InScratch, scene_path, striper

WALL = scene_path("wall.yaml")
NTSC = scene_path("ntsc_grabber.yaml")
CURB = "sim:" + scene_path("curb.yaml")
WIDTH, HEIGHT = 160, 120


def stripe(height, at=60.0, sigma=1.2):
    """Light of a Gaussian stripe by the distance across it."""
    return lambda place: height * math.exp(-0.5 * ((place - at) / sigma) ** 2)


def grey(background, light, along="columns"):
    """An image with a stripe that has one centre in every column, or in every row."""
    across = HEIGHT if along == "columns" else WIDTH
    profile = bytes(min(round(background + light(place)), 255) for place in range(across))
    if along == "columns":
        pixels = b"".join(bytes([value]) * WIDTH for value in profile)
    else:
        pixels = profile * HEIGHT
    return b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + pixels


def crossed(light):
    """An image with light by row and column."""
    pixels = bytes(min(round(20 + light(row, column)), 255) for row in range(HEIGHT) for column in range(WIDTH))
    return b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + pixels


def green_on_white(background, light, edges=120):
    """The same for a green laser on a scene whose white light makes edges, by default stronger ones than the laser."""
    pixels = bytearray()
    for row in range(HEIGHT):
        for column in range(WIDTH):
            white = background + (edges if column // 10 % 2 and row // 7 % 2 else 0)
            pixels += bytes([white, min(round(white + light(row)), 255), white])
    return b"P6 %d %d 255\n" % (WIDTH, HEIGHT) + bytes(pixels)


class Doctor(InScratch):
    def image(self, content, name="image.pnm"):
        return "images:" + self.write(name, content)

    def findings(self, source, code, *options):
        return json.loads(striper("doctor", source, "--json", *options, code=code).stdout)["findings"]

    def check(self, findings, severity, what, cure=""):
        for one in findings:
            if re.search(what, one["what"]):
                self.assertRegex(one["severity"], severity)
                self.assertIn(cure, one["cure"])
                return
        self.fail(f"nobody says '{what}': {findings}")

    def codes(self, findings):
        return {one["code"] for one in findings if one["code"]}

    def check_all_is_well(self, findings, what):
        self.check(findings, "good", what)
        self.assertEqual({one["severity"] for one in findings}, {"good"}, findings)


class Light(Doctor):
    def test_images_that_are_well(self):
        source = self.image(grey(20, stripe(150)))
        self.check_all_is_well(self.findings(source, 0), "a stripe in 100 % of the columns")

    def test_exposure_too_short(self):
        findings = self.findings(self.image(grey(3, stripe(0))), 1)
        self.check(findings, "bad", "images are dark", "exposure too short")
        findings = self.findings(self.image(grey(5, stripe(15))), 0)
        self.check(findings, "doubtful", "is faint: 6 %", "lengthen exposure_us")

    def test_exposure_too_long(self):
        findings = self.findings(self.image(grey(255, stripe(0))), 1)
        self.check(findings, "bad", "100 % of the pixels are saturated", "shorten exposure_us")

    def test_stripe_saturated(self):
        findings = self.findings(self.image(grey(20, stripe(400))), 0)
        self.check(findings, "doubtful", "stripe is saturated in 100 % of its columns", "shorten")

    def test_laser_off(self):
        findings = self.findings(self.image(grey(80, stripe(0))), 1)
        self.check(findings, "bad", "is it on, is it in view, which axis\\? The surroundings are at 80", "or laser= is wrong")
        self.assertIn("no_stripe", self.codes(findings))

    def test_out_of_focus(self):
        findings = self.findings(self.image(grey(20, stripe(150, sigma=6.0))), 0)
        self.check(findings, "doubtful", r"is 14\.\d pixels wide", "out of focus")

    def test_another_line_as_bright(self):
        both = lambda place: stripe(150, at=40.0)(place) + stripe(150, at=80.0)(place)
        findings = self.findings(self.image(grey(20, both)), 0)
        self.check(findings, "doubtful", "100 % of what was found is not plainly the stripe", "other bright lines")

    def test_for_people(self):
        done = striper("doctor", self.image(grey(80, stripe(0))), code=1)
        self.assertRegex(done.stdout, r"(?m)^bad +no laser stripe in these images.*\n +-> laser off or out of view")


class Colour(Doctor):
    def test_the_laser_is_found_in_its_colour(self):
        source = self.image(green_on_white(30, stripe(100), edges=50))
        findings = self.findings(source, 0)
        self.check(findings, "good", "channel green, ")
        self.check_all_is_well(findings, "a stripe in 100 % of the columns")

    def test_a_difference_is_named_where_it_alone_shows_the_laser(self):
        source = self.image(green_on_white(30, stripe(100)))
        findings = self.findings(source, 1)
        self.check(findings, "bad", "no laser stripe along columns in channel auto, but a stripe along columns in channel",
                   "say --channel green-red")
        self.assertIn("other_channel", self.codes(findings))
        self.check_all_is_well(self.findings(source, 0, "--channel", "green-red"), "a stripe in 100 % of the columns")

    def test_laser_off(self):
        findings = self.findings(self.image(green_on_white(30, stripe(0))), 1, "--channel", "green-red")
        self.check(findings, "bad", "no laser stripe in these images", "laser off")
        self.assertIn("no_stripe", self.codes(findings))

    def test_looked_for_in_the_wrong_channel(self):
        source = self.image(green_on_white(30, stripe(100)))
        findings = self.findings(source, 1, "--channel", "blue")
        self.check(findings, "bad", "no laser stripe along columns in channel blue, but a stripe along columns in channel",
                   "say --channel green-red")
        self.assertIn("other_channel", self.codes(findings))

    def test_saturated(self):
        source = self.image(b"P6 %d %d 255\n" % (WIDTH, HEIGHT) + b"\xff" * (3 * WIDTH * HEIGHT))
        self.check(self.findings(source, 1), "bad", "100 % of the pixels are saturated", "shorten")


class Axis(Doctor):
    def test_a_stripe_from_top_to_bottom(self):
        source = self.image(grey(20, stripe(150), along="rows"))
        findings = self.findings(source, 0, "--axis", "rows")
        self.check_all_is_well(findings, "a stripe in 100 % of the rows")
        # Along the columns there is none, and the cure names the other axis.
        findings = self.findings(source, 1)
        self.check(findings, "bad", "no laser stripe along columns in channel auto, but a stripe along rows in channel grey "
                   "is seen in 100 % of the rows", "say --axis rows, and in the model stripe: {axis: rows")
        self.assertIn("other_axis", self.codes(findings))

    def test_whose_columns_show_something_else(self):
        self.check(self.findings(CURB + "?frames=2", 1), "bad", "in 100 % of the rows", "say --axis rows")
        self.check_all_is_well(self.findings(CURB + "?frames=2", 0, "--axis", "rows"), "a stripe in 100 % of the rows")

    def test_a_post_is_not_the_stripe(self):
        def both(reach):
            return lambda row, column: (column < reach) * stripe(150)(row) + stripe(100, at=130.0)(column)

        findings = self.findings(self.image(crossed(both(WIDTH))), 0)
        self.check_all_is_well(findings, "a stripe in 100 % of the columns")
        # Where it is longer than the stripe, that is said, and so is what there is of the stripe.
        findings = self.findings(self.image(crossed(both(WIDTH // 2))), 0)
        self.check(findings, "good", "a stripe in 5. % of the columns")
        self.check(findings, "doubtful", "along the other axis", "if that is the stripe, say --axis rows")
        findings = self.findings(self.image(crossed(both(WIDTH // 2))), 0, "--peak", "all")
        self.check(findings, "good", "a stripe in 5. % of the columns")

    def test_the_axis_of_the_model(self):
        striper("simulate", WALL, "-o", self.path("wall"), "--frames", "1")
        with open(self.path("wall/model.yaml"), encoding="utf-8") as file:
            text = file.read()
        self.assertIn("axis: columns", text)
        with open(self.path("rows.yaml"), "w", encoding="utf-8") as file:
            file.write(text.replace("axis: columns", "axis: rows"))
        wall = "images:" + self.path("wall")
        findings = self.findings(wall, 0, "--model", self.path("wall/model.yaml"))
        self.check(findings, "good", r"a stripe in \d+ % of the columns")
        turned = self.findings(wall, 1, "--model", self.path("rows.yaml"))
        self.check(turned, "bad", "stripe axis rows; is it the other axis?")


class Fields(Doctor):
    """Interlaced frames with the laser in one field alone, in the sun."""

    @classmethod
    def setUpClass(cls):
        cls.interlaced = tempfile.TemporaryDirectory(prefix="striper-test-")
        striper("simulate", NTSC, "-o", cls.interlaced.name, "--frames", "4")
        os.remove(os.path.join(cls.interlaced.name, "frames.csv"))

    @classmethod
    def tearDownClass(cls):
        cls.interlaced.cleanup()

    def test_each_field_for_itself(self):
        source = f"images:{self.interlaced.name}?fields=split-bottom"
        findings = self.findings(source, 0)
        self.check(findings, "good", r"pattern .*dark.*, ambient fields")
        self.check(findings, "good", r"a stripe in (9\d|100) % of the columns")

    def test_interlaced_without_a_word(self):
        findings = self.findings(f"images:{self.interlaced.name}", None)
        self.check(findings, "doubtful", "look interlaced")

    def test_laser_that_the_address_gets_wrong(self):
        findings = self.findings(f"images:{self.interlaced.name}?fields=split-bottom&laser=dark,0", None)
        self.check(findings, "bad|doubtful", "no laser stripe|could be scanned|the images show")


class Numbers(Doctor):
    def test_gaps_are_named_and_not_blamed_on_a_cable(self):
        os.mkdir(self.path("shots"))
        for number in (0, 1, 2, 3, 5, 6, 7, 8, 9):
            self.image(grey(20, stripe(150)), f"shots/shot_{number:03}.pgm")
        findings = self.findings("images:" + self.path("shots"), 0)
        self.check(findings, "doubtful", "1 number missing between the frames", "pattern goes on")
        self.check(findings, "good", "a stripe in 100 % of the columns")

    def test_lit_frames_whose_dark_ones_are_missing(self):
        os.mkdir(self.path("shots"))
        for number in range(3):
            self.image(grey(20, stripe(150)), f"shots/{number}.pgm")
        with open(self.path("shots/frames.csv"), "w", encoding="utf-8") as file:
            file.write("file,sequence\n" + "".join(f"{n}.pgm,{2 * n}\n" for n in range(3)))
        findings = self.findings("images:" + self.path("shots") + "?laser=0,dark", 1)
        self.check(findings, "doubtful", "2 numbers missing between the frames", "pattern goes on")
        self.check(findings, "bad", "none of 3 frames could be scanned", "laser=")

    def test_damaged_frame(self):
        os.mkdir(self.path("shots"))
        for number in range(3):
            self.image(grey(20, stripe(150))[: None if number else 999], f"shots/{number}.pgm")
        findings = self.findings("images:" + self.path("shots"), 1)
        self.check(findings, "bad", "1 damaged frame", "damaged file")


class Model(Doctor):
    @classmethod
    def setUpClass(cls):
        cls.wall = tempfile.TemporaryDirectory(prefix="striper-test-")
        striper("simulate", WALL, "-o", cls.wall.name, "--frames", "1")

    @classmethod
    def tearDownClass(cls):
        cls.wall.cleanup()

    def model(self, change=lambda text: text):
        with open(os.path.join(self.wall.name, "model.yaml"), encoding="utf-8") as file:
            text = file.read()
        with open(self.path("model.yaml"), "w", encoding="utf-8") as file:
            file.write(change(text))
        return self.path("model.yaml")

    def test_that_fits(self):
        findings = self.findings("images:" + self.wall.name, 0, "--model", self.model())
        self.check_all_is_well(findings, r"a stripe in \d+ % of the columns")

    def test_dark_exposures_are_subtracted_from_the_lit_ones(self):
        findings = self.findings(f"sim:{WALL}?frames=4&laser=0,dark", 0, "--model", self.model())
        self.check(findings, "good", "pattern 0,dark .*, ambient alternate")
        self.check_all_is_well(findings, r"a stripe in \d+ % of the columns")

    def test_of_another_laser(self):
        def laser_above_the_camera(text):
            lines = [line for line in text.splitlines() if "homography" not in line and "T_cam_scan" not in line]
            text = "\n".join(lines)
            return re.sub(r"normal: \[([^,]+), ([^,]+), ([^\]]+)\]",
                          lambda m: f"normal: [{m[1]}, {-float(m[2])}, {m[3]}]", text)

        findings = self.findings("images:" + self.wall.name, 1, "--model", self.model(laser_above_the_camera))
        self.check(findings, "bad", "100 % of the stripe is where the model's laser plane", "calibrate")

    def test_of_another_camera(self):
        source = self.image(grey(20, stripe(150)))
        findings = self.findings(source, 1, "--model", self.model())
        self.check(findings, "bad", "is of a camera of 640x480 pixels")


if __name__ == "__main__":
    unittest.main()
