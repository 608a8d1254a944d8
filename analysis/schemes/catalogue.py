"""The schemes as they suit a pair: who may own the contact, and all that studies compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from railcosim.analysis.pair.owner import Owner
from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.master.schemes.family import Family


def owners_of(family: Family) -> tuple[Owner, ...]:
    """Who may own the contact with schemes of a family, the usual owner first."""
    if family.solves_law:
        return (Owner.MASTER,)
    return (Owner.TRACK, Owner.VEHICLE, Owner.MASTER)


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


def members(components: Sequence[str] = ("vehicle", "track")) -> dict[str, Member]:
    """All schemes that studies compare, by a name such as ``gauss-seidel-linear-track-first``.

    Parameters
    ----------
    components : sequence of str, optional
        Who may step first; the first one where it does not matter.
    """
    found: dict[str, Member] = {}
    for name, family in CATALOGUE.items():
        for degree in sorted(family.degrees):
            inputs = f"-{NAMES[degree]}" if len(family.degrees) > 1 else ""
            for first in components if family.sequential else components[:1]:
                order = f"-{first}-first" if family.sequential else ""
                scheme = family.make(degree, first)
                found[name + inputs + order] = Member(
                    scheme=scheme, owners=owners_of(family), linear=family.linear
                )
    return found
