"""The variables of a vehicle beside its ports: of bodies and wheelsets, of start and speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import wheelset_name

from .port_variables import SHOWN_IN, ports_of
from .roles import Role
from .scalar import Scalar, names

ABOUT = {"carbody": "the car body", "bogie[1]": "the front bogie", "bogie[2]": "the rear bogie"}
"""Of a vehicle with no more bogies than these."""


@dataclass(frozen=True)
class Told:
    """How a coordinate of a body, its rate or its acceleration is told.

    Attributes
    ----------
    role : Role
        What it is to the model.
    quantity, description : str
        Patterns, to be filled by the direction and whose it is; the latter in words.
    per : str
        What follows the unit of the coordinate.
    nominals : dict of float
        By that unit.
    """

    role: Role
    quantity: str
    description: str
    per: str
    nominals: dict[str, float]


DISPLACEMENT = Told(
    Role.OUT_COORDINATE, "{}", "{moved} of {about}, {where}", "", {"m": 1e-2, "rad": 1e-3}
)
VELOCITY = Told(Role.OUT_RATE, "v{}", "{rate} of {about}, {where}", "/s", {"m": 0.1, "rad": 1e-2})
ACCELERATION = Told(
    Role.OUT_ACCELERATION, "a{}", "{faster} of {about}, {where}", "/s2", {"m": 1.0, "rad": 0.1}
)
ALL = (DISPLACEMENT, VELOCITY, ACCELERATION)
MOVE = {"moved": "displacement", "rate": "velocity", "faster": "acceleration"}
COORDINATES = {
    "z": MOVE | {"unit": "m", "where": "down"},
    "y": MOVE | {"unit": "m", "where": "to the right"},
    **{
        turn: {
            "unit": "rad", "moved": turn, "rate": f"rate of {turn}",
            "faster": f"angular acceleration in {turn}", "where": f"{where} positive",
        }
        for turn, where in (
            ("roll", "right side down"), ("pitch", "front up"), ("yaw", "front to the right"),
        )
    },
}  # fmt: skip
"""Of bodies, in the order that they are told in."""


def bodies(body: ModalBody, heights: Sequence[str]) -> list[Scalar]:
    """At rest a body stands on the wheelsets below it; nothing moves or is accelerated.

    Where wheels are not turned, pitch is told without its rates: of a vertical vehicle.
    """
    known = body.coordinates
    if known is None:
        return []
    usual = len([name for name in known.bodies if name not in body.layout.axles]) <= len(ABOUT)
    follows, table = known.following, []
    turned = any(direction.motion == "rad" for direction in body.layout.directions)
    for name in known.bodies:
        if name in body.layout.axles:
            continue
        about = ABOUT[name] if usual and name in ABOUT else name
        for direction, words in COORDINATES.items():
            k = known.place(name, direction)
            if k is None:
                continue
            below = tuple(heights[i] for i in follows[k].nonzero()[0])
            for told in ALL if turned or words["unit"] == "m" else ALL[:1]:
                unit = words["unit"] + told.per
                table.append(
                    Scalar(
                        name=f"{name}.{told.quantity.format(direction)}", role=told.role, index=k,
                        causality="output", unit=unit, display_unit=SHOWN_IN.get(unit, ""),
                        nominal=told.nominals[words["unit"]],
                        description=told.description.format(about=about, **words),
                        starts_from=below if told is DISPLACEMENT else (),
                    )
                )  # fmt: skip
    return table


def axleboxes(
    body: ModalBody, heights: Sequence[str], own_contacts: Sequence[Sequence[str]]
) -> list[Scalar]:
    """Accelerations of the wheelsets, which their own forces change at once.

    Parameters
    ----------
    body : ModalBody
        The vehicle.
    heights : sequence of str
        Names of the wheelsets' start heights.
    own_contacts : sequence of sequence of str
        What the forces of each wheelset's contacts depend on; empty if these come from outside.
    """
    known = body.coordinates
    if known is None:
        return []
    table, strained = [], known.strained
    for i, axle in zip(body.layout.numbers, body.layout.axles, strict=True):
        own = [at for at in ports_of(body) if at.port.wheelset == i]
        for direction in ("z", "y"):
            k = known.place(axle, direction)
            if k is None:
                continue
            if own_contacts:
                depends = tuple(own_contacts[i - 1])
            else:
                pushed = np.tile(known.through[k] != 0, len(body.layout.sides))
                depends = names(at.force("input", body.face) for at in own if pushed[at.index])
            # A wheelset's own force is its contact's; others reach it where suspensions are
            # strained.
            felt = strained & (known.modes[k] != 0)[:, None]
            near = set(felt.any(axis=0).nonzero()[0].tolist()) | (
                {i - 1} if own_contacts else set()
            )
            table.append(
                Scalar(
                    name=f"{axle}.a{direction}",
                    unit="m/s2",
                    description=f"acceleration of wheelset {i} (axle box), "
                    f"{COORDINATES[direction]['where']}",
                    role=Role.OUT_ACCELERATION,
                    index=k,
                    causality="output",
                    nominal=10.0,
                    depends_on=depends,
                    starts_from=(*depends, *(heights[k] for k in sorted(near))),
                )
            )
    return table


def rolling_on() -> Scalar:
    """The speed of a vehicle whose contacts do not ask for it."""
    return Scalar(
        name="speed", role=Role.SPEED, unit="m/s", display_unit="km/h",
        causality="parameter", variability="fixed",
        start=250 / 3.6, nominal=100.0, description="speed, forward; 0 holds the positions",
    )  # fmt: skip


def start_place(start_position: float, last: int) -> Scalar:
    """Where a vehicle begins, whose last wheelset has this number."""
    return Scalar(
        name="start_position", role=Role.START_POSITION, unit="m", causality="parameter",
        variability="fixed", start=start_position, nominal=100.0,
        description=f"position of wheelset {last} at time 0",
    )  # fmt: skip


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
