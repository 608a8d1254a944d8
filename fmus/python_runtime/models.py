"""The models behind the FMUs: a vector of inputs to a vector of outputs. Needs numpy only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...vehicle.contact import ContactLaw, HertzContact, LinearContact, solve_compression
from .bodies import Arrays, TrackBody, VehicleBody
from .motion import Forces, FromOutside, Inputs, Mover, OwnContact
from .stepping import State

FloatArray = NDArray[np.float64]
Parameters = Mapping[str, Any]

WHEELSETS = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
WHEELS = [f"{w}.{side}" for side in ("left", "right") for w in WHEELSETS]
BODIES = {"carbody": (0, 1), "bogie[1]": (2, 3), "bogie[2]": (4, 5)}  # z and pitch coordinates


class Places:
    """Where the variables of a quantity stand in a vector."""

    def __init__(self, names: Sequence[str]) -> None:
        self._index = {name: k for k, name in enumerate(names)}

    def __call__(self, owners: Sequence[str], quantity: str) -> NDArray[np.intp]:
        """Places of ``owner.quantity`` for every owner; none if there is no such quantity."""
        names = [f"{owner}.{quantity}" for owner in owners]
        return np.array([self._index[n] for n in names if n in self._index], dtype=int)


class Model(Protocol):
    """What an FMU needs of its model."""

    mover: Mover

    def configure(self, parameters: Parameters) -> None:
        """Take the parameters, before `rest`."""

    def read(self, u: FloatArray) -> Inputs:
        """Inputs from their vector."""

    def rest(self, start: Inputs) -> State:
        """The state at rest that a run starts from."""

    def write(self, state: State, now: Inputs, time: float, y: FloatArray) -> None:
        """Outputs into their vector."""


def contact_law(parameters: Parameters) -> ContactLaw:
    """The law the parameters ask for."""
    if parameters["contact.nonlinear"]:
        return HertzContact(C=parameters["contact.hertz_coefficient"])
    return LinearContact(k_H=parameters["contact.stiffness"])


class TrackModel:
    """Track and TrackWithContact; the latter has wheel motions for inputs."""

    def __init__(self, arrays: Arrays, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self.body = TrackBody(arrays)
        u, y = Places(inputs), Places(outputs)
        self.u_position, self.u_force = u(WHEELSETS, "position"), u(WHEELS, "force_z")
        self.u_wheel, self.u_irregularity = u(WHEELS, "wheel_z"), u(WHEELS, "irregularity_z")
        self.y_z, self.y_vz = y(WHEELS, "rail_z"), y(WHEELS, "rail_vz")
        self.y_force = y(WHEELS, "force_z")

    def configure(self, parameters: Parameters) -> None:
        """See `Model`."""
        forces: Forces = FromOutside()
        if self.u_wheel.size:
            forces = OwnContact(contact_law(parameters), sign=-1)
        self.mover = Mover(self.body, forces, parameters["internal_step"])

    def read(self, u: FloatArray) -> Inputs:
        """See `Model`; the rail presses against the wheel, raised by the irregularity."""
        if self.u_force.size:
            return Inputs(u[self.u_position], u[self.u_force])
        return Inputs(u[self.u_position], u[self.u_wheel] - u[self.u_irregularity])

    def rest(self, start: Inputs) -> State:
        """The static deflection under the forces, from outside or of the own contacts."""
        shapes, force = self.body.shapes(start.position), start.load
        if isinstance(self.mover.forces, OwnContact):
            law, G = self.mover.forces.law, self.body.static_compliance(shapes)
            force = law.force(solve_compression(law, G, start.load, guess=start.load))
        return self.body.rest(shapes, force)

    def write(self, state: State, now: Inputs, time: float, y: FloatArray) -> None:
        """See `Model`."""
        del time
        shapes = self.body.shapes(now.position)
        force = self.mover.forces.at(self.body, shapes, state, now.load)
        y[self.y_z] = self.body.motion(shapes, state)
        y[self.y_vz] = self.body.velocity(shapes, state, force)
        if self.y_force.size:
            y[self.y_force] = force


class VehicleModel:
    """Vehicle and VehicleWithContact; the latter has rail motions for inputs."""

    def __init__(self, arrays: Arrays, inputs: Sequence[str], outputs: Sequence[str]) -> None:
        self.body = VehicleBody(arrays)
        u, y = Places(inputs), Places(outputs)
        self.u_force, self.u_rail = u(WHEELS, "force_z"), u(WHEELS, "rail_z")
        self.u_irregularity = u(WHEELS, "irregularity_z")
        self.y_position, self.y_force = y(WHEELSETS, "position"), y(WHEELS, "force_z")
        self.y_z, self.y_vz = y(WHEELS, "wheel_z"), y(WHEELS, "wheel_vz")
        self.y_bodies = {q: y(list(BODIES), q) for q in ("z", "vz", "az", "pitch")}
        self.y_axlebox = y(WHEELSETS, "az")
        self.heights = np.zeros(4)

    def configure(self, parameters: Parameters) -> None:
        """See `Model`."""
        forces: Forces = FromOutside()
        if self.u_rail.size:
            forces = OwnContact(contact_law(parameters), sign=1)
        # Without contacts the vehicle's step is exact whatever its length: no position is an input.
        self.mover = Mover(self.body, forces, parameters.get("internal_step", np.inf))
        self.heights = np.array([parameters[f"{w}.start_z"] for w in WHEELSETS])
        ahead = self.body.wheelset_x - self.body.wheelset_x[-1]
        self.start, self.speed = parameters["start_position"] + ahead, parameters["speed"]

    def read(self, u: FloatArray) -> Inputs:
        """See `Model`; the wheels press against the rail, lowered by the irregularity."""
        if self.u_force.size:
            return Inputs(np.zeros(4), u[self.u_force])
        return Inputs(np.zeros(4), u[self.u_rail] + u[self.u_irregularity])

    def rest(self, start: Inputs) -> State:
        """Car body and bogies at rest on wheelsets held at the start heights."""
        del start
        return self.body.rest(self.heights)

    def write(self, state: State, now: Inputs, time: float, y: FloatArray) -> None:
        """See `Model`."""
        body, shapes = self.body, self.body.shapes(now.position)
        z, vz = body.coordinates(state), body.rates(state)
        force = self.mover.forces.at(body, shapes, state, now.load)
        az = body.accelerations(state, force)
        y[self.y_position] = self.start + self.speed * time
        y[self.y_z], y[self.y_vz] = np.tile(z[-4:], 2), np.tile(vz[-4:], 2)
        heave, pitch = np.array(list(BODIES.values())).T
        y[self.y_bodies["z"]], y[self.y_bodies["vz"]] = z[heave], vz[heave]
        y[self.y_bodies["az"]], y[self.y_bodies["pitch"]] = az[heave], z[pitch]
        y[self.y_axlebox] = az[-4:]
        if self.y_force.size:
            y[self.y_force] = force
