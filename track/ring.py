"""Complex modes of N equal cells closed into a ring, from one Bloch eigenproblem per wavenumber."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .attached import against_attached, attached
from .cell import Cell
from .waves_of_cell import WavesOfCell, all_waves

REAL_POLE = 1e-9  # |Im| / |lambda| below which a pole counts as real (overdamped)
SAME_SHAPE = 1e-6  # relative difference below which two shapes count as one; rounding gives 1e-9


@dataclass(frozen=True, kw_only=True)
class RingModes:
    """Modes of the ring for one parity.

    With shapes U_r(x) = shapes[:, r] exp(i mu_r c) in cell c, forces f move the modes by
    ds_r/dt = lambda_r s_r + U_p(x) f, p = partner[r], and the deflection is Re(sum_r U_r(x) s_r).
    The partner of a wave is the one that runs the other way; a standing wave is its own, unless
    others share its pole.

    Attributes
    ----------
    poles : array, shape (n,)
        Complex poles lambda, rad/s, one of each conjugate pair.
    mu : array, shape (n,)
        Phase from cell to cell, rad.
    partner : array of int, shape (n,)
        The mode whose shape receives the force.
    shapes : array, shape (n_unknowns, n)
        In the unknowns of the open cell.
    """

    poles: ComplexArray
    mu: FloatArray
    partner: NDArray[np.intp]
    shapes: ComplexArray

    @classmethod
    def joined(cls, parts: Sequence[RingModes]) -> RingModes:
        """Modes of several, one behind the other; shapes stay with their own."""
        offsets = np.cumsum([0, *(part.poles.size for part in parts[:-1])])
        pairs = zip(parts, offsets, strict=True)
        return cls(
            poles=np.concatenate([part.poles for part in parts]),
            mu=np.concatenate([part.mu for part in parts]),
            partner=np.concatenate([part.partner + offset for part, offset in pairs]),
            shapes=np.concatenate([part.shapes for part in parts], axis=1),
        )

    def some(self, kept: NDArray[np.bool_]) -> RingModes:
        """Some of them; partners are kept together."""
        return RingModes(
            poles=self.poles[kept],
            mu=self.mu[kept],
            partner=(np.cumsum(kept) - 1)[self.partner[kept]],
            shapes=self.shapes[:, kept],
        )

    def weighted(self, weight: FloatArray) -> RingModes:
        """Modes that take part with a weight; partners, having one pole, have one weight."""
        return replace(self, shapes=self.shapes * np.sqrt(weight))


def ring_modes(cell: Cell, highest_frequency: float, cells: int | None = None) -> RingModes:
    """Complex modes of the ring of `cell.track.mesh.cells` cells, below a frequency.

    The damping is not proportional and is diagonalised in ALL undamped modes of the cell: with
    those above the frequency left out beforehand, the fastenings' dampers would no longer couple
    low modes to high ones, and what is missing near a railseat would be off by a quarter at 1 kHz.

    Parameters
    ----------
    cell : Cell
        One parity of the cell.
    highest_frequency : float
        Of the modes kept, |lambda| / 2 pi, Hz.
    cells : int, optional
        In the ring, if others than the track says; at least 1.

    Returns
    -------
    RingModes

    References
    ----------
    Tisseur, F. & Meerbergen, K. (2001), The quadratic eigenvalue problem, SIAM Rev. 43(2).
    """
    N = cell.track.mesh.cells if cells is None else cells
    parts = [
        _damped(
            all_waves(cell, 2 * np.pi * q / N), highest_frequency,
            standing=not 2 * q % N, cells=N,
        )
        for q in range(N // 2 + 1)
    ]  # fmt: skip
    return RingModes.joined(parts)


def passive_modes(cell: Cell, highest_frequency: float) -> tuple[RingModes, RingModes]:
    """Complex modes of a ring that moves in `attached` shapes only, all of them.

    As nothing is left out of that ring, it gives no power, whatever its dampers are.

    Parameters
    ----------
    cell : Cell
        One parity of the cell.
    highest_frequency : float
        Of the undamped modes, which fade out towards it, Hz.

    Returns
    -------
    modes, elastic : RingModes
        The modes; and what the attached shapes have at rest, of poles 1: the sum of their residues.
    """
    N = cell.track.mesh.cells
    modes, elastic = [], []
    pulled: list[FloatArray] = []
    beyond: list[FloatArray] = []
    for q in range(N // 2 + 1):
        standing = q in (0, N // 2)
        waves, *rest = attached(cell, 2 * np.pi * q / N, highest_frequency, standing=standing)
        modes.append(_damped(waves, np.inf, standing=standing, cells=N))
        for part, of_wave in zip((pulled, beyond), rest, strict=True):
            part.append((1 if standing else 2) / N * of_wave.real)
    shapes = against_attached(cell, np.sum(pulled, axis=0), np.sum(beyond, axis=0)) / np.sqrt(N)
    for q in range(N // 2 + 1):
        elastic.append(_elastic(2 * np.pi * q / N, shapes, standing=q in (0, N // 2)))
    return RingModes.joined(modes), RingModes.joined(elastic)


def _elastic(mu: float, shapes: ComplexArray, *, standing: bool) -> RingModes:
    """Of one wavenumber and its opposite; standing waves have real shapes, being their own."""
    own = np.arange(shapes.shape[1])
    if standing:
        return RingModes(
            poles=np.ones(own.size, dtype=complex),
            mu=np.full(own.size, mu),
            partner=own,
            shapes=shapes.astype(complex),
        )
    return RingModes(
        poles=np.ones(2 * own.size, dtype=complex),
        mu=np.repeat([mu, -mu], own.size),
        partner=np.concatenate([own + own.size, own]),
        shapes=np.concatenate([shapes, shapes], axis=1).astype(complex),
    )


def _damped(undamped: WavesOfCell, highest: float, *, standing: bool, cells: int) -> RingModes:
    """Modes of one wavenumber and its opposite."""
    mu, T, basis = undamped.mu, undamped.turn, undamped.basis
    squared, m = undamped.squared, undamped.squared.size
    A = np.block([[np.zeros((m, m)), np.eye(m)], [-np.diag(squared), -undamped.damping]])
    poles, right = eig(A)
    left = np.linalg.inv(right)
    forward = T @ (basis @ right[:m])  # deflection of a wave e^{+i mu c}
    # What a force does to it, f -> left @ basis^H T^H f, is the shape of the wave e^{-i mu c}.
    backward = (left[:, m:] @ basis.conj().T @ T.conj().T).T
    is_real = np.abs(poles.imag) < REAL_POLE * np.abs(poles)
    chosen = ((poles.imag > 0) | is_real) & (np.abs(poles) < 2 * np.pi * highest)
    # One of each conjugate pair stands for both (weight 2); the force on one of N cells is 1/N.
    # A real pole of a travelling wave is its own conjugate, with the opposite wave as the other.
    weight = np.where(is_real, 1.0, 2.0)[chosen] / cells
    poles, forward, backward = poles[chosen], forward[:, chosen], backward[:, chosen]
    balance = np.sqrt(
        weight * np.linalg.norm(backward, axis=0) / np.linalg.norm(forward, axis=0)
    )  # fmt: skip
    forward, backward = forward * balance, backward * weight / balance
    n, alike = poles.size, np.zeros(poles.size, dtype=bool)
    if standing:
        # backward and forward are one shape up to a complex factor: share it between them. Not so
        # for modes of one pole, which mix: they stay two waves, each with half the weight.
        at = np.argmax(np.abs(forward), axis=0)
        ratio = backward[at, np.arange(n)] / forward[at, np.arange(n)]
        rest = np.linalg.norm(forward * ratio - backward, axis=0)
        alike = rest < SAME_SHAPE * np.linalg.norm(backward, axis=0)
        forward = forward * np.where(alike, np.sqrt(ratio), np.sqrt(0.5))
        backward = backward * np.sqrt(0.5)
    pair = np.flatnonzero(~alike)
    partner = np.arange(n + pair.size)
    partner[pair], partner[n:] = partner[n:], pair.copy()
    return RingModes(
        poles=np.concatenate([poles, poles[pair]]),
        mu=np.concatenate([np.full(n, mu), np.full(pair.size, -mu)]),
        partner=partner,
        shapes=np.concatenate([forward, backward[:, pair]], axis=1),
    )
