# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper eyesafe` and `striper design` promise on the command line: JSON with the agreed members, the
paper's figures, exit code 2 with option, value and bound for what is out of bounds. The
limits themselves are proved by eye_safety_tests, the figures of a design by design_tests.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 design_test.py
"""
import json
import unittest

from program import InScratch, scene_path, striper

FAN = ("--wavelength", 900, "--energy", 10.43, "--pulse", 1e-6, "--rate", 30, "--fan", 60, "--thickness", 0.4)


def refused(test, command, arguments, *words):
    done = striper(command, *arguments, code=2)
    test.assertEqual(done.stdout, "")
    for word in words:
        test.assertIn(word, done.stderr)


class Eyesafe(InScratch):
    def test_paper_is_1m_today(self):
        report = json.loads(striper("eyesafe", *FAN, "--closest", 0.6, "--json").stdout)
        self.assertEqual(report["class"], "1M")
        self.assertAlmostEqual(report["max_energy_uj"], 8.102, delta=5e-4)
        self.assertAlmostEqual(report["max_power_mw"], 0.2431, delta=5e-5)
        limiting = report["limiting"]
        self.assertEqual((limiting["condition"], limiting["rule"], limiting["unit"]), (1, "single_pulse", "J"))
        self.assertIn("60825-1:2014", limiting["table"])
        self.assertAlmostEqual(1e6 * limiting["ael"], 0.1934, delta=5e-5)
        steps = {step["name"]: step["value"] for step in report["steps"]}
        self.assertAlmostEqual(1e6 * steps["condition 3 single_pulse emitted"], 17.36, delta=5e-3)
        self.assertGreater(report["closest_safe_m"], 2.0)
        self.assertTrue(any("standard's text" in one for one in report["not_checked"]))

    def test_text_names_class_limit_and_what_is_open(self):
        done = striper("eyesafe", *FAN, "--closest", 0.6)
        self.assertTrue(done.stdout.startswith("class 1M\nclass 1 is limited to 8.102 uJ a pulse by condition 1"))
        self.assertIn("not checked", done.stderr)

    def test_paper_by_its_own_standard(self):
        report = json.loads(striper("eyesafe", *FAN, "--closest", 0.6, "--standard", "ansi1993", "--json").stdout)
        self.assertAlmostEqual(report["max_energy_uj"], 10.4287, delta=5e-5)
        self.assertAlmostEqual(report["max_power_mw"], 0.3129, delta=5e-5)

    def test_steady_visible_beam(self):
        report = json.loads(striper("eyesafe", "--wavelength", 632.8, "--power", 2.33, "--json").stdout)
        self.assertEqual(report["class"], "3R")
        self.assertIsNone(report["max_energy_uj"])
        self.assertIsNone(report["closest_safe_m"])

    def test_refuses_what_is_out_of_bounds(self):
        beam = ("--wavelength", 632.8, "--power")
        refused(self, "eyesafe", beam + (-1,), "--power", "'-1'", "0 or more")
        refused(self, "eyesafe", beam + ("nan",), "--power", "'nan'", "0 or more")
        refused(self, "eyesafe", beam + (1, "--fan", 181, "--thickness", 1), "--fan", "'181'", "180")
        refused(self, "eyesafe", ("--wavelength", 1064, "--power", 1), "1064", "400 to 1050", "cross-checked")
        refused(self, "eyesafe", ("--wavelength", "nan", "--power", 1), "wavelength", "nan", "400 to 1050")
        refused(self, "eyesafe", beam + (1, "--scan-speed", 100), "--scan-speed", "--failsafe")
        refused(self, "eyesafe", beam + (1, "--failsafe"), "--failsafe", "--scan-speed")
        refused(self, "eyesafe", ("--wavelength", 900), "--energy")
        refused(self, "eyesafe", ("--wavelength", 900, "--energy", 1), "--energy", "--pulse")


PAPER = ("--fov", 55, "--columns", 640, "--rows", 480, "--interlaced", "--baseline", 0.5, "--tilt", 14, "--energy", 10.43)


class Design(InScratch):
    def figures(self, *arguments):
        return json.loads(striper("design", *arguments, "--json").stdout)

    def test_json_has_the_agreed_members(self):
        figures = self.figures(*PAPER, "--range", 2, "--range", 3)
        self.assertAlmostEqual(figures["angular_resolution_deg"], 55 / 640, delta=1e-5)
        self.assertAlmostEqual(1 / figures["laser_to_sun"], 8e4, delta=400)
        self.assertAlmostEqual(figures["shutter_factor"], 13333.3, delta=0.1)
        self.assertAlmostEqual(figures["filter_factor"], 40)
        self.assertIsNone(figures["far_m"])  # The horizon.
        self.assertEqual((figures["false_alarm"], figures["detection"]), (0.001, 0.99))
        self.assertGreater(figures["max_range_m"], 2)
        self.assertEqual([at["range_m"] for at in figures["at"]], [2, 3])
        at = figures["at"][0]
        self.assertAlmostEqual(100 * at["step_out_m"], 2.6, delta=0.05)
        self.assertAlmostEqual(at["signal_to_background"], 6.67, delta=0.01)
        self.assertAlmostEqual(at["signal_dn"] / at["background_dn"], at["signal_to_background"], delta=1e-6)
        self.assertNotAlmostEqual(at["snr"], at["signal_to_background"], delta=1)
        self.assertGreater(at["sigma_m"], 0)
        self.assertEqual(len(figures["requirements"]), 10)

    def test_paper_is_beside_what_comes_out(self):
        text = striper("design", "--paper").stdout
        for word in ("0.16 degrees", "5.0 cm", "no reproduction", "13333", "6.67", "2.50"):
            self.assertIn(word, text)

    def test_says_in_words_what_is_not_in_the_image(self):
        text = striper("design", *PAPER[:-4], "--range", 0.3, "--range", 2).stdout
        self.assertIn("0.3 m straight ahead is not in the image", text)
        self.assertIn("   0.30  not in the image\n", text)
        self.assertNotIn("nan", text)
        self.assertIn("sees nothing of the laser plane", striper("design", *PAPER[:-4], "--tilt", -80).stdout)

    def test_a_scene_and_its_model_agree_on_geometry(self):
        scene = self.figures("--from", scene_path("room.yaml"), "--range", 2)
        striper("simulate", scene_path("room.yaml"), "-o", self.path("room"), "--frames", 1)
        model = self.figures("--from", self.path("room/model.yaml"), "--range", 2)
        for member in ("angular_resolution_deg", "near_m"):
            self.assertAlmostEqual(scene[member], model[member], delta=1e-6)
        for member in ("step_out_m", "step_derivative_m"):
            self.assertAlmostEqual(scene["at"][0][member], model["at"][0][member], delta=1e-6)
        # Both know how bright the stripe is: one by its optics, one by what it looks like.
        self.assertAlmostEqual(scene["at"][0]["signal_dn"] / model["at"][0]["signal_dn"], 1, delta=0.03)

    def test_an_option_goes_before_the_file(self):
        room = ("--from", scene_path("room.yaml"), "--range", 2)
        bright = self.figures(*room, "--energy", 20.8)["at"][0]["signal_dn"]
        self.assertAlmostEqual(bright / self.figures(*room)["at"][0]["signal_dn"], 2, delta=1e-6)

    def test_plot_is_an_svg(self):
        striper("design", *PAPER, "--plot", self.path("design.svg"))
        with open(self.path("design.svg")) as file:
            svg = file.read()
        self.assertTrue(svg.startswith("<svg xmlns="))
        self.assertIn("signal to background", svg)
        self.assertNotIn("nan", svg)

    def test_refuses_what_is_out_of_bounds(self):
        refused(self, "design", PAPER + ("--fan", 181), "--fan", "'181'", "180")
        refused(self, "design", PAPER[:-2] + ("--power", -1), "--power", "'-1'", "0 or more")
        refused(self, "design", PAPER + ("--reflectance", "nan"), "--reflectance", "'nan'", "to 1")
        refused(self, "design", PAPER + ("--wavelength", 2000), "--wavelength", "'2000'", "to 1080")
        refused(self, "design", ("--paper", "--json"), "--paper", "--json")
        refused(self, "design", ("--columns", 640, "--rows", 480, "--baseline", 0.5), "--fov")
        refused(self, "design", PAPER + ("--from", scene_path("room.yaml")), "--from", "--fov")


if __name__ == "__main__":
    unittest.main()
