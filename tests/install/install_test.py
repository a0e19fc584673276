#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Builds and runs a consumer's project against an installed Striper.

  install_test.py CASE --build DIR --source DIR --work DIR --components sdk,capture,... [--config CMAKE_OPTION...]

Cases: install (puts the libraries into a folder and moves that to WORK/prefix; the others need it), sdk, sdk_and_simulator,
sdk_and_capture, capture_and_virtual_camera, calibration, python (imports the package), missing (asks for what is not
there and reads the answer), share
(builds the installed examples, and looks whether every example, scene and plot script is there).
"""
import argparse
import pathlib
import shutil
import subprocess
import sys


def fail(message):
    sys.exit(f"install test: {message}")


def run(command):
    result = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.returncode, result.stdout


def must_run(command):
    code, output = run(command)
    if code != 0:
        fail(f"{' '.join(map(str, command))} ended with {code}:\n{output}")
    return output


def install(options):
    # An installation must not depend on where it was put first.
    first = options.work / "first"
    shutil.rmtree(first, ignore_errors=True)
    shutil.rmtree(options.prefix, ignore_errors=True)
    for component in [*options.components, "share"]:
        must_run(["cmake", "--install", options.build, "--prefix", first, "--component", component])
    first.rename(options.prefix)
    for path in options.prefix.rglob("*.cmake"):
        text = path.read_text()
        for private in (str(options.build), str(options.source), str(first)):
            if private in text:
                fail(f"{path} names {private}: it works on this machine only")


def configure(options, components, program):
    work = options.work / f"build_{program}"
    shutil.rmtree(work, ignore_errors=True)
    code, output = run(["cmake", "-S", options.source / "tests/install/consumer", "-B", work,
                        f"-DCMAKE_PREFIX_PATH={options.prefix}", f"-DCOMPONENTS={';'.join(components)}",
                        f"-DPROGRAM={program}", *options.config])
    return code, output, work


def use(options, components, program):
    code, output, work = configure(options, components, program)
    if code != 0:
        fail(f"{program} does not configure:\n{output}")
    must_run(["cmake", "--build", work])
    print(must_run([work / "consumer", options.source / "data/scenes/wall.yaml"]), end="")


def missing(options):
    present = ", ".join(sorted(options.components))
    for components, expected in (
        (["sdk", "teleportation"], f"this installation of striper has no component teleportation; it has {present}"),
        (["sdk", "teleportation", "levitation"], "has no component teleportation, levitation; it has"),
    ):
        code, output, _ = configure(options, components, "missing")
        if code == 0:
            fail(f"found {components}, which do not exist")
        # CMake breaks long lines.
        if expected not in " ".join(output.split()):
            fail(f"expected '{expected}' in:\n{output}")


def import_package(options):
    prefix = options.work / "python"
    shutil.rmtree(prefix, ignore_errors=True)
    must_run(["cmake", "--install", options.build, "--prefix", prefix, "--component", "python"])
    site = next(prefix.rglob("dist-packages"))
    scene = options.source / "data/scenes/room.yaml"
    program = ("import striper; assert striper.__file__.startswith(%r), striper.__file__; "
               "print(striper.scan('sim:%s', model=striper.simulated_model('%s')).next())" % (str(site), scene, scene))
    command = ["env", f"PYTHONPATH={site}", "/usr/bin/python3", "-c", program]
    if "<striper.Scan 0" not in must_run(command):
        fail("the installed package gave no scan")
    if not (site / "striper/py.typed").exists():
        fail("the installed package has no types")


def share(options):
    installed = options.prefix / "share/striper"
    for folder, pattern, part in (("apps/examples", "*.cpp", "examples"), ("apps/plot", "*.gp", "plot"),
                                  ("data/scenes", "*", "scenes"), ("data/roads", "*", "roads"), ("data/can", "*", "can")):
        files = sorted(path.relative_to(options.source / folder) for path in (options.source / folder).rglob(pattern) if path.is_file())
        if not files:
            fail(f"{folder} holds no {pattern}")
        for file in files:
            there = installed / part / file
            if not there.is_file() or there.read_bytes() != (options.source / folder / file).read_bytes():
                fail(f"{there} is not {options.source / folder / file}")
    work = options.work / "build_examples"
    shutil.rmtree(work, ignore_errors=True)
    must_run(["cmake", "-S", installed / "examples", "-B", work, f"-DCMAKE_PREFIX_PATH={options.prefix}", *options.config])
    must_run(["cmake", "--build", work])
    for example in (options.source / "apps/examples").glob("*.cpp"):
        if not (work / example.stem).is_file():
            fail(f"the installed project does not build {example.stem}")
    code, output = run([work / "01_stream_scans", f"sim:{installed}/scenes/room.yaml?frames=1", "none.yaml"])
    if code == 0 or "none.yaml" not in output:
        fail(f"01_stream_scans with a model that is not there ended with {code}:\n{output}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", choices=["install", "sdk", "sdk_and_simulator", "sdk_and_capture",
                                         "capture_and_virtual_camera", "calibration", "missing", "python", "share"])
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--source", type=pathlib.Path, required=True)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--components", type=lambda text: text.split(","), required=True)
    parser.add_argument("--config", nargs=argparse.REMAINDER, default=[], help="options for CMake; the last")
    options = parser.parse_args()
    options.prefix = options.work / "prefix"
    options.work.mkdir(parents=True, exist_ok=True)
    if options.case == "install":
        install(options)
    elif options.case == "missing":
        missing(options)
    elif options.case == "python":
        import_package(options)
    elif options.case == "share":
        share(options)
    else:
        use(options, options.case.split("_and_"), options.case)


if __name__ == "__main__":
    main()
