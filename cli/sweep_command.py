"""railcosim sweep."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .commands import COMMANDS, loaded
from .option_types import PlotFile, SchedulerOption
from .options import UsageError
from .progress import progress
from .results import PICTURES, Suffixes, folder_of, keep
from .sweep_point import blanks_in, filled, measured, options_of
from .terminal import console, errors

if TYPE_CHECKING:
    import xarray as xr

    from railcosim.analysis.joined import Value

NETCDF = Suffixes("--out", (".nc",))
MOST = 10_000  # values of one axis
PARAMETERS = {"track", "vehicle", "vehicles", "dimension", "set", "sensor", "local", "then"}
"""Options that decide FMUs of ours."""
FORM = "start:stop:N, start:stop:N@log, or values with commas"


class SweepFailedError(ArithmeticError):
    """Some points could not be made; exit status 1."""


def sweep(
    command: Annotated[str, typer.Argument(help="Which, with its options behind.")],
    out: Annotated[Path, typer.Option("--out", help="Result: .nc.", metavar="FILE")],
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="An axis: a number of vehicle or track, an option of the command, or NAME where "
            f"an option says {{NAME}}, and its values: {FORM}. Such as "
            "fastening.stiffness=2e7:6e7:5, speed=100:300:5, track=paper,booted, or depth=1e-3:"
            "3e-3:3 with --defect dip:depth={depth},length=1,at=30. Of one value: the same for "
            "all.",
            metavar="KEY=VALUES",
        ),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option("--only", help="Variables that are kept, with commas; all if not given."),
    ] = None,
    plot: PlotFile = None,
    show: Annotated[
        str | None, typer.Option("--show", help="Variable of the picture; the first if not given.")
    ] = None,
    scheduler: SchedulerOption = None,
    *,
    context: typer.Context,
) -> None:
    """Call a command for all combinations of values, on all cores: one dataset, one picture.

    What is finished is kept beside --out, in FILE.points: the same command goes on after an
    interruption, and one with more values makes only those.
    """
    from railcosim.analysis.pair.kept_fmus import MOST as MOST_KEPT
    from railcosim.analysis.schemes.grid_run import NoDaskError
    from railcosim.analysis.sweep import sweep as swept

    NETCDF.check(out)
    PICTURES.check(plot)
    asked = _asked(command, list(context.args), set_ or ())
    points = folder_of("--out", out.with_name(f"{out.name}.points"))
    files = asked.files()
    about: dict[str, Any] = {
        "command": command,
        "arguments": asked.arguments,
        "files": [hashlib.sha256(content).hexdigest() for content in files.values()],
    }
    names = [name.strip() for name in only.split(",")] if only else []
    measure = partial(
        measured, command, asked.arguments, files if scheduler else {},
        kept=asked.pairs <= MOST_KEPT,
    )  # fmt: skip
    with progress("sweeping") as update:
        try:
            found = swept(
                measure, asked.axes, points, about=about, only=names, scheduler=scheduler,
                progress=update, tell=console.print,
            )  # fmt: skip
        except NoDaskError as error:
            raise UsageError(str(error)) from error
    if found.dataset is not None:
        _keep(found.dataset, asked.axes, out, plot, show, f"sweep of {command}")
    if found.failed:
        for one in found.failed[:3]:
            errors.print(f"note: {one}")
        raise SweepFailedError(f"{len(found.failed)} points failed, NaN in the result")


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """Calls of a command that differ in values."""

    arguments: list[str]
    axes: dict[str, list[Value]]
    pairs: int  # how many FMUs of ours it may take

    def files(self) -> dict[str, bytes]:
        """Files that arguments name, such as --track=a.toml, and what is in them."""
        words = [word for one in self.arguments for word in (one, one.partition("=")[2])]
        return {one: Path(one).read_bytes() for one in words if Path(one).is_file()}


def _asked(command: str, arguments: list[str], texts: Sequence[str]) -> _Asked:
    """What is to be called, by the command line."""
    if command not in COMMANDS or not _gives_results(command):
        known = ", ".join(name for name in COMMANDS if _gives_results(name))
        raise UsageError(f"sweep {command}: must be one of {known}")
    options, blanks = options_of(command), blanks_in(arguments)
    axes = _axes(command, texts, {*options, *blanks})
    for blank in blanks:
        if blank not in axes:
            raise UsageError(f"{{{blank}}}: has no values; give --set {blank}= and {FORM}")
    for key in {*axes} - {*blanks}:  # of two the last would count, and nobody be told
        if any(one.partition("=")[0] == f"--{key}" for one in arguments):
            raise UsageError(f"--{key}: is an axis (--set {key}=...), and given besides")
    pairs = math.prod(
        len(v) for key, v in axes.items()
        if "." in key or PARAMETERS & {key, *blanks.get(key, ())}
    )  # fmt: skip
    same = {key: values[0] for key, values in axes.items() if len(values) == 1}
    axes = {key: values for key, values in axes.items() if len(values) > 1}
    if not axes:
        raise UsageError(f"--set: give at least one axis, KEY= and {FORM}")
    arguments = filled(command, arguments, same)
    _check(command, filled(command, arguments, {k: v[0] for k, v in axes.items()}))
    return _Asked(arguments=arguments, axes=axes, pairs=pairs)


def _keep(
    result: xr.Dataset, axes: dict[str, list[Value]], out: Path, plot: Path | None,
    show: str | None, title: str,
) -> None:  # fmt: skip
    """Save, and draw if there is what is to be shown."""
    from railcosim.plots.sweep import sweep_chart

    _tell_units(result, axes)
    chart = partial(sweep_chart, axes=list(axes), shown=show, title=title)
    size = " x ".join(f"{len(values)} {key}" for key, values in axes.items())
    drawn = show is None or show in result.data_vars
    keep(result, out, size, plot if drawn else None, chart)
    if not drawn:
        known = ", ".join(map(str, result.data_vars))
        raise UsageError(f"--show {show}: must be one of {known}; the result is in {out}")


def _gives_results(command: str) -> bool:
    """Whether a command writes a file of results."""
    out = options_of(command).get("out")
    return command != "sweep" and out is not None and (out.help or "").startswith("Result")


def _axes(command: str, texts: Sequence[str], known: Set[str]) -> dict[str, list[Value]]:
    """Values by key, from KEY=VALUES; keys are known, or numbers of vehicle and track."""
    axes: dict[str, list[Value]] = {}
    numbers = "set" in options_of(command)
    for text in texts:
        key, equals, values = (part.strip() for part in text.partition("="))
        if not equals or not values:
            raise UsageError(f"--set {text}: must be KEY= and {FORM}")
        if key not in known and not ("." in key and numbers):
            raise UsageError(
                f"--set {text}: {command} has no option --{key}, nor such a number, and none of "
                f"its options says {{{key}}}"
            )
        if key in axes:
            raise UsageError(f"--set {text}: {key} is given twice; give all its values at once")
        axes[key] = _values(text, values)
    return axes


def _tell_units(swept: xr.Dataset, axes: Iterable[str]) -> None:
    """Units of axes that are numbers of the built-in vehicle or track; of others none is known."""
    from railcosim.parameters.change import keys_of, unit_of
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle

    for parameters in (Vehicle(), Track()):
        for key in {*axes} & {*keys_of(parameters)}:
            if unit := unit_of(parameters, key):
                swept[key].attrs["units"] = unit


def _value(word: str) -> Value:
    """A number, or a word as it is written."""
    try:
        return float(word)
    except ValueError:
        return word


def _values(text: str, values: str) -> list[Value]:
    import numpy as np

    parts = values.removesuffix("@log").split(":")
    if len(parts) == 1 or isinstance(_value(parts[0]), str) or "," in values:  # hertz:1e9
        return [_value(one.strip()) for one in values.split(",")]
    try:
        start, stop = float(parts[0]), float(parts[1])
        count = int(parts[2])
    except (ValueError, IndexError) as error:
        raise UsageError(f"--set {text}: must be KEY= and {FORM}") from error
    log = values.endswith("@log")
    if len(parts) != 3 or not 2 <= count <= MOST or (log and min(start, stop) <= 0):
        raise UsageError(
            f"--set {text}: N must be from 2 to {MOST}, and both ends > 0 with @log; {FORM}"
        )
    spaced = np.geomspace(start, stop, count) if log else np.linspace(start, stop, count)
    return [float(x) for x in spaced]


def _check(command: str, arguments: list[str]) -> None:
    """Refuse now what no point would take."""
    for option in ("--out", "--plot"):
        if option in arguments:
            raise UsageError(f"{option}: is the sweep's, and given to it once")
    loaded(command).make_context(command, [*arguments, "--out", "result.nc"])
