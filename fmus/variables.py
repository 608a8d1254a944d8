"""The variables of the FMUs: one row each, made for a wheel, a wheelset or a body."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, IRREGULARITY, Face, Port, wheelset_name

from .roles import Role, Slot


@dataclass(frozen=True, kw_only=True)
class Scalar:
    """One FMI variable.

    Attributes
    ----------
    name, unit, description : str
        Unit as the XML's UnitDefinitions name it.
    role : Role
        What it is to the model.
    causality : str
        input, output, parameter or independent.
    index : int
        Of which wheelset, port or coordinate of the model it is, from 0.
    port : Port or None
        What it is a variable of.
    quantity : str
        Last part of its name.
    variability : str
        continuous, fixed or tunable.
    type : str
        Real, Integer or Boolean.
    start : float, int, bool or None
        Start value of inputs and parameters.
    display_unit : str
        What people read it in, if not in `unit`.
    nominal : float
        A typical magnitude.
    minimum, maximum : float or None
        Allowed range.
    depends_on : tuple of str
        Inputs, parameters and time that an output depends on at once, the state being what it is.
    starts_from : tuple of str
        Those that it depends on in initialisation, where the state is the one at rest.
    """

    name: str
    unit: str
    description: str
    role: Role
    causality: str
    index: int = 0
    port: Port | None = None
    variability: str = "continuous"
    type: str = "Real"
    start: float | int | bool | None = None
    display_unit: str = ""
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    depends_on: tuple[str, ...] = field(default=())
    starts_from: tuple[str, ...] = field(default=())

    @property
    def quantity(self) -> str:
        """Last part of its name."""
        return self.name.rpartition(".")[2]

    @property
    def slot(self) -> Slot:
        """What it is to the model."""
        return Slot(self.causality, self.role, self.index)

    def as_dict(self) -> dict[str, object]:
        """For the runtime's own copy of the table."""
        return asdict(replace(self, port=None))


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Start values of the contact parameters.

    Attributes
    ----------
    k_H, C : tuple of float
        N/m and N/m^1.5: one number of all wheels, or one of those of each wheelset.
    """

    k_H: tuple[float, ...]
    C: tuple[float, ...]


def names(table: Iterable[Scalar]) -> tuple[str, ...]:
    """Names of rows."""
    return tuple(v.name for v in table)


def time() -> Scalar:
    """The independent variable."""
    return Scalar(
        name="time",
        unit="s",
        description="simulation time",
        role=Role.TIME,
        causality="independent",
    )


def position(i: int, causality: str, start: float | None = None) -> Scalar:
    """Where a wheelset is."""
    return Scalar(
        name=f"{wheelset_name(i)}.position",
        unit="m",
        description=f"position of wheelset {i} along the track, forward; on a ring it wraps",
        role=Role.IN_POSITION if causality == "input" else Role.OUT_POSITION,
        causality=causality,
        index=i - 1,
        start=start,
        nominal=100.0,
    )


@dataclass(frozen=True)
class AtPort:
    """Makes the variables of one port of a body.

    Attributes
    ----------
    body : ModalBody
        Of which.
    index : int
        Which of its ports.
    """

    body: ModalBody
    index: int

    @property
    def port(self) -> Port:
        """The port."""
        return self.body.layout.ports[self.index]

    def _row(self, quantity: str, role: Role, causality: str, **known: Any) -> Scalar:
        port = self.port
        return Scalar(
            name=port.name(quantity), role=role, causality=causality, index=self.index, port=port,
            **known,
        )  # fmt: skip

    def force(self, causality: str, start: float | None = None) -> Scalar:
        """Of the contact."""
        direction = self.port.direction
        return self._row(
            FORCE, Role.IN_LOAD if causality == "input" else Role.OUT_FORCE, causality,
            unit=direction.force, display_unit="kN", start=start, nominal=1e5,
            description=FORCES.get(
                direction.name,
                f"contact force, {direction.positive} on the rail, the opposite on the wheel",
            ),
        )  # fmt: skip

    def motion(self, face: Face, causality: str) -> Scalar:
        """Of the body's own face, or the other's as an input."""
        direction = self.port.direction
        row = self._row(
            face.motion, Role.IN_LOAD if causality == "input" else Role.OUT_MOTION, causality,
            unit=direction.motion, display_unit="mm", nominal=1e-3,
            start=0.0 if causality == "input" else None,
            description=MOTIONS[face.name].format(direction.positive),
        )  # fmt: skip
        if causality == "input" or self.body.coordinates is None:
            return row
        return replace(row, role=Role.OUT_COORDINATE, index=self._coordinate())

    def rate(self) -> Scalar:
        """Of the body's own face."""
        face, direction = self.body.face, self.port.direction
        row = self._row(
            face.rate, Role.OUT_MOTION_RATE, "output", unit=f"{direction.motion}/s",
            display_unit="mm/s", nominal=0.1,
            description=RATES[face.name].format(direction.positive),
        )  # fmt: skip
        if self.body.coordinates is None:
            return row
        return replace(row, role=Role.OUT_RATE, index=self._coordinate())

    def irregularity(self) -> Scalar:
        """Of the rail; it takes off what a rail presses against, and adds to what a wheel does."""
        role = Role.IN_LOAD_LESS if self.body.sign < 0 else Role.IN_LOAD
        return self._row(
            IRREGULARITY,
            role,
            "input",
            unit="m",
            display_unit="mm",
            start=0.0,
            nominal=1e-3,
            description="rail surface under the wheel below its nominal height, down positive",
        )

    def _coordinate(self) -> int:
        known = self.body.coordinates
        assert known is not None
        return int(known.wheelsets[self.port.wheelset - 1])


FORCES = {"z": "contact force, compression positive: down on the rail, up on the wheel"}
MOTIONS = {
    "rail": "deflection of the rail under the wheel, {}, from the unloaded track",
    "wheel": "displacement of the wheel, {}, from touching the unloaded track",
}
RATES = {
    "rail": "velocity ({}) of the rail's material point under the wheel",
    "wheel": "velocity of the wheel, {}",
}


def ports_of(body: ModalBody) -> list[AtPort]:
    """Makers of variables, in the order of the ports."""
    return [AtPort(body, k) for k in range(body.ports)]


ABOUT = {"carbody": "the car body", "bogie[1]": "the front bogie", "bogie[2]": "the rear bogie"}
"""Of a vehicle with no more bogies than these."""


def bodies(body: ModalBody, heights: Sequence[str]) -> list[Scalar]:
    """At rest a body stands on the wheelsets below it; nothing moves or is accelerated."""
    known = body.coordinates
    if known is None:
        return []
    usual = len([name for name in known.bodies if name not in body.layout.axles]) <= len(ABOUT)
    follows, table = known.following, []
    for name in known.bodies:
        if name in body.layout.axles:
            continue
        z, pitch = known.place(name, "z"), known.place(name, "pitch")
        about = ABOUT[name] if usual and name in ABOUT else name
        for quantity, role, k, known_of in (
            ("z", Role.OUT_COORDINATE, z, {"unit": "m", "display_unit": "mm", "nominal": 1e-2,
             "description": f"displacement of {about}, down"}),
            ("vz", Role.OUT_RATE, z, {"unit": "m/s", "display_unit": "mm/s", "nominal": 0.1,
             "description": f"velocity of {about}, down"}),
            ("az", Role.OUT_ACCELERATION, z, {"unit": "m/s2", "nominal": 1.0,
             "description": f"acceleration of {about}, down"}),
            ("pitch", Role.OUT_COORDINATE, pitch, {"unit": "rad", "display_unit": "mrad",
             "nominal": 1e-3, "description": f"pitch of {about}, front up positive"}),
        ):  # fmt: skip
            if k is None:
                continue
            at_rest = role is Role.OUT_COORDINATE
            below = [heights[i] for i in follows[k].nonzero()[0]] if at_rest else []
            table.append(
                Scalar(
                    name=f"{name}.{quantity}", role=role, index=k, causality="output",
                    starts_from=tuple(below), **known_of,  # type: ignore[arg-type]
                )
            )  # fmt: skip
    return table


def axleboxes(body: ModalBody, heights: Sequence[str], law: Sequence[Scalar]) -> list[Scalar]:
    """Accelerations of the wheelsets, which their own forces change at once."""
    known = body.coordinates
    if known is None:
        return []
    table = []
    for i, coordinate in zip(body.layout.numbers, known.wheelsets, strict=True):
        own = [at for at in ports_of(body) if at.port.wheelset == i]
        if law:
            given = [at.motion(body.face.other, "input") for at in own]
            depends = names([*given, *(at.irregularity() for at in own), *law_at(law, i)])
        else:
            depends = names(at.force("input") for at in own)
        # A wheelset's own force is its contact's; others reach it where suspensions are strained.
        felt = known.strained & (known.modes[coordinate] != 0)[:, None]
        near = set(felt.any(axis=0).nonzero()[0].tolist()) | ({i - 1} if law else set())
        table.append(
            Scalar(
                name=f"{wheelset_name(i)}.az",
                unit="m/s2",
                description=f"acceleration of wheelset {i} (axle box), down",
                role=Role.OUT_ACCELERATION,
                index=int(coordinate),
                causality="output",
                nominal=10.0,
                depends_on=depends,
                starts_from=(*depends, *(heights[k] for k in sorted(near))),
            )
        )
    return table


def input_hold() -> Scalar:
    """How inputs go on over a step."""
    return Scalar(
        name="input_hold",
        role=Role.HOLD,
        unit="",
        type="Integer",
        causality="parameter",
        variability="tunable",
        start=0,
        minimum=0,
        maximum=2,
        description="inputs over a step: 0 held; 1 on the line through the last two values set; "
        "2 on the line to the value set, which is that at the end of the step",
    )


def internal_step() -> Scalar:
    """Of the stepping inside.

    At 250 km/h a wheel passes a tenth of an element in 0.1 ms, which costs 1e-4 of the swing of the
    rail's deflection (measured against 6 microseconds), a thirtieth of what coupling costs at that
    step. A contact inside costs 1e-3 of the swing of its force.
    """
    return Scalar(
        name="internal_step",
        role=Role.INTERNAL_STEP,
        unit="s",
        display_unit="ms",
        causality="parameter",
        variability="fixed",
        start=1e-4,
        minimum=1e-7,
        nominal=1e-4,
        description="longest internal step while wheels move or a contact force is solved for",
    )


def contact_parameters(contact: Contact) -> list[Scalar]:
    """Of the contact law, for an FMU that owns it."""
    return [
        Scalar(
            name="contact.nonlinear", role=Role.NONLINEAR, unit="", type="Boolean",
            causality="parameter", variability="fixed", start=True,
            description="true: F = C delta^1.5 with loss of contact; false: F = k_H delta",
        ),
        *_of_wheels(
            "contact.stiffness", contact.k_H, role=Role.STIFFNESS, unit="N/m", display_unit="GN/m",
            nominal=1e9,
            description="k_H of the linear law; default: tangent of Hertz at the static load",
        ),
        *_coefficient(contact, "C of the nonlinear law"),
    ]  # fmt: skip


def told_coefficient(contact: Contact) -> list[Scalar]:
    """Of a vehicle that does not own the contact, whose wheels it is made with all the same."""
    return _coefficient(contact, "C of its wheels on the rail, for the owner of the contact")


def law_at(law: Sequence[Scalar], wheelset: int) -> list[Scalar]:
    """Contact parameters that count at a wheelset."""
    rows = Counter(v.role for v in law)
    return [v for v in law if rows[v.role] == 1 or v.index == wheelset - 1]


def _coefficient(contact: Contact, description: str) -> list[Scalar]:
    return _of_wheels(
        "contact.hertz_coefficient", contact.C, role=Role.HERTZ, unit="N/m1.5", nominal=1e11,
        description=description,
    )  # fmt: skip


def _of_wheels(name: str, starts: Sequence[float], **known: Any) -> list[Scalar]:
    """A parameter of all wheels, or one of those of each wheelset."""
    owners = [wheelset_name(i) for i in range(1, len(starts) + 1)] if len(starts) > 1 else [""]
    description = known.pop("description")
    return [
        Scalar(
            name=f"{owner}.{name}" if owner else name, index=k, start=start, minimum=1.0,
            causality="parameter", variability="fixed",
            description=f"{description}, {owner}" if owner else description, **known,
        )
        for k, (owner, start) in enumerate(zip(owners, starts, strict=True))
    ]  # fmt: skip


def journey(start_position: float, last: int) -> list[Scalar]:
    """Of a vehicle that rolls, whose last wheelset has this number."""
    return [
        Scalar(
            name="speed", role=Role.SPEED, unit="m/s", display_unit="km/h",
            causality="parameter", variability="fixed",
            start=250 / 3.6, nominal=100.0, description="speed, forward; 0 holds the positions",
        ),
        Scalar(
            name="start_position", role=Role.START_POSITION, unit="m", causality="parameter",
            variability="fixed", start=start_position, nominal=100.0,
            description=f"position of wheelset {last} at time 0",
        ),
    ]  # fmt: skip


def start_heights(body: ModalBody) -> list[Scalar]:
    """Of a vehicle at rest on the rails."""
    return [
        Scalar(
            name=f"{wheelset_name(i)}.start_z", role=Role.START_Z, index=i - 1,
            unit="m", display_unit="mm",
            causality="parameter", variability="fixed",
            start=0.0, nominal=1e-3,
            description=f"height of wheelset {i} (down) the vehicle starts at rest with; in "
            f"equilibrium with the track where wheelset[{i}].az is then zero",
        )
        for i in body.layout.numbers
    ]  # fmt: skip
