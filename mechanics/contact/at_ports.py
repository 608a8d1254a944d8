"""The law of rolling contact at the ports of wheel and rail, as two bodies exchange it.

Needs numpy only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..ports import DIMENSIONS, OF_WHEELS, RAIL, WHEEL, Direction, Face
from .geometry import COORDINATES
from .numbers import Numbers
from .rolling import RollingContact

PORTS: tuple[tuple[Face, Direction], ...] = (
    *((WHEEL, direction) for direction in OF_WHEELS["spatial"]),
    *((RAIL, direction) for direction in DIMENSIONS["spatial"]),
)
"""Of a contact, in the order of its motions and forces: the wheel's, then the rail's."""
GIVEN = 2 * len(PORTS) + 1
"""Numbers that forces of a contact follow from: motions at `PORTS`, their rates, and the speed."""


@dataclass(frozen=True, kw_only=True)
class AtPorts:
    """A rolling contact by motions at a datum of each wheel and each rail.

    A wheel's datum is the point of its material that is designed to lie on the rail's: r0 below
    the axle and b beside the wheelset's middle. It moves as the wheelset does, to first order:
    down by z + s b roll, to the right by y - r0 roll, forward by r0 spin - s b yaw, with s = 1 on
    the right and -1 on the left. All that is left out is geometry of the second order between two
    bodies that hardly turn; the contact's own, which decides how wheelsets centre, is in the law.

    Attributes
    ----------
    contact : RollingContact
        The law.
    half_distance : float
        b, of the data from the wheelset's middle, m.
    """

    contact: RollingContact
    half_distance: float

    @property
    def directions(self) -> int:
        """Motions of a contact, and forces: those of `PORTS`."""
        return len(PORTS)

    @cached_property
    def coordinates(self) -> FloatArray:
        """`COORDINATES` of each contact by its port motions, shape (n, 8, 8)."""
        side, r0 = self.contact.side, self.contact.geometry.radius
        at = {(face.name, d.name): k for k, (face, d) in enumerate(PORTS)}
        T = np.zeros((side.size, len(COORDINATES), len(PORTS)))
        rows = {name: T[:, k] for k, name in enumerate(COORDINATES)}
        z, y, roll, x, yaw = (at["wheel", d.name] for d in OF_WHEELS["spatial"])
        out = side * self.half_distance
        rows["z"][:, z], rows["z"][:, roll] = 1.0, -out
        rows["y"][:, y], rows["y"][:, roll] = 1.0, r0
        rows["roll"][:, roll] = rows["yaw"][:, yaw] = 1.0
        rows["spin"][:, x], rows["spin"][:, yaw] = 1 / r0, out / r0
        for direction in DIMENSIONS["spatial"]:
            rows[f"rail_{direction.name}"][:, at["rail", direction.name]] = 1.0
        return T

    @cached_property
    def signs(self) -> FloatArray:
        """Of the force numbers: what a wheel does to its rail, shape (8,)."""
        return np.array([float(face.push) for face, _ in PORTS])

    def force(self, q: Numbers, v: Numbers, speed: FloatArray | None = None) -> Numbers:
        """What wheels do to rails.

        Parameters
        ----------
        q, v : array, shape (..., n, 8)
            Motions at `PORTS`, m and rad, and their rates. An irregularity of the rail is added to
            the rail's motions, not to their rates.
        speed : array, shape (..., n), optional
            Of the moment, m/s; that of the law if not given.

        Returns
        -------
        array, shape (..., n, 8)
            N and N m. Those down and to the right are the same at wheel and rail; a moment about x
            is about the datum of the one or of the other, which move.
        """
        return self._pushed(self.contact.force(self._turned(q), self._turned(v), speed))

    def by_speed(self, v: FloatArray, by_v: FloatArray, speed: FloatArray) -> FloatArray:
        """Derivatives of the forces by the speed, (..., n, 8), from those by rates.

        Creep knows rates over the speed; what an axle's momentum makes of them grows with it.
        """
        turning = self._pushed(self.contact.turning(self._turned(v), speed))
        of_rates = np.einsum("...ij,...j->...i", by_v, v)
        found: FloatArray = (2 * turning - of_rates) / speed[..., None]
        return found

    def _pushed(self, f: Numbers) -> Numbers:
        found: Numbers = self.signs * np.einsum("nij,...ni->...nj", self.coordinates, f)
        return found

    def tangents(
        self, q: FloatArray, v: FloatArray, speed: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of the forces by motions and by rates, each (..., n, 8, 8)."""
        T = self.coordinates
        by_q, by_v = self.contact.tangents(self._turned(q), self._turned(v), speed)
        signs = self.signs[:, None]
        to_ports = np.swapaxes(T, 1, 2)
        return signs * (to_ports @ by_q @ T), signs * (to_ports @ by_v @ T)

    def _turned(self, at_ports: Numbers) -> Numbers:
        turned: Numbers = np.einsum("nij,...nj->...ni", self.coordinates, at_ports)
        return turned


@dataclass(frozen=True)
class Rolls:
    """The law as one of the motions of wheels or of rails, whose body owns it; an `OwnLaw`.

    Given of a contact are `GIVEN` numbers: motions at `PORTS`, their rates, and the speed (m/s).
    Motions and rates add to the body's own, so at its own ports stand irregularities, which have no
    rates, or nothing.

    Attributes
    ----------
    law : AtPorts
        Of all contacts.
    face : Face
        WHEEL or RAIL: the body's.
    """

    law: AtPorts
    face: Face
    of_rates: ClassVar[bool] = True
    given: ClassVar[int] = GIVEN

    @property
    def directions(self) -> int:
        """See `OwnLaw`."""
        return len(_places(self.face))

    def force(self, q: Numbers, v: Numbers, given: FloatArray) -> Numbers:
        """See `OwnLaw`."""
        return self._all(q, v, given)[..., _places(self.face)]

    def tangents(
        self, q: FloatArray, v: FloatArray, given: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See `OwnLaw`."""
        at, own = self._at(q, v, given), np.array(_places(self.face))
        by_q, by_v = self.law.tangents(*at)
        return by_q[..., own[:, None], own], by_v[..., own[:, None], own]

    def on_other(self, q: FloatArray, v: FloatArray, given: FloatArray) -> FloatArray:
        """See `OwnLaw`: a moment is about the other's datum."""
        return self._all(q, v, given)[..., _places(self.face.other)]

    def _all(self, q: Numbers, v: Numbers, given: FloatArray) -> Numbers:
        """Forces at `PORTS`."""
        return self.law.force(*self._at(q, v, given))

    def _at(self, q: Numbers, v: Numbers, given: FloatArray) -> tuple[Numbers, Numbers, FloatArray]:
        """Motions and rates at `PORTS`, and the speed."""
        own = np.eye(len(PORTS))[_places(self.face)]
        motions, rates, speed = apart(given)
        return q @ own + motions, v @ own + rates, speed


def apart(given: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Motions and rates, each (..., n, 8), and speeds (..., n), of `GIVEN` numbers a contact."""
    motions, rates, speed = np.split(given, [len(PORTS), 2 * len(PORTS)], axis=-1)
    return motions, rates, speed[..., 0]


def _places(face: Face) -> list[int]:
    """Of a face among `PORTS`."""
    return [k for k, (of, _) in enumerate(PORTS) if of == face]
