"""railcosim modes."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.analysis.response.choices import Gravity, Wheels

from .options import UsageError, speed_of
from .parameter_options import PairOptions
from .progress import progress
from .results import RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr


class Subject(StrEnum):
    """Whose modes."""

    VEHICLE = "vehicle"
    TRACK = "track"


OutFile = Annotated[
    Path | None, typer.Option("--out", help="Result as well: .nc or .csv.", metavar="FILE")
]
Conicity = Annotated[
    float | None,
    typer.Option(help="Tangent of the angle of conical wheels; with --speed: they creep."),
]
GravityOption = Annotated[
    Gravity,
    typer.Option(
        help="Conical wheels: springs along the contact normals, or vertical ones and the "
        "textbook's gravity stiffness."
    ),
]


def modes(
    *,
    subject: Annotated[Subject, typer.Argument(help="Whose modes: vehicle or track.")],
    given: PairOptions,
    wheels: Annotated[
        Wheels,
        typer.Option(
            help="fixed: wheelsets held; contact: on contact springs on rigid rails; rails: on "
            "rails that give way as the track does."
        ),
    ] = Wheels.FIXED,
    speed: Annotated[
        float | None, typer.Option(help="km/h; with --conicity: wheels creep, linearly.")
    ] = None,
    conicity: Conicity = None,
    gravity: GravityOption = Gravity.NORMALS,
    out: OutFile = None,
) -> None:
    """Modes of a vehicle in space or of a track, by their names: frequencies and damping.

    Names are read from the shapes. What nothing holds, and with creep what does not swing, is left
    out. Of a track: where waves begin to run, and where rails swing between railseats.
    """
    from railcosim.analysis.response.vehicle_modes import vehicle_modes

    RESULTS.check(out)
    if subject is Subject.TRACK:
        of_vehicle = {
            given.tells_vehicle: bool(given.tells_vehicle),
            "--wheels": wheels is not Wheels.FIXED,
            "--speed": speed is not None,
            "--conicity": conicity is not None,
            "--gravity": gravity is not Gravity.NORMALS,
        }
        for option, is_given in of_vehicle.items():
            if is_given:
                raise UsageError(f"{option}: is of a vehicle; leave it out with modes track")
        _of_track(given, out)
        return
    if given.tells_track and wheels is not Wheels.RAILS:
        raise UsageError(f"{given.tells_track}: only with --wheels rails")
    if gravity is not Gravity.NORMALS and speed is None:
        raise UsageError(
            f"--gravity {gravity.value}: of wheels that creep; give --speed, --conicity"
        )
    stock = given.stock()
    with progress("finding modes") as update:
        result = vehicle_modes(
            stock,
            wheels=wheels,
            speed=None if speed is None else speed_of(speed),
            conicity=conicity,
            gravity=gravity,
            track=given.pair()[1] if wheels is Wheels.RAILS else None,
            progress=update,
        )
    console.print(_table(result))
    if result.attrs["free_motions"]:
        console.print(f"{result.attrs['free_motions']} free motions left out: nothing holds them")
    if (result["damping_ratio"] < 0).any():
        console.print("damping below 0: what is displaced so grows, and leaves the rails")
    keep(result, out, f"{result.sizes['name']} modes")


def _of_track(given: PairOptions, out: Path | None) -> None:
    from railcosim.analysis.response.track_modes import track_modes

    with progress("finding modes"):
        result = track_modes(given.rails())
    table = Table(title="Modes of the track")
    table.add_column("mode")
    for heading in ("undamped, Hz", "damping ratio", "share of its mass"):
        table.add_column(heading, justify="right")
    for name in result["name"].values:
        f, ratio, share = (float(variable) for variable in result.sel(name=name).values())
        table.add_row(str(name), f"{f:.4g}", f"{ratio:.4f}", f"{share:.2f}")
    console.print(table)
    keep(result, out, f"{result.sizes['name']} modes")


def _table(result: xr.Dataset) -> Table:
    from railcosim.analysis.response.vehicle_modes import SIZE_OF_POLE

    table = Table(title=f"Modes of the vehicle, wheels: {result.attrs['wheels']}")
    table.add_column("mode")
    creeps_or_gives = result["undamped_frequency"].attrs["long_name"] == SIZE_OF_POLE
    undamped = "size of pole, Hz" if creeps_or_gives else "undamped, Hz"
    for heading in (undamped, "damped, Hz", "damping ratio"):
        table.add_column(heading, justify="right")
    for name in result["name"].values:
        one = result.sel(name=name)
        frequencies = (float(one["undamped_frequency"]), float(one["damped_frequency"]))
        table.add_row(
            str(name), *(f"{x:.4g}" for x in frequencies), f"{float(one['damping_ratio']):.4f}"
        )
    return table
