# SPDX-License-Identifier: Apache-2.0
"""Proves of `striper serve --to web:` that a client of the Foxglove WebSocket gets what the CSV beside it holds, to float32;
that late comers get /tf_static; that a client which does not read costs nobody anything; that status, readiness and metrics are
right; and that hostile requests are refused and scans go on. The client is written here, byte by byte, by RFC 6455 and
Foxglove's published layouts. What browsers and Foxglove itself make of it is not here.

Run by ctest; by hand: STRIPER=... STRIPER_SOURCE_DIR=... python3 web_test.py
"""
import base64
import csv
import fcntl
import http.client
import json
import math
import os
import re
import selectors
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.environ["STRIPER_SOURCE_DIR"], "tests/end_to_end"))
from gige_test import VirtualCamera, small_scene  # noqa: E402
from program import STRIPER, InScratch, slowed, striper  # noqa: E402

COLUMNS = {"x": "x_m", "y": "y_m", "intensity": "intensity", "sigma": "sigma_m", "sigma_cal": "sigma_cal_m",
           "width": "width_px", "confidence": "confidence"}


def float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


class Socket:
    """A WebSocket, as a client has it."""

    opened = []

    def __init__(self, port, subprotocols="foxglove.websocket.v1", headers=(), path="/"):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=10)
        self.opened.append(self.socket)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{port}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: {subprotocols}", *headers]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.waiting = b""
        while b"\r\n\r\n" not in self.waiting:
            piece = self.socket.recv(4096)
            if not piece:
                break
            self.waiting += piece
        self.answer, _, self.waiting = self.waiting.partition(b"\r\n\r\n")
        self.answer = self.answer.decode()

    def take(self, size):
        while len(self.waiting) < size:
            piece = self.socket.recv(65536)
            if not piece:
                raise EOFError
            self.waiting += piece
        taken, self.waiting = self.waiting[:size], self.waiting[size:]
        return taken

    def frame(self):
        """The next one: opcode and bytes."""
        first, second = self.take(2)
        size = second & 127
        if size == 126:
            (size,) = struct.unpack(">H", self.take(2))
        elif size == 127:
            (size,) = struct.unpack(">Q", self.take(8))
        return first & 15, self.take(size)

    def send(self, data, opcode=1):
        mask = os.urandom(4)
        size = len(data)
        head = bytes([128 | opcode]) + (bytes([128 | size]) if size < 126 else bytes([254]) + struct.pack(">H", size)
                                        if size < 65536 else bytes([255]) + struct.pack(">Q", size))
        self.socket.sendall(head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)))

    def say(self, **message):
        self.send(json.dumps(message).encode())

    def close(self):
        self.socket.close()


class Viewer:
    """A client that knows the channels by their topics and counts what comes."""

    def __init__(self, port, **options):
        self.socket = Socket(port, **options)
        self.channels, self.topics, self.messages, self.statuses = {}, {}, {}, []
        self.services, self.parameters, self.calls = {}, [], []
        self.info = None

    def hear(self, seconds, until=lambda: False):
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            self.socket.socket.settimeout(max(0.01, end - time.monotonic()))
            try:
                opcode, data = self.socket.frame()
            except (TimeoutError, socket.timeout):
                break
            if opcode == 1:
                self.obey(json.loads(data))
            elif opcode == 2 and data[0] == 3:
                self.calls.append(service_answer(data))
            elif opcode == 2:
                kind, subscription, stamp = struct.unpack_from("<BIQ", data)
                if kind == 1:
                    self.messages.setdefault(self.topics[subscription], []).append((stamp, data[13:]))
            elif opcode == 9:
                self.socket.send(data, 10)
        return self

    def obey(self, message):
        if message["op"] == "serverInfo":
            self.info = message
        elif message["op"] == "advertise":
            for channel in message["channels"]:
                self.channels[channel["topic"]] = channel
        elif message["op"] == "advertiseServices":
            self.services.update({one["name"]: one["id"] for one in message["services"]})
        elif message["op"] == "parameterValues":
            self.parameters.append((message.get("id"), {one["name"]: one["value"] for one in message["parameters"]}))
        elif message["op"] == "serviceCallFailure":
            self.calls.append((message["callId"], message["message"]))
        else:
            self.statuses.append(message)

    def call(self, name, request=b"{}"):
        """What a service answers: its JSON, or why it failed."""
        number = len(self.calls)
        self.socket.send(struct.pack("<BIII", 2, self.services[name], number, 4) + b"json" + request, 2)
        self.hear(10, lambda: len(self.calls) > number)
        self.assert_is(self.calls[number][0], number)
        return self.calls[number][1]

    @staticmethod
    def assert_is(a, b):
        assert a == b, (a, b)

    def subscribe(self, *topics):
        self.hear(10, lambda: all(topic in self.channels for topic in topics))
        fresh = {len(self.topics) + 1 + i: topic for i, topic in enumerate(topics)}
        self.topics.update(fresh)
        self.socket.say(op="subscribe", subscriptions=[{"id": i, "channelId": self.channels[topic]["id"]}
                                                       for i, topic in fresh.items()])
        return self


def service_answer(data):
    """Call's number and JSON of a service's answer."""
    _, _, call, size = struct.unpack_from("<BIII", data)
    assert data[13:13 + size] == b"json"
    return call, json.loads(data[13 + size:])


def cloud(data):
    """Stamp and points of a PointCloud2 in CDR."""
    at = 4

    def u32():
        nonlocal at
        at += (4 - (at - 4) % 4) % 4
        at += 4
        return struct.unpack_from("<I", data, at - 4)[0]

    def text():
        nonlocal at
        size = u32()
        at += size
        return data[at - size:at - 1].decode()
    stamp = u32() + u32() / 1e9
    frame, _, width = text(), u32(), u32()
    names = []
    for _ in range(u32()):
        names.append((text(), u32()))
        at += 1
        u32()
    at += 1
    step, _, size = u32(), u32(), u32()
    points = [{name: struct.unpack_from("<f", data, at + i * step + offset)[0] for name, offset in names[:-1]} for i in range(width)]
    assert size == step * width
    return stamp, frame, points


class Served(InScratch):
    def setUp(self):
        super().setUp()
        self.scene = self.write("small.yaml", small_scene())
        striper("simulate", self.scene, "-o", self.path("made"), "--frames", "1")
        self.model = self.path("made", "model.yaml")
        self.start()

    def start(self, *options, fps=20, to="web:0", source=None):
        # pylint: disable=consider-using-with
        source = source or f"sim:{self.scene}?realtime=yes&fps={fps}"
        self.server = subprocess.Popen(
            [STRIPER, "serve", source, *(["-m", self.model] if self.model else []), "--to", to,
             "--to", "csv:" + self.path("a.csv") + "?missing=yes&doubtful=yes", *options],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "STATE_DIRECTORY": self.path("state")})
        self.addCleanup(self.end)
        self.log = []
        self.port = None
        for line in self.server.stderr:
            self.log.append(line)
            found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
            if found:
                self.port = int(found[1])
                break
        self.assertIsNotNone(self.port, self.log)
        self.reader = threading.Thread(target=lambda: self.log.extend(self.server.stderr), daemon=True)
        self.reader.start()

    def wait_until_ready(self):
        end = time.monotonic() + 20
        while self.get("/readyz")[0] != 200 or json.loads(self.get("/api/v1/status")[1])["heads"][0]["rate_hz"] == 0:
            self.assertLess(time.monotonic(), end, self.log)
            time.sleep(0.05)

    def tearDown(self):
        while Socket.opened:
            Socket.opened.pop().close()

    def end(self):
        if self.server.poll() is None:
            self.server.send_signal(signal.SIGTERM)
        self.server.wait(timeout=30)
        self.reader.join(timeout=10)
        self.server.stderr.close()
        return "".join(self.log)

    def get(self, path, method="GET", headers=None, body=None):
        status, data, headers = self.get_bytes(path, method, headers, body)
        return status, data.decode(), headers

    def get_bytes(self, path, method="GET", headers=None, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=15)
        connection.request(method, path, headers=headers or {}, body=body)
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, data, answer.headers

    def memory_kb(self):
        with open(f"/proc/{self.server.pid}/status", encoding="ascii") as file:
            return int(re.search(r"VmRSS:\s+(\d+)", file.read())[1])

    def cpu_s(self):
        """Of all its threads that are."""
        used_ns = 0
        for thread in os.listdir(f"/proc/{self.server.pid}/task"):
            with open(f"/proc/{self.server.pid}/task/{thread}/schedstat", encoding="ascii") as file:
                used_ns += int(file.read().split()[0])
        return used_ns / 1e9

    def rows(self):
        scans = {}
        with open(self.path("a.csv"), encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                scans.setdefault(row["time_s"], []).append(row)
        return scans

    def scan_times(self):
        """Of the scans in the CSV, in order; nothing else of it is kept, for there may be gigabytes."""
        times = []
        with open(self.path("a.csv"), encoding="utf-8") as file:
            column = next(file).strip().split(",").index("time_s")
            for line in file:
                time_s = line.split(",", column + 1)[column]
                if not times or times[-1] != time_s:
                    times.append(time_s)
        return [float(time_s) for time_s in times]


class Scans(Served):
    def test_are_the_csv_by_both_subprotocols(self):
        for name in ("foxglove.websocket.v1", "other, foxglove.sdk.v1"):
            viewer = Viewer(self.port, subprotocols=name).subscribe("/striper/points", "/striper/scan", "/striper/camera_info",
                                                                    "/diagnostics", "/tf_static")
            self.assertIn("Sec-WebSocket-Protocol: " + name.split(", ")[-1], viewer.socket.answer)
            viewer.hear(2.5)
            self.assertEqual(viewer.info["name"], "striper")
            for topic in ("/striper/points", "/striper/scan"):
                self.assertGreater(len(viewer.messages[topic]), 30)
            for topic in ("/striper/camera_info", "/diagnostics"):
                self.assertGreater(len(viewer.messages[topic]), 0, topic)
            self.assertEqual(len(viewer.messages["/tf_static"]), 1)
            self.assertIn("float32[] ranges", viewer.channels["/striper/scan"]["schema"])
            viewer.socket.close()
            last = viewer
        self.end()
        self.judge(last.messages["/striper/points"])

    def judge(self, messages):
        table = self.rows()
        for _, data in messages[:10]:
            stamp, frame, points = cloud(data)
            (rows,) = [rows for time_s, rows in table.items() if abs(float(time_s) - stamp) < 1e-6]
            self.assertEqual((frame, len(points)), ("striper_scan0", len(rows)))
            for point, row in zip(points, rows):
                for name, column in COLUMNS.items():
                    if row[column] == "":
                        self.assertTrue(math.isnan(point[name]))
                    else:
                        self.assertEqual(point[name], float32(float(row[column])))

    def test_stop_when_nobody_wants_them_any_more(self):
        viewer = Viewer(self.port).subscribe("/striper/points")
        viewer.hear(5, lambda: len(viewer.messages.get("/striper/points", [])) > 5)
        viewer.socket.say(op="unsubscribe", subscriptionIds=[1])
        viewer.hear(0.5)
        before = len(viewer.messages["/striper/points"])
        viewer.hear(1)
        self.assertEqual(len(viewer.messages["/striper/points"]), before)

    def test_what_is_no_request_is_answered_with_a_status(self):
        viewer = Viewer(self.port)
        for text in (b"x", b"{}", b'{"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]}', b'{"op":"fly"}', b"[]"):
            viewer.socket.send(text)
        viewer.hear(2, lambda: len(viewer.statuses) >= 5)
        self.assertEqual([one["level"] for one in viewer.statuses], [1] * 5)
        self.assertIn("no channel 99", viewer.statuses[2]["message"])


class Clients(Served):
    def test_that_do_not_read_cost_nobody_anything(self):
        self.end()
        self.scene = self.write("wide.yaml", small_scene().replace("width: 160, height: 120", "width: 640, height: 480"))
        striper("simulate", self.scene, "-o", self.path("wide"), "--frames", "1")
        self.model = self.path("wide", "model.yaml")
        fps = 10 // slowed(1)
        self.start("--name", "wide", fps=fps, to="web:0?frames=10")
        lazy = [Viewer(self.port).subscribe("/wide/points", "/wide/image_raw") for _ in range(5)]
        keen = Viewer(self.port).subscribe("/wide/points")
        keen.hear(30, lambda: "/wide/points" in keen.messages)
        keen.hear(1)
        memory, heard = self.memory_kb(), len(keen.messages["/wide/points"])
        begin = time.monotonic()
        keen.hear(6)
        rate = (len(keen.messages["/wide/points"]) - heard) / (time.monotonic() - begin)
        self.assertGreater(rate, 0.95 * fps)
        self.assertLess(self.memory_kb() - memory, 40_000)
        _, metrics, _ = self.get("/metrics")
        self.assertIn("striper_clients 6", metrics)
        dropped = float(re.search(r"^striper_client_dropped_total (\S+)", metrics, re.M)[1])
        self.assertGreater(dropped, 50 if fps == 10 else 1)  # At few frames sockets hold most of six seconds.
        lazy[0].hear(15, lambda: any(one["op"] == "status" for one in lazy[0].statuses))
        self.assertIn("does not keep up", lazy[0].statuses[0]["message"])
        log = self.end()
        self.assertRegex(log, r"csv:\S+ finished, \d+ written, 0 lost")
        times = self.scan_times()
        self.assertAlmostEqual((times[-1] - times[0]) * fps, len(times) - 1, delta=0.5)



def diagnostics(data):
    """Level and message of a DiagnosticArray's one status, in CDR."""
    at = 12

    def text():
        nonlocal at
        at += (4 - (at - 4) % 4) % 4
        (size,) = struct.unpack_from("<I", data, at)
        at += 4 + size
        return data[at - size:at - 1].decode()
    text()
    at += (4 - (at - 4) % 4) % 4 + 4
    level = data[at]
    at += 1
    text()
    return level, text()


class Crowd:
    """Clients that want the points: some read, some never do. One thread reads what has come, and looks at one client's messages."""

    TOPICS = ("/striper/points", "/striper/scan")

    def __init__(self, port, readers, sleepers):
        self.watcher = Viewer(port).subscribe(*self.TOPICS)
        self.readers = [Viewer(port).subscribe(*self.TOPICS).socket.socket for _ in range(readers - 1)]
        self.sleepers = [Viewer(port).subscribe(*self.TOPICS) for _ in range(sleepers)]
        self.bytes, self.ages = 0, []
        self.is_over = False
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        selector = selectors.DefaultSelector()
        for one in self.readers:
            one.setblocking(False)
            selector.register(one, selectors.EVENT_READ)
        selector.register(self.watcher.socket.socket, selectors.EVENT_READ, "watcher")
        room = bytearray(1 << 20)
        while not self.is_over:
            for key, _ in selector.select(0.1):
                if key.data is None:
                    self.bytes += key.fileobj.recv_into(room)
                    continue
                self.watcher.hear(5, lambda: bool(self.watcher.messages.get("/striper/points")))
                now = time.time()
                for stamp, _ in self.watcher.messages.pop("/striper/points", []):
                    self.ages.append(now - stamp / 1e9)

    def end(self):
        self.is_over = True
        self.thread.join(timeout=10)


class Load(Served):
    """Fifty clients of which ten never read, 640x480 at 60 frames a second from a GigE camera on loopback: the CSV beside them is
    complete, the rate is that without clients to 2 %, memory stays, and how old a scan is when a client has it is printed."""

    SECONDS = 60

    def test_fifty_clients_cost_the_scans_nothing(self):
        self.end()
        text = small_scene().replace("width: 160, height: 120", "width: 640, height: 480")
        self.scene = self.write("wide.yaml", re.sub(r"picture_rate_hz: [\d.]+", "picture_rate_hz: 60", text))
        striper("simulate", self.scene, "-o", self.path("wide"), "--frames", "1")
        self.model = self.path("wide", "model.yaml")
        with VirtualCamera(self.scene, "--loop", "60") as camera:
            alone = self.run_for(camera, 15, 0, 0)
            crowded = self.run_for(camera, self.SECONDS, 40, 10)
        print("alone", alone, "crowded", crowded)
        self.assertAlmostEqual(crowded["rate_hz"] / alone["rate_hz"], 1, delta=0.02)
        self.assertEqual((alone["lost"], crowded["lost"]), (0, 0))
        self.assertLess(crowded["grown_kb"], 8_000)

    def run_for(self, camera, seconds, readers, sleepers):
        self.start(source=camera.uri("fps=60"))
        self.wait_until_ready()
        crowd = Crowd(self.port, readers, sleepers) if readers else None
        time.sleep(5)
        before, used = self.memory_kb(), self.cpu_s()
        begin = time.monotonic()
        time.sleep(seconds)
        found = {"grown_kb": self.memory_kb() - before, "cpu": round((self.cpu_s() - used) / (time.monotonic() - begin), 2)}
        if crowd:
            crowd.end()
            found["MB/s"] = round(crowd.bytes / 1e6 / (seconds + 5))
            ages = sorted(crowd.ages)
            found.update(ages=len(ages), median_ms=round(1e3 * ages[len(ages) // 2], 1), p99_ms=round(1e3 * ages[len(ages) * 99 // 100], 1))
        log = self.end()
        self.tearDown()
        found["lost"] = int(re.search(r"csv:\S+ finished, \d+ written, (\d+) lost", log)[1])
        times = self.scan_times()
        found["scans"] = len(times)
        found["rate_hz"] = round((len(times) - 1) / (times[-1] - times[0]), 3)
        return found


class Camera(Served):
    """A camera that is absent, comes, is lost and comes back: everything says so within two seconds."""

    TIMES = 2
    WITHIN_S = 4.0  # On a machine that does something else beside.

    def test_absent_coming_lost_and_back(self):
        self.end()
        camera = VirtualCamera(self.scene)
        self.start(source=camera.uri())
        viewer = Viewer(self.port).subscribe("/diagnostics")
        self.slowest, self.seen = {}, {}
        self.judge(viewer, False, "no scan yet", "waited for", "source_waiting")
        for number in range(self.TIMES):
            with camera:
                begin = time.monotonic()
                self.judge(viewer, True, "", "scanning", "source_back", begin)
                camera.program.kill()
                camera.program.communicate()
                self.judge(viewer, False, "no scan for", "no frame", "source_lost", time.monotonic())
        status = json.loads(self.get("/api/v1/status")[1])["heads"][0]
        self.assertEqual(status["reconnects"], self.TIMES - 1)
        self.assertGreater(status["latency_ms"], 0)
        self.assertLess(status["latency_ms"], 500)
        print({what: round(seconds, 2) for what, seconds in self.slowest.items()})

    def judge(self, viewer, is_ready, reason, message, code, since=None):
        """Of each who says it, how long after."""
        since = since or time.monotonic()
        seen = self.seen.get(code, 0)
        told = {}

        def ask():
            viewer.hear(0.05)
            ready, body, _ = self.get("/readyz")
            words = [diagnostics(data) for _, data in viewer.messages.get("/diagnostics", [])[-1:]]
            metrics = self.get("/metrics")[1]
            says = {
                "readyz": ready == (200 if is_ready else 503) and reason in body,
                "diagnostics": bool(words) and message in words[0][1] and words[0][0] == (0 if is_ready else 2),
                "metrics": f'striper_head_streaming{{head="striper"}} {int(is_ready)}' in metrics,
                "events": self.count(code) > seen,
            }
            for what in (what for what, is_said in says.items() if is_said):
                told.setdefault(what, time.monotonic() - since)
            return len(told) == len(says)
        while not ask():
            self.assertLess(time.monotonic() - since, 15, (told, self.log[-3:]))
        self.seen[code] = self.count(code)
        for what, seconds in told.items():
            self.slowest[code + " " + what] = max(seconds, self.slowest.get(code + " " + what, 0))
            self.assertLess(seconds, self.WITHIN_S, (what, code))

    def count(self, code):
        return sum(one["code"] == code for one in json.loads(self.get("/api/v1/events")[1]))


class CameraOften(Camera):
    TIMES = 5
    WITHIN_S = 2.0


class Asked(Served):
    def test_status_events_readiness_and_metrics(self):
        self.wait_until_ready()
        status = json.loads(self.get("/api/v1/status")[1])
        (head,) = status["heads"]
        self.assertEqual((head["name"], head["state"], head["source"][:4]), ("striper", "streaming", "sim:"))
        self.assertAlmostEqual(head["rate_hz"], 20, delta=3)
        self.assertLess(head["last_scan_s"], 1)
        self.assertEqual({sink["uri"][:4] for sink in status["sinks"]}, {"web:", "csv:"})
        events = json.loads(self.get("/api/v1/events")[1])
        self.assertIn("source_opened", [event["code"] for event in events])
        self.assertEqual(json.loads(self.get(f"/api/v1/events?since={events[-1]['n']}")[1]), [])
        self.assertEqual(self.get("/readyz")[:2], (200, '{"ready":true,"reasons":[]}\n'))
        self.assertEqual(self.get("/healthz")[:2], (200, "alive\n"))
        code, metrics, headers = self.get("/metrics")
        self.assertEqual((code, headers["Content-Type"]), (200, "text/plain; version=0.0.4; charset=utf-8"))
        self.assertTrue(metrics.endswith("\n"))
        self.check_metrics(metrics)
        self.assertEqual(self.get("/", "HEAD")[1], "")
        self.assertIn('data-page="live"', self.get("/")[1])

    def check_metrics(self, metrics):
        """Against the text format's grammar, and by prometheus' own parser where it is installed."""
        types = dict(re.findall(r"^# TYPE (\S+) (gauge|counter)$", metrics, re.M))
        for line in metrics.splitlines():
            if not line.startswith("#"):
                self.assertRegex(line, r'^[a-z_]+(\{[a-z]+="([^"\\\n]|\\.)*"\})? (NaN|[-+0-9.e]+)$')
                self.assertIn(re.match(r"[a-z_]+", line)[0], types)
        self.assertGreater(float(re.search(r'^striper_scans_total\{head="striper"\} (\S+)', metrics, re.M)[1]), 5)
        try:
            from prometheus_client.parser import text_string_to_metric_families as parse  # pylint: disable=import-outside-toplevel
        except ImportError:
            return
        self.assertIn("striper_scans", {family.name for family in parse(metrics)})

    def test_what_a_console_asks(self):
        self.wait_until_ready()
        for page in ("calibrate", "health", "settings", "recordings"):
            status, text, headers = self.get("/" + page)
            self.assertEqual((status, headers["Content-Type"]), (200, "text/html; charset=utf-8"))
            self.assertIn(f'data-page="{page}"', text)
            self.assertNotIn("@", text)
        of_head = "/api/v1/heads/striper/"
        forms = json.loads(self.get(of_head + "settings")[1])
        self.assertEqual({form["name"]: form["value"] for form in forms}, json.loads(self.get(of_head + "parameters")[1]))
        (gain,) = [form for form in forms if form["name"] == "gain_db"]
        self.assertEqual((gain["of"], gain["type"], gain["unit"], gain["minimum"], gain["at_start"]), ("camera", "number", "dB", [0], 0))
        self.assertEqual(json.loads(self.get("/api/v1/login")[1]), {"may_change": False})
        end = time.monotonic() + 20
        while "stripe_seen" not in (found := {one["code"]: one for one in json.loads(self.get(of_head + "findings")[1])}):
            self.assertLess(time.monotonic(), end, found)
            time.sleep(0.2)
        self.assertEqual(found["source_opened"]["severity"], "info")
        pieces = {"sequence": None}
        while pieces["sequence"] is None:
            pieces = json.loads(self.get("/api/v1/pieces?head=striper&laser=0")[1])
        (wall,) = pieces["pieces"]  # 2 m in front.
        self.assertAlmostEqual(wall["x1_m"], 2, delta=0.05)
        for path in ("settings", "findings"):
            self.assertEqual(self.get("/api/v1/heads/other/" + path)[0], 404)
            self.assertEqual(self.get(of_head + path, "POST")[0], 405)

    def test_readiness_says_that_no_scans_come(self):
        self.end()
        self.start(fps=0.2)
        time.sleep(3)
        code, body, _ = self.get("/readyz")
        self.assertEqual(code, 503)
        self.assertRegex(json.loads(body)["reasons"][0], r"^striper: no scan (yet|for [\d.]+ s)")


class Changes(Served):
    """Who has the secret changes parameters and gives commands; who has not may switch lasers off, and no more."""

    HEAD = "/api/v1/heads/striper/"

    def setUp(self):
        super().setUp()
        self.wait_until_ready()
        with open(self.path("state", "token"), encoding="ascii") as file:
            self.token = file.read().strip()
        self.right = {"Authorization": "Bearer " + self.token}

    def parameters(self):
        return json.loads(self.get(self.HEAD + "parameters")[1])

    def put(self, headers=None, **values):
        code, body, _ = self.get(self.HEAD + "parameters", "PUT", headers, json.dumps(values))
        return code, json.loads(body)

    def post(self, command, headers=None, body=None):
        code, body, _ = self.get(self.HEAD + command, "POST", headers, body)
        return code, json.loads(body)

    def test_the_secret_is_made_for_its_owner_alone_and_its_path_is_said(self):
        self.assertEqual(os.stat(self.path("state", "token")).st_mode & 0o777, 0o600)
        self.assertEqual(len(self.token), 64)
        self.assertIn(self.path("state", "token"), "".join(self.log))
        self.assertNotIn(self.token, "".join(self.log))
        self.end()
        os.chmod(self.path("state", "token"), 0o644)
        done = striper("serve", "sim:" + self.scene, "-m", self.model, "--to", "web:0", "--token", self.path("state", "token"), code=1)
        self.assertIn("others may read it: chmod 600", done.stderr)

    def test_parameters_need_the_secret(self):
        before = self.parameters()
        self.assertEqual((before["laser"], before["method"], before["threshold"]), (True, "refined", None))
        self.assertEqual(self.put(exposure_us=50)[0], 401)
        self.assertEqual(self.put({"Authorization": "Bearer " + "0" * 64}, exposure_us=50)[0], 401)
        self.assertEqual(self.parameters(), before)
        code, now = self.put(self.right, exposure_us=50, threshold=40)
        self.assertEqual((code, now["exposure_us"], now["threshold"]), (200, 50, 40))
        self.assertEqual(self.put(self.right, threshold=None)[1]["threshold"], None)
        for values, why in (({"exposure_us": -1}, "expected"), ({"method": "magic"}, "magic"), ({"fly": 1}, "fly"), ({"threshold": 1e6}, "threshold"),
                            ({"exposure_us": "x"}, "exposure_us")):
            code, answer = self.put(self.right, **values)
            self.assertEqual(code, 400, values)
            self.assertIn(why, answer["error"])
        self.assertEqual(self.get("/api/v1/heads/other/parameters")[0], 404)
        self.assertIn("exposure_us is 50 now", "".join(self.log))

    def test_lasers_go_off_for_everybody_and_on_for_nobody(self):
        self.assertEqual(self.post("lasers_on")[0], 401)
        self.assertEqual(self.post("lasers_off"), (200, {"message": "lasers off"}))
        self.assertIs(self.parameters()["laser"], False)
        for code, answer in (self.post("lasers_on", self.right), self.put(self.right, laser=True)):
            self.assertEqual(code, 403)
            self.assertIn("--allow-lasers-on", answer["error"])
        self.assertIs(self.parameters()["laser"], False)
        self.end()
        self.start("--allow-lasers-on")
        self.wait_until_ready()
        self.assertEqual(self.post("lasers_off")[0], 200)
        self.assertEqual(self.post("lasers_on")[0], 401)
        self.assertEqual(self.post("lasers_on", self.right)[0], 200)
        self.assertIs(self.parameters()["laser"], True)

    def test_lasers_go_off_whatever_secret_is_shown_and_whatever_was_asked_before(self):
        old = ({"Authorization": "Bearer " + "0" * 64}, {"Cookie": "striper_token=" + "0" * 64})
        for _ in range(20):
            for headers in old:
                self.assertEqual(self.post("lasers_off", headers), (200, {"message": "lasers off"}))
        codes = {self.get("/api/v1/status", "POST")[0] for _ in range(80)}
        self.assertIn(429, codes)
        self.assertEqual(self.post("lasers_off")[0], 200)

    def test_start_and_stop(self):
        self.assertEqual(self.post("stop")[0], 401)
        self.assertEqual(self.post("stop", self.right)[0], 200)
        end = time.monotonic() + 10
        while self.get("/readyz")[0] == 200 and time.monotonic() < end:
            time.sleep(0.1)
        self.assertIn("paused", self.get("/readyz")[1])
        self.assertEqual(self.post("start", self.right)[0], 403)  # It would light the laser.
        self.end()
        self.start("--allow-lasers-on")
        self.wait_until_ready()
        self.post("stop", self.right)
        time.sleep(2)
        self.assertEqual(self.get("/readyz")[0], 503)
        self.assertEqual(self.post("start", self.right)[0], 200)
        self.wait_until_ready()

    def test_recordings(self):
        self.assertEqual(self.post("record", body='{"seconds": 1}')[0], 401)
        for body in (None, '{"seconds": -1}', '{"seconds": "x"}', "[]", "x"):
            self.assertEqual(self.post("record", self.right, body)[0], 400, body)
        self.assertEqual(self.post("record", self.right, '{"seconds": 1}')[0], 200)
        self.assertEqual(self.post("record", self.right, '{"seconds": 1}')[0], 403)
        end = time.monotonic() + 10
        while "recording_made" not in "".join(self.log) and time.monotonic() < end:
            time.sleep(0.1)
        (made,) = json.loads(self.get("/api/v1/recordings")[1])
        self.assertRegex(made["name"], r"^striper-\d{8}T\d{6}Z\.mcap$")
        info = striper("info", self.path("state", "recordings", made["name"]), "--json").stdout
        self.assertIn("image_raw", info)

    def test_the_cookie_of_a_login_is_the_secret(self):
        code, _, _ = self.get("/api/v1/login", "POST", body='{"token": "wrong"}')
        self.assertEqual(code, 401)
        code, _, headers = self.get("/api/v1/login", "POST", body=json.dumps({"token": self.token}))
        self.assertEqual(code, 200)
        cookie = headers["Set-Cookie"]
        self.assertIn("HttpOnly", cookie)
        self.assertIn("SameSite=Strict", cookie)
        self.assertEqual(self.put({"Cookie": cookie.split(";")[0]}, gain_db=6)[1]["gain_db"], 6)
        self.assertEqual(self.get("/api/v1/status", headers={"Cookie": "striper_token=old"})[0], 200)
        foreign = {"Cookie": cookie.split(";")[0], "Origin": "http://evil.example"}
        self.assertEqual(self.get(self.HEAD + "parameters", "PUT", foreign, "{}")[0], 403)

    def test_wrong_secrets_are_few(self):
        codes = [self.get("/api/v1/status", headers={"Authorization": "Bearer x"})[0] for _ in range(14)]
        self.assertEqual((codes[0], codes[-1]), (401, 429))
        self.assertEqual(self.get("/readyz")[0], 200)
        self.assertIn("showed a wrong secret", "".join(self.log))

    def test_a_recording_is_played_back_beside_what_is_measured(self):
        self.assertEqual(self.post("record", self.right, '{"seconds": 1}')[0], 200)
        self.wait_for_event("recording_made")
        (one,) = json.loads(self.get("/api/v1/recordings")[1])
        address = "/api/v1/recordings/" + one["name"]
        info = json.loads(self.get(address + "/info")[1])
        self.assertGreater(info["frames"], 10)
        self.assertIsNone(info["damage"])
        status, data, _ = self.get_bytes(address)
        self.assertEqual((status, len(data)), (200, one["bytes"]))
        for path in ("/api/v1/recordings/..%2Ftoken", "/api/v1/recordings/none.mcap", address + "/fly"):
            self.assertEqual(self.get(path)[0], 404, path)
        self.assertEqual(self.get(address + "/play", "POST")[0], 401)
        viewer = Viewer(self.port)
        self.assertEqual(self.get(address + "/play", "POST", self.right)[0], 200)
        viewer.subscribe("/playback/points").hear(10, lambda: len(viewer.messages.get("/playback/points", [])) > 5)
        self.assertGreater(len(viewer.messages["/playback/points"]), 5)
        heads = json.loads(self.get("/api/v1/status")[1])["heads"]
        self.assertEqual([(head["name"], head["plays"]) for head in heads], [("striper", None), ("playback", one["name"])])
        self.assertEqual(self.get("/api/v1/heads/playback/record", "POST", self.right, '{"seconds": 1}')[0], 403)
        self.wait_until_ready()
        self.assertEqual(self.get("/api/v1/playback/stop", "POST", self.right)[0], 200)
        self.assertEqual(len(json.loads(self.get("/api/v1/status")[1])["heads"]), 1)
        self.end()
        times = self.scan_times()
        self.assertEqual(times, sorted(times))  # Nothing of what was played is in the CSV.

    def wait_for_event(self, code):
        end = time.monotonic() + 20
        while code not in (codes := [one["code"] for one in json.loads(self.get("/api/v1/events")[1])]):
            self.assertLess(time.monotonic(), end, codes)
            time.sleep(0.1)

    def test_the_model_is_there(self):
        code, text, headers = self.get("/api/v1/model?head=striper")
        self.assertEqual((code, headers["Content-Type"]), (200, "application/yaml"))
        self.assertIn("lasers:", text)
        self.assertEqual(self.get("/api/v1/model?head=other")[0], 404)

    def test_why_a_line_gives_what_it_gives(self):
        code, body, _ = self.get("/api/v1/why?head=striper&line=80")
        self.assertEqual(code, 200, body)
        why = json.loads(body)
        self.assertEqual((why["line"], why["status"]), (80, "ok"))
        self.assertAlmostEqual(why["range_m"], 2, delta=0.2)
        self.assertTrue(why["candidates"])
        for query, expected in (("line=x", 400), ("", 400), ("line=9999", 400), ("head=other&line=1", 404)):
            self.assertEqual(self.get("/api/v1/why?" + query)[0], expected, query)
        self.assertEqual(self.get("/api/v1/why?line=1", "POST")[0], 405)
        self.post("stop", self.right)
        end = time.monotonic() + 10
        while "paused" not in self.get("/api/v1/status")[1] and time.monotonic() < end:
            time.sleep(0.05)
        self.assertEqual(self.get("/api/v1/why?line=80")[0], 503)

    def test_foxglove_parameters_with_and_without_the_secret(self):
        reader, writer = Viewer(self.port), Viewer(self.port, path="/?token=" + self.token)
        self.assertIn("401", Socket(self.port, path="/?token=wrong").answer.split("\r\n")[0])
        reader.socket.say(op="subscribeParameterUpdates", parameterNames=["/striper/exposure_us"])
        reader.hear(5, lambda: reader.parameters)
        reader.socket.say(op="setParameters", parameters=[{"name": "/striper/exposure_us", "value": 70}], id="a")
        reader.hear(5, lambda: reader.statuses)
        self.assertIn("needs the secret", reader.statuses[0]["message"])
        writer.socket.say(op="setParameters", parameters=[{"name": "/striper/exposure_us", "value": 60}], id="b")
        writer.hear(5, lambda: writer.parameters)
        ((answered, values),) = writer.parameters
        self.assertEqual((answered, list(values)), ("b", ["/striper/exposure_us"]))
        self.assertAlmostEqual(values["/striper/exposure_us"], 60)
        reader.hear(5, lambda: len(reader.parameters) > 1)
        self.assertEqual(reader.parameters[1], (None, values))
        reader.socket.say(op="getParameters", parameterNames=[], id="all")
        reader.hear(5, lambda: len(reader.parameters) > 2)
        self.assertIn("/striper/method", reader.parameters[2][1])
        writer.socket.say(op="setParameters", parameters=[{"name": "/striper/exposure_us", "value": -1}, {"name": "/other/x", "value": 1}])
        writer.hear(5, lambda: writer.statuses)
        self.assertIn("exposure_us=-1", writer.statuses[0]["message"])
        self.assertIn("/other/x", writer.statuses[0]["message"])

    def test_foxglove_services(self):
        reader, writer = Viewer(self.port), Viewer(self.port, path="/?token=" + self.token)
        for one in (reader, writer):
            one.hear(5, lambda one=one: one.services)
        self.assertEqual(set(writer.services), {"/striper/" + word for word in ("start", "stop", "lasers_off", "lasers_on", "record")})
        self.assertIn("secret", reader.call("/striper/stop"))
        self.assertEqual({str(reader.call("/striper/stop")) for _ in range(60)} & {"too many calls in a second"}, {"too many calls in a second"})
        self.assertEqual(reader.call("/striper/lasers_off"), {"message": "lasers off"})
        self.assertIn("--allow-lasers-on", writer.call("/striper/lasers_on"))
        self.assertIn("seconds", writer.call("/striper/record"))
        self.assertEqual(writer.call("/striper/stop"), {"message": "stopped"})
        writer.socket.send(b"\2\1", 2)
        writer.hear(5, lambda: writer.statuses)
        self.assertIn("cut off", writer.statuses[0]["message"])


def judges(test, otherwise):
    """The folder with the packages of npm that judge us; where they cannot be had the test is skipped, and says so."""
    here = os.path.dirname(os.path.abspath(__file__))
    work = os.environ["WEB_JUDGE_WORK"]
    os.makedirs(work, exist_ok=True)
    for name in ("package.json", "package-lock.json", "foxglove_client.mjs", "../../foreign/.npmrc"):
        shutil.copy(os.path.join(here, name), work)
    if shutil.which("npm") is None:
        test.skipTest(f"{otherwise}: npm is not installed")
    with open(os.path.join(work, ".lock"), "w", encoding="ascii") as lock:  # Tests run beside each other.
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(["npm", "ci", "--no-audit"], cwd=work, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        test.skipTest(f"{otherwise}: {done.stderr}")
    return work


class FoxgloveClient:
    """Foxglove's own client, @foxglove/ws-protocol of npm, which is told what to do and says what it hears."""

    def __init__(self, test, url, *subprotocols):
        # pylint: disable=consider-using-with
        self.program = subprocess.Popen(["node", os.path.join(test.work, "foxglove_client.mjs"), url, *subprotocols],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.heard = []
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()
        test.addCleanup(self.end)

    def read(self):
        for line in self.program.stdout:
            self.heard.append(json.loads(line))

    def end(self):
        if self.program.poll() is None:
            self.program.kill()
        self.program.wait(timeout=10)
        self.reader.join(timeout=10)
        self.program.stdin.close()
        self.program.stdout.close()

    def tell(self, what, value=None):
        self.program.stdin.write(json.dumps({"what": what, "value": value}) + "\n")
        self.program.stdin.flush()

    def all(self, what):
        return [one["value"] for one in list(self.heard) if one["what"] == what]

    def wait_for(self, what, times=1, seconds=15):
        end = time.monotonic() + seconds
        while len(self.all(what)) < times:
            if time.monotonic() > end:
                raise TimeoutError(f"{what} x{times} not in {self.heard[-3:]}")
            time.sleep(0.02)
        return self.all(what)[-1]

    def messages(self, topic):
        return [one["message"] for one in self.all("message") if one["topic"] == topic]


class WsProtocol(Served):
    """What Foxglove's own client makes of us."""

    def setUp(self):
        self.work = judges(self, "FOXGLOVE'S CLIENT HAS NOT HEARD US")
        super().setUp()

    def test_hears_the_csv_by_both_subprotocols(self):
        self.wait_until_ready()
        clients = []
        for name in ("foxglove.websocket.v1", "foxglove.sdk.v1"):
            client = FoxgloveClient(self, f"ws://127.0.0.1:{self.port}", name)
            self.assertEqual(client.wait_for("open"), name)
            client.wait_for("topics")
            for topic in ("/striper/points", "/striper/scan", "/striper/camera_info", "/tf_static", "/diagnostics"):
                client.tell("subscribe", topic)
            clients.append(client)
        time.sleep(3)
        for client in clients:
            self.assertEqual(client.all("error"), [])
            self.assertEqual(len(client.messages("/tf_static")), 1)  # It came late.
            for topic in ("/striper/camera_info", "/diagnostics", "/striper/scan"):
                self.assertGreater(len(client.messages(topic)), 1, topic)
        before = len(clients[0].messages("/striper/points"))
        self.assertGreater(before, 30)
        clients[0].tell("unsubscribe", "/striper/points")
        time.sleep(0.5)
        stopped = len(clients[0].messages("/striper/points"))
        time.sleep(1)
        self.assertEqual(len(clients[0].messages("/striper/points")), stopped)
        self.end()
        for client in clients:
            client.wait_for("close")
            self.judge(client)

    def judge(self, client):
        table = self.rows()
        for message in client.messages("/striper/points")[:10]:
            stamp = message["header"]["stamp"]
            stamp_s = stamp["sec"] + stamp.get("nsec", stamp.get("nanosec", 0)) / 1e9
            (rows,) = [rows for time_s, rows in table.items() if abs(float(time_s) - stamp_s) < 1e-6]
            data = base64.b64decode(message["data"])
            offsets = {field["name"]: field["offset"] for field in message["fields"]}
            self.assertEqual(message["width"], len(rows))
            for i, row in enumerate(rows):
                for name, column in COLUMNS.items():
                    (value,) = struct.unpack_from("<f", data, i * message["point_step"] + offsets[name])
                    if row[column] == "":
                        self.assertTrue(math.isnan(value))
                    else:
                        self.assertEqual(value, float32(float(row[column])))

    def test_changes_what_it_may(self):
        self.wait_until_ready()
        with open(self.path("state", "token"), encoding="ascii") as file:
            token = file.read().strip()
        reader = FoxgloveClient(self, f"ws://127.0.0.1:{self.port}", "foxglove.sdk.v1")
        writer = FoxgloveClient(self, f"ws://127.0.0.1:{self.port}/?token={token}", "foxglove.websocket.v1")
        for client in (reader, writer):
            client.wait_for("services")
        reader.tell("watchParameters", ["/striper/gain_db"])
        self.assertEqual(reader.wait_for("parameterValues")["parameters"], [{"name": "/striper/gain_db", "value": 0, "type": "float64"}])
        reader.tell("setParameters", [{"name": "/striper/gain_db", "value": 3}])
        self.assertIn("needs the secret", reader.wait_for("status")["message"])
        writer.tell("setParameters", [{"name": "/striper/gain_db", "value": 6}])
        self.assertEqual(writer.wait_for("parameterValues")["id"], "set")
        self.assertEqual(reader.wait_for("parameterValues", 2)["parameters"][0]["value"], 6)
        reader.tell("call", {"name": "/striper/lasers_off", "callId": 5, "request": {}})
        self.assertEqual(reader.wait_for("serviceCallResponse"), {"callId": 5, "encoding": "json", "text": '{"message":"lasers off"}\n'})
        reader.tell("call", {"name": "/striper/stop", "callId": 6, "request": {}})
        self.assertEqual(reader.wait_for("serviceCallFailure")["callId"], 6)

    def test_comes_back(self):
        self.wait_until_ready()
        first = FoxgloveClient(self, f"ws://127.0.0.1:{self.port}", "foxglove.websocket.v1")
        session = first.wait_for("serverInfo")["sessionId"]
        again = FoxgloveClient(self, f"ws://127.0.0.1:{self.port}", "foxglove.websocket.v1")
        self.assertEqual(again.wait_for("serverInfo")["sessionId"], session)
        port = self.port
        self.end()
        first.wait_for("close")
        self.start(to=f"web:{port}")
        again = FoxgloveClient(self, f"ws://127.0.0.1:{port}", "foxglove.websocket.v1")
        self.assertNotEqual(again.wait_for("serverInfo")["sessionId"], session)
        again.wait_for("topics")
        again.tell("subscribe", "/striper/points")
        again.wait_for("message")


class Strangers(Served):
    """Who must be refused, and scans go on."""

    def raw(self, text):
        with socket.create_connection(("127.0.0.1", self.port), timeout=15) as stream:
            stream.sendall(text)
            answer = b""
            try:
                while piece := stream.recv(4096):
                    answer += piece
            except ConnectionResetError:
                pass
        return answer.decode(errors="replace").split("\r\n")[0]

    def test_are_refused(self):
        self.wait_until_ready()
        host = f"127.0.0.1:{self.port}"
        for headers, code in (({"Host": "evil.example"}, 403), ({"Host": f"evil.example:{self.port}"}, 403),
                              ({"Origin": "http://evil.example"}, 403), ({"Origin": "null"}, 403),
                              ({"Origin": f"http://{host}"}, 200), ({"Host": f"localhost:{self.port}"}, 200)):
            self.assertEqual(self.get("/api/v1/status", headers=headers)[0], code, headers)
        for method in ("POST", "PUT", "DELETE", "OPTIONS"):
            self.assertEqual(self.get("/api/v1/status", method)[0], 405, method)
        for path in ("/../../etc/passwd", "/%2e%2e/etc/passwd", "/page.hpp", "/api/v1/nothing", "//", "/live.js/"):
            self.assertEqual(self.get(path)[0], 404, path)
        for headers in (["Origin: http://evil.example"], ["Origin: https://app.foxglove.dev"]):
            self.assertIn("403", Socket(self.port, headers=headers).answer.split("\r\n")[0])
        self.assertIn("400", Socket(self.port, subprotocols="chat").answer.split("\r\n")[0])
        self.assertIn("400", Socket(self.port, path="/api/v1/status").answer.split("\r\n")[0])
        self.assertIn("431", self.raw(f"GET / HTTP/1.1\r\nHost: {host}\r\nX: {'a' * 20000}\r\n\r\n".encode()))
        self.assertIn("413", self.raw(f"POST / HTTP/1.1\r\nHost: {host}\r\nContent-Length: 1000000000\r\n\r\n".encode()))
        self.assertIn("400", self.raw(b"\x00\x01\x02\r\n\r\n"))
        self.assertEqual(self.get("/readyz")[0], 200)

    def test_cannot_take_all_the_room(self):
        self.wait_until_ready()
        crowd = [socket.create_connection(("127.0.0.1", self.port), timeout=5) for _ in range(200)]
        for one in crowd[:64]:
            one.sendall(b"GET / HTTP/1.1\r\nHost: ")  # And nothing more.
        time.sleep(11)
        self.assertEqual(self.get("/readyz")[0], 200)  # The slow ones are gone.
        for one in crowd:
            one.close()
        giant = Viewer(self.port)
        giant.hear(0.3)
        giant.socket.socket.sendall(bytes([0x81, 255]) + struct.pack(">Q", 1_000_000_000) + b"mask")
        with self.assertRaises((EOFError, ConnectionError, socket.timeout)):
            for _ in range(100):
                if giant.socket.frame()[0] == 8:
                    raise EOFError
        self.assertEqual(self.get("/readyz")[0], 200)

    def test_a_port_that_is_taken_is_said(self):
        done = striper("serve", "sim:" + self.scene, "-m", self.model, "--to", f"web:{self.port}", code=1)
        self.assertIn(f"nothing can listen at 127.0.0.1 port {self.port}: Address already in use", done.stderr)


if __name__ == "__main__":
    unittest.main()
