"""Tracks of several kinds, one behind the other, the first and the last without end.

Each kind is cells that are equal; what two of them are to each other where they meet is known by
the stiffness of their ends. A half track without end has one of d x d, found by doubling (`waves`),
a stretch of n cells one of 2 d x 2 d, by joining halves. So a line has as few unknowns as it has
places: ends of stretches and of cells where something acts or is seen. Exact: the finite elements
of each kind as they stand, and no end that reflects but the joint itself.

At a joint the rail goes through, and layers that lie along it, if there are as many on either side;
slabs end there.

References
----------
Mead, D. J. (1973), A general theory of harmonic wave propagation in linear periodic systems with
multiple coupling, J. Sound Vib. 27(2), 235-260.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .cell import Cell, build_cell
from .condensation import CondensedCell, condense
from .parameters import Track
from .receptance import Point, Progress, of_parities, shortest
from .section import VERTICAL, section_of
from .waves import half_tracks

WHOLE = 1e-6  # of a cell: how far a length may be from whole ones
Indices = NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class Line:
    """Kinds of track along a line.

    Attributes
    ----------
    tracks : tuple of Track
        From behind to ahead; nothing is asked of the cells of their rings.
    joints : tuple of float
        Where each ends and the next one begins, m; rising.
    names : tuple of str
        What people call them.

    Raises
    ------
    ParameterError
        If a stretch between two joints is not of whole cells, or rails meet their slabs tilted.
    """

    tracks: tuple[Track, ...]
    joints: tuple[float, ...]
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Take the shortest cells, and see that stretches are whole ones."""
        if len(self.tracks) != len(self.joints) + 1 or not self.joints:
            raise ValueError("a joint between each track and the next")
        object.__setattr__(self, "tracks", tuple(shortest(track) for track in self.tracks))
        object.__setattr__(self, "names", self.names or tuple(t.called for t in self.tracks))
        for name, track in zip(self.names, self.tracks, strict=True):
            if track.rails_tilt:
                raise ParameterError(
                    f"{name}: tracks are joined in the vertical model only, with [slab] "
                    "tilts_rails = false"
                )
        between = zip(self.names[1:], self.tracks[1:], self.joints, self.joints[1:], strict=False)
        for name, track, begin, end in between:
            cell, length = track.cell_length, end - begin
            cells = round(length / cell)
            if cells < 1 or abs(length / cell - cells) > WHOLE:
                raise ParameterError(
                    f"{name} from {begin:g} to {end:g} m: must be whole cells of {cell:g} "
                    f"m; let it end at {begin + max(cells, 1) * cell:.10g} m"
                )

    def begins(self, section: int) -> float:
        """Where cells of a section are counted from, m; of the first one where it ends."""
        return self.joints[max(section - 1, 0)]

    def section(self, x: float) -> int:
        """In which a place is; a joint is of what is ahead."""
        return int(np.searchsorted(self.joints, x, side="right"))

    def cell(self, point: Point) -> tuple[int, int]:
        """Section of a point, and its cell there."""
        section = self.section(point.x)
        return section, int((point.x - self.begins(section)) // self.tracks[section].cell_length)

    def within(self, point: Point) -> Point:
        """A point as its own section counts."""
        return replace(point, x=point.x - self.begins(self.section(point.x)))


def line_receptance(
    line: Line,
    omega: FloatArray,
    loads: Sequence[Point],
    observed: Sequence[Point],
    progress: Progress | None = None,
    *,
    viscous: bool = False,
) -> ComplexArray:
    """Receptance between points along a line of several tracks, on either side of the joints.

    Parameters
    ----------
    line : Line
        The tracks.
    omega : array, shape (n_omega,)
        Frequencies, rad/s; zero is the static flexibility.
    loads, observed : sequence of Point
        Vertical; x along the line.
    progress : callable, optional
        Called with (done, total).
    viscous : bool
        Loss factors as viscous damping, as the time domain has them.

    Returns
    -------
    array, shape (n_omega, n_observed, n_loads)
        m/N.

    Raises
    ------
    ParameterError
        If a point is not vertical.
    """
    points = [*loads, *observed]
    for point in points:
        if point.direction is not Z:
            raise ParameterError(
                f"{point.direction.name} at {point.x:g} m: tracks are joined in the vertical model "
                "only"
            )
    nodes = [
        np.array([
            line.within(p).x % track.cell_length
            for p in points if p.on_rail and line.section(p.x) == s
        ])
        for s, track in enumerate(line.tracks)
    ]  # fmt: skip

    def solver(parity: int) -> _Solver:
        cells = [
            build_cell(track, parity, at) for track, at in zip(line.tracks, nodes, strict=True)
        ]
        return _Solver(line, [cell.made_viscous() for cell in cells] if viscous else cells)

    return of_parities(
        [VERTICAL], lambda parity, _: solver(parity), omega, loads, observed, progress
    )


@dataclass(frozen=True)
class _Solver:
    """One parity of a line."""

    line: Line
    cells: Sequence[Cell]

    def __call__(
        self, omega: FloatArray, loads: Sequence[Point], observed: Sequence[Point]
    ) -> ComplexArray:
        """Receptance, (n_omega, n_observed, n_loads)."""
        places = [[self.line.cell(p) for p in points] for points in (loads, observed)]
        condensed = [
            condense(cell, omega, self._rows(loads, s).T, self._rows(observed, s).T)
            for s, cell in enumerate(self.cells)
        ]
        ends = _Ends.of(self.line, self.cells, sorted({*places[0], *places[1]}))
        K = ends.stiffness(condensed)
        forces = np.zeros((omega.size, K.shape[1], len(loads)), complex)
        for k, (section, cell) in enumerate(places[0]):
            forces[:, ends.of_cell(section, cell), k] = condensed[section].forces[:, :, k]
        moved = np.linalg.solve(K, forces)
        out = np.empty((omega.size, len(observed), len(loads)), complex)
        for k, (section, cell) in enumerate(places[1]):
            row = condensed[section].motions[:, [k]]
            out[:, k] = (row @ moved[:, ends.of_cell(section, cell)])[:, 0]
            same = np.array([place == (section, cell) for place in places[0]])
            out[:, k, same] += condensed[section].within[:, k, same]
        return out

    def _rows(self, points: Sequence[Point], section: int) -> FloatArray:
        """Participation in the unknowns of a section's cell; of others' points none."""
        cell = self.cells[section]
        none = np.zeros(cell.K.shape[0])
        return np.array([
            self.line.within(p).row(cell) if self.line.section(p.x) == section else none
            for p in points
        ])  # fmt: skip


@dataclass(frozen=True)
class _Ends:
    """Unknowns of the ends of cells that are kept.

    Attributes
    ----------
    at : tuple of dict
        Of each section, by the number of an end (the end before cell 0 is 0): its unknowns.
    """

    at: tuple[dict[int, Indices], ...]

    @classmethod
    def of(cls, line: Line, cells: Sequence[Cell], places: Sequence[tuple[int, int]]) -> _Ends:
        """Those of cells at places, and of the joints, where the rails' unknowns are one."""
        kept: list[dict[int, Indices]] = []
        count, joint = 0, np.empty(0, int)
        for s, cell in enumerate(cells):
            first, last = 0, 0
            if 0 < s < len(cells) - 1:
                last = round((line.joints[s] - line.joints[s - 1]) / cell.track.cell_length)
            numbers = {end for t, c in places if t == s for end in (c, c + 1)} | {first, last}
            own: dict[int, Indices] = {}
            for end in sorted(numbers):
                shared = joint if end == first else np.empty(0, int)
                fresh = np.arange(count, count + cell.section.size - shared.size)
                count += fresh.size
                own[end] = np.concatenate([shared, fresh])
            ahead = cells[min(s + 1, len(cells) - 1)]
            alike = ahead.section.unknowns == cell.section.unknowns
            joint = own[last] if alike else own[last][: section_of(cell.track.rail, VERTICAL).size]
            kept.append(own)
        return cls(tuple(kept))

    def of_cell(self, section: int, cell: int) -> Indices:
        """Unknowns of both ends of a cell."""
        return np.concatenate([self.at[section][cell], self.at[section][cell + 1]])

    def stiffness(self, condensed: Sequence[CondensedCell]) -> ComplexArray:
        """Of all, with the half tracks at both ends, (n_omega, n, n)."""
        size = 1 + max(int(own.max()) for ends in self.at for own in ends.values())
        K = np.zeros((len(condensed[0].stiffness), size, size), complex)

        def add(unknowns: Indices, own: ComplexArray) -> None:
            K[:, unknowns[:, None], unknowns] += own

        for ends, cell in zip(self.at, condensed, strict=True):
            numbers = list(ends)
            for begin, end in pairwise(numbers):
                stretch = stretch_of(cell.stiffness, end - begin)
                add(np.concatenate([ends[begin], ends[end]]), stretch)
        add(self.at[0][min(self.at[0])], half_tracks(condensed[0].stiffness)[1])
        add(self.at[-1][max(self.at[-1])], half_tracks(condensed[-1].stiffness)[0])
        return K


def stretch_of(cell: ComplexArray, count: int) -> ComplexArray:
    """Stiffness of so many equal cells between their ends, (n_omega, 2 d, 2 d)."""
    stretch = cell
    for bit in f"{count:b}"[1:]:
        stretch = _joined(stretch, stretch)
        if bit == "1":
            stretch = _joined(stretch, cell)
    return stretch


def _joined(one: ComplexArray, other: ComplexArray) -> ComplexArray:
    """Two stretches, one behind the other, without their common end."""
    d = one.shape[1] // 2
    first, last = slice(d), slice(d, None)
    inner = np.linalg.inv(one[:, last, last] + other[:, first, first])
    past, back = one[:, first, last] @ inner, other[:, last, first] @ inner
    return np.block([
        [one[:, first, first] - past @ one[:, last, first], -past @ other[:, first, last]],
        [-back @ one[:, last, first], other[:, last, last] - back @ other[:, first, last]],
    ])  # fmt: skip
