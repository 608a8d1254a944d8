"""The interface of the four FMUs as one table: names, units, causality, exact dependencies.

Every runtime is built from this table, and so is every modelDescription.xml.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace

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


def track(
    *, with_contact: bool, wheel_load: float, positions: list[float], contact: Contact
) -> list[Scalar]:
    """Track (force to motion) or TrackWithContact (wheel motion to force).

    Parameters
    ----------
    with_contact : bool
        Whether the track owns the contact spring.
    wheel_load : float
        Static load of a wheel, the forces' start value, N.
    positions : list of float
        Start positions of the wheelsets, m.
    contact : Contact
        Defaults of the contact law.
    """
    table = [_time()]
    table += [_position(i, "input", start=x) for i, x in zip(WHEELSETS, positions, strict=True)]
    for i, side in wheels():
        if with_contact:
            table += [_wheel_z(i, side, "input"), _irregularity(i, side)]
        else:
            table.append(_force(i, side, "input", start=wheel_load))
    law = _contact_parameters(contact) if with_contact else []
    everything = _names(v for v in table if v.causality == "input") + _names(law)
    for i, side in wheels():
        here = (_position(i, "input").name,)
        # At rest the rails carry all forces, and do not move whatever these are.
        table += [
            replace(_rail_z(i, side, "output"), depends_on=here, starts_from=everything),
            replace(_rail_vz(i, side), depends_on=everything),
        ]
        if with_contact:
            own = here + _names([_wheel_z(i, side, "input"), _irregularity(i, side), *law])
            force = _force(i, side, "output")
            table.append(replace(force, depends_on=own, starts_from=everything))
    return [*table, _input_hold(), _internal_step(), *law]


def vehicle(
    *, with_contact: bool, wheel_load: float, positions: list[float], contact: Contact
) -> list[Scalar]:
    """Vehicle (force to motion) or VehicleWithContact (rail motion to force); see `track`."""
    table = [_time()]
    for i, side in wheels():
        if with_contact:
            table += [_rail_z(i, side, "input"), _irregularity(i, side)]
        else:
            table.append(_force(i, side, "input", start=wheel_load))
    law = _contact_parameters(contact) if with_contact else []
    journey, heights = _journey(positions[-1]), _start_heights()
    run = _names([_time(), *journey])
    table += [replace(_position(i, "output"), depends_on=run, starts_from=run) for i in WHEELSETS]
    for i, side in wheels():
        start = _names([heights[i - 1]])
        table += [replace(_wheel_z(i, side, "output"), starts_from=start), _wheel_vz(i, side)]
        if with_contact:
            own = _names([_rail_z(i, side, "input"), _irregularity(i, side), *law])
            force = _force(i, side, "output")
            table.append(replace(force, depends_on=own, starts_from=own + start))
    table += [*_bodies(_names(heights)), *_axleboxes(_names(heights), law)]
    step = [_internal_step()] if with_contact else []
    return [*table, _input_hold(), *journey, *heights, *step, *law]


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Start values of the contact parameters: k_H in N/m, C in N/m^1.5."""

    k_H: float
    C: float


def _names(table: Iterable[Scalar]) -> tuple[str, ...]:
    return tuple(v.name for v in table)


def _time() -> Scalar:
    return Scalar(name="time", unit="s", description="simulation time", causality="independent")


def _position(i: int, causality: str, start: float | None = None) -> Scalar:
    return Scalar(
        name=f"wheelset[{i}].position",
        unit="m",
        description=f"position of wheelset {i} along the track, forward; on a ring it wraps",
        causality=causality,
        start=start,
        nominal=100.0,
    )


def _wheel(i: int, side: str, quantity: str, **known: object) -> Scalar:
    return Scalar(name=f"wheelset[{i}].{side}.{quantity}", **known)  # type: ignore[arg-type]


def _force(i: int, side: str, causality: str, start: float | None = None) -> Scalar:
    return _wheel(
        i, side, "force_z", unit="N", display_unit="kN",
        causality=causality, start=start, nominal=1e5,
        description="contact force, compression positive: down on the rail, up on the wheel",
    )  # fmt: skip


def _rail_z(i: int, side: str, causality: str) -> Scalar:
    return _wheel(
        i, side, "rail_z", unit="m", display_unit="mm", causality=causality, nominal=1e-3,
        start=0.0 if causality == "input" else None,
        description="deflection of the rail under the wheel, down, from the unloaded track",
    )  # fmt: skip


def _rail_vz(i: int, side: str) -> Scalar:
    return _wheel(
        i, side, "rail_vz", unit="m/s", display_unit="mm/s", causality="output", nominal=0.1,
        description="velocity (down) of the rail's material point under the wheel",
    )  # fmt: skip


def _wheel_z(i: int, side: str, causality: str) -> Scalar:
    return _wheel(
        i, side, "wheel_z", unit="m", display_unit="mm", causality=causality, nominal=1e-3,
        start=0.0 if causality == "input" else None,
        description="displacement of the wheel, down, from touching the unloaded track",
    )  # fmt: skip


def _wheel_vz(i: int, side: str) -> Scalar:
    return _wheel(
        i, side, "wheel_vz", unit="m/s", display_unit="mm/s", causality="output", nominal=0.1,
        description="velocity of the wheel, down",
    )  # fmt: skip


def _irregularity(i: int, side: str) -> Scalar:
    return _wheel(
        i, side, "irregularity_z", unit="m", display_unit="mm",
        causality="input", start=0.0, nominal=1e-3,
        description="rail surface under the wheel below its nominal height, down positive",
    )  # fmt: skip


def _bodies(heights: Sequence[str]) -> list[Scalar]:
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


def _axleboxes(heights: Sequence[str], law: Sequence[Scalar]) -> list[Scalar]:
    """Accelerations of the wheelsets, which their own forces change at once."""
    table = []
    for i, height in zip(WHEELSETS, heights, strict=True):
        depends = _names(_force(i, s, "input") for s in SIDES)
        start = depends
        if law:
            own = [_rail_z(i, s, "input") for s in SIDES] + [_irregularity(i, s) for s in SIDES]
            depends = _names([*own, *law])
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


def _input_hold() -> Scalar:
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


def _internal_step() -> Scalar:
    return Scalar(
        name="internal_step",
        unit="s",
        display_unit="ms",
        causality="parameter",
        variability="fixed",
        start=5e-5,
        minimum=1e-7,
        nominal=1e-4,
        description="longest internal step while wheels move or a contact force is solved for",
    )


def _contact_parameters(contact: Contact) -> list[Scalar]:
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
        Scalar(
            name="contact.hertz_coefficient", unit="N/m1.5", causality="parameter",
            variability="fixed", start=contact.C, minimum=1.0, nominal=1e11,
            description="C of the nonlinear law",
        ),
    ]  # fmt: skip


def _journey(start_position: float) -> list[Scalar]:
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


def _start_heights() -> list[Scalar]:
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
