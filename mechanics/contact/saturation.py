"""Creep forces that friction bounds, by Kalker's linear ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray
from .creep import LINEAR, Patch
from .numbers import Numbers

WHOLE = 3.0
"""Linear force over the friction's from which on the contact slides as a whole."""
NO_LOAD = 1e-3  # N: a contact that presses less has no creep; avoids a division by nothing


@dataclass(frozen=True, kw_only=True)
class Saturated:
    """Shen, Hedrick & Elkins: the resultant of linear creep, bent towards friction's bound.

    The moment is taken down in the same ratio: then forces and moment never give energy, as the
    linear ones do not. It overestimates forces where spin is large: by two at 2 rad/m.

    Attributes
    ----------
    friction : float or array
        Coefficient, above 0; an array: of each contact.

    References
    ----------
    Shen, Z. Y., Hedrick, J. K. & Elkins, J. A. (1983), A comparison of alternative creep force
    models for rail vehicle dynamic analysis, Vehicle System Dynamics 12, 79-83.
    """

    friction: float | FloatArray

    def force(self, patch: Patch, normal: Numbers, creepage: Numbers) -> Numbers:
        """See `CreepLaw`."""
        linear = LINEAR.force(patch, normal, creepage)
        bound = self.friction * np.where(normal.real > NO_LOAD, normal, NO_LOAD)
        found: Numbers = linear * share(resultant(linear) / bound)[..., None]
        return found


def resultant(force: Numbers) -> Numbers:
    """Of the parts along and across."""
    found: Numbers = np.sqrt(force[..., 0] ** 2 + force[..., 1] ** 2)
    return found


def share(ratio: Numbers) -> Numbers:
    """What saturation leaves of a linear force that is `ratio` times the friction's."""
    bent = 1 - ratio / 3 + ratio**2 / 27
    slides = ratio.real >= WHOLE
    found: Numbers = np.where(slides, 1 / np.where(slides, ratio, WHOLE), bent)
    return found
