#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lets other people's programs read the files that Striper writes: PCL, @mcap/core, @foxglove's CDR reader,
@loaders.gl.

  foreign_test.py --files PROGRAM --work DIR

PROGRAM is foreign_files. The judges are installed from npm into DIR as package-lock.json pins them; where npm is not reached the test is
skipped, exit code 77. Proves that every field of every message is read to the bit, by index and as a stream,
that what we damage is refused, and that points are where we put them.
"""
import argparse
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
SKIPPED = 77


def run(command, cwd=None):
    return subprocess.run([str(word) for word in command], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def skip(why):
    print(f"SKIPPED: NO FOREIGN PROGRAM HAS READ OUR FILES: {why}", file=sys.stderr)
    sys.exit(SKIPPED)


def install_judges(work):
    if shutil.which("node") is None or shutil.which("npm") is None:
        skip("node and npm are not installed")
    for name in ("package.json", "package-lock.json", ".npmrc", "judge.mjs", "judge_points.mjs"):
        if (HERE / name).exists():
            shutil.copy(HERE / name, work / name)
    installed = work / "node_modules" / "installed"
    lock = (HERE / "package-lock.json").read_text()
    if installed.exists() and installed.read_text() == lock:
        return
    result = run(["npm", "ci"], cwd=work)
    if result.returncode != 0:
        if any(word in result.stdout for word in ("ENOTFOUND", "ECONN", "ETIMEDOUT", "EAI_AGAIN", "E403", "E404", "network")):
            skip(f"npm is not reached:\n{result.stdout}")
        sys.exit(f"npm ci ended with {result.returncode}:\n{result.stdout}")
    installed.write_text(lock)


def judge(work, *words):
    result = run(["node", work / "judge.mjs", *words])
    print(result.stdout, end="")
    if result.returncode != 0:
        sys.exit(f"judge.mjs {' '.join(map(str, words))} ended with {result.returncode}")


def read_ascii_pcd(path):
    """Fields and rows of a PCD file as PCL writes it."""
    lines = path.read_text().splitlines()
    fields = next(line for line in lines if line.startswith("FIELDS")).split()[1:]
    rows = lines[lines.index("DATA ascii") + 1:]
    return fields, [[float(word) for word in row.split()] for row in rows]


def judge_with_pcl(work):
    """PCL's own programs turn our PLY and PCD into text; its 7 digits are ours."""
    if shutil.which("pcl_ply2pcd") is None:
        print("SKIPPED: PCL HAS NOT READ OUR POINTS: pcl-tools is not installed", file=sys.stderr)
        return
    commands = {"ply": ["pcl_ply2pcd", "-format", "0"], "pcd": ["pcl_convert_pcd_ascii_binary"]}
    for extension, command in commands.items():
        read = work / f"pcl_{extension}.pcd"
        result = run([*command, work / f"points.{extension}", read, *(["0"] if extension == "pcd" else [])])
        if result.returncode != 0 or not read.exists():
            sys.exit(f"{command[0]} ended with {result.returncode}:\n{result.stdout}")
        fields, rows = read_ascii_pcd(read)
        expected = json.loads((work / f"points_{extension}.json").read_text())
        if fields != "x y z intensity sigma sigma_cal width confidence status time".split():
            sys.exit(f"{read}: fields {fields}")
        if len(rows) != len(expected):
            sys.exit(f"{read}: {len(rows)} points, {len(expected)} expected")
        for number, (row, point) in enumerate(zip(rows, expected)):
            for value, wanted in zip(row, point):
                is_same = math.isnan(value) if wanted is None else math.isclose(value, wanted, rel_tol=1e-6)
                if not is_same:
                    sys.exit(f"{read}: point {number}: {value}, {wanted} expected")
        print(f"{command[0]}: {len(rows)} points of points.{extension} agree, every field is there")


def records(data):
    """Offset, kind and length of each record of an MCAP file."""
    at = 8
    while at + 9 <= len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, at)
        yield at, kind, length
        at += 9 + length


def flip(path, data, offset, bit=1):
    damaged = bytearray(data)
    damaged[offset] ^= bit
    path.write_bytes(damaged)
    return path


def damaged_files(work):
    """A flipped bit in a chunk, the attachment, the summary; a file cut in the middle."""
    data = (work / "zstd.mcap").read_bytes()
    found = list(records(data))
    chunks = [(at, length) for at, kind, length in found if kind == 6]
    attachments = [(at, length) for at, kind, length in found if kind == 9]
    statistics = [(at, length) for at, kind, length in found if kind == 11]
    for number, (at, length) in enumerate(chunks[:: max(1, len(chunks) // 8)]):
        yield flip(work / f"chunk{number}.mcap", data, at + 9 + length // 2)
    yield flip(work / "attachment.mcap", data, attachments[0][0] + 9 + attachments[0][1] - 10)
    yield flip(work / "statistics.mcap", data, statistics[0][0] + 12)
    (work / "cut.mcap").write_bytes(data[: len(data) // 2])
    yield work / "cut.mcap"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--files", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    written = run([options.files, options.work])
    if written.returncode != 0:
        sys.exit(f"{options.files} ended with {written.returncode}:\n{written.stdout}")
    judge_with_pcl(options.work)
    install_judges(options.work)
    judge(options.work, "messages", options.work / "zstd.mcap", options.work / "expected.jsonl")
    judge(options.work, "messages", options.work / "plain.mcap", options.work / "expected.jsonl")
    judge(options.work, "messages", options.work / "repaired.mcap", options.work / "repaired.jsonl")
    judge(options.work, "refused", *damaged_files(options.work))
    for extension in ("ply", "pcd", "las"):
        judge(options.work, "points", options.work / f"points.{extension}", options.work / f"points_{extension}.json")


if __name__ == "__main__":
    main()
