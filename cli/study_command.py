"""railcosim study."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from railcosim.analysis.pair.owner import Owner

from .fmus import FreshOption, made
from .irregularity_options import IrregularityOptions
from .options import (
    DimensionName,
    DimensionOption,
    PlotFile,
    PositionOption,
    SchedulerOption,
    Speed,
    UsageError,
    console,
    contact_parameters,
    doubted,
    positive,
    progress,
    speed_of,
)
from .parameter_options import PairOptions
from .results import PICTURES, folder_of
from .terminal import Terminal

if TYPE_CHECKING:
    import xarray as xr

WIDTH = 120  # of the table, characters


class StudyFailedError(ArithmeticError):
    """Some points could not be run; exit status 1."""


def study(
    *,
    schemes: Annotated[
        str, typer.Option(help="Names or patterns such as 'jacobi-*', with commas between.")
    ] = "*",
    steps: Annotated[
        str, typer.Option(help="Communication steps, s, with commas between.")
    ] = "2e-4,1e-4,5e-5",
    owners: Annotated[
        str, typer.Option(help=f"Of the contact springs: {', '.join(Owner)}, with commas between.")
    ] = ",".join(Owner),
    contact_stiffness: Annotated[
        str,
        typer.Option(
            "--contact-stiffness", help="k_H in N/m, hertz, or hertz:N/m, with commas between."
        ),
    ] = "1e9",
    time: Annotated[float, typer.Option(help="How long each run is, s.")] = 0.05,
    speed: Speed = 250.0,
    position: PositionOption = None,
    rough: IrregularityOptions,
    given: PairOptions,
    dimension: DimensionOption = DimensionName.VERTICAL,
    fresh: FreshOption = False,
    out: Annotated[
        Path, typer.Option("--out", help="Folder for what is finished.", metavar="DIR")
    ] = Path("railcosim-study"),
    plot: PlotFile = None,
    scheduler: SchedulerOption = None,
) -> None:
    """Compare coupling schemes: error against the monolithic solution, growth and cost.

    Runs every scheme with every owner of the contact it allows, every contact and every step, with
    held wheels and a moving irregularity. What is finished is kept in the folder: the same command
    goes on after an interruption, and one with more schemes or steps runs only those. Of pairs in
    space, any stiffness is that at the static load.
    """
    from railcosim.analysis.schemes.grid_run import NoDaskError
    from railcosim.analysis.schemes.grid_run import study as studied
    from railcosim.analysis.schemes.study import Grid, StudyError
    from railcosim.analysis.schemes.study_point import ContactCase

    PICTURES.check(plot)
    folder_of("--out", out)
    v = speed_of(speed)
    aside = dimension is DimensionName.SPATIAL
    profile = rough.profile(v * positive("--time", time, "s"), spatial=aside)
    defects = rough.defects()
    laws = _parts("--contact-stiffness", contact_stiffness)
    at_rest = "hertz:" if aside else ""  # rolling wheels have no other
    asked = (
        _parts("--schemes", schemes),
        _parts("--owners", owners),
        [
            ContactCase(
                label=text,
                parameters=contact_parameters(text if "hertz" in text else at_rest + text),
            )
            for text in laws
        ],
        [_step(text) for text in _parts("--steps", steps)],
    )
    grid = Grid.of(*asked)
    grid.check(time)
    with made(*given.pair(), dimension=dimension, fresh=fresh) as fmus:
        try:
            with progress("running points") as update:
                found = studied(
                    fmus, out, *asked, time=time, speed=v, irregularity=profile, defects=defects,
                    position=position, scheduler=scheduler, progress=update, tell=console.print,
                )  # fmt: skip
        except StudyError as error:
            raise UsageError(f"--out {error}") from error
        except NoDaskError as error:
            raise UsageError(str(error)) from error
    if found.table is not None:
        _show(found.table, out, plot)
    if found.failed:
        n, first = len(grid.points()), "; ".join(found.failed[:3])
        raise StudyFailedError(f"{len(found.failed)} of {n} points failed: {first}")


def _show(table: xr.Dataset, out: Path, plot: Path | None) -> None:
    """Save, print and draw."""
    from railcosim.analysis.schemes.study_table import save_table
    from railcosim.plots.study import save_study_picture

    for path in save_table(table, out):
        console.print(str(path))
    for contact in table["contact"].values:
        # Names of schemes are long: rather wide than cut.
        wide = Terminal(width=max(console.width, WIDTH))
        wide.print(order_table(table.sel(contact=contact)))
    if plot is not None:
        save_study_picture(table, plot)
        console.print(str(plot))


def order_table(table: xr.Dataset) -> Table:
    """Errors of one contact by step, with claimed and observed orders."""
    import numpy as np

    steps = table["step"].values[::-1]
    shown = Table(
        title=f"Contact {table['contact'].item()}: relative RMS error of the contact forces to "
        f"the monolithic solution (itself within {table['reference_error'].max():.0e}), "
        "by step in ms",
        box=SIMPLE,
    )
    shown.add_column("scheme, owner of the contact", no_wrap=True)
    for name in (*(f"{1e3 * step:g}" for step in steps), "order", "observed", "evals"):
        shown.add_column(name, justify="right", no_wrap=True)
    for owner, scheme in itertools.product(table["owner"].values, table["scheme"].values):
        row = table.sel(scheme=scheme, owner=owner)
        if row["error"].isnull().all():
            continue
        observed = row["observed_order"].item()
        shown.add_row(
            f"{scheme}, {owner}",
            *(_cell(row["error"].sel(step=step).item()) for step in steps),
            str(row["order"].item()),
            "-" if np.isnan(observed) else f"{observed:.2f}",
            f"{row['evaluations'].mean():.3g}",
        )
    return shown


def _cell(error: float) -> str:
    """Give an error as people read it."""
    from railcosim.plots.study import UNSTABLE

    if math.isnan(error):
        return ""
    return f"{error:.1e}" if error < UNSTABLE else "unstable"


def _parts(option: str, text: str) -> list[str]:
    """Take apart what has commas between, each once."""
    parts = list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    if not parts:
        raise UsageError(f"{option} {text!r}: names nothing")
    return parts


def _step(text: str) -> float:
    """A step, s."""
    try:
        number = float(text)
    except ValueError as error:
        raise UsageError(f"--steps {text}: must be numbers > 0, in s") from error
    return doubted("--step", positive("--steps", number, "s"))
