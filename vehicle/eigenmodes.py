"""Eigenmodes of linear equations of motion: undamped and damped, paired by their shapes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig, eigh
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import connected_components

from railcosim.mechanics.arrays import ComplexArray, FloatArray

FREE = 1e-10  # of the greatest eigenvalue: rounding is 1e-15, springs differ by 1e4
SLOW = 1e-3  # rad/s, two hours a period: double poles at 0 are split by rounding, 1e-5
FASTEST = 1e9  # rad/s: poles without end, of what has neither mass nor damping, are rounded
ALIKE = 1e-9  # relative difference of eigenvalues whose shapes are any mixture, by rounding
REAL = 1e-7  # of a pole's size: two poles that meet are split by the root of rounding, 1e-8


@dataclass(frozen=True, kw_only=True)
class Oscillation:
    """One mode.

    Attributes
    ----------
    undamped : float
        Natural frequency without any damper, rad/s. Of a system with creep, the pole's size.
    damped : float
        Frequency at which it swings, rad/s; 0 if it does not.
    damping_ratio : float
        Decay over natural frequency: above 1 it does not swing, below 0 it grows.
    shape : array, shape (n,)
        Displacements of the coordinates; its greatest energy is one of real motion.
    """

    undamped: float
    damped: float
    damping_ratio: float
    shape: ComplexArray

    @classmethod
    def of(cls, pole: complex, shape: ComplexArray, M: FloatArray) -> Oscillation:
        """What a pole (rad/s) says."""
        size = abs(pole)
        return cls(
            undamped=size,
            damped=pole.imag,
            damping_ratio=_ratio(pole, size),
            shape=_turned(shape, M),
        )

    @property
    def pole(self) -> complex:
        """The one that swings forward, rad/s."""
        return complex(-self.damping_ratio * self.undamped, self.damped)


@dataclass(frozen=True, kw_only=True)
class Oscillations:
    """All modes but free motions, by natural frequency.

    Attributes
    ----------
    modes : tuple of Oscillation
        Those that swing, or would without dampers, and those that grow.
    free : int
        Motions that nothing holds.
    """

    modes: tuple[Oscillation, ...]
    free: int


def oscillations(M: FloatArray, C: FloatArray, K: FloatArray, place: FloatArray) -> Oscillations:
    """Modes of springs and dampers; M and K symmetric.

    A mode has a natural frequency, that without dampers, and two poles, which are found by the
    likeness of their shapes to that without.

    Parameters
    ----------
    M, C, K : array, shape (n, n)
        Mass, damping, stiffness.
    place : array, shape (n,)
        Where each coordinate's body is along the track, m: equal frequencies are told apart by it.

    Raises
    ------
    ArithmeticError
        If something topples: a stiffness below zero.
    """
    omega2, shapes = eigh(K, M)
    if omega2[0] < -FREE * omega2[-1]:
        raise ArithmeticError(
            "the vehicle topples over: its weights are stronger than the springs that hold it"
        )
    keep = omega2 > FREE * omega2[-1]
    omega, shapes = np.sqrt(omega2[keep]), _told_apart(omega2[keep], shapes[:, keep], place)
    D = shapes.T @ C @ shapes
    # Modes that no damper joins are solved apart: of equal poles any mixture would be a mode.
    count, part = connected_components(np.abs(D) > FREE * np.abs(D).max(initial=0.0))
    found = [
        Oscillation(
            undamped=float(omega[own][i]),
            damped=float(max(a.imag, 0.0)),
            # Of a pair p and q the polynomial is s^2 - (p + q) s + p q.
            damping_ratio=_ratio((a + b) / 2, float(np.sqrt((a * b).real))),
            shape=_turned(shapes[:, own] @ vector, M),
        )
        for own in (np.flatnonzero(part == k) for k in range(count))
        for i, a, b, vector in _pairs(
            *poles_of(np.eye(own.size), D[np.ix_(own, own)], np.diag(omega[own] ** 2))
        )
    ]
    found.sort(key=lambda mode: mode.undamped)
    return Oscillations(modes=tuple(found), free=int(np.sum(~keep)))


def swings(M: FloatArray, C: FloatArray, K: FloatArray) -> Oscillations:
    """Modes of a system with creep, which is no set of springs; those that swing or grow.

    Parameters
    ----------
    M, C, K : array, shape (n, n)
        Any but for M, which is symmetric.
    """
    poles, vectors = poles_of(M, C, K)
    seen = (np.abs(poles) > SLOW) & ((poles.imag > 0) | ((poles.imag == 0) & (poles.real > 0)))
    found = [
        Oscillation.of(complex(p), vector, M)
        for p, vector in zip(poles[seen], vectors.T[seen], strict=True)
    ]
    found.sort(key=lambda mode: mode.undamped)
    size = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    return Oscillations(modes=tuple(found), free=len(M) - int(np.linalg.matrix_rank(K / size)))


def _ratio(pole: complex, size: float) -> float:
    """Damping ratio; what is rounding is none."""
    ratio = -pole.real / size
    return ratio if abs(ratio) > REAL**2 else 0.0


def poles_of(
    M: FloatArray, C: FloatArray, K: FloatArray | ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Poles (rad/s), real ones exactly so, and displacements of their vectors as columns.

    Coordinates without mass come last; they have no velocity of their own.
    """
    n = len(M)
    heavy = int(np.count_nonzero(np.diag(M)))
    if heavy == n:
        poles, vectors = eig(
            np.vstack([np.eye(n, 2 * n, n), -np.linalg.solve(M, np.hstack([K, C]))])
        )
    else:
        # Rails are a thousand times as stiff as suspensions: brought to one size, for rounding.
        size = 1 / np.sqrt(np.abs(np.diag(K)) + np.diag(M))
        M, C, K = (size[:, None] * A * size for A in (M, C, K))
        # M v' + C q' + K q = 0 and q' = v, v of what has mass.
        E = np.block([[C, M[:, :heavy]], [np.eye(heavy, n), np.zeros((heavy, heavy))]])
        A = np.block([[-K, np.zeros((n, heavy))], [np.zeros((heavy, n)), np.eye(heavy)]])
        poles, vectors = eig(A, E)
        finite = np.isfinite(poles) & (np.abs(poles) < FASTEST)
        poles, vectors = poles[finite], vectors[:, finite]
        vectors[:n] *= size[:, None]
    poles = np.where(np.abs(poles.imag) <= REAL * np.abs(poles), poles.real, poles)
    return poles.astype(complex), vectors[:n].astype(complex)


def _pairs(
    poles: ComplexArray, vectors: ComplexArray
) -> Iterator[tuple[int, complex, complex, ComplexArray]]:
    """Of every natural mode its two poles and a vector, in modal coordinates of mass 1."""
    m = len(vectors)
    likeness = np.abs(vectors) ** 2 / (np.abs(vectors) ** 2).sum(axis=0)
    pairs = np.flatnonzero(poles.imag > 0)
    modes, chosen = linear_sum_assignment(likeness[:, pairs], maximize=True)
    owner = dict(zip(modes.tolist(), pairs[chosen].tolist(), strict=True))
    # What does not swing: two real poles a mode.
    others = [i for i in range(m) if i not in owner]
    real = np.flatnonzero(poles.imag == 0)
    _, chosen = linear_sum_assignment(likeness[others][:, real].repeat(2, axis=0), maximize=True)
    alone = dict(zip(others, real[chosen].reshape(-1, 2).tolist(), strict=True))
    for i in range(m):
        if i in owner:
            j = owner[i]
            yield i, complex(poles[j]), complex(poles[j].conjugate()), vectors[:, j]
        else:
            a, b = sorted(alone[i], key=lambda j: float(poles[j].real))
            yield i, complex(poles[a]), complex(poles[b]), vectors[:, b]


def _told_apart(omega2: FloatArray, shapes: FloatArray, place: FloatArray) -> FloatArray:
    """Of modes of one frequency those that are each at a place of their own."""
    apart = shapes.copy()
    starts = np.flatnonzero(np.diff(omega2, prepend=-np.inf) > ALIKE * omega2)
    for begin, end in zip(starts, [*starts[1:], omega2.size], strict=True):
        if end - begin > 1:
            some = shapes[:, begin:end]
            _, turn = np.linalg.eigh(some.T @ (place[:, None] * some))
            apart[:, begin:end] = some @ turn[:, ::-1]
    return apart


def _turned(shape: ComplexArray, M: FloatArray) -> ComplexArray:
    """A shape whose coordinate of most energy is 1 of its size, and real."""
    energy = np.abs(shape) ** 2 * np.diag(M)
    most = shape[np.argmax(energy)]
    turned: ComplexArray = shape * np.exp(-1j * np.angle(most)) / np.sqrt(energy.sum())
    return turned
