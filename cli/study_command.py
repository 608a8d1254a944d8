"""railcosim study."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.box import SIMPLE
from rich.table import Table

from railcosim.analysis.pair.owner import Owner

from .fmus import FreshOption, made
from .irregularity_options import IrregularityOptions
from .option_types import (
    DimensionName,
    DimensionOption,
    PlotFile,
    PositionOption,
    SchedulerOption,
    Speed,
)
from .options import (
    UsageError,
    contact_parameters,
    doubted,
    given_here,
    positive,
    speed_of,
)
from .parameter_options import PairOptions
from .progress import progress
from .results import PICTURES, folder_of
from .system_options import SystemOptions
from .terminal import Terminal, console

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.analysis.schemes.grid_run import Studied
    from railcosim.analysis.schemes.study_point import ContactCase

WIDTH = 120  # of the table, characters


OF_THE_PAIR = (
    "owners", "contact_stiffness", "speed", "position", "irregularity", "seed", "quantities",
    "defect", "fade", "repeat",
    "vehicle", "vehicles", "track", "set_", "dimension", "fresh",
)  # fmt: skip


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
    instead: SystemOptions,
    plot: PlotFile = None,
    scheduler: SchedulerOption = None,
    context: typer.Context,
) -> None:
    """Compare coupling schemes: error against the monolithic solution, growth and cost.

    Runs every scheme with every owner of the contact it allows, every contact and every step, with
    held wheels and a moving irregularity. What is finished is kept in the folder: the same command
    goes on after an interruption, and one with more schemes or steps runs only those. Of pairs in
    space, any stiffness is that at the static load. Any other system, --system, runs as its file
    says, and is held against runs with ever shorter steps, extrapolated.
    """
    from railcosim.analysis.schemes.grid_run import study as studied
    from railcosim.analysis.schemes.grid_run import study_system
    from railcosim.analysis.schemes.study import Grid

    PICTURES.check(plot)
    folder_of("--out", out)
    if system := instead.file(context, OF_THE_PAIR):
        chosen = [_step(text, system) for text in _parts("--steps", steps)]
        make = partial(
            study_system, system, out, _parts("--schemes", schemes),
            chosen if given_here(context, "steps") else (), law=instead.law,
            time=positive("--time", time, "s") if given_here(context, "time") else None,
        )  # fmt: skip
        _finish(make, scheduler, out, plot)
        return
    v = speed_of(speed)
    aside = dimension is DimensionName.SPATIAL
    profile = rough.profile(v * positive("--time", time, "s"), spatial=aside)
    defects = rough.defects()
    asked = (
        _parts("--schemes", schemes),
        _parts("--owners", owners),
        _contacts(_parts("--contact-stiffness", contact_stiffness), aside=aside),
        [_step(text) for text in _parts("--steps", steps)],
    )
    Grid.of(*asked).check(time)
    with made(*given.pair(), dimension=dimension, fresh=fresh) as fmus:
        make = partial(
            studied, fmus, out, *asked, time=time, speed=v, irregularity=profile,
            defects=defects, position=position,
        )  # fmt: skip
        _finish(make, scheduler, out, plot)


def _contacts(texts: list[str], *, aside: bool) -> list[ContactCase]:
    """What ``--contact-stiffness`` says; wheels that roll have none but that at the static load."""
    from railcosim.analysis.schemes.study_point import ContactCase

    at_rest = "hertz:" if aside else ""
    return [
        ContactCase(
            label=text, parameters=contact_parameters(text if "hertz" in text else at_rest + text)
        )
        for text in texts
    ]


def _finish(
    make: Callable[..., Studied], scheduler: str | None, out: Path, plot: Path | None
) -> None:
    """Run, show, and say what failed."""
    from railcosim.analysis.schemes.grid_run import NoDaskError
    from railcosim.analysis.schemes.study import StudyError

    try:
        with progress("running points") as update:
            found = make(scheduler=scheduler, progress=update, tell=console.print)
    except StudyError as error:
        raise UsageError(f"--out {error}") from error
    except NoDaskError as error:
        raise UsageError(str(error)) from error
    if found.table is not None:
        _show(found.table, out, plot)
    if found.failed:
        n, first = found.points, "; ".join(found.failed[:3])
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
        title=f"Contact {table['contact'].item()}: relative RMS error of {table.attrs['compared']} "
        f"to {table.attrs['held_to']} (itself within {table['reference_error'].max():.0e}), "
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


def _step(text: str, system: Path | None = None) -> float:
    """A step, s; what is usual of a pair says nothing of other systems."""
    try:
        number = float(text)
    except ValueError as error:
        raise UsageError(f"--steps {text}: must be numbers > 0, in s") from error
    step = positive("--steps", number, "s")
    return step if system is not None else doubted("--step", step)
