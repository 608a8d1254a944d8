"""Derivatives by a step in an imaginary direction: exact, of the very formulas that are used."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Numbers = TypeVar("Numbers", NDArray[np.float64], NDArray[np.complex128])
