"""A linear model as matrices: x' = A x + B u, y = C x + D u."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, TypeAlias

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array
from scipy.sparse.csgraph import connected_components

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.partial_fractions import PartialFractions, partial_fractions
from railcosim.master.linear.realisation import ComplexArray

__all__ = ["ComplexArray", "IndexArray", "StateSpace"]

IndexArray: TypeAlias = NDArray[np.intp]

CHUNK = 2_000_000
"""Complex numbers solved for at once: 32 MB."""


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """Small motion about an operating point.

    Attributes
    ----------
    name : str
        What moves.
    A : scipy.sparse.csc_array, shape (n_states, n_states)
        In 1/s and the units of the states.
    B : ndarray, shape (n_states, n_inputs)
        Rates of the states per unit of the inputs.
    C : ndarray, shape (n_outputs, n_states)
        Outputs per unit of the states.
    D : ndarray, shape (n_outputs, n_inputs)
        Feedthrough.
    inputs, outputs : tuple of Variable
        Names and units, in the order of the columns of B and of the rows of C.
    rougher : StateSpace or None
        The same, known less exactly, for `error_estimate`; None if it is exact but for rounding.
    standing : mapping of str to float
        Values of all outputs at the operating point, if they are known.
    is_divisible : bool
        Whether steps one after the other are one of their length.
    """

    name: str
    A: csc_array
    B: FloatArray
    C: FloatArray
    D: FloatArray
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    rougher: StateSpace | None = None
    standing: Mapping[str, float] = field(default_factory=dict)
    is_divisible: ClassVar[bool] = True

    def __post_init__(self) -> None:
        n, m, p = self.A.shape[0], len(self.inputs), len(self.outputs)
        found = {k: getattr(self, k).shape for k in "ABCD"}
        wanted = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
        if found != wanted:
            raise ValueError(f"{self.name}: shapes are {found}; they must be {wanted}")

    @property
    def error_floor(self) -> FloatArray:
        """Relative error beside the difference to `rougher`: none."""
        return np.zeros(self.D.shape)

    def over(self, times: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
        """What some times do to the states, and what inputs with their derivatives add in them.

        Both are in the first rows of the exponential of [[A, B, 0], [0, 0, 1], [0, 0, 0]].

        Parameters
        ----------
        times : array, any shape
            s.
        degree : int
            Of the highest derivative.

        Returns
        -------
        array, shape (..., n_states, n_states)
            exp(A t).
        array, shape (..., n_states, (degree + 1) * n_inputs)
            By inputs at the beginning, then their derivatives.
        """
        n, m = self.B.shape
        A = self.A.toarray()
        # Inputs are forces or motions, and one is a million times the other.
        unit = max(np.abs(A).max(initial=0.0), 1.0) / max(np.abs(self.B).max(initial=0.0), 1e-300)
        big = np.zeros((n + (degree + 1) * m,) * 2)
        big[:n, :n], big[:n, n : n + m] = A, unit * self.B
        k = np.arange(n, n + degree * m)
        big[k, k + m] = 1.0
        top = scipy.linalg.expm(times[..., None, None] * big)[..., :n, :]
        return top[..., :n], top[..., n:] / unit

    def blocks(self) -> list[IndexArray]:
        """States that act on each other, apart from all others.

        Returns
        -------
        list of ndarray of int, each of shape (n_blocks, size)
            One array for each size of block, with the positions of each block's states.
        """
        if not self.A.shape[0]:
            return []
        _, label = connected_components(self.A != 0, directed=False)
        order = np.argsort(label, kind="stable")
        counts = np.bincount(label)
        starts = np.cumsum(counts) - counts
        return [
            order[starts[counts == size][:, None] + np.arange(size)]
            for size in np.unique(counts).tolist()
        ]

    def frequency_response(self, omega: ArrayLike) -> ComplexArray:
        """C (i omega - A)^-1 B + D.

        Parameters
        ----------
        omega : array_like, shape (n_omega,)
            Angular frequencies, rad/s; none of them an undamped pole.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs, n_inputs)
            In units of the output per unit of the input.

        Notes
        -----
        Blocks of one or two states, such as the modes of a body, are fractions. Each larger one is
        brought to triangular form once, by unitary matrices, which a multiple pole does not harm;
        from then on a frequency costs one back substitution.
        """
        s = 1j * np.asarray(omega, dtype=float)
        response: ComplexArray = self._fractions.at(s)
        for T, B, C in self._triangular:
            length = max(1, CHUNK // B.size)
            for begin in range(0, len(s), length):
                part = slice(begin, begin + length)
                # (outputs, all states) times (all states, frequencies and inputs): one BLAS call.
                x = _back_substitute(T, B, s[part])
                y: ComplexArray = C @ x.reshape(C.shape[1], -1)
                response[part] += y.reshape(len(C), -1, B.shape[2]).transpose(1, 0, 2)
        response += self.D
        return response

    @cached_property
    def _fractions(self) -> PartialFractions:
        """All blocks of one or two states."""
        blocks = [self._dense(states) for states in self.blocks() if states.shape[1] <= 2]
        n = sum(len(A) for A, _, _ in blocks)
        A, B, C = (
            np.zeros((n, 2, 2)),
            np.zeros((n, 2, len(self.inputs))),
            np.zeros((n, len(self.outputs), 2)),
        )
        end = 0
        for a, b, c in blocks:
            begin, size = end, a.shape[1]
            end += len(a)
            A[begin:end, :size, :size], B[begin:end, :size], C[begin:end, :, :size] = a, b, c
            if size == 1:  # a second state with the same pole, which nothing moves
                A[begin:end, 1, 1] = a[:, 0, 0]
        return partial_fractions(A, B, C)

    @cached_property
    def _triangular(self) -> list[tuple[ComplexArray, ComplexArray, ComplexArray]]:
        """By size of block above two: T (n, k, k), B (n, k, n_inputs), C (n_outputs, n * k)."""
        found: list[tuple[ComplexArray, ComplexArray, ComplexArray]] = []
        for states in self.blocks():
            if states.shape[1] <= 2:
                continue
            A, b, c = self._dense(states)
            pairs = [scipy.linalg.schur(block, output="complex") for block in A]
            T, Q = np.array([t for t, _ in pairs]), np.array([q for _, q in pairs])
            B: ComplexArray = Q.conj().transpose(0, 2, 1) @ b.astype(complex)
            C: ComplexArray = (c @ Q).transpose(1, 0, 2)
            found.append((T, B, C.reshape(len(self.C), states.size)))
        return found

    def _dense(self, states: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Blocks of one size: A (n, k, k), B (n, k, n_inputs), C (n, n_outputs, k)."""
        count, size = states.shape
        ordered = self.A[states.ravel()][:, states.ravel()].tocoo()
        block, row, column = ordered.row // size, ordered.row % size, ordered.col % size
        # Beside the blocks there may be zeros that are stored.
        inside = block == ordered.col // size
        A = np.zeros((count, size, size))
        A[block[inside], row[inside], column[inside]] = ordered.data[inside]
        return A, self.B[states], self.C[:, states].transpose(1, 0, 2)


def _back_substitute(T: ComplexArray, B: ComplexArray, s: ComplexArray) -> ComplexArray:
    """Solve (s - T) x = B for all blocks and frequencies: (n_blocks, k, n_omega, n_inputs)."""
    count, size, m = B.shape
    x = np.empty((count, size, len(s), m), dtype=complex)
    for i in range(size)[::-1]:
        known = x[:, i + 1 :].reshape(count, size - 1 - i, len(s) * m)
        right = (T[:, i, None, i + 1 :] @ known).reshape(count, len(s), m) + B[:, i, None, :]
        x[:, i] = right / (s - T[:, i, i, None])[:, :, None]
    return x
