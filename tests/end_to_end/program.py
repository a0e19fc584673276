# SPDX-License-Identifier: Apache-2.0
"""What the tests of the program share: where it and its scenes are, running it, a scratch directory."""
import os
import subprocess
import tempfile
import unittest

STRIPER = os.environ["STRIPER"]
SOURCE_DIR = os.environ.get(
    "STRIPER_SOURCE_DIR", os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
)


def at_most(seconds):
    """How long something may take: sixty times longer where a sanitizer watches the program, which is what it makes of
    rendering a street; but ctest is to hear of it."""
    return min(60 * seconds, 600) if "STRIPER_SANITIZED" in os.environ else seconds


def slowed(seconds):
    """How long something is let run: five times longer where a sanitizer watches the program, which begins late."""
    return 5 * seconds if "STRIPER_SANITIZED" in os.environ else seconds


def scene_path(name):
    """The path of a scene that comes with Striper."""
    return os.path.join(SOURCE_DIR, "data/scenes", name)


def run(*arguments, code=0, timeout=120, **options):
    """Runs a program to its end and returns it, its output as text; fails where its exit code is not
    `code` (None: any will do)."""
    done = subprocess.run(
        [str(argument) for argument in arguments],
        capture_output=True, text=True, timeout=at_most(timeout), check=False, **options,
    )
    if code is not None and done.returncode != code:
        raise AssertionError(f"{arguments} gave {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr}")
    return done


def striper(*arguments, **options):
    return run(STRIPER, *arguments, **options)


class InScratch(unittest.TestCase):
    """Tests with a directory of their own each, which is gone afterwards."""

    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="striper-test-")
        self.addCleanup(scratch.cleanup)
        self.scratch = scratch.name

    def path(self, *names):
        return os.path.join(self.scratch, *names)

    def write(self, name, content):
        """Writes bytes or text, into folders that are made as needed."""
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        return self.path(name)
