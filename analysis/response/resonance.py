"""Resonances and antiresonances read off a response."""

from __future__ import annotations

import numpy as np

from railcosim.master.component import FloatArray


def resonance(frequency: FloatArray, size: FloatArray, *, dip: bool = False) -> float:
    """Where a response is largest (or smallest), between the frequencies it is known at.

    Parameters
    ----------
    frequency : array, shape (n,)
        Increasing.
    size : array, shape (n,)
        Magnitude, positive.
    dip : bool
        An antiresonance: the smallest.

    Returns
    -------
    float
        Top of the parabola through the three highest points of the logarithms; the end point where
        the response rises to the end.
    """
    y = np.log(size) * (-1 if dip else 1)
    k = int(np.argmax(y))
    if k in (0, y.size - 1):
        return float(frequency[k])
    a, b, _ = np.polyfit(np.log(frequency[k - 1 : k + 2] / frequency[k]), y[k - 1 : k + 2], 2)
    return float(frequency[k] * np.exp(-b / (2 * a)))
