# SPDX-License-Identifier: Apache-2.0
"""Runs the examples, and what docs/python.md tells people to type."""
import os
import re
import subprocess
import sys

import pytest

from conftest import ROOT

EXAMPLES = sorted((ROOT / "python" / "examples").glob("*.py"))


def run(script, *arguments, folder):
    command = [sys.executable, str(script), *map(str, arguments)]
    environment = dict(os.environ, MPLBACKEND="Agg", MPLCONFIGDIR=str(folder))
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120, check=True)


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda script: script.stem)
def test_example(script, tmp_path):
    if "plot" in script.stem:
        pytest.importorskip("matplotlib", reason="the plots are drawn by matplotlib")
    os.symlink(ROOT / "data", tmp_path / "data")
    out = run(script, folder=tmp_path).stdout
    assert out.strip(), "an example shows something"


def test_the_manual_runs(tmp_path):
    text = (ROOT / "docs" / "python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert len(blocks) >= 4
    os.symlink(ROOT / "data", tmp_path / "data")
    script = tmp_path / "manual.py"
    script.write_text("\n".join(blocks))
    run(script, folder=tmp_path)
