# SPDX-License-Identifier: Apache-2.0
"""Prints what each sink costs at 200 scans a second of 640 columns: part of a core, beside a CSV, from a GigE camera on loopback; web:
with a client that takes points and scan, ros2: with nobody who hears.

By hand: STRIPER=... STRIPER_SOURCE_DIR=... python3 sink_cost.py
"""
import re
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

    def test_cost(self):
        with VirtualCamera(self.scene, "--loop", "60") as camera:
            alone = self.cpu(camera, [])
            print(f"scanning, web: without a client and csv: together  {alone:.3f} of a core")
            for name, uri in SINKS.items():
                print(f"{name:6} {self.cpu(camera, [uri.format(self.path('cost.' + name))], name == 'web') - alone:6.3f}", flush=True)
            every = [uri.format(self.path("all." + name)) for name, uri in SINKS.items() if name != "web"]
            print(f"all    {self.cpu(camera, every, True):6.3f}, scanning included")

    def cpu(self, camera, sinks, has_client=False):
        self.start(*(word for sink in sinks if sink != "web:0" for word in ("--to", sink)), source=camera.uri("fps=200"))
        self.wait_until_ready()
        viewer = Viewer(self.port).subscribe("/striper/points", "/striper/scan") if has_client else None
        time.sleep(2)
        used, begin = self.cpu_s(), time.monotonic()
        if viewer:
            viewer.hear(self.SECONDS)
        else:
            time.sleep(self.SECONDS)
        share = (self.cpu_s() - used) / (time.monotonic() - begin)
        self.end()
        self.tearDown()
        times = sorted(map(float, self.rows()))
        rate_hz = (len(times) - 1) / (times[-1] - times[0])
        returns = sum(len(rows) for rows in self.rows().values()) / len(times)
        self.assertGreater(rate_hz, 195, "the camera does not keep up")
        self.assertEqual(returns, 640)
        return share


del Served

if __name__ == "__main__":
    import unittest
    unittest.main()
