"""railcosim decay-rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .option_types import OutFile, PlotFile
from .options import UsageError
from .parameter_options import TrackOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

NOMINAL = (1, 1.25, 1.6, 2, 2.5, 3.15, 4, 5, 6.3, 8)


def decay_rate(
    *,
    given: TrackOptions,
    bands: Annotated[
        str, typer.Option(help="Third octaves from:to, Hz.", metavar="F:F")
    ] = "100:5000",
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Decay rates of the rail by EN 15461, in third octaves, vertical and lateral.

    From exact receptances on the standard's grid of 29 places, and from the slowest wave; beside
    them the least rates that ISO 3095 asks of a track for pass-by tests.
    """
    from railcosim.analysis.response.decay_rate import track_decay_rate
    from railcosim.plots.waves import decay_rate_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    lowest, highest = bands_of(bands)
    parameters = given.rails()
    with progress("solving") as update:
        result = track_decay_rate(parameters, lowest, highest, progress=update)
    console.print(_table(result))
    least = result.attrs["least_measurable"]
    console.print(
        f"< : below twice 4.343 / {result.attrs['farthest']:g} m = {least:.3g} dB/m, what that "
        "grid shows at least; an upper bound"
    )
    keep(result, out, f"{result.sizes['frequency']} third octaves", plot, decay_rate_chart)


def bands_of(text: str) -> tuple[float, float]:
    """Read ``--bands``: the first and the last third octave, Hz."""
    try:
        lowest, highest = (float(part) for part in text.split(":"))
    except ValueError as error:
        raise UsageError(f"--bands {text}: must be from:to, Hz") from error
    return lowest, highest


def _table(result: xr.Dataset) -> Table:
    table = Table(title="Decay rate, dB/m")
    names = [name for name in ("vertical", "lateral") if name in result]
    for heading in ("Hz", *(h for name in names for h in (name, "slowest wave", "ISO 3095"))):
        table.add_column(heading, justify="right")
    least = 2 * result.attrs["least_measurable"]
    for f in result["frequency"].values:
        one = result.sel(frequency=f)
        row = []
        for name in names:
            rate, wave, limit = (float(one[f"{name}{of}"]) for of in ("", ".wave", ".limit"))
            row += [f"{'< ' if rate < least else ''}{rate:.2f}", f"{wave:.2f}"]
            row.append(f"{limit:.2f}" if limit > 0 else "")
        table.add_row(nominal(float(f)), *row)
    return table


def nominal(centre: float) -> str:
    """What a third octave is called."""
    decade, tenth = divmod(round(10 * math.log10(centre)), 10)
    return f"{NOMINAL[tenth] * 10**decade:g}"
