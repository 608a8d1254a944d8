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
from railcosim.analysis.stability import FAST, LONGEST, Limit, Window, limits, static_stiffness
from railcosim.plots.stability import stability_chart

from .fmus import FreshOption, fmus_of
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
"""Schemes by default; all that can be predicted would take twice as long."""
TOGETHER = 3
"""Schemes of one task: the contact is made ready once for them."""
NOWHERE = Window(begin=math.nan, end=math.nan, is_fast=False, growth=math.nan)


def stability(
    out: OutFile = None,
    vehicle_fmu: VehicleFmu = None,
    track_fmu: TrackFmu = None,
    fresh: FreshOption = False,
    contact_stiffness: Annotated[
        str,
        typer.Option("--contact-stiffness", help="k_H in N/m, or hertz; several with commas."),
    ] = "0.1e9,1e9,8e9",
    schemes: Annotated[
        str, typer.Option(help="Schemes, or how their names begin; several with commas.")
    ] = USUAL,
    plot: PlotFile = None,
) -> None:
    """Predict the largest stable step of every scheme, owner of the contact and stiffness.

    And the windows above it: ranges of steps in which something grows, between others in which
    nothing does. From the linear models of a vehicle FMU and a track FMU that take contact forces;
    nothing is run. Wheels are held, hertz is linearised at the static load, and whoever owns the
    contact springs is taken to integrate them exactly.
    """
    RESULTS.check(out)
    PICTURES.check(plot)
    chosen, texts = schemes_of(schemes), contact_stiffness.split(",")
    parameters = [contact_parameters(text) for text in texts]
    with fmus_of(vehicle_fmu, track_fmu, fresh=fresh) as (vehicle, track):
        k_H = [stiffness(vehicle, track, values) for values in parameters]
        with progress("linearising") as update:
            parts = linear_parts(vehicle, track, update)
    with progress("predicting") as update:
        found = _all_limits(parts, k_H, chosen, update)
    console.print(_table(found, texts))
    if any(_closed(limit) for row in found.values() for limit in row):
        console.print(_windows(found, texts))
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
            for j in range(0, len(suiting), TOGETHER):
                some = dict(list(suiting.items())[j : j + TOGETHER])
                tasks.append(
                    Task(
                        name=f"{owner.value} {i} {j}",
                        function=limits,
                        arguments=(parts, owner, k, some),
                        cost=float(len(some)),
                    )
                )
    total = sum(task.cost for task in tasks)
    results: dict[tuple[str, str, str], Limit] = {}
    with Workers(update) as workers:
        for task, part in workers.completed(tasks, total):
            owner_name, i_k, _ = task.split()
            results |= {(owner_name, i_k, name): limit for name, limit in part.items()}
    return {
        (name, owner): [results[owner.value, str(i), name] for i in range(len(k_H))]
        for name in names
        for owner in Owner
        if owner in catalogue[name].owners
    }


def in_ms(step: float) -> str:
    """A largest stable step for a table, ms."""
    if math.isinf(step):
        return f"> {1e3 * LONGEST:g}"
    if step <= 0.0:
        return "none"
    digit = 10.0 ** (math.floor(math.log10(1e3 * step)) - 2)
    return f"{math.floor(1e3 * step / digit) * digit:.3g}"  # rounded down: a limit is no more


def _reach(limit: Limit) -> str:
    """Largest stable step for a table, and that up to which nothing grows fast, ms."""
    last = "" if limit.fast == limit.step else f" ({in_ms(limit.fast)})"
    return in_ms(limit.step) + last


def _closed(limit: Limit) -> list[Window]:
    """Windows above which nothing grows again."""
    return [window for window in limit.windows if math.isfinite(window.end)]


def _table(found: Found, texts: list[str]) -> Table:
    table = Table(title=f"Largest stable step, ms (in brackets: if {FAST:g} 1/s is allowed)")
    for heading in ("scheme", "contact in", "evaluations"):
        table.add_column(heading, no_wrap=heading == "scheme")
    for text in texts:
        table.add_column(_contact(text), justify="right")
    for (name, owner), row in found.items():
        evaluations = max(limit.evaluations for limit in row)
        table.add_row(name, owner.value, str(evaluations), *(_reach(limit) for limit in row))
    return table


def _windows(found: Found, texts: list[str]) -> Table:
    """Where something grows between stable steps."""
    table = Table(title="Windows: steps (ms) in which something grows, and its rate in the middle")
    for heading in ("scheme", "contact in", "stiffness", "ms", "1/s"):
        table.add_column(heading, justify="right" if heading in ("ms", "1/s") else "left")
    for (name, owner), row in found.items():
        for text, limit in zip(texts, row, strict=True):
            for window in _closed(limit):
                edges = f"{1e3 * window.begin:.4g}-{1e3 * window.end:.4g}"
                table.add_row(name, owner.value, _contact(text), edges, f"{window.growth:.2g}")
    return table


def _contact(text: str) -> str:
    return "hertz" if text == "hertz" else f"{text} N/m"


def _dataset(found: Found, k_H: list[float]) -> xr.Dataset:
    """Variables for each scheme and owner over the stiffness; windows it has not are NaN."""
    order = np.argsort(k_H)
    columns = {}
    for (name, owner), row in found.items():
        stem, who = f"{name}.{owner.value}", f"{name}, contact in {owner.value}"
        limits = [row[i] for i in order]
        columns[stem] = [limit.step for limit in limits], "s", f"largest stable step of {who}"
        for w in range(max(len(limit.windows) for limit in limits)):
            some = [limit.windows[w] if w < len(limit.windows) else NOWHERE for limit in limits]
            text = f"of window {w + 1}, in which something grows, of {who}"
            columns |= {
                f"{stem}.window[{w + 1}].begin": ([s.begin for s in some], "s", f"begin {text}"),
                f"{stem}.window[{w + 1}].end": ([s.end for s in some], "s", f"end {text}"),
                f"{stem}.window[{w + 1}].growth": ([s.growth for s in some], "1/s", f"rate {text}"),
            }
    variables = {
        name: ("k_H", np.array(values, dtype=float), {"units": unit, "long_name": text})
        for name, (values, unit, text) in columns.items()
    }
    axis = ("k_H", np.array(k_H)[order], {"units": "N/m", "long_name": "contact stiffness"})
    return xr.Dataset(variables, coords={"k_H": axis}, attrs={"title": "largest stable step"})
