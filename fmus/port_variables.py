"""The variables of a body where it is met: of its ports, and of where wheelsets are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, IRREGULARITY, Face, Port, wheelset_name

from .roles import Role
from .scalar import Scalar


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
    port : Port
        Of the body, or of what it meets.
    index : int
        Which it is of these ports.
    """

    body: ModalBody
    port: Port
    index: int

    def _row(self, quantity: str, role: Role, causality: str, **known: Any) -> Scalar:
        port = self.port
        return Scalar(
            name=port.name(quantity), role=role, causality=causality, index=self.index, port=port,
            **known,
        )  # fmt: skip

    def force(self, causality: str, face: Face, start: float | None = None) -> Scalar:
        """Of the contact, at a face."""
        direction = self.port.direction
        return self._row(
            FORCE, Role.IN_LOAD if causality == "input" else Role.OUT_FORCE, causality,
            unit=direction.force, display_unit=SHOWN_IN[direction.force], start=start,
            nominal=NOMINALS[direction.force],
            description=FORCES.get(
                direction.name,
                f"{KINDS[direction.force].format(DATA[face.name])}, {direction.positive} on the "
                "rail, the opposite on the wheel",
            ),
        )  # fmt: skip

    def motion(self, face: Face, causality: str) -> Scalar:
        """Of the body's own face, or the other's as an input."""
        direction = self.port.direction
        return self._row(
            face.motion, Role.IN_LOAD if causality == "input" else Role.OUT_MOTION, causality,
            unit=direction.motion, display_unit=SHOWN_IN[direction.motion], nominal=1e-3,
            start=0.0 if causality == "input" else None,
            description=MOTIONS[face.name].format(direction.positive),
        )  # fmt: skip

    def rate(self, face: Face, causality: str) -> Scalar:
        """Likewise its rate."""
        direction = self.port.direction
        return self._row(
            face.rate, Role.IN_LOAD if causality == "input" else Role.OUT_MOTION_RATE, causality,
            unit=f"{direction.motion}/s", display_unit=SHOWN_IN[f"{direction.motion}/s"],
            nominal=0.1, start=0.0 if causality == "input" else None,
            description=RATES[face.name].format(direction.positive),
        )  # fmt: skip

    def irregularity(self, role: Role) -> Scalar:
        """Of the rail."""
        direction = self.port.direction
        return self._row(
            IRREGULARITY,
            role,
            "input",
            unit=direction.motion,
            display_unit=SHOWN_IN[direction.motion],
            start=0.0,
            nominal=1e-3,
            description=IRREGULARITIES[direction.name],
        )


SHOWN_IN = {
    "m": "mm", "m/s": "mm/s", "rad": "mrad", "rad/s": "mrad/s", "N": "kN", "N.m": "kN.m",
}  # fmt: skip
NOMINALS = {"N": 1e5, "N.m": 1e4}
KINDS = {
    "N": "contact force",
    "N.m": "moment of the contact about {}",
}
DATA = {
    "rail": "the top of the design head's middle",
    "wheel": "the wheel's point that is designed to lie on the rail",
}
FORCES = {"z": "contact force, compression positive: down on the rail, up on the wheel"}
MOTIONS = {
    "rail": "deflection of the rail under the wheel, {}, from the unloaded track",
    "wheel": "displacement of the wheel, {}, from touching the unloaded track",
}
RATES = {
    "rail": "velocity ({}) of the rail's material point under the wheel",
    "wheel": "velocity of the wheel, {}",
}


IRREGULARITIES = {
    "z": "rail surface under the wheel below its nominal height, down positive",
    "y": "rail surface under the wheel beside its nominal place, to the right positive",
}


def ports_of(body: ModalBody) -> list[AtPort]:
    """Makers of variables, in the order of the ports."""
    return [AtPort(body, port, k) for k, port in enumerate(body.layout.ports)]
