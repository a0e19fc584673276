#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that folders stay small enough to find one's way in.

usage: folders.py SOURCE_DIR
A folder has at most 24 source files. One with more than 8 has a README of at most a screen; it names the file to read
first, which is there, and every file that it names is there.
"""
import pathlib
import re
import sys

PARTS = ("sdk", "capture", "calibration", "connect", "apps")
MOST_FILES = 24
MOST_WITHOUT_README = 8
SCREEN = (40, 160)  # Lines, columns.


def complaints(root, folder):
    name = folder.relative_to(root).as_posix()
    sources = [f for f in folder.iterdir() if f.suffix in (".cpp", ".hpp", ".inc")]
    if len(sources) > MOST_FILES:
        yield f"{name}: {len(sources)} source files - expected at most {MOST_FILES}: make rooms"
    readme = folder / "README.md"
    if not readme.exists():
        if len(sources) > MOST_WITHOUT_README:
            yield f"{name}: {len(sources)} source files and no README.md"
        return
    if folder.name in PARTS:
        return  # A module's README is for its users.
    text = readme.read_text()
    lines = text.splitlines()
    if len(lines) > SCREEN[0] or max(map(len, lines)) > SCREEN[1]:
        yield f"{name}/README.md: more than a screen of {SCREEN[0]} lines, {SCREEN[1]} columns"
    if len(sources) > MOST_WITHOUT_README and not re.search(r"Read `[^`]+`|read first", text):
        yield f"{name}/README.md: names no file to read first"
    for file in re.findall(r"`(\w[\w./-]*\.(?:cpp|hpp|inc|py|yaml|csv))`", text):
        public = root / "sdk/include/striper"
        is_there = any((p / file).exists() for p in (folder, *folder.parents))
        if not is_there and not list(folder.rglob(file)) and not list(public.rglob(file)):
            yield f"{name}/README.md: there is no {file}"


def main():
    root = pathlib.Path(sys.argv[1]).resolve()
    found = []
    for part in PARTS:
        for folder in sorted([root / part, *(d for d in (root / part).rglob("*") if d.is_dir())]):
            found.extend(complaints(root, folder))
    sys.exit("\n".join(found) or 0)


if __name__ == "__main__":
    main()
