"""Derivatives of the poles of free motions by the logarithms of parameters: ds / d ln p.

Of free motions D(s) v = 0 the derivative of a pole is ds/dp = -(w' dD/dp v) / (w' dD/ds v), with
the left vector w: v itself of springs and dampers, its conjugate of waves. So a resonance is found
once, and each parameter costs two times the matrices; differences of these, not of poles, need no
telling which mode is which.

References
----------
Adhikari, S. (1999), Rates of change of eigenvalues and eigenvectors in damped dynamic system,
AIAA Journal 37(11), 1452-1457. Where poles are equal: Sun, J.-G. (1990), Linear Algebra Appl. 137,
183-211.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ParameterError, UnusualWarning, changed
from railcosim.parameters.change import numbers_of, value_at

STEP = 1e-4  # of a parameter; matrices are products and quotients of few: 1e-8 of curvature
OF_POLE = 1e-6  # of a pole: as in `modes_on_track`
ALIKE = 1e-6  # relative difference of poles whose shapes are any mixture
# What the modes of a plate, and where bays are, depend on: no small change of the same matrices.
LEFT_OUT = (
    "mesh.", "slab.length", "slab.width", "slab.joint", "slab.poisson_ratio", "fastening.spacing",
)  # fmt: skip

Stiffness: TypeAlias = Callable[[ComplexArray], ComplexArray]
"""Dynamic stiffness at complex frequencies s, (m,) to (m, n, n)."""


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """A free motion.

    Attributes
    ----------
    name : str
        What swings.
    pole : complex
        rad/s.
    right, left : array, shape (n,)
        Its vectors.
    """

    name: str
    pole: complex
    right: ComplexArray
    left: ComplexArray


def slopes(
    of: Callable[[Any], Stiffness],
    parameters: Any,
    before: str,
    resonances: Sequence[Resonance],
    progress: Progress = unheard,
) -> dict[str, ComplexArray]:
    """Derivatives ds / d ln p of poles, each (resonances,), by key with something before it.

    Parameters
    ----------
    of : callable
        Makes the dynamic stiffness of parameters.
    parameters : Vehicle, Train or Track
        Where they are taken.
    before : str
        Put before each key.
    resonances : sequence of Resonance
        Free motions of it.
    progress : callable
        Told what is done and the total.
    """
    if not resonances:
        return {}
    s: ComplexArray = np.array([one.pole for one in resonances], dtype=complex)
    here = of(parameters)
    ahead, behind = (here(np.asarray(s * f, complex)) for f in (1 + OF_POLE, 1 - OF_POLE))
    by_s = (ahead - behind) / (2 * OF_POLE * s[:, None, None])
    groups = list(_alike(s))
    keys = [key for key in numbers_of(parameters) if not key.startswith(LEFT_OUT)]
    found = {}
    for k, key in enumerate(keys):
        try:
            up, down = (of(_scaled(parameters, key, f))(s) for f in (1 + STEP, 1 - STEP))
        except ParameterError:  # at the end of its range, or something must fit
            continue
        by_p = (up - down) / (2 * STEP)
        row = np.zeros(s.size, dtype=complex)
        for group in groups:
            left = np.stack([resonances[i].left for i in group])
            right = np.stack([resonances[i].right for i in group], axis=1)
            i = group[0]
            row[group] = np.linalg.eigvals(
                -np.linalg.solve(left @ by_s[i] @ right, left @ by_p[i] @ right)
            )
        found[f"{before}{key}"] = row
        progress(k + 1, len(keys))
    return found


def _scaled(parameters: Any, key: str, factor: float) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusualWarning)
        value = np.asarray(value_at(parameters, key), float)
        return changed(parameters, {key: float(value * factor)})


def _alike(s: ComplexArray) -> Iterator[list[int]]:
    """Numbers of poles that are equal, together."""
    left = list(range(s.size))
    while left:
        first = left[0]
        group = [i for i in left if abs(s[i] - s[first]) <= ALIKE * abs(s[first])]
        yield group
        left = [i for i in left if i not in group]
