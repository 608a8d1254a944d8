"""What holds wheels and rails together: springs, wheels that roll, and the latter about rest.

Whatever it is, it is a law of motions of the whole system that are picked by rows, and of their
rates: its forces resist these motions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from scipy import sparse

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.geometry import OF_WHEELSET
from railcosim.mechanics.contact.rolling import OfMotion, RollingContact
from railcosim.mechanics.contact.wheelset import NAMES, selection
from railcosim.mechanics.law import ContactLaw, NormalLaw
from railcosim.mechanics.ports import ROLL, ROUGH, SIDES, Direction, Y, Z
from railcosim.vehicle import on_rails

from .monolithic import Monolithic


class Contacts(Protocol):
    """All contacts of a system.

    Attributes
    ----------
    law : ContactLaw
        Forces that resist, of k motions and perhaps of their rates behind them, all that belong
        together in a row.
    orders : int
        1: of motions alone; 2: of their rates, too.
    rough : tuple of Direction
        Irregularities of each contact, as the ports of a `Layout` of these directions.
    """

    @property
    def law(self) -> ContactLaw:
        """See above."""

    @property
    def orders(self) -> int:
        """See above."""

    @property
    def rough(self) -> tuple[Direction, ...]:
        """See above."""

    def rows(self, mono: Monolithic, position: FloatArray) -> sparse.csr_array:
        """The motions by the unknowns, wheelsets at places; (motions, n)."""

    def lowered(self, mono: Monolithic) -> sparse.csr_array:
        """By how much irregularities lessen the motions, (motions, irregularities)."""

    def pushes(self, mono: Monolithic) -> sparse.csr_array:
        """What wheels do to rails, as rows of `Monolithic.rails`, by the forces of the law."""


@dataclass(frozen=True)
class Pressing:
    """Springs between wheels and rails, downwards: a law of compressions, one a contact.

    Attributes
    ----------
    law : NormalLaw
        Of every contact.
    """

    law: NormalLaw
    orders: ClassVar[int] = 1
    rough: ClassVar[tuple[Direction, ...]] = (Z,)

    def rows(self, mono: Monolithic, position: FloatArray) -> sparse.csr_array:
        """See `Contacts`."""
        down = mono.directions.index(Z)
        apart = mono.wheels - mono.rails(position)
        return apart[down :: len(mono.directions)]

    def lowered(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        return sparse.eye_array(2 * len(mono.body.axles), format="csr")

    def pushes(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        down = [[float(direction is Z)] for direction in mono.directions]
        return sparse.kron(sparse.eye_array(2 * len(mono.body.axles)), down, format="csr")


def _of_wheelsets(mono: Monolithic, position: FloatArray) -> sparse.csr_array:
    """Coordinates `NAMES` of wheelset after wheelset, by the unknowns, (11 n_wheelsets, n)."""
    heads, k, axles = mono.rails(position), len(mono.directions), mono.body.axles
    order = np.array([mono.directions.index(direction) for direction in (Y, Z, ROLL)])
    unknowns = sparse.eye_array(mono.K.shape[0], format="csr")
    blocks = []
    for i, axle in enumerate(axles):
        blocks.append(unknowns[[mono.coordinate(f"{axle}.{name}") for name in OF_WHEELSET]])
        blocks += [heads[(side * len(axles) + i) * k + order] for side in range(2)]
    return sparse.vstack(blocks, format="csr")


def _rough_rails(mono: Monolithic) -> sparse.csr_array:
    """By how much irregularities of contacts, `ROUGH`, lessen the same coordinates."""
    count = len(mono.body.axles)
    found = np.zeros((count, len(NAMES), 2, count, len(ROUGH)))
    for i, side in enumerate(SIDES):
        for j, direction in enumerate(ROUGH):
            # A surface that is low is a rail that is low.
            at = NAMES.index(f"{side}.rail_{direction.name}")
            found[np.arange(count), at, i, np.arange(count), j] = -1.0
    return sparse.csr_array(found.reshape(count * len(NAMES), -1))


def _rails_pushed(mono: Monolithic) -> sparse.csr_array:
    """What resists motions of rails, turned round: that acts on them."""
    count, k = len(mono.body.axles), len(mono.directions)
    found = np.zeros((2, count, k, count, len(NAMES)))
    for i, side in enumerate(SIDES):
        for j, direction in enumerate(mono.directions):
            at = NAMES.index(f"{side}.rail_{direction.name}")
            found[i, np.arange(count), j, np.arange(count), at] = -1.0
    return sparse.csr_array(found.reshape(2 * count * k, -1))


def _of_contacts(mono: Monolithic) -> sparse.csr_array:
    """Eight coordinates of each contact, left ones first, by those of wheelsets."""
    count, chosen = len(mono.body.axles), selection()
    found = np.zeros((2, count, chosen.shape[1], count, chosen.shape[2]))
    for i in range(count):
        found[:, i, :, i] = chosen
    return sparse.csr_array(found.reshape(2 * count * chosen.shape[1], -1))


@dataclass(frozen=True)
class LinearRolling:
    """Wheels that stand or creep on both rails, linear: 11 motions a wheelset, `NAMES`.

    Irregularities are in motions, never in rates.

    Attributes
    ----------
    contacts : railcosim.vehicle.on_rails.Contacts
        What they add.
    """

    contacts: on_rails.Contacts
    orders: ClassVar[int] = 2
    rough: ClassVar[tuple[Direction, ...]] = ROUGH

    @cached_property
    def law(self) -> ContactLaw:
        """See `Contacts`."""
        return _Linear(np.concatenate([self.contacts.K, self.contacts.C], axis=-1))

    def rows(self, mono: Monolithic, position: FloatArray) -> sparse.csr_array:
        """See `Contacts`."""
        return _of_wheelsets(mono, position)

    def lowered(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        return _rough_rails(mono)

    def pushes(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        return _rails_pushed(mono)


@dataclass(frozen=True)
class _Linear:
    """Forces in proportion: matrices of shape (n, k, m)."""

    by: FloatArray

    @property
    def directions(self) -> int:
        return int(self.by.shape[1])

    def force(self, compression: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("nkm,nm->nk", self.by, compression))

    def tangent(self, compression: FloatArray) -> FloatArray:
        return self.by


@dataclass(frozen=True)
class Rolling:
    """Wheels that roll: eight motions a contact, `COORDINATES`, left contacts first.

    Irregularities are in motions, never in rates.

    Attributes
    ----------
    contact : RollingContact
        The law of all contacts, sides in their order.
    """

    contact: RollingContact
    orders: ClassVar[int] = 2
    rough: ClassVar[tuple[Direction, ...]] = ROUGH

    @property
    def law(self) -> ContactLaw:
        """See `Contacts`."""
        return _Resisting(OfMotion(self.contact))

    def rows(self, mono: Monolithic, position: FloatArray) -> sparse.csr_array:
        """See `Contacts`."""
        return _of_contacts(mono) @ _of_wheelsets(mono, position)

    def lowered(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        return _of_contacts(mono) @ _rough_rails(mono)

    def pushes(self, mono: Monolithic) -> sparse.csr_array:
        """See `Contacts`."""
        return _rails_pushed(mono) @ _of_contacts(mono).T


@dataclass(frozen=True)
class _Resisting:
    """The opposite of generalised forces."""

    driving: ContactLaw

    @property
    def directions(self) -> int:
        return self.driving.directions

    def force(self, compression: FloatArray) -> FloatArray:
        return -self.driving.force(compression)

    def tangent(self, compression: FloatArray) -> FloatArray:
        return -self.driving.tangent(compression)
