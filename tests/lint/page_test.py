#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs what a page tells people to type, and checks that the code it shows is the example's own.

usage: page_test.py SOURCE_DIR STRIPER_PROGRAM PAGE
Proves that every `striper ...` line of the page's shell blocks, and what of COMMANDS is between them, ends with exit code 0, in
order, in one folder that at first holds data/ and apps/plot/ alone; that plots are there and whole; that its C++ blocks
stand, line for line, in the first example; that what it links to exists. Does not prove that a plot shows what it should.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

COMMANDS = ("striper", "gnuplot", "printf", "cp")
PLOTS = {".png": (b"\x89PNG", b"IEND\xaeB`\x82"), ".svg": (b"<?xml", b"</svg>")}


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def commands_of(text):
    lines = [line for block in blocks(text, "sh") for line in block.replace("\\\n", " ").splitlines()]
    return [line for line in lines if line.split(" ")[0] in COMMANDS]


def run(commands, source, program):
    with tempfile.TemporaryDirectory() as folder:
        for part in ("data", "apps/plot"):
            shutil.copytree(source / part, pathlib.Path(folder) / part)
        path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
        for command in commands:
            print("$", command, flush=True)
            subprocess.run(command, shell=True, cwd=folder, check=True, env={**os.environ, "PATH": path})
        for plot in re.findall(r"^gnuplot -c \S+.*? (\S+\.(?:svg|png))", "\n".join(commands), re.M):
            first, last = PLOTS[pathlib.Path(plot).suffix]
            content = (pathlib.Path(folder) / plot).read_bytes().strip()
            if not (content.startswith(first) and content.endswith(last)):
                sys.exit(f"{plot} is no whole plot: {len(content)} bytes")


def main():
    source, program, page = (pathlib.Path(argument) for argument in sys.argv[1:])
    program = program.resolve()
    text = (source / page).read_text()

    example = (source / "apps/examples/01_stream_scans.cpp").read_text()
    for block in blocks(text, "cpp"):
        if block not in example:
            sys.exit(f"{page} shows code that is not in the example:\n{block}")

    commands = commands_of(text)
    if not any(command.startswith("striper ") for command in commands):
        sys.exit(f"{page} shows no striper command")
    run(commands, source, program)

    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text):
        if not ((source / page).parent / link).exists():
            sys.exit(f"{page} links to {link}, which does not exist")


main()
