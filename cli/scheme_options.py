"""How schemes and owners of the contact are spelt."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from railcosim.analysis.catalogue import FAMILIES, Owner, SchemeName
from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme

from .options import UsageError


class Inputs(StrEnum):
    """How inputs go on between communication points."""

    CONSTANT = NAMES[0]
    LINEAR = NAMES[1]
    QUADRATIC = NAMES[2]


SchemeOption = Annotated[
    SchemeName | None,
    typer.Option(
        "--scheme",
        metavar="NAME",
        help=f"Coupling scheme: {', '.join(SchemeName)}; if not given, jacobi, or "
        "interface-jacobian where the master owns the contact.",
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


def choice_of(scheme: SchemeName | None, contact: Owner | None) -> tuple[SchemeName, Owner]:
    """Scheme and owner of the contact, from options of which each may decide the other."""
    if scheme is None:
        solved = contact is Owner.MASTER
        scheme = SchemeName.INTERFACE_JACOBIAN if solved else SchemeName.JACOBI
    owners = FAMILIES[scheme].owners
    if contact is None:
        return scheme, owners[0]
    if contact not in owners:
        raise UsageError(
            f"--contact {contact}: with --scheme {scheme} it must be {' or '.join(owners)}"
        )
    return scheme, contact


def scheme_of(name: SchemeName, inputs: Inputs | None, first: str) -> Scheme:
    """A scheme from its options."""
    family = FAMILIES[name]
    degree = family.degrees[0] if inputs is None else NAMES.index(inputs)
    if degree not in family.degrees:
        able = " or ".join(NAMES[d] for d in sorted(family.degrees))
        raise UsageError(f"--inputs {inputs}: {name} has {able} inputs only; leave the option out")
    return family.make(degree, first)
