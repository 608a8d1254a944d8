"""The largest stable communication step of a vehicle and a track, from their linear models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from railcosim.master.amplification import Amplifier
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.schemes import Scheme
from railcosim.track.irregularity import flat

from .catalogue import Owner
from .contact import FORCES, contact_law
from .linear_pair import Part, coupled
from .pair import Journey, open_pair

RATE = 1.0
"""What grows slower than exp(RATE t), in 1/s, counts as stable: the rail's pinned-pinned mode has
no damping of its own, and any scheme of finite order drives it a little."""
SHORTEST, LONGEST = 1e-6, 1e-2
"""Range of steps that is scanned, s."""
PER_DECADE = 6
"""Steps scanned in a factor of ten."""
RESOLUTION = 2e-3
"""Relative, of the largest stable step."""


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


class Coupling:
    """A scheme on a pair with springs of a stiffness on one side, ready to be asked.

    Parameters
    ----------
    parts : sequence of Part
        The pair.
    owner : Owner
        Of the contact springs.
    k_H : float or array, shape (n_wheels,)
        Their stiffness, N/m.
    scheme : Scheme
        The scheme.

    Raises
    ------
    ValueError
        If the scheme does not suit the owner.
    """

    def __init__(
        self, parts: Sequence[Part], owner: Owner, k_H: float | FloatArray, scheme: Scheme
    ) -> None:
        self._amplifiers = []
        for part in parts:
            k = np.broadcast_to(np.asarray(k_H, dtype=float), len(part.wheels))
            self._amplifiers.append(Amplifier(coupled(part, owner, k), scheme))
        scheme.start(self._amplifiers[0].system)

    @property
    def evaluations(self) -> int:
        """How often each component was stepped in a step, at the most, so far."""
        return max(a.evaluations for a in self._amplifiers)

    def is_stable(self, h: float) -> bool:
        """Whether nothing grows with steps of `h` (s); a scheme that fails is not stable."""
        try:
            return all(a.at(h).growing(RATE) == 0 for a in self._amplifiers)
        except (ComponentError, ArithmeticError, np.linalg.LinAlgError):
            return False

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


def static_stiffness(vehicle: Path, track: Path, parameters: dict[str, float | bool]) -> float:
    """Tangent of the contact law at the static load of the most loaded wheel, N/m.

    Parameters
    ----------
    vehicle, track : Path
        FMU files that take contact forces.
    parameters : dict
        Of the contact.
    """
    journey = Journey(speed=1.0, held=True, profile=flat(1.0))
    with open_pair(vehicle, track, parameters, journey) as pair:
        pair.system.exchange()
        names = pair.system.names
        force = np.array([pair.system.outputs[names.index(f"contact.{name}")] for name in FORCES])
    law = contact_law(parameters).law
    compression = brentq(lambda x: float(law.force(np.array([x]))[0]) - force.max(), 0.0, 1.0)
    return float(law.stiffness(np.array([compression]))[0])
