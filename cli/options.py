"""What the commands share: how options are spelt, checked and read, and progress bars."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from railcosim.analysis.contact import NONLINEAR, STIFFNESS, TANGENT
from railcosim.parameters import read_toml
from railcosim.storage.interruption import noting
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .terminal import console, errors

__all__ = ["console", "errors"]  # beside what is defined here

FloatArray = NDArray[np.float64]

MAX_FREQUENCIES = 1_000_000


class UsageError(ValueError):
    """The command line asks for something that cannot be; exit status 2."""


VehicleFile = Annotated[
    Path | None, typer.Option("--vehicle", help="Vehicle parameters, TOML.", metavar="F.toml")
]
TrackFile = Annotated[
    Path | None, typer.Option("--track", help="Track parameters, TOML.", metavar="F.toml")
]
VehicleFmu = Annotated[
    Path | None,
    typer.Option(
        "--vehicle-fmu", help="Vehicle FMU; ours, exported now, if not given.", metavar="F"
    ),
]
TrackFmu = Annotated[
    Path | None,
    typer.Option("--track-fmu", help="Track FMU; ours, exported now, if not given.", metavar="F"),
]
Out = Annotated[Path, typer.Option("--out", help="Result: .nc or .csv.", metavar="FILE")]
PlotFile = Annotated[
    Path | None, typer.Option("--plot", help="Picture as well: .png, .svg or .pdf.", metavar="FILE")
]
Frequencies = Annotated[
    str,
    typer.Option(
        "--frequencies", help="start:stop:step in Hz, stop included, or start:stop:N@log."
    ),
]
ContactStiffness = Annotated[
    str, typer.Option("--contact-stiffness", help="Linear contact stiffness k_H, N/m.")
]
Speed = Annotated[float, typer.Option("--speed", help="km/h")]


def vehicle_of(file: Path | None) -> Vehicle:
    """The vehicle of a parameter file, or the paper's."""
    return Vehicle() if file is None else read_toml(Vehicle, file)


def track_of(file: Path | None) -> Track:
    """The track of a parameter file, or the paper's."""
    return Track() if file is None else read_toml(Track, file)


def frequencies_of(text: str) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, Hz; see `grid_of`."""
    return grid_of("--frequencies", text, "Hz")


def grid_of(option: str, text: str, unit: str) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, all positive.

    Raises
    ------
    UsageError
        Saying what is wrong with it.
    """
    form = f"start:stop:step ({unit}, stop included) or start:stop:N@log"
    parts = text.removesuffix("@log").split(":")
    try:
        start, stop, third = (float(part) for part in parts)
    except ValueError as error:
        raise UsageError(f"{option} {text}: must be {form}") from error
    if not (0 < start <= stop and third > 0 and math.isfinite(stop + third)):
        raise UsageError(f"{option} {text}: needs 0 < start <= stop and a third number > 0")
    if text.endswith("@log"):
        count = int(third)
        if count != third:
            raise UsageError(f"{option} {text}: N = {third:g} must be a whole number")
    else:
        count = math.floor((stop - start) / third * (1 + 1e-12) + 1e-9) + 1
    if count > MAX_FREQUENCIES:
        raise UsageError(f"{option} {text}: over {MAX_FREQUENCIES} values")
    if text.endswith("@log"):
        spaced: FloatArray = np.geomspace(start, stop, count)
        return spaced
    grid: FloatArray = start + third * np.arange(count, dtype=np.float64)
    return grid if stop - grid[-1] < 1e-9 * stop else np.append(grid, stop)


def contact_parameters(text: str) -> dict[str, float | bool]:
    """FMU parameters for ``hertz``, ``hertz:k_H``, or a stiffness k_H in N/m.

    With ``hertz:k_H`` the tangent at the static load of the vehicle's wheels is k_H.
    """
    kind, _, tangent = text.partition(":")
    if kind != "hertz":
        return {NONLINEAR: False, STIFFNESS: stiffness_of(text)}
    if not tangent:
        return {NONLINEAR: True}
    return {NONLINEAR: True, TANGENT: stiffness_of(tangent)}


def stiffness_of(text: str) -> float:
    """A contact stiffness in N/m."""
    try:
        k_H = float(text)
    except ValueError:
        k_H = math.nan
    if not (math.isfinite(k_H) and k_H > 0):
        raise UsageError(
            f"--contact-stiffness {text}: must be a number > 0 in N/m, hertz, or hertz:N/m"
        )
    return k_H


def positive(option: str, value: float, unit: str) -> float:
    """Check a number that must be finite and positive."""
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{option} {value:g}: must be > 0 {unit}")
    return value


@contextmanager
def progress(text: str) -> Iterator[Callable[[float, float], None]]:
    """A progress bar on standard error; the callable takes what is done and the total.

    Ctrl-C is obeyed at the next call; see `noting`.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    bar = Progress(
        *columns, TimeRemainingColumn(), console=errors, transient=True,
        disable=not errors.is_terminal,  # else it leaves an empty line
    )  # fmt: skip
    with noting() as obey, bar:
        task = bar.add_task(text, total=None)

        def update(done: float, total: float) -> None:
            obey()
            bar.update(task, completed=done, total=total)

        yield update


@contextmanager
def status(text: str) -> Iterator[Callable[[str], None]]:
    """A line that tells what is being done."""
    with errors.status(text) as line:
        yield lambda now: line.update(f"{text}: {now}")
