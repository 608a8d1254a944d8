"""The law of rolling contacts as an interface has it; see `railcosim.mechanics.contact`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from railcosim.mechanics.contact.at_ports import GIVEN, PORTS
from railcosim.mechanics.contact.creep import REFERENCE
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import DIMENSIONS, RAIL, WHEEL, Direction, Port, X, Y, Z

from .law_variables import coefficient, contact_place, of_wheels
from .port_variables import AtPort
from .roles import Role
from .scalar import Scalar
from .stepping_variables import CREEPING_SPEED, LEAST_SPEED

SMALLEST = 1e-5  # m
LOAD = f"a normal force of {REFERENCE / 1e3:g} kN"
ROWS: Mapping[Role, dict[str, Any]] = {
    Role.RADIUS: {
        "name": "wheel_radius", "unit": "m", "minimum": 0.05,
        "description": "r0, rolling radius of the wheels in the middle of the track",
    },
    Role.HALF_DISTANCE: {
        "name": "half_distance", "unit": "m", "minimum": 0.1,
        "description": "b, of the data of wheels and rails from the middle of the track",
    },
    Role.CONICITY: {
        "name": "conicity", "unit": "", "minimum": 0.0,
        "description": "lambda, tangent of the angle of conical wheels",
    },
    Role.HEAD_RADIUS: {
        "name": "head_radius", "unit": "m", "minimum": 0.01,
        "description": "R, radius of the rail's head across",
    },
    Role.CREEP_ALONG: {
        "name": "f11", "unit": "N", "minimum": 0.0, "nominal": 1e7,
        "description": f"force along per creepage along at {LOAD}; by its power 2/3",
    },
    Role.CREEP_ACROSS: {
        "name": "f22", "unit": "N", "minimum": 0.0, "nominal": 1e7,
        "description": f"force across per creepage across at {LOAD}; by its power 2/3",
    },
    Role.CREEP_SPIN: {
        "name": "f23", "unit": "N.m", "minimum": 0.0, "nominal": 1e4,
        "description": f"force across per spin at {LOAD}; in proportion to it",
    },
    Role.CREEP_TURN: {
        "name": "f33", "unit": "N.m2", "minimum": 0.0, "nominal": 10.0,
        "description": f"moment about the normal per spin at {LOAD}; by its power 4/3",
    },
    Role.ELLIPSE_ALONG: {
        "name": "ellipse_along", "unit": "m", "display_unit": "mm", "minimum": SMALLEST,
        "nominal": 1e-2,
        "description": f"a, semi-axis of the contact along rolling at {LOAD}; by its power 1/3; of "
        "fastsim only",
    },
    Role.ELLIPSE_ACROSS: {
        "name": "ellipse_across", "unit": "m", "display_unit": "mm", "minimum": SMALLEST,
        "nominal": 1e-2,
        "description": f"b, semi-axis of the contact across at {LOAD}; by its power 1/3; of "
        "fastsim only",
    },
    Role.FRICTION: {
        "name": "friction", "unit": "", "minimum": 0.0,
        "description": "coefficient of friction, which bounds creep; 0: creep without bound, "
        "Kalker's linear theory",
    },
    Role.FLANGE_STIFFNESS: {
        "name": "flange_stiffness", "unit": "N/m", "minimum": 0.0, "nominal": 1e7,
        "description": "of a flange against its rail, across; 0: no flanges",
    },
    Role.FLANGE_CLEARANCE: {
        "name": "flange_clearance", "unit": "m", "display_unit": "mm", "minimum": 0.0,
        "nominal": 1e-2, "description": "how far a wheel may go outwards on its rail",
    },
    Role.FLANGE_DEPTH: {
        "name": "flange_depth", "unit": "m", "display_unit": "mm", "minimum": 0.0,
        "nominal": 1e-2, "description": "of a flange's contact below the rail's datum",
    },
    Role.AXLE_INERTIA: {
        "name": "axle_inertia", "unit": "kg.m2", "minimum": 0.0, "nominal": 100.0,
        "description": "of a wheelset about its axle, whose moments as a gyroscope are with those "
        "of its contacts; 0: none, or the vehicle's own model has them",
    },
}  # fmt: skip
"""What a rolling contact is, beside Hertz's coefficient."""


@dataclass(frozen=True, kw_only=True)
class RollingWheels:
    """Wheels that roll: cones on round heads, or by tables of profiles.

    Attributes
    ----------
    numbers : dict of tuple of float
        By role, of `ROWS` and of Hertz's coefficient: one number of all wheels, or one of those of
        each wheelset. Of profiles friction and the axle's inertia: the table tells the rest.
    fastsim : bool
        Whether friction bounds creep by Kalker's simplified theory; else as Shen, Hedrick & Elkins
        do.
    textbook : bool
        Whether springs are vertical and the textbook's gravity stiffness is put in by hand.
    profiles : Profiled or None
        Of all wheels and rails; None: cones.
    """

    numbers: Mapping[Role, tuple[float, ...]]
    fastsim: bool
    textbook: bool
    profiles: Profiled | None = None
    directions: ClassVar[tuple[Direction, ...]] = DIMENSIONS["spatial"]
    of_rates: ClassVar[bool] = True

    def parameters(self) -> list[Scalar]:
        """See `OfContact`."""
        return self._rows("")

    def told(self) -> list[Scalar]:
        """See `OfContact`."""
        return self._rows("; of its wheels, for the owner of the contact")

    def _rows(self, more: str) -> list[Scalar]:
        table = [
            row
            for role, known in ROWS.items()
            if role in self.numbers
            for row in of_wheels(
                starts=self.numbers[role],
                role=role,
                **known
                | {
                    "name": f"contact.{known['name']}",
                    "description": known["description"] + more,
                },
            )
        ]
        table.append(
            Scalar(
                name="contact.fastsim", role=Role.FASTSIM, unit="", type="Boolean",
                causality="parameter", variability="fixed", start=self.fastsim,
                description="true: friction bounds creep by Kalker's FASTSIM; false: as Shen, "
                "Hedrick & Elkins do" + more,
            )
        )  # fmt: skip
        if self.profiles:
            return table
        C = "C of normal force by compression, N = C delta^1.5, with loss of contact" + more
        return [
            *coefficient(self.numbers[Role.HERTZ], C),
            *table,
            Scalar(
                name="contact.textbook", role=Role.TEXTBOOK, unit="", type="Boolean",
                causality="parameter", variability="fixed", start=self.textbook,
                description="true: contact springs are vertical, and gravity centres wheelsets by "
                "eqs 4, 5 of Xu & Lu; false: springs stand on the cones" + more,
            ),
        ]  # fmt: skip

    def given(self, body: ModalBody, contact: int) -> list[Scalar]:
        """See `OfContact`: motions and rates of what is met, places of the rail's surface."""
        first, count = GIVEN * contact, len(PORTS)
        met = body.face.other
        others = [k for k, (face, _) in enumerate(PORTS) if face == met]
        off = [PORTS.index((RAIL, direction)) for direction in (Z, Y)]
        return [
            *(_at(body, contact, k, first + k).motion(met, "input") for k in others),
            *(_at(body, contact, k, first + count + k).rate(met, "input") for k in others),
            *(_at(body, contact, k, first + k).irregularity(Role.IN_LOAD) for k in off),
        ]

    def told_forces(self, body: ModalBody, contact: int) -> list[Scalar]:
        """See `OfContact`."""
        face = body.face.other
        others = [k for k, (of, _) in enumerate(PORTS) if of == face]
        first = contact * len(others)
        return [
            _at(body, contact, k, first + n).force("output", face) for n, k in enumerate(others)
        ]

    def counts(self, given: Scalar) -> bool:
        """See `OfContact`: how far wheels have turned does not matter."""
        port = given.port
        return not (port and port.direction is X and given.name == port.name(WHEEL.motion))


def _at(body: ModalBody, contact: int, k: int, index: int) -> AtPort:
    """Maker of variables at one of `PORTS`."""
    place = contact_place(body.layout, contact)
    return AtPort(body, Port(place.wheelset, place.side, PORTS[k][1]), index)


def speed() -> Scalar:
    """Of a body whose own contacts creep."""
    return Scalar(
        name="speed", role=Role.IN_SPEED, unit="m/s", display_unit="km/h", causality="input",
        start=250 / 3.6, minimum=LEAST_SPEED, nominal=100.0, description=CREEPING_SPEED,
    )  # fmt: skip
