"""What the contact between a vehicle and a track asks to know, and its law in the master."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from railcosim.master.law import ForceLaw, Law
from railcosim.mechanics.ports import Layout

from .contact import HERTZ, NONLINEAR, ROLLING, STIFFNESS, Parameters, contact_law, law_of
from .rolling import over_rates, rolling_law


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Contacts of a dimension.

    Attributes
    ----------
    needed : callable
        Names of the numbers that the law of these parameters takes.
    law : callable
        That law in the master, from complete parameters, the wheels, nominal values of forces by
        name, and the speed, m/s.
    component : callable
        Another law of the same motions and forces in the master, of the wheels, with nominal values
        of forces by name.
    """

    needed: Callable[[Parameters], tuple[str, ...]]
    law: Callable[[Parameters, Layout, Mapping[str, float], float], Law]
    component: Callable[[ForceLaw, Layout, Mapping[str, float]], Law]


def _pressed(parameters: Parameters) -> tuple[str, ...]:
    return (HERTZ if parameters[NONLINEAR] else STIFFNESS,)


def _pressing(
    parameters: Parameters, layout: Layout, nominal: Mapping[str, float], speed: float
) -> Law:
    del speed
    return contact_law(law_of(parameters, layout), layout, nominal)


KINDS = {
    "vertical": Kind(needed=_pressed, law=_pressing, component=contact_law),
    "spatial": Kind(
        needed=lambda parameters: tuple(ROLLING.values()), law=rolling_law, component=over_rates
    ),
}
"""By the dimension of the layout."""
