"""Two factors of a matrix, with no more between them than its rank."""

from __future__ import annotations

import numpy as np

from railcosim.master.component import FloatArray

RANK = 1e-12
"""Of the largest singular value of rows and columns of like size: smaller ones are rounding."""


def factors(M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two factors of a matrix, with no more columns and rows between them than its rank.

    Parameters
    ----------
    M : array, shape (m, n)
        Rows and columns may be of different units.

    Returns
    -------
    array, array, shapes (m, rank) and (rank, n)
        Their product is M.
    """
    rows = np.abs(M).max(axis=1, initial=0.0, keepdims=True)
    rows[rows == 0.0] = 1.0
    columns = np.abs(M / rows).max(axis=0, initial=0.0, keepdims=True)
    columns[columns == 0.0] = 1.0
    U, s, Vt = np.linalg.svd(M / rows / columns, full_matrices=False)
    r = int((s > RANK * s.max(initial=0.0)).sum())
    return rows * U[:, :r] * s[:r], Vt[:r] * columns
