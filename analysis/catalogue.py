"""The schemes by name: families with their settings, and all members that studies compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.picard import picard
from railcosim.master.schemes.variants import AVERAGE_HOLD, VARIANTS, Variant


class Owner(StrEnum):
    """Who owns the contact springs."""

    VEHICLE = "vehicle"
    TRACK = "track"
    MASTER = "master"


FMUS = {
    Owner.VEHICLE: ("VehicleWithContact", "Track"),
    Owner.TRACK: ("Vehicle", "TrackWithContact"),
    Owner.MASTER: ("Vehicle", "Track"),
}
"""Names of our vehicle's and track's FMUs, by owner of the contact."""


@dataclass(frozen=True, kw_only=True)
class Family:
    """Schemes that differ in their settings only.

    Attributes
    ----------
    make : callable
        A member, from the degree of its inputs' polynomials and the component that steps first.
    degrees : tuple of int
        The degrees it can have, the usual one first.
    sequential : bool
        Whether it matters who steps first.
    owners : tuple of Owner
        Who may own the contact, the usual owner first.
    """

    make: Callable[[int, str], Scheme]
    degrees: tuple[int, ...] = (1, 0, 2)
    sequential: bool = False
    owners: tuple[Owner, ...] = (Owner.TRACK, Owner.VEHICLE, Owner.MASTER)


def _solved(variant: Variant) -> Family:
    """Schemes that solve the contact law themselves: the polynomial is the variant's."""
    return Family(
        make=lambda degree, first: interface_jacobian(variant=variant),
        degrees=(1,),
        owners=(Owner.MASTER,),
    )


FAMILIES: dict[str, Family] = {
    "jacobi": Family(make=lambda degree, first: jacobi(degree=degree)),
    "gauss-seidel": Family(
        make=lambda degree, first: gauss_seidel(first=first, degree=degree), sequential=True
    ),
    "nepce": Family(make=lambda degree, first: nepce(), degrees=(0,)),
    "picard": Family(make=lambda degree, first: picard(degree=degree)),
    "aitken": Family(make=lambda degree, first: aitken(degree=degree)),
    "iqn-ils": Family(make=lambda degree, first: iqn_ils(degree=degree)),
    "interface-jacobian": _solved(AVERAGE_HOLD),
    **{
        f"interface-jacobian-{name}": _solved(variant)
        for name, variant in VARIANTS.items()
        if variant is not AVERAGE_HOLD
    },
}


@dataclass(frozen=True, kw_only=True)
class Member:
    """One scheme of the catalogue.

    Attributes
    ----------
    scheme : Scheme
        The scheme.
    owners : tuple of Owner
        Who may own the contact.
    """

    scheme: Scheme
    owners: tuple[Owner, ...]


def members() -> dict[str, Member]:
    """All schemes that studies compare, by a name such as ``gauss-seidel-linear-track-first``."""
    found: dict[str, Member] = {}
    for name, family in FAMILIES.items():
        for degree in sorted(family.degrees):
            inputs = f"-{NAMES[degree]}" if len(family.degrees) > 1 else ""
            for first in ("vehicle", "track") if family.sequential else ("vehicle",):
                order = f"-{first}-first" if family.sequential else ""
                scheme = family.make(degree, first)
                found[name + inputs + order] = Member(scheme=scheme, owners=family.owners)
    return found


def catalogue() -> dict[str, Scheme]:
    """The schemes of `members`, by name."""
    return {name: member.scheme for name, member in members().items()}
