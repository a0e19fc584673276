# SPDX-License-Identifier: Apache-2.0
"""Proves of `striper serve` that its files are capture's, byte for byte; that a signal at any moment
leaves them whole; that it waits for its camera, opens it again, reads its model anew and says how it is,
to people and to systemd; and of `capture` that several outputs hold the same scans.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 serve_test.py
"""
import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import time
import unittest

from gige_test import VirtualCamera, small_scene
from program import STRIPER, SOURCE_DIR, InScratch, at_most, slowed, striper


class Serve(InScratch):
    def setUp(self):
        super().setUp()
        self.scene = self.write("small.yaml", small_scene())
        striper("simulate", self.scene, "-o", self.path("made"), "--frames", "1")
        self.model = self.path("model.yaml")
        shutil.copy(self.path("made", "model.yaml"), self.model)

    def source(self, query):
        return f"sim:{self.scene}?{query}"

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def start(self, source, *options, env=None):
        """`striper serve` at work; ended when the test is."""
        # pylint: disable=consider-using-with
        program = subprocess.Popen(
            [STRIPER, "serve", source, "-m", self.model, *options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, **(env or {})},
        )

        def end():
            if program.poll() is None:
                program.kill()
            program.communicate()

        self.addCleanup(end)
        self.wait_for_line(program, "serving")
        return program

    def wait_for_line(self, program, word):
        for line in program.stderr:
            if word in line:
                return line
        return self.fail(f"it ended without '{word}'")

    def wait_until(self, condition, what, seconds=30):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.02)

    def end(self, program, number=signal.SIGTERM):
        program.send_signal(number)
        _, stderr = program.communicate(timeout=30)
        self.assertEqual(program.returncode, 0, stderr)
        return stderr

    def events(self, name):
        """The codes in a file of JSON lines, in order."""
        lines = [json.loads(line) for line in self.read(name).splitlines()]
        return [line["event"] for line in lines if "event" in line]

    def check_whole(self, csv_name, jsonl_name):
        """Whole lines, and the same scans as far as the shorter goes. Returns how many."""
        rows, lines = self.read(csv_name), self.read(jsonl_name)
        self.assertTrue(rows.endswith(b"\n") and lines.endswith(b"\n") or not rows)
        table = [row.split(b",") for row in rows.splitlines()]
        self.assertEqual({len(row) for row in table} - {18}, set())
        in_table = {int(row[0]) for row in table[1:]}
        scans = [json.loads(line) for line in lines.splitlines()]
        in_lines = {scan["sequence"] for scan in scans if "sequence" in scan}
        self.assertEqual(in_table, in_lines)
        return len(in_table)


class Files(Serve):
    def test_are_those_of_capture(self):
        source = self.source("frames=30")
        striper("capture", source, "-m", self.model, "-o", self.path("capture.csv"))
        done = striper("serve", source, "-m", self.model, "--to", "csv:" + self.path("a.csv"),
                       "--to", "jsonl:" + self.path("b.jsonl"))
        self.assertGreater(self.read("capture.csv").count(b"\n"), 1000)
        self.assertEqual(self.read("a.csv"), self.read("capture.csv"))
        self.assertEqual(self.check_whole("a.csv", "b.jsonl"), 30)
        self.assertEqual(self.events("b.jsonl"), ["source_opened", "source_ended"])
        self.assertIn("30 written, 0 lost", done.stderr)

    def test_of_several_outputs_are_the_same(self):
        source = self.source("frames=10")
        options = ("-m", self.model, "--missing", "--max-range", "2.2")  # Beyond it some are missing.
        striper("capture", source, *options, "-o", self.path("alone.csv"))
        done = striper("capture", source, *options, "-o", self.path("a.csv"),
                       "-o", self.path("b.jsonl"), "-o", self.path("c.csv") + "?missing=no", "--json")
        self.assertEqual(self.read("a.csv"), self.read("alone.csv"))
        self.assertLess(len(self.read("c.csv")), len(self.read("a.csv")))
        self.check_whole("a.csv", "b.jsonl")
        for output in json.loads(done.stdout)["outputs"]:
            self.assertEqual((output["state"], output["written"], output["lost"]), ("finished", 10, 0))

    def test_that_fail_do_not_touch_the_others(self):
        source = self.source("frames=10")
        striper("capture", source, "-m", self.model, "-o", self.path("alone.csv"))
        done = striper("capture", source, "-m", self.model, "-o", "/dev/full", "-o", self.path("a.csv"), code=1)
        self.assertEqual(self.read("a.csv"), self.read("alone.csv"))
        self.assertIn("No space left on device", done.stderr)

    def test_that_nobody_can_write_are_told_of_first(self):
        for sink, message in (("ftp:x", "unknown kind 'ftp'"), (self.model, "holds no scans"),
                              ("csv:x.csv?mising=yes", "unknown key 'mising'")):
            done = striper("serve", self.source("frames=1"), "-m", self.model, "--to", sink, code=2)
            self.assertIn(message, done.stderr)
        striper("serve", self.source("frames=1"), "-m", self.path("none.yaml"), "--to", self.path("a.csv"), code=1)

    def test_of_two_names_are_refused(self):
        for command, option in (("serve", "--to"), ("capture", "-o")):
            done = striper(command, self.source("frames=1"), "-m", self.model, option, "a.csv",
                           option, "jsonl:./a.csv", code=2, cwd=self.scratch)
            self.assertIn("are the same", done.stderr)
            self.assertFalse(os.path.exists(self.path("a.csv")))

    def test_are_not_waited_for_as_cameras_are(self):
        for source in ("sim:none.yaml", "images:none", "none.yaml"):
            done = striper("serve", source, "-m", self.model, "--to", self.path("a.csv"), code=1)
            self.assertIn("none", done.stderr)
            self.assertNotIn("source_waiting", done.stderr)


class Signals(Serve):
    TIMES = 6

    def test_that_end_it_leave_whole_files(self):
        random.seed(2026)
        scans = 0
        for number in range(self.TIMES):
            program = self.start(self.source("realtime=yes&fps=200"), "--to", self.path("a.csv"), "--to", self.path("b.jsonl"))
            time.sleep(slowed(random.uniform(0.0, 0.4)))
            self.end(program, signal.SIGTERM if number % 2 == 0 else signal.SIGINT)
            if os.path.exists(self.path("a.csv")) and os.path.exists(self.path("b.jsonl")):
                scans += self.check_whole("a.csv", "b.jsonl")
        self.assertGreater(scans, self.TIMES)

    def test_hup_reads_the_model_anew(self):
        program = self.start(self.source("realtime=yes&fps=50"), "--to", self.path("b.jsonl"))
        self.wait_for_line(program, "source_opened")  # With the model as it was.
        with open(self.model, encoding="utf-8") as file:
            text = file.read()
        for content, event in (("striper_model: 7\n", "model_refused"), (text, "model_reloaded")):
            self.write("model.yaml", content)
            program.send_signal(signal.SIGHUP)
            self.wait_for_line(program, event)
        self.end(program)
        self.assertEqual(
            [one for one in self.events("b.jsonl") if one.startswith("model")], ["model_refused", "model_reloaded"]
        )

    def test_usr1_has_it_say_how_it_is(self):
        program = self.start(self.source("realtime=yes&fps=50"), "--to", self.path("a.csv"))
        self.wait_until(lambda: os.path.exists(self.path("a.csv")), "a scan")
        time.sleep(1.5)
        program.send_signal(signal.SIGUSR1)
        line = self.wait_for_line(program, "frames/s")
        self.assertRegex(line, r"^streaming, [\d.]+ frames/s, \d+ scans.*; \S+a\.csv open, \d+ written, 0 lost")
        self.end(program)


class SignalsOften(Signals):
    TIMES = 50


class Systemd(Serve):
    """Against a socket that stands where systemd's would."""

    def messages(self, receiver):
        found = []
        try:
            while True:
                found.append(receiver.recv(4096).decode())
        except BlockingIOError:
            return found

    def check(self, address, name):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
            receiver.bind(address)
            receiver.setblocking(False)
            program = self.start(
                self.source("realtime=yes&fps=20"), "--to", self.path("a.csv"),
                env={"NOTIFY_SOCKET": name, "WATCHDOG_USEC": "400000"},
            )
            messages = []  # Read in time: ten of them fit.
            for _ in range(10):
                time.sleep(0.15)
                messages += self.messages(receiver)
            program.send_signal(signal.SIGUSR1)
            self.wait_for_line(program, "frames/s")
            messages += self.messages(receiver)
            self.end(program)
            messages += self.messages(receiver)
        self.assertEqual(messages[0], "READY=1")
        self.assertEqual(messages[-1], "STOPPING=1")
        self.assertGreaterEqual(messages.count("WATCHDOG=1"), 4)
        self.assertTrue(any(re.match(r"STATUS=streaming, .* frames/s", one) for one in messages), messages)

    def test_socket_in_a_directory(self):
        self.check(self.path("notify"), self.path("notify"))

    def test_socket_in_the_abstract_space(self):
        name = "striper-test-" + os.path.basename(self.scratch)
        self.check("\0" + name, "@" + name)

    def test_who_does_not_listen_holds_up_nothing(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
            receiver.bind(self.path("notify"))
            program = self.start(
                self.source("realtime=yes&fps=20"), "--to", self.path("a.csv"),
                env={"NOTIFY_SOCKET": self.path("notify"), "WATCHDOG_USEC": "40000"},
            )
            time.sleep(1.5)  # Ten messages fit, and 75 are due.
            begin = time.monotonic()
            self.end(program)
            self.assertLess(time.monotonic() - begin, at_most(2.0))

    def test_watchdog_of_another_process_is_not_fed(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
            receiver.bind(self.path("notify"))
            receiver.setblocking(False)
            striper("serve", self.source("frames=5"), "-m", self.model, "--to", self.path("a.csv"),
                    env={**os.environ, "NOTIFY_SOCKET": self.path("notify"), "WATCHDOG_USEC": "2", "WATCHDOG_PID": "1"})
            self.assertEqual(self.messages(receiver), ["READY=1", "STOPPING=1"])

    def test_unit_names_what_there_is(self):
        with open(os.path.join(SOURCE_DIR, "packaging", "striper@.service"), encoding="utf-8") as file:
            unit = file.read()
        self.assertIn("Type=notify", unit)
        self.assertRegex(unit, r"WatchdogSec=\d+")
        options = re.findall(r" (--[a-z-]+)", re.search("ExecStart=striper serve (.*)", unit).group(0))
        known = striper("serve", "--help").stdout
        for option in options:
            self.assertIn(option, known)

    @unittest.skipUnless(shutil.which("systemd-analyze"), "there is no systemd-analyze here (package systemd)")
    def test_unit_is_whole_and_confined(self):
        with open(os.path.join(SOURCE_DIR, "packaging", "striper@.service"), encoding="utf-8") as file:
            unit = file.read()
        for program in ("striper", "kill"):  # Neither need be in systemd's folders on the machine that tests.
            unit = re.sub(rf"(Exec\w+=){program} ", rf"\1{shutil.which('true')} ", unit)
        path = self.write("striper@left.service", re.sub(r"Documentation=.*\n", "", unit))
        done = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=40", path], capture_output=True, text=True,
                              timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stdout[-200:])


class Camera(Serve):
    """A camera that is not there, comes, is lost and comes back."""

    TIMES = 1

    def test_that_comes_and_goes_is_told_of_once_in_order(self):
        camera = VirtualCamera(self.scene)
        program = self.start(camera.uri(), "--to", self.path("a.csv"), "--to", self.path("b.jsonl"))
        self.wait_for_line(program, "source_waiting")
        with camera:
            self.wait_for_line(program, "source_back")
            self.wait_until(lambda: os.path.exists(self.path("a.csv")), "a scan")
            time.sleep(0.5)
            camera.program.kill()
            camera.program.communicate()
        for number in range(self.TIMES):
            self.wait_for_line(program, "source_lost")
            with camera:
                self.wait_for_line(program, "source_back")
                time.sleep(0.5)
                if number + 1 == self.TIMES:
                    self.end(program)
                else:
                    camera.program.kill()
                    camera.program.communicate()
        told = [one for one in self.events("b.jsonl") if one in ("source_waiting", "source_lost", "source_back", "source_gone")]
        self.assertEqual(told, ["source_waiting", "source_back"] + ["source_lost", "source_back"] * self.TIMES)
        self.assertGreater(self.check_whole("a.csv", "b.jsonl"), 2)


class CameraOften(Camera):
    TIMES = 10


if __name__ == "__main__":
    unittest.main()
