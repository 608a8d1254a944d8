"""Waves along an infinite track of equal cells: how they decay, and the receptance they make.

At a real frequency the cells' ends obey, with the stiffness of a condensed cell
[[S_ll, S_lr], [S_rl, S_rr]],

    S_rl u[j-1] + (S_ll + S_rr) u[j] + S_lr u[j+1] = f[j].

Its free waves u[j] = lambda^j u come in pairs lambda and 1/lambda (reciprocity), so the quartic for
lambda is a quadratic for lambda + 1/lambda. What decays away from a load, u[j+1] = X u[j], has the
two lambda of a side as eigenvalues; with their sum s and product p, X^2 = s X - p turns the
equation for X into a linear one, and no eigenvector is needed: nothing is lost where two waves
become one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .condensation import CondensedCell

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TRAVELLING = 1e-6  # ||lambda| - 1| below which the way the power flows tells the side, not decay
LENGTH = 0.1  # m, a rail's own: rotations times it are of the size of deflections


@dataclass(frozen=True, kw_only=True)
class Waves:
    """The two waves that run away from a load to either side.

    Attributes
    ----------
    decay : array, shape (n_omega, 2)
        Factors lambda from one cell to the next, the slowest wave first.
    forward, backward : array, shape (n_omega, 2, 2)
        [w, theta] at a cell's end from those at the end before, away from the load.
    at_load : array, shape (n_omega, 2, 2)
        [w, theta] at a cell's end for a unit force and a unit moment there.
    """

    decay: ComplexArray
    forward: ComplexArray
    backward: ComplexArray
    at_load: ComplexArray

    def away(self, cells: int) -> ComplexArray:
        """[w, theta] for unit loads that many cells behind (or, if negative, ahead)."""
        step = self.forward if cells >= 0 else self.backward
        powers: ComplexArray = np.linalg.matrix_power(step, abs(cells)) @ self.at_load
        return powers

    def is_same(self, cells: int) -> bool:
        """Whether that many cells further is the same cell."""
        return cells == 0


def waves(cell: CondensedCell) -> Waves:
    """Find the waves of the infinite track.

    Where nothing damps, waves travel without decay: those that carry power away from the load are
    taken, the limit of small damping.

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
    scale = np.array([1.0, 1 / LENGTH])
    S = cell.stiffness * np.outer(np.tile(scale, 2), np.tile(scale, 2))
    right, left = S[:, :2, 2:], S[:, 2:, :2]
    own = S[:, :2, :2] + S[:, 2:, 2:]
    factor = _decaying(S)
    s, p = factor.sum(axis=1)[:, None, None], factor.prod(axis=1)[:, None, None]
    forward = np.linalg.solve(own + s * right, p * right - left)
    backward = np.linalg.solve(own + s * left, p * left - right)
    at_load = np.linalg.inv(left @ backward + own + right @ forward).astype(complex)
    similar = scale[:, None] / scale
    return Waves(
        decay=factor,
        forward=forward * similar,
        backward=backward * similar,
        at_load=at_load * np.outer(scale, scale),
    )


def _decaying(S: ComplexArray) -> ComplexArray:
    """The two lambda of waves that run forward, the slower first, shape (n_omega, 2)."""
    right, left = S[:, :2, 2:], S[:, 2:, :2]
    own = S[:, :2, :2] + S[:, 2:, 2:]
    # det(lambda right + own + left / lambda) = a z^2 + b z + c with z = lambda + 1 / lambda.
    a = _mixed(right, right) / 2
    b = _mixed(right, own)
    c = _mixed(own, own) / 2 + _mixed(right, left) - 2 * a
    root = np.sqrt(b * b - 4 * a * c)
    large = -(b + np.where((np.conj(b) * root).real >= 0, root, -root)) / 2
    z = np.stack([c / large, large / a], axis=1)
    root = np.sqrt(z / 2 - 1) * np.sqrt(z / 2 + 1)
    growing = z / 2 + np.where((np.conj(z) * root).real >= 0, root, -root)
    factor = 1 / growing
    travels = np.abs(np.abs(factor) - 1) < TRAVELLING
    away = np.where(travels & (_power(S, factor) < 0), growing, factor)
    order = np.argsort(-np.abs(away), axis=1)
    sorted_: ComplexArray = np.take_along_axis(away, order, axis=1)
    return sorted_


def _mixed(A: ComplexArray, B: ComplexArray) -> ComplexArray:
    """What is bilinear in det(A + B): det A + _mixed(A, B) + det B."""
    mixed: ComplexArray = (
        A[:, 0, 0] * B[:, 1, 1] + A[:, 1, 1] * B[:, 0, 0]
        - A[:, 0, 1] * B[:, 1, 0] - A[:, 1, 0] * B[:, 0, 1]
    )  # fmt: skip
    return mixed


def _power(S: ComplexArray, factor: ComplexArray) -> FloatArray:
    """Power that each wave carries forward, but for a positive factor, shape (n_omega, 2)."""
    f = factor[:, :, None, None]
    Q = f * S[:, None, :2, 2:] + (S[:, :2, :2] + S[:, 2:, 2:])[:, None] + S[:, None, 2:, :2] / f
    # The wave is what Q leaves at rest: at right angles to its larger row.
    rows = np.linalg.norm(Q, axis=3)
    row = np.take_along_axis(Q, np.argmax(rows, axis=2)[:, :, None, None], axis=2)[:, :, 0]
    u = np.stack([-row[..., 1], row[..., 0]], axis=2)
    force = np.einsum("wfij,wfj->wfi", S[:, None, :2, :2] + f * S[:, None, :2, 2:], u)
    power: FloatArray = np.einsum("wfi,wfi->wf", np.conj(u), force).imag
    return power
