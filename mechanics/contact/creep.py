"""Forces between a rolling wheel and a rail that do not move quite alike.

In the plane of the contact: x along rolling, y across, z along the normal from wheel into rail, a
right-handed frame. Creepages are the wheel's velocity less the rail's over the speed; the spin is
the relative angular velocity about z over it, 1/m. Forces and the moment are those on the WHEEL.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray
from .ellipse import Ellipse, ellipse
from .kalker import Kalker, kalker
from .numbers import Numbers

REFERENCE = 1e5
"""A normal force, N: at about it wheels of full axle load press."""


@dataclass(frozen=True, kw_only=True)
class Patch:
    """What contact patches are before they are loaded: their shape and their material.

    Attributes
    ----------
    ellipse : Ellipse
        Semi-axes and approach by the load.
    kalker : Kalker
        Of the ellipse's shape.
    shear_modulus : float
        G of wheel and rail, N/m2.
    """

    ellipse: Ellipse
    kalker: Kalker
    shear_modulus: float

    @classmethod
    def of(
        cls,
        curvature_x: FloatArray | float,
        curvature_y: FloatArray | float,
        *,
        shear_modulus: float,
        poisson_ratio: float,
    ) -> Patch:
        """Patches of given curvatures; see `ellipse`."""
        shape = ellipse(
            curvature_x, curvature_y, shear_modulus=shear_modulus, poisson_ratio=poisson_ratio
        )
        return cls(
            ellipse=shape, kalker=kalker(shape.ratio, poisson_ratio), shear_modulus=shear_modulus
        )

    @classmethod
    def measured(
        cls,
        *,
        C: FloatArray | float,
        f11: FloatArray | float,
        f22: FloatArray | float,
        f23: FloatArray | float,
        f33: FloatArray | float,
        along: FloatArray | float,
        across: FloatArray | float,
    ) -> Patch:
        """Patches by what they do, whatever bodies they are of.

        Parameters
        ----------
        C : array or float
            Of N = C delta^1.5, N/m^1.5.
        f11, f22, f23, f33 : array or float
            Of linear creep at a normal force of `REFERENCE`, N, N m and N m2.
        along, across : array or float
            Semi-axes at that force, m.
        """
        root = REFERENCE ** (-1 / 3) * np.ones(np.shape(C))
        area = np.multiply(along, across)
        return cls(
            ellipse=Ellipse(along=along * root, across=across * root, C=np.asarray(C)),
            kalker=Kalker(C11=f11 / area, C22=f22 / area, C23=f23 / area**1.5, C33=f33 / area**2),
            shear_modulus=1.0,
        )

    def creep_coefficients(self, normal: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """f11, f22 (N), f23 (N m) and f33 (N m2) at a normal force, N."""
        a, b = self.ellipse.semi_axes(normal)
        area, G, C = a * b, self.shear_modulus, self.kalker
        return (
            G * C.C11 * area,
            G * C.C22 * area,
            G * C.C23 * area**1.5,
            G * C.C33 * area**2,
        )


class CreepLaw(Protocol):
    """Forces of creep."""

    def force(self, patch: Patch, normal: Numbers, creepage: Numbers) -> Numbers:
        """Forces on the wheel.

        Parameters
        ----------
        patch : Patch
            Of the contacts.
        normal : array, shape (...,)
            Normal forces, N, not below 0.
        creepage : array, shape (..., 3)
            Along, across, and spin (1/m).

        Returns
        -------
        array, shape (..., 3)
            Along and across (N), and the moment about the normal (N m).
        """


@dataclass(frozen=True)
class LinearCreep:
    """Kalker's linear theory: right for little creep, without bound.

    References
    ----------
    Kalker, J. J. (1967), On the Rolling Contact of Two Elastic Bodies in the Presence of Dry
    Friction, thesis, Delft.
    """

    def force(self, patch: Patch, normal: Numbers, creepage: Numbers) -> Numbers:
        """See `CreepLaw`."""
        f11, f22, f23, f33 = patch.creep_coefficients(normal)
        x, y, spin = np.moveaxis(creepage, -1, 0)
        forces: Numbers = np.stack([-f11 * x, -f22 * y - f23 * spin, f23 * y - f33 * spin], axis=-1)
        return forces


LINEAR = LinearCreep()


@dataclass(frozen=True)
class Unlike:
    """One law of some contacts, and another of the others.

    Attributes
    ----------
    which : array of bool, shape (n,)
        Contacts, the last axis.
    those, others : CreepLaw
        Of those, and of the others.
    """

    which: NDArray[np.bool_]
    those: CreepLaw
    others: CreepLaw

    def force(self, patch: Patch, normal: Numbers, creepage: Numbers) -> Numbers:
        """See `CreepLaw`."""
        those, others = (law.force(patch, normal, creepage) for law in (self.those, self.others))
        found: Numbers = np.where(self.which[:, None], those, others)
        return found
