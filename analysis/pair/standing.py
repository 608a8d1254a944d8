"""Where wheelsets are to stand, and how FMUs are told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias, TypedDict

from railcosim.master.component import FloatArray, Variable
from railcosim.master.fmi.description import describe_file
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout
from railcosim.parameters import ArgumentError

from .numbering import START_POSITION, Vehicles, files_of, through

FARTHEST = 1e6  # m; from there a place on the ring is known to 1e-10 m
POSITIONS = frozenset(Layout(MOST_WHEELSETS).of_axles("position"))


Position: TypeAlias = float | Sequence[float] | None
"""Where the last wheelset stands, of several vehicles that of each, m; None: as the FMU has it."""


class Standing(TypedDict, total=False):
    """What of `railcosim.master.linear.linear_fmu.Wanted` says so."""

    at: dict[str, float]
    parameters: dict[str, float]


def each_position(vehicle: Vehicles, position: Position) -> list[tuple[Path, float | None]]:
    """The FMUs of vehicles from the front, and where the last wheelset of each stands.

    Raises
    ------
    ArgumentError
        If there are not as many positions as vehicles.
    """
    files = files_of(vehicle)
    each: Sequence[float | None]
    if position is None:
        each = [None] * len(files)
    else:
        each = [position] if isinstance(position, float | int) else position
    if len(each) != len(files):
        told = ",".join(f"{x:g}" for x in each if x is not None)
        raise ArgumentError(
            "position", told, f"must be one of each of {len(files)} vehicles, with commas"
        )
    return list(zip(files, each, strict=True))


def start_positions(vehicle: Vehicles, position: Position) -> dict[str, float]:
    """Parameters of a pair whose vehicles stand so; see `standing`."""
    each = each_position(vehicle, position)
    starts = [standing(file, x).get("parameters", {}) for file, x in each]
    if len(each) == 1:
        return starts[0]
    return {
        through(name, number, 0): x
        for number, own in enumerate(starts, start=1)
        for name, x in own.items()
    }


def track_at(places: FloatArray, layout: Layout, inputs: Sequence[Variable]) -> dict[str, float]:
    """Inputs of a track under wheelsets at places (m); others' tracks may know one place only."""
    known = {v.name for v in inputs}
    at = zip(layout.of_axles("position"), places.tolist(), strict=True)
    return {name: x for name, x in at if name in known}


def standing(fmu: Path, position: float | None) -> Standing:
    """Inputs or a parameter of an FMU for which its last wheelset stands at a position.

    Parameters
    ----------
    fmu : Path
        Of a track, whose wheelsets keep their distances, or of a vehicle.
    position : float or None
        m; None leaves all as the FMU has it.

    Raises
    ------
    ArgumentError
        If the position is no number, or too far, or the FMU knows of no wheelsets.
    """
    if position is None:
        return {}
    if not abs(position) <= FARTHEST:
        raise ArgumentError("position", position, f"must be from -{FARTHEST:g} to {FARTHEST:g} m")
    about = describe_file(fmu)
    if START_POSITION in about.parameters:
        return {"parameters": {START_POSITION: position}}
    starts = {v.name: v.start for v in about.inputs if v.name in POSITIONS}
    if not starts:
        raise ArgumentError(
            "position", position,
            f"{fmu} has no input wheelset[1].position and no parameter {START_POSITION}, so "
            "nothing of it stands elsewhere; leave the option out",
        )  # fmt: skip
    last = min(starts.values())
    return {"at": {name: start - last + position for name, start in starts.items()}}
