# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python package stand on: the source tree, the program, simulated sessions."""
import csv
import os
import pathlib
import subprocess

import numpy as np
import pytest
import striper

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCENES = sorted((ROOT / "data" / "scenes").glob("*.yaml"))


def striper_program():
    return os.environ["STRIPER_PROGRAM"]


def run_program(*arguments):
    return subprocess.run([striper_program(), *map(str, arguments)], check=True, capture_output=True, text=True)


def assert_same_returns(a, b):
    """Field by field: what lies between them in memory is nobody's."""
    assert a.dtype == b.dtype and len(a) == len(b)
    for name in a.dtype.names:
        equal = np.array_equal(a[name], b[name], equal_nan=a[name].dtype.kind == "f")
        assert equal, f"{name} differs"


def table_of(lines):
    """The columns of a CSV, as texts."""
    rows = list(csv.reader(lines))
    return {name: [row[at] for row in rows[1:]] for at, name in enumerate(rows[0])}


def assert_same_as_table(returns, table):
    """Bit for bit: an empty cell is NaN."""
    for name in returns.dtype.names:
        if name == "status":
            words = [striper.Status(code).name.lower() for code in returns["status"]]
            assert words == table["status"]
            continue
        column = np.array([float(text or "nan") for text in table[name]]).astype(returns[name].dtype)
        assert np.array_equal(returns[name], column, equal_nan=True), f"{name} differs"


@pytest.fixture(scope="session")
def session(tmp_path_factory):
    """A folder of images of a scene with its model, made once a scene."""
    made = {}

    def make(scene, frames=4):
        key = (scene, frames)
        if key not in made:
            made[key] = tmp_path_factory.mktemp(pathlib.Path(scene).stem) / "session"
            run_program("simulate", ROOT / "data" / "scenes" / scene, "-o", made[key], "--frames", frames)
        return made[key]

    return make
