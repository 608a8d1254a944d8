"""The variables of a vehicle beside its ports: of bodies and wheelsets, of start and speed."""

from __future__ import annotations

from collections.abc import Sequence

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import wheelset_name

from .law_variables import law_at
from .port_variables import ports_of
from .roles import Role
from .scalar import Scalar, names

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
    table, strained = [], known.strained
    for i, coordinate in zip(body.layout.numbers, known.wheelsets, strict=True):
        own = [at for at in ports_of(body) if at.port.wheelset == i]
        if law:
            given = [at.motion(body.face.other, "input") for at in own]
            depends = names([*given, *(at.irregularity() for at in own), *law_at(law, i)])
        else:
            depends = names(at.force("input") for at in own)
        # A wheelset's own force is its contact's; others reach it where suspensions are strained.
        felt = strained & (known.modes[coordinate] != 0)[:, None]
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
