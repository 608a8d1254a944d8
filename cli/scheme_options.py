"""How schemes and owners of the contact are spelt."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import typer

from railcosim.analysis.pair.owner import Owner
from railcosim.analysis.schemes.usual import PREDICTED
from railcosim.master.names import INPUTS, SCHEMES

from .options import UsageError, positive


class Inputs(StrEnum):
    """How inputs go on between communication points."""

    CONSTANT = INPUTS[0]
    LINEAR = INPUTS[1]
    QUADRATIC = INPUTS[2]


def _scheme(text: str) -> str:
    """A name of a scheme."""
    if text not in SCHEMES:
        raise typer.BadParameter(f"{text!r} is not one of {', '.join(map(repr, SCHEMES))}.")
    return text


def _completed(incomplete: str) -> list[str]:
    """Names that begin so, for the shell."""
    return [name for name in SCHEMES if name.startswith(incomplete)]


SchemeOption = Annotated[
    str | None,
    typer.Option(
        "--scheme",
        metavar="NAME",
        parser=_scheme,
        autocompletion=_completed,
        help=f"Coupling scheme: {', '.join(SCHEMES)}; if not given, gauss-seidel where the "
        "track owns the contact, jacobi where the vehicle does, interface-jacobian where the "
        "master does.",
    ),
]
EVERY = ",".join(PREDICTED)
SchemesOption = Annotated[
    str,
    typer.Option(
        "--schemes",
        help="Schemes, or how their names begin; several with commas.",
        show_default=", ".join(PREDICTED),  # which folds
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


@dataclass(frozen=True, kw_only=True)
class CourseOptions:
    """How a run goes: its scheme, its steps, and how long."""

    scheme: SchemeOption = None
    first: Annotated[
        str | None,
        typer.Option(
            "--first",
            help="Who steps first in gauss-seidel: vehicle or track; of a system, a component, the "
            "first in the file if not given.",
        ),
    ] = None
    inputs: InputsOption = None
    step: Annotated[
        float | None,
        typer.Option(
            "--step",
            help="Communication step, s. If not given, 1e-4 or 2e-5 by scheme and owner; of a "
            "system, what the file says.",
        ),
    ] = None
    time: Annotated[
        float | None,
        typer.Option("--time", help="How long, s. If not given, 1; or what the file says."),
    ] = None
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance", help="Choose steps by an error estimate; --step is then the longest."
        ),
    ] = None

    tolerance_fmu: Annotated[
        float | None,
        typer.Option(
            "--tolerance-fmu",
            help="Relative error that FMUs are asked to keep; if not given, what each says.",
        ),
    ] = None

    limit: Annotated[
        float | None,
        typer.Option(
            "--limit",
            help="Largest output, in its nominal values, that is not taken for divergence; 1e6.",
        ),
    ] = None

    @property
    def largest(self) -> float:
        """What `limit` is."""
        from railcosim.master.cosimulation import LIMIT

        return LIMIT if self.limit is None else self.limit

    def check(self) -> None:
        """Raise UsageError if a number cannot be."""
        for option, value in (("--step", self.step), ("--time", self.time)):
            if value is not None:
                positive(option, value, "s")
        if self.limit is not None:
            positive("--limit", self.limit, "nominal values")
        tolerances = {"--tolerance": self.tolerance, "--tolerance-fmu": self.tolerance_fmu}
        for option, value in tolerances.items():
            if value is not None and not 0.0 < value < 1.0:
                raise UsageError(f"{option} {value:g}: must be between 0 and 1, such as 1e-4")
