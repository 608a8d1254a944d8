"""Critical speeds: where the wavelength suits the wheelbase and the frequency a resonance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray


def bogie_distance(positions: FloatArray) -> float:
    """Distance of the bogies' centres, d1 + d2 of Xu & Lu, from wheelset positions (4,): m."""
    return float(positions[:2].mean() - positions[2:].mean())


def in_phase(distance: float, orders: Sequence[int]) -> FloatArray:
    """Wavelengths (m) at which both bogies move alike, eq. 21: (d1 + d2) / n."""
    return distance / np.asarray(orders, dtype=float)


def out_of_phase(distance: float, orders: Sequence[int]) -> FloatArray:
    """Wavelengths (m) at which the bogies move against each other, eq. 22: 2 (d1 + d2)/(2n - 1)."""
    return 2 * distance / (2 * np.asarray(orders, dtype=float) - 1)


@dataclass(frozen=True, kw_only=True)
class Critical:
    """One critical point.

    Attributes
    ----------
    mode : str
        Which motion.
    order : int
        n of eq. 21 or 22.
    wavelength : float
        m.
    frequency : float
        Of the resonance, Hz.
    """

    mode: str
    order: int
    wavelength: float
    frequency: float

    @property
    def speed(self) -> float:
        """Critical speed, m/s (eq. 20)."""
        return self.wavelength * self.frequency


def critical_points(
    positions: FloatArray, bounce: float, pitch: float, orders: Sequence[int]
) -> list[Critical]:
    """Critical points of the car body.

    Parameters
    ----------
    positions : array, shape (4,)
        Wheelsets, m.
    bounce, pitch : float
        Resonances of the car body, Hz.
    orders : sequence of int
        n = 1 is the fastest.
    """
    D = bogie_distance(positions)
    kinds: list[tuple[str, float, Callable[[float, Sequence[int]], FloatArray]]] = [
        ("car body bounce", bounce, in_phase),
        ("car body pitch", pitch, out_of_phase),
    ]
    return [
        Critical(mode=mode, order=n, wavelength=float(wave), frequency=f)
        for mode, f, wavelengths in kinds
        for n, wave in zip(orders, wavelengths(D, orders), strict=True)
    ]
