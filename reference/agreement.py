"""How far two frequency responses or two time histories are apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray

MARGIN = 0.01  # of the frequency: where a response nearly vanishes, a relative error says nothing


def near(frequency: FloatArray, fine: FloatArray, response: ComplexArray) -> NDArray[np.bool_]:
    """Which frequencies are within `MARGIN` of an antiresonance.

    Parameters
    ----------
    frequency : array, shape (n,)
        Hz.
    fine : array, shape (m,)
        Frequencies (Hz) dense enough to show every local minimum.
    response : array of complex, shape (m,)
        A response on them.

    Returns
    -------
    array of bool, shape (n,)
    """
    size = np.abs(response)
    dips = fine[1:-1][(size[1:-1] < size[:-2]) & (size[1:-1] < size[2:])]
    close: NDArray[np.bool_] = np.any(np.abs(frequency[:, None] / dips - 1) <= MARGIN, axis=1)
    return close


def relative_rms(ours: FloatArray, reference: FloatArray, mean: FloatArray) -> float:
    """RMS of the difference over the RMS of the reference's deviation from `mean`."""
    return float(np.sqrt(np.mean((ours - reference) ** 2) / np.mean((reference - mean) ** 2)))
