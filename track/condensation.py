"""One cell condensed to its two ends, at many frequencies at once.

Between the ends a rail is a chain of elements, its matrix a narrow band; the slab's modes touch it
at the railseats only. So the band is solved for unit forces at ends, railseats and loads, all
frequencies in one banded system, and the slab joins them afterwards.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .cell import Cell


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
    size, rail, d = cell.K.shape[0], cell.rail_size, cell.section.size
    ends, inner = np.r_[0:d, rail - d : rail], np.r_[d : rail - d, rail:size]
    at_ends = _dynamic(cell, omega, inner, ends)
    right = np.concatenate(
        [at_ends, np.broadcast_to(loads[inner], (omega.size, *loads[inner].shape))], axis=2
    )
    solved = _solve_inside(cell, omega, right)
    follow, moved = solved[:, :, : 2 * d], solved[:, :, 2 * d :]
    up = np.swapaxes(follow, 1, 2)
    return CondensedCell(
        stiffness=_dynamic(cell, omega, ends, ends) - np.swapaxes(at_ends, 1, 2) @ follow,
        forces=loads[ends] - up @ loads[inner],
        motions=observed[ends].T - observed[inner].T @ follow,
        within=observed[inner].T @ moved,
    )


def _dynamic(
    cell: Cell, omega: FloatArray, rows: NDArray[np.intp], columns: NDArray[np.intp]
) -> ComplexArray:
    """Part of the dynamic stiffness, shape (n_omega, n_rows, n_columns)."""
    return _at_frequencies(omega, *(A[np.ix_(rows, columns)] for A in _matrices(cell)))


def _matrices(cell: Cell) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Coefficients of 1, omega and omega^2 in the dynamic stiffness."""
    elastic: ComplexArray = cell.K + 1j * cell.K_loss
    return elastic, 1j * cell.C.astype(complex), -cell.M.astype(complex)


def _at_frequencies(omega: FloatArray, *coefficients: ComplexArray) -> ComplexArray:
    """Polynomial in omega with arrays for coefficients: one product, the frequencies in front."""
    powers = (omega[:, None] ** np.arange(len(coefficients))).astype(complex)
    values: ComplexArray = powers @ np.stack([c.ravel() for c in coefficients])
    return values.reshape(omega.size, *coefficients[0].shape)


def _solve_inside(cell: Cell, omega: FloatArray, right: ComplexArray) -> ComplexArray:
    """Inner unknowns for right-hand sides (n_omega, n_inner, n), the ends being held."""
    size, rail, d = cell.K.shape[0], cell.rail_size, cell.section.size
    on_rail, on_slab = np.arange(d, rail - d), np.arange(rail, size)
    seats = np.flatnonzero(np.any(cell.K[on_rail[:, None], on_slab], axis=1))
    n, columns = on_rail.size, right.shape[2]
    unit = np.broadcast_to(np.eye(n)[:, seats], (omega.size, n, seats.size))
    solved = _solve_rail(cell, omega, np.concatenate([right[:, :n], unit], axis=2))
    free, soft = solved[:, :, :columns], solved[:, :, columns:]
    if not seats.size:
        return free
    # Slab: (D_pp - B' R B) q = f - B' w, with B where it is fastened and R the rail's receptance.
    B = _dynamic(cell, omega, on_rail[seats], on_slab)
    up = np.swapaxes(B, 1, 2)
    D = _dynamic(cell, omega, on_slab, on_slab) - up @ soft[:, seats] @ B
    q = np.linalg.solve(D, right[:, n:] - up @ free[:, seats])
    return np.concatenate([free - soft @ (B @ q), q], axis=1)


def _solve_rail(cell: Cell, omega: FloatArray, right: ComplexArray) -> ComplexArray:
    """Rail held at the ends, on fastenings whose slabs are held: all frequencies as one band."""
    d = cell.section.size
    n, inner = right.shape[1], slice(d, cell.rail_size - d)
    reach = 2 * d - 1  # diagonals on either side: a node's unknowns meet those of the next node
    band = np.zeros((2 * reach + 1, omega.size, n), dtype=complex)
    matrices = [A[inner, inner] for A in _matrices(cell)]
    for k in range(-reach, reach + 1):
        place = slice(max(k, 0), n + min(k, 0))
        band[reach - k, :, place] = _at_frequencies(omega, *(A.diagonal(k) for A in matrices))
    flat = right.reshape(omega.size * n, -1)
    solved: ComplexArray = solve_banded(
        (reach, reach), band.reshape(2 * reach + 1, -1), flat,
        overwrite_ab=True, overwrite_b=True, check_finite=False,
    )  # fmt: skip
    return solved.reshape(right.shape)
