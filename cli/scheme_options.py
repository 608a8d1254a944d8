"""How schemes and owners of the contact are spelt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Annotated

import typer

from railcosim.analysis.catalogue import Owner, owners_of
from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.catalogue import CATALOGUE

from .options import UsageError


class Inputs(StrEnum):
    """How inputs go on between communication points."""

    CONSTANT = NAMES[0]
    LINEAR = NAMES[1]
    QUADRATIC = NAMES[2]


USUAL = {
    Owner.TRACK: "gauss-seidel",
    Owner.VEHICLE: "jacobi",
    Owner.MASTER: "interface-jacobian",
}
"""Scheme by the owner of the contact, the usual owner first."""


def _scheme(text: str) -> str:
    """A name of a scheme."""
    if text not in CATALOGUE:
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(map(repr, CATALOGUE))}.")
    return text


def _completed(incomplete: str) -> list[str]:
    """Names that begin so, for the shell."""
    return [name for name in CATALOGUE if name.startswith(incomplete)]


SchemeOption = Annotated[
    str | None,
    typer.Option(
        "--scheme",
        metavar="NAME",
        parser=_scheme,
        autocompletion=_completed,
        help=f"Coupling scheme: {', '.join(CATALOGUE)}; if not given, gauss-seidel where the "
        "track owns the contact, jacobi where the vehicle does, interface-jacobian where the "
        "master does.",
    ),
]
InputsOption = Annotated[
    Inputs | None,
    typer.Option(
        "--inputs",
        metavar="NAME",
        help=f"Inputs between communication points: {', '.join(Inputs)}; linear where the scheme "
        "has a choice.",
    ),
]
ContactOption = Annotated[
    Owner | None,
    typer.Option(
        "--contact",
        metavar="NAME",
        help=f"Owner of the contact springs: {', '.join(Owner)}; track, or master if the scheme "
        "needs it.",
    ),
]


def choice_of(
    scheme: str | None, contact: Owner | None, possible: Sequence[Owner] = tuple(Owner)
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

    Raises
    ------
    UsageError
        If they exclude each other.
    """
    if contact is not None and contact not in possible:
        raise UsageError(
            f"--contact {contact}: with the FMUs given it must be {' or '.join(possible)}"
        )
    wanted = possible if contact is None else (contact,)
    if scheme is None:
        scheme = USUAL[next(owner for owner in USUAL if owner in wanted)]
    suiting = [owner for owner in owners_of(CATALOGUE[scheme]) if owner in wanted]
    if not suiting:
        must = " or ".join(owners_of(CATALOGUE[scheme]))
        if contact is not None:
            raise UsageError(f"--contact {contact}: with --scheme {scheme} it must be {must}")
        raise UsageError(
            f"--scheme {scheme}: the contact must be the {must}'s, and with the FMUs given it is "
            f"the {' or '.join(wanted)}'s"
        )
    return scheme, suiting[0]


def maker_of(name: str, inputs: Inputs | None, first: str | None = None) -> Callable[[str], Scheme]:
    """A scheme from its options, once it is known who steps first where the user does not say.

    Raises
    ------
    UsageError
        If an option says nothing of this scheme.
    """
    family = CATALOGUE[name]
    if first is not None and not family.sequential:
        able = " or ".join(other for other, family in CATALOGUE.items() if family.sequential)
        raise UsageError(
            f"--first {first}: {name} has no first; leave it out, or take --scheme {able}"
        )
    degree = family.degrees[0] if inputs is None else NAMES.index(inputs)
    if degree not in family.degrees:
        able = " or ".join(NAMES[d] for d in sorted(family.degrees))
        raise UsageError(f"--inputs {inputs}: {name} has {able} inputs only; leave the option out")
    return lambda usual: family.make(degree, first or usual)
