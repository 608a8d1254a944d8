"""Whether an FMU depends on more than its model description says: a probe of all at once.

Columns of a Jacobian that have no row in common are found together; a dependence that is not
declared then goes to another column, and nothing shows it. So all states and inputs are moved
together, each by another amount, and what that does is held against the Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csc_array

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import IndexArray

Change = Callable[[IndexArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Change of all unknowns while some columns change by some amounts; and the same, less exactly."""

ROUNDING = 1e-9
"""Of what all columns add up to in a row: sums of thousands of terms differ by less."""
DOUBT = 10.0
"""How many times a change may be wrong by more than its two values differ."""


def undeclared(
    change: Change, best: csc_array, rougher: csc_array, sizes: FloatArray
) -> list[tuple[int, int]]:
    """Find pairs of row and column whose derivative the Jacobian lacks.

    Parameters
    ----------
    change : callable
        See `Change`.
    best, rougher : sparse array, shape (n_rows, n_columns)
        The Jacobian, found by the declared dependencies; and less exactly.
    sizes : array, shape (n_columns,)
        Magnitudes of what the columns stand for.

    Returns
    -------
    list of (int, int)
        Every one, but for those smaller than the error of the derivatives.
    """
    chance = np.random.default_rng(20)
    amounts = sizes * chance.uniform(0.5, 1.0, sizes.size) * chance.choice((-1.0, 1.0), sizes.size)

    def wrong(columns: IndexArray) -> IndexArray:
        """Rows that change by something else than they should."""
        given, almost = change(columns, amounts[columns])
        moved = np.zeros_like(amounts)
        moved[columns] = amounts[columns]
        known = ROUNDING * (abs(best) @ np.abs(moved)) + DOUBT * (
            np.abs(given - almost) + abs(best - rougher) @ np.abs(moved)
        )
        off = np.abs(given - best @ moved)
        return np.flatnonzero(off > known + np.finfo(float).tiny)

    found = list[tuple[int, int]]()
    parts = [np.arange(sizes.size)]
    while parts:
        part = parts.pop()
        rows = wrong(part)
        if not rows.size:
            continue
        if part.size == 1:
            found += [(int(row), int(part[0])) for row in rows]
        else:
            parts += np.array_split(part, 2)
    return sorted(found)


def told(path: object, pairs: Sequence[tuple[str, str]]) -> str:
    """A sentence about the first of them."""
    more = f", and {len(pairs) - 1} more like it" if len(pairs) > 1 else ""
    unknown, known = pairs[0]
    return (
        f"{path}: its model description does not say that {unknown} depends on {known}{more}; "
        "counted in here, but whoever couples it by what it says gets such a value a step late"
    )
