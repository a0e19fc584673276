#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Says whether two builds of striper give the same scans, byte for byte, and the same calibrations, to 7 digits.

usage: same_scans.py OLD_STRIPER NEW_STRIPER [--real DIR] [--frames N]

Every scene that comes with Striper is simulated by both programs, and scanned by both in the ways below, each alone and
with all returns; every calibration below is made by both. With --real the images under DIR are scanned too. What differs
is named with its first line that does; the exit code is 1 then.
"""
import argparse
import collections
import filecmp
import itertools
import math
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
IMAGES = (".png", ".pgm", ".jpg", ".jpeg", ".bmp", ".tif")
MOST_IMAGES = 12  # Of one folder of real ones.
WAYS = {
    "default": [],
    "paper": ["--method", "paper"],
    "fast": ["--method", "fast"],
    "continuous": ["--peak", "continuous"],
    "all peaks": ["--peak", "all"],
    "no ambient": ["--ambient", "none"],
    "temporal": ["--ambient", "temporal"],
    "rows": ["--axis", "rows"],
}
CALIBRATIONS = {
    "the shipped session": ["--board", "9x6", "--square", "0.06", "--lasers", ROOT / "data/calibration"],
    "its camera alone": ["--board", "9x6", "--square", "0.06", "--boards", ROOT / "data/calibration"],
}


# How long it took, and when that was.
OF_THE_CLOCK = re.compile(rb"[0-9.]+ s\b|\([0-9.]+/s\)|date: .*")


def without_clock(text):
    return OF_THE_CLOCK.sub(b"-", text)


NUMBER = re.compile(rb"-?[0-9]+\.[0-9]+(?:e-?[0-9]+)?")


def are_alike(old, new):
    """Whether two models are, to 7 digits: sums over several threads end in other ones each time."""
    if NUMBER.sub(b"", old) != NUMBER.sub(b"", new):
        return False
    numbers = [map(float, NUMBER.findall(text)) for text in (old, new)]
    return all(math.isclose(a, b, rel_tol=1e-7, abs_tol=1e-12) for a, b in zip(*numbers, strict=True))


def run(program, *arguments):
    """What the program printed and its exit code: these have to be alike too."""
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, check=False)
    return f"exit code {done.returncode}\n".encode() + without_clock(done.stderr)


def first_difference(old, new):
    """The first line that differs."""
    for number, (a, b) in enumerate(itertools.zip_longest(old.splitlines(), new.splitlines()), 1):
        if a != b:
            return f"line {number}: {a!r:.120} became {b!r:.120}"
    return "the ends of their lines"


class Comparison:
    def __init__(self, old, new, scratch):
        self.programs = {"old": old, "new": new}
        self.scratch = scratch
        self.compared = collections.Counter()
        self.differences = []

    def compare(self, kind, name, *arguments, output):
        """Runs both programs with an output file each and compares what they wrote and said."""
        said, files = [], []
        for age, program in self.programs.items():
            files.append(self.scratch / f"{age}-{output}")
            files[-1].unlink(missing_ok=True)
            text = run(program, *arguments, "-o", files[-1])
            said.append(text.replace(f"{age}-{output}".encode(), output.encode()))
        self.compared[kind] += 1
        if said[0] != said[1]:
            self.differ(kind, name, "what is said, " + first_difference(*said))
        written = [without_clock(file.read_bytes()) if file.exists() else b"" for file in files]
        same = are_alike(*written) if kind == "calibrations" else written[0] == written[1]
        if not same:
            self.differ(kind, name, first_difference(*written))

    def differ(self, kind, name, what):
        self.differences.append(f"{kind}, {name}: {what}")
        print(self.differences[-1], flush=True)

    def scene(self, scene, frames):
        folders = {age: self.scratch / f"{age}-{scene.stem}" for age in self.programs}
        for age, program in self.programs.items():
            run(program, "simulate", scene, "-o", folders[age], "--frames", frames)
        names = sorted(path.name for path in folders["old"].iterdir())
        same = filecmp.cmpfiles(folders["old"], folders["new"], names, shallow=False)
        self.compared["simulated files"] += len(names)
        for name in same[1] + same[2]:
            self.differ("simulated file", f"{scene.stem}/{name}", "not the same bytes")
        for way, options in WAYS.items():
            for missing in ([], ["--missing", "--doubtful"]):
                self.compare("scans", f"{scene.stem}, {way}{' with all' if missing else ''}",
                             "capture", f"images:{folders['old']}", "--model", folders["old"] / "model.yaml",
                             *options, *missing, output="scans.csv")

    def real(self, folder):
        for axis in ("columns", "rows"):
            self.compare("scans of real images", f"{folder.name} along {axis}", "capture", f"images:{folder}",
                         "--axis", axis, "--frames", MOST_IMAGES, "--missing", "--doubtful", output="scans.csv")


def folders_of_images(root):
    return sorted({path.parent for path in root.rglob("*") if path.suffix.lower() in IMAGES})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=pathlib.Path, help="the striper program of before")
    parser.add_argument("new", type=pathlib.Path, help="the one of after")
    parser.add_argument("--real", type=pathlib.Path, help="a folder with folders of real images")
    parser.add_argument("--frames", type=int, default=6, help="of each scene (6)")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="same-scans-") as scratch:
        comparison = Comparison(arguments.old.resolve(), arguments.new.resolve(), pathlib.Path(scratch))
        for scene in sorted((ROOT / "data/scenes").glob("*.yaml")):
            comparison.scene(scene, arguments.frames)
        for name, options in CALIBRATIONS.items():
            comparison.compare("calibrations", name, "calibrate", *options, output="model.yaml")
        for folder in folders_of_images(arguments.real) if arguments.real else []:
            comparison.real(folder)
    for kind, count in comparison.compared.items():
        print(f"{count} {kind} compared")
    print(f"{len(comparison.differences)} differ")
    return 1 if comparison.differences else 0


if __name__ == "__main__":
    sys.exit(main())
