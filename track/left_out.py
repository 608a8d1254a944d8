"""What modes of a ring leave out at a place: finite elements less modes, there and at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction
from railcosim.mechanics.shape_functions import shape_functions

from .along import Rows
from .cell import regular_nodes
from .parameters import Track
from .receptance import Point, direct_receptance
from .ring import RingModes

Directions = tuple[Direction, ...]

FIT_FROM = 0.1  # of the highest frequency kept: where inertia shows
TRIFLE = 1e-6  # of a flexibility: rounding, to be left out as if it were there
MOSTLY_ELASTIC = 0.1  # imaginary by real part of what is left out
HIGHEST_POLE = 10.0  # of what is left out, in highest frequencies kept


def left_out_by(
    track: Track,
    rows: Rows,
    tables: list[ComplexArray],
    modes: list[RingModes],
    directions: Directions,
    omega: FloatArray,
) -> tuple[ComplexArray, FloatArray]:
    """Finite elements less modes, at every node for forces there, (n_omega, n_nodes, k, k).

    And the finite elements at rest, (n_nodes, k, k).

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
    omega : array, shape (n_omega,)
        rad/s, the first one 0.
    """
    k, nodes = len(directions), rows.nodes
    points = [Point(x=float(x), direction=d) for x in nodes for d in directions]
    total = direct_receptance(track, omega, points, points, viscous=True)
    same = np.arange(nodes.size)
    total = total.reshape(omega.size, nodes.size, k, nodes.size, k)
    left_out: ComplexArray = np.moveaxis(total[:, same, :, same], 0, 1).copy()
    whole = left_out[0].real.copy()
    s = 1j * omega[:, None]
    for table, ring in zip(tables, modes, strict=True):
        w = table[rows.firsts, ::2]
        for i in range(k):
            for j in range(k):
                residue = w[:, i] * w[:, j][:, ring.partner]
                for p, r in ((ring.poles, residue), (ring.poles.conj(), residue.conj())):
                    left_out[:, :, i, j] -= 0.25 * (1 / (s - p)) @ r.T
    return left_out, whole


def static_flexibility(track: Track, rows: Rows, directions: Directions) -> FloatArray:
    """Of the finite elements, at all places of the rows, (.., k, k): exact in any mesh."""
    parts, k = rows.parts, len(directions)
    x = regular_nodes(track, track.mesh.elements_per_bay * parts)
    static = np.empty((x.size, k, k))
    for start in range(parts):
        points = [
            Point(x=float(place), direction=d) for place in x[start::parts] for d in directions
        ]
        R = direct_receptance(track, np.zeros(1), points, points, viscous=True)[0].real
        R = R.reshape(-1, k, len(R) // k, k)
        static[start::parts] = R[np.arange(len(R)), :, np.arange(len(R))]
    node, share = rows.places
    places: FloatArray = static[np.rint((node + share) * parts).astype(int)]
    return places


def at_places(rows: Rows, table: ComplexArray) -> ComplexArray:
    """Motions at all places of the rows, (.., k, n), of a table of motions and slopes."""
    node, share = rows.places
    moved = np.empty((node.size, table.shape[1] // 2, table.shape[2]), complex)
    first, last = rows.elements, rows.node.size - 1
    for p in np.unique(share):
        at = np.flatnonzero(share == p)
        here = np.append(first, last)[node[at]]
        there = np.minimum(here + 1, last)
        weights, _ = shape_functions(p, rows.nodes[1], 0.0)
        ends = (table[here, ::2], table[here, 1::2], table[there, ::2], table[there, 1::2])
        moved[at] = sum(weight * end for weight, end in zip(weights, ends, strict=True))
    return moved


def held_by(rows: Rows, tables: list[ComplexArray], modes: list[RingModes]) -> FloatArray:
    """Flexibility of modes at rest, at all places, (.., k, k); see `left_out_by`."""
    held = 0.0
    for table, ring in zip(tables, modes, strict=True):
        w = at_places(rows, table)
        # Half of the force on one rail is of either parity.
        held = held + 0.5 * np.einsum("xin,xjn->xij", w / -ring.poles, w[..., ring.partner]).real
    return np.asarray(held)


def natural(N: ComplexArray, known: NDArray[np.bool_], w: FloatArray, top: float) -> float:
    """Natural frequency of an oscillator like this flexibility, static first; rad/s.

    Told by the nodes where damping does not decide.
    """
    if not known.any():
        return top
    elastic = np.max(np.abs(N.imag), axis=0) < MOSTLY_ELASTIC * np.max(np.abs(N.real), axis=0)
    told = elastic & known if (elastic & known).any() else known
    R, R0 = N[1:, told], N[0, told].real
    inertia = np.vdot(R * w**2, R - R0).real / np.vdot(R * w**2, R * w**2).real
    return float(1 / np.sqrt(max(inertia, 1 / (HIGHEST_POLE * top) ** 2)))
