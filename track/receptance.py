"""Direct receptance of the ring: one cell condensed to its ends, N of them closed by Bloch waves.

Nothing is truncated: at every frequency the finite elements are solved as they stand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cell import EVEN, ODD, Cell, build_cell
from .parameters import Track

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Progress = Callable[[int, int], None]

BLOCK = 32  # frequencies solved at once: some 20 MB of matrices


@dataclass(frozen=True, kw_only=True)
class Point:
    """A point of the track where it is loaded or observed.

    Attributes
    ----------
    x : float
        Along the ring, m; it wraps. Cells begin at multiples of the cell length.
    side : int
        -1 left, 1 right.
    slab_y : float or None
        None: on the rail of that side. Else on the slab, this far from the centre line (m, >= 0).
    """

    x: float
    side: int = -1
    slab_y: float | None = None

    def row(self, cell: Cell) -> FloatArray:
        """Participation in the unknowns of its cell, shape (n,)."""
        x = self.x % cell.track.cell_length
        row = cell.rail_row(x) if self.slab_y is None else cell.slab_row(x, self.slab_y)
        return row * (self.side if cell.parity == ODD else 1)


def direct_receptance(
    track: Track,
    omega: FloatArray,
    loads: list[Point],
    observed: list[Point],
    progress: Progress | None = None,
    *,
    viscous: bool = False,
) -> ComplexArray:
    """Receptance between points of the ring, solved directly from the finite elements.

    Parameters
    ----------
    track : Track
        Parameters.
    omega : array, shape (n_omega,)
        Frequencies, rad/s; zero is the static flexibility.
    loads, observed : list of Point
        Where a unit force acts (down), and where the deflection (down) is wanted.
    progress : callable, optional
        Called with (done, total).
    viscous : bool
        Loss factors as viscous damping, as the time domain has them.

    Returns
    -------
    array, shape (n_omega, n_observed, n_loads)
        m/N.

    References
    ----------
    Mead, D. J. (1973), A general theory of harmonic wave propagation in linear periodic systems
    with multiple coupling, J. Sound Vib. 27(2), 235-260.
    """
    omega = np.atleast_1d(np.asarray(omega, dtype=float))
    out = np.zeros((omega.size, len(observed), len(loads)), dtype=complex)
    on_rail = [p.x % track.cell_length for p in (*loads, *observed) if p.slab_y is None]
    cells = [build_cell(track, parity, np.array(on_rail)) for parity in (EVEN, ODD)]
    if viscous:
        cells = [cell.made_viscous() for cell in cells]
    for start in range(0, omega.size, BLOCK):
        part = slice(start, start + BLOCK)
        for cell in cells:
            # A load on one rail is half an even and half an odd one.
            out[part] += 0.5 * _one_parity(cell, omega[part], loads, observed)
        if progress:
            progress(min(start + BLOCK, omega.size), omega.size)
    return out


def _one_parity(
    cell: Cell, omega: FloatArray, loads: list[Point], observed: list[Point]
) -> ComplexArray:
    track = cell.track
    N, ends = track.mesh.cells, np.r_[0:2, cell.rail_size - 2 : cell.rail_size]
    inner = np.setdiff1d(np.arange(cell.K.shape[0]), ends)
    F = np.stack([p.row(cell) for p in loads], axis=1)
    W = np.stack([p.row(cell) for p in observed], axis=1)
    D = cell.dynamic_stiffness(omega)
    D_ie = D[:, inner[:, None], ends]
    # Inner unknowns follow the ends (-T) and the loads (X): one factorisation for both.
    right = np.concatenate([D_ie, np.broadcast_to(F[inner], (omega.size, *F[inner].shape))], axis=2)
    solved = np.linalg.solve(D[:, inner[:, None], inner], right)
    T, X = solved[:, :, :4], solved[:, :, 4:]
    S = D[:, ends[:, None], ends] - np.swapaxes(D_ie, 1, 2) @ T
    f = F[ends] - np.swapaxes(T, 1, 2) @ F[inner]
    observe_ends = W[ends].T - W[inner].T @ T
    # Bloch waves: the last node of a cell is the first of the next, e^{i mu} further on.
    mu = 2 * np.pi * np.arange(N) / N
    join = np.zeros((N, 4, 2), dtype=complex)
    join[:, [0, 1], [0, 1]] = 1.0
    join[:, [2, 3], [0, 1]] = np.exp(1j * mu)[:, None]
    joined = np.conj(np.swapaxes(join, 1, 2))
    S_q = joined @ S[:, None] @ join
    u_q = join @ np.linalg.solve(S_q, joined @ f[:, None])  # (n_omega, N, 4, n_loads)
    cell_of = [np.array([int(p.x // track.cell_length) for p in ps]) for ps in (observed, loads)]
    apart = cell_of[0][:, None] - cell_of[1][None, :]
    phase = np.exp(1j * mu[:, None, None] * apart) / N  # (N, n_observed, n_loads)
    out: ComplexArray = np.einsum("woe,wqel,qol->wol", observe_ends, u_q, phase, optimize=True)
    same_cell = (apart % N == 0)[None]
    out += same_cell * (W[inner].T @ X)
    return out
