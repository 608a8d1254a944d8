"""Wheels that roll on rails at a speed, linear about straight running, as joints at the ports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.joint import End, Joint
from railcosim.mechanics.contact.at_ports import PORTS, AtPorts
from railcosim.mechanics.contact.creep import LINEAR, CreepLaw
from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Geometry
from railcosim.mechanics.contact.rolling import RollingContact
from railcosim.mechanics.contact.wheelset import at_rest
from railcosim.mechanics.ports import (
    DIMENSIONS,
    FORCE,
    IRREGULARITY,
    OF_WHEELS,
    RAIL,
    ROLL,
    WHEEL,
    YAW,
    Layout,
)
from railcosim.vehicle.bodies import SPIN
from railcosim.vehicle.multibody import Multibody

ON_WHEEL, ON_RAIL = OF_WHEELS["spatial"], DIMENSIONS["spatial"]
RAIL_MOMENT = "rail_moment_x"
"""About the rail's datum; that of the wheel's, `moment_x`, is about the wheel's."""
FORCES = (*(d.effort for d in ON_WHEEL), RAIL_MOMENT)
"""Of a contact, last parts of names: those down and to the right are the same at both bodies."""
TOLD = [*range(len(ON_WHEEL)), PORTS.index((RAIL, ROLL))]
"""Their places among all forces, `PORTS`."""
ROUGH = ON_RAIL[:2]
"""Directions in which a rail is irregular: down and aside."""
BOTH = np.array([LEFT, RIGHT])
"""Sides of a wheelset's contacts."""


@dataclass(frozen=True, kw_only=True)
class LinearContacts:
    """Contacts of all wheelsets about straight running at 1 m/s.

    Creepages are velocities over the speed, so what they do to forces falls with it; the moments of
    turning axles grow with it.

    Attributes
    ----------
    K, C : array, shape (n_contacts, 8, 8)
        What wheels do to rails by motions and by rates at `PORTS`, left contacts first.
    turning : array, shape (n_wheelsets,)
        Angular momentum of each axle, N m s per m/s.
    """

    K: FloatArray
    C: FloatArray
    turning: FloatArray

    @classmethod
    def of(
        cls, body: Multibody, wheels: Sequence[Geometry], creep: CreepLaw = LINEAR
    ) -> LinearContacts:
        """Of a vehicle's wheels on their rails, under its static loads.

        Parameters
        ----------
        body : Multibody
            The vehicle in space.
        wheels : sequence of Geometry, length n_wheelsets
            From the front.
        creep : CreepLaw
            Kalker's linear one if not given.

        Raises
        ------
        ArithmeticError
            If a wheelset cannot stand under its load.
        """
        inertia = np.diag(body.M)[[body.at(axle, SPIN) for axle in body.axles]].tolist()
        laws = [
            AtPorts(
                contact=RollingContact(
                    geometry=wheel, side=BOTH, speed=1.0, creep=creep, axle_inertia=one
                ),
                half_distance=cylinder.half_distance,
            )
            for wheel, cylinder, one in zip(wheels, body.wheels, inertia, strict=True)
        ]
        return cls.under(laws, body.wheel_load)

    @classmethod
    def under(cls, laws: Sequence[AtPorts], load: FloatArray) -> LinearContacts:
        """Of the left and the right wheel of each wheelset from the front, by their law at 1 m/s.

        Parameters
        ----------
        laws : sequence of AtPorts, length n_wheelsets
            Each of two contacts.
        load : array, shape (n_wheelsets,)
            Static, of one wheel, N.

        Raises
        ------
        ArithmeticError
            If a wheelset cannot stand under its load.
        """
        made = [_tangents(law, one) for law, one in zip(laws, load.tolist(), strict=True)]
        K, C = (np.concatenate(np.swapaxes([one[k] for one in made], 0, 1)) for k in range(2))
        turning = [np.max(law.contact.axle_inertia / law.contact.geometry.radius) for law in laws]
        return cls(K=K, C=C, turning=np.array(turning))

    def at(self, speed: float) -> Running:
        """At a speed, m/s."""
        turning = np.tile(self.turning, 2)
        G = np.zeros_like(self.C)
        roll, yaw = PORTS.index((WHEEL, ROLL)), PORTS.index((WHEEL, YAW))
        # Half of the axle's moment at each wheel, turned round: what wheels do to rails.
        G[:, roll, yaw], G[:, yaw, roll] = turning / 2, -turning / 2
        return Running(K=self.K, C=self.C / speed, G=speed * G, speed=speed)


@dataclass(frozen=True, kw_only=True)
class Running:
    """The same at a speed.

    Attributes
    ----------
    K, C : array, shape (n_contacts, 8, 8)
        See `LinearContacts`.
    G : array, shape (n_contacts, 8, 8)
        Moments of turning axles by rates, as if contacts gave them.
    speed : float
        m/s.
    """

    K: FloatArray
    C: FloatArray
    G: FloatArray
    speed: float

    def joints(self) -> list[Joint]:
        """One a contact, left ones first; forces `FORCES`, irregularities down and to the right."""
        layout = Layout(len(self.K) // 2, directions=ON_WHEEL)
        split, m = len(ON_WHEEL), len(TOLD)
        by_gap = [PORTS.index((RAIL, d)) for d in ROUGH]
        # A wheel takes the first five; a rail those down, aside, and the moment about its datum.
        on_wheel = tuple(range(split))
        on_rail = (*(ON_WHEEL.index(d) for d in ROUGH), m - 1)
        found = []
        for k in range(layout.contacts):
            ports = layout.ports[split * k : split * (k + 1)]
            K, C, G = (A[k][TOLD] for A in (self.K, self.C, self.G))
            rails = ports[: len(ON_RAIL)]
            wheel = ports[0].wheel
            found.append(
                Joint(
                    forces=tuple(f"{wheel}.{effort}" for effort in FORCES),
                    gaps=tuple(p.name(IRREGULARITY) for p in ports[: len(ROUGH)]),
                    first=End(
                        inputs=tuple(p.name(FORCE) for p in ports),
                        takes=on_wheel,
                        outputs=tuple(p.name(WHEEL.motion) for p in ports),
                        stiffness=K[:, :split],
                        damping=C[:, :split],
                        beside=G[:, :split],
                    ),
                    second=End(
                        inputs=tuple(p.name(FORCE) for p in rails),
                        takes=on_rail,
                        outputs=tuple(p.name(RAIL.motion) for p in rails),
                        stiffness=K[:, split:],
                        damping=C[:, split:],
                    ),
                    flexibility=np.eye(m),
                    by_gap=K[:, by_gap],
                )
            )
        return found


def _tangents(ports: AtPorts, load: float) -> tuple[FloatArray, FloatArray]:
    """Of the left and the right contact of a wheelset at rest, (2, 8, 8), by motions and rates.

    Without the moments of its axle, which grow with the speed where creep falls.
    """
    ports = replace(ports, contact=replace(ports.contact, axle_inertia=0.0))
    at = at_rest(ports.contact, load)
    rest = np.linalg.solve(ports.coordinates, at[..., None])[..., 0].astype(float)
    return ports.tangents(rest, np.zeros_like(rest))
