# SPDX-License-Identifier: Apache-2.0
"""Proves that scans in Python are those of the command line, bit for bit, and that their arrays are safe."""
import gc
import io
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import striper

from conftest import ROOT, SCENES, assert_same_as_table, assert_same_returns, run_program, table_of


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.stem)
def test_arrays_are_the_csv_bit_for_bit(scene, session, tmp_path):
    folder = session(scene.name)
    csv = tmp_path / "scans.csv"
    run_program("capture", f"images:{folder}", "--model", folder / "model.yaml", "-o", csv, "--missing")
    scans = list(striper.scan(f"images:{folder}", model=folder / "model.yaml", on_event=lambda event: None))
    assert scans
    returns = np.concatenate([scan.returns for scan in scans])
    table = table_of(csv.open())
    assert_same_as_table(returns, table)
    lengths = [len(scan) for scan in scans]
    assert np.array_equal(np.repeat([scan.frame for scan in scans], lengths), [int(text) for text in table["frame"]])
    assert np.array_equal(np.repeat([scan.time for scan in scans], lengths), [float(text) for text in table["time_s"]])


def room(session, **options):
    folder = session("room.yaml")
    return striper.scan(f"images:{folder}", model=folder / "model.yaml", **options)


def test_a_scan_as_csv_reads_back(session, tmp_path):
    scan = next(iter(room(session)))
    assert_same_as_table(scan.returns, table_of(io.StringIO(scan.to_csv())))
    path = tmp_path / "one.csv"
    scan.to_csv(path)
    assert path.read_text() == scan.to_csv()
    again = list(striper.scan(path))
    assert len(again) == 1
    assert_same_returns(again[0].returns, scan.returns)


def test_arrays_share_memory_and_cannot_be_written(session):
    scan = next(iter(room(session)))
    returns = scan.returns
    assert returns.ctypes.data == scan.returns.ctypes.data
    assert returns.dtype == striper.returns_dtype
    with pytest.raises(ValueError):
        returns["range_m"][0] = 1.0


def test_points_are_the_ok_returns(session):
    scan = next(iter(room(session)))
    ok = scan.returns[scan.returns["status"] == striper.Status.OK]
    points = scan.points()
    assert points.shape == (len(ok), 3) and points.dtype == np.float64
    assert np.array_equal(points[:, 0], ok["x_m"]) and np.array_equal(points[:, 1], ok["y_m"])


def test_an_array_outlives_scan_and_stream(session):
    stream = room(session)
    kept = [(scan.returns, scan.returns.copy()) for scan in stream]
    del stream
    gc.collect()
    for shared, copy in kept:
        assert_same_returns(shared, copy)


def test_an_array_outlives_the_interpreter(session):
    folder = session("room.yaml")
    program = f"""
import striper, threading
stream = striper.scan("images:{folder}", model=r"{folder}/model.yaml")
kept = next(iter(stream)).returns
source = striper.open_source("images:{folder}")
image = next(iter(source)).image
lasting = threading.local()
lasting.kept = (stream, kept, source, image)
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_the_first_scan_of_a_fresh_process_comes_within_a_second():
    program = f"""
import time
begin = time.perf_counter()
import striper
scan = next(iter(striper.scan("sim:{ROOT}/data/scenes/room.yaml", model=striper.simulated_model("{ROOT}/data/scenes/room.yaml"))))
assert len(scan) == scan.returns.shape[0] > 0
print(time.perf_counter() - begin)
"""
    out = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, timeout=60)
    assert float(out.stdout) < (10.0 if "STRIPER_SANITIZED" in os.environ else 1.0)


def test_options_are_those_of_the_command_line(session):
    names = {option["name"] for option in striper.scanner_options()}
    assert {"peak", "axis", "min_confidence"} <= names
    assert sum(s.points().shape[0] for s in room(session, max_range=1e-3)) == 0
    with pytest.raises(striper.Error) as error:
        room(session, peek="brightest")
    assert error.value.kind == "usage" and "peek" in str(error.value)
    with pytest.raises(striper.Error, match="columns"):
        room(session, axis="diagonal")


@pytest.mark.parametrize(
    "kind, call",
    [
        ("not_found", lambda: striper.load_model("/nowhere/striper.yaml")),
        ("usage", lambda: striper.open_source(f"sim:{SCENES[0]}?frames=few")),
        ("not_found", lambda: striper.open_source("images:/nowhere")),
        ("bad_value", lambda: striper.Frame(np.zeros((4, 4)))),
    ],
)
def test_errors_have_a_kind(kind, call):
    with pytest.raises(striper.Error) as error:
        call()
    assert error.value.kind == kind
    assert isinstance(error.value, RuntimeError)


def test_a_model_of_another_sensor_is_refused(session):
    other = session("wall.yaml") / "model.yaml"
    with pytest.raises(striper.Error, match="is of a camera of"):
        striper.scan(f"images:{session('calibration.yaml')}", model=other)


def unannounced(**options):
    """Scans of frames that do not say what lit them: something is said of that."""
    scene = ROOT / "data" / "scenes" / "room.yaml"
    model = striper.simulated_model(scene)
    return striper.scan(f"sim:{scene}?frames=10&illumination=unknown", model=model, **options)


def test_a_callback_that_raises_stops_nothing():
    heard = []

    def on_event(event):
        heard.append(event.code)
        raise RuntimeError("not my day")

    reported = []
    previous, sys.unraisablehook = sys.unraisablehook, lambda args: reported.append(args.exc_value)
    try:
        scans = list(unannounced(on_event=on_event))
    finally:
        sys.unraisablehook = previous
    assert len(scans) == 10 and heard
    assert len(reported) == len(heard) and str(reported[0]) == "not my day"


def test_events_go_to_the_log_where_nobody_listens(caplog):
    with caplog.at_level("INFO", logger="striper"):
        list(unannounced())
    assert caplog.records and all(record.name == "striper" for record in caplog.records)


def test_next_times_out_and_ends(session):
    stream = room(session)
    assert isinstance(stream.next(timeout=5.0), striper.Scan)
    for _ in stream:
        pass
    with pytest.raises(EOFError):
        stream.next()


def test_a_scanner_takes_frames_one_by_one(session):
    folder = session("room.yaml")
    with striper.open_source(f"images:{folder}") as source:
        scanner = striper.Scanner(folder / "model.yaml", source.info)
        scans = [scan for frame in source for scan in scanner.process(frame)] + scanner.finish()
    expected = list(room(session))
    assert [scan.frame for scan in scans] == [scan.frame for scan in expected]
    for a, b in zip(scans, expected):
        assert_same_returns(a.returns, b.returns)
    assert scanner.status["scans"] == len(scans)


def test_a_recording_can_be_indexed_and_sliced(session, tmp_path):
    folder = session("room.yaml")
    path = tmp_path / "run.mcap"
    run_program("record", f"images:{folder}", "--model", folder / "model.yaml", "-o", path)
    run = striper.recording(path)
    assert len(run) == 4
    assert [scan.frame for scan in run[1:3]] == [run[1].frame, run[2].frame]
    assert run[-1].frame == run[3].frame
    assert [scan.frame for scan in run[::-1]] == [scan.frame for scan in run][::-1]
    with pytest.raises(IndexError):
        run[4]


def interrupted_after(program, seconds):
    """How long a program of Python takes to end by KeyboardInterrupt."""
    import signal

    running = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stdout.readline().strip() == "waiting"
    time.sleep(seconds)
    begin = time.perf_counter()
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=30)
    return time.perf_counter() - begin, out, err


WAITING = """
import time, striper
source = {opened}
next(iter(source))
print("waiting", flush=True)
try:
    {waits}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    import os
    os._exit(0)
"""


@pytest.mark.parametrize("kind", ["source", "scans", "bounded"])
def test_ctrl_c_ends_a_wait(kind):
    scene = f"sim:{ROOT}/data/scenes/room.yaml?fps=.05&realtime=yes"
    opened = f"striper.open_source('{scene}')" if kind == "source" else (
        f"striper.scan('{scene}', model=striper.simulated_model('{ROOT}/data/scenes/room.yaml'))")
    waits = "source.next(30.0)" if kind == "bounded" else "source.next()"
    taken, out, err = interrupted_after(WAITING.format(opened=opened, waits=waits), 0.3)
    assert "interrupted" in out, err
    assert taken < (2.0 if "STRIPER_SANITIZED" in os.environ else 0.2)


def test_two_threads_scan_at_the_same_time(session):
    """The interpreter's lock is free while scanning: a second thread goes on."""
    folder = session("room.yaml")
    frames = list(striper.open_source(f"images:{folder}"))
    scanner = striper.Scanner(folder / "model.yaml", source=striper.open_source(f"images:{folder}?laser=0").info)
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    thread = threading.Thread(target=tick)
    thread.start()
    for _ in range(100):
        for frame in frames:
            scanner.process(frame)
    stop.set()
    thread.join()
    assert len(ticks) > 20
