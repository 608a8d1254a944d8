"""Ride comfort from the density of an acceleration: ISO 2631-1 and Sperling's Wz."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray

SPERLING_BAND = (0.5, 30.0)  # Hz
REACTIONS = (  # ISO 2631-1:1997 annex C.2.3, m/s2; the ranges overlap there
    (0.315, "not uncomfortable"),
    (0.63, "a little uncomfortable"),
    (1.0, "fairly uncomfortable"),
    (1.6, "uncomfortable"),
    (2.5, "very uncomfortable"),
    (np.inf, "extremely uncomfortable"),
)


@dataclass(frozen=True, kw_only=True)
class Felt:
    """How a direction is felt by a seated person.

    Attributes
    ----------
    name : str
        Of the weighting of ISO 2631-1.
    transition : tuple of float
        f3, f4 (Hz) and Q4 of the transition from acceleration to velocity.
    step : tuple of float, optional
        f5, Q5, f6, Q6 of the upward step.
    sperling : float
        Factor of Sperling's weighting.
    """

    name: str
    transition: tuple[float, float, float]
    step: tuple[float, float, float, float] | None
    sperling: float


VERTICAL = Felt(
    name="W_k", transition=(12.5, 12.5, 0.63), step=(2.37, 0.91, 3.35, 0.91), sperling=0.588
)
LATERAL = Felt(name="W_d", transition=(2.0, 2.0, 0.63), step=None, sperling=0.737)


def iso_2631_weight(frequency: FloatArray, felt: Felt = VERTICAL) -> FloatArray:
    """Magnitude of a weighting of ISO 2631-1.

    Parameters
    ----------
    frequency : array
        Hz.
    felt : Felt
        In what direction: W_k of vertical, W_d of lateral vibration, which EN 12299 has as well.

    References
    ----------
    ISO 2631-1:1997, annex A: band limits 0.4 and 100 Hz (Butterworth), transition from acceleration
    to velocity, upward step.
    """
    s = 2j * np.pi * np.asarray(frequency, dtype=float)
    w1, w2, w3, w4 = (2 * np.pi * f for f in (0.4, 100.0, *felt.transition[:2]))
    high_pass = s**2 / (s**2 + np.sqrt(2) * w1 * s + w1**2)
    low_pass = w2**2 / (s**2 + np.sqrt(2) * w2 * s + w2**2)
    transition = (1 + s / w3) / (1 + s / (felt.transition[2] * w4) + (s / w4) ** 2)
    passed = high_pass * low_pass * transition
    if felt.step is not None:
        f5, Q5, f6, Q6 = felt.step
        w5, w6 = 2 * np.pi * f5, 2 * np.pi * f6
        step = (1 + s / (Q5 * w5) + (s / w5) ** 2) / (1 + s / (Q6 * w6) + (s / w6) ** 2)
        passed = passed * step * (w5 / w6) ** 2
    weight: FloatArray = np.abs(passed)
    return weight


def weighted_acceleration(frequency: FloatArray, psd: FloatArray, felt: Felt = VERTICAL) -> float:
    """Weighted r.m.s. acceleration (m/s2) from a one-sided density ((m/s2)^2/Hz)."""
    return float(np.sqrt(np.trapezoid(iso_2631_weight(frequency, felt) ** 2 * psd, frequency)))


def reaction(weighted: float) -> str:
    """What passengers say of a weighted r.m.s. acceleration (m/s2), ISO 2631-1 annex C."""
    return next(text for limit, text in REACTIONS if weighted < limit)


def sperling_weight(frequency: FloatArray, felt: Felt = VERTICAL) -> FloatArray:
    """Sperling's B(f) for ride comfort, for accelerations in cm/s2.

    References
    ----------
    Sperling, E. & Betzhold, C. (1956), Beitrag zur Beurteilung des Fahrkomforts in
    Schienenfahrzeugen, Glasers Annalen 80, 314-320; in the form of Garg, V. K. & Dukkipati, R. V.
    (1984), Dynamics of Railway Vehicle Systems, Academic Press.
    """
    f = np.asarray(frequency, dtype=float)
    above = 1.911 * f**2 + (0.25 * f**2) ** 2
    below = (1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2
    weight: FloatArray = felt.sperling * np.sqrt(above / below)
    return weight


def sperling(frequency: FloatArray, psd: FloatArray, felt: Felt = VERTICAL) -> float:
    """Sperling's ride index Wz from a one-sided density of acceleration ((m/s2)^2/Hz).

    Wz = (sqrt(2) a_w)^0.3, with a_w the B-weighted r.m.s. acceleration in cm/s2 over 0.5 to 30 Hz:
    4.42 a_w^0.3 in m/s2 [1]_. The root of two makes an amplitude of the r.m.s., as Sperling's
    formula for a harmonic has it. Below 2.5 is called good, above 3 no longer pleasant.

    References
    ----------
    .. [1] Forstberg, J. (2000), Ride comfort and motion sickness in tilting trains, KTH Stockholm.
    """
    inside = (frequency >= SPERLING_BAND[0]) & (frequency <= SPERLING_BAND[1])
    f, centimetres = frequency[inside], 1e4 * psd[inside]
    mean_square = np.trapezoid(sperling_weight(f, felt) ** 2 * centimetres, f)
    return float((2 * mean_square) ** 0.15)
