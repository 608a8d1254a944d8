"""Which owner, scheme and step reach an accuracy at the least cost, from the linear models.

The error of a scheme is that of the contact forces at communication points while the vehicle runs
over an irregularity of a given spectrum: at every frequency the response of the scheme's step,
which is a linear map, against the exact one. Nothing is run.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from railcosim.analysis.pair.linear_pair import Part
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.linear.receptance import lag
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.schemes import Scheme
from railcosim.track.irregularity import Spectrum

from .catalogue import Owner
from .stability import Contact, Coupling

STEPS = np.sort(np.outer(10.0 ** np.arange(-5, -2), [1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0,
                                                      8.0]).ravel())  # fmt: skip
"""Steps that are tried, s: round numbers up to 8 ms."""
MARGIN, REACH = 1.1, 2.0
"""Parts of the step advised up to which nothing may grow, and up to which that is looked for."""
FREQUENCIES = 150
"""Points of the spectrum: the force has no resonance sharper than a tenth of its frequency."""
Progress = Callable[[float, float], None]


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


@dataclass(frozen=True, kw_only=True)
class Option:
    """One way to couple that reaches the accuracy.

    Attributes
    ----------
    scheme : str
        Name in the catalogue.
    owner : Owner
        Of the contact springs.
    step : float
        The longest of the steps tried that does, `MARGIN` below the first unstable one, s.
    limit : float
        Largest stable step, s; infinite if nothing grows up to `REACH` times the step.
    evaluations : int
        How often each component is stepped in a step.
    error : float
        Predicted RMS of the error of the contact forces, relative to that of their dynamic part.
    errors : array, shape (len(STEPS),)
        The same over all steps tried; NaN for the others.
    """

    scheme: str
    owner: Owner
    step: float
    limit: float
    evaluations: int
    error: float
    errors: FloatArray

    @property
    def cost(self) -> float:
        """Evaluations of each component a second of time simulated."""
        return self.evaluations / self.step


def options(
    parts: tuple[Part, ...],
    owner: Owner,
    k_H: float,
    schemes: dict[str, Scheme],
    accuracy: float,
    source: Excitation,
    progress: Progress,
) -> list[Option]:
    """Find the longest step for every scheme that reaches an accuracy; see `Option`.

    Parameters
    ----------
    parts, owner, k_H
        See `Contact`.
    schemes : dict of str to Scheme
        The schemes, all suitable for the owner.
    accuracy : float
        Largest error allowed.
    source : Excitation
        What excites the vehicle.
    progress : callable
        Told what is done and the total.
    """
    contact = Contact(parts, owner, k_H)
    # Both rails are alike, so only the first of the parts moves; but all have to be stable.
    part = parts[0]
    heights = np.asarray(
        np.tile(source.heights, (1, len(part.wheels) // source.heights.shape[1])),
        dtype=np.complex128,
    )
    flexible = part.compliance(source.omega) + np.eye(len(part.wheels)) / k_H
    solved = np.linalg.solve(flexible, -heights[:, :, None])[:, :, 0]
    exact = np.asarray(solved, dtype=np.complex128)
    found = []
    for i, (name, scheme) in enumerate(schemes.items()):
        coupling = Coupling(contact, scheme)
        errors, limit = np.full(len(STEPS), np.nan), math.inf
        for j in range(len(STEPS))[::-1]:
            h = float(STEPS[j])
            if MARGIN * h > limit:
                continue
            errors[j] = _error(coupling, h, source, heights, exact)
            if errors[j] > accuracy or not coupling.is_stable(h):
                continue
            # Stable between unstable steps is no advice, nor is a step just below one: another FMU
            # may shift it.
            limit = coupling.limit(REACH * h).step
            if MARGIN * h <= limit:
                option = Option(
                    scheme=name, owner=owner, step=h, limit=limit, error=float(errors[j]),
                    errors=errors, evaluations=coupling.evaluations,
                )  # fmt: skip
                found.append(option)
                break
        progress(i + 1, len(schemes))
    return found


def _error(
    coupling: Coupling, h: float, source: Excitation, heights: ComplexArray, exact: ComplexArray
) -> float:
    """RMS of the error of the forces, of all wheels, relative to that of the forces."""
    amplifier = coupling.amplifiers[0]
    names = amplifier.system.names
    forces = [i for i, name in enumerate(names) if name.endswith(".force_z")]
    try:
        response = amplifier.at(h).response(source.omega, heights, forces)
    except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
        return np.inf
    wrong, right = (
        np.trapezoid((np.abs(values) ** 2).sum(axis=1), source.omega)
        for values in (response - exact, exact)
    )
    return float(np.sqrt(wrong / right))
