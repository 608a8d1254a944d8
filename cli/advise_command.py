"""railcosim advise."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.track.irregularity import QUALITIES

from .option_types import (
    DimensionName,
    DimensionOption,
    PlotFile,
    PositionsOption,
    Speed,
)
from .options import (
    contact_parameters,
    positions_of,
    positive,
    speed_of,
)
from .parameter_options import FmuOptions
from .progress import progress
from .results import PICTURES, Suffixes, keep
from .scheme_options import EVERY, SchemesOption
from .stability_command import OF_A_PAIR, in_ms, tell_of_growing, tell_of_growth
from .system_options import SystemOptions
from .terminal import console, errors

if TYPE_CHECKING:
    from railcosim.analysis.schemes.advised import Advice, Option


TimeOption = Annotated[
    float | None,
    typer.Option(help="With --system: how long the run is, s; the file's if not given."),
]
NETCDF = Suffixes("--out", (".nc",))
SHOWN = 8
"""Lines of the table."""
OF_THE_PAIR = (*OF_A_PAIR, "irregularity")


def advise(
    *,
    accuracy: Annotated[
        float, typer.Option(help="Error allowed: RMS of the contact force's, relative.")
    ] = 1e-3,
    out: Annotated[
        Path | None, typer.Option("--out", help="Result as well: .nc.", metavar="FILE")
    ] = None,
    dimension: DimensionOption = DimensionName.VERTICAL,
    contact_stiffness: Annotated[
        str, typer.Option("--contact-stiffness", help="N/m, or hertz at the static load.")
    ] = "hertz",
    schemes: SchemesOption = EVERY,
    speed: Speed = 250.0,
    irregularity: Annotated[
        str, typer.Option("--class", help=f"Class of the track: {', '.join(QUALITIES)}.")
    ] = "german-low",
    position: PositionsOption = None,
    given: FmuOptions,
    instead: SystemOptions,
    time: TimeOption = None,
    plot: PlotFile = None,
    context: typer.Context,
) -> None:
    """Name owner, scheme and step that reach an accuracy at the least cost, before running.

    The error is predicted from the linear models of both FMUs, which must take contact forces, for
    a random irregularity under wheels that are held; of pairs in space it is the worse of the
    forces down and aside. Of any other system, --system, it is that of its own motions, each left
    alone, while it lasts. Cost is how often the FMUs are stepped.
    """
    from railcosim.analysis.schemes.advice import advise as advice
    from railcosim.analysis.schemes.advised import check_accuracy
    from railcosim.analysis.schemes.limits import predictable
    from railcosim.track.irregularity.synthesis import quality

    NETCDF.check(out)
    PICTURES.check(plot)
    check_accuracy(accuracy)
    words = [word.strip() for word in schemes.split(",")]
    if system := instead.file(context, OF_THE_PAIR, of_system=("time",)):
        _of_system(system, instead.law, time, accuracy, words, out, plot)
        return
    predictable(words)
    quality(irregularity)
    v = speed_of(speed)
    parameters = contact_parameters(contact_stiffness)
    standing = positions_of(position, given)
    with (
        given.fmus(dimension=dimension) as (vehicle, track),
        progress("predicting errors") as update,
    ):
        found = advice(
            vehicle, track, accuracy,
            contact=parameters, schemes=words, speed=v, irregularity=irregularity,
            position=standing, progress=update, tell=errors.print,
        )  # fmt: skip
    tell_of_growth(found.growth, contact_stiffness)
    _conclude(found, f"at contact stiffness {contact_stiffness}", out, plot)


def _of_system(
    path: Path, law: Path | None, time: float | None, accuracy: float, words: list[str],
    out: Path | None, plot: Path | None,
) -> None:  # fmt: skip
    """Any system of FMUs."""
    from railcosim.analysis.schemes.system_advice import advise_system

    duration = None if time is None else positive("--time", time, "s")
    with progress("predicting errors") as update:
        found = advise_system(
            path, accuracy, schemes=words, time=duration, law=law, progress=update,
            tell=errors.print,
        )  # fmt: skip
    tell_of_growing(found.growth)
    _conclude(found, f"of each of its own motions, over {found.about['time']:g} s", out, plot)


def _conclude(found: Advice, where: str, out: Path | None, plot: Path | None) -> None:
    """Print, save and draw."""
    from railcosim.plots.stability import advice_chart

    title = f"Error below {found.about['accuracy']:g} {where}, cheapest first"
    console.print(_table(found.options[:SHOWN], title))
    best = found.options[0]
    owned = "" if best.owner is None else f" with the contact in the {best.owner}"
    console.print(
        f"Use {best.scheme}{owned} and a step of {1e3 * best.step:g} ms: predicted error "
        f"{best.error:.1e}, {_margin(best)}."
    )
    keep(found.to_dataset(), out, plot=plot, chart=advice_chart)


def _margin(best: Option) -> str:
    from railcosim.analysis.schemes.advised import REACH

    if math.isinf(best.limit):
        return f"nothing grows up to {REACH:g} times that"
    return f"stable up to {in_ms(best.limit)} ms, {best.limit / best.step:.2g} times that"


def _limit(option: Option) -> str:
    """Largest stable step for the table, ms."""
    from railcosim.analysis.schemes.advised import REACH

    if math.isinf(option.limit):
        return f"> {1e3 * REACH * option.step:g}"
    return in_ms(option.limit)


def _table(found: list[Option], title: str) -> Table:
    table = Table(title=title)
    table.add_column("scheme", overflow="fold")
    table.add_column("contact", no_wrap=True)
    for heading in ("step, ms", "evals", "per s", "error", "limit, ms"):
        table.add_column(heading, justify="right", no_wrap=True)
    for option in found:
        table.add_row(
            option.scheme, option.owner or "-", f"{1e3 * option.step:g}", str(option.evaluations),
            f"{option.cost:.0f}", f"{option.error:.1e}", _limit(option),
        )  # fmt: skip
    return table
