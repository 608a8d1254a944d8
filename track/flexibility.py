"""The local flexibility beside modes that take no power: masses on springs under every wheel.

In each direction one. Its shape is real along the rail but for a constant phase, so whatever lies
between the places of a table, what is added up is a sum of squares: it can only store and take.
"""

from __future__ import annotations

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.shape_functions import shape_functions

from .along import Rows, along_cell, by_bay, smoothed
from .cell import Cell, elements_per_bay, regular_nodes
from .parameters import Track
from .receptance import Point, direct_receptance
from .residual import (
    FIT_FROM,
    LEAST_DAMPING,
    MOST_DAMPING,
    Apart,
    Directions,
    left_out_by,
    natural,
)  # fmt: skip
from .ring import RingModes

TOLD_TO = 0.3  # of the highest frequency kept: where inertia shows, and its like is promised
LEAST = 1e-9  # of the whole flexibility: rounding, as if it were there


def kinked_shapes(cell: Cell, ring: RingModes, directions: Directions) -> ComplexArray:
    """Motion and slope of the modes at the head of the left rail, (n_rows, 2 k, n).

    Direction by direction, on `kinked_rows`.
    """
    track, section, turn = cell.track, cell.section, np.exp(1j * ring.mu)
    first = [section.element_unknowns(i)[0] for i in range(len(section.members))]
    height = -track.rail.head_height
    parts = [d.mirror * section.deflections(d, 0.0, height) for d in directions]
    nodal = ring.shapes[: cell.rail_size].reshape(-1, section.size, ring.poles.size)[:, first]
    bays = by_bay(np.einsum("km,xmn->xkn", parts, nodal), track.bays, turn)
    steps, step = bays.shape[1] - 1, cell.nodes[1] - cell.nodes[0]
    at = np.linspace(0, steps, track.mesh.elements_per_bay + 1)
    along = np.stack([smoothed(steps, at), smoothed(steps, at, 1) / step])
    rows: ComplexArray = along_cell(np.einsum("vex,bxkn->bekvn", along, bays), turn)
    return rows.reshape(len(rows), -1, ring.poles.size)


def local_flexibility(
    track: Track,
    rows: Rows,
    tables: list[ComplexArray],
    modes: list[RingModes],
    directions: Directions,
    top: float,
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Poles of what modes leave out, (k,); shapes at all places of the rows, (.., k, k); scales.

    At rest it is exact at every place. Its inertia and its losses are those of the whole track, by
    least squares.

    Parameters
    ----------
    track : Track
        Parameters.
    rows : Rows
        Of the tables.
    tables : list of array, shape (n_rows, 2 k, n)
        Motions and slopes of the modes of either parity.
    modes : list of RingModes
        These.
    directions : tuple of Direction
        In which wheels meet the rail.
    top : float
        Highest frequency kept, rad/s.
    """
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, TOLD_TO, 8) * top])
    at_nodes = np.searchsorted(rows.node, np.arange(rows.nodes.size))
    motions = [table[at_nodes, ::2] for table in tables]
    left_out, whole = left_out_by(track, rows.nodes, motions, modes, directions, omega)
    apart, w, k = Apart.of(left_out[0].real, whole), omega[1:, None], len(directions)
    N, poles = apart.seen(left_out), np.empty(k, complex)
    for j in range(k):
        own, static = N[:, :, j, j], apart.static[:, j, j]
        omega_r = natural(own, apart.known[:, j], w, top)
        loss = -own[1:].imag / w * (1 - (w / omega_r) ** 2)
        d = (loss @ static).sum() / (static @ static) / len(loss)
        zeta = np.clip(0.5 * d * omega_r, LEAST_DAMPING, MOST_DAMPING)
        poles[j] = omega_r * complex(-zeta, np.sqrt(1 - zeta**2))
    held = _static(track, rows, directions)
    beyond = _root(held - _held_by(rows, tables, modes), np.diagonal(held, axis1=1, axis2=2))
    scale = np.diagonal(beyond, axis1=1, axis2=2) / np.max(beyond, axis=(0, 1))
    return poles, beyond * np.sqrt(-1j * np.abs(poles) ** 2 / poles.imag), scale


def _static(track: Track, rows: Rows, directions: Directions) -> FloatArray:
    """Flexibility of the finite elements at rest, at all places, (.., k, k)."""
    a_bay, k = elements_per_bay(track, directions), len(directions)
    nodes = regular_nodes(track, a_bay)
    static, some = np.empty((nodes.size, k, k)), a_bay // track.mesh.elements_per_bay
    for start in range(some):
        points = [Point(x=float(x), direction=d) for x in nodes[start::some] for d in directions]
        R = direct_receptance(track, np.zeros(1), points, points)[0].real
        R = R.reshape(-1, k, len(R) // k, k)
        static[start::some] = R[np.arange(len(R)), :, np.arange(len(R))]
    parts, elements = rows.shares.size - 1, np.arange(track.mesh.elements_per_bay)
    at = np.append((elements[:, None] + rows.shares[:-1]).ravel() * some, a_bay)
    bays = np.einsum("ex,bxij->beij", smoothed(a_bay, at), by_bay(static, track.bays))
    # Before a railseat, which is a row of its own, all places are at it.
    index = np.minimum(np.arange(at.size - 1 + parts), at.size - 1).reshape(-1, parts)
    places: FloatArray = along_cell(bays[:, index]).reshape(-1, k, k).real
    return places[: len(rows.places[0])]


def _held_by(rows: Rows, tables: list[ComplexArray], modes: list[RingModes]) -> FloatArray:
    """Flexibility of the modes at rest, at all places, (.., k, k)."""
    node, share = rows.places
    held = np.empty((node.size, tables[0].shape[1] // 2, tables[0].shape[1] // 2))
    first, length = rows.elements, rows.nodes[1]
    for p in rows.shares[:-1]:
        at = np.flatnonzero(share == p)
        here = np.append(first, rows.node.size - 1)[node[at]]
        there = np.minimum(here + 1, rows.node.size - 1)
        weights, _ = shape_functions(p, length, 0.0)
        total = np.zeros((at.size, *held.shape[1:]))
        for table, ring in zip(tables, modes, strict=True):
            ends = (table[here, ::2], table[here, 1::2], table[there, ::2], table[there, 1::2])
            w = sum(weight * end for weight, end in zip(weights, ends, strict=True))
            total += np.einsum("xin,xjn->xij", w / -ring.poles, w[..., ring.partner]).real
        held[at] = 0.5 * total  # half of the force on one rail is of either parity
    return held


def _root(static: FloatArray, size: FloatArray) -> FloatArray:
    """L with static = L L', whose last direction moves those before it; (n, k, k)."""
    unit = np.sqrt(size[:, :, None] * size[:, None, :])
    value, vector = np.linalg.eigh(static / unit)
    value = np.maximum(value, LEAST)
    raised = (vector * value[:, None, :]) @ np.swapaxes(vector, 1, 2) * unit
    root: FloatArray = np.linalg.cholesky(raised[:, ::-1, ::-1])[:, ::-1, ::-1]
    return root
