"""What a sensor sees, as rows: of modes of the ring, and of the finite elements at rest.

A row that modes show is also a load: what a force at a wheel does to it is, by Betti's law, how
much such a load moves the rail under the wheel.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Y, Z

from .cell import Cell
from .rail import section_matrices
from .ring import RingModes
from .section import Beam
from .sensors import LEFT, Place
from .stack import stack_of

Weights = tuple[float, float, float]
"""Of a quantity, its rate and its acceleration."""
VALUE: Weights = (1.0, 0.0, 0.0)
ASIDE = 1e-8  # m: which of the elements at a node; far below what is one node


class At(Protocol):
    """A row of the unknowns of a cell at a place along the track."""

    @property
    def x(self) -> float:
        """Along the track, m."""

    @property
    def direction(self) -> Direction:
        """Of what it is."""

    @property
    def on_rail(self) -> bool:
        """Whether a rail has a node there."""

    def row(self, cell: Cell) -> FloatArray:
        """Shape (n,)."""


class Row(Protocol):
    """What is seen at a place."""

    @property
    def place(self) -> Place:
        """Where."""

    @property
    def direction(self) -> Direction:
        """Of the mirror between the rails, as a motion in it."""

    def parts(self, cell: Cell) -> Sequence[tuple[Weights, FloatArray]]:
        """In the first cell, in elements that move: rows, of their rates and accelerations, too."""

    def behind_and_ahead(self, length: float) -> tuple[At, At]:
        """The row in elements, for forces behind the place and for those ahead of it, at rest.

        Parameters
        ----------
        length : float
            Of a cell, m.
        """


def _sign(cell: Cell, side: str, direction: Direction) -> float:
    """Of what is on a side to the right one, in a cell that is one of the right."""
    return float(cell.left(direction)) if side == LEFT else 1.0


class _InElements(ABC):
    """A row that is the same whether elements move or rest, and by forces on either side of it."""

    place: Place

    def parts(self, cell: Cell) -> Sequence[tuple[Weights, FloatArray]]:
        """See `Row`."""
        return [(VALUE, self.at(cell.track.cell_length).row(cell))]

    def behind_and_ahead(self, length: float) -> tuple[At, At]:
        """See `Row`."""
        return self.at(length), self.at(length)

    @abstractmethod
    def at(self, length: float) -> At:
        """In elements, of cells of a length."""


@dataclass(frozen=True, kw_only=True)
class Motion(_InElements):
    """Of the head of a rail, of a slab, of a layer; or between two that springs join.

    Attributes
    ----------
    body : int
        From the top: 0 the rail, then layers, then the slab.
    y : float
        From the track's middle, m; of slabs and sleepers.
    stretch : bool
        How much it comes nearer to what is below it, all springs of a railseat together.
    """

    place: Place
    side: str
    direction: Direction
    body: int = 0
    y: float = 0.0
    stretch: bool = False

    def at(self, length: float) -> MotionAt:
        """In elements, of cells of a length."""
        return MotionAt(self, self.place.cell * length + self.place.inside)


@dataclass(frozen=True)
class MotionAt:
    """A motion at a place."""

    motion: Motion
    x: float

    @property
    def direction(self) -> Direction:
        """See `At`."""
        return self.motion.direction

    @property
    def on_rail(self) -> bool:
        """See `At`."""
        return self.motion.body == 0 and not self.motion.stretch

    def row(self, cell: Cell) -> FloatArray:
        """See `At`."""
        of, inside = self.motion, self.motion.place.inside
        sign = _sign(cell, of.side, of.direction)
        if self.on_rail:
            return sign * cell.rail_row(inside, of.direction)
        stack = stack_of(cell.track, cell.parity, cell.section, cell.nodes, cell.slab)
        if not of.stretch:
            point = np.array([inside]), np.array([of.y])
            row: FloatArray = stack.bodies[of.body].rows(of.direction, *point)[0]
            return sign * row
        joint = list(stack.joints((of.direction,)))[of.body]
        here, weight = np.abs(joint.points.x - inside) < ASIDE, joint.points.weight
        if joint.points.all_along:
            point = np.array([inside]), np.array([of.y])
            bodies = joint.upper, joint.lower
            one, other = (body.rows(of.direction, *point)[0] for body in bodies)
            between: FloatArray = sign * (one - other)
            return between
        # Springs of a railseat are given by parts: each the square of what it is stretched by.
        stretched: FloatArray = sign * (np.sqrt(weight[here]) @ joint.stretch(of.direction)[here])
        return stretched


@dataclass(frozen=True, kw_only=True)
class RailMoment:
    """Bending moment of a rail; positive with tension below (down), on the right (to the right).

    Between the ends of an element it follows from their moments and the element's inertia.
    """

    place: Place
    side: str
    direction: Direction

    @property
    def unknown(self) -> str:
        """The rotation whose change along the rail it is."""
        return {Z: "theta", Y: "psi"}[self.direction]

    def parts(self, cell: Cell) -> Sequence[tuple[Weights, FloatArray]]:
        """See `Row`: an element's ends feel its stiffness and its inertia."""
        track, row, inert = cell.track, np.zeros(cell.K.shape[0]), np.zeros(cell.K.shape[0])
        loss = track.rail.loss_factor / (2 * np.pi * track.mesh.loss_factor_frequency)
        member = member_of(cell, self.unknown)
        if member is not None:
            nodes, d, inside = cell.nodes, cell.section.size, self.place.inside
            e = int(np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, nodes.size - 2))
            L = nodes[e + 1] - nodes[e]
            xi = (inside - nodes[e]) / L
            M, K = (A[0] for A in section_matrices(cell.section, np.array([L])))
            beam = cell.section.members[member]
            own = cell.section.element_unknowns(member)
            bow = np.zeros(2 * d)
            bow[own] = beam.inertias[0] * np.array([0.5, 0, 0.5, 0])
            bow[own] -= beam.inertias[1] * np.array([0, -1, 0, 1]) / L
            # EI theta', with its ends as the element's equations of motion have them.
            ends = [-(1 - xi) * A[own[1]] + xi * A[own[3]] for A in (K, M)]
            sign = -_sign(cell, self.side, self.direction)
            row[e * d : (e + 2) * d] = sign * ends[0]
            inert[e * d : (e + 2) * d] = sign * (ends[1] + 0.5 * L**2 * xi * (1 - xi) * bow)
        return [((1.0, loss, 0.0), row), ((0.0, 0.0, 1.0), inert)]

    def behind_and_ahead(self, length: float) -> tuple[RailMomentAt, RailMomentAt]:
        """See `Row`: a force in an element bends it otherwise than its ends tell."""
        x = self.place.cell * length + self.place.inside
        return RailMomentAt(self, x + ASIDE, ahead=True), RailMomentAt(self, x - ASIDE, ahead=False)


@dataclass(frozen=True)
class RailMomentAt:
    """A bending moment at a node, at rest, from the element ahead or behind."""

    moment: RailMoment
    x: float
    ahead: bool
    on_rail: bool = True

    @property
    def direction(self) -> Direction:
        """See `At`."""
        return self.moment.direction

    def row(self, cell: Cell) -> FloatArray:
        """See `At`."""
        row, d = np.zeros(cell.K.shape[0]), cell.section.size
        member = member_of(cell, self.moment.unknown)
        if member is None:
            return row
        inside = self.x % cell.track.cell_length
        node = int(np.argmin(np.abs(cell.nodes - inside)))
        e = node if self.ahead else node - 1
        _, K = section_matrices(cell.section, np.diff(cell.nodes[e : e + 2]))
        own = cell.section.element_unknowns(member)
        end = K[0][own[1]] if self.ahead else -K[0][own[3]]
        row[e * d : (e + 2) * d] = end
        return row * _sign(cell, self.moment.side, self.direction)


@dataclass(frozen=True, kw_only=True)
class SlabMoment(_InElements):
    """Bending moment of a slab along the track, a metre of its width; positive: tension below."""

    place: Place
    side: str
    y: float
    direction: Direction = Z

    def at(self, length: float) -> SlabMomentAt:
        """In elements, of cells of a length."""
        return SlabMomentAt(self, self.place.cell * length + self.place.inside)


@dataclass(frozen=True)
class SlabMomentAt:
    """The same at a place."""

    moment: SlabMoment
    x: float
    on_rail: bool = False

    @property
    def direction(self) -> Direction:
        """See `At`."""
        return self.moment.direction

    def row(self, cell: Cell) -> FloatArray:
        """See `At`."""
        row, slab = np.zeros(cell.K.shape[0]), cell.slab
        if slab is None or not slab.plate.omega.size:
            return row
        of, track = self.moment, cell.track
        x, y = np.array([of.place.inside - track.cell_length / 2]), np.array([of.y])
        along, across = slab.plate.curvatures(x, y)
        bent = -track.slab.bending_stiffness * (along + track.slab.poisson_ratio * across)
        first = row.size - slab.size
        row[first : first + slab.plate.omega.size] = bent[0]
        return row * _sign(cell, of.side, self.direction)


def member_of(cell: Cell, unknown: str) -> int | None:
    """Which member of the section turns by an unknown; None if none does."""
    for i, member in enumerate(cell.section.members):
        if isinstance(member, Beam) and member.unknowns[1] == unknown:
            return i
    return None


@dataclass(frozen=True)
class PartAt:
    """One part of a row, in elements that move."""

    of: Row
    part: int
    x: float
    on_rail: bool = False

    @property
    def direction(self) -> Direction:
        """See `At`."""
        return self.of.direction

    def row(self, cell: Cell) -> FloatArray:
        """See `At`."""
        return self.of.parts(cell)[self.part][1]


def weighed(weights: Weights, s: ComplexArray) -> ComplexArray:
    """What stands before a row whose motion is exp(s t)."""
    return weights[0] + s * (weights[1] + s * weights[2])


def shown_by(rows: Sequence[Row], cell: Cell, ring: RingModes) -> ComplexArray:
    """Rows by modes of a cell's parity, shape (n_rows, n), in the signs of `ReducedTrack.table`."""
    found = [
        sum(weighed(w, ring.poles) * (cell.parity * part @ ring.shapes)
            for w, part in row.parts(cell))
        * np.exp(1j * ring.mu * row.place.cell)
        for row in rows
    ]  # fmt: skip
    return np.array(found).reshape(len(rows), ring.poles.size).astype(complex)
