"""railcosim critical-speed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.analysis.response.choices import CONICITIES, Gravity

from .modes_command import GravityOption
from .option_types import OutFile, PlotFile
from .options import UsageError
from .parameter_options import PairOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.plots.chart import Chart

MOST = 100  # conicities


def critical_speed_command(
    *,
    given: PairOptions,
    conicity: Annotated[
        str, typer.Option(help="Tangent of the angle of conical wheels; several with commas.")
    ] = ",".join(map(str, CONICITIES)),
    gravity: GravityOption = Gravity.NORMALS,
    vehicle_fmu: Annotated[
        Path | None,
        typer.Option(
            "--vehicle-fmu",
            help="Vehicle FMU in space instead, on the wheels that it tells, or on those of "
            "--vehicle.",
            metavar="F",
        ),
    ] = None,
    track_fmu: Annotated[
        Path | None,
        typer.Option("--track-fmu", help="Track FMU in space instead of --track.", metavar="F"),
    ] = None,
    rigid_track: Annotated[
        bool, typer.Option("--rigid-track", help="Rails that do not move, instead of a track.")
    ] = False,
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Speed from which on a vehicle hunts, by its poles, for each conicity of its wheels.

    The picture follows the poles of the first conicity over the speed.
    """
    from railcosim.analysis.response.hunting import KMH, check_conicities, critical_speeds, way_of
    from railcosim.analysis.response.hunting import root_locus as locus_of
    from railcosim.plots.hunting import hunting_chart
    from railcosim.vehicle.hunting import Critical

    RESULTS.check(out)
    PICTURES.check(plot)
    conicities = _numbers(conicity)
    check_conicities(conicities)
    if rigid_track + bool(given.tells_track) + (track_fmu is not None) > 1:
        raise UsageError(
            "--rigid-track, --track, --track-fmu: rails that do not move have no track, and an FMU "
            "is one; give one of them"
        )
    if vehicle_fmu is not None:
        given.check_wheels()
    told = vehicle_fmu is not None and not given.tells_vehicle  # of its wheels, by the FMU
    stock = None if told else given.stock()
    parameters = given.rails() if given.tells_track else None
    with progress("finding critical speeds") as update:
        way = way_of(
            stock, gravity, parameters, rigid_track=rigid_track, vehicle_fmu=vehicle_fmu,
            track_fmu=track_fmu, progress=update,
        )  # fmt: skip
        result = critical_speeds(way, conicities, update)
    console.print(_table(result))

    def chart(found: xr.Dataset) -> Chart:
        first = found.isel(conicity=0)
        critical = Critical(
            speed=float(first["critical_speed"]) / KMH, frequency=float(first["frequency"])
        )
        return hunting_chart(found, locus_of(way, conicities[0], critical))

    keep(result, out, f"{len(conicities)} conicities", plot, chart)


def _numbers(text: str) -> list[float]:
    import numpy as np

    try:
        found = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise UsageError(f"--conicity {text}: must be numbers, with commas") from error
    if len(found) > MOST or (np.diff(found) <= 0).any():
        raise UsageError(f"--conicity {text}: must increase, and be at most {MOST}")
    return found


def _table(result: xr.Dataset) -> Table:
    from railcosim.analysis.response.hunting import KMH
    from railcosim.analysis.response.running import SPEEDS

    table = Table(title=f"{result.attrs['title'].capitalize()}, gravity: {result.attrs['gravity']}")
    for heading in ("conicity", "critical speed, km/h", "frequency, Hz"):
        table.add_column(heading, justify="right")
    for one in result["conicity"].values:
        speed, frequency = (
            float(result[n].sel(conicity=one)) for n in ("critical_speed", "frequency")
        )
        none = f"below {KMH * SPEEDS[0]:.0f}" if speed == 0 else f"none to {KMH * SPEEDS[-1]:.0f}"
        known = (f"{speed:.1f}", f"{frequency:.2f}") if speed > 0 else (none, "")
        table.add_row(f"{one:g}", *known)
    return table
