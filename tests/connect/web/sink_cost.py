# SPDX-License-Identifier: Apache-2.0
"""Prints what each sink costs at 200 scans a second of 640 columns: part of a core and allocations a scan, beside a CSV, from a GigE
camera on loopback; web: with a client that takes points and scan, ros2: with nobody who hears.

By hand: STRIPER=... STRIPER_SOURCE_DIR=... python3 sink_cost.py
"""
import mmap
import os
import re
import struct
import subprocess
import time

from web_test import Served, Viewer, VirtualCamera, small_scene, striper

SINKS = {"csv": "csv:{}", "jsonl": "jsonl:{}", "mcap": "mcap:{}", "ply": "ply:{}?speed=2", "web": "web:0", "ros2": "ros2:"}


class Cost(Served):
    SECONDS = 10

    def setUp(self):
        super().setUp()
        self.end()
        text = small_scene().replace("width: 160, height: 120", "width: 640, height: 120")
        self.scene = self.write("wide.yaml", re.sub(r"picture_rate_hz: [\d.]+", "picture_rate_hz: 200", text))
        striper("simulate", self.scene, "-o", self.path("wide"), "--frames", "1")
        self.model = self.path("wide", "model.yaml")

        self.counter, self.count_file = self.path("count.so"), self.path("allocations")
        source = os.path.join(os.environ["STRIPER_SOURCE_DIR"], "tests/connect/web/count_allocations.c")
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", source, "-o", self.counter], check=True)

    def test_cost(self):
        with VirtualCamera(self.scene, "--loop", "60") as camera:
            alone, made = self.cost(camera, [])
            print(f"scanning, web: without a client and csv: together  {alone:.3f} of a core, {made:.1f} allocations a scan")
            every = [uri.format(self.path("all." + name)) for name, uri in SINKS.items() if name != "web"]
            rows = [(name, [uri.format(self.path("cost." + name))], name == "web") for name, uri in SINKS.items()]
            for name, sinks, has_client in (*rows, ("all", every, True)):
                core, more = self.cost(camera, sinks, has_client)
                print(f"{name:6} {core - alone:6.3f} of a core, {more - made:6.1f} allocations a scan", flush=True)

    def cost(self, camera, sinks, has_client=False):
        with open(self.count_file, "wb") as file:
            file.write(bytes(8))
        os.environ.update(LD_PRELOAD=self.counter, ALLOCATION_COUNT=self.count_file)
        self.start(*(word for sink in sinks if sink != "web:0" for word in ("--to", sink)), source=camera.uri("fps=200"))
        del os.environ["LD_PRELOAD"]
        self.wait_until_ready()
        viewer = Viewer(self.port).subscribe("/striper/points", "/striper/scan") if has_client else None
        time.sleep(2)
        used, begin, made = self.cpu_s(), time.monotonic(), self.allocations()
        if viewer:
            viewer.hear(self.SECONDS)
        else:
            time.sleep(self.SECONDS)
        passed = time.monotonic() - begin
        share, made = (self.cpu_s() - used) / passed, self.allocations() - made
        self.end()
        self.tearDown()
        times = self.scan_times()
        rate_hz = (len(times) - 1) / (times[-1] - times[0])
        self.assertGreater(rate_hz, 195, "the camera does not keep up")
        return share, made / (rate_hz * passed)

    def allocations(self):
        with open(self.count_file, "rb") as file, mmap.mmap(file.fileno(), 8, prot=mmap.PROT_READ) as shared:
            return struct.unpack("<q", shared[:8])[0]


del Served

if __name__ == "__main__":
    import unittest
    unittest.main()
