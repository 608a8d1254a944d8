"""The parameters of the contact law."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from railcosim.mechanics.ports import wheelset_name

from .roles import Role
from .scalar import Scalar


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
