"""railcosim export, railcosim parameters."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from railcosim.fmus.export import export as export_fmus
from railcosim.parameters import write_toml
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .options import (
    TrackFile,
    UsageError,
    VehicleFile,
    console,
    errors,
    status,
    track_of,
    vehicle_of,
)


def export(
    out: Annotated[Path, typer.Option("--out", help="Folder for the FMUs.", metavar="DIR")],
    vehicle: VehicleFile = None,
    track: TrackFile = None,
) -> None:
    """Write Vehicle, Track, VehicleWithContact and TrackWithContact as FMI 2.0 FMUs."""
    for path in exported(vehicle_of(vehicle), track_of(track), out).values():
        console.print(f"{path}  {path.stat().st_size / 1e6:.1f} MB", highlight=False)


def parameters(
    vehicle: Annotated[bool, typer.Option("--vehicle", help="The vehicle's.")] = False,
    track: Annotated[bool, typer.Option("--track", help="The track's.")] = False,
) -> None:
    """Print the default parameter file, with units, ranges and sources as comments."""
    if vehicle == track:
        raise UsageError("parameters: give --vehicle or --track")
    # Plain print: the file goes to a file.
    text = write_toml(Vehicle(), "Vehicle") if vehicle else write_toml(Track(), "Slab track")
    print(text, end="")


def exported(vehicle: Vehicle, track: Track, out: Path) -> dict[str, Path]:
    """Export with a status line; announces what the time domain does with loss factors."""
    if track.rail.loss_factor > 0 or track.fastening.loss_factor > 0:
        errors.print(
            "note: loss factors are hysteretic in direct receptances; in the FMUs they are the "
            f"viscous damping equal at {track.mesh.loss_factor_frequency:g} Hz "
            "(mesh.loss_factor_frequency)"
        )
    with status("exporting FMUs") as tell:
        return export_fmus(vehicle, track, out, tell)


@contextmanager
def fmus_of(
    vehicle: Path | None, track: Path | None, vehicle_name: str, track_name: str
) -> Iterator[tuple[Path, Path]]:
    """FMU files given by the user, or ours, exported for as long as the block lasts."""
    if vehicle is not None and track is not None:
        yield vehicle, track
        return
    with TemporaryDirectory(prefix="railcosim_") as folder:
        ours = exported(Vehicle(), Track(), Path(folder))
        yield vehicle or ours[vehicle_name], track or ours[track_name]
