"""Random response by pseudo-excitation: densities of irregularity to those of outputs."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.receptance import Response, lag
from railcosim.mechanics.ports import Layout

Density: TypeAlias = Callable[[FloatArray], FloatArray]  # Omega (rad/m) to S, one-sided


def response_psd(
    system: Response,
    positions: FloatArray,
    speed: float,
    vertical: Density,
    cross_level: Density | None = None,
) -> FloatArray:
    """Power spectral densities of all outputs on an irregular track.

    Parameters
    ----------
    system : Response
        With an input ``wheelset[i].side.irregularity_z`` for every wheel.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    speed : float
        m/s.
    vertical : callable
        Wavenumber (rad/m) to the one-sided density (m2/(rad/m)) of the mean height of both rails.
    cross_level : callable, optional
        The same of left minus right height, independent of the mean; without it both rails are
        alike.

    Returns
    -------
    array, shape (n_omega, n_outputs)
        One-sided, in the output's unit squared per Hz.

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
    wheels = Layout(len(positions)).wheels
    sides = np.repeat([0.5, -0.5], len(positions))  # half of the cross-level on each rail
    sources = [(vertical, np.ones(len(wheels)))]
    if cross_level is not None:
        sources.append((cross_level, sides))
    total = np.zeros((system.omega.size, len(system.outputs)))
    phases = lag(system.omega, np.tile((positions.max() - positions) / speed, 2))
    for density, share in sources:
        amplitude = np.sqrt(density(system.omega / speed) * 2 * np.pi / speed)
        weights = amplitude[:, None] * phases * share
        total += np.abs(system.combined([f"{w}.irregularity_z" for w in wheels], weights)) ** 2
    return total


def acceleration_psd(omega: FloatArray, psd: FloatArray) -> FloatArray:
    """Density of accelerations (m/s2)^2/Hz from that of displacements (n_omega, ...) m2/Hz."""
    return psd * omega.reshape(-1, *(1 for _ in psd.shape[1:])) ** 4


def standard_deviation(frequency: FloatArray, psd: FloatArray) -> FloatArray:
    """Root of the integral of one-sided densities (n, ...) over frequencies (n,) in Hz."""
    deviation: FloatArray = np.sqrt(np.trapezoid(psd, frequency, axis=0))
    return deviation
