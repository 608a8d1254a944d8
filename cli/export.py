"""railcosim export."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import StrEnum
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .fmus import tell_of_losses
from .option_types import DimensionName, LocalOption, ThenOption
from .options import UsageError
from .parameter_options import changes_at
from .progress import status
from .results import folder_of
from .sensor_options import ObservedPair
from .terminal import console, errors

if TYPE_CHECKING:
    from railcosim.fmus.export import Runtime
    from railcosim.track.closed_line import ClosedLine
    from railcosim.track.local import LocalChange
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle
    from railcosim.vehicle.train import Train


APART = 2.5  # m, as the axles of a bogie


class RuntimeName(StrEnum):
    """How runtimes are spelt."""

    NATIVE = "native"
    PYTHON = "python"


def export(
    *,
    out: Annotated[Path, typer.Option("--out", help="Folder for the FMUs.", metavar="DIR")],
    given: ObservedPair,
    runtime: Annotated[
        RuntimeName,
        typer.Option("--runtime", help="native: needs nothing where imported. python: numpy."),
    ] = RuntimeName.NATIVE,
    fmi: Annotated[int, typer.Option("--fmi", help="Version of FMI: 2 or 3.")] = 2,
    model_exchange: Annotated[
        bool,
        typer.Option(
            "--model-exchange",
            help="Track.fmu for Model Exchange as well, which frf and others linearise exactly: "
            "12,000 variables, slow to load elsewhere. Vehicle.fmu always is, and so is FMI 3.",
        ),
    ] = False,
    platforms: Annotated[
        str | None,
        typer.Option(
            "--platforms",
            help="What to compile for: all, or a list such as linux64,win64 (others than this "
            "machine need railcosim[native] or --config-settings platforms=all when installed). "
            "This machine if not given.",
            metavar="LIST",
        ),
    ] = None,
    wheelsets: Annotated[
        int | None,
        typer.Option(
            "--wheelsets",
            help="Tracks only, under so many wheelsets of a vehicle of yours. Static loads and "
            "contact are those of --vehicle.",
        ),
    ] = None,
    positions: Annotated[
        str | None,
        typer.Option(
            "--positions",
            help=f"Where they stand at first, m, from the front, such as 18.5,16,2.8,0.3. If not "
            f"given, {APART:g} m apart.",
            metavar="LIST",
        ),
    ] = None,
    one_rail: Annotated[
        bool, typer.Option("--one-rail", help="With --wheelsets: only the left rail is loaded.")
    ] = False,
    dimension: Annotated[
        DimensionName,
        typer.Option(
            "--dimension",
            help="In spatial FMUs wheels and rails move aside and turn as well, and contacts "
            "inside roll.",
        ),
    ] = DimensionName.VERTICAL,
    local: LocalOption = None,
    then: ThenOption = None,
    separate: Annotated[
        bool,
        typer.Option(
            "--separate",
            help="Each vehicle of a train as FMUs of its own, Vehicle1 and so on, which only the "
            "track joins.",
        ),
    ] = False,
) -> None:
    """Write Vehicle, Track, VehicleWithContact, TrackWithContact as FMUs, and Pair.ssp."""
    from railcosim.analysis.pair.export_pair import PAIR

    chosen = runtime_of(runtime, fmi, platforms, model_exchange=model_exchange)
    if wheelsets is None and (positions is not None or one_rail):
        raise UsageError("--positions and --one-rail: need --wheelsets, how many there are")
    if wheelsets is not None and separate:
        raise UsageError("--separate: is of vehicles, and --wheelsets exports tracks only")
    if wheelsets is not None:
        places = positions_of(wheelsets, positions)
        cars, rails = given.stock(), given.rails(places[0] - places[-1])
        folder_of("--out", out)
        files = exported_tracks(
            cars, rails, places, one_rail, out, chosen, dimension=dimension,
            changes=changes_at(rails, local), line=given.line(rails, then),
        )  # fmt: skip
    else:
        cars, rails = given.pair()
        folder_of("--out", out)
        files = exported(
            cars, rails, out, chosen, separate=separate, dimension=dimension,
            changes=changes_at(rails, local), line=given.line(rails, then),
        )  # fmt: skip
    for path in files.values():
        console.print(f"{path}  {path.stat().st_size / 1e6:.1f} MB")
    if wheelsets is None and chosen.fmi == 2 and "TrackWithContact" in files:
        which = "all vehicles" if separate else "Vehicle"
        console.print(f"{out / PAIR}  wires {which} and TrackWithContact")


def positions_of(wheelsets: int, text: str | None) -> list[float]:
    """Positions of wheelsets from the front, m; the last above a railseat if not given.

    Raises
    ------
    UsageError
        Saying what is wrong with them.
    """
    from railcosim.mechanics.ports import MOST_WHEELSETS
    from railcosim.track.parameters import Track

    if not 1 <= wheelsets <= MOST_WHEELSETS:
        raise UsageError(f"--wheelsets {wheelsets}: must be from 1 to {MOST_WHEELSETS}")
    if text is None:
        last = Track().fastening.spacing / 2
        return [last + APART * (wheelsets - i) for i in range(1, wheelsets + 1)]
    try:
        places = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise UsageError(f"--positions {text}: must be numbers in m, with commas") from error
    if len(places) != wheelsets:
        raise UsageError(f"--positions {text}: are {len(places)}, but --wheelsets is {wheelsets}")
    if not all(map(math.isfinite, places)) or any(a <= b for a, b in pairwise(places)):
        raise UsageError(f"--positions {text}: must be from the front, so each less than the last")
    return places


def runtime_of(
    name: RuntimeName, fmi: int, platforms: str | None, *, model_exchange: bool = False
) -> Runtime:
    """The runtime that options ask for."""
    from railcosim.compiling.platforms import platforms_named
    from railcosim.fmus.export import NativeRuntime, PythonRuntime

    if fmi not in {2, 3}:
        raise UsageError(f"--fmi {fmi}: must be 2 or 3")
    if name is RuntimeName.NATIVE:
        chosen = None if platforms is None else platforms_named(platforms)
        return NativeRuntime(fmi=fmi, platforms=chosen, model_exchange=model_exchange)
    if fmi != 2 or platforms is not None or model_exchange:
        raise UsageError("--runtime python: is FMI 2 only, for every platform; leave out the rest")
    return PythonRuntime()


def exported(
    vehicle: Vehicle | Train,
    track: Track,
    out: Path,
    runtime: Runtime,
    *,
    separate: bool = False,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> dict[str, Path]:
    """Export into a folder, with a status line."""
    from railcosim.analysis.pair.export_pair import export_pair

    make = partial(
        export_pair, vehicle, track, out, runtime=runtime, separate=separate, dimension=dimension,
        changes=changes, line=line,
    )  # fmt: skip
    return _told(track, out, runtime, make)


def exported_tracks(
    vehicle: Vehicle | Train,
    track: Track,
    places: list[float],
    one_rail: bool,
    out: Path,
    runtime: Runtime,
    *,
    dimension: str = "vertical",
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> dict[str, Path]:
    """The same of tracks under other wheelsets, with the static load and contact of a vehicle."""
    from railcosim.fmus.export import export_track
    from railcosim.fmus.start import start_of
    from railcosim.mechanics.ports import SIDES

    sides = SIDES[:1] if one_rail else SIDES
    start = start_of(vehicle, places, sides)
    make = partial(
        export_track, track, start, out, sides=sides, dimension=dimension, runtime=runtime,
        changes=changes, line=line,
    )  # fmt: skip
    return _told(track, out, runtime, make)


def _told(
    track: Track,
    out: Path,
    runtime: Runtime,
    make: Callable[[Callable[[str], None]], dict[str, Path]],
) -> dict[str, Path]:
    """Say what is done, and what was there before."""
    from railcosim.storage.archive import digest_of

    tell_of_losses(track)
    before = {path.name: digest_of(path) for path in out.glob("*.fmu")}
    runtime.prepare(errors.print)  # compiling takes some seconds a platform, and says so
    with status("exporting FMUs") as tell:
        files = make(tell)
    written = {path.name: digest_of(path) for path in files.values()}
    if replaced := [n for n, now in written.items() if before.get(n, now) != now]:
        errors.print(f"note: {', '.join(replaced)} in {out}: replaced; they were other FMUs")
    return files
