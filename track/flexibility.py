"""The local flexibility beside modes that take no power: masses on springs under every wheel.

In each direction one, all of one pole, and against them those that stand where `attached` shapes
do. Together they are an oscillator of that pole times what both are at rest, which is not negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.shape_functions import shape_functions

from .along import Rows, along_cell, by_bay, smoothed
from .cell import Cell, elements_per_bay, regular_nodes
from .parameters import Track
from .receptance import Point, direct_receptance
from .residual import (
    FIT_FROM,
    Apart,
    Directions,
    at_least,
    left_out_by,
    natural,
)
from .ring import RingModes

TOLD_TO = 0.3  # of the highest frequency kept: where inertia shows, and its like is promised
LEAST = 2e-6  # of the local flexibility, at railseats: above single precision
DAMPING = 0.12  # ratio: it rings off within 5 cm, and takes 1e-3 of a response at 1500 Hz


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


def local_pole(
    track: Track,
    rows: Rows,
    tables: list[ComplexArray],
    modes: list[RingModes],
    directions: Directions,
    top: float,
) -> complex:
    """Pole of what modes leave out, by least squares: as torsion has it, which is most of it.

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
    apart = Apart.of(left_out[0].real, whole)
    own = apart.seen(left_out)[:, :, -1, -1]
    omega_r = natural(own, apart.known[:, -1], omega[1:, None], top)
    return omega_r * complex(-DAMPING, np.sqrt(1 - DAMPING**2))


def oscillator(pole: complex) -> complex:
    """Residue of H(s) = (1 + d s) / (1 + d s + s^2 / omega^2), as one of a conjugate pair has it.

    A mass hung on its spring by a damper: it is passive, rings off, and loses with the third power
    of the frequency.
    """
    jump = -2 * pole.real
    return jump - 1j * (abs(pole) ** 2 + jump * pole.real) / pole.imag


def against(elastic: RingModes, pole: complex) -> RingModes:
    """Oscillators of this pole that take off what these have at rest."""
    return replace(
        elastic,
        poles=pole * elastic.poles,
        shapes=elastic.shapes * np.sqrt(-oscillator(pole)),
    )


def local_flexibility(
    track: Track,
    rows: Rows,
    directions: Directions,
    moving: tuple[list[ComplexArray], list[RingModes]],
    taken: tuple[list[ComplexArray], list[RingModes]],
) -> ComplexArray:
    """Shapes of the oscillators under wheels, at all places of the rows, (.., k, k): exact at rest.

    Parameters
    ----------
    track, rows, directions : Track, Rows, tuple of Direction
        See `local_pole`.
    moving, taken : tuple of list
        Tables and modes of either parity, as in `local_pole`: of what moves, and `against` it.
    """
    notch = _static(track, rows, directions) - _held_by(rows, *moving)
    against = -_held_by(rows, *taken)
    mean = (notch + against).mean(axis=0)
    least = LEAST * mean
    root = _root(at_least(notch, least, np.sqrt(np.diagonal(mean))) + against)
    shapes: ComplexArray = root * np.sqrt(oscillator(complex(taken[1][0].poles[0])))
    return shapes


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
    parts = rows.parts
    at = np.arange(parts * track.mesh.elements_per_bay + 1) / parts * some
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
    for p in np.unique(share):
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


def _root(static: FloatArray) -> FloatArray:
    """L with static = L L', whose last direction moves those before it; (.., k, k)."""
    root = np.linalg.cholesky(static[..., ::-1, ::-1])[..., ::-1, ::-1]
    return np.asarray(root, dtype=np.float64)
