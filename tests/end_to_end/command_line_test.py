# SPDX-License-Identifier: Apache-2.0
"""Proves what the striper program promises to the shell: exit codes, messages, whole lines in the CSV
whatever happens, help that teaches. The images are made here by hand, so that nothing but the
program is needed. Does not prove that the ranges are right: the library's own tests do.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 command_line_test.py
"""
import base64
import csv
import io
import json
import math
import os
import random
import resource
import shutil
import signal
import subprocess
import time
import unittest

from program import SOURCE_DIR, STRIPER, InScratch, striper

COLUMNS = (
    "frame,time_s,laser,u_px,v_px,bearing_rad,range_m,range_near_m,range_far_m,sigma_m,sigma_cal_m,"
    "x_m,y_m,intensity,width_px,row_sigma_px,confidence,status"
).split(",")
WIDTH, HEIGHT, STRIPE_ROW = 64, 48, 30.25

# A camera with the laser 0.5 m below it, the plane level: y = 0.5 in the camera frame.
MODEL = """striper_model: 1
camera:
  image_width: 64
  image_height: 48
  camera_matrix: {rows: 3, cols: 3, data: [60, 0, 31.5, 0, 60, 23.5, 0, 0, 1]}
  distortion_model: plumb_bob
  distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
lasers:
  - normal: [0, 1, 0]
    distance_m: 0.5
stripe: {axis: columns, channel: grey}
"""

# The same kind of image (64x48, stripe in row 30) as a JPEG.
JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAoHBwgHBgoICAgLCgoLDhgQDg0NDh0VFhEYIx8lJCIfIiEmKzcvJik0KSEi"
    "MEExNDk7Pj4+JS5ESUM8SDc9Pjv/wAALCAAwAEABAREA/8QAHwAAAQUBAQEBAQEAAAAAAAAAAAECAwQFBgcICQoL/8QA"
    "tRAAAgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS0fAkM2JyggkKFhcYGRolJicoKSo0"
    "NTY3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKjpKWmp6ipqrKztLW2"
    "t7i5usLDxMXGx8jJytLT1NXW19jZ2uHi4+Tl5ufo6erx8vP09fb3+Pn6/9oACAEBAAA/APIaKKKKKKKKKKKKKKKKKKKK"
    "KKK6/wD4Vvqn/P7p/wD4ErR/wrfVP+f3T/8AwJWj/hW+qf8AP7p//gStH/Ct9U/5/dP/APAlaP8AhW+qf8/un/8AgStH"
    "/Ct9U/5/dP8A/AlaP+Fb6p/z+6f/AOBK0f8ACt9U/wCf3T//AAJWuS86X/no350edL/z0b86POl/56N+dHnS/wDPRvzo"
    "86X/AJ6N+dHnS/8APRvzo86X/no350edL/z0b86bRRRRRRRX/9k="
)


def pgm(row=STRIPE_ROW, width=WIDTH, height=HEIGHT):
    """A grey image with a Gaussian stripe across it."""
    profile = [10 + 200 * math.exp(-0.5 * ((v - row) / 0.8) ** 2) for v in range(height)]
    pixels = b"".join(bytes([round(value)]) * width for value in profile)
    return b"P5 %d %d 255\n" % (width, height) + pixels


def limit_file_size(count):
    """For preexec_fn: no file may grow beyond `count` bytes, which stands for a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (count, count))


class EndToEnd(InScratch):
    def setUp(self):
        super().setUp()
        self.shots = self.path("shots")
        for number in (1, 2, 3, 10):
            self.write(f"shots/shot{number}.pgm", pgm())
        self.model = self.write("striper.yaml", MODEL)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def capture(self, *arguments, **options):
        return striper("capture", *arguments, **options)

    def rows(self, text):
        """The lines of a CSV; fails where one is not whole."""
        self.assertTrue(text.endswith("\n"), f"cut off: {text[-200:]!r}")
        rows = list(csv.DictReader(io.StringIO(text)))
        self.assertEqual(text.split("\n", 1)[0], ",".join(COLUMNS))
        for row in rows:
            self.assertEqual(len(row), len(COLUMNS), row)
            self.assertNotIn(None, row, "more fields than the header")
            self.assertNotIn(None, row.values(), "fewer fields than the header")
            self.assertTrue(row["status"], "the last field is missing")
        return rows

    def long_recording(self, frames=100000):
        """A recording that lasts: every line of its table is the same image."""
        os.mkdir(self.path("long"))
        self.write("long/0.pgm", pgm())
        self.write("long/frames.csv", b"file\n" + b"0.pgm\n" * frames)
        return "images:" + self.path("long")


class Help(EndToEnd):
    def test_every_command_teaches(self):
        overview = striper("--help").stdout
        for command in ("capture", "record", "simulate"):
            with self.subTest(command=command):
                self.assertIn(f"  {command} ", overview)
                done = striper(command, "--help")
                self.assertEqual(done.stderr, "")
                self.assertIn("Examples:", done.stdout)
                self.assertIn(f"  striper {command} ", done.stdout.split("Examples:")[1])

    def test_lines_fit_a_terminal(self):
        for arguments in (["--help"], ["capture", "--help"], ["record", "--help"]):
            for line in striper(*arguments).stdout.splitlines():
                self.assertLessEqual(len(line), 100, line)

    def test_version(self):
        self.assertRegex(striper("--version").stdout, r"^striper \d+\.\d+\.\d+\n$")

    def test_nothing_asked_for_is_wrong_usage(self):
        self.assertIn("See striper --help", striper(code=2).stderr)


class WrongUsage(EndToEnd):
    def check(self, expected, *arguments):
        done = striper(*arguments, code=2)
        self.assertIn(expected, done.stderr)
        self.assertEqual(done.stdout, "")

    def test_command_that_does_not_exist(self):
        self.check("no command 'captur'; there are capture, serve, record", "captur", self.shots)

    def test_option_that_does_not_exist(self):
        self.check("--speed", "capture", self.shots, "--speed", "3")

    def test_no_source(self):
        self.check("SOURCE is required", "capture")

    def test_verify_without_a_model(self):
        self.check("--model is required", "verify", self.shots)

    def test_words_are_listed(self):
        self.check("'best' is none of paper, fast, refined", "capture", self.shots, "--method", "best")
        self.check("'u' is none of columns, rows", "capture", self.shots, "--axis", "u")
        self.check("'sun' is none of auto, none", "capture", self.shots, "--ambient", "sun")

    def test_numbers_have_bounds(self):
        self.check("--frames: '0' is no number above 0", "capture", self.shots, "--frames", "0")
        self.check("--frames: 'many' is no number", "capture", self.shots, "--frames", "many")
        self.check("--seconds: '-1' is no number above 0", "capture", self.shots, "--seconds", "-1")
        self.check("--seconds: 'inf' is no number above", "capture", self.shots, "--seconds", "inf")
        self.check("threshold", "capture", self.shots, "--threshold", "-3")
        self.check("--width: '0' is no number above 0", "capture", self.shots, "--width", "0")
        for value in ("-0.1", "1.01", "nan", "sure"):
            done = striper("capture", self.shots, f"--min-confidence={value}", code=2)
            self.assertIn(f"--min-confidence: '{value}' is no probability, 0 to 1", done.stderr)
        for option, value in (("--min-fill", "nan"), ("--min-fill", "7"), ("--max-ratio", "-3")):
            self.check(option, "verify", self.shots, "-m", self.model, option, value)
        self.check("--black nan: expected a level", "noise", self.shots, "--black", "nan")
        self.check("--frames = 1e3: expected a number, whole", "capture", self.shots, "--frames", "1e3")

    def test_threshold_that_no_pixel_can_reach(self):
        self.check("have 8 bits and end at 255 DN", "capture", self.shots, "--threshold", "255")
        striper("capture", self.shots, "--threshold", "60")

    def test_colour_of_grey_frames_is_said(self):
        done = striper("capture", self.shots, "--channel", "red")
        self.assertIn("--channel red: the frames of '", done.stderr)
        self.assertNotIn("--channel", striper("capture", self.shots, "--channel", "grey").stderr)

    def test_output_that_holds_something_else(self):
        for name, keep in (("striper.yaml", MODEL.encode()), ("shots/shot1.pgm", pgm())):
            self.check("is there and holds no scans", "capture", self.shots, "-m", self.model, "-o", self.path(name))
            self.assertEqual(keep, self.read(name))
        self.write("scans.csv", "")
        for _ in range(2):  # An empty file, and one with scans.
            self.capture(self.shots, "-o", self.path("scans.csv"))
        self.check("--json needs -o FILE", "capture", self.shots, "--json", "-o", "/dev/stdout")

    def test_empty_words(self):
        self.check("striper capture: --output is empty", "capture", self.shots, "-o", "")
        self.check("striper record: SOURCE is empty", "record", "", "-o", self.path("rec"))

    def test_what_a_file_holds_does_not_command_the_terminal(self):
        model = self.write("bell.yaml", MODEL.replace("axis: columns", 'axis: "\\e[2Jcol\\a"'))
        done = self.capture(self.shots, "-m", model, code=1)
        self.assertIn("\\x1b[2Jcol\\x07", done.stderr)
        self.assertNotIn("\x1b", done.stderr)

    def test_options_that_contradict_each_other(self):
        self.check(
            "--peak continuous is for --method fast or refined", "capture", self.shots, "--method", "paper",
            "--peak", "continuous",
        )
        self.capture(self.shots, "--method", "paper", "--peak", "brightest")
        for option, value in (("--width", "1.2"), ("--min-confidence", "0.5")):
            self.check(
                f"{option} is for --method fast or refined", "capture", self.shots, "--method", "paper", option, value
            )
        self.check("--max-range needs --model", "capture", self.shots, "--max-range", "3")
        self.capture(self.shots, "--model", self.model, "--max-range", "3")

    def test_address_with_a_misspelt_key(self):
        self.check("unknown key 'fsp'; images: knows fps", "capture", self.shots + "?fsp=3")

    def test_address_of_unknown_kind(self):
        self.check("unknown kind 'film'", "capture", "film:x")

    def test_laser_that_the_model_lacks(self):
        self.check(
            "fires laser 1, but the model has 1 laser", "capture", self.shots + "?laser=0,1",
            "--model", self.model,
        )

    def test_axis_along_which_the_plane_cannot_be_seen(self):
        self.check(
            "is it the other axis?", "capture", self.shots, "--model", self.model, "--axis", "rows"
        )

    def test_json_needs_a_file(self):
        self.check("--json needs -o FILE", "capture", self.shots, "--json")


class BadInput(EndToEnd):
    def test_no_such_source(self):
        done = self.capture(self.path("nowhere"), code=1)
        self.assertIn("nowhere': no such file or directory", done.stderr)
        self.assertEqual(done.stdout, "")

    def test_empty_directory(self):
        os.mkdir(self.path("empty"))
        self.assertIn("holds no image files", self.capture(self.path("empty"), code=1).stderr)

    def test_pattern_without_a_match(self):
        done = self.capture(self.path("*.png"), code=1)
        self.assertIn("no file matches the pattern", done.stderr)

    def test_missing_model_leaves_the_output_alone(self):
        precious = (",".join(COLUMNS) + "\nof last year\n").encode()
        output = self.write("scans.csv", precious)
        done = self.capture(self.shots, "-m", self.path("none.yaml"), "-o", output, code=1)
        self.assertIn("none.yaml", done.stderr)
        self.assertEqual(self.read("scans.csv"), precious)

    def test_not_a_number_in_the_model(self):
        self.write("striper.yaml", MODEL.replace("distance_m: 0.5", "distance_m: .nan"))
        done = self.capture(self.shots, "-m", self.model, code=1)
        self.assertIn("striper.yaml", done.stderr)
        self.assertIn("distance_m", done.stderr)
        self.assertIn("nan", done.stderr.lower())

    def test_model_without_a_laser(self):
        text = MODEL.replace("""lasers:
  - normal: [0, 1, 0]
    distance_m: 0.5
""", "lasers: []\n")
        self.write("striper.yaml", text)
        self.assertIn("lasers", self.capture(self.shots, "-m", self.model, code=1).stderr)

    def test_plane_behind_the_camera(self):
        self.write("striper.yaml", MODEL.replace("distance_m: 0.5", "distance_m: -0.5"))
        done = self.capture(self.shots, "-m", self.model)
        self.assertRegex(
            done.stderr, "no_stripe: a stripe along columns .* 100 % .*: where the model has none: is it this striper's"
        )

    def test_model_of_another_camera(self):
        self.write("striper.yaml", MODEL.replace("image_width: 64", "image_width: 65"))
        done = self.capture(self.shots, "-m", self.model, code=1)
        self.assertIn("65x48", done.stderr)
        self.assertIn("64x48", done.stderr)

    def test_one_row_is_not_two_fields(self):
        self.write("row.pgm", pgm(height=1))
        done = self.capture(self.path("row.pgm") + "?fields=split-top", code=1)
        self.assertIn("frame 0: one row is not two fields", done.stderr)
        self.assertIn("refused 1 frame", done.stderr)

    def check_one_bad_frame(self, reason, **options):
        done = self.capture(self.shots, "-m", self.model, code=1, **options)
        self.assertIn(reason, done.stderr)
        self.assertEqual({row["frame"] for row in self.rows(done.stdout)}, {"0", "2", "3"})
        return done

    def test_truncated_frame_is_named_and_the_rest_is_scanned(self):
        self.write("shots/shot2.pgm", pgm()[:-100])
        done = self.check_one_bad_frame("shot2.pgm' is a truncated PGM")
        self.assertIn("1 corrupt", done.stderr)

    def test_truncated_jpeg_is_never_scanned(self):
        for length in range(0, len(JPEG), 7):
            self.write("cut.jpg", JPEG[:length])
            done = self.capture(self.path("cut.jpg"), code=1)
            self.assertIn("cut.jpg' is ", done.stderr)
            self.assertEqual(self.rows(done.stdout), [], f"{length} of {len(JPEG)} bytes")
        self.write("whole.jpg", JPEG)
        self.assertEqual(len(self.rows(self.capture(self.path("whole.jpg")).stdout)), WIDTH)

    def test_frame_of_another_size_is_named_and_the_rest_is_scanned(self):
        self.write("shots/shot2.pgm", pgm(width=32))
        done = self.check_one_bad_frame("shot2.pgm' is 32x48 grey")
        self.assertIn("1 of wrong size", done.stderr)

    def test_many_bad_frames_do_not_flood_the_terminal(self):
        for number in range(11, 60):
            self.write(f"shots/shot{number}.pgm", b"P5")
        done = self.capture(self.shots, code=1)
        self.assertIn("49 corrupt", done.stderr)
        self.assertLess(len(done.stderr.splitlines()), 20)


class Scans(EndToEnd):
    def test_without_a_model_only_what_the_image_gives(self):
        rows = self.rows(self.capture(self.shots + "?fps=4").stdout)
        self.assertEqual(len(rows), 4 * WIDTH)
        self.assertEqual([row["u_px"] for row in rows[:WIDTH]], [str(u) for u in range(WIDTH)])
        for row in rows:
            self.assertAlmostEqual(float(row["v_px"]), STRIPE_ROW, delta=0.15)
            self.assertEqual(row["range_m"] + row["bearing_rad"] + row["x_m"] + row["sigma_m"], "")
            self.assertEqual(row["status"], "ok")
        self.assertEqual(rows[-1]["frame"], "3")
        self.assertEqual(float(rows[-1]["time_s"]), 0.75)

    def test_with_a_model_the_range_is_within_its_bar(self):
        rows = self.rows(self.capture(self.shots, "-m", self.model, "--frames", "1").stdout)
        self.assertEqual(len(rows), WIDTH)
        depth_m = 0.5 * 60 / (STRIPE_ROW - 23.5)
        for row in rows:
            near, range_m, far = (float(row[f"range{what}_m"]) for what in ("_near", "", "_far"))
            self.assertLess(near, range_m)
            self.assertLess(range_m, far)
            true_m = math.hypot(depth_m, (float(row["u_px"]) - 31.5) / 60 * depth_m)
            self.assertLess(near, true_m)
            self.assertLess(true_m, far)

    def test_dark_exposures_are_talked_of_where_they_matter(self):
        def decided(*arguments):
            text = self.capture(*arguments).stderr
            self.assertNotIn("warning", text)
            return [line.removeprefix("decided: ") for line in text.splitlines() if line.startswith("decided: ")]

        self.assertEqual(decided(self.shots), ["channel grey"], "a laser that is always on")
        self.assertEqual(decided(self.shots + "?laser=0"), ["channel grey"])
        every = ["channel grey", "pattern 0 (given)", "ambient none"]
        self.assertEqual(decided(self.shots + "?laser=0", "--ambient", "none"), every)
        self.write("blank.pgm", pgm(row=1000))
        self.assertIn("ambient none", decided(self.path("blank.pgm")), "little is found: daylight may be why")

    def test_rate_that_is_not_reached_is_said(self):
        scene = os.path.join(SOURCE_DIR, "data/scenes/room.yaml")
        done = self.capture(f"sim:{scene}?fps=100000&realtime=yes&frames=150", "-o", self.path("scans.csv"))
        self.assertRegex(
            done.stderr, r"warning: fps=100000 was asked for, and [\d.]+ frames came in a second: this machine is too slow"
        )
        for query in ("fps=1000&frames=40", "fps=2&realtime=yes&frames=4"):
            done = self.capture(f"sim:{scene}?{query}", "-o", self.path("scans.csv"))
            self.assertNotIn("was asked for", done.stderr)

    def test_frames_and_seconds_limit_what_is_read(self):
        frames = {row["frame"] for row in self.rows(self.capture(self.shots, "--frames", "2").stdout)}
        self.assertEqual(frames, {"0", "1"})
        done = self.capture(self.shots + "?fps=2", "--seconds", "1.5")
        self.assertEqual({row["frame"] for row in self.rows(done.stdout)}, {"0", "1", "2"})

    def test_missing_writes_a_line_for_every_column(self):
        blank = b"P5 64 48 255\n" + bytes([10]) * (64 * 48)
        self.write("blank.pgm", blank)
        self.assertEqual(self.rows(self.capture(self.path("blank.pgm")).stdout), [])
        rows = self.rows(self.capture(self.path("blank.pgm"), "--missing").stdout)
        self.assertEqual(len(rows), WIDTH)
        self.assertEqual({row["status"] for row in rows}, {"no_stripe"})
        self.assertEqual({row["v_px"] for row in rows}, {""})

    def test_wrong_laser_is_told_of_eight_frames(self):
        blank = pgm(row=1000)
        os.mkdir(self.path("walk"))
        os.mkdir(self.path("off"))
        for number in range(8):
            self.write(f"walk/{number}.pgm", blank if number % 2 else pgm())
            self.write(f"off/{number}.pgm", blank)
        def said(source):
            text = self.capture(self.path(source)).stderr
            for line in text.splitlines():
                self.assertEqual(text.count(line.removeprefix("warning: ")), 1, "said once")
            return text

        self.assertNotIn("was given", said("walk?laser=0,dark"))
        for laser in ("0", "dark,0"):
            shown = f"the pattern '{laser}' was given, but the images show '0,dark'"
            self.assertIn(shown, said(f"walk?laser={laser}"))
        self.assertIn("'0,dark' was given, but nothing in the images tells", said("off?laser=0,dark"))
        self.assertNotIn("was given", said("off?laser=0"))

    def test_axis_rows_gives_a_return_per_row(self):
        rows = self.rows(self.capture(self.path("shots/shot1.pgm"), "--axis", "rows", "--missing").stdout)
        self.assertEqual([row["v_px"] for row in rows], [str(v) for v in range(HEIGHT)])

    def test_summary_for_programs(self):
        done = self.capture(self.shots, "-m", self.model, "-o", self.path("scans.csv"), "--json")
        summary = json.loads(done.stdout)
        self.assertEqual(summary["pictures"], 4)
        self.assertEqual(summary["scans"], 4)
        self.assertEqual(summary["lines"], 4 * WIDTH)
        self.assertEqual(summary["returns"]["ok"], 4 * WIDTH)
        self.assertEqual(summary["corrupt"], 0)
        self.assertIn("ambient none", summary["decisions"])
        self.assertEqual(len(self.rows(self.read("scans.csv").decode())), 4 * WIDTH)

    def test_nothing_but_data_on_the_standard_output(self):
        done = self.capture(self.shots)
        self.rows(done.stdout)
        self.assertIn("read 4 frames", done.stderr)
        self.assertNotIn("\r", done.stderr, "no progress line where there is no terminal")


class NoStripe(EndToEnd):
    """That there is no stripe is said, with what was tried and where one is instead. The images without one are
    of plain noise: of textures see the images with the laser off in doctor_test.py."""

    def image(self, name, stripe, along="columns", background=20, colours=0):
        """Noise, with a stripe if told; of colour images it is in plane `colours` - 1 of R, G, B."""
        noise = random.Random(name)
        pixels = bytearray()
        for v in range(HEIGHT):
            for u in range(WIDTH):
                light = stripe * math.exp(-0.5 * (((v if along == "columns" else u) - STRIPE_ROW) / 0.8) ** 2)
                for plane in range(3 if colours else 1):
                    dn = background + noise.gauss(0, 1.5) + (light if plane == max(colours - 1, 0) else 0)
                    pixels.append(min(max(round(dn), 0), 255))
        return self.write(name, b"P%d %d %d 255\n" % (6 if colours else 5, WIDTH, HEIGHT) + bytes(pixels))

    def images(self, count, stripe, **how):
        for number in range(count):
            self.image(f"walk/{number}.pnm", stripe, **how)
        return self.path("walk")

    def said(self, source, *arguments, code=0):
        done = self.capture(source, "-o", self.path("scans.csv"), "--json", *arguments, code=code)
        lines = [line for line in done.stderr.splitlines() if line.startswith("no_stripe: ")]
        return json.loads(done.stdout), lines, done.stderr

    def test_where_it_is_looked_for_and_who_said_so(self):
        _, _, text = self.said(self.shots)
        self.assertIn("looking for the stripe along columns (the default), channel auto (the default)\n", text)
        _, _, text = self.said(self.shots, "-m", self.model, "--channel", "red")
        self.assertIn("along columns (as the model says), channel red (as you asked)\n", text)
        done = striper("verify", self.shots, "-m", self.model, code=None)
        self.assertIn("along columns (as the model says), channel grey (as the model says)\n", done.stderr)

    def test_stripe_that_is_seen_is_no_event(self):
        summary, lines, _ = self.said(self.shots)
        self.assertEqual((summary["without_stripe"], summary["stripe_elsewhere"], lines), (0, None, []))

    def test_laser_off(self):
        summary, lines, _ = self.said(self.images(5, 0) + "?laser=0", "--axis", "rows")
        self.assertEqual((summary["without_stripe"], summary["stripe_elsewhere"]), (5, None))
        self.assertEqual(lines, [
            "no_stripe: no laser's stripe in the first 3 scans, looked for along rows (as you asked), channel auto "
            "(the default): is the laser on, and in view?",
            "no_stripe: nor along the other axis, nor in any other channel",
            "no_stripe: in 5 of 5 scans (100 %) no stripe was seen",
        ])

    def test_one_image_is_enough(self):
        _, lines, _ = self.said(self.images(1, 0))
        self.assertIn("no_stripe: no laser's stripe in the first 1 scan, looked for along columns", lines[0])

    def test_laser_that_goes_off(self):
        source = self.images(4, 150)
        for number in (1, 3):
            self.image(f"walk/{number}.pnm", 0)
        summary, lines, _ = self.said(source + "?laser=0")
        self.assertEqual(summary["without_stripe"], 2)
        self.assertEqual(lines, ["no_stripe: in 2 of 4 scans (50 %) no stripe was seen"])

    def test_stripe_along_the_other_axis(self):
        source = self.images(4, 150, along="rows")
        summary, lines, _ = self.said(source)
        self.assertEqual(summary["stripe_elsewhere"]["axis"], "rows")
        self.assertRegex(lines[1], r"a stripe along rows in channel grey is seen in \d+ % of the rows: --axis rows$")
        self.assertEqual(self.said(source, "--axis", "rows")[1], [])

    def test_stripe_in_another_channel(self):
        source = self.images(4, 150, along="rows", colours=1)
        summary, lines, _ = self.said(source, "--channel", "blue")
        self.assertEqual(summary["stripe_elsewhere"]["axis"], "rows")
        self.assertEqual(summary["stripe_elsewhere"]["channel"], "red")
        self.assertIn("rows: --axis rows --channel red", lines[1])
        self.assertEqual(self.said(source, "--axis", "rows", "--channel", "red")[1], [])

    def test_verify_says_it_too(self):
        done = striper("verify", self.images(4, 0) + "?laser=0", "-m", self.model, code=1)
        self.assertIn("no_stripe: no laser's stripe in the first 3 scans", done.stderr)

    def test_confidence_that_is_asked_for(self):
        every = self.said(self.shots, "--min-confidence", "0")[0]["returns"]
        none = self.said(self.shots, "--min-confidence", "1")[0]["returns"]
        self.assertEqual(every["ok"], 4 * WIDTH)
        self.assertGreaterEqual(every["ok"], none["ok"])

    def test_width_that_is_told(self):
        done = self.capture(self.shots, "--width", "0.8")
        self.assertEqual(len(self.rows(done.stdout)), 4 * WIDTH)
        wrong = self.said(self.shots, "--width", "5")[0]["returns"]
        self.assertLess(wrong["ok"], 4 * WIDTH, "the stripe is far narrower than that")


class Output(EndToEnd):
    def test_full_device(self):
        done = self.capture(self.shots, "-o", "/dev/full", code=1)
        self.assertIn("/dev/full': No space left on device", done.stderr)

    def test_full_device_as_the_standard_output(self):
        with open("/dev/full", "wb") as full:
            done = subprocess.run(
                [STRIPER, "capture", self.shots],
                stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
            )
        self.assertEqual(done.returncode, 1)
        self.assertIn("No space left on device", done.stderr)

    def test_full_device_is_told_of_by_every_command(self):
        for arguments in (["capture", "--help"], ["--version"], ["bench", "--quick", "--size", "64x64"]):
            with self.subTest(arguments=arguments), open("/dev/full", "wb") as full:
                done = subprocess.run(
                    [STRIPER, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False
                )
                self.assertEqual(done.returncode, 1)
                self.assertIn("cannot write to the standard output: No space left on device", done.stderr)

    def test_messages_never_go_into_a_file_where_standard_streams_are_closed(self):
        self.shell(f"'{STRIPER}' capture '{self.shots}' -o scans.csv 2>&-")
        self.rows(self.read("scans.csv").decode())
        done = self.shell(f"'{STRIPER}' record '{self.shots}' -o rec --json >&-", code=1)
        self.assertIn("cannot write the summary to the standard output: Bad file descriptor", done.stderr)
        self.assertEqual(self.read("rec/frames.csv").count(b"\n"), 1 + 4)

    def shell(self, line, code=0):
        done = subprocess.run(
            ["sh", "-c", line], cwd=self.path("."), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            timeout=60, check=False,
        )
        if code is not None:
            self.assertEqual(done.returncode, code, done.stderr)
        return done

    def test_disk_that_fills_up_keeps_whole_lines(self):
        for limit in (50, 3000, 12345):
            with self.subTest(limit=limit):
                output = self.path(f"scans{limit}.csv")
                done = self.capture(
                    self.shots, "-o", output, code=1, preexec_fn=limit_file_size(limit)
                )
                self.assertIn("File too large", done.stderr)
                text = self.read(output).decode()
                if text:  # Not even the header went in with the smallest limit.
                    self.rows(text)
                    self.assertGreater(len(text), limit - 500, "as much as fits was kept")

    def test_small_tmpfs(self):
        mount = self.path("small")
        os.mkdir(mount)
        command = ["mount", "-t", "tmpfs", "-o", "size=16k", "striper-test", mount]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            self.skipTest("mounting a tmpfs is not permitted here")
        try:
            output = os.path.join(mount, "scans.csv")
            done = self.capture(self.shots, "-o", output, code=1)
            self.assertIn("No space left on device", done.stderr)
            self.rows(self.read(output).decode())
        finally:
            subprocess.run(["umount", mount], check=True)

    def test_disk_that_fills_up_under_a_redirection_keeps_what_was_there(self):
        output = self.write("log.csv", b"earlier line\n")
        with open(output, "ab") as file:
            done = subprocess.run(
                [STRIPER, "capture", self.shots],
                stdout=file, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
                preexec_fn=limit_file_size(3000),
            )
        self.assertEqual(done.returncode, 1)
        text = self.read("log.csv").decode()
        self.assertTrue(text.startswith("earlier line\n"), text[:100])
        self.rows(text.split("\n", 1)[1])

    def test_pipe_that_closes(self):
        program = subprocess.Popen(
            [STRIPER, "capture", self.long_recording()],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )
        self.assertTrue(program.stdout.readline().startswith(b"frame,time_s"))
        program.stdout.close()
        message = program.stderr.read().decode()
        program.stderr.close()
        self.assertEqual(program.wait(timeout=60), -signal.SIGPIPE, "as other programs end")
        self.assertNotIn("pipe", message.lower())
        self.assertNotIn("striper capture:", message)

    def test_reader_that_goes_away_is_nothing_to_talk_about(self):
        for arguments in (["capture", self.shots], ["--help"], ["capture", "--help"]):
            with self.subTest(arguments=arguments):
                words = " ".join(f"'{word}'" for word in [STRIPER, *arguments])
                done = self.shell(f"{{ {words}; echo $? >&2; }} | head -n 0", code=None)
                self.assertNotIn("pipe", done.stderr.lower())
                self.assertIn(done.stderr.splitlines()[-1], ("141", "0"), "killed by SIGPIPE, or done before")

    def test_reader_that_goes_away_is_an_error_where_sigpipe_is_ignored(self):
        program = subprocess.Popen(
            [STRIPER, "capture", self.long_recording()],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            restore_signals=False, preexec_fn=lambda: signal.signal(signal.SIGPIPE, signal.SIG_IGN),
        )
        program.stdout.readline()
        program.stdout.close()
        message = program.stderr.read().decode()
        program.stderr.close()
        self.assertEqual(program.wait(timeout=60), 1, message)
        self.assertIn("cannot write 'standard output': Broken pipe", message)

    def test_pipe_that_is_closed_from_the_start(self):
        reading, writing = os.pipe()
        os.close(reading)
        with os.fdopen(writing, "wb") as pipe:
            done = subprocess.run(
                [STRIPER, "capture", self.shots],
                stdout=pipe, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
            )
        self.assertEqual(done.returncode, -signal.SIGPIPE)
        self.assertNotIn("pipe", done.stderr.lower())

    @unittest.skipIf(os.geteuid() == 0 and not shutil.which("setpriv"), "root may enter every directory")
    def test_directory_that_may_not_be_entered(self):
        os.chmod(self.path("."), 0o755)
        os.mkdir(self.path("closed"), 0o700 if os.geteuid() == 0 else 0o000)
        program = self.path("striper")
        shutil.copy(STRIPER, program)
        nobody = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"] if os.geteuid() == 0 else []
        for expected, arguments in (
            ("closed: Permission denied", ["record", self.shots, "-o", "closed"]),
            ("closed/x.yaml: cannot be read: Permission denied", ["capture", self.shots, "-m", "closed/x.yaml"]),
            ("closed/x.yaml: cannot be read: Permission denied", ["capture", "sim:closed/x.yaml"]),
        ):
            with self.subTest(arguments=arguments):
                done = subprocess.run(
                    [*nobody, program, *arguments], cwd=self.path("."), stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE, text=True, timeout=60, check=False,
                )
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn(expected, done.stderr.replace("'", ""))

    def test_output_that_cannot_be_opened(self):
        done = self.capture(self.shots, "-o", self.path("none/scans.csv"), code=1)
        self.assertIn("none/scans.csv': No such file or directory", done.stderr)

    def test_interrupt_ends_cleanly_with_whole_lines(self):
        for signal_number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(signal=signal_number):
                output = self.path(f"scans{int(signal_number)}.csv")
                source = self.path("long")
                if not os.path.exists(source):
                    self.long_recording()
                program = subprocess.Popen(
                    [STRIPER, "capture", source, "-o", output], stderr=subprocess.PIPE, text=True
                )
                self.wait_until_it_writes(output)
                program.send_signal(signal_number)
                _, message = program.communicate(timeout=10)
                self.assertEqual(program.returncode, 0, message)
                self.assertIn("interrupted", message)
                rows = self.rows(self.read(output).decode())
                self.assertEqual(len(rows) % WIDTH, 0, "whole scans")
                self.assertGreater(len(rows), 0)

    def wait_until_it_writes(self, path, size=10000):
        deadline = time.monotonic() + 20
        while not os.path.exists(path) or os.path.getsize(path) < size:
            self.assertLess(time.monotonic(), deadline, "nothing was written")
            time.sleep(0.01)


class Record(EndToEnd):
    def test_recording_replays_to_the_same_scans(self):
        expected = self.capture(self.shots + "?fps=7", "-m", self.model, "--missing").stdout
        striper("record", self.shots + "?fps=7", "-o", self.path("rec"))
        again = self.capture(self.path("rec"), "-m", self.model, "--missing").stdout
        self.assertEqual(again, expected)

    def test_the_command_that_replays_can_be_pasted(self):
        done = striper("record", self.shots, "-o", self.path("it's a run"))
        hint = done.stderr.split("replay: striper ")[1].strip()
        again = subprocess.run(
            f"'{STRIPER}' {hint}", shell=True, stdout=subprocess.PIPE, text=True, timeout=60, check=True
        )
        self.assertEqual(len(self.rows(again.stdout)), 4 * WIDTH)

    def test_bad_frames_are_recorded_as_such(self):
        self.write("shots/shot2.pgm", pgm()[:-1])
        done = striper("record", self.shots, "-o", self.path("rec"), "--json", code=1)
        self.assertEqual(json.loads(done.stdout)["recorded"], 4)
        self.assertEqual(json.loads(done.stdout)["corrupt"], 1)
        done = self.capture(self.path("rec"), code=1)
        self.assertIn("shot2.pgm' is a truncated PGM", done.stderr)

    def test_a_file_keeps_bad_frames_too(self):
        self.write("shots/shot2.pgm", pgm()[:-1])
        expected = self.capture(self.shots, "--missing", code=1).stdout
        striper("record", self.shots, "-o", self.path("rec.mcap"), code=1)
        done = self.capture(self.path("rec.mcap"), "--missing", code=1)
        self.assertEqual(done.stdout, expected)
        self.assertIn("shot2.pgm' is a truncated PGM", done.stderr)

    def test_every_keeps_frames_that_far_apart(self):
        striper("record", self.shots + "?fps=10", "-o", self.path("rec"), "--every", "0.2")
        table = csv.DictReader(io.StringIO(self.read("rec/frames.csv").decode()))
        self.assertEqual([row["sequence"] for row in table], ["0", "2"])

    def test_never_into_a_directory_with_images(self):
        done = striper("record", self.shots, "-o", self.shots, code=2)
        self.assertIn("already holds a recording or image files", done.stderr)

    def test_full_disk_keeps_what_was_recorded(self):
        source = self.long_recording(1000)
        done = striper(
            "record", source, "-o", self.path("rec"), code=1, preexec_fn=limit_file_size(5000)
        )
        self.assertIn("frames.csv': File too large", done.stderr)
        summary = json.loads(
            self.capture(self.path("rec"), "-o", self.path("scans.csv"), "--json").stdout
        )
        self.assertGreater(summary["pictures"], 20)

    def test_interrupt_keeps_what_was_recorded(self):
        program = subprocess.Popen(
            [STRIPER, "record", self.long_recording(), "-o", self.path("rec")],
            stderr=subprocess.PIPE, text=True,
        )
        deadline = time.monotonic() + 20
        while not os.path.exists(self.path("rec/00000010.png")):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)
        program.send_signal(signal.SIGINT)
        _, message = program.communicate(timeout=10)
        self.assertEqual(program.returncode, 0, message)
        table = self.read("rec/frames.csv").decode()
        self.assertTrue(table.endswith("\n"))
        for row in csv.DictReader(io.StringIO(table)):
            self.assertTrue(os.path.exists(self.path("rec", row["file"])), row)
        self.capture(self.path("rec"))


if __name__ == "__main__":
    unittest.main()
