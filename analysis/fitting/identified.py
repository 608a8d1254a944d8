"""What a fit knows of each parameter: an interval, or why there is none.

Near the solution the residuals r are linear in the logarithms x of the parameters, r = r0 + J dx.
If their errors are independent and alike, x is normal about the true one with the covariance
s^2 (J'J)^-1, s^2 = r'r / (m - p), and (x - true) / (its standard error) has Student's t of m - p
degrees of freedom.

References
----------
Seber, G. A. F. & Wild, C. J. (1989), Nonlinear Regression, Wiley, sections 2.1.2 and 2.8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from railcosim.master.component import FloatArray

LEVEL = 0.95
NONE = 1e-5  # of the largest singular value: what differences leave of nothing
WIDEST = 3.0  # times and through which an interval may reach; wider, it is no number
PART = 0.05  # of a direction of length 1: a parameter that has less is not of it
ALIKE = 0.95  # correlation from which on two parameters are told to hide each other


@dataclass(frozen=True, kw_only=True)
class Identified:
    """What is known of parameters.

    Attributes
    ----------
    half_width : array, shape (p,)
        Of the interval of each logarithm; NaN where it is not known.
    correlation : array, shape (p, p)
        Of the logarithms.
    why_not : dict
        By number of a parameter that is not known, why, in words.
    inflation : float
        Of variances, as neighbouring residuals are alike: 1 if they are independent.
    neighbours : float
        Correlation of neighbouring residuals.
    """

    half_width: FloatArray
    correlation: FloatArray
    why_not: dict[int, str]
    inflation: float
    neighbours: float


def identified(
    names: list[str], J: FloatArray, residual: FloatArray, runs: list[slice], at_limit: list[str]
) -> Identified:
    """See the module.

    Parameters
    ----------
    names : list of str
        Of the parameters.
    J : array, shape (m, p)
        Derivatives of the residuals by the logarithms.
    residual : array, shape (m,)
        At the solution.
    runs : list of slice
        Residuals that are neighbours in frequency.
    at_limit : list of str
        Of each parameter the limit that it has come to, or nothing.
    """
    m, p = J.shape
    neighbours = _neighbours(residual, runs)
    # Of a first-order autoregressive process so many residuals count as one; where no more than
    # chance shows, they are independent.
    is_chance = neighbours < 3 / np.sqrt(m)
    inflation = 1.0 if is_chance else (1 + neighbours) / (1 - neighbours)
    _, sizes, directions = np.linalg.svd(J, full_matrices=False)
    largest = float(sizes[0]) or 1.0
    known = sizes > NONE * largest
    variance = float(residual @ residual) / (m - p) * inflation
    inverse = np.divide(1.0, sizes, out=np.full(p, 1 / (NONE * largest)), where=known)
    covariance = (directions.T * inverse**2) @ directions
    error = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(error, error)
    half = stats.t.ppf((1 + LEVEL) / 2, m - p) * np.sqrt(variance) * error
    lost = np.abs(directions[~known]).max(axis=0, initial=0.0) > PART
    effect = np.linalg.norm(J, axis=0) / largest
    why_not = {}
    for i in range(p):
        if at_limit[i]:
            why_not[i] = at_limit[i]
        elif effect[i] <= NONE:
            why_not[i] = "has no effect on what was measured"
        elif lost[i] or half[i] > np.log(WIDEST):
            why_not[i] = _hidden(i, names, correlation) or (
                f"has too little effect: its 95 % interval reaches {np.exp(min(half[i], 50)):.2g} "
                "times and through"
            )
    half[list(why_not)] = np.nan
    return Identified(
        half_width=half, correlation=correlation, why_not=why_not, inflation=inflation,
        neighbours=neighbours,
    )  # fmt: skip


def _hidden(i: int, names: list[str], correlation: FloatArray) -> str:
    """Which others do the same, or the opposite."""
    others = [
        f"{names[j]} (correlation {correlation[i, j]:+.4f})"
        for j in np.argsort(-np.abs(correlation[i]))
        if j != i and abs(correlation[i, j]) > ALIKE
    ]
    return f"cannot be told from {', '.join(others)}" if others else ""


def _neighbours(residual: FloatArray, runs: list[slice]) -> float:
    """Correlation of neighbouring residuals."""
    parts = [residual[run] for run in runs]
    beside = sum(float(r[1:] @ r[:-1]) for r in parts)
    own = sum(float(r @ r) - (float(r[0] ** 2) + float(r[-1] ** 2)) / 2 for r in parts if r.size)
    return float(np.clip(beside / own, -0.999, 0.999)) if own > 0 else 0.0
