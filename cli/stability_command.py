"""railcosim stability."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr
from rich.table import Table

from railcosim.analysis.catalogue import Owner, members
from railcosim.analysis.linear_pair import Part, linear_parts
from railcosim.analysis.parallel import Task, Workers
from railcosim.analysis.stability import LONGEST, Limit, limits, static_stiffness
from railcosim.plots.stability import stability_chart

from .export import fmus_of
from .options import (
    PlotFile,
    TrackFmu,
    UsageError,
    VehicleFmu,
    console,
    contact_parameters,
    progress,
)
from .results import PICTURES, RESULTS, keep

Found = dict[tuple[str, Owner], list[Limit]]
OutFile = Annotated[
    Path | None, typer.Option("--out", help="Result as well: .nc or .csv.", metavar="FILE")
]
USUAL = "jacobi,gauss-seidel-linear,nepce,interface-jacobian"
"""Schemes by default; all that can be predicted would take three times as long."""


def stability(
    out: OutFile = None,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    contact_stiffness: Annotated[
        str,
        typer.Option("--contact-stiffness", help="k_H in N/m, or hertz; several with commas."),
    ] = "0.1e9,0.3e9,1e9,3e9,8e9",
    schemes: Annotated[
        str, typer.Option(help="Schemes, or how their names begin; several with commas.")
    ] = USUAL,
    plot: PlotFile = None,
) -> None:
    """Predict the largest stable step of every scheme, owner of the contact and stiffness.

    From the linear models of a vehicle FMU and a track FMU that take contact forces; nothing is
    run. Wheels are held, hertz is linearised at the static load, and whoever owns the contact
    springs is taken to integrate them exactly.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    chosen, texts = schemes_of(schemes), contact_stiffness.split(",")
    parameters = [contact_parameters(text) for text in texts]
    with fmus_of(vehicle_fmu, track_fmu, "Vehicle", "Track") as (vehicle, track):
        k_H = [stiffness(vehicle, track, values) for values in parameters]
        with progress("linearising") as update:
            parts = linear_parts(vehicle, track, update)
    with progress("predicting") as update:
        found = _all_limits(parts, k_H, chosen, update)
    console.print(_table(found, texts))
    for k, text in zip(k_H, texts, strict=True):
        warn_of_growth(parts, k, text)
    result = _dataset(found, k_H)
    keep(result, out, plot=plot, chart=partial(stability_chart, longest=LONGEST))


def schemes_of(text: str) -> list[str]:
    """Names of the schemes that can be predicted and begin with one of several words."""
    names = [name for name, member in members().items() if member.linear]
    learning = [name for name, member in members().items() if not member.linear]
    chosen = dict[str, None]()
    for word in text.split(","):
        matching = [name for name in names if name.startswith(word)] if word else []
        if not matching and word and any(name.startswith(word) for name in learning):
            raise UsageError(
                f"--schemes {text}: {word} cannot be predicted, as it learns within a step; "
                "railcosim study runs it"
            )
        if not matching:
            raise UsageError(
                f"--schemes {text}: no scheme begins with {word!r}; there are {', '.join(names)}"
            )
        chosen |= dict.fromkeys(matching)
    return list(chosen)


def stiffness(vehicle: Path, track: Path, parameters: dict[str, float | bool]) -> float:
    """The stiffness (N/m) that contact parameters mean, at the static load."""
    if parameters["contact.nonlinear"]:
        return static_stiffness(vehicle, track, parameters)
    return float(parameters["contact.stiffness"])


def warn_of_growth(parts: tuple[Part, ...], k_H: float, text: str) -> None:
    """Say so where vehicle and track are not stable even if coupled exactly."""
    growth = max(part.growth(np.full(len(part.wheels), k_H)) for part in parts)
    if growth > 0.0:
        console.print(
            f"{text}: coupled exactly, vehicle and track grow by exp({growth:.3g} t), for one of "
            "them is not passive; schemes are only asked to add nothing to that",
        )


def _all_limits(
    parts: tuple[Part, ...],
    k_H: list[float],
    names: list[str],
    update: Callable[[float, float], None],
) -> Found:
    """By scheme and owner, one for each stiffness; on all cores."""
    catalogue = members()
    tasks = []
    for owner in Owner:
        suiting = {n: catalogue[n].scheme for n in names if owner in catalogue[n].owners}
        for i, k in enumerate(k_H):
            tasks.append(
                Task(
                    name=f"{owner.value} {i}",
                    function=limits,
                    arguments=(parts, owner, k, suiting),
                    cost=float(len(suiting)),
                )
            )
    tasks = [task for task in tasks if task.cost > 0.0]
    total = sum(task.cost for task in tasks)
    with Workers(update) as workers:
        results = dict(workers.completed(tasks, total))
    return {
        (name, owner): [results[f"{owner.value} {i}"][name] for i in range(len(k_H))]
        for name in names
        for owner in Owner
        if owner in catalogue[name].owners
    }


def in_ms(step: float) -> str:
    """A largest stable step for a table, ms."""
    if math.isinf(step):
        return f"> {1e3 * LONGEST:g}"
    return f"{1e3 * step:.3g}" if step > 0.0 else "none"


def _table(found: Found, texts: list[str]) -> Table:
    table = Table(title="Largest stable step, ms")
    for heading in ("scheme", "contact in", "evaluations"):
        table.add_column(heading, no_wrap=heading == "scheme")
    for text in texts:
        table.add_column("hertz" if text == "hertz" else f"{text} N/m", justify="right")
    for (name, owner), row in found.items():
        evaluations = max(limit.evaluations for limit in row)
        table.add_row(
            name, owner.value, str(evaluations), *(in_ms(limit.step) for limit in row)
        )  # fmt: skip
    return table


def _dataset(found: Found, k_H: list[float]) -> xr.Dataset:
    """A variable for each scheme and owner over the stiffness."""
    order = np.argsort(k_H)
    steps = {
        f"{name}.{owner.value}": (
            "k_H",
            np.array([row[i].step for i in order]),
            {"units": "s", "long_name": f"largest stable step of {name}, contact in {owner.value}"},
        )
        for (name, owner), row in found.items()
    }
    axis = ("k_H", np.array(k_H)[order], {"units": "N/m", "long_name": "contact stiffness"})
    return xr.Dataset(steps, coords={"k_H": axis}, attrs={"title": "largest stable step"})
