"""What an interface starts with: static loads of a vehicle's wheels, and their contact laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.law import tangent_stiffness
from railcosim.mechanics.ports import SIDES
from railcosim.parameters import ParameterError
from railcosim.vehicle.multibody import Multibody, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .interface import Contact, Start
from .law_variables import OfContact, in_common
from .rolling_start import rolling_wheels


def start_of(
    vehicle: Vehicle | Train,
    positions: Sequence[float],
    sides: tuple[str, ...] = SIDES,
    dimension: str = "vertical",
) -> Start:
    """Loads and contacts of a vehicle's wheels, for wheelsets that stand at positions (m).

    As many wheelsets as the vehicle has are its own; others carry its mean load.

    Raises
    ------
    ParameterError
        If they are others, and its wheels have no contact law in common.
    """
    cars, count = build_multibody(vehicle), len(positions)
    load = cars.wheel_load
    if load.size != count:
        load = np.full(count, load.mean())
    contact = CONTACTS[dimension](train_of(vehicle), cars, load)
    return Start(loads=np.tile(load, len(sides)).tolist(), positions=positions, contact=contact)


def contact_defaults(vehicle: Vehicle | Train) -> Contact:
    """Contact parameters of the wheels: C, and k_H at their static load (eq. 18)."""
    cars = build_multibody(vehicle)
    return _pressed(train_of(vehicle), cars, cars.wheel_load)


def _pressed(train: Train, cars: Multibody, load: FloatArray) -> Contact:
    """Of the train's wheelsets, or of others that are all alike."""
    del train
    C = cars.hertz_coefficient
    if load.size != C.size:
        if len(in_common(C)) > 1:
            raise ParameterError(
                f"{load.size} wheelsets, but the vehicle has {C.size} whose wheels have different "
                f"contact laws (Hertz coefficients from {C.min():g} to {C.max():g} N/m1.5): must "
                f"be {C.size}, or all of one [wheelset] radius and [contact]"
            )
        C = np.full(load.size, C[0])
    return Contact(k_H=in_common(tangent_stiffness(C, load)), C=in_common(C))


CONTACTS: Mapping[str, Callable[[Train, Multibody, FloatArray], OfContact | None]] = {
    "vertical": _pressed,
    "spatial": rolling_wheels,
}
"""Start values of contact laws, by dimension."""
