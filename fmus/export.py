"""Vehicle and track parameters to FMUs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Protocol

from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .content import Content, contents
from .native_fmu import NativeRuntime
from .python_fmu import PythonRuntime

__all__ = ["NATIVE", "NativeRuntime", "PythonRuntime", "Runtime", "export", "pack"]

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
    return pack(contents(vehicle, track, progress), out, progress, runtime=runtime)


def pack(
    made: Iterable[Content],
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    runtime: Runtime = NATIVE,
) -> dict[str, Path]:
    """Write contents as FMUs; the runtime is prepared. See `export`."""
    out.mkdir(parents=True, exist_ok=True)
    files = {}
    for content in made:
        files[content.name] = out / f"{content.name}.fmu"
        runtime.pack(content, files[content.name], progress)
    return files
