"""Laws of contact: forces of wheel on rail against how they press, with tangents in blocks.

Needs numpy only: a copy of this file travels in every FMU.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray

Numbers = TypeVar("Numbers", float, NDArray[np.float64])


class ContactLaw(Protocol):
    """Forces of contacts against what presses them, one row a contact, one column a direction.

    Where a force depends on more than its own compressions, on rates as well (`contact.rolling`),
    there are m columns of motions, k of forces, and tangents of shape (n_contacts, k, m).
    """

    @property
    def directions(self) -> int:
        """How many directions it knows, k."""

    def force(self, compression: FloatArray) -> FloatArray:
        """Forces (N) of compressions (m), both of shape (n_contacts, k)."""

    def tangent(self, compression: FloatArray) -> FloatArray:
        """Their derivatives, shape (n_contacts, k, k), N/m."""


class OwnLaw(Protocol):
    """The law of the contacts that a body owns, in its own k directions.

    Motions q of the body at its ports (m, rad) and their rates v are of shape (..., n, k), n
    contacts; what the other one does, and irregularities, are g numbers a contact, (..., n, g).
    """

    @property
    def directions(self) -> int:
        """How many, k."""

    @property
    def given(self) -> int:
        """How many, g."""

    @property
    def of_rates(self) -> bool:
        """Whether forces depend on rates: then they act on what they depend on at once."""

    def force(self, q: FloatArray, v: FloatArray, given: FloatArray) -> FloatArray:
        """Forces at the body's ports, what wheels do to rails, shape (..., n, k), N and N m."""

    def tangents(
        self, q: FloatArray, v: FloatArray, given: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Their derivatives by q and by v, each of shape (..., n, k, k)."""

    def on_other(self, q: FloatArray, v: FloatArray, given: FloatArray) -> FloatArray:
        """Forces at the ports of what the body meets, shape (..., n, directions of that)."""


@dataclass(frozen=True)
class Pressed:
    """Contacts that are only pressed, each direction by itself: forces know no rates.

    The given number of a direction is the height (m) of the surface that the body meets: of the
    wheel less the irregularity, or of the rail with it.

    Attributes
    ----------
    law : ContactLaw
        Of compressions.
    sign : int
        Of a compression by the body's motion: 1 for wheels, -1 for rails.
    """

    law: ContactLaw
    sign: int
    of_rates: ClassVar[bool] = False

    @property
    def directions(self) -> int:
        """See `OwnLaw`."""
        return self.law.directions

    @property
    def given(self) -> int:
        """See `OwnLaw`."""
        return self.directions

    def force(self, q: FloatArray, v: FloatArray, given: FloatArray) -> FloatArray:
        """See `OwnLaw`."""
        del v
        return self.law.force(self.sign * (q - given))

    def tangents(
        self, q: FloatArray, v: FloatArray, given: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `OwnLaw`."""
        del v
        by_q = self.sign * self.law.tangent(self.sign * (q - given))
        return by_q, np.zeros_like(by_q)

    def on_other(self, q: FloatArray, v: FloatArray, given: FloatArray) -> FloatArray:
        """See `OwnLaw`: action is reaction."""
        return self.force(q, v, given)


class NormalLaw:
    """A law of one direction, so of arrays of any shape, number by number.

    What belongs to every contact stands along the last axis, or alone in it beside its contact, as
    in a `ContactLaw`.
    """

    directions: ClassVar[int] = 1

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force, N, compression (m) positive."""
        raise NotImplementedError

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Derivative of the force, N/m."""
        raise NotImplementedError

    def tangent(self, compression: FloatArray) -> FloatArray:
        """See `ContactLaw`."""
        return self.stiffness(compression)[..., None]


@dataclass(frozen=True, kw_only=True)
class LinearContact(NormalLaw):
    """A spring that also pulls: what a linear frequency response assumes.

    Attributes
    ----------
    k_H : float or array, shape (n_contacts,)
        Stiffness of all contacts, or of each, N/m.
    """

    k_H: float | FloatArray

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force, N."""
        return _beside(self.k_H, compression) * compression

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Stiffness, N/m."""
        return np.full_like(compression, _beside(self.k_H, compression))


@dataclass(frozen=True, kw_only=True)
class HertzContact(NormalLaw):
    """F = C delta^1.5 in compression, nothing when wheel and rail part.

    Attributes
    ----------
    C : float or array, shape (n_contacts,)
        Coefficient of all contacts, or of each, N/m^1.5.
    """

    C: float | FloatArray

    def force(self, compression: FloatArray) -> FloatArray:
        """Contact force, N."""
        closed = np.maximum(compression, 0.0)
        return _beside(self.C, compression) * closed * np.sqrt(closed)

    def stiffness(self, compression: FloatArray) -> FloatArray:
        """Tangent stiffness, N/m."""
        return 1.5 * _beside(self.C, compression) * np.sqrt(np.maximum(compression, 0.0))


def _beside(number: float | FloatArray, compression: FloatArray) -> float | FloatArray:
    """What belongs to contacts, in the shape in which their compressions come."""
    if isinstance(number, np.ndarray) and compression.ndim > 1 and compression.shape[-1] == 1:
        return number[:, None]
    return number


def hertz_coefficient(
    *, young_modulus: float, poisson_ratio: float, wheel_radius: float, rail_radius: float
) -> float:
    """C of F = C delta^1.5 (N/m^1.5), so that the tangent stiffness is eq. 18 of Xu & Lu.

    Parameters
    ----------
    young_modulus : float
        Of wheel and rail, N/m2.
    poisson_ratio : float
        Of wheel and rail.
    wheel_radius, rail_radius : float
        Radii of curvature, m.

    References
    ----------
    Johnson, K. L. (1985), Contact Mechanics, Cambridge University Press.
    """
    modulus = young_modulus / (1 - poisson_ratio**2)
    return float(2 / 3 * modulus * (wheel_radius * rail_radius) ** 0.25)


def tangent_stiffness(C: Numbers, static_force: Numbers) -> Numbers:
    """k_H = dF/d delta of F = C delta^1.5 at a static force, eq. 18: N/m."""
    k_H: Numbers = 1.5 * C ** (2 / 3) * static_force ** (1 / 3)
    return k_H


def coefficient_for(k_H: Numbers, static_force: Numbers) -> Numbers:
    """C of F = C delta^1.5 (N/m^1.5) whose tangent at a static force (N) is k_H (N/m)."""
    C: Numbers = (k_H / (1.5 * static_force ** (1 / 3))) ** 1.5
    return C
