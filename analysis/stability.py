"""The largest stable communication step of a vehicle and a track, from their linear models."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railcosim.master.component import ComponentError
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.interface_jacobian import InterfaceJacobian
from railcosim.master.stability.amplification import Amplifier
from railcosim.track.irregularity import flat

from .catalogue import Owner
from .contact import Parameters, stiffness_at
from .linear_pair import Part, coupled
from .pair import Journey, open_pair

RATE = 1.0
"""What grows slower than exp(RATE t), in 1/s, counts as stable: the rail's pinned-pinned mode has
no damping of its own, and any scheme of finite order drives it a little."""
SHORTEST, LONGEST = 2e-6, 1e-2
"""Range of steps that is scanned, s."""
PER_DECADE = 5
"""Steps scanned in a factor of ten."""
RESOLUTION = 2e-3
"""Relative, of the largest stable step."""

Progress = Callable[[float, float], None]
FINE = 1e-10
"""Tolerance of forces, relative: far below what a step does to them, far above rounding."""


@dataclass(frozen=True, kw_only=True)
class Limit:
    """How far a coupling is stable.

    Attributes
    ----------
    step : float
        The largest step, s, below which every step scanned is stable; infinite if all are, zero
        if none is.
    evaluations : int
        How often each component is stepped in a step, at the most.
    """

    step: float
    evaluations: int


class Contact:
    """A pair with springs of one stiffness on one side, for all schemes.

    Parameters
    ----------
    parts : sequence of Part
        The pair.
    owner : Owner
        Of the contact springs.
    k_H : float
        Their stiffness, N/m.

    Attributes
    ----------
    systems : list of System
        One a part, at rest.
    rate : float
        What grows slower (1/s) counts as stable: `RATE`, beyond what grows when vehicle and track
        are coupled exactly.
    """

    def __init__(self, parts: Sequence[Part], owner: Owner, k_H: float) -> None:
        k = [np.full(len(part.wheels), k_H) for part in parts]
        self.systems = [coupled(part, owner, its) for part, its in zip(parts, k, strict=True)]
        exact = max(part.growth(its) for part, its in zip(parts, k, strict=True))
        self.rate = RATE + max(exact, 0.0)
        self.rests = [system.save_state() for system in self.systems]


class Coupling:
    """A scheme at a contact, ready to be asked.

    Parameters
    ----------
    contact : Contact
        The pair.
    scheme : Scheme
        The scheme.

    Raises
    ------
    ValueError
        If the scheme does not suit the owner.
    """

    def __init__(self, contact: Contact, scheme: Scheme) -> None:
        scheme = _observed(scheme)
        self.rate = contact.rate
        self.amplifiers = []
        for system, rest in zip(contact.systems, contact.rests, strict=True):
            system.restore_state(rest)
            self.amplifiers.append(Amplifier(system, scheme))
        scheme.start(self.amplifiers[0].system)

    @property
    def evaluations(self) -> int:
        """How often each component was stepped in a step, at the most, so far."""
        return max(a.evaluations for a in self.amplifiers)

    def is_stable(self, h: float) -> bool:
        """Whether nothing grows with steps of `h` (s); a scheme that fails is not stable."""
        try:
            return all(a.at(h).growing(self.rate) == 0 for a in self.amplifiers)
        except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
            return False

    def growth(self, h: float) -> float:
        """Rate (1/s) of the fastest-growing motion with steps of `h` (s); infinite if it fails.

        Negative if all motions die away: then of the one that does so most slowly.
        """
        try:
            return max(a.at(h).growth() for a in self.amplifiers)
        except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
            return math.inf

    def limit(self) -> Limit:
        """Find the largest stable step: scan from the shortest, then halve the interval."""
        count = round(PER_DECADE * math.log10(LONGEST / SHORTEST)) + 1
        stable = 0.0
        for h in np.geomspace(SHORTEST, LONGEST, count).tolist():
            if not self.is_stable(h):
                break
            stable = h
        else:
            return Limit(step=math.inf, evaluations=self.evaluations)
        unstable = h
        while stable > 0.0 and unstable > stable * (1.0 + RESOLUTION):
            middle = math.sqrt(stable * unstable)
            if self.is_stable(middle):
                stable = middle
            else:
                unstable = middle
        return Limit(step=stable, evaluations=self.evaluations)


def limits(
    parts: Sequence[Part], owner: Owner, k_H: float, schemes: dict[str, Scheme], progress: Progress
) -> dict[str, Limit]:
    """Largest stable steps of several schemes at one contact, by their names.

    Parameters
    ----------
    parts, owner, k_H
        See `Contact`.
    schemes : dict of str to Scheme
        The schemes, all suitable for the owner.
    progress : callable
        Told what is done and the total.
    """
    contact = Contact(parts, owner, k_H)
    found = {}
    for i, (name, scheme) in enumerate(schemes.items()):
        found[name] = Coupling(contact, scheme).limit()
        progress(i + 1, len(schemes))
    return found


def _observed(scheme: Scheme) -> Scheme:
    """The scheme with a tolerance so fine that a step is a linear map.

    Else a step whose forces were foreseen well enough is taken as it is, and another is not.
    """
    if isinstance(scheme, InterfaceJacobian):
        return replace(scheme, tolerance=FINE)
    return scheme


def static_stiffness(vehicle: Path, track: Path, parameters: Parameters) -> float:
    """Tangent of the contact law at the static load of the most loaded wheel, N/m.

    Parameters
    ----------
    vehicle, track : Path
        FMU files that take contact forces.
    parameters : mapping
        Of the contact, as far as they are given; see `open_pair`.
    """
    journey = Journey(speed=1.0, held=True, profile=flat())
    with open_pair(vehicle, track, parameters, journey) as pair:
        return stiffness_at(pair.parameters, pair.static_load)
