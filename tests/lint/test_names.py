#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Proves that every test has a name of its own and one of the labels by which test.sh selects. ctest gives tests of
one name each other's labels, so a quick test that is named like a slow one is left out of the quick tests unseen.

usage: test_names.py CTEST BUILD_DIR
"""
import collections
import json
import subprocess
import sys

STAGES = {"quick", "slow", "device", "foreign", "browser", "fuzz"}


def labels(test):
    return [value for p in test["properties"] if p["name"] == "LABELS" for value in p["value"]]


def main():
    ctest, build = sys.argv[1:]
    listed = subprocess.run([ctest, "--test-dir", build, "--show-only=json-v1"], check=True, capture_output=True)
    tests = json.loads(listed.stdout)["tests"]
    times = collections.Counter(t["name"] for t in tests)
    wrong = [f"{name}: {n} tests have this name" for name, n in sorted(times.items()) if n > 1]
    wrong += [f"{t['name']}: labels {labels(t)}, not one of {sorted(STAGES)}" for t in tests
              if not STAGES & set(labels(t))]
    wrong += [f"{t['name']}: both quick and slow" for t in tests if {"quick", "slow"} <= set(labels(t))]
    print("\n".join(wrong))
    return 1 if wrong or not tests else 0


if __name__ == "__main__":
    sys.exit(main())
