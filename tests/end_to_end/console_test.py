# SPDX-License-Identifier: Apache-2.0
"""Proves the operator's console of `striper guide console` in a real terminal (tmux): every function of the 1991 report's Appendix
B by its keys, at two sizes, against screens that are kept (console_screens/); without colour; resized; parameters out of range
refused on the spot; messages of three levels that go away; the same functions line by line. The run goes on by key (--step), so that
screens are the same each time. Does not prove a live truck.

Run by ctest; by hand: STRIPER=... STRIPER_SOURCE_DIR=. python3 console_test.py
After a change that is meant: STRIPER_REGENERATE=1 python3 console_test.py, and look at the screens.
"""
import itertools
import os
import re
import shutil
import signal
import subprocess
import time
import unittest

from program import SOURCE_DIR, STRIPER, InScratch, at_most, run, striper

SCREENS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "console_screens")
_terminals = itertools.count(1)
ROAD = """striper_road: 1
seed: 5
length_m: 60
speed_m_s: 10
wander: [{amplitude_m: 0.08, period_m: 40}]
lines: [{dash_m: 3.048, gap_m: 4.572, begin_m: 3}]
"""


class Terminal:
    """A terminal of its own, with the console in it."""

    def __init__(self, scratch, columns, rows, command, environment=None):
        self.socket = os.path.join(scratch, f"tmux-{next(_terminals)}")
        self.tmux("-f", "/dev/null", "new-session", "-d", "-s", "console", "-x", str(columns), "-y", str(rows),
                  "env", *[f"{key}={value}" for key, value in (environment or {}).items()], *command)
        self.tmux("set", "-g", "status", "off")
        self.tmux("resize-window", "-t", "console", "-x", str(columns), "-y", str(rows))

    def tmux(self, *arguments, check=True):
        return subprocess.run(["tmux", "-S", self.socket, *arguments], capture_output=True, text=True, timeout=20, check=check)

    def keys(self, *names):
        self.tmux("send-keys", "-t", "console", *names)

    def type(self, text):
        self.tmux("send-keys", "-t", "console", "-l", text)

    def screen(self, colours=False):
        return self.tmux("capture-pane", "-p", *(["-e"] if colours else []), "-t", "console").stdout

    def wait_for(self, text, seconds=15):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            screen = self.screen()
            if re.search(text, screen):
                return screen
            time.sleep(0.05)
        raise AssertionError(f"{text!r} did not come:\n{self.screen()}")

    def wait_other(self, before, seconds=15):
        """Until the screen is another one, the clock aside."""
        end = time.monotonic() + seconds
        while still(self.screen()) == still(before):
            if time.monotonic() > end:
                raise AssertionError(f"it stays as it was:\n{before}")
            time.sleep(0.05)

    def wait_without(self, text, seconds=20):
        end = time.monotonic() + seconds
        while re.search(text, self.screen()):
            if time.monotonic() > end:
                raise AssertionError(f"{text!r} did not go:\n{self.screen()}")
            time.sleep(0.1)

    def close(self):
        self.tmux("kill-server", check=False)


def made_run(scratch):
    """A run, made once; each test has a copy, as the console changes it."""
    path = os.path.join(scratch, "run")
    with open(os.path.join(scratch, "road.yaml"), "w", encoding="utf-8") as file:
        file.write(ROAD)
    striper("guide", "simulate", os.path.join(scratch, "road.yaml"), "-o", path)
    return path


def still(screen):
    """A screen without what another moment has: the clock."""
    return re.sub(r"\d\d:\d\d:\d\d", "HH:MM:SS", screen.rstrip("\n")) + "\n"


class InTerminal(InScratch):
    maxDiff = None

    def open(self, columns=80, rows=24, *arguments, **environment):
        if not shutil.which("tmux"):
            self.skipTest("tmux is not installed")
        self.run_path = self.path("run") if os.path.exists(self.path("run")) else made_run(self.scratch)
        terminal = Terminal(self.scratch, columns, rows, [STRIPER, "guide", "console", self.run_path, "--step", "0.5", *arguments],
                            {"TERM": "screen-256color", **environment})
        self.addCleanup(terminal.close)
        try:
            terminal.wait_for("Use arrow keys")
        except AssertionError:
            if "line mode alone" in open(os.path.join(SOURCE_DIR, "README.md"), encoding="utf-8").read():
                self.skipTest("built without ncurses")
            raise
        return terminal

    def choose(self, terminal, menu, item):
        """From any menu to an item, by arrows."""
        terminal.keys("Escape")
        terminal.wait_for("Use arrow keys")
        for _ in range(4):
            if f"[{menu}]" in terminal.screen():
                break
            now = re.search(r"\[(\w+)\]", terminal.screen()).group(1)
            terminal.keys("Right")
            terminal.wait_for(rf"\[(?!{now}\])\w+\]")
        terminal.keys("Left")
        terminal.keys("Right")
        terminal.keys("Down")
        terminal.wait_for(r"> \w")
        for _ in range(7):
            if f"> {item}" in terminal.screen():
                break
            now = re.search(r"> ([\w/ ]+?) *\|", terminal.screen()).group(1)
            terminal.keys("Down")
            terminal.wait_for(rf"> (?!{re.escape(now)} *\|)\w")
        self.assertIn(f"> {item}", terminal.screen())

    def matches(self, terminal, name, text):
        screen = still(terminal.wait_for(text))
        file = os.path.join(SCREENS, name + ".txt")
        if os.environ.get("STRIPER_REGENERATE"):
            os.makedirs(SCREENS, exist_ok=True)
            with open(file, "w", encoding="utf-8") as out:
                out.write(screen)
        with open(file, encoding="utf-8") as kept:
            self.assertEqual(kept.read(), screen, name)

    def config(self):
        with open(os.path.join(self.run_path, "guidance.yaml"), encoding="utf-8") as file:
            return file.read()


class Screens(InTerminal):
    def every_function(self, columns, rows):
        size = f"{columns}x{rows}"
        terminal = self.open(columns, rows)
        matches = lambda name, text: self.matches(terminal, f"{size}-{name}", text)
        for _ in range(4):
            terminal.type(".")
        matches("01-start", "STRIPE GUIDANCE")
        self.choose(terminal, "File", "Shell")
        matches("02-file", "> Shell")
        self.choose(terminal, "Controls", "Laser off")
        matches("03-controls", "> Laser off")
        terminal.keys("Enter")
        matches("04-laser-off", "information: laser off")
        self.choose(terminal, "Scans", "Single scan")
        terminal.keys("Enter")
        matches("05-no-scan-without-laser", "warning: the laser is off")
        self.choose(terminal, "Controls", "Laser on")
        terminal.keys("Enter")
        terminal.wait_for("Laser beam : ON")
        terminal.wait_without("information:")
        terminal.type(".")
        self.choose(terminal, "Controls", "Read odometer")
        terminal.keys("Enter")
        matches("06-odometer", r"Odometer: \d+ clks")
        self.choose(terminal, "Controls", "Set time")
        terminal.keys("Enter")
        matches("07-set-time", "Please input the new time")
        terminal.type("12:30:00")
        terminal.keys("Enter")
        terminal.wait_for("information: time set")
        terminal.wait_for("12:30:0")
        terminal.wait_without("information:")
        self.choose(terminal, "Scans", "Single scan")
        matches("08-scans", "> Single scan")
        terminal.keys("Enter")
        matches("09-single-scan", "leave the scan")
        terminal.keys("q")
        self.choose(terminal, "Scans", "Continue scan")
        terminal.keys("Enter")
        matches("10-continue-scan", "quit continue scan")
        for _ in range(2):
            before = terminal.screen()
            terminal.type(".")
            terminal.wait_for(r"State    tracking")
            terminal.wait_other(before)
        matches("11-lateral", "State    tracking")
        terminal.keys("q")
        self.choose(terminal, "Scans", "Threshold scans")
        terminal.keys("Enter")
        terminal.wait_for("Threshold=1000")
        before = terminal.screen()
        terminal.type(".")
        terminal.wait_other(before)
        matches("12-threshold", r"Threshold=1000  at [+-]")
        terminal.keys("Up")
        terminal.keys("Up")
        terminal.wait_for("Threshold=1082")
        terminal.keys("NPage")
        matches("13-threshold-moved", "Threshold=672")
        terminal.keys("Enter")
        terminal.wait_for("information: threshold of front is 672")
        self.assertIn("threshold: 672", self.config())
        terminal.keys("Right")
        terminal.wait_for("Beam middle")
        terminal.keys("a")
        terminal.wait_for("Threshold=auto")
        terminal.keys("q")  # Not kept.
        terminal.wait_for("middle    : 1000")
        terminal.wait_without("information:")
        self.parameters(terminal, matches)
        self.calibration(terminal, matches)
        self.choose(terminal, "File", "Quit all")
        terminal.keys("Enter")

    def parameters(self, terminal, matches):
        self.choose(terminal, "Parameters", "Left line")
        matches("14-parameters", "> Left line")
        terminal.keys("Enter")
        terminal.wait_for("using LEFT")
        self.choose(terminal, "Parameters", "Right line")
        terminal.keys("Enter")
        matches("15-right-line", "using RIGHT")
        self.choose(terminal, "Parameters", "Single line")
        terminal.keys("Enter")
        terminal.wait_for("Double line: none")
        for item, name, wrong, right, shown in (
                ("Window size", "16-window", "91", "20", r"Window size: 20.0' ~ 2.8ft"),
                ("Points/scan", "17-points", "3.5", "128", "Points/scan: 128"),
                ("Stripe width", "18-stripe-width", "1", "18", "Stripe width 18pts")):
            terminal.wait_without("information:|error:")
            self.choose(terminal, "Parameters", item)
            terminal.keys("Enter")
            matches(name, "Please input new")
            terminal.type(wrong)
            terminal.keys("Enter")
            terminal.wait_for(f"error: .*{re.escape(wrong)} is out of range")
            self.assertIn("Please input new", terminal.screen())  # The same question again.
            if name == "16-window":
                matches("19-refused", "error:")
            terminal.type(right)
            terminal.keys("Enter")
            terminal.wait_for(shown)
        for text in ("fan_deg: 20,", "samples: 128"):
            self.assertIn(text, self.config())

    def calibration(self, terminal, matches):
        terminal.wait_without("information:|error:")
        self.choose(terminal, "Parameters", "Odometer CF")
        terminal.keys("Enter")
        matches("20-odometer-cf", "Input calibration distance")
        terminal.type("50")
        terminal.keys("Enter")
        terminal.wait_for("Please press Enter to start")
        terminal.keys("Enter")
        matches("21-calibrating", "CALIBRATING")
        for _ in range(3):
            terminal.type(".")
        terminal.keys("Enter")
        # 1.5 s at 10 m/s are 49.2 ft of 11.725 counts.
        screen = terminal.wait_for(r"information: odometer CF is [\d.]+ clks/ft")
        factor = float(re.search(r"odometer CF is ([\d.]+)", screen).group(1))
        self.assertAlmostEqual(factor, 11.725 * 15 / 0.3048 / 50, delta=0.05)
        self.assertAlmostEqual(float(re.search(r"counts_per_m: ([\d.]+)", self.config()).group(1)) * 0.3048, factor, places=3)

    def test_every_function_at_80_by_24(self):
        self.every_function(80, 24)

    def test_every_function_at_120_by_40(self):
        self.every_function(120, 40)


class Behaviour(InTerminal):
    def test_follows_its_terminal_s_size_and_says_where_it_is_too_small(self):
        terminal = self.open()
        terminal.tmux("resize-window", "-t", "console", "-x", "60", "-y", "20")
        terminal.wait_for("The console needs 80 x 24; this is 60 x 20")
        terminal.tmux("resize-window", "-t", "console", "-x", "100", "-y", "30")
        screen = terminal.wait_for("Use arrow keys")
        self.assertEqual(len(screen.rstrip("\n").split("\n")), 30)
        self.assertIn("PARAMETERS", screen)

    def test_without_colour_words_and_signs_are_the_same(self):
        terminal = self.open(80, 24, NO_COLOR="1")
        terminal.type(".")
        self.choose(terminal, "Scans", "Threshold scans")
        terminal.keys("Enter")
        plain = terminal.wait_for("Threshold=1000")
        self.assertNotRegex(terminal.screen(colours=True), r"\x1b\[[0-9;]*3[0-7]m")
        terminal.close()
        terminal = self.open(80, 24)
        terminal.type(".")
        self.choose(terminal, "Scans", "Threshold scans")
        terminal.keys("Enter")
        self.assertEqual(still(terminal.wait_for("Threshold=1000")), still(plain))
        self.assertRegex(terminal.screen(colours=True), r"\x1b\[[0-9;]*3[0-7]m")

    def test_messages_go_away_the_worse_the_later(self):
        terminal = self.open()
        self.choose(terminal, "Controls", "Laser off")
        terminal.keys("Enter")
        terminal.wait_for("information: laser off")
        told = time.monotonic()
        terminal.wait_without("information:")
        self.assertGreater(time.monotonic() - told, 3.0)
        self.choose(terminal, "Scans", "Continue scan")
        terminal.keys("Enter")
        terminal.wait_for("warning: the laser is off")
        told = time.monotonic()
        terminal.wait_without("warning:")
        self.assertGreater(time.monotonic() - told, 7.0)

    def test_a_dumb_terminal_is_refused_in_words(self):
        if not shutil.which("tmux"):
            self.skipTest("tmux is not installed")
        made_run(self.scratch)
        terminal = Terminal(self.scratch, 80, 24, ["sh", "-c", f"{STRIPER} guide console {self.path('run')}; echo gave $?; sleep 20"],
                            {"TERM": "nonsense"})
        self.addCleanup(terminal.close)
        self.assertIn("has no screen that can be drawn on", terminal.wait_for("gave 1"))


class Lines(InScratch):
    def lines(self, *commands, code=0):
        run_path = self.path("run") if os.path.exists(self.path("run")) else made_run(self.scratch)
        return run(STRIPER, "guide", "console", run_path, "--lines", input="\n".join(commands) + "\n", code=code).stdout

    def config(self):
        with open(self.path("run", "guidance.yaml"), encoding="utf-8") as file:
            return file.read()

    def test_every_function_is_a_line(self):
        said = self.lines("wait 2", "laser off", "scan", "laser on", "wait 0.1", "odometer", "time 08:15:00", "scan", "continue start",
                          "wait 1", "lateral", "continue stop", "threshold front", "threshold front 900", "threshold rear auto",
                          "line left", "line right", "line single", "window 20", "points 128", "width 18", "calibrate 50", "wait 1.5",
                          "calibrate end", "parameters", "quit")
        for text in ("laser off", "warning: the laser is off", "the time is 08:15:00",
                     "Beam front  Threshold=1000", "State    tracking", "threshold of front is 900", "threshold of rear is auto",
                     "the left line is followed", "the right line is followed", "window size is 20", "points per scan is 128",
                     "stripe width is 18", "started; say: calibrate end", "information: odometer CF is 11.5", "Laser beam : ON"):
            self.assertIn(text, said)
        self.assertRegex(said, r"Odometer: 80\d clks 0.01 miles")  # 2.1 s at 10 m/s, 11.725 counts a foot.
        self.assertIn("threshold: 900", self.config())

    def test_told_to_end_it_waits_for_no_line(self):
        made_run(self.scratch)
        console = subprocess.Popen([STRIPER, "guide", "console", self.path("run"), "--lines"], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, text=True)
        self.addCleanup(console.communicate)
        console.stdin.write("odometer\nlaser off\nodome")
        console.stdin.flush()
        self.assertIn("Odometer: 0 clks", console.stdout.readline())
        self.assertEqual(console.stdout.readline(), "laser off\n")
        console.send_signal(signal.SIGINT)
        told = time.monotonic()
        self.assertEqual(console.wait(timeout=at_most(10)), 0)
        self.assertLess(time.monotonic() - told, at_most(0.5))

    def test_every_parameter_out_of_range_is_refused_on_the_spot_and_changes_nothing(self):
        self.lines("help")
        before = self.config()
        wrong = ("window 0.5", "window 91", "window x", "points 15", "points 5000", "points 20.5", "points nan", "width 1", "width 70",
                 "width inf", "threshold front 0", "threshold front 4096", "threshold front -1", "threshold nobody 5", "odometer-cf 0",
                 "odometer-cf 10001", "odometer-cf 1e999", "calibrate 0.5", "calibrate 60000", "calibrate end", "line middle",
                 "laser dim", "threshold", "time 24:00:00", "time 12:60:00", "time 12", "time noon", "wait -1", "open sesame", "lateral")
        said = self.lines(*wrong, code=1).strip().split("\n")
        self.assertEqual(len(said), len(wrong), said)
        for command, answer in zip(wrong, said):
            self.assertTrue(answer.startswith("error: "), f"{command}: {answer}")
        self.assertEqual(self.config(), before)
        self.assertIn("error: the odometer did not count", self.lines("calibrate 100", "calibrate end", code=1))
        # 5709 ft for 57.09: a decimal point was forgotten.
        self.assertIn("clks/ft, where it was 11.725", self.lines("calibrate 5709", "wait 2", "calibrate end", code=1))
        self.assertEqual(self.config(), before)


if __name__ == "__main__":
    unittest.main()
