#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs what the README tells people to type, and checks that the code it shows is the example's own.

usage: readme_test.py SOURCE_DIR STRIPER_PROGRAM
Proves that every `striper ...` line of the README's shell blocks ends with exit code 0, in order, in one folder; and
that its C++ block stands, line for line, in the first example.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.S)


def main():
    source, program = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    readme = (source / "README.md").read_text()

    example = (source / "apps/examples/01_stream_scans.cpp").read_text()
    for block in blocks(readme, "cpp"):
        if block not in example:
            sys.exit(f"the README shows code that is not in the example:\n{block}")

    commands = [
        line
        for block in blocks(readme, "sh")
        for line in block.splitlines()
        if line.startswith("striper ")
    ]
    if not commands:
        sys.exit("the README shows no striper command")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(source / "data", pathlib.Path(folder) / "data")
        path = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
        for command in commands:
            print("$", command, flush=True)
            subprocess.run(command, shell=True, cwd=folder, check=True, env={**os.environ, "PATH": path})

    for link in re.findall(r"\]\(([^)#:]+)\)", readme):
        if not (source / link).exists():
            sys.exit(f"the README links to {link}, which does not exist")


main()
