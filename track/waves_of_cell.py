"""Undamped waves of one wavenumber: what a ring of cells moves in, turned by a phase a cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .cell import Cell


@dataclass(frozen=True, kw_only=True)
class WavesOfCell:
    """Shapes of one wavenumber, of unit mass and apart but for damping.

    Attributes
    ----------
    mu : float
        Phase from cell to cell, rad.
    turn : array, shape (n_unknowns, n_closed)
        Open cell from closed one, see `bloch`.
    squared : array, shape (m,)
        Squares of their frequencies, rad2/s2.
    basis : array, shape (n_closed, m)
        The shapes, in the unknowns of the closed cell.
    damping : array, shape (m, m)
        Among them.
    """

    mu: float
    turn: ComplexArray
    squared: FloatArray
    basis: ComplexArray
    damping: ComplexArray


def all_waves(cell: Cell, mu: float) -> WavesOfCell:
    """All of them."""
    T = bloch(cell, mu)
    M, C, K = (T.conj().T @ A @ T for A in (cell.M, cell.viscous_damping(), cell.K))
    squared, basis = eigh(K, M)
    return WavesOfCell(
        mu=mu, turn=T, squared=squared, basis=basis, damping=basis.conj().T @ C @ basis
    )


def bloch(cell: Cell, mu: float) -> ComplexArray:
    """Open cell from closed one: the last rail node is the first one's, e^{i mu} further."""
    size, n, d = cell.K.shape[0], cell.rail_size, cell.section.size
    T = np.eye(size, dtype=complex)
    T[np.arange(n - d, n), np.arange(d)] = np.exp(1j * mu)
    return np.delete(T, np.arange(n - d, n), axis=1)
