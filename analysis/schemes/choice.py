"""Which scheme, owner of the contact and step, from what is said and what is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.schemes.catalogue import owners_of
from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.master.schemes.family import Family
from railcosim.master.suggest import suggest
from railcosim.parameters import ArgumentError

from .usual import AGREED, ASIDE, SOLVED, STEPS, USUAL


def choice_of(
    scheme: str | None,
    contact: Owner | None,
    possible: Sequence[Owner] = tuple(Owner),
    usual: Mapping[Owner, str] = USUAL,
) -> tuple[str, Owner]:
    """Scheme and owner of the contact, from options of which each may decide the other.

    Parameters
    ----------
    scheme : str or None
        As chosen.
    contact : Owner or None
        As chosen.
    possible : sequence of Owner
        Owners with the FMUs that are given.
    usual : mapping of Owner to str, optional
        Schemes where none is chosen, `USUAL` or `ASIDE`.

    Raises
    ------
    ArgumentError
        If they exclude each other.
    """
    if contact is not None and contact not in possible:
        must = " or ".join(possible)
        raise ArgumentError("contact", contact, f"with the FMUs given it must be {must}")
    wanted = possible if contact is None else (contact,)
    if scheme is not None:
        family_of(scheme)
    else:
        scheme = usual[next(owner for owner in usual if owner in wanted)]
    suiting = [owner for owner in owners_of(CATALOGUE[scheme]) if owner in wanted]
    if not suiting:
        must = " or ".join(owners_of(CATALOGUE[scheme]))
        if contact is not None:
            raise ArgumentError("contact", contact, f"with --scheme {scheme} it must be {must}")
        raise ArgumentError(
            "scheme", scheme,
            f"the contact must be the {must}'s, and with the FMUs given it is the "
            f"{' or '.join(wanted)}'s",
        )  # fmt: skip
    return scheme, suiting[0]


def scheme(name: str, inputs: str | None = None, first: str | None = None) -> Scheme:
    """A scheme by its name.

    Parameters
    ----------
    name : str
        Of a family: ``jacobi``, ``gauss-seidel``, ``interface-jacobian`` ...
    inputs : str, optional
        ``constant``, ``linear`` or ``quadratic`` between communication points; the scheme's usual
        ones if not given.
    first : str, optional
        The component that steps first, where it matters; the vehicle if not given.

    Raises
    ------
    ArgumentError
        If there is no such scheme, or an argument says nothing of it.
    """
    return maker_of(name, inputs, first)(Owner.VEHICLE)


def maker_of(name: str, inputs: str | None, first: str | None = None) -> Callable[[str], Scheme]:
    """A scheme, once it is known who steps first where the user does not say; see `scheme`."""
    family = family_of(name)
    if first is not None and not family.sequential:
        able = " or ".join(other for other, family in CATALOGUE.items() if family.sequential)
        raise ArgumentError(
            "first", first, f"{name} has no first; leave it out, or take --scheme {able}"
        )
    if inputs is not None and inputs not in NAMES:
        raise ArgumentError("inputs", inputs, f"must be {', '.join(NAMES)}")
    degree = family.degrees[0] if inputs is None else NAMES.index(inputs)
    if degree not in family.degrees:
        able = " or ".join(NAMES[d] for d in sorted(family.degrees))
        raise ArgumentError("inputs", inputs, f"{name} has {able} inputs only; leave it out")
    return lambda usual: family.make(degree, first or usual)


def family_of(name: str) -> Family:
    """The schemes of a name; ArgumentError if there are none."""
    if name not in CATALOGUE:
        raise ArgumentError(
            "scheme", name, f"must be one of {', '.join(CATALOGUE)}{suggest(name, CATALOGUE)}"
        )
    return CATALOGUE[name]


def usual_step(name: str, owner: Owner) -> float:
    """The step (s) where the user gives none."""
    if family_of(name).solves_law:
        return SOLVED
    return AGREED if (owner, name) == (Owner.VEHICLE, ASIDE[Owner.VEHICLE]) else STEPS[owner]
