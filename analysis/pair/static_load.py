"""What a contact is like at its static load."""

from __future__ import annotations

from pathlib import Path

from railcosim.track.irregularity import flat

from .contact import NONLINEAR, STIFFNESS, Parameters, Stiffness, stiffness_at
from .numbering import Vehicles
from .pair import Journey, open_pair
from .standing import Position


def static_stiffness(
    vehicle: Vehicles, track: Path, contact: float | Parameters, position: Position = None
) -> Stiffness:
    """Stiffness of every wheelset's contacts at its static load, N/m; one number if one is given.

    Parameters
    ----------
    vehicle, track : Path
        FMU files that take contact forces; of vehicles also several, from the front.
    contact : float or mapping
        The stiffness itself, N/m, or parameters as far as they are given; see `open_pair`.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    """
    if isinstance(contact, float | int):
        return float(contact)
    if not contact.get(NONLINEAR, True) and STIFFNESS in contact:
        return float(contact[STIFFNESS])
    journey = Journey(speed=1.0, held=True, profile=flat(), position=position)
    with open_pair(vehicle, track, contact, journey) as pair:
        return stiffness_at(pair.parameters, pair.static_loads, pair.layout)
