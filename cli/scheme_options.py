"""How schemes and owners of the contact are spelt."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from railcosim.analysis.pair.owner import Owner
from railcosim.master.continuation import NAMES
from railcosim.master.schemes.catalogue import CATALOGUE


class Inputs(StrEnum):
    """How inputs go on between communication points."""

    CONSTANT = NAMES[0]
    LINEAR = NAMES[1]
    QUADRATIC = NAMES[2]


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
