"""railcosim fit."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .option_types import OutFile, PlotFile
from .parameter_options import TrackOptions
from .progress import progress
from .receptance import Load
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr


class Hit(StrEnum):
    """Along what a rail is hit."""

    DOWN = "z"
    RIGHT = "y"


def fit(
    measured: Annotated[
        list[Path],
        typer.Argument(
            help="Receptance, mobility or accelerance (real and imag, magnitude and phase, or "
            "magnitude; coherence), or decay rates in third octaves: .csv with names and units in "
            "its first line, or .nc."
        ),
    ],
    *,
    free: Annotated[
        str,
        typer.Option(
            help="Numbers of the track to be found, with commas: fastening.stiffness, "
            "foundation.damping and so on."
        ),
    ],
    given: TrackOptions,
    position: Annotated[
        list[str] | None,
        typer.Option(
            help="Where the rail was hit: railseat (if neither this nor the file says), midspan, "
            "or m along the track; of several files once for all or once for each.",
            metavar="PLACE",
        ),
    ] = None,
    direction: Annotated[
        Hit | None, typer.Option(help="z (if neither this nor the file says) down, y to the right.")
    ] = None,
    load: Annotated[
        Load | None,
        typer.Option(help="single: one rail was hit (if neither this nor the file says)."),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            help="Of the response, where the file says none: m/N, mm/s/kN, g/N, dB re 1 m/N."
        ),
    ] = None,
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Find track parameters from a measured receptance or decay rate, with 95 % intervals.

    The search starts from the track's numbers. What the data cannot tell is named, not guessed.
    """
    from railcosim.analysis.fitting.fit import fit as fitted
    from railcosim.plots.fit import fit_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    track = given.rails()
    with progress("fitting") as update:
        result = fitted(
            list(measured), track,
            free=[key.strip() for key in free.split(",")], position=position or None,
            direction=direction and direction.value,
            both_rails=None if load is None else load is Load.BOTH, unit=unit, progress=update,
        )  # fmt: skip
    _tell(result)
    columns = ["value", "lower", "upper", "start"]
    kept = result[columns] if out is not None and out.suffix == ".csv" else result
    keep(kept, out, f"{result.sizes['parameter']} parameters")
    keep(result, None, "", plot, fit_chart)


def _tell(result: xr.Dataset) -> None:
    table = Table(title="Fitted, with 95 % confidence intervals")
    table.add_column("parameter")
    for heading in ("value", "from", "to", "before"):
        table.add_column(heading, justify="right")
    why_not = result.attrs["not_identified"]
    for name in map(str, result["parameter"].values):
        one = result.sel(parameter=name)
        numbers = [f"{float(one[n]):.4g}" for n in ("value", "lower", "upper", "start")]
        if name in why_not:
            numbers[:3] = "not known", "", ""
        table.add_row(name, *numbers)
    console.print(table)
    for name, why in why_not.items():
        console.print(f"{name}: {why}")
    console.print(f"fitted within {result.attrs['rms']:.2g} dB (root mean square)")
    if result.attrs["inflation"] > 1:
        console.print(
            f"neighbouring residuals correlate by {result.attrs['neighbours']:.2f}: the rail "
            "was hit otherwise than supposed (--load, --position, --direction), or the track lacks "
            "something of what was measured; intervals are "
            f"{result.attrs['inflation'] ** 0.5:.2g} times as wide for it"
        )
    known = [str(n) for n in result["parameter"].values if n not in why_not]
    values = [f"--set {name}={float(result['value'].sel(parameter=name)):.6g}" for name in known]
    console.print(f"to go on with it: {' '.join(values)}")
