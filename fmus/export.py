"""Vehicle and track parameters to FMUs, and a file that wires them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .content import Content, contents
from .description.about import Description
from .interface import WHEELSETS
from .native_fmu import NativeRuntime
from .python_fmu import PythonRuntime
from .ssp import Part, static_start, write_ssp

__all__ = ["NATIVE", "PAIR", "NativeRuntime", "PythonRuntime", "Runtime", "export"]

PAIR = "Pair.ssp"
NATIVE = NativeRuntime()  # FMI 2.0, for this machine


class Runtime(Protocol):
    """What computes inside an FMU."""

    @property
    def fmi(self) -> int:
        """Version of FMI."""

    def prepare(self, progress: Callable[[str], None]) -> None:
        """Do what all FMUs need once."""

    def pack(self, content: Content, target: Path, progress: Callable[[str], None]) -> None:
        """Write the FMU, replacing one that is there."""


def export(
    vehicle: Vehicle,
    track: Track,
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    runtime: Runtime = NATIVE,
) -> dict[str, Path]:
    """Write Vehicle, Track, VehicleWithContact and TrackWithContact as FMUs.

    With them goes Pair.ssp, which wires Vehicle and TrackWithContact, at rest (FMI 2.0 only, as
    SSP 1.0).

    Parameters
    ----------
    vehicle, track : Vehicle, Track
        Parameters.
    out : Path
        Folder, made if need be.
    progress : callable
        Told what is being done.
    runtime : Runtime
        NativeRuntime or PythonRuntime.

    Returns
    -------
    dict
        FMU name to file.

    Raises
    ------
    CompilerMissing, CompilationFailed
        If there is no compiler for a native FMU, or it fails.
    """
    runtime.prepare(progress)
    out.mkdir(parents=True, exist_ok=True)
    made = {content.name: content for content in contents(vehicle, track, progress)}
    files = {name: out / f"{name}.fmu" for name in made}
    for name, content in made.items():
        runtime.pack(content, files[name], progress)
    if runtime.fmi == 2:
        _write_pair(out / PAIR, made["Vehicle"], made["TrackWithContact"], files)
    return files


def _write_pair(target: Path, vehicle: Content, track: Content, files: dict[str, Path]) -> None:
    start = {v.name: v.start for v in vehicle.table + track.table}
    heights = static_start(
        track.arrays,
        positions=[float(start[f"wheelset[{i}].position"] or 0) for i in WHEELSETS],
        wheel_load=float(vehicle.arrays["wheel_load"]),
        C=float(start["contact.hertz_coefficient"] or 0),
    )
    parts = (
        Part(name="vehicle", fmu=files[vehicle.name], table=vehicle.table, start=heights),
        Part(name="track", fmu=files[track.name], table=track.table, start={}),
    )
    write_ssp(target, *parts, step=Description.step, stop=Description.stop)
