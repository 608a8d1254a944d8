"""railcosim stability."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from .option_types import (
    DimensionName,
    DimensionOption,
    PlotFile,
    PositionsOption,
    Speed,
)
from .options import contact_parameters, positions_of, speed_of
from .parameter_options import FmuOptions
from .progress import progress
from .results import PICTURES, RESULTS, keep
from .scheme_options import EVERY, SchemesOption
from .system_options import SystemOptions
from .terminal import console, errors

if TYPE_CHECKING:
    from railcosim.analysis.schemes.limits import Found
    from railcosim.analysis.schemes.stability import Limit, Window


OF_A_PAIR = (
    "vehicle_fmu", "track_fmu", "vehicle", "vehicles", "track", "set_", "dimension", "speed",
    "contact_stiffness", "position", "fresh",
)  # fmt: skip
OutFile = Annotated[
    Path | None, typer.Option("--out", help="Result as well: .nc or .csv.", metavar="FILE")
]


def stability(
    *,
    out: OutFile = None,
    dimension: DimensionOption = DimensionName.VERTICAL,
    speed: Speed = 250.0,
    contact_stiffness: Annotated[
        str,
        typer.Option("--contact-stiffness", help="k_H in N/m, or hertz; several with commas."),
    ] = "0.1e9,1e9,8e9",
    schemes: SchemesOption = EVERY,
    position: PositionsOption = None,
    given: FmuOptions,
    instead: SystemOptions,
    plot: PlotFile = None,
    context: typer.Context,
) -> None:
    """Predict the largest stable step of every scheme, owner of the contact and stiffness.

    And the windows above it: ranges of steps in which something grows, between others in which
    nothing does. From the linear models of a vehicle FMU and a track FMU that take contact forces;
    nothing is run. Wheels are held, hertz is linearised at the static load, and whoever owns the
    contact springs is taken to integrate them exactly. Wheels of pairs in space creep at the speed,
    and any stiffness is that at the static load.
    """
    words, texts = ([word.strip() for word in of.split(",")] for of in (schemes, contact_stiffness))
    if system := instead.file(context, (*OF_A_PAIR, "plot")):
        _of_system(system, instead.law, words, out)
        return
    from railcosim.analysis.schemes.limits import predictable
    from railcosim.analysis.schemes.limits import stability as predicted
    from railcosim.analysis.schemes.stability import LONGEST
    from railcosim.plots.stability import stability_chart

    RESULTS.check(out)
    PICTURES.check(plot)
    predictable(words)
    v = speed_of(speed)
    parameters = [contact_parameters(text) for text in texts]
    standing = positions_of(position, given)
    with (
        given.fmus(dimension=dimension) as (vehicle, track),
        progress("predicting") as update,
    ):
        table = predicted(
            vehicle, track, parameters, words, update,
            position=standing, speed=v, tell=errors.print,
        )  # fmt: skip
    console.print(_table(table.limits, texts))
    if any(_closed(limit) for row in table.limits.values() for limit in row):
        console.print(_windows(table.limits, texts))
    _tell_of_refused(table.refused)
    for growth, text in zip(table.growth, texts, strict=True):
        tell_of_growth(growth, text)
    chart = partial(stability_chart, longest=LONGEST)
    keep(table.to_dataset(), out, plot=plot, chart=chart)


def _of_system(path: Path, law: Path | None, words: list[str], out: Path | None) -> None:
    """Any system of FMUs: a step a scheme."""
    from railcosim.analysis.schemes.black_boxes import system_stability

    RESULTS.check(out)
    with progress("predicting") as update:
        found = system_stability(path, words, law=law, progress=update, tell=errors.print)
    table = Table(title="Largest stable step, s, and what it is up to fast growth")
    for heading in ("scheme", "stable to", "grows fast from", "evaluations"):
        table.add_column(heading, no_wrap=heading == "scheme")
    for name, limit in found.limits.items():
        steps = (_in_s(step, found.longest) for step in (limit.step, limit.fast))
        table.add_row(name, *steps, str(limit.evaluations))
    console.print(table)
    _tell_of_refused(found.refused)
    for name, way in found.ways.items():
        console.print(f"{name}: {way}")
    tell_of_growing(found.growth)
    keep(found.to_dataset(), out)


def _tell_of_refused(refused: dict[str, str]) -> None:
    for name, why in refused.items():
        errors.print(f"note: {name}: {why}")


def _in_s(step: float, longest: float) -> str:
    return f"> {longest:.3g}" if math.isinf(step) else f"{step:.4g}" if step > 0.0 else "none"


def tell_of_growing(growth: float) -> None:
    """Say so where a system is not stable even if coupled exactly."""
    if growth > 0.0:
        console.print(
            f"coupled exactly it grows by exp({growth:.3g} t), whatever the step; schemes are only "
            "asked to add nothing to that"
        )


def tell_of_growth(growth: float, text: str) -> None:
    """Say so where vehicle and track are not stable even if coupled exactly."""
    if growth > 0.0:
        console.print(
            f"{text}: coupled exactly, vehicle and track grow by exp({growth:.3g} t), whatever the "
            "step: the vehicle hunts at this speed (railcosim critical-speed), or one of them is "
            "not passive; schemes are only asked to add nothing to that",
        )


def in_ms(step: float) -> str:
    """A largest stable step for a table, ms."""
    from railcosim.analysis.schemes.stability import LONGEST

    if math.isinf(step):
        return f"> {1e3 * LONGEST:g}"
    if step <= 0.0:
        return "none"
    digit = 10.0 ** (math.floor(math.log10(1e3 * step)) - 2)
    return f"{math.floor(1e3 * step / digit) * digit:.3g}"  # rounded down: a limit is no more


def _reach(limit: Limit) -> str:
    """Largest stable step for a table, and that up to which nothing grows fast, ms."""
    step, fast = in_ms(limit.step), in_ms(limit.fast)
    return step if fast == step else f"{step} ({fast})"


def _closed(limit: Limit) -> list[Window]:
    """Windows above which nothing grows again."""
    return [window for window in limit.windows if math.isfinite(window.end)]


def _table(found: Found, texts: list[str]) -> Table:
    from railcosim.analysis.schemes.stability import FAST

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
