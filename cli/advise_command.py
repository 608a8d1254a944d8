"""railcosim advise."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from railcosim.analysis.schemes.usual import PREDICTED
from railcosim.track.irregularity import QUALITIES

from .options import (
    DimensionName,
    DimensionOption,
    PlotFile,
    PositionsOption,
    Speed,
    console,
    contact_parameters,
    errors,
    positions_of,
    progress,
    speed_of,
)
from .parameter_options import FmuOptions
from .results import PICTURES, Suffixes, keep
from .stability_command import in_ms, tell_of_growth

if TYPE_CHECKING:
    from railcosim.analysis.schemes.advice import Option


NETCDF = Suffixes("--out", (".nc",))
SHOWN = 8
"""Lines of the table."""


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
    schemes: Annotated[
        str,
        typer.Option(
            help="Schemes, or how their names begin; several with commas.",
            show_default=", ".join(PREDICTED),  # which folds
        ),
    ] = ",".join(PREDICTED),
    speed: Speed = 250.0,
    irregularity: Annotated[
        str, typer.Option("--class", help=f"Class of the track: {', '.join(QUALITIES)}.")
    ] = "german-low",
    position: PositionsOption = None,
    given: FmuOptions,
    plot: PlotFile = None,
) -> None:
    """Name owner, scheme and step that reach an accuracy at the least cost, before running.

    The error is predicted from the linear models of both FMUs, which must take contact forces, for
    a random irregularity under wheels that are held; of pairs in space it is the worse of the
    forces down and aside. Cost is how often the FMUs are stepped.
    """
    from railcosim.analysis.schemes.advice import advise as advice
    from railcosim.analysis.schemes.advice import check_accuracy
    from railcosim.analysis.schemes.limits import predictable
    from railcosim.plots.stability import advice_chart
    from railcosim.track.irregularity.synthesis import quality

    NETCDF.check(out)
    PICTURES.check(plot)
    check_accuracy(accuracy)
    words = [word.strip() for word in schemes.split(",")]
    predictable(words)
    quality(irregularity)
    v = speed_of(speed)
    parameters = contact_parameters(contact_stiffness)
    with (
        given.fmus(dimension=dimension) as (vehicle, track),
        progress("predicting errors") as update,
    ):
        found = advice(
            vehicle, track, accuracy,
            contact=parameters, schemes=words, speed=v, irregularity=irregularity,
            position=positions_of(position), progress=update, tell=errors.print,
        )  # fmt: skip
    tell_of_growth(found.growth, contact_stiffness)
    console.print(_table(found.options[:SHOWN], accuracy, contact_stiffness))
    best = found.options[0]
    console.print(
        f"Use {best.scheme} with the contact in the {best.owner.value} and a step of "
        f"{1e3 * best.step:g} ms: predicted error {best.error:.1e}, {_margin(best)}."
    )
    keep(found.to_dataset(), out, plot=plot, chart=advice_chart)


def _margin(best: Option) -> str:
    from railcosim.analysis.schemes.advice import REACH

    if math.isinf(best.limit):
        return f"nothing grows up to {REACH:g} times that"
    return f"stable up to {in_ms(best.limit)} ms, {best.limit / best.step:.2g} times that"


def _limit(option: Option) -> str:
    """Largest stable step for the table, ms."""
    from railcosim.analysis.schemes.advice import REACH

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
