# SPDX-License-Identifier: Apache-2.0
"""Proves that what `striper guide run --to candump:FILE` writes is what data/can/guidance.dbc says, read by a decoder of our own
(Frames) and by other people's (Judged, npm), and that it is what the tables of the run say; and what the outputs of `guide run` do. A
bus itself is vcan.sh's.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper STRIPER_SOURCE_DIR=. python3 can_test.py Frames
"""
import csv
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.environ["STRIPER_SOURCE_DIR"], "tests/end_to_end"))
from program import SOURCE_DIR, STRIPER, InScratch, at_most, striper  # noqa: E402

DBC = os.path.join(SOURCE_DIR, "data/can/guidance.dbc")
ROAD = """striper_road: 1
seed: 3
length_m: 60
speed_m_s: 12
wander: [{amplitude_m: 0.0762, period_m: 30}]
lines: [{dash_m: 3, gap_m: 4, begin_m: 4}]
wear: {edge_sd_m: 0.005}
"""


class Dbc:
    """The messages of a DBC file; signals in Intel's order, as ours all are."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.messages = {}
        for part in re.split(r"^BO_ ", text, flags=re.M)[1:]:
            number, name, size = re.match(r"(\d+) (\w+): (\d+)", part).groups()
            signals = {
                signal: {"begin": int(begin), "bits": int(bits), "is_signed": sign == "-", "step": float(step), "offset": float(offset),
                         "low": float(low), "high": float(high), "words": {}}
                for signal, begin, bits, sign, step, offset, low, high in re.findall(
                    r"^ SG_ (\w+) : (\d+)\|(\d+)@1([+-]) \(([^,]+),([^)]+)\) \[([^|]+)\|([^]]+)\]", part, flags=re.M)}
            self.messages[int(number)] = {"name": name, "size": int(size), "signals": signals}
        for number, signal, words in re.findall(r"^VAL_ (\d+) (\w+) (.*) ;$", text, flags=re.M):
            self.messages[int(number)]["signals"][signal]["words"] = {
                int(value): word for value, word in re.findall(r'(-?\d+) "([^"]*)"', words)}

    def decode(self, number, data):
        message = self.messages[number]
        if len(data) != message["size"]:
            raise AssertionError(f"{message['name']} has {len(data)} bytes")
        whole = int.from_bytes(data, "little")
        values = {}
        for name, signal in message["signals"].items():
            raw = whole >> signal["begin"] & (1 << signal["bits"]) - 1
            if signal["is_signed"] and raw >> signal["bits"] - 1:
                raw -= 1 << signal["bits"]
            word = signal["words"].get(raw)
            value = round(raw * signal["step"] + signal["offset"], 9)
            if word is None and not signal["low"] <= value <= signal["high"]:
                raise AssertionError(f"{name} is {value}, outside what is described")
            values[name] = value if word is None else word
        return message["name"], values


def log_lines(path):
    with open(path, encoding="ascii") as file:
        for line in file:
            time_s, interface, number, data = re.fullmatch(r"\((\d+\.\d{6})\) (\w+) ([0-9A-F]{3})#([0-9A-F]*)\n", line).groups()
            yield float(time_s), interface, int(number, 16), bytes.fromhex(data)


class WithRun(InScratch):
    def run_of(self, **changes):
        """A run on a short road, with a mirror that stops where asked for."""
        road = self.write("road.yaml", ROAD)
        striper("guide", "simulate", road, "-o", self.path("run"))
        if changes.get("mirror_stops_s"):
            self.write("run/state.csv", f"time_s,laser,mirror_hz\n0,1,88\n{changes['mirror_stops_s']},1,0\n")
        return self.path("run")

    def table(self, name):
        with open(self.path("job", name), encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))


class Frames(WithRun):
    def test_the_description_is_whole(self):
        dbc = Dbc(DBC)
        self.assertEqual([m["name"] for m in dbc.messages.values()], ["GUIDANCE_LATERAL", "GUIDANCE_GUNS", "GUIDANCE_FAULT", "GUIDANCE_WAY",
                                                                    "TRUCK_ODOMETER", "TRUCK_STATE"])
        for message in dbc.messages.values():
            taken = 0
            for name, signal in message["signals"].items():
                bits = (1 << signal["bits"]) - 1 << signal["begin"]
                self.assertFalse(taken & bits, f"{name} lies on another signal")
                self.assertLessEqual(signal["begin"] + signal["bits"], 8 * message["size"])
                taken |= bits

    def decoded(self, *arguments):
        striper("guide", "run", self.run_of(mirror_stops_s=3.5), "-o", self.path("job"), "--to", f"candump:{self.path('log')}", *arguments)
        dbc = Dbc(DBC)
        by_name = {message["name"]: [] for message in dbc.messages.values()}
        last_s = 0.0
        for time_s, _, number, data in log_lines(self.path("log")):
            self.assertGreaterEqual(time_s, last_s)
            last_s = time_s
            name, values = dbc.decode(number, data)
            by_name[name].append((time_s, values))
        return by_name

    def test_frames_are_the_tables(self):
        frames = self.decoded()
        self.assert_lateral(frames)
        self.assert_guns(frames)
        faults = self.table("faults.csv")
        self.assertEqual([(f["code"], f["action"]) for _, f in frames["GUIDANCE_FAULT"]], [(row["code"], row["action"]) for row in faults])
        self.assertEqual([f["code"] for _, f in frames["GUIDANCE_FAULT"]], ["mirror"])
        for kind in ("GUIDANCE_LATERAL", "GUIDANCE_GUNS", "GUIDANCE_FAULT"):
            for i, (_, values) in enumerate(frames[kind]):
                self.assertEqual(values["count"], i % 256)

    def assert_lateral(self, frames):
        rows = self.table("lateral.csv")
        # One more where the fault stops, and the last, which makes safe.
        lateral = frames["GUIDANCE_LATERAL"]
        self.assertEqual(len(lateral), len(rows) + 2)
        self.assertEqual(lateral[-1][1], lateral[-1][1] | {"lateral_m": "unknown", "volts": 0.0, "state": "lost"})
        by_time = {time_s: values for time_s, values in lateral[:-1]}
        states = set()
        for row in rows:
            values = by_time[round(float(row["time_s"]), 6)]
            for name, step in (("lateral_m", 1e-4), ("sigma_m", 1e-4), ("volts", 1e-3)):
                if row[name] == "":
                    self.assertEqual(values[name], "unknown")
                else:
                    self.assertAlmostEqual(values[name], float(row[name]), delta=0.501 * step)
            self.assertEqual(values["state"], row["state"])
            self.assertEqual(values["beams"], int(row["beams"]))
            states.add(row["state"])
        self.assertEqual(states, {"tracking", "bridging", "lost", "fault"})
        self.assertEqual(len(frames["GUIDANCE_WAY"]), len(rows))
        for row, (_, values) in zip(rows, frames["GUIDANCE_WAY"]):
            self.assertEqual(values["odometer_counts"], int(row["odometer_counts"]))
            self.assertAlmostEqual(values["distance_m"], float(row["distance_m"]), delta=0.501e-3)

    def assert_guns(self, frames):
        signals = [values["gun0"] for _, values in frames["GUIDANCE_GUNS"]]
        changes = [now for before, now in zip([0.0, *signals], signals) if now != before]
        states = [row["state"] for row in self.table("guns.csv")]
        self.assertGreaterEqual(states.count("ON"), 4)
        self.assertEqual(changes, [1.0 if state == "ON" else 0.0 for state in states[1:]])
        self.assertEqual(signals[-1], 0.0)
        self.assertTrue(all(values[f"gun{i}"] == 0.0 for _, values in frames["GUIDANCE_GUNS"] for i in range(1, 8)))
        off = [values["laser_off"] for _, values in frames["GUIDANCE_GUNS"]]
        self.assertEqual(sorted(off, key=["may shine", "off"].index), off)
        self.assertEqual(off[-1], "off")

    def test_a_run_that_breaks_off_leaves_no_gun_on(self):
        run = self.run_of()
        with open(os.path.join(run, "sweeps.csv"), encoding="utf-8") as file:
            lines = file.readlines()
        lines[len(lines) // 2] = "nan" + lines[len(lines) // 2]
        with open(os.path.join(run, "sweeps.csv"), "w", encoding="utf-8") as file:
            file.writelines(lines)
        striper("guide", "run", run, "-o", self.path("job"), "--to", f"candump:{self.path('log')}", code=1)
        dbc = Dbc(DBC)
        frames = [dbc.decode(number, data) for _, _, number, data in log_lines(self.path("log"))]
        guns = [values["gun0"] for name, values in frames if name == "GUIDANCE_GUNS"]
        self.assertIn(1.0, guns)
        self.assertEqual(guns[-1], 0.0)
        self.assertEqual([values["volts"] for name, values in frames if name == "GUIDANCE_LATERAL"][-1], 0.0)

    def test_an_output_that_cannot_be_leaves_the_earlier_job(self):
        run = self.run_of()
        striper("guide", "run", run, "-o", self.path("job"))
        with open(self.path("job", "lateral.csv"), encoding="utf-8") as file:
            before = file.read()
        striper("guide", "run", run, "-o", self.path("job"), "--to", "can:nosuch", code=1)
        with open(self.path("job", "lateral.csv"), encoding="utf-8") as file:
            self.assertEqual(file.read(), before)

    def test_lines_of_json_are_the_tables_too(self):
        run = self.run_of()
        done = striper("guide", "run", run, "-o", self.path("job"), "--to", "-", "--to", f"jsonl:{self.path('lines.jsonl')}")
        with open(self.path("lines.jsonl"), encoding="utf-8") as file:
            self.assertEqual(file.read(), done.stdout)
        lines = [json.loads(line) for line in done.stdout.splitlines()]
        for table in ("lateral", "guns", "seen", "faults"):
            found = [line for line in lines if line["table"] == table]
            rows = self.table(table + ".csv")
            self.assertEqual(len(found), len(rows))
            for line, row in zip(found, rows):
                self.assertEqual(["table", *row], list(line))
                for name, text in row.items():
                    self.assertEqual("" if line[name] is None else line[name] if isinstance(line[name], str) else float(line[name]),
                                     text if text == "" or isinstance(line[name], str) else float(text))
        switches = [line["is_on"] for line in lines if line["table"] == "switch"]
        self.assertEqual(switches, [i % 2 == 0 for i in range(len(switches))])
        self.assertGreater(len(switches), 6)
        self.assertEqual(lines[-1]["table"], "safe")

    def test_a_reader_that_stands_still_does_not_hold_ctrl_c_up(self):
        run = self.run_of()
        reader, writer = os.pipe()
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
        program = subprocess.Popen([STRIPER, "guide", "run", run, "-o", self.path("job"), "--to", "-"], stdout=writer,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(2)  # It would long be done.
        self.assertIsNone(program.poll())
        program.send_signal(signal.SIGINT)
        told = time.monotonic()
        _, said = program.communicate(timeout=at_most(20))
        self.assertLess(time.monotonic() - told, at_most(0.5))
        self.assertEqual(program.returncode, 1)
        self.assertIn("were not sent: nobody reads them", said)
        os.close(writer)
        os.close(reader)

    def test_no_output_replaces_what_the_run_reads_or_writes(self):
        run = self.run_of()
        for name in ("run/sweeps.csv", "run/guidance.yaml", "job/lateral.csv", "job/../job/guns.csv"):
            for scheme in ("jsonl", "candump"):
                said = striper("guide", "run", run, "-o", self.path("job"), "--to", f"{scheme}:{self.path(name)}", code=2).stderr
                self.assertIn("is read or written by this run", said)
        twice = ["--to", f"jsonl:{self.path('one')}", "--to", f"candump:{self.path('one')}"]
        self.assertIn("read or written", striper("guide", "run", run, "-o", self.path("job"), *twice, code=2).stderr)
        self.assertIn("already holds a run", striper("guide", "simulate", self.path("road.yaml"), "-o", run, code=2).stderr)

    def test_what_cannot_be_is_said(self):
        run = self.run_of()

        def said(code, *arguments):
            return striper("guide", "run", run, "-o", self.path("x"), *arguments, code=code).stderr
        self.assertIn("expected can:INTERFACE, candump:FILE, jsonl:FILE or -", said(2, "--to", "udp:1"))
        self.assertIn("write to the standard output", said(2, "--to", "-", "--json"))
        self.assertIn("write to the standard output", said(2, "--to", "-", "--to", "candump:-"))
        self.assertIn("id=3000", said(2, "--to", "candump:x.log?id=3000"))
        self.assertIn("can:nowhere7", said(1, "--to", "can:nowhere7"))
        self.assertIn("no/such", said(1, "--to", "candump:" + self.path("no/such/log")))
        self.assertIn("No space left", said(1, "--to", "candump:/dev/full"))


class Judged(WithRun):
    """Other people's reader of DBC files, from npm (stage `foreign`)."""

    def test_another_reader_gets_the_same(self):
        work = os.environ["CAN_JUDGE_WORK"]
        os.makedirs(work, exist_ok=True)
        here = os.path.dirname(os.path.abspath(__file__))
        if shutil.which("node") is None or shutil.which("npm") is None:
            self.skipTest("NO OTHER PROGRAM HAS READ OUR FRAMES: node and npm are not installed")
        for name in ("package.json", "package-lock.json", "judge.mjs"):
            shutil.copy(os.path.join(here, name), work)
        installed = subprocess.run(["npm", "ci"], cwd=work, capture_output=True, text=True, check=False)
        if installed.returncode != 0:
            self.skipTest(f"NO OTHER PROGRAM HAS READ OUR FRAMES: npm is not reached:\n{installed.stdout}{installed.stderr}")
        striper("guide", "run", self.run_of(mirror_stops_s=3.5), "-o", self.path("job"), "--to", f"candump:{self.path('log')}")
        done = subprocess.run(["node", "judge.mjs", DBC, self.path("log")], cwd=work, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        theirs = [json.loads(line) for line in done.stdout.splitlines()]
        dbc = Dbc(DBC)
        frames = list(log_lines(self.path("log")))
        self.assertEqual(len(theirs), len(frames))
        self.assertGreater(len(frames), 2000)
        for (_, _, number, data), their in zip(frames, theirs):
            name, values = dbc.decode(number, data)
            self.assertEqual(their["name"], name)
            words = dbc.messages[number]["signals"]
            for signal, value in their["values"].items():
                ours = values[signal]
                if isinstance(ours, str):
                    raw = next(raw for raw, word in words[signal]["words"].items() if word == ours)
                    ours = raw * words[signal]["step"]
                self.assertAlmostEqual(value, ours, places=6, msg=signal)


if __name__ == "__main__":
    unittest.main()
