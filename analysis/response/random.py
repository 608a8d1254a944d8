"""Random response by pseudo-excitation: densities of irregularity to those of outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.receptance import Response

from .excitation import loads_of

Density: TypeAlias = Callable[[FloatArray], FloatArray]  # Omega (rad/m) to S, one-sided


def response_psd(
    system: Response,
    positions: FloatArray,
    speed: float,
    densities: Mapping[str, Density],
) -> FloatArray:
    """Power spectral densities of all outputs on an irregular track.

    Parameters
    ----------
    system : Response
        With an input ``wheelset[i].side.irregularity_z`` for every wheel, and of a system in space
        ``irregularity_y``.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    speed : float
        m/s.
    densities : mapping of str to callable
        Of each quantity of irregularity, by its name in `QUANTITIES`: wavenumber (rad/m) to the
        one-sided density (m2/(rad/m)). They are independent of each other; with the vertical one
        alone both rails are alike.

    Returns
    -------
    array, shape (n_omega, n_outputs)
        One-sided, in the output's unit squared per Hz.

    Raises
    ------
    CouplingError
        If the system does not know of a quantity: all but the vertical one take a system in space.

    Notes
    -----
    The pseudo-excitation method [1]_: each independent source is a harmonic of amplitude
    sqrt(S_f), which every wheel meets with its lag; the squared magnitudes of the responses are
    the densities, and those of independent sources add up. S_f(f) = S(omega / v) 2 pi / v.

    References
    ----------
    .. [1] J. H. Lin, W. S. Zhang, J. J. Li, Structural responses to arbitrarily coherent
       stationary random excitations, Computers & Structures 50 (1994) 629-633.
    """
    total = np.zeros((system.omega.size, len(system.outputs)))
    for quantity, density in densities.items():
        amplitude = np.sqrt(density(system.omega / speed) * 2 * np.pi / speed)
        inputs, lagging = loads_of(system, quantity, positions, speed)
        total += np.abs(system.combined(inputs, amplitude[:, None] * lagging)) ** 2
    return total


def acceleration_psd(omega: FloatArray, psd: FloatArray) -> FloatArray:
    """Density of accelerations (m/s2)^2/Hz from that of displacements (n_omega, ...) m2/Hz."""
    return psd * omega.reshape(-1, *(1 for _ in psd.shape[1:])) ** 4


def standard_deviation(frequency: FloatArray, psd: FloatArray) -> FloatArray:
    """Root of the integral of one-sided densities (n, ...) over frequencies (n,) in Hz."""
    deviation: FloatArray = np.sqrt(np.trapezoid(psd, frequency, axis=0))
    return deviation
