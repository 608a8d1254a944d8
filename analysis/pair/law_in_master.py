"""What the contact between a vehicle and a track asks to know, and its law in the master."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from railcosim.fmus.roles import OF_PROFILES
from railcosim.master.connections import CouplingError
from railcosim.master.law import ForceLaw, Law
from railcosim.mechanics.contact.creep import REFERENCE
from railcosim.mechanics.ports import Layout

from .contact import (
    CONTACT,
    HERTZ,
    NONLINEAR,
    ROLLING,
    STIFFNESS,
    TANGENT,
    Parameters,
    at_load,
    contact_law,
    law_of,
)
from .profiles import profiles_of
from .rolling import over_rates, rolling_law


@dataclass(frozen=True, kw_only=True)
class Kind:
    """Contacts of a dimension.

    Attributes
    ----------
    needed : callable
        Names of the numbers that the law of these parameters takes; CouplingError if there is none.
    first : callable
        Of parameters that ask for a tangent at the static load, and the wheels: some that find this
        load, which does not depend on the law.
    law : callable
        That law in the master, from complete parameters, the wheels, nominal values of forces by
        name, and the speed, m/s.
    component : callable
        Another law of the same motions and forces in the master, of the wheels, with nominal values
        of forces by name.
    """

    needed: Callable[[Parameters], tuple[str, ...]]
    first: Callable[[Parameters, Layout], dict[str, float | bool]]
    law: Callable[[Parameters, Layout, Mapping[str, float], float], Law]
    component: Callable[[ForceLaw, Layout, Mapping[str, float]], Law]


def _pressed(parameters: Parameters) -> tuple[str, ...]:
    return (HERTZ if parameters[NONLINEAR] else STIFFNESS,)


def _sprung(parameters: Parameters, layout: Layout) -> dict[str, float | bool]:
    del layout
    return {**parameters, NONLINEAR: False, STIFFNESS: parameters[TANGENT]}


def _about_load(parameters: Parameters, layout: Layout) -> dict[str, float | bool]:
    return at_load(parameters, np.array([REFERENCE]), layout)


def _pressing(
    parameters: Parameters, layout: Layout, nominal: Mapping[str, float], speed: float
) -> Law:
    del speed
    return contact_law(law_of(parameters, layout), layout, nominal)


def kind_of(layout: Layout, vehicles: Sequence[Path], track: Path) -> Kind:
    """The contacts of FMUs: by the dimension of their layout, and by the profiles that they tell.

    Raises
    ------
    CouplingError
        See `profiles_of`.
    """
    kind = KINDS[layout.dimension]
    if kind is not KINDS["spatial"]:
        return kind
    profiles = profiles_of(vehicles, track)
    if profiles is None:
        return kind
    return replace(kind, needed=_profiled, law=partial(rolling_law, profiles=profiles))


def _profiled(parameters: Parameters) -> tuple[str, ...]:
    own = tuple(ROLLING[role] for role in OF_PROFILES)
    for name in parameters:
        if CONTACT in f".{name}" and not name.endswith((*own, NONLINEAR)):
            raise CouplingError(
                f"{name}: is of cones; these wheels have profiles, whose table tells all but "
                f"{', '.join(own)}"
            )
    _rolling(parameters)
    return own


def _rolling(parameters: Parameters) -> tuple[str, ...]:
    given = [name for name in parameters if name.endswith(STIFFNESS)]
    if given or not parameters[NONLINEAR]:
        name = given[0] if given else NONLINEAR
        raise CouplingError(
            f"{name} = {parameters[name]:g}: is of contacts that are pressed down only; wheels "
            f"that roll press by Hertz's law: give {HERTZ}, or {TANGENT} (--contact-stiffness "
            "hertz:N/m), the stiffness at the static load"
        )
    return tuple(ROLLING.values())


KINDS = {
    "vertical": Kind(needed=_pressed, first=_sprung, law=_pressing, component=contact_law),
    "spatial": Kind(needed=_rolling, first=_about_load, law=rolling_law, component=over_rates),
}
"""By the dimension of the layout."""
