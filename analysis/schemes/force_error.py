"""The error that a scheme makes on a random irregularity, from its linear model.

It is that of the contact forces at communication points while the vehicle runs over an irregularity
of a given spectrum: at every frequency the response of the scheme's step, which is a linear map,
against the exact one. Nothing is run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.linear_pair import Part
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.linear.receptance import lag
from railcosim.master.linear.state_space import ComplexArray
from railcosim.mechanics.ports import Z
from railcosim.track.irregularity import Spectrum

from .stability import Coupling

FREQUENCIES = 150
"""Points of the spectrum: the force has no resonance sharper than a tenth of its frequency."""


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """A random irregularity, met by every wheelset with its lag.

    Attributes
    ----------
    omega : array, shape (n_omega,)
        rad/s, increasing.
    heights : array of complex, shape (n_omega, n_wheelsets)
        Root of the density (m2/(rad/s)) under each wheelset, with its phase; alike on both rails.
    """

    omega: FloatArray
    heights: ComplexArray


def excitation(spectrum: Spectrum, speed: float, positions: FloatArray) -> Excitation:
    """The excitation by a spectrum, over the wavelengths for which it holds.

    Parameters
    ----------
    spectrum : Spectrum
        Of the mean height of both rails.
    speed : float
        m/s.
    positions : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    """
    shortest, longest = spectrum.wavelengths
    omega = 2 * np.pi * speed * np.geomspace(1 / longest, 1 / shortest, FREQUENCIES)
    size = np.sqrt(spectrum.density(omega / speed) / speed)
    heights = size[:, None] * lag(omega, (positions.max() - positions) / speed)
    return Excitation(omega=omega, heights=heights)


class ForceError:
    """What the errors of all schemes at one contact are measured against.

    Parameters
    ----------
    part : Part
        The pair where both rails are alike, the first of its parts: no other moves.
    k_H : float or array, shape (n_wheelsets,)
        Contact stiffness, N/m.
    source : Excitation
        What excites the vehicle.
    """

    def __init__(self, part: Part, k_H: Stiffness, source: Excitation) -> None:
        n = len(part.wheels)
        self._omega = source.omega
        self._forces = {f"{wheel}.{Z.effort}" for wheel in part.wheels}
        self._heights = np.asarray(
            np.tile(source.heights, (1, n // source.heights.shape[1])), dtype=np.complex128
        )
        flexible = part.compliance(source.omega) + np.diag(1 / part.of_wheels(k_H))
        solved = np.linalg.solve(flexible, -self._heights[:, :, None])[:, :, 0]
        self._exact = np.asarray(solved, dtype=np.complex128)

    def of(self, coupling: Coupling, h: float) -> float:
        """RMS of the error of the forces of all wheels with steps of `h` (s), relative to theirs.

        Infinite if the scheme cannot make such a step.
        """
        amplifier = coupling.amplifiers[0]
        names = amplifier.system.names
        forces = [i for i, name in enumerate(names) if name.partition(".")[2] in self._forces]
        try:
            response = amplifier.at(h).response(self._omega, self._heights, forces)
        except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
            return np.inf
        wrong, right = (
            np.trapezoid((np.abs(values) ** 2).sum(axis=1), self._omega)
            for values in (response - self._exact, self._exact)
        )
        return float(np.sqrt(wrong / right))
