"""Along a cell: where a table of shapes has its rows, and what has a kink at every railseat.

A fastening pulls at a rail, which has a kink there: its twist by the moment, its axis by shear.
From one railseat to the next it is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .cell import regular_nodes
from .parameters import Track

T = TypeVar("T", FloatArray, ComplexArray)

ORDER = 5  # of the splines from railseat to railseat
PARTS = 4  # of an element: the local flexibility has waves 0.1 m long


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Rows of a table along a cell.

    Attributes
    ----------
    node : array of int, shape (n_rows,)
        Node of the mesh that each stands at; two at a railseat, before it and behind it.
    nodes : array, shape (n_nodes,)
        Those of the mesh, m, both ends of the cell included.
    parts : int
        Of the way to the next node: at their ends the local flexibility is told.
    """

    node: NDArray[np.intp]
    nodes: FloatArray
    parts: int

    @property
    def elements(self) -> NDArray[np.intp]:
        """Row at which each element begins, shape (n_nodes - 1,)."""
        first = np.arange(self.nodes.size - 1)
        rows: NDArray[np.intp] = np.searchsorted(self.node, first, side="right") - 1
        return rows

    @property
    def firsts(self) -> NDArray[np.intp]:
        """First row of each node, shape (n_nodes,)."""
        rows: NDArray[np.intp] = np.searchsorted(self.node, np.arange(self.nodes.size))
        return rows

    @property
    def places(self) -> tuple[NDArray[np.intp], FloatArray]:
        """Where a local flexibility is told: node and how far from it to the next, 0..1.

        Of every row `parts`, and the last node; before a railseat all of them are at it.
        """
        parts = self.parts
        share = np.arange(parts) / parts
        begins = np.zeros(self.node.size, dtype=bool)
        begins[self.elements] = True
        node, shares = np.repeat(self.node, parts), np.outer(begins, share).ravel()
        count = (self.node.size - 1) * parts + 1
        return node[:count], shares[:count]

    def with_slopes(self, values: ComplexArray) -> ComplexArray:
        """Values at all places and how they change along the rail, 1/m, (.., 2, ..).

        From one railseat to the next; the first place is the last one's, a cell further.
        """
        total, step = len(values) - 1, self.nodes[1] / self.parts
        slopes = np.zeros_like(values)
        behind = (np.flatnonzero(np.diff(self.node) == 0) + 1) * self.parts
        for first, last in zip(behind, np.roll(behind, -1) - self.parts, strict=True):
            bay = np.arange(first, last + 1 + total * (last < first)) % total
            of_spline = smoothed(bay.size - 1, np.arange(float(bay.size)), 1) / step
            # Term by term: the same bits whichever other directions there are.
            slopes[bay] = sum(map(np.multiply.outer, of_spline.T, values[bay]))
        slopes[-1] = slopes[0]
        both: ComplexArray = np.stack([values, slopes], axis=1)
        return both

    def spread(self, values: ComplexArray) -> ComplexArray:
        """Values at nodes, straight between them, at all places."""
        node, share = self.places
        part = share.reshape(-1, *np.ones(values.ndim - 1, dtype=int))
        there: ComplexArray = values[node].copy()
        inside = share > 0
        there[inside] += part[inside] * (values[node[inside] + 1] - values[node[inside]])
        return there


def rows_along(track: Track) -> Rows:
    """One row at every node, two at every railseat."""
    a_bay = track.mesh.elements_per_bay
    nodes = regular_nodes(track, a_bay)
    seats = a_bay // 2 + a_bay * np.arange(track.bays)
    return Rows(
        node=np.sort(np.concatenate([np.arange(nodes.size), seats])), nodes=nodes, parts=PARTS
    )


def by_bay(values: T, bays: int, turn: ComplexArray | float = 1.0) -> T:
    """Values at equal steps along a cell, (n + 1, ..), by bays of railseats, (bays, m + 1, ..).

    The last bay reaches into the next cell, where they are turned.
    """
    m = (len(values) - 1) // bays
    seat = m // 2
    around = np.concatenate([values[seat:-1], values[: seat + 1] * turn])
    bay: T = np.stack([around[i * m : (i + 1) * m + 1] for i in range(bays)])
    return bay


def along_cell(values: T, turn: ComplexArray | float = 1.0) -> T:
    """Back again, each railseat twice: (bays, m + 1, ..) to (bays (m + 1) + 1, ..)."""
    half = (values.shape[1] - 1) // 2
    inner = values[:-1].reshape(-1, *values.shape[2:])
    rows: T = np.concatenate([values[-1, half:] / turn, inner, values[-1, : half + 1]])
    return rows


def smoothed(steps: int, at: FloatArray, order: int = 0) -> FloatArray:
    """Derivatives of the spline through values at 0, 1 .. steps: as a matrix, (at, steps + 1)."""
    spline = make_interp_spline(np.arange(steps + 1.0), np.eye(steps + 1), k=ORDER)
    matrix: FloatArray = spline(at, order)
    return matrix
