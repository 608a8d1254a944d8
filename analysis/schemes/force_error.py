"""The error that a scheme makes on a random irregularity, from its linear model.

It is that of the contact forces at communication points while the vehicle runs over an irregularity
of a given spectrum: at every frequency the response of the scheme's step, which is a linear map,
against the exact one. Nothing is run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.linear_contact import LinearLaw
from railcosim.analysis.pair.linear_pair import Part
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.linear.receptance import lag
from railcosim.master.linear.state_space import ComplexArray
from railcosim.mechanics.ports import FORCE
from railcosim.track.irregularity import QUANTITIES, Spectrum

from .stability import Coupling

FREQUENCIES = 150
"""Points of the spectrum: the force has no resonance sharper than a tenth of its frequency."""


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """Random irregularity of some quantities, met by every wheelset with its lag.

    Attributes
    ----------
    omega : array, shape (n_omega,)
        rad/s, increasing.
    sizes : mapping of str to array of complex, shape (n_omega, n_wheelsets)
        By the name of a quantity, root of its density (m2/(rad/s)) under each wheelset, with its
        phase.
    """

    omega: FloatArray
    sizes: Mapping[str, ComplexArray]

    def on(self, part: Part) -> Iterator[ComplexArray]:
        """What each quantity that moves a part is at its surfaces, (n_omega, n_surfaces), m."""
        surface = part.layout.surface
        for name, size in self.sizes.items():
            quantity = QUANTITIES[name]
            on_side = {"left": quantity.left, "right": quantity.right}
            heights = np.zeros((len(size), len(surface.ports)), dtype=complex)
            for k, port in enumerate(surface.ports):
                own = on_side[port.side]
                if part.image:  # of the part that is alike in the mirror, or the opposite
                    own = (own + part.image * port.direction.mirror * quantity.right) / 2
                if port.direction.name == quantity.direction:
                    heights[:, k] = own * size[:, port.wheelset - 1]
            if heights.any():
                yield heights


def excitation(
    spectra: Spectrum | Mapping[str, Spectrum], speed: float, positions: FloatArray
) -> Excitation:
    """The excitation by spectra, over the wavelengths for which the first holds.

    Parameters
    ----------
    spectra : Spectrum or mapping of str to Spectrum
        Of the mean height of both rails, or by the name of the quantity.
    speed : float
        m/s.
    positions : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    """
    given = {"vertical": spectra} if isinstance(spectra, Spectrum) else spectra
    shortest, longest = next(iter(given.values())).wavelengths
    omega = 2 * np.pi * speed * np.geomspace(1 / longest, 1 / shortest, FREQUENCIES)
    lags = lag(omega, (positions.max() - positions) / speed)
    sizes = {
        name: np.sqrt(spectrum.density(omega / speed) / speed)[:, None] * lags
        for name, spectrum in given.items()
    }
    return Excitation(omega=omega, sizes=sizes)


class ForceError:
    """What the errors of all schemes at one contact are measured against.

    Parameters
    ----------
    parts : sequence of Part
        The pair.
    contact : float or array
        See `Part.tangents`.
    source : Excitation
        What excites the vehicle.
    """

    def __init__(self, parts: Sequence[Part], contact: Stiffness, source: Excitation) -> None:
        self._omega = source.omega
        self._directions = len(parts[0].layout.surface.directions)
        self._driven = []
        for k, part in enumerate(parts):
            law, places = LinearLaw(part, contact), _forces(part)
            names = [v.name for v in law.law.outputs]
            columns = [names.index(name) for name in places]
            for heights in source.on(part):
                exact = law.response(source.omega, heights)[:, columns]
                self._driven.append((k, heights, exact))
        self._right = self._power([exact for _, _, exact in self._driven])

    def of(self, coupling: Coupling, h: float) -> float:
        """RMS of the error of the forces of all wheels with steps of `h` (s), relative to theirs.

        Of forces in several directions, the worst of these. Infinite if the scheme cannot make such
        a step.
        """
        wrong = []
        try:
            for k, heights, exact in self._driven:
                amplifier, part = coupling.amplifiers[k], coupling.parts[k]
                names = [name.partition(".")[2] for name in amplifier.system.names]
                forces = [names.index(name) for name in _forces(part)]
                found = amplifier.at(h).response(self._omega, heights, forces)
                wrong.append(found - exact)
        except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
            return np.inf
        return float(np.sqrt((self._power(wrong) / self._right).max()))

    def _power(self, responses: Sequence[ComplexArray]) -> FloatArray:
        """Of forces in each direction, that of all wheels and causes together."""
        directions = self._directions
        squares = sum(
            (np.abs(values.reshape(len(values), -1, directions)) ** 2).sum(axis=1)
            for values in responses
        )
        power: FloatArray = np.trapezoid(squares, self._omega, axis=0)
        return power


def _forces(part: Part) -> tuple[str, ...]:
    """Those that are of one direction and the same at wheel and rail."""
    return part.layout.surface.names(FORCE)
