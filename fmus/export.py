"""Vehicle and track parameters to FMUs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from railcosim.mechanics.ports import SIDES
from railcosim.storage.archive import digest_of
from railcosim.track.closed_line import ClosedLine
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .content import Content, contents, track_contents
from .interface import Start
from .native_fmu import NativeRuntime
from .python_fmu import PythonRuntime

__all__ = [
    "BARE", "NATIVE", "WITH_STATES", "NativeRuntime", "PythonRuntime", "Runtime", "Start", "export",
    "export_track", "packed",
]  # fmt: skip

NATIVE = NativeRuntime()  # FMI 2.0, for this machine
WITH_STATES = NativeRuntime(model_exchange=True)
"""The same, tracks for Model Exchange as well: what our own linear models are made of."""
BARE = NativeRuntime(model_exchange=True, documented=False)
"""What we make for ourselves and nobody looks at."""


class Runtime(Protocol):
    """What computes inside an FMU."""

    @property
    def fmi(self) -> int:
        """Version of FMI."""

    def prepare(self, progress: Callable[[str], None]) -> None:
        """Do what all FMUs need once."""

    def pack(self, content: Content, target: Path, progress: Callable[[str], None]) -> str:
        """Write the FMU, replacing one that is there; return the digest of what was written."""


class MixedExport(OSError):  # noqa: N818 (it says what happened)
    """Another export wrote other FMUs into the same folder at the same time."""


def export(
    vehicle: Vehicle | Train,
    track: Track,
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    dimension: str = "vertical",
    runtime: Runtime = NATIVE,
) -> dict[str, Path]:
    """Write Vehicle, Track, VehicleWithContact and TrackWithContact as FMUs.

    Parameters
    ----------
    vehicle, track : Vehicle or Train, Track
        Parameters.
    out : Path
        Folder, made if need be.
    progress : callable
        Told what is being done.
    dimension : str
        vertical or spatial, see `railcosim.mechanics.ports.OF_WHEELS`.
    runtime : Runtime
        NativeRuntime or PythonRuntime.

    Returns
    -------
    dict
        FMU name to file.

    Raises
    ------
    CompilerMissing, CompilationFailed, CacheRefused
        If there is no compiler for a native FMU, or it fails.
    MixedExport
        If another export, of other parameters, writes there at the same time.
    """
    runtime.prepare(progress)
    made = contents(vehicle, track, progress, dimension=dimension)
    with packed(made, out, progress, runtime=runtime) as files:
        return files


def export_track(
    track: Track,
    start: Start,
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
    runtime: Runtime = NATIVE,
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> dict[str, Path]:
    """Write Track and TrackWithContact as FMUs for any 1 to 64 wheelsets; see `export`.

    A spatial track is met in y, z and roll.

    Parameters
    ----------
    track : Track
        Parameters.
    start : Start
        Loads, positions and contact of the wheelsets, from the front.
    out, progress, runtime
        See `export`.
    sides : tuple of str
        Rails that are loaded: both, or the left one.
    dimension : str
        vertical or spatial, see `railcosim.mechanics.ports.DIMENSIONS`.
    changes : sequence of LocalChange
        What is different at single places, see `railcosim.track.local_modes.with_changes`.
    line : ClosedLine or None
        Kinds of track that follow, the first of which is `track`.
    """
    runtime.prepare(progress)
    made = track_contents(
        track, start, progress, sides=sides, dimension=dimension, changes=changes, line=line
    )
    with packed(made, out, progress, runtime=runtime) as files:
        return files


@contextmanager
def packed(
    made: Iterable[Content],
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
    *,
    runtime: Runtime = NATIVE,
) -> Iterator[dict[str, Path]]:
    """Write contents as FMUs, which must be the same still where the block ends. See `export`.

    Of several exports at once the last to end sees whether what is there is all its own; those of
    the same parameters write the same bits.
    """
    out.mkdir(parents=True, exist_ok=True)
    files, written = {}, {}
    for content in made:
        files[content.name] = place = out / f"{content.name}.fmu"
        written[place] = runtime.pack(content, place, progress)
    yield files
    for place, digest in written.items():
        if not place.is_file() or digest_of(place) != digest:
            raise MixedExport(
                f"{place}: another export has written it meanwhile, so the FMUs in {out} do not "
                "belong together; export again, each into a folder of its own"
            )
