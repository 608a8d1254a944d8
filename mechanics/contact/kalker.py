"""Kalker's coefficients of linear creep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray

RATIOS = np.array([
    0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1,
    1 / 0.9, 1 / 0.8, 1 / 0.7, 1 / 0.6, 1 / 0.5, 1 / 0.4, 1 / 0.3, 1 / 0.2, 1 / 0.1,
])  # fmt: skip
"""a/b of the rows of `TABLE`."""
POISSON_RATIOS = np.array([0.0, 0.25, 0.5])
TABLE = np.array([
    # C11                C22                 C23                     C33
    [[2.51, 3.31, 4.85], [2.51, 2.52, 2.53], [0.334, 0.473, 0.731], [6.42, 8.28, 11.7]],
    [[2.59, 3.37, 4.81], [2.59, 2.63, 2.66], [0.483, 0.603, 0.809], [3.46, 4.27, 5.66]],
    [[2.68, 3.44, 4.8], [2.68, 2.75, 2.81], [0.607, 0.715, 0.889], [2.49, 2.96, 3.72]],
    [[2.78, 3.53, 4.82], [2.78, 2.88, 2.98], [0.72, 0.823, 0.977], [2.02, 2.32, 2.77]],
    [[2.88, 3.62, 4.83], [2.88, 3.01, 3.14], [0.827, 0.929, 1.07], [1.74, 1.93, 2.22]],
    [[2.98, 3.72, 4.91], [2.98, 3.14, 3.31], [0.93, 1.03, 1.18], [1.56, 1.68, 1.86]],
    [[3.09, 3.81, 4.97], [3.09, 3.28, 3.48], [1.03, 1.14, 1.29], [1.43, 1.5, 1.6]],
    [[3.19, 3.91, 5.05], [3.19, 3.41, 3.65], [1.13, 1.25, 1.4], [1.34, 1.37, 1.42]],
    [[3.29, 4.01, 5.12], [3.29, 3.54, 3.82], [1.23, 1.36, 1.51], [1.27, 1.27, 1.27]],
    [[3.4, 4.12, 5.2], [3.4, 3.67, 3.98], [1.33, 1.47, 1.63], [1.21, 1.19, 1.16]],
    [[3.51, 4.22, 5.3], [3.51, 3.81, 4.16], [1.44, 1.59, 1.77], [1.16, 1.11, 1.06]],
    [[3.65, 4.36, 5.42], [3.65, 3.99, 4.39], [1.58, 1.75, 1.94], [1.1, 1.04, 0.954]],
    [[3.82, 4.54, 5.58], [3.82, 4.21, 4.67], [1.76, 1.95, 2.18], [1.05, 0.965, 0.852]],
    [[4.06, 4.78, 5.8], [4.06, 4.5, 5.04], [2.01, 2.23, 2.5], [1.01, 0.892, 0.751]],
    [[4.37, 5.1, 6.11], [4.37, 4.9, 5.56], [2.35, 2.62, 2.96], [0.958, 0.819, 0.65]],
    [[4.84, 5.57, 6.57], [4.84, 5.48, 6.31], [2.88, 3.24, 3.7], [0.912, 0.747, 0.549]],
    [[5.57, 6.34, 7.34], [5.57, 6.4, 7.51], [3.79, 4.32, 5.01], [0.868, 0.674, 0.446]],
    [[6.96, 7.78, 8.82], [6.96, 8.14, 9.79], [5.72, 6.63, 7.89], [0.828, 0.601, 0.341]],
    [[10.7, 11.7, 12.9], [10.7, 12.8, 16.0], [12.2, 14.6, 18.0], [0.795, 0.526, 0.228]],
])  # fmt: skip
"""Shape (ratios, coefficients, Poisson ratios): Kalker 1990, appendix E."""


@dataclass(frozen=True, kw_only=True)
class Kalker:
    """Coefficients of a contact patch.

    Attributes
    ----------
    C11, C22, C23, C33 : array
        Along, across, across by spin, and of the moment by spin.
    """

    C11: FloatArray
    C22: FloatArray
    C23: FloatArray
    C33: FloatArray


def kalker(ratio: FloatArray | float, poisson_ratio: float) -> Kalker:
    """Coefficients of patches of given shape.

    Linear in a/b between the rows of the table; in Poisson's ratio by the parabola through the
    reciprocals, which are nearly straight: C11 of a circle at 0.3 is 4.300.

    Parameters
    ----------
    ratio : array or float
        a/b, a along rolling.
    poisson_ratio : float
        Of wheel and rail.

    Returns
    -------
    Kalker

    Raises
    ------
    ValueError
        Outside the table, 0.1 to 10 and 0 to 0.5.

    References
    ----------
    Kalker, J. J. (1990), Three-Dimensional Elastic Bodies in Rolling Contact, Kluwer.
    """
    wanted = np.asarray(ratio, float)
    within = (wanted >= RATIOS[0]) & (wanted <= RATIOS[-1])
    if not np.all(within):
        raise ValueError(
            f"a contact ellipse with a/b = {wanted[~within].flat[0]:g}: Kalker's table has "
            f"{RATIOS[0]:g} to {RATIOS[-1]:g}"
        )
    if not POISSON_RATIOS[0] <= poisson_ratio <= POISSON_RATIOS[-1]:
        raise ValueError(f"Poisson ratio {poisson_ratio:g}: Kalker's table has 0 to 0.5")
    t = poisson_ratio / POISSON_RATIOS[1]
    weights = np.array([(t - 1) * (t - 2) / 2, t * (2 - t), t * (t - 1) / 2])
    columns = 1 / ((1 / TABLE) @ weights)
    C11, C22, C23, C33 = (np.asarray(np.interp(wanted, RATIOS, c)) for c in columns.T)
    return Kalker(C11=C11, C22=C22, C23=C23, C33=C33)
