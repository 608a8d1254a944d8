"""Bodies of a cell below a rail, and where one lies on another, as rows.

A row is how much each unknown of the cell moves a point. The unknowns are those of a chain, node by
node from end to end: the rail and layers that are continuous as it is; then those of bodies that
end within the cell: blocks, sleepers, the slab. For one rail and half of what both rails share, of
one parity, see `cell`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.polynomial import legendre

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.ports import Direction

from .fastenings import Spring
from .layers import CONTINUOUS, SLEEPER, Layer
from .section import GAUSS, Bar, Beam, Section
from .slab import SlabModes

NODE_TOLERANCE = 1e-6  # m; a point this near to a node is that node
DEGREE = 24
"""Highest degree of a deflection across: the push of a rail at a point is met to 1e-4."""


class Body(Protocol):
    """Something that moves under a rail."""

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """Motion of points, (points, unknowns of the cell); x in the cell, y from the middle, m."""


@dataclass(frozen=True, kw_only=True)
class Points:
    """Where one body lies on another.

    Attributes
    ----------
    x, y, weight : array, shape (points,)
        In the cell and from the middle, m; part of a railseat's stiffness.
    all_along : bool
        Whether they are Gauss points of what is continuous.
    """

    x: FloatArray
    y: FloatArray
    weight: FloatArray
    all_along: bool = False


@dataclass(frozen=True, kw_only=True)
class Chain:
    """What goes on from cell to cell: how members of a section move at places along it."""

    section: Section
    nodes: FloatArray
    unknowns: int

    def rows(self, parts: FloatArray, x: FloatArray) -> FloatArray:
        """Motion of points that move by `parts` of each member's deflection."""
        out, d = np.zeros((x.size, self.unknowns)), self.section.size
        e = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, self.nodes.size - 2)
        nearest = np.argmin(np.abs(self.nodes[None, :] - x[:, None]), axis=1)
        at_node = np.abs(self.nodes[nearest] - x) < NODE_TOLERANCE
        for i, (member, part) in enumerate(zip(self.section.members, parts, strict=True)):
            own = self.section.element_unknowns(i)
            out[np.flatnonzero(at_node), d * nearest[at_node] + own[0]] = part
            for p in np.flatnonzero(~at_node):
                L = self.nodes[e[p] + 1] - self.nodes[e[p]]
                out[p, e[p] * d + own] = part * member.shapes((x[p] - self.nodes[e[p]]) / L, L)
        return out


@dataclass(frozen=True, kw_only=True)
class Foot:
    """The rail's foot."""

    chain: Chain
    height: float

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `Body`."""
        return self.chain.rows(self.chain.section.deflections(direction, 0.0, self.height), x)


@dataclass(frozen=True, kw_only=True)
class Line:
    """A continuous layer: a member of the chain."""

    chain: Chain
    member: int

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `Body`."""
        return self.chain.rows(np.eye(len(self.chain.section.members))[self.member], x)


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """Blocks, or halves of sleepers, at railseats: deflections that are polynomials across.

    Attributes
    ----------
    seats : array
        Where, in the cell, m.
    half_length : float
        Of a sleeper, m.
    degrees : array of int
        Of the Legendre polynomials; a block has the first only.
    first, unknowns : int
        Where theirs are among those of the cell.
    """

    seats: FloatArray
    half_length: float
    degrees: FloatArray
    first: int
    unknowns: int

    @property
    def size(self) -> int:
        """Number of its unknowns."""
        return self.seats.size * self.degrees.size

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `Body`."""
        out, n = np.zeros((x.size, self.unknowns)), self.degrees.size
        seat = np.argmin(np.abs(self.seats[None, :] - x[:, None]), axis=1)
        columns = self.first + n * seat[:, None] + np.arange(n)
        shapes = legendre.legvander(y / self.half_length, int(self.degrees[-1]))
        np.put_along_axis(out, columns, shapes[:, self.degrees.astype(int)], axis=1)
        return out

    def matrices(self, layer: Layer) -> tuple[FloatArray, FloatArray]:
        """Mass and bending stiffness of one of them, of its half."""
        points, weights = legendre.leggauss(DEGREE + 1)
        eta, weight = (points + 1) / 2, weights / 2
        value, curved = (
            np.stack([legendre.legval(eta, legendre.legder(np.eye(DEGREE + 1)[int(n)], m))
                      for n in self.degrees])
            for m in (0, 2)
        )  # fmt: skip
        bending = layer.bending_stiffness / self.half_length**3
        return layer.mass * (value * weight) @ value.T, bending * (curved * weight) @ curved.T


@dataclass(frozen=True, kw_only=True)
class Plate:
    """The slab."""

    slab: SlabModes
    middle: float
    unknowns: int

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `Body`."""
        out = np.zeros((x.size, self.unknowns))
        out[:, self.unknowns - self.slab.size :] = self.slab.at(direction, x - self.middle, y)
        return out


@dataclass(frozen=True, kw_only=True)
class Ground:
    """Rigid."""

    unknowns: int

    def rows(self, direction: Direction, x: FloatArray, y: FloatArray) -> FloatArray:
        """See `Body`."""
        return np.zeros((x.size, self.unknowns))


@dataclass(frozen=True, kw_only=True)
class Joint:
    """A body on another: springs and dampers at points, all in all those of one railseat."""

    upper: Body
    lower: Body
    points: Points
    springs: Sequence[Spring]
    loss_factor: float

    def stretch(self, direction: Direction) -> FloatArray:
        """Motion of the upper less that of the lower, as of equal springs, (points, unknowns)."""
        at = (direction, self.points.x, self.points.y)
        return np.sqrt(self.points.weight)[:, None] * (self.upper.rows(*at) - self.lower.rows(*at))


def with_lines(section: Section, layers: Collection[Layer], spacing: float) -> Section:
    """A rail's section with the layers that are as continuous as it is."""
    lines: list[Beam | Bar] = []
    for i, layer in enumerate(layers):
        if layer.kind == CONTINUOUS:
            mass, bending = layer.mass / spacing, layer.bending_stiffness
            lines.append(
                Beam(
                    unknowns=(f"w{i}", f"theta{i}"), mass=mass, rotary_inertia=0.0, bending=bending
                )
                if bending
                else Bar(unknowns=(f"w{i}",), mass=mass, slope=0.0)
            )
    return replace(section, members=(*section.members, *lines)) if lines else section


def half_of(layer: Layer, parity: int, seats: FloatArray, first: int, unknowns: int) -> Crossing:
    """Blocks, or halves of sleepers, for motions of one parity."""
    degrees = np.zeros(1)
    if layer.kind == SLEEPER:
        odd = 0 if parity == 1 else 1
        degrees = np.arange(odd, DEGREE + 1 if layer.bending_stiffness else odd + 1, 2.0)
    return Crossing(
        seats=seats,
        half_length=layer.length / 2 if layer.kind == SLEEPER else 1.0,
        degrees=degrees, first=first, unknowns=unknowns,
    )  # fmt: skip


def points_at(seats: FloatArray, side: float) -> Points:
    """Under the rail at railseats."""
    return Points(x=seats, y=np.full(seats.size, side), weight=np.ones(seats.size))


def points_along(nodes: FloatArray, side: float, spacing: float, span: FloatArray) -> Points:
    """Under the rail all along a part of the cell, for what is given per railseat."""
    edges = np.unique(np.clip(np.append(nodes, span), *span))
    L = np.diff(edges)[:, None]
    xi, weight = (GAUSS[0] + 1) / 2, GAUSS[1] / 2
    x = (edges[:-1, None] + L * xi).ravel()
    return Points(
        x=x, y=np.full(x.size, side), weight=(L * weight).ravel() / spacing, all_along=True
    )


def points_across(layer: Layer, seats: FloatArray) -> Points:
    """Under half of every sleeper."""
    points, weights = legendre.leggauss(DEGREE + 1)
    first, last = layer.unsupported / 2, layer.length / 2
    y = first + (last - first) * (points + 1) / 2
    return Points(
        x=np.repeat(seats, y.size),
        y=np.tile(y, seats.size),
        weight=np.tile(weights / 2, seats.size),
    )
