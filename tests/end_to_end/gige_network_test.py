# SPDX-License-Identifier: Apache-2.0
"""Proves that `striper doctor` and `striper devices` tell what is wrong between this machine and a
camera on a cable: nobody there, another subnet, the reverse-path filter, a firewall in the way, an
interface with a small MTU. The network is one of our own: two network namespaces with a virtual cable
between them, the camera (Aravis' arv-fake-gv-camera-0.8, or a few lines that answer as a camera of
another subnet does) in one, striper in the other. Needs the right to make namespaces and skips without.

Run by ctest; by hand, as root: STRIPER=build/release/apps/striper/striper python3 gige_network_test.py
"""
import json
import os
import socket
import struct
import subprocess
import sys
import time
import unittest

from program import STRIPER

HOST, CAMERA = (f"striper-{side}-{os.getpid()}" for side in ("host", "camera"))


def ip(*arguments):
    return subprocess.run(["ip", *arguments], capture_output=True, text=True, check=True)


def answer_as_a_camera(address):
    """Answers discoveries as GigE Vision 1.2 (16.2.3) wants it of a camera that has no way back to who
    asked: with a broadcast, where the request allows that."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as broadcast_socket:
        broadcast_socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        broadcast_socket.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, b"cable")
        broadcast_socket.bind(("", 3956))
        print("ready", flush=True)
        while True:
            request, who = broadcast_socket.recvfrom(1024)
            flags, command, number = request[1], *struct.unpack(">H2xH", request[2:8])
            if command != 2 or not flags & 0x10:
                continue
            about = bytearray(0xF8)
            about[0x0A:0x10] = bytes.fromhex("020000000001")
            about[0x24:0x28] = socket.inet_aton(address)
            about[0x34:0x38] = socket.inet_aton("255.255.255.0")
            about[0x48:0x52] = b"Other side"
            about[0x68:0x6D] = b"Model"
            about[0xD8:0xDC] = b"FAR1"
            answer = struct.pack(">HHHH", 0, 3, len(about), number) + about
            broadcast_socket.sendto(answer, ("255.255.255.255", who[1]))


# What the fake camera's pattern of slopes looks like to a striper is not what these tests are about.
ANY_FRAMES = (0, 1)


class Network(unittest.TestCase):
    def setUp(self):
        try:
            ip("netns", "add", HOST)
        except (FileNotFoundError, subprocess.CalledProcessError) as failure:
            self.skipTest(f"no right to make a network namespace: {failure}")
        self.addCleanup(ip, "netns", "del", HOST)
        ip("netns", "add", CAMERA)
        self.addCleanup(ip, "netns", "del", CAMERA)
        ip("link", "add", "cable", "netns", HOST, "type", "veth", "peer", "name", "cable", "netns", CAMERA)
        for side, address in ((HOST, "10.77.1.1/24"), (CAMERA, self.camera_address + "/24")):
            for device in ("lo", "cable"):
                ip("-n", side, "link", "set", device, "up")
            ip("-n", side, "addr", "add", address, "dev", "cable")
        self.filter_by_reverse_path(0)

    camera_address = "10.77.1.2"

    def filter_by_reverse_path(self, value):
        for name in ("all", "cable"):
            self.inside(HOST, "sh", "-c", f"echo {value} > /proc/sys/net/ipv4/conf/{name}/rp_filter")

    def inside(self, side, *command):
        return subprocess.run(
            ["ip", "netns", "exec", side, *command], capture_output=True, text=True, timeout=60,
            check=False,
        )

    def start_camera(self, *command):
        program = subprocess.Popen(
            ["ip", "netns", "exec", CAMERA, *command], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )

        def end():
            program.terminate()
            program.communicate()

        self.addCleanup(end)
        return program

    def start_fake_camera(self):
        self.start_camera("arv-fake-gv-camera-0.8", "-i", "cable", "-s", "FAKE1")
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            # Its port, 3956, is open.
            if ":0F74" in self.inside(CAMERA, "cat", "/proc/net/udp").stdout:
                return
            time.sleep(0.05)
        self.fail("arv-fake-gv-camera-0.8 does not begin")

    def doctor(self, source="gige:", codes=(1,)):
        done = self.inside(HOST, STRIPER, "doctor", source, "--seconds", "1", "--json")
        self.assertIn(done.returncode, codes, done.stdout + done.stderr)
        return json.loads(done.stdout)["findings"]

    def check(self, findings, severity, what, cure):
        for one in findings:
            if what in one["what"]:
                self.assertEqual(one["severity"], severity)
                self.assertIn(cure, one["cure"])
                return
        self.fail(f"nobody says '{what}': {findings}")


class SameSubnet(Network):
    def test_nobody_there(self):
        findings = self.doctor()
        self.check(findings, "bad", "no camera answers; asked on ", "powered and plugged")
        self.check(findings, "bad", "cable (10.77.1.1)", "firewall")

    def test_camera_that_is_well(self):
        self.start_fake_camera()
        findings = self.doctor("gige:FAKE1?roi=0,0,64,64&fps=20", ANY_FRAMES)
        self.check(findings, "good", "Fake FAKE1 answers at 10.77.1.2 on cable", "")
        self.check(findings, "good", "free to be opened", "")
        self.check(findings, "doubtful", "MTU of cable is 1500", "ip link set cable mtu 9000")

    def test_answers_that_a_firewall_drops(self):
        self.start_fake_camera()
        ip("-n", CAMERA, "route", "add", "blackhole", "10.77.1.1/32")
        self.check(self.doctor(), "bad", "no camera answers", "UDP from port 3956")

    def test_list(self):
        self.start_fake_camera()
        listed = self.inside(HOST, STRIPER, "devices").stdout
        self.assertIn("gige:FAKE1\n  Aravis Fake FAKE1 (GigE Vision on cable, 10.77.1.2), free", listed)


class OtherSubnet(Network):
    camera_address = "10.77.2.2"

    def setUp(self):
        super().setUp()
        ip("-n", CAMERA, "route", "add", "10.77.1.0/24", "dev", "cable")

    def test_camera_of_another_subnet(self):
        self.start_fake_camera()
        findings = self.doctor()
        self.check(
            findings, "bad", "wrong subnet: the camera is 10.77.2.2, cable is 10.77.1.1/255.255.255.0",
            "ip addr add 10.77.2.254/24 dev cable",
        )
        listed = self.inside(HOST, STRIPER, "devices").stdout
        self.assertIn("other subnet", listed)
        done = self.inside(HOST, STRIPER, "capture", "gige:FAKE1", "--frames", "1")
        self.assertEqual(done.returncode, 1)
        self.assertIn("of another subnet than 10.77.1.1 on cable", done.stderr)

    def test_the_cure_cures(self):
        self.start_fake_camera()
        ip("-n", HOST, "addr", "add", "10.77.2.254/24", "dev", "cable")
        findings = self.doctor("gige:FAKE1?roi=0,0,64,64&fps=20", ANY_FRAMES)
        self.check(findings, "good", "free to be opened", "")
        self.check(findings, "good", "opened: Aravis Fake FAKE1", "")

    def test_reverse_path_filter(self):
        self.start_fake_camera()
        self.filter_by_reverse_path(1)
        self.check(self.doctor(), "bad", "no camera answers", "sysctl -w net.ipv4.conf.cable.rp_filter=2")
        self.filter_by_reverse_path(2)
        ip("-n", HOST, "route", "add", "10.77.2.0/24", "dev", "cable")
        self.check(self.doctor(), "bad", "wrong subnet: the camera is 10.77.2.2", "ip addr add")

    def test_camera_that_can_only_shout(self):
        ip("-n", CAMERA, "route", "del", "10.77.1.0/24", "dev", "cable")
        camera = self.start_camera(sys.executable, __file__, "camera", "10.77.2.2")
        self.assertEqual(camera.stdout.readline(), b"ready\n")
        self.check(self.doctor(), "bad", "wrong subnet: the camera is 10.77.2.2", "10.77.2.254/24")
        self.filter_by_reverse_path(1)
        self.check(
            self.doctor(), "bad", "the reverse-path filter of this machine threw 1 packet away",
            "sysctl -w net.ipv4.conf.cable.rp_filter=2",
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["camera"]:
        answer_as_a_camera(sys.argv[2])
    unittest.main()
