"""railcosim export."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from railcosim.analysis.export_pair import PAIR, export_pair
from railcosim.fmus.export import NATIVE, NativeRuntime, PythonRuntime, Runtime
from railcosim.fmus.native_runtime.platforms import platforms_named
from railcosim.storage.archive import digest_of
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .fmus import tell_of_losses
from .options import (
    TrackFile,
    UsageError,
    VehicleFile,
    Vehicles,
    console,
    errors,
    status,
    track_of,
    vehicle_of,
)
from .results import folder_of


class RuntimeName(StrEnum):
    """How runtimes are spelt."""

    NATIVE = "native"
    PYTHON = "python"


def export(
    out: Annotated[Path, typer.Option("--out", help="Folder for the FMUs.", metavar="DIR")],
    vehicle: VehicleFile = None,
    vehicles: Vehicles = 1,
    track: TrackFile = None,
    runtime: Annotated[
        RuntimeName,
        typer.Option("--runtime", help="native: needs nothing where imported. python: numpy."),
    ] = RuntimeName.NATIVE,
    fmi: Annotated[int, typer.Option("--fmi", help="Version of FMI: 2 or 3.")] = 2,
    platforms: Annotated[
        str | None,
        typer.Option(
            "--platforms",
            help="What to compile for: all, or a list such as linux64,win64 (others than this "
            "machine need railcosim[native] or --config-settings platforms=all when installed). "
            "This machine if not given.",
            metavar="LIST",
        ),
    ] = None,
) -> None:
    """Write Vehicle, Track, VehicleWithContact, TrackWithContact as FMUs, and Pair.ssp."""
    chosen = runtime_of(runtime, fmi, platforms)
    folder_of("--out", out)
    cars = vehicle_of(vehicle, vehicles)
    for path in exported(cars, track_of(track, cars), out, chosen).values():
        console.print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")
    if chosen.fmi == 2:
        console.print(f"{out / PAIR}  wires Vehicle and TrackWithContact")


def runtime_of(name: RuntimeName, fmi: int, platforms: str | None) -> Runtime:
    """The runtime that options ask for."""
    if fmi not in {2, 3}:
        raise UsageError(f"--fmi {fmi}: must be 2 or 3")
    if name is RuntimeName.NATIVE:
        chosen = None if platforms is None else platforms_named(platforms)
        return NativeRuntime(fmi=fmi, platforms=chosen)
    if fmi != 2 or platforms is not None:
        raise UsageError("--runtime python: is FMI 2 only, for every platform; leave out the rest")
    return PythonRuntime()


def exported(
    vehicle: Vehicle | Train, track: Track, out: Path, runtime: Runtime = NATIVE
) -> dict[str, Path]:
    """Export into a folder, with a status line."""
    tell_of_losses(track)
    before = {path.name: digest_of(path) for path in out.glob("*.fmu")}
    with status("exporting FMUs") as tell:
        files = export_pair(vehicle, track, out, tell, runtime=runtime)
    written = {path.name: digest_of(path) for path in files.values()}
    if replaced := [n for n, now in written.items() if before.get(n, now) != now]:
        errors.print(f"note: {', '.join(replaced)} in {out}: replaced; they were other FMUs")
    return files
