"""railcosim advise."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from rich.table import Table

from railcosim.analysis.advise import REACH, STEPS, Excitation, Option, excitation, options
from railcosim.analysis.catalogue import Owner, members
from railcosim.analysis.frequency import wheelset_positions
from railcosim.analysis.linear_pair import Part, linear_parts
from railcosim.analysis.parallel import Task, Workers
from railcosim.plots.stability import advice_chart
from railcosim.track.irregularity import QUALITIES
from railcosim.track.irregularity.synthesis import quality

from .fmus import FreshOption, fmus_of
from .options import (
    PlotFile,
    Speed,
    TrackFmu,
    UsageError,
    VehicleFmu,
    console,
    contact_parameters,
    progress,
    speed_of,
)
from .results import PICTURES, Suffixes, keep
from .stability_command import USUAL, in_ms, schemes_of, stiffness, warn_of_growth

NETCDF = Suffixes("--out", (".nc",))
FINEST = 1e-12  # accuracy: below it is rounding
SHOWN = 8
"""Lines of the table."""
TOGETHER = 4
"""Schemes of one task."""


def advise(
    accuracy: Annotated[
        float, typer.Option(help="Error allowed: RMS of the contact force's, relative.")
    ] = 1e-3,
    out: Annotated[
        Path | None, typer.Option("--out", help="Result as well: .nc.", metavar="FILE")
    ] = None,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    contact_stiffness: Annotated[
        str, typer.Option("--contact-stiffness", help="N/m, or hertz at the static load.")
    ] = "hertz",
    schemes: Annotated[
        str, typer.Option(help="Schemes, or how their names begin; several with commas.")
    ] = USUAL,
    speed: Speed = 250.0,
    irregularity: Annotated[
        str, typer.Option("--class", help=f"Class of the track: {', '.join(QUALITIES)}.")
    ] = "german-low",
    plot: PlotFile = None,
) -> None:
    """Name owner, scheme and step that reach an accuracy at the least cost, before running.

    The error is predicted from the linear models of both FMUs, which must take contact forces, for
    a random irregularity under wheels that are held. Cost is how often the FMUs are stepped.
    """
    NETCDF.check(out)
    PICTURES.check(plot)
    if not FINEST <= accuracy < 1.0:
        raise UsageError(
            f"--accuracy {accuracy:g}: must be from {FINEST:g} to below 1, such as 1e-3"
        )
    v, chosen = speed_of(speed), schemes_of(schemes)
    parameters = contact_parameters(contact_stiffness)
    spectrum = quality(irregularity).vertical
    with fmus_of(vehicle_fmu, track_fmu, fresh=fresh) as (vehicle, track):
        source = excitation(spectrum, v, wheelset_positions(vehicle))
        k_H = stiffness(vehicle, track, parameters)
        with progress("linearising") as update:
            parts = linear_parts(vehicle, track, update)
    with progress("predicting errors") as update, Workers(update) as workers:
        tasks = _tasks(parts, k_H, chosen, accuracy, source)
        total = sum(task.cost for task in tasks)
        found = [o for _, part in workers.completed(tasks, total) for o in part]
    found.sort(key=lambda option: option.cost)
    warn_of_growth(parts, k_H, contact_stiffness)
    if not found:
        raise UsageError(
            f"--accuracy {accuracy:g}: no scheme reaches it with steps of 0.01 ms or more; ask for "
            "less, or for other --schemes"
        )
    console.print(_table(found[:SHOWN], accuracy, contact_stiffness))
    best = found[0]
    console.print(
        f"Use {best.scheme} with the contact in the {best.owner.value} and a step of "
        f"{1e3 * best.step:g} ms: predicted error {best.error:.1e}, {_margin(best)}."
    )
    result = _dataset(found, accuracy, k_H, v)
    keep(result, out, plot=plot, chart=advice_chart)


def _tasks(
    parts: tuple[Part, ...], k_H: float, names: list[str], accuracy: float, source: Excitation
) -> list[Task]:
    """Some schemes of one owner each."""
    catalogue = members()
    tasks = []
    for owner in Owner:
        suiting = [name for name in names if owner in catalogue[name].owners]
        for i in range(0, len(suiting), TOGETHER):
            some = {name: catalogue[name].scheme for name in suiting[i : i + TOGETHER]}
            tasks.append(
                Task(
                    name=f"{owner.value} {i}",
                    function=options,
                    arguments=(parts, owner, k_H, some, accuracy, source),
                    cost=float(len(some)),
                )
            )
    return tasks


def _margin(best: Option) -> str:
    if math.isinf(best.limit):
        return f"nothing grows up to {REACH:g} times that"
    return f"stable up to {in_ms(best.limit)} ms, {best.limit / best.step:.2g} times that"


def _limit(option: Option) -> str:
    """Largest stable step for the table, ms."""
    if math.isinf(option.limit):
        return f"> {1e3 * REACH * option.step:g}"
    return in_ms(option.limit)


def _table(found: list[Option], accuracy: float, contact: str) -> Table:
    table = Table(title=f"Error below {accuracy:g} at contact stiffness {contact}, cheapest first")
    table.add_column("scheme", overflow="fold")
    table.add_column("contact", no_wrap=True)
    for heading in ("step, ms", "evals", "per s", "error", "limit, ms"):
        table.add_column(heading, justify="right", no_wrap=True)
    for option in found:
        table.add_row(
            option.scheme, option.owner.value, f"{1e3 * option.step:g}", str(option.evaluations),
            f"{option.cost:.0f}", f"{option.error:.1e}", _limit(option),
        )  # fmt: skip
    return table


def _dataset(found: list[Option], accuracy: float, k_H: float, speed: float) -> xr.Dataset:
    """Columns over the options, cheapest first."""
    columns = {
        "step": ([o.step for o in found], "s", "longest step that reaches the accuracy"),
        "evaluations": ([o.evaluations for o in found], "1", "evaluations a step"),
        "cost": ([o.cost for o in found], "1/s", "evaluations a second of time simulated"),
        "error": ([o.error for o in found], "1", "predicted relative RMS error of contact forces"),
        "stable_to": (
            [o.limit for o in found],
            "s",
            "largest stable step; infinite beyond twice the step",
        ),
    }
    variables: dict[str, Any] = {
        name: ("option", np.array(values, dtype=float), {"units": unit, "long_name": text})
        for name, (values, unit, text) in columns.items()
    }
    variables["errors"] = (
        ("option", "tried"),
        np.array([o.errors for o in found]),
        {"units": "1", "long_name": "predicted relative RMS error at the steps tried"},
    )
    return xr.Dataset(
        variables,
        coords={
            "option": [f"{o.scheme}, contact in {o.owner.value}" for o in found],
            "tried": ("tried", STEPS, {"units": "s", "long_name": "step"}),
        },
        attrs={"accuracy": accuracy, "contact_stiffness": k_H, "speed": speed},
    )
