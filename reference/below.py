"""What lies between the fastenings and slabs or ground, of the whole ring: finite elements.

Blocks are masses, sleepers beams of elements across, both halves of them; layers as continuous as
the rails have the rails' elements. No parity, no polynomials, no cell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.track.below import NODE_TOLERANCE
from railcosim.track.cell import railseats
from railcosim.track.layers import CONTINUOUS, SLEEPER, Layer
from railcosim.track.parameters import Track
from railcosim.track.section import Beam, Section

SIDES = (-1, 1)  # left, right
ELEMENTS = 24  # across a sleeper: its second bending mode to 1e-5
GAUSS = np.polynomial.legendre.leggauss(4)


def unknowns_at(e: NDArray[np.intp], nodes: int, size: int) -> NDArray[np.intp]:
    """Of elements on a rail, of the node behind and then of the one in front, (n, 2 size)."""
    both = np.stack([e, (e + 1) % nodes], axis=1)[:, :, None] * size + np.arange(size)
    return both.reshape(e.size, -1)


@dataclass(frozen=True, kw_only=True)
class Line:
    """Rails, and layers as continuous: how they move at places round the ring."""

    nodes: FloatArray
    section: Section
    length: float

    def rows(self, side: int, parts: FloatArray, x: FloatArray) -> sparse.csr_array:
        """Motion of points that move by `parts` of each member's deflection; of both rails."""
        ends, d = np.append(self.nodes, self.length), self.section.size
        e = np.searchsorted(ends, x + NODE_TOLERANCE, side="right") - 1
        e = np.clip(e, 0, self.nodes.size - 1)
        L = ends[e + 1] - ends[e]
        columns = side * d * self.nodes.size + unknowns_at(e, self.nodes.size, d)
        entries = np.zeros(columns.shape)
        for i, (member, part) in enumerate(zip(self.section.members, parts, strict=True)):
            own = self.section.element_unknowns(i)
            entries[:, own] = part * member.shapes((x - ends[e]) / L, L)
        points = np.repeat(np.arange(x.size), columns.shape[1])
        return sparse.csr_array(
            (entries.ravel(), (points, columns.ravel())),
            shape=(x.size, 2 * d * self.nodes.size),
        )


@dataclass(frozen=True, kw_only=True)
class Bodies:
    """Blocks or sleepers at all railseats of the ring.

    Attributes
    ----------
    M, K : sparse array
        Of all of them.
    seats : array
        Where, m.
    across : callable
        Motion of points at y by the unknowns of one, (points, n).
    """

    M: sparse.csr_array
    K: sparse.csr_array
    seats: FloatArray
    across: Callable[[FloatArray], FloatArray]

    def rows(self, x: FloatArray, y: FloatArray) -> sparse.csr_array:
        """Motion of points that belong to railseats at x."""
        seat = np.argmin(np.abs(self.seats[None, :] - x[:, None]), axis=1)
        moved = self.across(y)
        n = moved.shape[1]
        columns = n * seat[:, None] + np.arange(n)
        points = np.repeat(np.arange(x.size), n)
        return sparse.csr_array(
            (moved.ravel(), (points, columns.ravel())), shape=(x.size, n * self.seats.size)
        )


def all_seats(track: Track) -> FloatArray:
    """Railseats round the ring, m."""
    begin = np.arange(track.mesh.cells)[:, None] * track.cell_length
    seats: FloatArray = (begin + railseats(track)).ravel()
    return seats


def bodies_of(layer: Layer, track: Track) -> Bodies:
    """Blocks or sleepers of a layer."""
    seats = all_seats(track)
    if layer.kind == SLEEPER:
        M, K, across = _sleeper(layer, track.rail.lateral_distance / 2)
    else:
        # The left one and the right one of a pair, by the sign of y.
        M, K = layer.mass * np.eye(2), np.zeros((2, 2))

        def across(y: FloatArray) -> FloatArray:
            return np.stack([y < 0, y > 0], axis=1).astype(float)

    one = sparse.eye_array(seats.size)
    return Bodies(
        M=sparse.csr_array(sparse.kron(one, M)),
        K=sparse.csr_array(sparse.kron(one, K)),
        seats=seats,
        across=across,
    )


def _sleeper(
    layer: Layer, side: float
) -> tuple[FloatArray, FloatArray, Callable[[FloatArray], FloatArray]]:
    """Mass, stiffness, and motion at y, of a whole sleeper, perhaps rigid."""
    ends = layer.length / 2
    edges = np.array([-side, side, -layer.unsupported / 2, layer.unsupported / 2])
    nodes = np.unique(np.append(np.linspace(-ends, ends, ELEMENTS + 1), edges))
    nodes = nodes[np.append(True, np.diff(nodes) > 1e-9)]
    # A rigid one bends as a beam would whose unknowns are these two.
    beam = Beam(
        unknowns=("w", "slope"), mass=2 * layer.mass / layer.length, rotary_inertia=0.0,
        bending=layer.bending_stiffness or 1.0,
    )  # fmt: skip
    L = np.diff(nodes)
    M, K = np.zeros((2, 2 * nodes.size, 2 * nodes.size))
    for e, (M_e, K_e) in enumerate(zip(beam.consistent_mass(L), beam.stiffness(L), strict=True)):
        at = slice(2 * e, 2 * e + 4)
        M[at, at] += M_e
        K[at, at] += K_e
    rigid = np.stack([np.ravel([np.ones_like(nodes), 0 * nodes], "F"),
                      np.ravel([nodes, np.ones_like(nodes)], "F")], axis=1)  # fmt: skip
    free = rigid if layer.bending_stiffness == 0 else np.eye(2 * nodes.size)

    def across(y: FloatArray) -> FloatArray:
        e = np.clip(np.searchsorted(nodes, y, side="right") - 1, 0, L.size - 1)
        shapes = beam.shapes((y - nodes[e]) / L[e], L[e])
        out = np.zeros((y.size, 2 * nodes.size))
        np.put_along_axis(out, 2 * e[:, None] + np.arange(4), shapes, axis=1)
        moved: FloatArray = out @ free
        return moved

    return free.T @ M @ free, free.T @ K @ free, across


def places(
    track: Track, kind: str, layer: Layer | None, nodes: FloatArray, *, on_slabs: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where something lies on what is below, on the right: x, y, and part of a railseat's springs.

    Of what is continuous, at Gauss points of all elements; of sleepers, of parts across.
    """
    side, seats = track.rail.lateral_distance / 2, all_seats(track)
    points, weights = (GAUSS[0] + 1) / 2, GAUSS[1] / 2
    if kind == SLEEPER and layer is not None:
        edges = np.linspace(layer.unsupported / 2, layer.length / 2, ELEMENTS + 1)
        y = (edges[:-1, None] + np.diff(edges)[:, None] * points).ravel()
        part = np.tile(weights / ELEMENTS, ELEMENTS)
        return np.repeat(seats, y.size), np.tile(y, seats.size), np.tile(part, seats.size)
    if kind != CONTINUOUS:
        return seats, np.full(seats.size, side), np.ones(seats.size)
    edges = np.append(nodes, track.length)
    gap = track.slab.joint / 2 if on_slabs else 0.0
    if gap:
        joints = np.arange(track.mesh.cells + 1) * track.cell_length
        edges = np.unique(np.concatenate([edges, joints[:-1] + gap, joints[1:] - gap]))
    L = np.diff(edges)[:, None]
    x = edges[:-1, None] + L * points
    part = L * weights / track.fastening.spacing
    inside = np.abs((edges[:-1] + L[:, 0] / 2) % track.cell_length - track.cell_length / 2)
    part[inside > track.cell_length / 2 - gap] = 0.0
    return x.ravel(), np.full(x.size, side), part.ravel()
