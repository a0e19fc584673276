# SPDX-License-Identifier: Apache-2.0
"""Proves of `striper serve --to ros2:` that programs with other makers' generated types get what the CSV beside it
holds, to float32, under ROS 2's names, types and hashes. In a network namespace of its own, so that nobody else's programs
hear or are heard; needs the right to make one and skips without. What it does not prove: that ROS 2 itself is content,
which cannot run here.

Run by ctest; by hand, as root: STRIPER=... CYCLONE_SUBSCRIBER=... python3 ros2_test.py
"""
import csv
import json
import math
import os
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.environ["STRIPER_SOURCE_DIR"], "tests/end_to_end"))
from gige_test import small_scene  # noqa: E402
from program import STRIPER, InScratch, striper  # noqa: E402

CYCLONE = os.environ.get("CYCLONE_SUBSCRIBER", "")
# Of ROS 2 Jazzy's packages and public programs, not of our own calculator.
HASHES = {
    "sensor_msgs::msg::dds_::LaserScan_": "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "sensor_msgs::msg::dds_::PointCloud2_": "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "sensor_msgs::msg::dds_::CameraInfo_": "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
    "diagnostic_msgs::msg::dds_::DiagnosticArray_": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "tf2_msgs::msg::dds_::TFMessage_": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
# Name, offset, datatype (7 float32, 2 uint8), count.
POINT_FIELDS = [[name, 4 * i, 7, 1] for i, name in
                enumerate("x y z intensity sigma sigma_cal width confidence".split())] + [["status", 32, 2, 1]]
FLOAT_COLUMNS = {"x": "x_m", "y": "y_m", "intensity": "intensity", "sigma": "sigma_m", "sigma_cal": "sigma_cal_m",
                 "width": "width_px", "confidence": "confidence"}


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


class Namespace:
    """A network of its own, in which programs are started. Lives as long as a process in it."""

    def __init__(self, test):
        # pylint: disable=consider-using-with
        self.keeper = subprocess.Popen(["unshare", "-n", "sh", "-c", "ip link set lo up && echo up && exec sleep 600"],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        test.addCleanup(self.end)
        if self.keeper.stdout.readline() != "up\n":
            test.skipTest(f"no right to make a network namespace: {self.keeper.stderr.read()}")

    def end(self):
        self.keeper.kill()
        self.keeper.communicate()

    def command(self, *words):
        return ["nsenter", "-n", "-t", str(self.keeper.pid), *(str(word) for word in words)]


class Program:
    """A program whose output is read as it comes, so that it never waits for us. `lines` are its JSON lines."""

    def __init__(self, test, space, *words, env=None):
        # pylint: disable=consider-using-with
        self.test = test
        self.process = subprocess.Popen(space.command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        env={**os.environ, **(env or {})})
        self.lines, self.errors = [], []
        self.readers = [threading.Thread(target=self.read, args=pair, daemon=True) for pair in
                        ((self.process.stdout, self.lines), (self.process.stderr, self.errors))]
        for reader in self.readers:
            reader.start()
        test.addCleanup(self.kill)

    @staticmethod
    def read(stream, lines):
        for line in stream:
            lines.append(line)

    def kill(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
        self.process.wait()
        for reader in self.readers:
            reader.join()
        for stream in (self.process.stdout, self.process.stderr):
            stream.close()

    def wait_for(self, word, seconds=20, where="errors"):
        end = time.monotonic() + seconds
        while not any(word in line for line in getattr(self, where)):
            self.test.assertLess(time.monotonic(), end, f"no '{word}' in {getattr(self, where)[-20:]}")
            self.test.assertIsNone(self.process.poll(), "".join(self.errors))
            time.sleep(0.02)

    def end(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        return self.wait()

    def wait(self):
        self.process.wait(timeout=60)
        for reader in self.readers:
            reader.join()
        return "".join(self.errors)

    def messages(self, topic):
        return [line["message"] for line in map(json.loads, self.lines) if line.get("topic") == topic]


class Ros2(InScratch):
    def setUp(self):
        super().setUp()
        self.space = Namespace(self)
        self.scene = self.write("small.yaml", small_scene())
        striper("simulate", self.scene, "-o", self.path("made"), "--frames", "1")
        self.model = self.path("made", "model.yaml")

    def serve(self, *options, fps=20, space=None, env=None):
        # Beyond the wall's distance at the rim returns are missing, so that there are some of all kinds.
        return Program(self, space or self.space, STRIPER, "serve", f"sim:{self.scene}?realtime=yes&fps={fps}",
                       "-m", self.model, "--max-range", "2.1", *options, env=env)

    def subscribe(self, seconds, *options, space=None, program=CYCLONE, namespace="/striper", env=None):
        heard = Program(self, space or self.space, program, namespace, seconds, *options,
                        env={"CYCLONEDDS_URI": LOOPBACK, **(env or {})})
        heard.wait_for("ready", where="lines")
        return heard

    def table(self, name):
        """The CSV's lines by stamp in whole nanoseconds: header.stamp has no more."""
        scans = {}
        with open(self.path(name), encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                scans.setdefault(row["time_s"], []).append(row)
        return scans

    def scan_of(self, message, table):
        """The CSV's scan that a message is of: within 1 us."""
        stamp = message["header"]["sec"] + message["header"]["nanosec"] / 1e9
        near = [rows for time_s, rows in table.items() if abs(float(time_s) - stamp) < 1e-6]
        self.assertEqual(len(near), 1, stamp)
        return near[0]

    def check_points(self, message, rows):
        self.assertEqual(message["header"]["frame_id"], "striper_scan0")
        self.assertEqual(message["fields"], POINT_FIELDS)
        self.assertEqual([message[key] for key in ("height", "width", "point_step", "row_step")],
                         [1, len(rows), 36, 36 * len(rows)])
        self.assertFalse(message["is_bigendian"] or message["is_dense"])
        data = bytes.fromhex(message["data"])
        self.assertEqual(len(data), 36 * len(rows))
        for i, row in enumerate(rows):
            values = dict(zip(FLOAT_NAMES, struct.unpack_from("<8f", data, 36 * i)))
            for name, column in FLOAT_COLUMNS.items():
                self.check_same(values[name], row[column], (i, name))
            self.assertEqual(data[36 * i + 32] == 0, row["status"] == "ok")

    def check_same(self, value, text, what):
        if text == "":
            self.assertTrue(math.isnan(value), what)
        else:
            self.assertEqual(value, float32(float(text)), what)

    def check_scan(self, message, rows):
        """Each bearing against the CSV's returns, searched one by one."""
        lowest, step, ranges = message["angle_min"], message["angle_increment"], message["ranges"]
        self.assertEqual(len(ranges), len(rows))
        self.assertAlmostEqual(lowest + (len(ranges) - 1) * step, message["angle_max"], delta=1e-5)
        self.assertEqual((message["time_increment"], message["range_min"], message["range_max"]),
                         (0, float32(0.1), 10))
        self.assertIn(len(message["intensities"]), (0, len(ranges)))
        known = [row for row in rows if row["range_m"] != ""]
        for i, value in enumerate(ranges):
            at = lowest + i * step
            near = sorted((abs(float(row["bearing_rad"]) - at), row["range_m"], row["status"]) for row in known)[:2]
            if not near or near[0][0] > 1.001 * step:
                self.assertEqual(value, "inf", i)
            elif near[0][0] < 0.999 * step and (len(near) == 1 or near[1][0] - near[0][0] > 1e-6):
                expected = float32(float(near[0][1])) if near[0][2] == "ok" else None
                self.assertEqual(value, expected, i)


FLOAT_NAMES = [field[0] for field in POINT_FIELDS[:8]]
LOOPBACK = ("<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface name='lo'/></Interfaces></General>"
            "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>"
            "<Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>")


class Judged(Ros2):
    def judge(self, heard, name):
        """All five topics of a head against the CSV beside them and the model."""
        table = self.table(name)
        points, scans = heard.messages("/striper/points"), heard.messages("/striper/scan")
        self.assertGreater(min(len(points), len(scans)), 5)
        for message in points[:10]:
            self.check_points(message, self.scan_of(message, table))
        for message in scans[:10]:
            self.check_scan(message, self.scan_of(message, table))
        grids = {(len(m["ranges"]), m["angle_min"], m["angle_max"], m["angle_increment"]) for m in scans}
        self.assertEqual(len(grids), 1)
        every_range = [value for message in scans for value in message["ranges"]]
        self.assertIn("inf", every_range)
        self.assertGreater(sum(isinstance(value, float) for value in every_range), 100)
        self.check_camera(heard.messages("/striper/camera_info")[0])
        self.check_transforms(heard.messages("/tf_static")[0])
        self.check_diagnostics(heard.messages("/diagnostics"))

    def check_camera(self, message):
        self.assertEqual(message["header"]["frame_id"], "striper_camera_optical")
        self.assertEqual([message["width"], message["height"]], [160, 120])
        self.assertEqual(message["distortion_model"], "plumb_bob")
        self.assertEqual(message["d"][:2], [-0.2, 0.05])
        fx, _, cx, _, fy, cy, *last = message["k"]
        self.assertAlmostEqual(fx, 80 / math.tan(math.radians(27.5)), places=6)
        self.assertEqual(last, [0, 0, 1])
        self.assertEqual(message["p"], [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0])
        self.assertEqual(message["r"], [1, 0, 0, 0, 1, 0, 0, 0, 1])

    def check_transforms(self, message):
        found = {one["child"]: one for one in message["transforms"]}
        self.assertEqual(set(found), {"striper_camera_optical", "striper_scan0"})
        self.assertEqual({one["header"]["frame_id"] for one in message["transforms"]}, {"striper"})
        camera = found["striper_camera_optical"]
        self.assertEqual(camera["translation"], [0, 0, 0])
        # x = z_cam, y = -x_cam, z = -y_cam: the quaternion of ROS' optical frames, REP 103.
        for value, expected in zip(camera["rotation"], (-0.5, 0.5, -0.5, 0.5)):
            self.assertAlmostEqual(value * math.copysign(1, camera["rotation"][3]), expected)
        self.assertAlmostEqual(math.hypot(*found["striper_scan0"]["rotation"]), 1)

    def check_diagnostics(self, messages):
        self.assertGreater(len(messages), 1)
        status = messages[-1]["status"][0]
        self.assertEqual((status["name"], status["level"], status["message"]), ("striper: scanner", 0, "scanning"))
        self.assertGreater(int(status["values"]["scans"]), 5)

    def check_names(self, heard):
        writers = {line["writer"]: line for line in map(json.loads, heard.lines) if "writer" in line}
        for topic in ("/striper/points", "/striper/scan", "/striper/camera_info", "/tf_static", "/diagnostics"):
            writer = writers["rt" + topic]
            self.assertEqual(writer["user_data"], f"typehash=RIHS01_{HASHES[writer['type']]};")


class Messages(Judged):
    def test_are_the_csv_in_cyclone_dds(self):
        heard = self.subscribe(7)
        server = self.serve("--to", "csv:" + self.path("a.csv") + "?missing=yes&doubtful=yes", "--to", "ros2:")
        heard.wait()
        log = server.end()
        self.assertIn("topics_offered: ", log)
        self.assertIn("on lo, for this machine alone (by the default)", log)
        self.judge(heard, "a.csv")
        self.check_names(heard)

    def test_images_are_raw_and_compressed(self):
        heard = self.subscribe(5)
        server = self.serve("--to", "csv:" + self.path("a.csv"), "--to", "ros2:?frames=5&images=both", fps=10)
        heard.wait()
        server.end()
        raw, compressed = heard.messages("/striper/image_raw"), heard.messages("/striper/image_raw/compressed")
        self.assertGreater(min(len(raw), len(compressed)), 5)
        self.assertLess(len(raw), 5 * 5 + 2)
        for message in raw:
            self.assertEqual((message["encoding"], message["width"], message["height"], message["step"]), ("mono8", 160, 120, 160))
        stamp = raw[5]["header"]
        (same,) = [message for message in compressed if message["header"] == stamp]
        self.assertEqual(same["format"], "mono8; jpeg compressed mono8")
        # The stripe that our own program finds in the one lies where it lies in the other.
        rows = []
        for name, data in (("raw.pgm", b"P5 160 120 255\n" + bytes.fromhex(raw[5]["data"])), ("small.jpg", bytes.fromhex(same["data"]))):
            with open(self.path(name), "wb") as file:
                file.write(data)
            striper("capture", "images:" + self.path(name), "-o", self.path(name + ".csv"))
            (scan,) = self.table(name + ".csv").values()
            rows.append({row["u_px"]: float(row["v_px"]) for row in scan})
        both = rows[0].keys() & rows[1].keys()
        self.assertGreater(len(both), 100)
        differences = sorted(abs(rows[0][u] - rows[1][u]) for u in both)
        self.assertLess(differences[len(differences) // 2], 0.1)

    def test_addresses_that_are_wrong_are_refused(self):
        for sink, said in (("ros2:?qos=fast", "reliable or best_effort"), ("ros2:?domain=233", "domain"),
                           ("ros2:a//b", "no prefix"), ("ros2:9", "no prefix"), ("ros2:?qs=1", "qs"), ("ros2:?node=jazzy", "off, humble, iron or auto"),
                           ("ros2:?frames=1&images=png", "raw, compressed or both"),
                           ("ros2:?interface=a%20b", "interface")):
            done = striper("serve", "sim:" + self.scene, "-m", self.model, "--to", sink, code=2)
            self.assertIn(said, done.stderr)
        done = striper("serve", "sim:" + self.scene, "-m", self.model, "--to", "ros2:", code=2,
                       env={**os.environ, "ROS_DOMAIN_ID": "x"})
        self.assertIn("ROS_DOMAIN_ID", done.stderr)

    def test_an_interface_that_is_not_there_is_said(self):
        server = self.serve("--to", "ros2:?interface=eth77")
        server.process.wait(timeout=30)
        self.assertIn("eth77", server.wait())
        self.assertEqual(server.process.returncode, 1)


class Nodes(Ros2):
    """`node=`: who of ROS 2's programs is told which node has the topics."""

    def other(self, release, seconds=9):
        program = Program(self, self.space, os.environ["CYCLONE_NODE"], release, seconds, env={"CYCLONEDDS_URI": LOOPBACK})
        program.wait_for("ready", where="lines")
        return program

    @staticmethod
    def said(program, key):
        return [line[key] for line in map(json.loads, program.lines) if key in line]

    def check_node(self, heard, gid_bytes, namespace="/"):
        nodes = self.said(heard, "node")
        self.assertTrue(nodes, "".join(heard.errors))
        node = nodes[-1]
        self.assertEqual((node["namespace"], node["name"], node["readers"]), (namespace, "striper", []))
        padding = "00" * (gid_bytes - 16)
        topics = {one["gid"] + padding: one["topic"] for one in self.said(heard, "writer")}
        prefix = "rt" + namespace.rstrip("/") + "/striper/"
        self.assertEqual({topics[gid] for gid in node["writers"]},
                         {prefix + "points", prefix + "scan", prefix + "camera_info", "rt/tf_static", "rt/diagnostics"})
        participants = {one["gid"] + padding: one["user_data"] for one in self.said(heard, "participant")}
        self.assertEqual(participants[node["gid"]], "enclave=/;")

    def run_beside(self, releases, node):
        heard = [self.other(release) for release in releases]
        server = self.serve("--to", "csv:" + self.path("a.csv"), "--to", f"ros2:truck?node={node}")
        for one in heard:
            one.wait()
        return heard, server.end()

    def test_are_told_to_the_release_that_is_named(self):
        for release, gid_bytes in (("humble", 24), ("iron", 16)):
            (heard,), log = self.run_beside([release], release)
            self.check_node(heard, gid_bytes, "/truck")
            self.assertIn("node_announced", log)
            said = {one["user_data"] for one in self.said(heard, "writer") if one["topic"] == "ros_discovery_info" and
                    one["gid"][:32] != self.said(heard, "participant")[0]["gid"][:32]}
            self.assertEqual(any("typehash=RIHS01_91a0593b" in text for text in said), release == "iron")

    def test_are_told_to_the_release_that_is_heard(self):
        for release, gid_bytes in (("humble", 24), ("iron", 16)):
            (heard,), log = self.run_beside([release], "auto")
            self.check_node(heard, gid_bytes, "/truck")
            self.assertIn("node_announced", log)

    def test_are_told_to_nobody_where_both_are(self):
        heard, log = self.run_beside(["humble", "iron"], "auto")
        self.assertIn("node_withheld: warning", log)
        for one in heard:
            self.assertEqual(self.said(one, "node"), [])

    def test_are_told_to_nobody_by_default(self):
        (heard,), log = self.run_beside(["iron"], "off")
        self.assertNotIn("node_announced", log)
        self.assertEqual(self.said(heard, "node"), [])
        self.assertNotIn("enclave=/;", {one["user_data"] for one in self.said(heard, "participant")})


class Readers(Ros2):
    """That come late, come and go, stop, or want less."""

    def csv(self, name="a.csv"):
        return "csv:" + self.path(name)

    def test_that_come_late_get_the_transforms(self):
        server = self.serve("--to", self.csv(), "--to", "ros2:truck/left?qos=best_effort")
        server.wait_for("topics_offered")
        time.sleep(2)
        heard = self.subscribe(4, "best_effort", namespace="/truck/left/striper")
        heard.wait()
        server.end()
        self.assertEqual(len(heard.messages("/tf_static")), 1)
        self.assertGreater(len(heard.messages("/truck/left/striper/points")), 10)

    def test_that_want_reliable_do_not_match_best_effort(self):
        server = self.serve("--to", self.csv(), "--to", "ros2:?qos=best_effort")
        heard = self.subscribe(3)
        heard.wait()
        server.end()
        self.assertEqual(heard.messages("/striper/points"), [])
        self.assertEqual(len(heard.messages("/tf_static")), 1)

    STOPPED_S, GUESTS = 5, 4

    def test_that_stop_or_come_and_go_change_nothing(self):
        # Wide: what a stopped reader leaves unread is more than the 30 kB at which Cyclone DDS may make writers wait.
        fps = 10
        self.scene = self.write("wide.yaml", small_scene().replace("width: 160, height: 120", "width: 640, height: 480"))
        striper("simulate", self.scene, "-o", self.path("wide"), "--frames", "1")
        self.model = self.path("wide", "model.yaml")
        server = self.serve("--to", self.csv(), "--to", "ros2:", fps=fps)
        stopped = self.subscribe(self.STOPPED_S + 30, "count")
        steady = self.subscribe(self.STOPPED_S + 6, "count")
        steady.wait_for("points", where="lines")
        stopped.wait_for("points", where="lines")
        stopped.process.send_signal(signal.SIGSTOP)
        begin, heard_before = time.monotonic(), len(steady.lines)
        for _ in range(self.GUESTS):
            guest = self.subscribe(30, "count")
            guest.wait_for("points", where="lines")
            guest.kill()
        time.sleep(max(0, self.STOPPED_S - (time.monotonic() - begin)))
        elapsed, heard = time.monotonic() - begin, len(steady.lines) - heard_before
        stopped.process.send_signal(signal.SIGCONT)
        log = server.end()
        self.assertGreater(heard, 0.98 * fps * elapsed - 2)
        self.assertNotIn("sink_slow", log)
        self.assertRegex(log, r"ros2: finished, \d+ written, 0 lost")
        times = sorted(map(float, self.table("a.csv")))
        self.assertAlmostEqual((times[-1] - times[0]) * fps, len(times) - 1, delta=0.5)

    def test_of_two_publishers_are_told(self):
        first = self.serve("--to", self.csv("a.csv"), "--to", "ros2:")
        first.wait_for("topics_offered")
        second = self.serve("--to", self.csv("b.csv"), "--to", "ros2:")
        for program in (first, second):
            program.wait_for("name_taken: warning: another program in ROS 2 domain 0 publishes /striper/points too")
        third = self.serve("--to", self.csv("c.csv"), "--to", "ros2:", "--name", "rear")
        elsewhere = self.serve("--to", self.csv("d.csv"), "--to", "ros2:", env={"ROS_DOMAIN_ID": "5"})
        elsewhere.wait_for("domain 5")
        time.sleep(3)
        for program in (third, elsewhere):
            self.assertNotIn("name_taken", program.end())


def connect(test, left, right):
    """A cable between two namespaces: `cable` on both sides, 10.78.1.1 and 10.78.1.2."""
    made = subprocess.run(["ip", "link", "add", "cable", "netns", str(left.keeper.pid), "type", "veth", "peer", "name",
                           "cable", "netns", str(right.keeper.pid)], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        test.skipTest(f"no right to make a cable: {made.stderr}")
    for number, space in enumerate((left, right), 1):
        for words in (("addr", "add", f"10.78.1.{number}/24", "dev", "cable"), ("link", "set", "cable", "up"),
                      ("route", "add", "239.0.0.0/8", "dev", "cable")):
            subprocess.run(space.command("ip", *words), check=True)


ON_CABLE = ("<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface name='cable'/></Interfaces></General>"
            "</Domain></CycloneDDS>")


class TwoMachines(Ros2):
    """Two network namespaces with a cable between them."""

    def setUp(self):
        super().setUp()
        self.other = Namespace(self)
        connect(self, self.space, self.other)

    def test_give_their_heads_to_both(self):
        left = self.serve("--to", "csv:" + self.path("left.csv") + "?missing=yes", "--to", "ros2:?interface=cable", "--name", "left")
        right = self.serve("--to", "csv:" + self.path("right.csv") + "?missing=yes", "--to", "ros2:?interface=auto", "--name",
                           "right", space=self.other)
        heard = [self.subscribe(6, namespace="/" + name, space=space, env={"CYCLONEDDS_URI": ON_CABLE})
                 for name, space in (("left", self.other), ("right", self.space))]
        for reader in heard:
            reader.wait()
        for name, program, reader in (("left", left, heard[0]), ("right", right, heard[1])):
            self.assertNotIn("name_taken", program.end())
            points = reader.messages(f"/{name}/points")
            self.assertGreater(len(points), 20)
            self.assertEqual({message["header"]["frame_id"] for message in points}, {name + "_scan0"})
            data = bytes.fromhex(points[5]["data"])
            rows = [row for row in self.scan_of(points[5], self.table(name + ".csv")) if row["status"] == "ok"]
            self.assertGreater(len(rows), 50)
            for row in rows:
                x, y = struct.unpack_from("<2f", data, 36 * int(row["u_px"]))
                self.assertEqual((x, y), (float32(float(row["x_m"])), float32(float(row["y_m"]))))
            frames = {one["child"] for message in reader.messages("/tf_static") for one in message["transforms"]}
            self.assertEqual(frames, {f"{head}_{frame}" for head in ("left", "right") for frame in ("camera_optical", "scan0")})

    def test_of_one_name_are_told(self):
        programs = [self.serve("--to", "csv:" + self.path(f"{i}.csv"), "--to", "ros2:?interface=cable", space=space)
                    for i, space in enumerate((self.space, self.other))]
        for program in programs:
            program.wait_for("name_taken")

    def test_the_default_stays_on_its_machine(self):
        self.serve("--to", "csv:" + self.path("a.csv"), "--to", "ros2:").wait_for("topics_offered")
        heard = self.subscribe(4, space=self.other, env={"CYCLONEDDS_URI": ON_CABLE})
        heard.wait()
        self.assertEqual(heard.messages("/striper/points"), [])


class Doctor(Ros2):
    """`striper doctor --ros2`."""

    def doctor(self, *options, code=0, env=None):
        done = subprocess.run(self.space.command(STRIPER, "doctor", "--ros2", *options, "--seconds", "2", "--json"),
                              capture_output=True, text=True, timeout=60, check=False, env={**os.environ, **(env or {})})
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return {one["code"]: one for one in json.loads(done.stdout)["findings"]}

    def test_hears_who_is_there_and_whose_name_is_taken(self):
        found = self.doctor()
        self.assertEqual(set(found) - {"shared_memory_foreign"}, {"topics_offered", "nobody_heard"})
        programs = [self.serve("--to", "csv:" + self.path(f"{i}.csv"), "--to", "ros2:") for i in range(2)]
        for program in programs:
            program.wait_for("name_taken")
        self.subscribe(20, "count")
        done = subprocess.run(self.space.command(STRIPER, "doctor", "--ros2"), capture_output=True, text=True, timeout=60, check=True)
        self.assertIn("/striper/points (sensor_msgs/msg/PointCloud2): 2 writing, 1 reading", done.stdout)
        self.assertIn("doubtful  2 programs publish /striper/points", done.stdout)
        self.assertNotIn("programs publish /diagnostics", done.stdout)

    def test_says_what_is_wrong_with_an_interface(self):
        self.assertIn("there is no interface eth77", self.doctor("ros2:?interface=eth77", code=1)["interface_unfit"]["what"])
        other = Namespace(self)
        connect(self, self.space, other)
        self.assertNotIn("interface_unfit", self.doctor("ros2:?interface=cable"))
        for change, said in ((("link", "set", "cable", "multicast", "off"), "has no multicast"),
                             (("link", "set", "cable", "down"), "is down")):
            subprocess.run(self.space.command("ip", *change), check=True)
            found = self.doctor("ros2:?interface=cable", code=1)
            self.assertIn(said, found["interface_unfit"]["what"])

    def test_says_that_multicast_does_not_arrive(self):
        other = Namespace(self)
        connect(self, self.space, other)
        # Who holds the port for himself stands for a firewall, which is not installed everywhere.
        holder = Program(self, self.space, sys.executable, "-c", "import socket, time; s = socket.socket(type=socket.SOCK_DGRAM); "
                         "s.bind(('', 7400)); print('holding', flush=True); time.sleep(30)")
        holder.wait_for("holding", where="lines")
        found = self.doctor("ros2:?interface=cable", code=1)
        self.assertIn("does not come back on interface cable", found["interface_unfit"]["what"])

    def test_says_that_others_are_in_another_domain(self):
        other = Namespace(self)
        connect(self, self.space, other)
        server = self.serve("--to", "csv:" + self.path("a.csv"), "--to", "ros2:?interface=cable&domain=5")
        server.wait_for("topics_offered")
        found = self.doctor("ros2:?interface=cable")
        self.assertIn("programs of this machine are in domain 5, this is 0", found["other_domain"]["what"])
        self.assertNotIn("other_domain", self.doctor("ros2:?interface=cable", env={"ROS_DOMAIN_ID": "5"}))


class FastDds(Judged):
    """The same in Fast DDS, by its own defaults (shared memory, every interface)."""

    def test_are_the_csv_in_fast_dds(self):
        for qos in ("reliable", "best_effort"):
            heard = self.subscribe(8, qos, program=os.environ["FAST_DDS_SUBSCRIBER"])
            server = self.serve("--to", f"csv:{self.path(qos)}.csv?missing=yes&doubtful=yes", "--to", "ros2:?qos=" + qos)
            heard.wait()
            server.end()
            self.judge(heard, qos + ".csv")
            self.check_names(heard)


class Rtps(Judged):
    """The same in a third maker's RTPS, @foxglove/rtps of npm, which does not hear on lo."""

    def setUp(self):
        super().setUp()
        self.work = os.environ["RTPS_WORK"]
        os.makedirs(self.work, exist_ok=True)
        here = os.path.dirname(os.path.abspath(__file__))
        for name in ("package.json", "package-lock.json", "rtps_subscriber.mjs", "../../foreign/.npmrc"):
            shutil.copy(os.path.join(here, name), self.work)
        if shutil.which("npm") is None:
            self.skipTest("NO THIRD MAKER'S RTPS HAS HEARD US: npm is not installed")
        done = subprocess.run(["npm", "ci", "--no-audit"], cwd=self.work, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.skipTest(f"NO THIRD MAKER'S RTPS HAS HEARD US: {done.stderr}")

    def test_hears_the_csv(self):
        other = Namespace(self)
        connect(self, self.space, other)
        script = os.path.join(self.work, "rtps_subscriber.mjs")
        heard = Program(self, other, "node", script, "10.78.1.2", "/striper", 10)
        heard.wait_for("ready", where="lines")
        server = self.serve("--to", "csv:" + self.path("a.csv") + "?missing=yes&doubtful=yes", "--to",
                            "ros2:?qos=best_effort&interface=cable")
        heard.wait()
        server.end()
        self.assertGreater(len(heard.messages("/striper/scan")), 50, "".join(heard.errors))
        self.judge(heard, "a.csv")


class ReadersLong(Readers):
    STOPPED_S, GUESTS = 22, 20


if __name__ == "__main__":
    unittest.main()
