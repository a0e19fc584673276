# SPDX-License-Identifier: Apache-2.0
"""Proves that the types of the stubs are those of the module, that the examples keep to them, and that nothing but Python's entry
is seen of the library that the module brings along."""
import os
import pathlib
import re
import subprocess
import sys

import pytest
import striper

from conftest import ROOT

EXAMPLES = sorted((ROOT / "python" / "examples").glob("*.py"))
mypy = pytest.importorskip("mypy", reason="mypy checks the types")


def run_mypy(module, *arguments, folder):
    package = pathlib.Path(striper.__file__).parent.parent
    environment = dict(os.environ, MYPYPATH=str(package), MYPY_CACHE_DIR=str(folder / "cache"))
    command = [sys.executable, "-m", module, *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_stubs_are_the_module(tmp_path):
    allowed = ROOT / "tests" / "python" / "stub_allowlist.txt"
    known = ["--allowlist", allowed, "--ignore-unused-allowlist"]
    run_mypy("mypy.stubtest", "striper", "--ignore-missing-stub", *known, folder=tmp_path)


def test_the_stubs_name_all_there_is():
    stub = (pathlib.Path(striper.__file__).parent / "__init__.pyi").read_text()
    missing = [name for name in striper.__all__ if not re.search(rf"\b{name}\b", stub)]
    assert not missing


def test_the_examples_are_typed(tmp_path):
    run_mypy("mypy", "--strict", "--ignore-missing-imports", *EXAMPLES, folder=tmp_path)


def test_everything_public_says_what_it_is():
    missing = []
    for name in striper.__all__:
        thing = getattr(striper, name)
        if callable(thing) and not (thing.__doc__ or "").strip():
            missing.append(name)
    assert not missing


def test_only_the_entry_is_seen_from_outside():
    module = next(pathlib.Path(striper.__file__).parent.glob("_striper*.so"))
    listed = subprocess.run(["nm", "-D", "--defined-only", module], check=True, capture_output=True, text=True).stdout
    assert [line.split()[-1] for line in listed.splitlines()] == ["PyInit__striper"]
