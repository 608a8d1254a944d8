"""railcosim sensitivity."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.analysis.response.choices import Subject

from .options import UsageError
from .parameter_options import PairOptions
from .progress import progress
from .results import RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

SHOWN = 5  # parameters of a resonance
LEAST = 0.01  # of a resonance: less is in --out


def sensitivity(
    *,
    subject: Annotated[
        Subject,
        typer.Argument(
            help="vehicle: in space, wheels held; track; pair: vertical, on contact springs on a "
            "track without end."
        ),
    ],
    given: PairOptions,
    out: Annotated[
        Path | None, typer.Option("--out", help="All of it: .nc.", metavar="FILE")
    ] = None,
) -> None:
    """How much each parameter moves the resonances of a vehicle, a track, or both.

    Told are d ln f / d ln p, by how many per cent a resonance rises for one per cent more of a
    parameter, of the parameters that move it most.
    """
    from railcosim.analysis.response.sensitivity import sensitivities

    RESULTS.check(out)
    if out is not None and out.suffix != ".nc":
        raise UsageError(f"--out {out}: is over parameters and resonances; must end in .nc")
    if subject is Subject.VEHICLE and given.tells_track:
        raise UsageError(f"{given.tells_track}: is of a track; leave it out, or ask for pair")
    if subject is Subject.TRACK and given.tells_vehicle:
        raise UsageError(f"{given.tells_vehicle}: is of a vehicle; leave it out, or ask for pair")
    with progress("differentiating") as update:
        result = sensitivities(subject, given.stock(), given.rails(), progress=update)
    console.print(_table(result))
    keep(result, out, f"{result.sizes['parameter']} parameters, {result.sizes['name']} resonances")


def _table(result: xr.Dataset) -> Table:
    table = Table(title=str(result.attrs["title"]))
    table.add_column("resonance")
    table.add_column("Hz", justify="right")
    table.add_column("d ln f / d ln p")
    for k, name in enumerate(map(str, result["name"].values)):
        f = float(result["frequency"][k])
        relative = result["frequency_slope"].isel(name=k) / f
        most = abs(relative).argsort().values[::-1][:SHOWN]
        words = [
            f"{result['parameter'].values[i]} {float(relative[i]):+.3f}"
            for i in most
            if abs(float(relative[i])) >= LEAST
        ]
        table.add_row(name, f"{f:.4g}", ", ".join(words))
    return table
