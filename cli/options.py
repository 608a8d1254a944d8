"""What the commands share: how options are spelt, checked and read, and progress bars."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from railcosim.parameters import UnusualWarning, Usual
from railcosim.storage.interruption import noting

from .terminal import console, errors

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .parameter_options import FmuOptions

    FloatArray = NDArray[np.float64]

__all__ = ["console", "errors"]  # beside what is defined here

MAX_FREQUENCIES = 1_000_000
LIMITS = {  # wider than anything that is built: what is outside is a slip, or overflows
    "--amplitude": (1e-100, 1e100),
    "--frequencies": (
        1e-3,
        1e6,
    ),  # below, 1 / omega^2 of a free vehicle takes the digits: 1e-7 left
    "--length": (1.0, 1e6),
    "--shortest": (1e-3, 1e3),
    "--speed": (1e-3, 1e4),
    "--speeds": (1e-3, 1e4),
    "--step": (1e-12, 1e9),
    "--steps": (1e-12, 1e9),
    "--time": (1e-9, 1e9),
    "--wavelengths": (1e-3, 1e6),
}
OR_HERTZ = ", hertz, or hertz:N/m"
STIFFEST, SOFTEST = 1e15, 1e3  # N/m; softer, a wheel would hang metres below its place


class UsageError(ValueError):
    """The command line asks for something that cannot be; exit status 2."""


VehicleFmus = Annotated[
    list[Path] | None,
    typer.Option(
        "--vehicle-fmu",
        help="Vehicle FMU; ours if not given. Several, from the front, if given again.",
        metavar="F",
    ),
]
TrackFmu = Annotated[
    Path | None,
    typer.Option("--track-fmu", help="Track FMU; ours if not given.", metavar="F"),
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
PositionOption = Annotated[
    float | None,
    typer.Option(
        "--position", help="Where the last wheelset stands, m; as the FMU has it if not given."
    ),
]
PositionsOption = Annotated[
    str | None,
    typer.Option(
        "--position",
        help="Where the last wheelset stands, m, or at a railseat or midspan of our track; of "
        "several vehicles that of each, such as 25.1,0.3. As the FMU has it if not given.",
        metavar="PLACE",
    ),
]
LocalOption = Annotated[
    list[str] | None,
    typer.Option(
        "--local",
        help="What is different at one place: how much of a fastening or a layer is left (0: "
        "it hangs), fastening@railseat+1=0, kg more on a rail, mass@1.2=15, or a gap in m that "
        "closes, in time, sleeper@railseat=gap:1e-3. PLACE is in m along the track, as --position. "
        "Repeat it for more.",
        metavar="CHANGE",
    ),
]
ThenOption = Annotated[
    list[str] | None,
    typer.Option(
        "--then",
        help="Another kind of track from X on, m: a file or a built-in one, such as "
        "ballasted@30, where a cell of the one before ends. Repeat it for more.",
        metavar="TRACK@X",
    ),
]
LawOption = Annotated[
    Path | None,
    typer.Option(
        "--law",
        help="Springs and dampers between the system's FMUs, in the master: a TOML file.",
        metavar="F.toml",
    ),
]
SystemOption = Annotated[
    Path | None,
    typer.Option("--system", help="Any system of FMUs instead, an SSP file.", metavar="F.ssp"),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        help="Run on the workers of this dask scheduler, such as tcp://host:8786; on the cores "
        "of this machine if not given.",
        metavar="ADDRESS",
    ),
]
Speed = Annotated[float, typer.Option("--speed", help="km/h")]


_SPEED = Usual(15.0, 600.0, "shunting to records")
USUAL = {
    "--contact-stiffness": (Usual(1e7, 1e11, "the paper has 0.1 to 8 GN/m"), "N/m"),
    "--speed": (_SPEED, "km/h"),
    "--speeds": (_SPEED, "km/h"),
    "--step": (Usual(1e-7, 2e-2, "contact to car body"), "s"),
}


def given_here(context: typer.Context, name: str) -> bool:
    """Whether an option was given on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def refuse_of_pair(context: typer.Context, system: Path, options: tuple[str, ...]) -> None:
    """Refuse options given on the command line that say nothing of a system in a file."""
    for name in options:
        if given_here(context, name):
            option = "--" + name.strip("_").replace("_", "-")
            raise UsageError(f"{option}: is of our pair; {system} has its own FMUs. Leave it out")


def refuse_of_system(context: typer.Context, options: tuple[str, ...]) -> None:
    """Refuse options given on the command line that say nothing without ``--system``."""
    for name in options:
        if given_here(context, name):
            raise UsageError(f"--{name.replace('_', '-')}: is of FMUs of --system")


def positions_of(text: str | None, given: FmuOptions) -> list[float] | None:
    """Read ``--position``: numbers of m, or places of our track by name, with commas."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        if given.track_fmu is not None:
            raise UsageError(
                f"--position {text}: must be m, with commas; railseat and midspan are known of "
                "our own track, and not of --track-fmu"
            ) from error
    from railcosim.analysis.response.receptance import place_of

    return [place_of(given.rails(), part.strip()) for part in text.split(",")]


def frequencies_of(text: str, limits: tuple[float, float] | None = None) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, Hz; see `grid_of`."""
    return grid_of("--frequencies", text, "Hz", limits)


def grid_of(
    option: str, text: str, unit: str, limits: tuple[float, float] | None = None
) -> FloatArray:
    """Read ``start:stop:step`` or ``start:stop:N@log``, within limits, the option's if not given.

    Raises
    ------
    UsageError
        Saying what is wrong with it.
    """
    import numpy as np

    form = f"start:stop:step ({unit}, stop included) or start:stop:N@log"
    parts = text.removesuffix("@log").split(":")
    try:
        start, stop, third = (float(part) for part in parts)
    except ValueError as error:
        raise UsageError(f"{option} {text}: must be {form}") from error
    least, most = LIMITS[option] if limits is None else limits
    if not (least <= start <= stop <= most and 0 < third < math.inf):
        raise UsageError(
            f"{option} {text}: needs {least:g} <= start <= stop <= {most:g} {unit} and a third "
            "number > 0"
        )
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


class DimensionName(StrEnum):
    """How dimensions are spelt."""

    VERTICAL = "vertical"
    SPATIAL = "spatial"


DimensionOption = Annotated[
    DimensionName,
    typer.Option(
        "--dimension",
        metavar="NAME",
        help="Of our FMUs: spatial, where wheels roll on rails that move aside and turn as well; "
        "with --vehicle-fmu or --track-fmu theirs counts.",
    ),
]


def contact_parameters(text: str) -> dict[str, float | bool]:
    """FMU parameters for ``hertz``, ``hertz:k_H``, or a stiffness k_H in N/m.

    With ``hertz:k_H`` the tangent at the static load of the vehicle's wheels is k_H.
    """
    from railcosim.analysis.pair.contact import NONLINEAR, STIFFNESS, TANGENT

    kind, _, tangent = text.partition(":")
    if kind != "hertz":
        return {NONLINEAR: False, STIFFNESS: stiffness_of(text, OR_HERTZ)}
    if not tangent:
        return {NONLINEAR: True}
    return {NONLINEAR: True, TANGENT: stiffness_of(tangent, OR_HERTZ, "hertz:")}


def stiffness_of(text: str, otherwise: str = "", before: str = "") -> float:
    """A contact stiffness in N/m, given `before`; a message says what it may be `otherwise`."""
    try:
        k_H = float(text)
    except ValueError:
        k_H = math.nan
    if not SOFTEST <= k_H <= STIFFEST:
        raise UsageError(
            f"--contact-stiffness {before}{text}: must be a number from {SOFTEST:g} to "
            f"{STIFFEST:g} in N/m{otherwise}" + USUAL["--contact-stiffness"][0].slip(k_H, "N/m")
        )
    return doubted("--contact-stiffness", k_H)


def positive(option: str, value: float, unit: str) -> float:
    """Check a number that must be positive and within the option's limits."""
    if not (math.isfinite(value) and value > 0):
        raise UsageError(f"{option} {value:g}: must be > 0 {unit}")
    least, most = LIMITS.get(option, (0.0, math.inf))
    if not least <= value <= most:
        raise UsageError(f"{option} {value:g}: must be from {least:g} to {most:g} {unit}")
    return value


def doubted(option: str, value: float) -> float:
    """Warn of a number of our pair that is allowed and unusual: the unit may be another."""
    usual, unit = USUAL[option]
    doubt = usual.doubt(option, value, unit)
    if doubt is not None:
        warnings.warn(doubt, UnusualWarning, stacklevel=2)
    return value


def speed_of(speed: float, option: str = "--speed") -> float:
    """A speed in m/s, from one in km/h that should not have been m/s already."""
    kmh = doubted(option, positive(option, speed, "km/h"))
    whole = 10 * round(0.36 * kmh)  # what 69.4 would be in km/h if it were m/s
    if kmh % 1 and abs(3.6 * kmh - whole) < 0.2 and USUAL[option][0].low <= kmh:
        warnings.warn(
            f"{option} = {kmh:g} km/h: meant {kmh:g} m/s? That is {whole:g} km/h",
            UnusualWarning,
            stacklevel=2,
        )
    return kmh / 3.6


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
def foretelling(text: str) -> Iterator[Callable[[float, float], None]]:
    """A progress bar of work of some seconds: it is told before, and soon for how long."""
    from railcosim.master.progress import foretold

    errors.print(text)
    with progress(text) as update:
        yield foretold(update, lambda more: errors.print(f"{text}: {more}"))


@contextmanager
def status(text: str) -> Iterator[Callable[[str], None]]:
    """A line that tells what is being done."""
    with errors.status(text) as line:
        yield lambda now: line.update(f"{text}: {now}")
