# SPDX-License-Identifier: Apache-2.0
"""Proves with the virtual camera, over real packets on loopback, what the program promises of GigE
Vision: that scans from a camera are those of the simulator, that cameras are listed, that the laser is
commanded off however a capture ends, that other GenICam programs work with our camera and we with
another maker's, and that `striper doctor` tells one trouble from the other. Does not prove anything of
a real network: see gige_network_test.py.

Run by ctest; by hand: STRIPER=build/release/apps/striper/striper python3 gige_test.py
"""
import csv
import fcntl
import io
import itertools
import json
import math
import os
import re
import resource
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest
import xml.etree.ElementTree

from program import STRIPER, InScratch, run, scene_path, striper

WALL = scene_path("wall.yaml")
ROOM = scene_path("room.yaml")
# Of the same wall, a small camera: rendered in no time.
SMALL = """striper_scene: 1
camera: {width: 160, height: 120, fov_deg: 55, lens: plumb_bob, distortion: [-0.2, 0.05, 0, 0, 0]}
imager: {blur_px: 0.5, black_level_dn: BLACK, dn_per_electron: GAIN, bits: BITS REGION}
noise: {shot: yes, read_e: 20, seed: 2002}
timing: {picture_rate_hz: 20, cadence: "CADENCE"}
lasers:
  - {position_m: [0, 0, -0.5], fan_deg: 60, thickness_deg: 0.3, wavelength_nm: 900, pulse_uj: 10.4}
objects:
  - {name: wall, shape: plane, position_m: [2, 0, 0], reflectance: 0.5}
"""
LINE_STATUS_ALL = 0x1006C
_addresses = itertools.count(1)


def small_scene(bits=8, cadence="0", region=""):
    gain = 0.02 * 2 ** (bits - 8)
    region = f", region: [{region}]" if region else ""
    return (
        SMALL.replace("BLACK", str(2 ** (bits - 5))).replace("GAIN", str(gain)).replace("BITS", str(bits))
        .replace(" REGION", region).replace("CADENCE", cadence)
    )


def own_address():
    """One of this machine that no other test uses; the C++ tests keep below 127.216."""
    pid = os.getpid()
    return f"127.{216 + pid % 38}.{pid // 38 % 250 + 1}.{next(_addresses)}"


def read_register(address, register):
    """Reads a register as any program may, without control of the camera (GigE Vision 1.2, 16.3)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(5)
        client.sendto(struct.pack(">BBHHHI", 0x42, 1, 0x80, 4, 7, register), (address, 3956))
        status, _, _, _, value = struct.unpack(">HHHHI", client.recv(64))
    assert status == 0, f"register 0x{register:x} is refused: 0x{status:x}"
    return value


class VirtualCamera:
    """`striper virtual-camera` for as long as the `with` lasts."""

    def __init__(self, scene, *options, registers=None):
        self.address = own_address()
        self.serial = "E" + self.address.replace("127.", "").replace(".", "-")
        self.registers = registers
        self.arguments = [STRIPER, "virtual-camera", scene, "--address", self.address]
        self.arguments += ["--serial", self.serial, *options]
        if registers:
            self.arguments += ["--registers", registers]

    def __enter__(self):
        # pylint: disable=consider-using-with
        self.program = subprocess.Popen(self.arguments, stderr=subprocess.PIPE, text=True)
        line = self.program.stderr.readline()
        if "is gige:" not in line:
            raise AssertionError(f"{self.arguments}\n{line}{self.program.stderr.read()}")
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        if self.program.poll() is None:
            self.program.send_signal(signal.SIGINT)
        return self.program.communicate(timeout=20)[1]

    def uri(self, query=""):
        """A machine that is busy with other tests is no reason to give a frame up."""
        return f"gige:{self.address}?frame_timeout_ms=3000" + (f"&{query}" if query else "")

    def writes(self):
        """What clients set, once the camera was stopped."""
        with open(self.registers, encoding="utf-8") as file:
            return list(csv.DictReader(file))


class Gige(InScratch):
    def start_capture(self, uri, *options):
        """A capture that runs until it is told to end; returns when it is at work."""
        program = subprocess.Popen(
            [STRIPER, "capture", uri, *options],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )

        def end():
            if program.poll() is None:
                program.kill()
            program.communicate()

        self.addCleanup(end)
        lines = [program.stdout.readline() for _ in range(2)]  # the header and a return: it is at work
        if not all(lines):
            self.fail(f"{uri}: {program.communicate()[1]}")
        return program


class CaptureEqualsSimulator(Gige):
    """`striper capture gige:...` against `striper capture sim:...`, column by column."""

    def check(self, scene, gige_query="", sim_query="", options=(), sim_scene=None, frames=4, least=100):
        model_from = self.path(f"truth{len(os.listdir(self.scratch))}")
        striper("simulate", scene, "-o", model_from, "--frames", "1")
        common = ["--model", os.path.join(model_from, "model.yaml"), "--frames", str(frames), *options]
        simulated = f"sim:{sim_scene or scene}?frames={frames}" + (f"&{sim_query}" if sim_query else "")
        expected = self.rows(striper("capture", simulated, *common))
        with VirtualCamera(scene) as camera:
            got = self.rows(striper("capture", camera.uri(gige_query), *common))
        self.assertGreater(len(expected), least, "there is something to compare")
        self.assertEqual(len(got), len(expected))
        for one, other in zip(got, expected):
            for column in one:
                if column != "time_s":
                    self.assert_same(column, one[column], other[column])

    def rows(self, done):
        return list(csv.DictReader(io.StringIO(done.stdout)))

    def assert_same(self, column, one, other):
        if column.endswith("_m") and one and other:
            one, other = float(one), float(other)
            self.assertTrue(one == other or math.isclose(one, other, rel_tol=0, abs_tol=1e-9), column)
        else:
            self.assertEqual(one, other, column)

    def test_wall(self):
        self.check(WALL, "fps=10", least=2000)

    def test_cluttered_room_with_every_column(self):
        self.check(ROOM, "fps=10", options=["--missing"], frames=2, least=1200)

    def test_laser_that_the_camera_switches(self):
        scene = self.write("small.yaml", small_scene(cadence="0,dark"))
        self.check(scene, "strobe=Line2&laser=0,dark", "laser=0,dark", options=["--doubtful"])

    def test_laser_that_the_host_switches(self):
        scene = self.write("small.yaml", small_scene(cadence="0,dark"))
        query = "strobe=Line2&laser=0,dark&switching=host"
        self.check(scene, query, "laser=0,dark", options=["--doubtful"])

    def test_region_of_interest(self):
        scene = self.write("small.yaml", small_scene())
        part = self.write("part.yaml", small_scene(region="32, 40, 96, 64"))
        self.check(scene, "roi=32,40,96,64", sim_scene=part)

    def test_bit_depths(self):
        for bits in (8, 12, 16):
            with self.subTest(bits=bits):
                scene = self.write(f"small{bits}.yaml", small_scene(bits=bits))
                self.check(scene, f"pixel_format=Mono{bits}")


class Recording(Gige):
    """`striper record gige:...`: the frames that were kept give the scans that were made while they came."""

    def check(self, scene, query="", frames=12):
        truth = self.path(f"truth{len(os.listdir(self.scratch))}")
        striper("simulate", scene, "-o", truth, "--frames", "1")
        model = os.path.join(truth, "model.yaml")
        run_file = os.path.join(truth, "run.mcap")
        with VirtualCamera(scene) as camera:
            striper("record", camera.uri(query), "-o", run_file, "--model", model, "--frames", frames)
        live = os.path.join(truth, "live.csv")
        striper("convert", run_file, "-o", live, "--missing")
        again = striper("capture", "mcap:" + run_file, "--model", model, "--missing").stdout
        with open(live, encoding="utf-8") as file:
            self.assertEqual(again, file.read())
        self.assertGreater(again.count(",ok"), 500)

    def test_bit_depths(self):
        for bits in (8, 12, 16):
            with self.subTest(bits=bits):
                self.check(self.write(f"small{bits}.yaml", small_scene(bits=bits)), f"pixel_format=Mono{bits}")

    def test_laser_that_the_camera_switches(self):
        scene = self.write("small.yaml", small_scene(cadence="0,dark"))
        self.check(scene, "strobe=Line2&laser=0,dark")


class Devices(Gige):
    def listed(self, camera):
        cameras = json.loads(striper("devices", "--json").stdout)["cameras"]
        ours = [one for one in cameras if one["address"] == camera.address]
        self.assertEqual(len(ours), 1, cameras)
        return ours[0]

    def test_what_names_a_camera_and_who_holds_it(self):
        with VirtualCamera(self.write("small.yaml", small_scene())) as camera:
            one = self.listed(camera)
            self.assertEqual(one["uri"], "gige:" + camera.serial)
            self.assertEqual(one["kind"], "gige")
            self.assertEqual(one["name"], "Striper VirtualStriper")
            self.assertEqual(one["serial"], camera.serial)
            self.assertEqual(one["access"], "free")
            self.assertIn("gige:" + camera.address, one["other_uris"])
            striper("capture", one["uri"], "--frames", "2", "-o", self.path("scans.csv"))

            program = self.start_capture(camera.uri())
            self.assertRegex(self.listed(camera)["access"], r"^held by 127\.0\.0\.1:\d+$")
            text = striper("devices").stdout
            self.assertIn(f"gige:{camera.serial}\n  Striper VirtualStriper {camera.serial}", text)
            self.assertRegex(text, r"held by 127\.0\.0\.1:\d+")
            refused = striper("capture", camera.uri(), "--frames", "1", code=1)
            self.assertIn("busy: held by another program (127.0.0.1:", refused.stderr)
            program.send_signal(signal.SIGINT)
            program.communicate(timeout=20)
            self.assertEqual(self.listed(camera)["access"], "free")


class Lost(Gige):
    def end_of(self, command, *options):
        """What a command says, and how long after the camera was lost it ends."""
        with VirtualCamera(self.write("small.yaml", small_scene())) as camera:
            program = subprocess.Popen(
                [STRIPER, command, camera.uri("reconnect=no"), *options],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            )
            self.addCleanup(program.kill)
            self.assertIn("Striper VirtualStriper", self.line_with(program, "Mono8"))
            time.sleep(1.0)
            camera.program.kill()
            lost_at = time.monotonic()
            stdout, stderr = program.communicate(timeout=20)
            return program.returncode, stdout, stderr, time.monotonic() - lost_at

    def line_with(self, program, word):
        for line in program.stderr:
            if word in line:
                return line
        return self.fail(f"it ended without '{word}'")

    def test_camera_that_is_not_to_be_opened_again(self):
        scans = self.path("scans.csv")
        code, stdout, stderr, seconds = self.end_of("capture", "-o", scans, "--json")
        self.assertEqual(code, 1, stderr)
        self.assertLess(seconds, 3.0)
        self.assertRegex(stderr, r"error: camera Striper VirtualStriper \S+ is lost: .*; the stream ends")
        self.assertIn("; the camera was lost", stderr)
        self.assertTrue(json.loads(stdout)["lost"])
        with open(scans, encoding="utf-8") as file:
            self.assertTrue(file.read().endswith("ok\n"), "what was scanned is kept whole")

    def test_record_too(self):
        code, _, stderr, seconds = self.end_of("record", "-o", self.path("rec"))
        self.assertEqual(code, 1, stderr)
        self.assertLess(seconds, 3.0)
        self.assertIn("the camera was lost", stderr)
        striper("capture", "images:" + self.path("rec"), "-o", self.path("scans.csv"))


class LaserOff(Gige):
    """Whatever ends a capture, the last thing that the camera hears of its laser is off."""

    QUERY = "strobe=Line2&laser=0,dark"

    def check_writes(self, camera):
        camera.stop()
        writes = camera.writes()
        names = [one["register"] for one in writes]
        self.assertTrue(any(one["laser_armed"] == "1" for one in writes), "it was never on")
        stopped = len(names) - 1 - names[::-1].index("AcquisitionStop")
        self.assertEqual(writes[-1]["register"], "ControlChannelPrivilege")
        self.assertEqual(writes[-1]["laser_armed"], "0")
        off = writes[-2]
        self.assertEqual((off["register"], off["value"]), ("LineSource", "0"), "its own command")
        self.assertEqual(off["laser_armed"], "0")
        self.assertLess(stopped, len(writes) - 2)

    def test_after_ctrl_c_and_sigterm(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            for way in ("", "&switching=host"):
                with self.subTest(signal=number.name, way=way):
                    scene = self.write("small.yaml", small_scene())
                    with VirtualCamera(scene, registers=self.path("writes.csv")) as camera:
                        program = self.start_capture(camera.uri(self.QUERY + way))
                        program.send_signal(number)
                        program.communicate(timeout=20)
                        self.check_writes(camera)

    def test_after_a_disk_that_fills_up(self):
        with VirtualCamera(
            self.write("small.yaml", small_scene()), registers=self.path("writes.csv")
        ) as camera:
            done = run(
                STRIPER, "capture", camera.uri(self.QUERY), "-o", self.path("scans.csv"), code=1,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50000, 50000)),
            )
            self.assertIn("File too large", done.stderr)
            self.check_writes(camera)

    def test_the_camera_does_it_when_the_program_is_killed(self):
        with VirtualCamera(self.write("small.yaml", small_scene())) as camera:
            program = self.start_capture(camera.uri("strobe=Line2&heartbeat_ms=1500"))
            self.assertEqual(read_register(camera.address, LINE_STATUS_ALL), 4)
            program.kill()
            deadline = time.monotonic() + 10
            while read_register(camera.address, LINE_STATUS_ALL) and time.monotonic() < deadline:
                time.sleep(0.1)
            self.assertEqual(read_register(camera.address, LINE_STATUS_ALL), 0)


class OtherClients(Gige):
    """Aravis' own programs, which know nothing of ours (Debian: aravis-tools, aravis-tools-cli)."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="striper-test-")
        scene = os.path.join(cls.folder.name, "small.yaml")
        with open(scene, "w", encoding="utf-8") as file:
            file.write(small_scene())
        cls.camera = VirtualCamera(scene).__enter__()

    @classmethod
    def tearDownClass(cls):
        cls.camera.stop()
        cls.folder.cleanup()

    def arv_tool(self, *arguments):
        done = run("arv-tool-0.8", "-a", self.camera.address, *arguments)
        self.assertNotIn("error", (done.stdout + done.stderr).lower())
        return done.stdout

    def test_arv_tool_finds_it(self):
        listing = run("arv-tool-0.8").stdout
        self.assertIn(f"Striper-{self.camera.serial} ({self.camera.address})", listing)

    def test_arv_tool_reads_a_description_that_is_xml(self):
        text = self.arv_tool("genicam")
        root = xml.etree.ElementTree.fromstring(text[text.index("<?xml"):].encode())
        self.assertTrue(root.tag.endswith("RegisterDescription"))

    def test_arv_tool_reads_every_value(self):
        values = self.arv_tool("values")
        for name in ("Width", "PixelFormat", "ExposureTime", "LineSource", "SequencerMode", "PtpStatus"):
            self.assertRegex(values, rf"\b{name}\b")
        self.assertRegex(values, rf"'DeviceSerialNumber' = '{self.camera.serial}'")

    def test_arv_tool_sets_what_we_read_back(self):
        said = self.arv_tool("control", "Width=64", "OffsetX=32", "Height=120", "ExposureTime=250",
                             "Gain=6", "PixelFormat=Mono12")
        for words in ("Width = 64", "OffsetX = 32", "ExposureTime = 250", "Gain = 6", "Mono12"):
            self.assertIn(words, said)
        done = striper("doctor", self.camera.uri(), "--seconds", "0.5", code=None)
        self.assertIn("Mono12 64x120", done.stdout)
        self.arv_tool("control", "OffsetX=0", "Width=160", "PixelFormat=Mono8", "Gain=0")

    def test_arv_tool_is_refused_what_is_out_of_range(self):
        before = self.arv_tool("control", "Gain")
        done = run(
            "arv-tool-0.8", "-a", self.camera.address, "--range-check=enable", "control", "Gain=99",
            code=None,
        )
        self.assertIn("Gain", done.stdout + done.stderr)
        self.assertEqual(self.arv_tool("control", "Gain"), before)

    def test_arv_camera_test_streams_without_loss(self):
        done = run(
            "arv-camera-test-0.8", "-n", self.camera.address, "-f", "50", "-e", "500", "-w", "128",
            "-h", "96", "--no-packet-socket", "--duration", "3",
        )
        text = done.stdout + done.stderr
        counts = {name: int(count) for name, count in re.findall(r"(?m)^n_(\w+) += (\d+)$", text)}
        self.assertGreater(counts["completed_buffers"], 20, text)
        for trouble in ("failures", "aborted", "missing_frames", "size_mismatch_errors",
                        "error_packets", "ignored_packets"):
            self.assertEqual(counts[trouble], 0, text)


class AnotherMakersCamera(Gige):
    """Our source with `arv-fake-gv-camera-0.8` as it is shipped, which is always at 127.0.0.1."""

    def setUp(self):
        super().setUp()
        # Shared with the C++ test of the same camera.
        lock = open(os.path.join(tempfile.gettempdir(), "striper-aravis-fake-camera.lock"), "w",
                    encoding="utf-8")
        self.addCleanup(lock.close)
        fcntl.flock(lock, fcntl.LOCK_EX)
        self.camera = subprocess.Popen(
            ["arv-fake-gv-camera-0.8", "-i", "127.0.0.1", "-s", "SHIPPED"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        self.addCleanup(self.camera.wait)
        self.addCleanup(self.camera.terminate)
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            if "SHIPPED" in striper("devices").stdout:
                return
        self.fail("arv-fake-gv-camera-0.8 does not answer")

    def test_lists_records_and_scans(self):
        listed = striper("devices").stdout
        self.assertIn("gige:SHIPPED\n  Aravis Fake SHIPPED (GigE Vision on lo, 127.0.0.1), free", listed)
        uri = "gige:SHIPPED?roi=0,0,320,240&fps=25&exposure_us=1000"
        done = striper("record", uri, "-o", self.path("frames"), "--frames", "10")
        self.assertIn("10 frames", done.stderr)
        with open(self.path("frames/frames.csv"), encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual([row["sequence"] for row in rows], [str(n) for n in range(10)])
        striper("capture", uri, "--frames", "5", "--missing", "-o", self.path("scans.csv"))


class Doctor(Gige):
    """Each trouble is told from the others, with its cure. What it says of images is in doctor_test.py."""

    def findings(self, source, code, seconds="1"):
        done = striper("doctor", source, "--seconds", seconds, "--json", code=code)
        return json.loads(done.stdout)["findings"]

    def check(self, findings, severity, what, cure):
        for one in findings:
            if re.search(what, one["what"]):
                self.assertEqual(one["severity"], severity, one)
                self.assertIn(cure, one["cure"])
                return
        self.fail(f"nobody says '{what}': {findings}")

    def test_no_such_camera(self):
        with VirtualCamera(self.write("small.yaml", small_scene())):
            self.check(self.findings("gige:NOBODY", 1), "bad", "no camera 'NOBODY'; there are", "name one")

    def test_held_by_another_program(self):
        with VirtualCamera(self.write("small.yaml", small_scene())) as camera:
            self.start_capture(camera.uri())
            findings = self.findings(camera.uri(), 1)
            self.check(findings, "bad", r"held by another program \(127\.0\.0\.1:\d+\)", "stop that")

    def test_mtu_too_small(self):
        with VirtualCamera(self.write("small.yaml", small_scene()), "--mtu", "1500") as camera:
            findings = self.findings(camera.uri("packet_size=8000"), 1)
            self.check(findings, "bad", "MTU is too small.*of 1400 bytes arrive, those of 8000", "packet_size=1400")
            self.findings(camera.uri(), 0)

    def test_trigger_that_never_comes(self):
        with VirtualCamera(self.write("small.yaml", small_scene())) as camera:
            findings = self.findings(camera.uri("trigger=Line1"), 1)
            self.check(findings, "bad", "test packets arrive and frames do not", "trigger")

    def test_packets_lost(self):
        with VirtualCamera(
            self.write("small.yaml", small_scene()), "--lost-packets", "0.05"
        ) as camera:
            findings = self.findings(camera.uri("packet_size=1400"), 0, "2")
            self.check(findings, "doubtful", r"\d+ packets were lost and asked for again", "cable, switch")
            findings = self.findings(camera.uri("packet_size=1400&resend=no"), 1, "2")
            self.check(findings, "bad", "frames lost on the way", "net.core.rmem_max")


if __name__ == "__main__":
    unittest.main()
