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
from railcosim.master.schemes.variants import (
    AVERAGE_HOLD,
    CONSERVING_4,
    CONSERVING_6,
    HERMITE,
    RADAU_2,
    Variant,
)


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
    linear : bool
        Whether a step with linear components is a linear map, so that growth can be predicted. It
        is not where the scheme learns within a step.
    """

    make: Callable[[int, str], Scheme]
    degrees: tuple[int, ...] = (1, 0, 2)
    sequential: bool = False
    owners: tuple[Owner, ...] = (Owner.TRACK, Owner.VEHICLE, Owner.MASTER)
    linear: bool = True


def _solved(variant: Variant) -> Family:
    """Schemes that solve the contact law themselves: the polynomial is the variant's."""
    return Family(
        make=lambda degree, first: interface_jacobian(variant=variant),
        degrees=(1,),
        owners=(Owner.MASTER,),
    )


class SchemeName(StrEnum):
    """Families of schemes."""

    JACOBI = "jacobi"
    GAUSS_SEIDEL = "gauss-seidel"
    NEPCE = "nepce"
    PICARD = "picard"
    AITKEN = "aitken"
    IQN_ILS = "iqn-ils"
    INTERFACE_JACOBIAN = "interface-jacobian"
    INTERFACE_JACOBIAN_RADAU_2 = "interface-jacobian-radau-2"
    INTERFACE_JACOBIAN_HERMITE = "interface-jacobian-hermite"
    INTERFACE_JACOBIAN_CONSERVING_4 = "interface-jacobian-conserving-4"
    INTERFACE_JACOBIAN_CONSERVING_6 = "interface-jacobian-conserving-6"


FAMILIES: dict[str, Family] = {
    SchemeName.JACOBI: Family(make=lambda degree, first: jacobi(degree=degree)),
    SchemeName.GAUSS_SEIDEL: Family(
        make=lambda degree, first: gauss_seidel(first=first, degree=degree), sequential=True
    ),
    SchemeName.NEPCE: Family(make=lambda degree, first: nepce(), degrees=(0,)),
    SchemeName.PICARD: Family(make=lambda degree, first: picard(degree=degree)),
    SchemeName.AITKEN: Family(make=lambda degree, first: aitken(degree=degree), linear=False),
    SchemeName.IQN_ILS: Family(make=lambda degree, first: iqn_ils(degree=degree), linear=False),
    SchemeName.INTERFACE_JACOBIAN: _solved(AVERAGE_HOLD),
    SchemeName.INTERFACE_JACOBIAN_RADAU_2: _solved(RADAU_2),
    SchemeName.INTERFACE_JACOBIAN_HERMITE: _solved(HERMITE),
    SchemeName.INTERFACE_JACOBIAN_CONSERVING_4: _solved(CONSERVING_4),
    SchemeName.INTERFACE_JACOBIAN_CONSERVING_6: _solved(CONSERVING_6),
}
"""By the values of `SchemeName`."""


@dataclass(frozen=True, kw_only=True)
class Member:
    """One scheme of the catalogue.

    Attributes
    ----------
    scheme : Scheme
        The scheme.
    owners : tuple of Owner
        Who may own the contact.
    linear : bool
        Whether its growth can be predicted.
    """

    scheme: Scheme
    owners: tuple[Owner, ...]
    linear: bool


def members() -> dict[str, Member]:
    """All schemes that studies compare, by a name such as ``gauss-seidel-linear-track-first``."""
    found: dict[str, Member] = {}
    for name, family in FAMILIES.items():
        for degree in sorted(family.degrees):
            inputs = f"-{NAMES[degree]}" if len(family.degrees) > 1 else ""
            for first in ("vehicle", "track") if family.sequential else ("vehicle",):
                order = f"-{first}-first" if family.sequential else ""
                scheme = family.make(degree, first)
                found[name + inputs + order] = Member(
                    scheme=scheme, owners=family.owners, linear=family.linear
                )
    return found


def catalogue() -> dict[str, Scheme]:
    """The schemes of `members`, by name."""
    return {name: member.scheme for name, member in members().items()}
