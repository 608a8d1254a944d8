"""What a sensor sees, as rows: of modes of the ring, and of the finite elements at rest.

A row that modes show is also a load: what a force at a wheel does to it is, by Betti's law, how
much such a load moves the rail under the wheel.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Y, Z

from .cell import Cell
from .rail import section_matrices
from .ring import RingModes
from .section import Beam
from .sensors import LEFT, Place
from .stack import stack_of

if TYPE_CHECKING:
    from .parameters import Track

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

    def of_modes(self, cell: Cell, ring: RingModes) -> ComplexArray:
        """In the first cell by modes of one parity, (n,), in the signs of `ReducedTrack.table`."""

    def behind_and_ahead(self, length: float) -> tuple[At, At]:
        """The row in elements, for forces behind the place and for those ahead of it, at rest.

        Parameters
        ----------
        length : float
            Of a cell, m.
        """

    def moving(self, track: Track) -> Sequence[tuple[Weights, At]]:
        """The row in elements that move, as a sum of rows, their rates and accelerations."""


def _sign(cell: Cell, side: str, direction: Direction) -> float:
    """Of what is on a side to the right one, in a cell that is one of the right."""
    return float(cell.left(direction)) if side == LEFT else 1.0


class _InElements(ABC):
    """A row that is the same of modes and in elements, and by forces on either side of it."""

    place: Place

    def of_modes(self, cell: Cell, ring: RingModes) -> ComplexArray:
        """See `Row`."""
        row = cell.parity * self.at(cell.track.cell_length).row(cell)
        seen: ComplexArray = row @ ring.shapes
        return seen

    def behind_and_ahead(self, length: float) -> tuple[At, At]:
        """See `Row`."""
        return self.at(length), self.at(length)

    def moving(self, track: Track) -> Sequence[tuple[Weights, At]]:
        """See `Row`."""
        return [(VALUE, self.at(track.cell_length))]

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

    def of_modes(self, cell: Cell, ring: RingModes) -> ComplexArray:
        """See `Row`."""
        member = member_of(cell, self.unknown)
        if member is None:
            return np.zeros(ring.poles.size, dtype=complex)
        nodes, d, inside = cell.nodes, cell.section.size, self.place.inside
        e = int(np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, nodes.size - 2))
        L = nodes[e + 1] - nodes[e]
        xi = (inside - nodes[e]) / L
        M, K = (A[0] for A in section_matrices(cell.section, np.array([L])))
        beam = cell.section.members[member]
        own = cell.section.element_unknowns(member)
        u, pole = ring.shapes[e * d : (e + 2) * d], ring.poles
        mesh, loss = cell.track.mesh, cell.track.rail.loss_factor
        elastic = 1 + pole * loss / (2 * np.pi * mesh.loss_factor_frequency)
        ends = elastic * (K[own[[1, 3]]] @ u) + pole**2 * (M[own[[1, 3]]] @ u)
        w, turn = u[own[[0, 2]]].mean(axis=0), (u[own[3]] - u[own[1]]) / L
        bow = pole**2 * (beam.inertias[0] * w - beam.inertias[1] * turn)
        # EI theta', with its ends as the element's equations of motion have them.
        moment = -(1 - xi) * ends[0] + xi * ends[1] + 0.5 * L**2 * xi * (1 - xi) * bow
        found: ComplexArray = -cell.parity * _sign(cell, self.side, self.direction) * moment
        return found

    def behind_and_ahead(self, length: float) -> tuple[RailMomentAt, RailMomentAt]:
        """See `Row`: a force in an element bends it otherwise than its ends tell."""
        x = self.place.cell * length + self.place.inside
        return RailMomentAt(self, x + ASIDE, ahead=True), RailMomentAt(self, x - ASIDE, ahead=False)

    def moving(self, track: Track) -> Sequence[tuple[Weights, At]]:
        """See `Row`: an element's end feels its inertia as well."""
        bends, _ = self.behind_and_ahead(track.cell_length)
        loss = track.rail.loss_factor / (2 * np.pi * track.mesh.loss_factor_frequency)
        return [((1.0, loss, 0.0), bends), ((0.0, 0.0, 1.0), replace(bends, inertia=True))]


@dataclass(frozen=True)
class RailMomentAt:
    """A bending moment at a node, from stiffness or inertia of the element ahead or behind."""

    moment: RailMoment
    x: float
    ahead: bool
    inertia: bool = False
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
        M, K = section_matrices(cell.section, np.diff(cell.nodes[e : e + 2]))
        own, felt = cell.section.element_unknowns(member), M[0] if self.inertia else K[0]
        end = felt[own[1]] if self.ahead else -felt[own[3]]
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


def shown_by(rows: Sequence[Row], cell: Cell, ring: RingModes) -> ComplexArray:
    """Rows by modes of a cell's parity, shape (n_rows, n)."""
    found = [row.of_modes(cell, ring) * np.exp(1j * ring.mu * row.place.cell) for row in rows]
    return np.array(found).reshape(len(rows), ring.poles.size).astype(complex)
