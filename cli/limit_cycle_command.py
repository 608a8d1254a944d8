"""railcosim limit-cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .option_types import OutFile, PlotFile
from .options import grid_of, positive
from .parameter_options import VehicleOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

SPEEDS = 1.0, 1000.0  # km/h
HOW = {1: "not settled", 2: "off the rails", 3: "interrupted"}


def limit_cycle(
    *,
    given: VehicleOptions,
    speeds: Annotated[
        str | None,
        typer.Option(
            "--speeds",
            help="km/h, start:stop:step; 0.7 to 1.3 of the linear critical speed if not given.",
        ),
    ] = None,
    longest: Annotated[
        float, typer.Option(help="How long a run may take to settle, s.", metavar="S")
    ] = 60.0,
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """How far a vehicle hunts on rigid rails: limit cycles against speed, up and down, in time.

    Wheels roll as the vehicle's [rolling] says: profiles or cones, saturated creep, flanges. Up, a
    run goes on from where the one at the speed below has settled; down, from the one above. What
    has not settled is given no number. Ctrl-C ends it with what it has found.
    """
    from railcosim.analysis.response.hunting import KMH
    from railcosim.analysis.response.limit_cycle import limit_cycles
    from railcosim.plots.hunting import limit_cycle_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    grid = None if speeds is None else grid_of("--speeds", speeds, "km/h", SPEEDS) / KMH
    positive("--longest", longest, "s")
    stock = given.stock()
    folder = None if given.vehicle is None else given.vehicle.parent
    with progress("running until it settles") as update:
        found = limit_cycles(stock, grid, longest=longest, folder=folder, progress=update)
    console.print(_table(found))
    keep(found, out, f"{found.sizes['speed']} speeds", plot, limit_cycle_chart)
    if found.attrs["stopped"] != "no":
        raise KeyboardInterrupt  # what was found is kept


def _table(found: xr.Dataset) -> Table:
    critical = float(found.attrs["critical_speed"])
    known = f"{critical:.1f} km/h" if critical > 0 else "none found"
    table = Table(title=f"Limit cycles on rigid rails; linear critical speed: {known}")
    for heading in ("km/h", "up, mm", "Hz", "down, mm", "Hz"):
        table.add_column(heading, justify="right")
    for speed in found["speed"].values:
        at = found.sel(speed=speed)
        cells = []
        for way in ("up", "down"):
            how = int(at[f"how_{way}"])
            amplitude, frequency = (float(at[f"{x}_{way}"]) for x in ("amplitude", "frequency"))
            hunts = how == 0 and amplitude > 0
            cells += [
                HOW.get(how, f"{1e3 * amplitude:.2f}"), f"{frequency:.2f}" if hunts else ""
            ]  # fmt: skip
        table.add_row(f"{speed:.1f}", *cells)
    return table
