"""Where the mode shapes of a body come from: a table along a ring, or the same everywhere.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .arrays import ComplexArray, FloatArray
from .shape_functions import shape_functions

Shaped: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray]


def one_stretch() -> FloatArray:
    """All elements of a cell are equally long."""
    return np.zeros((1, 2))


class Shapes(Protocol):
    """Where mode shapes come from."""

    @property
    def local(self) -> bool:
        """Whether every port has an oscillator of its own."""

    def at(self, position: FloatArray, rows: int) -> Shaped:
        """Shapes at the wheelsets.

        Returns
        -------
        out, into : array, shape (rows, n)
            As displacements, and as forces receive them; a row is a wheelset in a direction.
        local : array, shape (wheelsets, directions, k)
            Of the local oscillators on the left, or of both sides; empty without any.
        """


@dataclass(frozen=True, kw_only=True)
class AlongRing:
    """Shapes as a table along one cell of a ring of cells.

    Attributes
    ----------
    table : array, shape (n_rows, 2 x directions, n)
        Of each direction (of the left rail, then of the right one, where these are apart, see
        `ModalBody`) the displacement and its slope, at all nodes of a cell but its last, which
        is the first of the next; numbers of single precision. A node with a kink is two rows.
    mu : array, shape (n,)
        Phase of a mode from cell to cell, rad.
    partner : array of int, shape (n,)
        Mode whose shape receives the force.
    local_table : array, shape (n_rows x parts, 2, directions, k)
        Shapes of the local oscillators under each contact, and their slopes along the rail: motion
        in a direction by the oscillator of one of the k directions of a contact, of the left rail;
        at `parts` of the way from row to row, Hermite's cubics between them.
    elements : array of int, shape (n_elements,)
        Row at which each element of a cell begins.
    parts : int
        Of an element.
    cell_length : float
        m.
    cells : int
        Of the ring.
    stretches : array, shape (s, 2)
        Of equally long elements: where each begins in the cell, m, and the number of its first
        element; rising, the first one (0, 0).
    """

    table: NDArray[np.complex64]
    mu: FloatArray
    partner: NDArray[np.intp]
    local_table: ComplexArray
    elements: NDArray[np.intp]
    parts: int
    cell_length: float
    cells: int
    stretches: FloatArray = field(default_factory=one_stretch)

    @property
    def local(self) -> bool:
        """See `Shapes`."""
        return True

    @property
    def length(self) -> float:
        """Of the ring, m."""
        return self.cell_length * self.cells

    @cached_property
    def element_lengths(self) -> FloatArray:
        """Of each stretch, m."""
        begins, firsts = self.stretches.T
        counts = np.diff(firsts, append=self.elements.size)
        lengths: FloatArray = np.diff(begins, append=self.cell_length) / counts
        return lengths

    @cached_property
    def _closed(self) -> tuple[ComplexArray, ComplexArray]:
        """Tables with the last node, not rounded by itself: a wheel must not feel the joint.

        Contiguous, for `at` reads neighbours as one block.
        """
        table: ComplexArray = self.table.astype(complex)
        closing = table[:1] * np.exp(1j * self.mu)
        local = np.concatenate([self.local_table, self.local_table[:1]])
        return np.ascontiguousarray(np.concatenate([table, closing])), local

    @cached_property
    def _phase(self) -> ComplexArray:
        turned: ComplexArray = np.exp(1j * np.arange(self.cells)[:, None] * self.mu)
        return turned  # (cells, n)

    def at(self, position: FloatArray, rows: int) -> Shaped:
        """See `Shapes`: between nodes displacements are Hermite's cubics."""
        table, local_table = self._closed
        cell, inside = np.divmod(position % self.length, self.cell_length)
        begins, firsts = self.stretches.T
        stretch = np.searchsorted(begins, inside, side="right") - 1
        element = self.element_lengths[stretch]
        counts = np.diff(firsts, append=self.elements.size)
        inside = (inside - begins[stretch]) / element
        first = np.minimum(inside.astype(int), counts[stretch] - 1)
        xi = inside - first
        first = self.elements[(firsts[stretch] + first).astype(int)]
        weights, _ = shape_functions(xi, element, 0.0)
        k = rows // position.size
        out = np.empty((position.size, k, self.mu.size), dtype=complex)
        for i, node in enumerate(first):
            for d in range(k):
                # Two neighbouring nodes are one block of memory; as real numbers, one BLAS call.
                block = table[node : node + 2, 2 * d : 2 * d + 2].reshape(4, -1).view(float)
                out[i, d] = (weights[i] @ block).view(complex)
        out *= self._phase[cell.astype(int), None]
        part = np.minimum((xi * self.parts).astype(int), self.parts - 1)
        first = first * self.parts + part
        weights, _ = shape_functions(xi * self.parts - part, element / self.parts, 0.0)
        ends = np.concatenate([local_table[first], local_table[first + 1]], axis=1)
        local = np.einsum("pw,pw...->p...", weights, ends)
        shaped: ComplexArray = out.reshape(rows, -1)
        return shaped, shaped[:, self.partner], local


@dataclass(frozen=True, kw_only=True)
class Everywhere:
    """Shapes that are the same wherever the wheelsets are.

    Attributes
    ----------
    out, into : array, shape (rows, n)
        See `Shapes`.
    """

    out: ComplexArray
    into: ComplexArray

    @property
    def local(self) -> bool:
        """See `Shapes`."""
        return False

    def at(self, position: FloatArray, rows: int) -> Shaped:
        """See `Shapes`."""
        del position, rows
        return self.out, self.into, np.empty((0, 0, 0), complex)
