#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Proves what continuous integration promises: its order, that what fails fails the run, that the time cuts without
failing, that what was left out is named. `.ci/run` runs in scratch repositories beside a test.sh that is written here.
That the stage `tidy` looks at every source once, each time from another one on, and fails at a finding, with tools
that are written here. Does not prove that the other stages are right.

usage: ci_test.py SOURCE_DIR
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE_DIR = pathlib.Path(sys.argv.pop(1) if len(sys.argv) > 1 else __file__).resolve()
STAGES = ["asan", "tsan", "tidy", "slow", "fuzz", "device", "foreign", "browser"]
GIT = ["git", "-c", "user.name=t", "-c", "user.email=t@localhost", "-c", "commit.gpgsign=false"]

# Ends as the file STAGE.sh says, where there is one.
TEST_SH = """#!/usr/bin/env bash
stage=${2:-quick}
echo "$stage" >> ran
[ ! -e "$stage.sh" ] || . "./$stage.sh"
"""


class Repository(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.root = pathlib.Path(scratch.name)
        (self.root / ".ci").mkdir()
        shutil.copy(SOURCE_DIR / ".ci/run", self.root / ".ci/run")
        self.write("test.sh", TEST_SH)
        (self.root / "test.sh").chmod(0o755)
        self.git("init", "-q")
        self.commit("README.md")

    def git(self, *words):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
        subprocess.run([*GIT, *words], cwd=self.root, check=True, env=environment)

    def write(self, name, text="x"):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def commit(self, name):
        """One commit more, which changes the file `name`."""
        path = self.root / name
        self.write(name, (path.read_text() if path.exists() else "") + "x")
        self.git("add", name)
        self.git("commit", "-q", "-m", name)

    def plan(self):
        printed = subprocess.run([".ci/run", "--plan"], cwd=self.root, check=True, capture_output=True, text=True)
        lines = dict(line.split(": ") for line in printed.stdout.splitlines())
        return lines["changed"].split(), lines["others"].split()

    def run_ci(self, seconds=60):
        environment = {**os.environ, "STRIPER_CI_SECONDS": str(seconds)}
        return subprocess.run([".ci/run"], cwd=self.root, capture_output=True, text=True, env=environment, timeout=60)

    def ran(self):
        return (self.root / "ran").read_text().split()


class Plan(Repository):
    def test_each_stage_is_there_once_and_each_comes_first_in_turn(self):
        first = []
        for _ in STAGES:
            changed, others = self.plan()
            self.assertEqual(changed, [])
            self.assertCountEqual(others, STAGES)
            first.append(others[0])
            self.commit("docs/a.md")
        self.assertCountEqual(first, STAGES)

    def test_stages_whose_folders_changed_come_before_the_others(self):
        self.commit("connect/web/page/index.html")
        changed, others = self.plan()
        self.assertCountEqual(changed, ["asan", "tsan", "tidy", "fuzz", "device", "foreign", "browser"])
        self.assertEqual(others, ["slow"])

    def test_a_name_that_only_begins_like_a_folder_does_not_count(self):
        self.commit("sdkx/a.cpp")
        self.commit("old/sdk/a.cpp")
        self.assertEqual(self.plan()[0], [])

    def test_changed_stages_have_their_turns_too(self):
        first = set()
        for _ in STAGES:
            self.commit("sdk/src/wire/a.cpp")
            first.add(self.plan()[0][0])
        self.assertLessEqual({"asan", "tidy", "slow", "fuzz", "foreign"}, first)

    def test_twenty_commits_later_it_is_no_change(self):
        self.commit("sdk/a.cpp")
        for _ in range(19):
            self.commit("docs/a.md")
        self.assertTrue(self.plan()[0])
        self.commit("docs/a.md")
        self.assertEqual(self.plan()[0], [])

    def test_folders_exist(self):
        text = (SOURCE_DIR / ".ci/run").read_text()
        table = text[text.index("folders=(") : text.index("\n)", text.index("folders=("))]
        folders = {word for quoted in table.split('"')[1::2] for word in quoted.split()}
        self.assertGreater(len(folders), 10)
        for folder in folders:
            self.assertTrue((SOURCE_DIR / folder).is_dir(), folder)

    def test_stages_are_those_of_test_sh(self):
        usage = subprocess.run(["./test.sh", "--help"], cwd=SOURCE_DIR, capture_output=True, text=True).stdout
        for stage in STAGES:
            self.assertIn(f"\n                   {stage:<8}", usage)


class Run(Repository):
    def test_all_pass(self):
        run = self.run_ci()
        self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertEqual(self.ran()[:2], ["format", "quick"])
        self.assertCountEqual(self.ran()[2:], STAGES)
        self.assertTrue(run.stdout.endswith("failed: nothing; left out: nothing\n"), run.stdout)

    def test_what_must_pass_ends_the_run(self):
        for stage, ran in (("format", ["format"]), ("quick", ["format", "quick"])):
            (self.root / "ran").unlink(missing_ok=True)
            self.write(f"{stage}.sh", "exit 3")
            self.assertEqual(self.run_ci().returncode, 1)
            self.assertEqual(self.ran(), ran)
            (self.root / f"{stage}.sh").unlink()

    def test_quick_tests_that_the_time_cuts_have_failed(self):
        self.write("quick.sh", "sleep 30")
        self.assertEqual(self.run_ci(seconds=3).returncode, 1)

    def test_a_stage_that_fails_fails_the_run_and_the_others_go_on(self):
        self.write("fuzz.sh", "exit 8")
        run = self.run_ci()
        self.assertEqual(run.returncode, 1)
        self.assertEqual(len(self.ran()), 2 + len(STAGES))
        self.assertTrue(run.stdout.endswith("failed: fuzz; left out: nothing\n"), run.stdout)

    def cut_in(self, printed):
        """A run whose second stage prints and then has no end; and which stages came later."""
        order = [stage for group in self.plan() for stage in group]
        self.write(f"{order[1]}.sh", f"cat <<'TXT'\n{printed}\nTXT\nsleep 30")
        started = time.monotonic()
        run = self.run_ci(seconds=4)
        self.assertLess(time.monotonic() - started, 5)
        self.assertIn(f"left out: the rest of {order[1]}", run.stdout.splitlines()[-1])
        return run, order

    def test_the_time_cuts_and_what_is_left_out_is_named(self):
        run, order = self.cut_in("1/9 Test #7: good ...   Passed    0.00 sec")
        self.assertEqual(run.returncode, 0, run.stdout)
        self.assertTrue(run.stdout.endswith(f"left out: {','.join(['the rest of ' + order[1], *order[2:]])}\n"), run.stdout)
        self.assertEqual(self.ran(), ["format", "quick", *order[:2]])

    def test_a_test_that_failed_before_the_cut_fails_the_run(self):
        run, order = self.cut_in("      Start   7: a.bad\n  1/199 Test   #7: a.bad ...***Failed    0.00 sec")
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn("failed before the time was up: a.bad\n", run.stdout)
        self.assertIn(f"failed: {order[1]};", run.stdout.splitlines()[-1])

    def test_a_test_that_was_being_tried_again_at_the_cut_does_not(self):
        run, _ = self.cut_in("    Start 7: a.bad\n1/9 Test #7: a.bad ...***Timeout    1.00 sec\n    Start 7: a.bad")
        self.assertEqual(run.returncode, 0, run.stdout)


class Tidy(Repository):
    SOURCES = [f"src/s{k}.cpp" for k in range(16)]

    def setUp(self):
        super().setUp()
        (self.root / "tests/lint").mkdir(parents=True)
        shutil.copy(SOURCE_DIR / "tests/lint/tidy.sh", self.root / "tests/lint/tidy.sh")
        for source in self.SOURCES:
            self.commit(source)
        entries = [{"file": str(self.root / source)} for source in self.SOURCES]
        self.write("build/compile_commands.json", json.dumps(entries))
        # clang-tidy complains of a source that says so; ninja knows of one header and makes it.
        self.tool("clang-tidy", 'echo "${@: -1}" >> looked\n! grep -q finding "${@: -1}"\n')
        self.tool("ninja", "echo generated.h\n")

    def tool(self, name, text):
        self.write("tools/" + name, "#!/usr/bin/env bash\n" + text)
        (self.root / "tools" / name).chmod(0o755)

    def look(self):
        """The exit code, and the sources in the order in which they were looked at."""
        environment = dict(os.environ, PATH=f"{self.root / 'tools'}:{os.environ['PATH']}",
                           CMAKE_BUILD_PARALLEL_LEVEL="1")
        (self.root / "looked").unlink(missing_ok=True)
        run = subprocess.run(["tests/lint/tidy.sh", "build"], cwd=self.root, env=environment, capture_output=True)
        return run.returncode, (self.root / "looked").read_text().split()

    def test_every_source_once_from_another_one_on(self):
        begins = []
        for _ in range(8):
            code, looked = self.look()
            self.assertEqual(code, 0)
            self.assertEqual(sorted(looked), sorted(self.SOURCES))
            begins.append(looked[0])
            for _ in range(8):
                self.commit("README.md")
        self.assertEqual(len(set(begins)), 8)

    def test_a_finding_fails_and_ends_it(self):
        code, looked = self.look()
        (self.root / looked[3]).write_text("finding")
        code, looked = self.look()
        self.assertEqual((code, len(looked)), (1, 4))


if __name__ == "__main__":
    unittest.main()
