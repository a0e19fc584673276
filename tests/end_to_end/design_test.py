# SPDX-License-Identifier: Apache-2.0
"""Proves what `striper eyesafe` promises on the command line: JSON with the agreed members, the
paper's figures, exit code 2 with option, value and bound for what is out of bounds. The
limits themselves are proved by eye_safety_tests.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 design_test.py
"""
import json
import unittest

from program import InScratch, striper

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
        refused(self, "eyesafe", ("--wavelength", 900), "--energy")
        refused(self, "eyesafe", ("--wavelength", 900, "--energy", 1), "--energy", "--pulse")


if __name__ == "__main__":
    unittest.main()
