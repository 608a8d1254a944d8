"""A contact law as an interface has it: its parameters, what it is given, the forces it tells."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import Direction, Layout, Port, Z, wheelset_name

from .port_variables import AtPort
from .roles import Role
from .scalar import Scalar


class OfContact(Protocol):
    """Start values of the parameters of a contact law, and its other variables."""

    @property
    def directions(self) -> tuple[Direction, ...]:
        """In which rails must be met for it."""

    @property
    def of_rates(self) -> bool:
        """Whether its forces depend on rates, and on the speed."""

    def parameters(self) -> list[Scalar]:
        """Of an FMU that owns the contact."""

    def told(self) -> list[Scalar]:
        """Of a vehicle that does not, whose wheels it is made with all the same."""

    def given(self, body: ModalBody, contact: int) -> list[Scalar]:
        """Inputs of a body's own contact."""

    def told_forces(self, body: ModalBody, contact: int) -> list[Scalar]:
        """Outputs of a body's own contact."""

    def counts(self, given: Scalar) -> bool:
        """Whether forces depend on such an input."""


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Contacts that are only pressed.

    Attributes
    ----------
    k_H, C : tuple of float
        N/m and N/m^1.5: one number of all wheels, or one of those of each wheelset.
    """

    k_H: tuple[float, ...]
    C: tuple[float, ...]
    directions: ClassVar[tuple[Direction, ...]] = (Z,)
    of_rates: ClassVar[bool] = False

    def parameters(self) -> list[Scalar]:
        """See `OfContact`."""
        return [
            Scalar(
                name="contact.nonlinear", role=Role.NONLINEAR, unit="", type="Boolean",
                causality="parameter", variability="fixed", start=True,
                description="true: F = C delta^1.5 with loss of contact; false: F = k_H delta",
            ),
            *of_wheels(
                "contact.stiffness", self.k_H, role=Role.STIFFNESS, unit="N/m",
                display_unit="GN/m", nominal=1e9,
                description="k_H of the linear law; default: tangent of Hertz at the static load",
            ),
            *coefficient(self.C, "C of the nonlinear law"),
        ]  # fmt: skip

    def told(self) -> list[Scalar]:
        """See `OfContact`."""
        return coefficient(self.C, "C of its wheels on the rail, for the owner of the contact")

    def given(self, body: ModalBody, contact: int) -> list[Scalar]:
        """See `OfContact`: a height, which irregularity takes off or adds to."""
        at = AtPort(body, body.layout.ports[contact], contact)
        less = Role.IN_LOAD_LESS if body.sign < 0 else Role.IN_LOAD
        return [at.motion(body.face.other, "input"), at.irregularity(less)]

    def told_forces(self, body: ModalBody, contact: int) -> list[Scalar]:
        """See `OfContact`."""
        return [AtPort(body, body.layout.ports[contact], contact).force("output", body.face.other)]

    def counts(self, given: Scalar) -> bool:
        """See `OfContact`."""
        del given
        return True


def contact_place(layout: Layout, contact: int) -> Port:
    """The first port of a contact."""
    return layout.ports[contact * len(layout.directions)]


ROUNDING = 1e-9
"""Of loads: the static ones of like wheels are solved for, to some 1e-14."""


def in_common(of_wheelsets: FloatArray) -> tuple[float, ...]:
    """One number if all are the same but for rounding, else all."""
    alike = np.ptp(of_wheelsets) <= ROUNDING * np.abs(of_wheelsets).max()
    return tuple((of_wheelsets[:1] if alike else of_wheelsets).tolist())


def law_at(law: Sequence[Scalar], wheelset: int) -> list[Scalar]:
    """Contact parameters that count at a wheelset."""
    rows = Counter(v.role for v in law)
    return [v for v in law if rows[v.role] == 1 or v.index == wheelset - 1]


def coefficient(C: Sequence[float], description: str) -> list[Scalar]:
    """Of Hertz's law."""
    return of_wheels(
        "contact.hertz_coefficient", C, role=Role.HERTZ, unit="N/m1.5", nominal=1e11,
        description=description,
    )  # fmt: skip


def of_wheels(
    name: str, starts: Sequence[float], minimum: float = 1.0, **known: Any
) -> list[Scalar]:
    """A parameter of all wheels, or one of those of each wheelset."""
    owners = [wheelset_name(i) for i in range(1, len(starts) + 1)] if len(starts) > 1 else [""]
    description = known.pop("description")
    return [
        Scalar(
            name=f"{owner}.{name}" if owner else name, index=k, start=start, minimum=minimum,
            causality="parameter", variability="fixed",
            description=f"{description}, {owner}" if owner else description, **known,
        )
        for k, (owner, start) in enumerate(zip(owners, starts, strict=True))
    ]  # fmt: skip
