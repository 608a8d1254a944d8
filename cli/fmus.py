"""FMUs that commands work with: the user's, or ours, made now or before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from railcosim.analysis.pair.owner import Owner

from .options import UsageError
from .progress import status
from .terminal import errors

if TYPE_CHECKING:
    from railcosim.track.closed_line import ClosedLine
    from railcosim.track.local import LocalChange
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle
    from railcosim.vehicle.train import Train

FreshOption = Annotated[
    bool, typer.Option("--fresh", help="Make our FMUs anew, also where they are kept.")
]


@contextmanager
def made(
    vehicle: Vehicle | Train,
    track: Track,
    *,
    dimension: str = "vertical",
    fresh: bool = False,
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> Iterator[dict[str, Path]]:
    """Our four FMUs of these parameters by name, for as long as the block lasts."""
    from railcosim.analysis.pair.kept_fmus import fmus_of_pair

    tell_of_losses(track)
    with ExitStack() as stack:
        with status("exporting FMUs") as tell:
            ours = stack.enter_context(
                fmus_of_pair(
                    vehicle,
                    track,
                    tell,
                    dimension=dimension,
                    fresh=fresh,
                    changes=changes,
                    line=line,
                )
            )
        if ours.kept is not None:
            how = "made before (--fresh makes them anew)" if ours.found else "made now and kept"
            errors.print(f"FMUs: {how} in {ours.kept}")
        yield ours.files


@contextmanager
def fmus_of(
    vehicles: Sequence[Path] | None,
    track: Path | None,
    vehicle_name: str = "Vehicle",
    track_name: str = "Track",
    *,
    stock: Vehicle | Train | None = None,
    rails: Track | None = None,
    dimension: str = "vertical",
    fresh: bool = False,
    changes: Sequence[LocalChange] = (),
    line: ClosedLine | None = None,
) -> Iterator[tuple[tuple[Path, ...], Path]]:
    """FMU files given by the user, of vehicles from the front, or ours of a vehicle and a track.

    Raises
    ------
    FmuError, CouplingError
        At once if a file cannot take the place of ours of that name.
    """
    from railcosim.track.parameters import Track
    from railcosim.vehicle.parameters import Vehicle

    given = tuple(vehicles or ())
    for path in given:
        _check_like(path, Owner.VEHICLE, vehicle_name)
    if track is not None:
        _check_like(track, Owner.TRACK, track_name)
    if given and track is not None:
        yield given, track
        return
    with made(
        stock or Vehicle(), rails or Track(), dimension=dimension, fresh=fresh, changes=changes,
        line=line,
    ) as ours:  # fmt: skip
        for name in (vehicle_name, track_name):
            if name not in ours:
                raise UsageError(
                    f"--contact: there is no {name}.fmu among ours, {dimension}: it must be master"
                )
        yield given or (ours[vehicle_name],), track or ours[track_name]


def _check_like(path: Path, role: Owner, name: str) -> None:
    """Raise UsageError if a file cannot take the place of ours of that name."""
    from railcosim.analysis.pair.roles import owns_contact

    if owns_contact(path, role) != name.endswith("WithContact"):
        is_one = "owns" if name in {"Vehicle", "Track"} else "does not own"
        raise UsageError(f"{path}: {is_one} the contact springs; give one like {name}.fmu")


def tell_of_losses(track: Track) -> None:
    """Announce what the time domain does with loss factors."""
    if track.rail.loss_factor > 0 or track.fastening.loss_factor > 0:
        errors.print(
            "note: loss factors are hysteretic in direct receptances; in the FMUs they are the "
            f"viscous damping equal at {track.mesh.loss_factor_frequency:g} Hz "
            "(mesh.loss_factor_frequency)"
        )
