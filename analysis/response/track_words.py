"""What people call places, directions, single changes and kinds of a track, and what is meant."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from railcosim.analysis.pair.standing import FARTHEST
from railcosim.mechanics.ports import Direction
from railcosim.parameters import ArgumentError
from railcosim.track.cell import railseats
from railcosim.track.files import read_track
from railcosim.track.layers import MASS
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.track.section import SPATIAL
from railcosim.track.transition import Line

WIDEST_GAP = 0.1  # m


def place_of(track: Track, position: str | float) -> float:
    """A position as m along the track, from where a cell begins; ArgumentError if it is none."""
    seat = float(railseats(track)[track.bays // 2])
    named = {"railseat": seat, "midspan": seat + track.fastening.spacing / 2}
    if position in named:
        return named[str(position)]
    try:
        x = float(position)
    except ValueError:
        x = np.nan
    if not abs(x) <= FARTHEST:
        raise ArgumentError(
            "position", position,
            f"must be railseat, midspan, or from -{FARTHEST:g} to {FARTHEST:g} m",
        )  # fmt: skip
    return x


def direction_of(option: str, name: str) -> Direction:
    """A direction by its name; ArgumentError if the track does not move in such a one."""
    known = {direction.name: direction for direction in SPATIAL}
    if name not in known:
        raise ArgumentError(option, name, f"must be one of {', '.join(known)}")
    return known[name]


def line_of(track: Track, name: str, then: Sequence[str]) -> Line:
    """A track of some name, and others behind each other as ``TRACK@PLACE``: a file or name, m.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    tracks, names = [track], [name]
    joints: list[float] = []
    for text in then:
        source, _, place = text.rpartition("@")
        try:
            joint = float(place)
        except ValueError:
            joint = np.nan
        if not source or not abs(joint) <= FARTHEST or (joints and joint <= joints[-1]):
            raise ArgumentError(
                "then", text,
                f"must be TRACK@PLACE, such as ballasted@0, from -{FARTHEST:g} to {FARTHEST:g} m "
                "along the track and farther than the one before",
            )  # fmt: skip
        tracks.append(read_track(source))
        names.append(source)
        joints.append(joint)
    return Line(tracks=tuple(tracks), joints=tuple(joints), names=tuple(names))


def change_of(track: Track, text: str) -> LocalChange:
    """Read ``WHAT[.left|.right]@PLACE=VALUE`` or ``=gap:METRES``; see `LocalChange`.

    A place is in m along the track, as the load's position is, or ``railseat`` or ``midspan``, with
    ``+2`` or ``-1`` so many bays further.

    Raises
    ------
    ArgumentError
        If it cannot be read.
    """
    found = re.fullmatch(
        r"(?P<what>\w+)(\.(?P<side>left|right))?@(?P<name>railseat|midspan)?(?P<x>[^=]*)"
        r"=(?P<gap>gap:)?(?P<value>[^=]+)", text
    )  # fmt: skip
    try:
        if found is None:
            raise ValueError
        value = float(found["value"])
        if found["name"]:
            bays = int(found["x"] or 0)
            x = place_of(track, found["name"]) + bays * track.fastening.spacing
        else:
            x = float(found["x"])
    except ValueError as error:
        raise ArgumentError(
            "local", text,
            "must be WHAT@PLACE=VALUE, such as fastening.left@railseat+1=0, mass@1.2=15 or "
            "sleeper@railseat=gap:1e-3",
        ) from error  # fmt: skip
    if not (abs(x) <= FARTHEST and np.isfinite(value)):
        raise ArgumentError("local", text, f"must be finite, and at most {FARTHEST:g} m away")
    sides = {"left": (-1,), "right": (1,)}.get(found["side"], (-1, 1))
    if not found["gap"]:
        return LocalChange(what=found["what"], x=x, value=value, sides=sides)
    if not 0 <= value <= WIDEST_GAP or found["what"] == MASS:
        raise ArgumentError(
            "local", text, f"must be a gap of 0 to {WIDEST_GAP:g} m, of a fastening or a layer"
        )
    return LocalChange(what=found["what"], x=x, value=1.0, sides=sides, gap=value)
