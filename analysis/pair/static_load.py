"""What a contact is like at its static load."""

from __future__ import annotations

from pathlib import Path

from railcosim.master.component import FloatArray
from railcosim.master.fmi.description import describe_file
from railcosim.master.law import Law
from railcosim.mechanics.contact.at_ports import PORTS
from railcosim.mechanics.ports import Layout
from railcosim.track.irregularity import flat
from railcosim.track.irregularity.quantities import ALL

from .contact import (
    NONLINEAR,
    STIFFNESS,
    TANGENT,
    Parameters,
    Stiffness,
    contact_of,
    layout_of,
    stiffness_at,
)
from .numbering import Vehicles, files_of
from .pair import Journey, Pair, open_pair
from .standing import Position

SPEED = 250 / 3.6  # m/s


def static_stiffness(
    vehicle: Vehicles,
    track: Path,
    contact: float | Parameters,
    position: Position = None,
    speed: float = SPEED,
) -> Stiffness:
    """What the contacts' laws are like about rest; see `railcosim.analysis.pair.linear_pair.Part`.

    Parameters
    ----------
    vehicle, track : Path
        FMU files that take contact forces; of vehicles also several, from the front.
    contact : float or mapping
        The stiffness itself, N/m, or parameters as far as they are given; see `open_pair`.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    speed : float, optional
        m/s: wheels that roll creep the less, the faster they do.

    Returns
    -------
    float or array
        Where contacts are only pressed: stiffness of every wheelset's at its static load, N/m,
        shape (n_wheelsets,); one number if one is given. Of wheels that roll: tangents of all
        contacts, shape (n_contacts, k, m), where `contact` is the stiffness at the static load.
    """
    given = contact_of(contact)
    rolls = _layout(vehicle).dimension != Layout().dimension
    if not given.get(NONLINEAR, True) and STIFFNESS in given:
        if not rolls:
            return float(given[STIFFNESS])
        given = {NONLINEAR: True, TANGENT: given[STIFFNESS]}
    journey = Journey(speed=speed, held=True, profile=flat(), position=position)
    with open_pair(vehicle, track, given, journey) as pair:
        if not rolls:
            return stiffness_at(pair.parameters, pair.static_loads, pair.layout)
        return _tangents(pair)


def acting_on(vehicle: Vehicles) -> tuple[str, ...]:
    """Quantities of irregularity that a pair meets: of wheels that only press, the mean height."""
    return ("vertical",) if _layout(vehicle).dimension == Layout().dimension else (ALL,)


def _layout(vehicle: Vehicles) -> Layout:
    """Of the wheels of a vehicle, or of the first of several."""
    first = files_of(vehicle)[0]
    return layout_of((first, describe_file(first).inputs))


def _tangents(pair: Pair) -> FloatArray:
    """Of the law in the master, (n_contacts, k, m), where the pair is at rest, at one speed."""
    pair.system.exchange()
    (law,) = (component for component in pair.system.components if isinstance(component, Law))
    u = pair.system.gather(pair.system.index(law.name))
    by: FloatArray = law.law.tangent((law.S @ u).reshape(law.contacts, -1))
    return by[..., : 2 * len(PORTS)]
