"""Kinds of track one behind the other, closed to a ring: what a track FMU can have of a line.

The first kind has all cells of its ring, and so has the last one; those between have as many as lie
between their joints. Behind the last kind the first one begins again: a joint that no line has.
Runs keep away from it, as far as waves sent back there are felt (`Decay.echo`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .decay import PROMISED, PROMISED_TO, decay_along
from .parameters import Track
from .transition import WHOLE, Line


@dataclass(frozen=True, kw_only=True)
class ClosedLine:
    """A line on a ring.

    Attributes
    ----------
    line : Line
        Kinds and joints; the first joint is a whole number of cells of the first kind from 0 m.
    tracks : tuple of Track
        The same, all with the highest frequency of the first.
    counts : tuple of int
        Cells of each.

    Raises
    ------
    ParameterError
        If the first joint is not where a cell ends within the ring, kinds do not change, something
        is seen by sensors, or no place is far enough from the joint that closes the ring.
    """

    line: Line
    tracks: tuple[Track, ...] = field(init=False)
    counts: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        """See that it fits."""
        line, (first, *_) = self.line, self.line.tracks
        top = first.mesh.highest_frequency
        tracks = tuple(replace(t, mesh=replace(t.mesh, highest_frequency=top)) for t in line.tracks)
        object.__setattr__(self, "tracks", tracks)
        between = np.diff(line.joints) / [t.cell_length for t in tracks[1:-1]]
        counts = (first.mesh.cells, *np.rint(between).astype(int), tracks[-1].mesh.cells)
        object.__setattr__(self, "counts", tuple(map(int, counts)))
        joint, cell = line.joints[0], first.cell_length
        ahead = round(joint / cell)
        if abs(joint / cell - ahead) > WHOLE or not 0 < ahead <= first.mesh.cells:
            near = min(max(ahead, 1), first.mesh.cells) * cell
            raise ParameterError(
                f"--then {line.names[1]}@{joint:g}: in time a kind begins where a cell of the one "
                f"before ends: must be a multiple of {cell:g} m from {cell:g} to {first.length:g} "
                f"m, the ring of {line.names[0]} ([mesh] cells = {first.mesh.cells}), such as "
                f"{near:.10g}"
            )
        for k, (behind, ahead_) in enumerate(pairwise(tracks)):
            if behind == ahead_:
                raise ParameterError(
                    f"--then {line.names[k + 1]}@{line.joints[k]:g}: is the same kind as before; "
                    "leave it out"
                )
        if seen := next((t.sensor for t in tracks if t.sensor), None):
            raise ParameterError(
                f"sensor {seen[0]}: in time tracks of several kinds have no sensors; leave it out"
            )
        begin, end = self.clear
        if begin >= end:
            raise ParameterError(
                f"rings of {first.length:g} m of {line.names[0]} and {tracks[-1].length:g} m of "
                f"{line.names[-1]}: too short, waves sent back where the ring closes are above "
                f"{PROMISED:.0%} of the rail's receptance everywhere; give [mesh] more cells"
            )

    @property
    def begins(self) -> tuple[float, ...]:
        """Where each stretch begins, m; the first one where the ring is closed."""
        first = self.tracks[0]
        return (self.line.joints[0] - first.length, *self.line.joints)

    @property
    def length(self) -> float:
        """Of the ring, m."""
        return sum(n * t.cell_length for n, t in zip(self.counts, self.tracks, strict=True))

    @property
    def behind_zero(self) -> int:
        """Cells of the first kind behind 0 m."""
        return self.counts[0] - round(self.line.joints[0] / self.tracks[0].cell_length)

    @property
    def clear(self) -> tuple[float, float]:
        """From where to where the ring is a line, within what is promised of rings, m."""
        first, last = self.tracks[0], self.tracks[-1]
        begin = self.begins[0]
        near, far = (decay_along(t).echo(t.length) for t in (first, last))
        return begin + near, begin + self.length - far

    def __str__(self) -> str:
        first, *others = self.line.names
        places = zip(others, self.line.joints, strict=True)
        return ", then ".join([first, *(f"{name} from {x:g} m" for name, x in places)])


def check_places(closed: ClosedLine, positions: Sequence[float]) -> None:
    """Check that wheelsets stand where the ring is a line.

    Raises
    ------
    ParameterError
        Naming where that is.
    """
    begin, end = closed.clear
    if not (begin <= min(positions) and max(positions) <= end):
        raise ParameterError(
            f"wheelsets from {min(positions):g} to {max(positions):g} m: must be from {begin:.1f} "
            f"to {end:.1f} m, or waves sent back where the ring closes would be above "
            f"{PROMISED:.0%} of the rail's receptance to {PROMISED_TO:g} Hz; give [mesh] more cells"
        )


def tabulated(
    closed: ClosedLine, rows: Sequence[int], elements: Sequence[NDArray[np.intp]]
) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
    """How stretches become one table that begins at 0 m.

    Parameters
    ----------
    closed : ClosedLine
        The ring.
    rows : sequence of int
        How many a cell of each stretch has; at its end a stretch has one more.
    elements : sequence of array of int
        Row of a cell at which each of its elements begins.

    Returns
    -------
    order : array of int
        Of the rows of all stretches, one behind the other.
    begins : array of int
        Row in the table at which each element begins.
    stretches : array, shape (s, 2)
        Where elements of one length begin, m, and number of the first.
    """
    counts, behind = closed.counts, closed.behind_zero
    sizes = [n * r + 1 for n, r in zip(counts, rows, strict=True)]
    order = np.roll(np.arange(sum(sizes)), -behind * rows[0])
    parts = [
        (0, counts[0] - behind, 0.0),
        *((i, counts[i], x) for i, x in enumerate(closed.begins) if i),
    ]
    if behind:
        first = closed.tracks[0]
        parts.append((0, behind, closed.length - behind * first.cell_length))
    begins: list[NDArray[np.intp]] = []
    stretches, row = [], 0
    for i, n, x in parts:
        stretches.append((x, sum(own.size for own in begins)))
        begins.append((row + rows[i] * np.arange(n)[:, None] + elements[i]).ravel())
        row += n * rows[i] + 1
    return order, np.concatenate(begins), np.array(stretches)
