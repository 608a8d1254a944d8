"""Interpolation inside a Timoshenko rail element.

Needs numpy only: a copy of this file travels in every FMU of the track.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .arrays import FloatArray


def shape_functions(
    xi: ArrayLike, length: ArrayLike, phi: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Deflection and rotation inside an element from [w_a, theta_a, w_b, theta_b].

    The interdependent interpolation solves the static equations of the unloaded element, so nodal
    values are exact for loads at nodes.

    Parameters
    ----------
    xi : array
        Position in the element, 0..1.
    length : array
        Length of the element, m.
    phi : array
        Shear parameter 12 EI / (kappa G A length^2); all three broadcast together.

    Returns
    -------
    N_w, N_theta : array, shape (..., 4)
        So that w = N_w @ u and theta = N_theta @ u, theta positive along dw/dx.

    References
    ----------
    Friedman, Z. & Kosmatka, J. B. (1993), Computers & Structures 47(3), 473-481.
    """
    xi, length, phi = (np.asarray(a, dtype=float) for a in (xi, length, phi))
    s = 1 / (1 + phi)
    N_w = [
        s * (2 * xi**3 - 3 * xi**2 - phi * xi + 1 + phi),
        s * length * (xi**3 - (2 + phi / 2) * xi**2 + (1 + phi / 2) * xi),
        s * (-2 * xi**3 + 3 * xi**2 + phi * xi),
        s * length * (xi**3 - (1 - phi / 2) * xi**2 - phi / 2 * xi),
    ]
    N_theta = [
        s * 6 / length * (xi**2 - xi),
        s * (3 * xi**2 - (4 + phi) * xi + 1 + phi),
        s * -6 / length * (xi**2 - xi),
        s * (3 * xi**2 - (2 - phi) * xi),
    ]
    return (
        np.stack(np.broadcast_arrays(*N_w), axis=-1),
        np.stack(np.broadcast_arrays(*N_theta), axis=-1),
    )
