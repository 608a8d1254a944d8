"""Real numbers, or complex ones whose small imaginary parts carry derivatives."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from ..arrays import ComplexArray, FloatArray

Numbers = TypeVar("Numbers", FloatArray, ComplexArray)

STEP = 1e-30  # its square is lost in any sum, so the derivative has no error but rounding


def derivatives(function: Callable[[ComplexArray], ComplexArray], at: FloatArray) -> FloatArray:
    """Derivatives of a function of every row by the complex step.

    They are those of the very formulas that are used, to rounding: there is no second set of
    formulas to keep right.

    Parameters
    ----------
    function : callable
        From shape (..., m) to shape (..., k), a row of each, by formulas that hold for complex
        numbers; a choice between formulas looks at real parts.
    at : array, shape (..., m)
        Where.

    Returns
    -------
    array, shape (..., k, m)

    References
    ----------
    Squire, W. & Trapp, G. (1998), Using complex variables to estimate derivatives of real
    functions, SIAM Review 40(1), 110-112.
    """
    m = at.shape[-1]
    ways = (1j * STEP * np.eye(m)).reshape(m, *(1,) * (at.ndim - 1), m)
    moved: FloatArray = np.moveaxis(function(at + ways).imag / STEP, 0, -1)
    return moved


def positive(x: Numbers) -> Numbers:
    """What is above zero, and zero else."""
    kept: Numbers = np.where(x.real > 0, x, np.zeros_like(x))
    return kept
