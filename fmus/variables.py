"""The variables of the FMUs: one row each, made for a wheel, a wheelset or a body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field

WHEELSETS = (1, 2, 3, 4)
SIDES = ("left", "right")


@dataclass(frozen=True, kw_only=True)
class Scalar:
    """One FMI variable.

    Attributes
    ----------
    name, unit, description : str
        Unit as the XML's UnitDefinitions name it.
    causality : str
        input, output, parameter or independent.
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
    causality: str
    variability: str = "continuous"
    type: str = "Real"
    start: float | int | bool | None = None
    display_unit: str = ""
    nominal: float = 1.0
    minimum: float | None = None
    maximum: float | None = None
    depends_on: tuple[str, ...] = field(default=())
    starts_from: tuple[str, ...] = field(default=())

    def as_dict(self) -> dict[str, object]:
        """For the runtime's own copy of the table."""
        return asdict(self)


def wheels() -> Iterator[tuple[int, str]]:
    """Wheelset number and side of every wheel, left wheels first."""
    for side in SIDES:
        for i in WHEELSETS:
            yield i, side


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Start values of the contact parameters: k_H in N/m, C in N/m^1.5."""

    k_H: float
    C: float


def names(table: Iterable[Scalar]) -> tuple[str, ...]:
    """Names of rows."""
    return tuple(v.name for v in table)


def time() -> Scalar:
    """The independent variable."""
    return Scalar(name="time", unit="s", description="simulation time", causality="independent")


def position(i: int, causality: str, start: float | None = None) -> Scalar:
    """Where a wheelset is."""
    return Scalar(
        name=f"wheelset[{i}].position",
        unit="m",
        description=f"position of wheelset {i} along the track, forward; on a ring it wraps",
        causality=causality,
        start=start,
        nominal=100.0,
    )


def wheel(i: int, side: str, quantity: str, **known: object) -> Scalar:
    """A variable of one wheel."""
    return Scalar(name=f"wheelset[{i}].{side}.{quantity}", **known)  # type: ignore[arg-type]


def force(i: int, side: str, causality: str, start: float | None = None) -> Scalar:
    """Of the contact of one wheel."""
    return wheel(
        i, side, "force_z", unit="N", display_unit="kN",
        causality=causality, start=start, nominal=1e5,
        description="contact force, compression positive: down on the rail, up on the wheel",
    )  # fmt: skip


def rail_z(i: int, side: str, causality: str) -> Scalar:
    """Of the rail under one wheel."""
    return wheel(
        i, side, "rail_z", unit="m", display_unit="mm", causality=causality, nominal=1e-3,
        start=0.0 if causality == "input" else None,
        description="deflection of the rail under the wheel, down, from the unloaded track",
    )  # fmt: skip


def rail_vz(i: int, side: str) -> Scalar:
    """Of the rail under one wheel."""
    return wheel(
        i, side, "rail_vz", unit="m/s", display_unit="mm/s", causality="output", nominal=0.1,
        description="velocity (down) of the rail's material point under the wheel",
    )  # fmt: skip


def wheel_z(i: int, side: str, causality: str) -> Scalar:
    """Of one wheel."""
    return wheel(
        i, side, "wheel_z", unit="m", display_unit="mm", causality=causality, nominal=1e-3,
        start=0.0 if causality == "input" else None,
        description="displacement of the wheel, down, from touching the unloaded track",
    )  # fmt: skip


def wheel_vz(i: int, side: str) -> Scalar:
    """Of one wheel."""
    return wheel(
        i, side, "wheel_vz", unit="m/s", display_unit="mm/s", causality="output", nominal=0.1,
        description="velocity of the wheel, down",
    )  # fmt: skip


def irregularity(i: int, side: str) -> Scalar:
    """Of the rail under one wheel."""
    return wheel(
        i, side, "irregularity_z", unit="m", display_unit="mm",
        causality="input", start=0.0, nominal=1e-3,
        description="rail surface under the wheel below its nominal height, down positive",
    )  # fmt: skip


def bodies(heights: Sequence[str]) -> list[Scalar]:
    """At rest a body stands on the wheelsets below it; nothing moves or is accelerated."""
    table = []
    for body, about, below in (
        ("carbody", "the car body", tuple(heights)),
        ("bogie[1]", "the front bogie", tuple(heights[:2])),
        ("bogie[2]", "the rear bogie", tuple(heights[2:])),
    ):
        table += [
            Scalar(
                name=f"{body}.z", unit="m", display_unit="mm", causality="output", nominal=1e-2,
                starts_from=below, description=f"displacement of {about}, down",
            ),
            Scalar(
                name=f"{body}.vz", unit="m/s", display_unit="mm/s", causality="output",
                nominal=0.1, description=f"velocity of {about}, down",
            ),
            Scalar(
                name=f"{body}.az", unit="m/s2", causality="output",
                nominal=1.0, description=f"acceleration of {about}, down",
            ),
            Scalar(
                name=f"{body}.pitch", unit="rad", display_unit="mrad", causality="output",
                nominal=1e-3, starts_from=below,
                description=f"pitch of {about}, front up positive",
            ),
        ]  # fmt: skip
    return table


def axleboxes(heights: Sequence[str], law: Sequence[Scalar]) -> list[Scalar]:
    """Accelerations of the wheelsets, which their own forces change at once."""
    table = []
    for i, height in zip(WHEELSETS, heights, strict=True):
        depends = names(force(i, s, "input") for s in SIDES)
        start = depends
        if law:
            own = [rail_z(i, s, "input") for s in SIDES] + [irregularity(i, s) for s in SIDES]
            depends = names([*own, *law])
            start = (*depends, height)
        table.append(
            Scalar(
                name=f"wheelset[{i}].az",
                unit="m/s2",
                description=f"acceleration of wheelset {i} (axle box), down",
                causality="output",
                nominal=10.0,
                depends_on=depends,
                starts_from=start,
            )
        )
    return table


def input_hold() -> Scalar:
    """How inputs go on over a step."""
    return Scalar(
        name="input_hold",
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


def internal_step(*, with_contact: bool) -> Scalar:
    """Of the stepping inside.

    A contact of one's own needs 0.05 ms. Forces from outside allow 0.1 ms: at 250 km/h a wheel then
    passes a tenth of an element at a time, which costs 1e-4 of the swing of the rail's deflection
    (measured against 6 microseconds), a thirtieth of what coupling costs at that step.
    """
    return Scalar(
        name="internal_step",
        unit="s",
        display_unit="ms",
        causality="parameter",
        variability="fixed",
        start=5e-5 if with_contact else 1e-4,
        minimum=1e-7,
        nominal=1e-4,
        description="longest internal step while wheels move or a contact force is solved for",
    )


def contact_parameters(contact: Contact) -> list[Scalar]:
    """Of the contact law, for an FMU that owns it."""
    return [
        Scalar(
            name="contact.nonlinear", unit="", type="Boolean", causality="parameter",
            variability="fixed", start=True,
            description="true: F = C delta^1.5 with loss of contact; false: F = k_H delta",
        ),
        Scalar(
            name="contact.stiffness", unit="N/m", display_unit="GN/m",
            causality="parameter", variability="fixed",
            start=contact.k_H, minimum=1.0, nominal=1e9,
            description="k_H of the linear law; default: tangent of Hertz at the static load",
        ),
        _coefficient(contact, "C of the nonlinear law"),
    ]  # fmt: skip


def told_coefficient(contact: Contact) -> Scalar:
    """Of a vehicle that does not own the contact, whose wheels it is made with all the same."""
    return _coefficient(contact, "C of its wheels on the rail, for the owner of the contact")


def _coefficient(contact: Contact, description: str) -> Scalar:
    return Scalar(
        name="contact.hertz_coefficient", unit="N/m1.5", causality="parameter",
        variability="fixed", start=contact.C, minimum=1.0, nominal=1e11, description=description,
    )  # fmt: skip


def journey(start_position: float) -> list[Scalar]:
    """Of a vehicle that rolls."""
    return [
        Scalar(
            name="speed", unit="m/s", display_unit="km/h",
            causality="parameter", variability="fixed",
            start=250 / 3.6, nominal=100.0, description="speed, forward; 0 holds the positions",
        ),
        Scalar(
            name="start_position", unit="m", causality="parameter", variability="fixed",
            start=start_position, nominal=100.0, description="position of wheelset 4 at time 0",
        ),
    ]  # fmt: skip


def start_heights() -> list[Scalar]:
    """Of a vehicle at rest on the rails."""
    return [
        Scalar(
            name=f"wheelset[{i}].start_z", unit="m", display_unit="mm",
            causality="parameter", variability="fixed",
            start=0.0, nominal=1e-3,
            description=f"height of wheelset {i} (down) the vehicle starts at rest with; in "
            f"equilibrium with the track where wheelset[{i}].az is then zero",
        )
        for i in WHEELSETS
    ]  # fmt: skip
