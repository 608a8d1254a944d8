"""What a scheme's file says of it, to commands and studies: its name, its options, its claims."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from railcosim.master.schemes import Scheme


@dataclass(frozen=True, kw_only=True)
class Family:
    """Schemes that differ in their settings only.

    Attributes
    ----------
    name : str
        On the command line.
    make : callable
        A member, from the degree of its inputs' polynomials and the component that steps first.
    degrees : tuple of int
        The degrees it can have, the usual one first.
    sequential : bool
        Whether it matters who steps first.
    solves_law : bool
        Whether it solves a `Law`, which must then be in the system.
    linear : bool
        Whether a step with linear components is a linear map, so that growth can be predicted. It
        is not where the scheme learns within a step.
    """

    name: str
    make: Callable[[int, str], Scheme]
    degrees: tuple[int, ...] = (1, 0, 2)
    sequential: bool = False
    solves_law: bool = False
    linear: bool = True
