"""One cell condensed to its two ends, at many frequencies at once.

Between its places, where supports hold it, loads act or motions are seen, a rail is a chain of
elements: each such span is solved once for all that are equal. What the rail stands on is in modes,
which meet nothing but supports: it gives these their flexibility, as a sum over modes. What is left
are the rail's places, some twenty, in one small system a frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .cell import Cell

Indices = NDArray[np.intp]
Matrices = tuple[ComplexArray, ComplexArray, ComplexArray]
"""Coefficients of 1, omega and omega^2 of a dynamic stiffness."""

SAME = 1e-9  # relative difference below which spans are equal; nodes are rounded to 1e-15 of a cell
ROUNDING = 1e-12  # of the largest entry: what is left of supports that were taken out


@dataclass(frozen=True, kw_only=True)
class CondensedCell:
    """What a cell is to its neighbours, at every frequency.

    The ends' unknowns are the d of the first rail node ([w, theta] of the vertical model), then
    those of the last.

    Attributes
    ----------
    stiffness : array, shape (n_omega, 2 d, 2 d)
        Dynamic stiffness between the ends.
    forces : array, shape (n_omega, 2 d, n_loads)
        What unit loads inside are to the ends.
    motions : array, shape (n_omega, n_observed, 2 d)
        Deflections inside that follow the ends.
    within : array, shape (n_omega, n_observed, n_loads)
        Deflections inside for loads inside, the ends being held.
    """

    stiffness: ComplexArray
    forces: ComplexArray
    motions: ComplexArray
    within: ComplexArray


def condense(
    cell: Cell, omega: FloatArray, loads: FloatArray, observed: FloatArray
) -> CondensedCell:
    """Condense a cell to its ends.

    Parameters
    ----------
    cell : Cell
        Its matrices.
    omega : array, shape (n_omega,)
        rad/s.
    loads, observed : array, shape (n, n_loads) and (n, n_observed)
        Participation of points in the unknowns of the cell.

    Returns
    -------
    CondensedCell
    """
    rail, d = cell.rail_size, cell.section.size
    held = [(s.stretch, s.dynamic_stiffness(omega)) for s in cell.supports]
    rows = np.concatenate([np.empty((0, cell.K.shape[0])), *(stretch for stretch, _ in held)])
    of_each = (np.repeat(zs[:, None], len(T), axis=1) for T, zs in held)
    z = np.concatenate([np.empty((omega.size, 0), dtype=complex), *of_each], axis=1)
    free = _without_supports(cell)
    places = _places(d, np.concatenate([rows, loads.T, observed.T])[:, :rail])
    at = (d * places[:, None] + np.arange(d)).ravel()
    P = _rail(free, d, places, omega)
    S, F, W = rows[:, at], loads[at], observed[at].T
    below = _Below.of(free, rail, omega, rows, loads, observed, z)
    P += S.T @ below.held @ S
    F = F - S.T @ below.loads
    W = W - below.motions @ S
    # Rail's places but the ends, for motions of the ends and for loads.
    ends, inner = np.r_[0:d, at.size - d : at.size], np.arange(d, at.size - d)
    right = np.concatenate([P[:, inner[:, None], ends], F[:, inner]], axis=2)
    solved = np.linalg.solve(P[:, inner[:, None], inner], right)
    follow, moved = solved[:, :, : 2 * d], solved[:, :, 2 * d :]
    up = np.swapaxes(follow, 1, 2)
    return CondensedCell(
        stiffness=P[:, ends[:, None], ends] - P[:, ends[:, None], inner] @ follow,
        forces=F[:, ends] - up @ F[:, inner],
        motions=W[:, :, ends] - W[:, :, inner] @ follow,
        within=W[:, :, inner] @ moved + below.within,
    )


def _without_supports(cell: Cell) -> Matrices:
    """The cell's matrices with nothing between the rail and what is below."""
    below, rail = slice(cell.rail_size, None), slice(cell.rail_size)
    K: ComplexArray = cell.K + 1j * cell.K_loss
    C: ComplexArray = 1j * cell.C.astype(complex)
    sizes = [np.abs(A[below, below]).max(initial=0.0) for A in (K, C)]
    for support in cell.supports:
        square = support.stretch.T @ support.stretch
        K -= (support.stiffness + 1j * support.loss) * square
        C -= 1j * support.damping * square
    for A, size in zip((K, C), sizes, strict=True):
        for part in (A[below, below], A[rail, below], A[below, rail]):
            part[np.abs(part) <= ROUNDING * size] = 0
    if any(np.any(A[rail, below]) for A in (K, C)):
        raise ValueError("only supports may couple the rail with what is below it")
    return K, C, -cell.M.astype(complex)


def _places(d: int, rows: FloatArray) -> Indices:
    """Rail nodes that something happens at: the ends, and those in any row."""
    touched = np.any(rows, axis=0).reshape(-1, d).any(axis=1)
    touched[[0, -1]] = True
    return np.flatnonzero(touched)


def _rail(free: Matrices, d: int, places: Indices, omega: FloatArray) -> ComplexArray:
    """Dynamic stiffness of the rail between its places, shape (n_omega, d n, d n)."""
    at = (d * places[:, None] + np.arange(d)).ravel()
    P = _at_frequencies(omega, [A[np.ix_(at, at)] for A in free])
    spans = _Spans(free, d, omega)
    for k, (first, last) in enumerate(pairwise(places)):
        here = slice(d * k, d * (k + 2))
        P[:, here, here] -= spans.inside(int(first), int(last))
    return P


class _Spans:
    """Spans of the rail without places, by halves: what is alike is eliminated once."""

    def __init__(self, free: Matrices, d: int, omega: FloatArray) -> None:
        self.free, self.d, self.omega = free, d, omega
        self.known: list[tuple[ComplexArray, ComplexArray]] = []

    def inside(self, first: int, last: int) -> ComplexArray | float:
        """What the nodes between two take off the stiffness of these, (n_omega, 2 d, 2 d)."""
        if last - first == 1:
            return 0.0
        whole = slice(self.d * first, self.d * (last + 1))
        span = np.stack([A[whole, whole] for A in self.free])
        span[:, : self.d, : self.d] = span[:, -self.d :, -self.d :] = 0  # the ends' own
        found = next((taken for one, taken in self.known if _same(one, span)), None)
        if found is None:
            found = self._halved(first, (first + last) // 2, last)
            self.known.append((span, found))
        return found

    def _halved(self, first: int, middle: int, last: int) -> ComplexArray:
        d = self.d
        at = np.concatenate([d * node + np.arange(d) for node in (first, middle, last)])
        D = _at_frequencies(self.omega, [A[np.ix_(at, at)] for A in self.free])
        D[:, :d, :d] = D[:, -d:, -d:] = 0
        for part, half in ((slice(2 * d), (first, middle)), (slice(d, None), (middle, last))):
            D[:, part, part] -= self.inside(*half)
        ends, mid = np.r_[:d, 2 * d : 3 * d], slice(d, 2 * d)
        coupling = D[:, mid, ends]
        taken: ComplexArray = np.swapaxes(coupling, 1, 2) @ np.linalg.solve(
            D[:, mid, mid], coupling
        )
        return taken - D[:, ends[:, None], ends]


def _same(one: ComplexArray, other: ComplexArray) -> bool:
    """Whether two spans have the same matrices."""
    return one.shape == other.shape and all(
        np.abs(a - b).max() <= SAME * np.abs(a).max() for a, b in zip(one, other, strict=True)
    )


def _at_frequencies(omega: FloatArray, coefficients: list[ComplexArray]) -> ComplexArray:
    """Polynomial in omega with arrays for coefficients: one product, the frequencies in front."""
    powers = (omega[:, None] ** np.arange(len(coefficients))).astype(complex)
    values: ComplexArray = powers @ np.stack([c.ravel() for c in coefficients])
    return values.reshape(omega.size, *coefficients[0].shape)


@dataclass(frozen=True, kw_only=True)
class _Below:
    """What supports stand on, once its own motion is eliminated.

    Attributes
    ----------
    held : array, shape (n_omega, n_springs, n_springs)
        Forces of the supports for motions of the rail there.
    loads, motions : array, shape (n_omega, n_springs, n_loads) and (n_omega, n_observed, n_springs)
        Forces of the supports for loads below, the rail being held, and (reciprocal) motions
        below for motions of the rail.
    within : array, shape (n_omega, n_observed, n_loads)
        Motions below for loads below, the rail being held.
    """

    held: ComplexArray
    loads: ComplexArray
    motions: ComplexArray
    within: ComplexArray

    @classmethod
    def of(
        cls, free: Matrices, rail: int, omega: FloatArray, rows: FloatArray, loads: FloatArray,
        observed: FloatArray, z: ComplexArray,
    ) -> _Below:  # fmt: skip
        """Eliminate it; z of each support, shape (n_omega, n_springs)."""
        n, n_loads = len(rows), loads.shape[1]
        X = np.concatenate([rows[:, rail:], loads[rail:].T, observed[rail:].T])
        G = _flexibility([A[rail:, rail:] for A in free], omega, X)
        # Forces s = z (T w + g - G s), with the flexibility G of what is below and its motion g.
        held = np.zeros((omega.size, n, n), dtype=complex)
        held[:, np.arange(n), np.arange(n)] = z
        on = np.flatnonzero(np.any(rows[:, rail:], axis=1))
        if on.size:
            within = np.eye(on.size) + z[:, on, None] * G[:, on[:, None], on]
            held[:, on[:, None], on] = np.linalg.solve(within, held[:, on[:, None], on])
        given, seen = slice(n, n + n_loads), slice(n + n_loads, None)
        forces, motions = held @ G[:, :n, given], G[:, seen, :n] @ held
        return cls(
            held=held, loads=forces, motions=motions,
            within=G[:, seen, given] - G[:, seen, :n] @ forces,
        )  # fmt: skip


def _flexibility(free: list[ComplexArray], omega: FloatArray, X: FloatArray) -> ComplexArray:
    """X D^-1 X' of what is below, (n_omega, n, n); a sum over modes where these do not meet."""
    if any(np.any(A - np.diag(A.diagonal())) for A in free):
        D = _at_frequencies(omega, free)
        return X @ np.linalg.solve(D, np.broadcast_to(X.T, (omega.size, *X.T.shape)))
    each = 1 / _at_frequencies(omega, [A.diagonal() for A in free])
    pairs = (X[:, None] * X[None]).reshape(len(X) ** 2, X.shape[1]).T
    summed = each.real @ pairs + 1j * (each.imag @ pairs)  # real products: half the work
    return summed.reshape(omega.size, len(X), len(X))
