"""What an FMU file can be in a pair, told from its description before anything is made or run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from railcosim.analysis.pair.owner import Owner
from railcosim.master.component import Variable
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import describe_file
from railcosim.mechanics.ports import FORCE, RAIL, SIDES, Port, Y, wheelset_name

from .numbering import Vehicles, files_of

FIRST = Port(1, SIDES[0])
SIGNS = {
    Owner.VEHICLE: f"{wheelset_name(FIRST.wheelset)}.position",
    Owner.TRACK: FIRST.name(RAIL.motion),
}
"""The output by which a vehicle, and a track, is known."""


def is_of_a_pair(outputs: Iterable[Variable]) -> bool:
    """Whether these are outputs of a vehicle or a track."""
    return not {variable.name for variable in outputs}.isdisjoint(SIGNS.values())


def owns_contact(path: Path, role: Owner) -> bool:
    """Whether an FMU owns the contact springs.

    Parameters
    ----------
    path : Path
        The file.
    role : Owner
        VEHICLE or TRACK: what it is given as.

    Raises
    ------
    FmuError
        If it is not an FMU.
    CouplingError
        If it cannot be what it is given as.
    """
    outputs = _outputs(path)
    if SIGNS[role] not in outputs:
        found = [other.value for other, sign in SIGNS.items() if sign in outputs]
        known = f"it is a {found[0]}" if found else f"it has no output {SIGNS[role]}"
        raise CouplingError(f"{path}: cannot be the {role}: {known}")
    return FIRST.name(FORCE) in outputs


def owners(vehicle: Vehicles | None, track: Path | None) -> tuple[Owner, ...]:
    """Who may own the contact springs of FMU files, where None stands for one of ours.

    Raises
    ------
    CouplingError
        If both own them, some vehicles do and others do not, or a file cannot be what it is given
        as.
    """
    cars = () if vehicle is None else files_of(vehicle)
    given = {Owner.VEHICLE: cars, Owner.TRACK: () if track is None else (track,)}
    owning = {}
    for role, paths in given.items():
        found = {path: owns_contact(path, role) for path in paths}
        if len(set(found.values())) > 1:
            one, *_, other = sorted(found, key=lambda path: not found[path])
            raise CouplingError(
                f"{one} owns the contact springs and {other} does not: of vehicles on one "
                "track, all do or none"
            )
        if found:
            owning[role] = any(found.values())
    having = [role for role, owns in owning.items() if owns]
    if len(having) > 1:
        raise CouplingError(f"{cars[0]} and {track} both own the contact springs; give one without")
    return tuple(having) or tuple(role for role in Owner if role not in owning)


def moves_aside(track: Path | None) -> bool:
    """Whether rails of a track FMU move to the side, too; None stands for one of ours.

    Raises
    ------
    FmuError
        If it is not an FMU.
    """
    across = Port(FIRST.wheelset, FIRST.side, Y).name(RAIL.motion)
    return track is not None and across in _outputs(track)


def _outputs(path: Path) -> set[str]:
    """Names of the outputs of an FMU."""
    return {variable.name for variable in describe_file(path).outputs}
