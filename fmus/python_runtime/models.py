"""The model behind an FMU: a vector of inputs to a vector of outputs. Needs numpy only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...mechanics.contact.at_ports import GIVEN, AtPorts, Rolls
from ...mechanics.contact.creep import LINEAR, CreepLaw, Patch, Unlike
from ...mechanics.contact.fastsim import Fastsim
from ...mechanics.contact.geometry import LEFT, RIGHT, KnownCone, KnownTextbookCone
from ...mechanics.contact.profiled import Profiled
from ...mechanics.contact.rolling import Flange, RollingContact
from ...mechanics.contact.saturation import Saturated
from ...mechanics.law import HertzContact, LinearContact, OwnLaw, Pressed
from ...mechanics.modal import ModalBody
from ...mechanics.motion import Forces, FromOutside, Inputs, Mover, OwnContact
from ...mechanics.ports import Layout
from ...mechanics.stepping import State
from ..roles import Role, Slot

FloatArray = NDArray[np.float64]
Parameters: TypeAlias = Mapping[tuple[Role, int], float]
"""Values by role and index."""


class Places:
    """Where the variables of a role stand in the vector of a causality, and whose they are."""

    def __init__(self, slots: Sequence[Slot], causality: str) -> None:
        self._slots = [slot for slot in slots if slot.causality == causality]

    def __call__(self, role: Role) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Places, and indices of the owners."""
        at = [k for k, slot in enumerate(self._slots) if slot.role is role]
        return np.array(at, dtype=int), np.array([self._slots[k].owner for k in at], dtype=int)


def own_law(parameters: Parameters, body: ModalBody, profiles: Profiled | None = None) -> OwnLaw:
    """The law the parameters ask for, of all wheels or of those of each wheelset."""
    contacts = body.layout.contacts  # wheelsets from the front, side by side

    def each(role: Role) -> FloatArray:
        return np.resize(
            [parameters[key] for key in sorted(parameters) if key[0] is role], contacts
        )

    if (Role.NONLINEAR, 0) not in parameters:
        return Rolls(rolling_contact(each, body.layout, profiles), body.face)
    if parameters[Role.NONLINEAR, 0]:
        return Pressed(HertzContact(C=each(Role.HERTZ)), body.sign)
    return Pressed(LinearContact(k_H=each(Role.STIFFNESS)), body.sign)


def rolling_contact(
    each: Callable[[Role], FloatArray],
    layout: Layout,
    profiles: Profiled | None = None,
    speed: float = 1.0,
) -> AtPorts:
    """Wheels that roll, by their parameters at each contact; friction of 0 bounds no creep.

    The speed (m/s) is for who asks without one of the moment.

    A master that owns the contact takes it, too.
    """
    geometry: Any = profiles or _cone(each)  # a number a contact
    contact = RollingContact(
        geometry=geometry,
        side=np.repeat([LEFT, RIGHT][: len(layout.sides)], layout.wheelsets),
        speed=speed,
        creep=_creep(each),
        flange=None if profiles else _flange(each),
        axle_inertia=each(Role.AXLE_INERTIA),
    )
    return AtPorts(contact=contact, half_distance=geometry.half_distance)


def _creep(each: Callable[[Role], FloatArray]) -> CreepLaw:
    """As friction bounds it, where there is any."""
    friction = each(Role.FRICTION)
    bounded = friction > 0
    if not bounded.any():
        return LINEAR
    law = Fastsim if each(Role.FASTSIM).any() else Saturated
    if bounded.all():
        return law(friction=friction)
    return Unlike(bounded, law(friction=np.where(bounded, friction, 1.0)), LINEAR)


def _cone(each: Callable[[Role], FloatArray]) -> KnownCone:
    """On a round head."""
    cone: Any = KnownTextbookCone if each(Role.TEXTBOOK).any() else KnownCone
    made: KnownCone = cone(
        radius=each(Role.RADIUS),
        half_distance=each(Role.HALF_DISTANCE),
        conicity=each(Role.CONICITY),
        head_radius=each(Role.HEAD_RADIUS),
        known=Patch.measured(
            C=each(Role.HERTZ),
            f11=each(Role.CREEP_ALONG),
            f22=each(Role.CREEP_ACROSS),
            f23=each(Role.CREEP_SPIN),
            f33=each(Role.CREEP_TURN),
            along=each(Role.ELLIPSE_ALONG),
            across=each(Role.ELLIPSE_ACROSS),
        ),
    )
    return made


def _flange(each: Callable[[Role], FloatArray]) -> Flange:
    """Of a cone; profiles have their own."""
    flange: Any = Flange
    made: Flange = flange(
        stiffness=each(Role.FLANGE_STIFFNESS),
        clearance=each(Role.FLANGE_CLEARANCE),
        depth=each(Role.FLANGE_DEPTH),
    )
    return made


class Model:
    """A body with the interface of its FMU.

    Parameters
    ----------
    body : ModalBody
        What moves.
    slots : sequence of Slot
        Its variables, in the order of the interface.
    profiles : Profiled, optional
        Of wheels and rails that roll on each other; cones if not given.
    """

    def __init__(
        self, body: ModalBody, slots: Sequence[Slot], profiles: Profiled | None = None
    ) -> None:
        self.body, self._profiles = body, profiles
        u, y = Places(slots, "input"), Places(slots, "output")
        self._positions = u(Role.IN_POSITION)
        self._loads, self._less = u(Role.IN_LOAD), u(Role.IN_LOAD_LESS)
        self._out = {role: y(role) for role in Role}
        self.mover: Mover
        self._given: int
        self._heights = np.zeros(body.layout.wheelsets)
        self._start, self._speed = self._heights, 0.0
        self._fast, _ = u(Role.IN_SPEED)

    def configure(self, parameters: Parameters) -> None:
        """Take the parameters, before `rest`."""
        forces: Forces = FromOutside()
        self._given = self.body.ports
        # Where nothing is solved for and no position is an input, a step of any length is exact.
        step = parameters.get((Role.INTERNAL_STEP, 0), np.inf)
        if self._out[Role.OUT_FORCE][0].size:
            law = own_law(parameters, self.body, self._profiles)
            forces, self._given = OwnContact(law), law.given * self.body.layout.contacts
        self.mover = Mover(self.body, forces, step)
        known = self.body.coordinates
        if known is not None:
            numbers = range(self.body.layout.wheelsets)
            self._heights = np.array([parameters[Role.START_Z, i] for i in numbers])
            ahead = known.wheelset_x - known.wheelset_x[-1]
            self._start = parameters[Role.START_POSITION, 0] + ahead
            self._speed = parameters.get((Role.SPEED, 0), 0.0)

    def read(self, u: FloatArray) -> Inputs:
        """Inputs from their vector."""
        position, load = np.zeros(self.body.layout.wheelsets), np.zeros(self._given)
        at, which = self._positions
        position[which] = u[at]
        for sign, (at, which) in ((1.0, self._loads), (-1.0, self._less)):
            np.add.at(load, which, sign * u[at])
        if self._fast.size:
            load.reshape(-1, GIVEN)[:, -1] = u[self._fast]
        return Inputs(position, load)

    def speed(self, u: FloatArray) -> float:
        """How fast wheels are, by the inputs, m/s."""
        return float(u[self._fast[0]]) if self._fast.size else self._speed

    def behind(
        self, t: float, h: float, before: FloatArray, start: FloatArray, end: FloatArray
    ) -> float:
        """What a step adds to the integral of t dV, m.

        The way since time 0 is V t less that, which is nothing where the speed does not change.

        Parameters
        ----------
        t, h : float
            Where the step begins, and how long it is, s.
        before, start, end : array
            Inputs at the end of the last step, at the beginning of this one and at its end, along
            a line.
        """
        V = [self.speed(u) for u in (before, start, end)]
        return t * (V[1] - V[0]) + (t + h / 2) * (V[2] - V[1])

    def rest(self, start: Inputs) -> State:
        """The state at rest that a run starts from.

        A vehicle rests on wheelsets held at their heights, a track under the forces from outside or
        of its own contacts.
        """
        if self.body.coordinates is not None:
            return self.body.on(self._heights)
        met, force = self.mover.met(start.position), start.load
        if isinstance(self.mover.forces, OwnContact):
            force = self.mover.forces.rest(met, start.load)
        return met.rest(force)

    def write(self, state: State, now: Inputs, gone: float, y: FloatArray) -> None:
        """Outputs into their vector, where wheels have come so far since time 0, m."""
        met = self.mover.met(now.position)
        force = self.mover.forces.at(met, state, now.load)
        answers = {Role.OUT_POSITION: self._start + gone}
        if isinstance(self.mover.forces, OwnContact):
            answers[Role.OUT_FORCE] = self.mover.forces.on_other(met, state, now.load, force)
        if self._out[Role.OUT_SEEN][0].size:
            answers[Role.OUT_SEEN] = met.observed(state, force)
        if self._out[Role.OUT_MOTION][0].size:
            answers |= {
                Role.OUT_MOTION: met.motion(state),
                Role.OUT_MOTION_RATE: met.velocity(state, force),
            }
        if self.body.coordinates is not None:
            answers |= {
                Role.OUT_COORDINATE: self.body.displacements(state),
                Role.OUT_RATE: self.body.velocities(state),
                Role.OUT_ACCELERATION: self.body.accelerations(state, force),
            }
        for role, values in answers.items():
            at, which = self._out[role]
            y[at] = values[which]
