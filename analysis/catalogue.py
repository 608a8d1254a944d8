"""The schemes by name: families for one run, and all that studies compare."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from railcosim.master.continuation import NAMES
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi


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

Factory = Callable[[int, str], Scheme]
FAMILIES: dict[str, Factory] = {
    "jacobi": lambda degree, first: jacobi(degree=degree),
    "gauss-seidel": lambda degree, first: gauss_seidel(first=first, degree=degree),
}
"""From the degree of the inputs' polynomials and the component that steps first, where it matters."""


def catalogue() -> dict[str, Scheme]:
    """All schemes that studies compare, by a name such as ``gauss-seidel-linear-track-first``."""
    schemes: dict[str, Scheme] = {}
    for degree, inputs in enumerate(NAMES):
        schemes[f"jacobi-{inputs}"] = jacobi(degree=degree)
        for first in ("vehicle", "track"):
            name = f"gauss-seidel-{inputs}-{first}-first"
            schemes[name] = gauss_seidel(first=first, degree=degree)
    return schemes
