# SPDX-License-Identifier: Apache-2.0
import enum
from collections.abc import Callable, Iterable, Iterator
from os import PathLike
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from ._striper import (
    Calibration as Calibration,
    Camera as Camera,
    Control as Control,
    CurbDetector as CurbDetector,
    CurbFinding as CurbFinding,
    CurbTrack as CurbTrack,
    DesignCamera as DesignCamera,
    DesignFigures as DesignFigures,
    DesignLaser as DesignLaser,
    DesignSun as DesignSun,
    RangeFigures as RangeFigures,
    StriperDesign as StriperDesign,
    Error as Error,
    Event as Event,
    Frame as Frame,
    Joint as Joint,
    Laser as Laser,
    Measurement as Measurement,
    Measurer as Measurer,
    Model as Model,
    Motion as Motion,
    ObjectTrack as ObjectTrack,
    ObjectTracker as ObjectTracker,
    Piece as Piece,
    Scan as Scan,
    ScanCircle as ScanCircle,
    ScanLine as ScanLine,
    ScanStream as ScanStream,
    Scanner as Scanner,
    Segmentation as Segmentation,
    Source as Source,
    SourceInfo as SourceInfo,
    Truth as Truth,
    calibrate as calibrate,
    find_curbs as find_curbs,
    load_model as load_model,
    open_source as open_source,
    scanner_options as scanner_options,
    segments as segments,
    smooth as smooth,
)

__version__: str
returns_dtype: np.dtype[np.void]

_Path = str | PathLike[str]
_OnEvent = Callable[[Event], object] | None

class Status(enum.IntEnum):
    OK = 0
    SATURATED = 1
    AMBIGUOUS = 2
    WIDE = 3
    NARROW = 4
    WEAK = 5
    EDGE = 6
    OUT_OF_RANGE = 7
    NO_STRIPE = 8
    BLIND = 9
    BEHIND = 10
    OUTSIDE_MODEL = 11
    FILLED = 12
    OUTLIER = 13

def scan(
    uri: _Path, model: Model | _Path | None = None, *, on_event: _OnEvent = None, **options: str | float | None
) -> ScanStream: ...
def measure(scan: Scan, tools: str | Iterable[str], model: Model | _Path | None = None) -> list[Measurement]: ...
def simulate(scene: _Path, frames: int = 10) -> Iterator[tuple[Frame, Truth | None]]: ...
def simulated_model(scene: _Path) -> Model: ...
def recording(path: _Path, model: Model | _Path | None = None, **options: str | float | None) -> Recording: ...

class Recording:
    def __init__(self, path: _Path, model: Model | _Path | None = None, **options: str | float | None) -> None: ...
    def __iter__(self) -> Iterator[Scan]: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, index: int) -> Scan: ...
    @overload
    def __getitem__(self, index: slice) -> list[Scan]: ...
