# SPDX-License-Identifier: Apache-2.0
"""A camera and a laser plane as a calibrated range sensor.

    import striper

    for scan in striper.scan("sim:data/scenes/room.yaml?frames=10", model="striper.yaml"):
        ok = scan.returns["status"] == striper.Status.OK
        print(scan.time, scan.returns["range_m"][ok].min())

Lengths are metres, angles radians, positions in images pixels of the full sensor, brightness digital numbers (DN).
What does not exist is NaN. Errors are striper.Error, whose `kind` says what went wrong.
"""
import enum as _enum
import logging as _logging
import os as _os

from . import _striper
from ._striper import (
    Calibration,
    Camera,
    Control,
    CurbDetector,
    CurbFinding,
    CurbTrack,
    DesignCamera,
    DesignFigures,
    DesignLaser,
    DesignSun,
    Error,
    Event,
    Frame,
    Joint,
    Laser,
    Measurement,
    Measurer,
    Model,
    Motion,
    ObjectTrack,
    ObjectTracker,
    Piece,
    RangeFigures,
    Scan,
    ScanCircle,
    ScanLine,
    ScanStream,
    Scanner,
    Segmentation,
    Source,
    SourceInfo,
    StriperDesign,
    Truth,
    __version__,
    calibrate,
    find_curbs,
    load_model,
    open_source,
    returns_dtype,
    scanner_options,
    segments,
    smooth,
)

Status = _enum.IntEnum("Status", {word.upper(): code for word, code in _striper._status_words.items()})
Status.__doc__ = "Why a column's return is good (OK), doubtful or missing: the numbers in `scan.returns['status']`."

_log = _logging.getLogger("striper")
_LEVELS = {"info": _logging.INFO, "warning": _logging.WARNING}


def _log_event(event):
    text = f"{event.code}: {event.message}" + (f" ({event.advice})" if event.advice else "")
    _log.log(_LEVELS.get(event.severity, _logging.ERROR), text)


def scan(uri, model=None, *, on_event=None, **options):
    """Scans from an address: a camera, image files, a recording, a table of scans, the simulator.

    `model` is a Model or the path of one; recordings and tables may do without. Options are those of the command line
    (`scanner_options()`), hyphens as underscores: `peak="continuous"`, `min_confidence=.95`.

    `on_event` is called with every Event, from any thread; without it they go to the log `logging.getLogger("striper")`.
    """
    return _striper.scan(_os.fspath(uri), model, on_event=on_event, **options)


def measure(scan, tools, model=None):
    """Measures one scan: `measure(scan, ["width:step:x=0..1"])`; the tools are those of `striper measure`.

    For many scans make a Measurer once.
    """
    own = [tools] if isinstance(tools, str) else list(tools)
    return Measurer(own, model).measure(scan)


def simulate(scene, frames=10):
    """Simulates a scene: yields so many `frames` as (Frame, Truth); the Truth of a dark one is None.

    An interlaced frame whose both fields are lit has two truths: the first field's is given.
    """
    for frame, truth, _ in _striper._simulate(_os.fspath(scene), frames):
        yield frame, truth


def simulated_model(scene):
    """The model that a perfect calibration of a scene would find."""
    return _striper._simulate(_os.fspath(scene), 0).model


def recording(path, model=None, **options):
    """The scans of a file as a sequence: `len`, an index, a slice. Each access reads from the file's beginning."""
    return Recording(path, model, **options)


class Recording:
    """Scans of a file, by number. Nothing is kept in memory but what is asked for."""

    def __init__(self, path, model=None, **options):
        self._path = _os.fspath(path)
        self._model = model
        self._options = options
        self._length = None
        if scan(self._path, model, **options).info.is_live:
            raise ValueError(f"{self._path} is live: it can be iterated (striper.scan), not indexed")

    def __iter__(self):
        return iter(scan(self._path, self._model, **self._options))

    def __len__(self):
        if self._length is None:
            self._length = sum(1 for _ in self)
        return self._length

    def __getitem__(self, index):
        if isinstance(index, slice):
            wanted = range(*index.indices(len(self)))
            last = max(wanted, default=-1)
            kept = {}
            for number, each in enumerate(self):
                if number > last:
                    break
                if number in wanted:
                    kept[number] = each
            return [kept[number] for number in wanted]
        number = index + len(self) if index < 0 else index
        for at, each in enumerate(self):
            if at == number:
                return each
        raise IndexError(f"{self._path} has no scan {index}")


__all__ = [name for name in globals() if not name.startswith("_")] + ["__version__"]
