"""railcosim study."""

from __future__ import annotations

import fnmatch
import itertools
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
import xarray as xr
from rich.box import SIMPLE
from rich.table import Table

from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.schemes.catalogue import Member, members
from railcosim.analysis.schemes.grid_run import NoDaskError
from railcosim.analysis.schemes.grid_run import study as study_of
from railcosim.analysis.schemes.study import Folder, Grid, StudyError, settings_of
from railcosim.analysis.schemes.study_point import Contact, Ride
from railcosim.analysis.schemes.study_table import save_table
from railcosim.master.course import count_steps
from railcosim.master.memory import afford
from railcosim.master.suggest import suggest
from railcosim.plots.study import UNSTABLE, save_study_picture
from railcosim.track.irregularity.named import irregularity as named

from .fmus import FreshOption, made
from .irregularity_options import (
    FadeOption,
    Irregularity,
    RepeatOption,
    SeedOption,
)
from .options import (
    PlotFile,
    Speed,
    TrackFile,
    UsageError,
    VehicleFile,
    Vehicles,
    console,
    contact_parameters,
    doubted,
    positive,
    progress,
    speed_of,
    track_of,
    vehicle_of,
)
from .results import PICTURES, folder_of
from .terminal import Terminal

WIDTH = 120  # of the table, characters
BYTES = 500  # that a step of a run takes: its forces, its report, and what holds them


class StudyFailedError(ArithmeticError):
    """Some points could not be run; exit status 1."""


def study(
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
    irregularity: Irregularity = "german-low",
    seed: SeedOption = None,
    fade: FadeOption = None,
    repeat: RepeatOption = False,
    vehicle: VehicleFile = None,
    vehicles: Vehicles = 1,
    track: TrackFile = None,
    fresh: FreshOption = False,
    out: Annotated[
        Path, typer.Option("--out", help="Folder for what is finished.", metavar="DIR")
    ] = Path("railcosim-study"),
    plot: PlotFile = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            help="Run on the workers of this dask scheduler, such as tcp://host:8786; on the cores "
            "of this machine if not given.",
            metavar="ADDRESS",
        ),
    ] = None,
) -> None:
    """Compare coupling schemes: error against the monolithic solution, growth and cost.

    Runs every scheme with every owner of the contact it allows, every contact and every step, with
    held wheels and a moving irregularity. What is finished is kept in the folder: the same command
    goes on after an interruption, and one with more schemes or steps runs only those.
    """
    PICTURES.check(plot)
    folder_of("--out", out)
    v = speed_of(speed)
    profile = named(
        irregularity, v * positive("--time", time, "s"), seed=seed, fade=fade, repeat=repeat
    )
    ride = Ride(speed=v, profile=profile, stop=time)
    grid = Grid(
        schemes=_schemes(schemes),
        owners=[_owner(name) for name in _parts("--owners", owners)],
        contacts=[
            Contact(label=text, parameters=contact_parameters(text))
            for text in _parts("--contact-stiffness", contact_stiffness)
        ],
        steps=[_step(text, time) for text in _parts("--steps", steps)],
    )
    points = grid.points()
    if not points:
        raise UsageError(f"--owners {owners}: none of the schemes allows it")
    cars = vehicle_of(vehicle, vehicles)
    with made(cars, track_of(track, cars), fresh=fresh) as fmus:
        try:
            folder = Folder(out, settings_of(ride, fmus))
            with progress("running points") as update:
                found = study_of(grid, ride, fmus, folder, scheduler, update, console.print)
        except StudyError as error:
            raise UsageError(f"--out {error}") from error
        except NoDaskError as error:
            raise UsageError(str(error)) from error
    if found.table is not None:
        _show(found.table, out, plot)
    if found.failed:
        raise StudyFailedError(
            f"{len(found.failed)} of {len(points)} points failed: {'; '.join(found.failed[:3])}"
        )


def _show(table: xr.Dataset, out: Path, plot: Path | None) -> None:
    """Save, print and draw."""
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
    if np.isnan(error):
        return ""
    return f"{error:.1e}" if error < UNSTABLE else "unstable"


def _parts(option: str, text: str) -> list[str]:
    """Take apart what has commas between, each once."""
    parts = list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
    if not parts:
        raise UsageError(f"{option} {text!r}: names nothing")
    return parts


def _schemes(text: str) -> dict[str, Member]:
    """Schemes of the catalogue by names and patterns, in its order."""
    known = members()
    chosen: set[str] = set()
    for pattern in _parts("--schemes", text):
        matching = fnmatch.filter(known, pattern)
        if not matching:
            raise UsageError(
                f"--schemes {pattern}: no such scheme{suggest(pattern, known)}; "
                f"there are {', '.join(known)}"
            )
        chosen.update(matching)
    return {name: member for name, member in known.items() if name in chosen}


def _owner(name: str) -> Owner:
    if name not in list(Owner):
        raise UsageError(f"--owners {name}: must be {', '.join(Owner)}{suggest(name, Owner)}")
    return Owner(name)


def _step(text: str, time: float) -> float:
    """A step, s."""
    try:
        number = float(text)
    except ValueError as error:
        raise UsageError(f"--steps {text}: must be numbers > 0, in s") from error
    step = doubted("--step", positive("--steps", number, "s"))
    if step > time:
        raise UsageError(f"--steps {text}: is longer than --time {time:g} s")
    steps = count_steps(0.0, time, step)
    afford(BYTES * steps, f"--steps {text}: {steps} steps", "take longer steps, or less --time")
    return step
