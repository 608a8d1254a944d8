"""railcosim safety."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .option_types import OutFile, PlotFile
from .options import UsageError, speed_of
from .results import PICTURES, RESULTS, keep
from .terminal import console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.plots.chart import Chart

KINDS = {
    "derailment_quotient": ("Y/Q, mean over 2 m", 1.0, ""),
    "guiding_force_sum": ("sum of Y, mean over 2 m (kN)", 1e-3, " kN"),
    "unloading": ("unloading", 1.0, ""),
}
"""What is told, by the end of its name: label, factor, unit."""
RUNS = (".nc", ".csv")


def safety(
    run: Annotated[
        Path, typer.Argument(help="What railcosim run recorded: .nc or .csv.", metavar="RUN")
    ],
    speed: Annotated[
        float | None, typer.Option("--speed", help="km/h; that of the run if not given.")
    ] = None,
    section: Annotated[
        float, typer.Option(help="Length of sections whose percentiles count, at least, m.")
    ] = 250.0,
    out: OutFile = None,
    plot: PlotFile = None,
) -> None:
    """Running safety of a run: Y/Q, sum of guiding forces, wheel unloading, per EN 14363.

    Forces below 20 Hz; Y/Q and sums of Y as means over 2 m, every 0.5 m; percentiles 0.15 and 99.85
    of each section, of which the worst counts. Y/Q is positive outward, a sum of Y to the right. A
    vertical run has no Y. Static loads are the forces with which the run begins.
    """
    from railcosim.analysis.response.safety import running_safety
    from railcosim.master.files import load
    from railcosim.parameters import ArgumentError, ParameterError

    RESULTS.check(out)
    PICTURES.check(plot)
    if run.suffix not in RUNS:
        raise UsageError(f"{run}: must end in {' or '.join(RUNS)}")
    try:
        recorded = load(run)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{run}: cannot be read: {getattr(error, 'strerror', None) or error}"
        ) from error
    try:
        found = running_safety(
            recorded, speed=None if speed is None else speed_of(speed), section=section
        )
    except ArgumentError:
        raise
    except ParameterError as error:
        raise ParameterError(f"{run}: {error}") from error
    found.attrs["title"] = str(recorded.attrs.get("title", run.name))
    console.print(table_of(found))
    keep(found, out, f"{found.sizes['distance']} places", plot, chart_of)


def table_of(found: xr.Dataset) -> Table:
    """The percentiles and limits of each wheel and wheelset."""
    count, length = int(found.attrs["sections"]), float(found.attrs["section"])
    table = Table(title=f"Running safety, {count} section{'s' * (count > 1)} of {length:.0f} m")
    for heading in ("", "0.15 %", "99.85 %", "limit"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, variable in found.data_vars.items():
        _, factor, unit = KINDS[str(name).rpartition(".")[2]]
        low, high = (factor * float(variable.attrs[end]) for end in ("lowest", "highest"))
        limit = variable.attrs.get("limit")
        values = [low, high] if limit is None else [low, high, factor * limit]
        table.add_row(str(name), *(_shown(value, unit) for value in values))
    return table


def _shown(value: float, unit: str) -> str:
    if math.isnan(value):
        return "off the rail"
    return f"{round(value, 3) + 0.0:.3f}{unit}"  # no -0.000


def chart_of(found: xr.Dataset) -> Chart:
    """Of each kind the wheelset where it is worst, along the track; the limit dashed."""
    import numpy as np

    from railcosim.plots.chart import Chart, Curve, Panel
    from railcosim.plots.names import owner

    x = np.asarray(found["distance"])
    rows = []
    for kind, (label, factor, _) in KINDS.items():
        names = [str(name) for name in found.data_vars if str(name).endswith(f".{kind}")]
        if not names:
            continue
        worst = max(names, key=lambda name: _size(found[name])).partition(".")[0]
        shown = [name for name in names if name.startswith(f"{worst}.")]
        curves = [
            Curve(
                name=owner(name.removesuffix(f".{kind}")), x=x, y=factor * np.asarray(found[name])
            )
            for name in shown
        ]
        if "limit" in found[shown[0]].attrs:
            level = factor * found[shown[0]].attrs["limit"] * np.ones_like(x)
            curves.append(Curve(name="limit", x=x, y=level, dashed=True))
        rows.append((Panel(x_label="gone (m)", y_label=label, curves=tuple(curves)),))
    return Chart(title=str(found.attrs["title"]), rows=tuple(rows), share_x=True)


def _size(variable: xr.DataArray) -> float:
    """The greater percentile; of a wheel off the rail without bound."""
    size = max(abs(float(variable.attrs[end])) for end in ("lowest", "highest"))
    return math.inf if math.isnan(size) else size
