"""Waves along an infinite track of equal cells: how they decay, and the receptance they make.

At a real frequency the cells' ends obey, with the stiffness of a condensed cell
[[S_ll, S_lr], [S_rl, S_rr]],

    S_rl u[j-1] + (S_ll + S_rr) u[j] + S_lr u[j+1] = f[j].

Two cells joined are one of twice the length; joined over and over they become half a track without
end, of which only the stiffness at its beginning is left. Errors of that fall as lambda^(2^n), with
lambda the decay of the slowest wave from cell to cell, and no eigenvector is needed: nothing is
lost where waves become one. Only where nothing at all damps them, waves never die on the way: those
that carry power away from the load are taken, the limit of small damping.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from railcosim.mechanics.arrays import ComplexArray

from .condensation import CondensedCell

DOUBLINGS = 34  # of cells: waves with a decay of 1e-9 from cell to cell have died
DEAD = 1e-25  # of the cell's stiffness: what is left between the ends of a long track
TRAVELLING = 1e-6  # ||lambda| - 1| below which the way the power flows tells the side, not decay


@dataclass(frozen=True, kw_only=True)
class Waves:
    """The waves that run away from a load to either side, as many as a node has unknowns, d.

    Attributes
    ----------
    forward, backward : array, shape (n_omega, d, d)
        Motion of a cell's end from that of the end before, away from the load.
    at_load : array, shape (n_omega, d, d)
        Motion of a cell's end for unit loads there.
    """

    forward: ComplexArray
    backward: ComplexArray
    at_load: ComplexArray

    @cached_property
    def decay(self) -> ComplexArray:
        """Factors lambda from one cell to the next, the slowest wave first, (n_omega, d)."""
        factor: ComplexArray = np.linalg.eigvals(self.forward).astype(complex)
        order = np.argsort(-np.abs(factor), axis=1)
        return np.take_along_axis(factor, order, axis=1)

    def away(self, cells: int) -> ComplexArray:
        """Motion for unit loads that many cells behind (or, if negative, ahead)."""
        if cells not in self._known:
            step, back = (self.forward, -1) if cells > 0 else (self.backward, 1)
            near = self._known.get(cells + back)
            if near is None:
                near = np.linalg.matrix_power(step, abs(cells) - 1) @ self.at_load
            self._known[cells] = step @ near
        return self._known[cells]

    @cached_property
    def _known(self) -> dict[int, ComplexArray]:
        """Motions that were asked for, by cells; neighbours are mostly asked for together."""
        return {0: self.at_load}

    def is_same(self, cells: int) -> bool:
        """Whether that many cells further is the same cell."""
        return cells == 0


def waves(cell: CondensedCell) -> Waves:
    """Find the waves of the infinite track.

    Parameters
    ----------
    cell : CondensedCell
        Between its ends; loads inside do not matter.

    Returns
    -------
    Waves

    References
    ----------
    Mead, D. J. (1973), A general theory of harmonic wave propagation in linear periodic systems
    with multiple coupling, J. Sound Vib. 27(2), 235-260.
    """
    left_left, right, left, right_right = _quarters(cell.stiffness)
    ahead, behind = half_tracks(cell.stiffness)
    forward = np.linalg.solve(right_right + ahead, -left).astype(complex)
    backward = np.linalg.solve(left_left + behind, -right).astype(complex)
    at_load = np.linalg.inv(ahead + behind).astype(complex)
    return Waves(forward=forward, backward=backward, at_load=at_load)


def _quarters(S: ComplexArray) -> tuple[ComplexArray, ...]:
    d = S.shape[1] // 2
    return S[:, :d, :d], S[:, :d, d:], S[:, d:, :d], S[:, d:, d:]


def half_tracks(S: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Stiffness of the tracks ahead of an end and behind it, each (n_omega, d, d)."""
    ahead, right, left, behind = _quarters(S)
    size = np.abs(S).max(axis=(1, 2))
    for _ in range(DOUBLINGS):
        inner = np.linalg.inv(behind + ahead)
        past, back = right @ inner, left @ inner
        ahead, behind = ahead - past @ left, behind - back @ right
        right, left = -past @ right, -back @ left
        alive = np.abs(right).max(axis=(1, 2)) > DEAD * size
        if not alive.any():
            return ahead, behind
    for k in np.flatnonzero(alive):
        ahead[k], behind[k] = _undamped(S[k])
    return ahead, behind


def _undamped(S: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """The same at one frequency, from single waves: each d x d."""
    d = len(S) // 2
    size = np.sqrt(np.abs(S).max(axis=1).reshape(2, d).max(axis=0))  # moments beside forces
    scaled = (S / np.outer(np.tile(size, 2), np.tile(size, 2))).astype(complex)
    left_left, right, left, right_right = (part[0] for part in _quarters(scaled[None]))
    own, back = left_left + right_right, np.outer(size, size)
    # f u = v, left u + own v + f right v = 0.
    nothing, one = np.zeros((d, d)), np.eye(d)
    factor, vectors = eig(np.block([[nothing, one], [-left, -own]]),
                          np.block([[one, nothing], [nothing, right]]))  # fmt: skip
    u = vectors[:d]
    force = left_left @ u + (right @ u) * factor
    power = np.sum(np.conj(u) * force, axis=0).imag
    travels = np.abs(np.abs(factor) - 1) < TRAVELLING
    # Ahead run those that decay or carry power forward, the first d of all.
    order = np.argsort(np.where(travels, np.where(power > 0, -1, 1), np.log(np.abs(factor))))
    ahead, behind = order[:d], order[d:]

    def step(which: NDArray[np.intp], factors: ComplexArray) -> ComplexArray:
        shapes: ComplexArray = u[:, which]
        return np.linalg.solve(shapes.T, (shapes * factors).T).T.astype(complex)

    return (
        back * (left_left + right @ step(ahead, factor[ahead])),
        back * (right_right + left @ step(behind, 1 / factor[behind])),
    )
