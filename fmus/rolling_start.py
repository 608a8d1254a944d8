"""What the parameters of rolling contacts are at first: those of a vehicle's file."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.creep import REFERENCE
from railcosim.mechanics.contact.geometry import Cone, TextbookCone
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.parameters import ParameterError
from railcosim.vehicle.multibody import Multibody
from railcosim.vehicle.on_rails import GRAVITY
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling
from railcosim.vehicle.rolling import geometry_of
from railcosim.vehicle.train import Train

from .law_variables import in_common
from .roles import Role
from .rolling_variables import RollingWheels

UNBOUNDED, FASTSIM = "linear", "fastsim"
"""Of the creep laws, that which friction does not bound, and that which a parameter asks for."""


@dataclass(frozen=True)
class Wheel:
    """Of one wheelset."""

    cone: Cone
    rolling: Rolling
    inertia: float  # about the axle, kg m2

    def numbers(self) -> dict[Role, float]:
        """By role."""
        cone, rolling = self.cone, self.rolling
        f11, f22, f23, f33 = (float(f) for f in cone.patch.creep_coefficients(np.array(REFERENCE)))
        a, b = cone.patch.ellipse.semi_axes(np.array(REFERENCE))
        return {
            Role.RADIUS: cone.radius,
            Role.HALF_DISTANCE: cone.half_distance,
            Role.CONICITY: cone.conicity,
            Role.HEAD_RADIUS: cone.head_radius,
            Role.HERTZ: float(cone.patch.ellipse.C),
            Role.CREEP_ALONG: f11,
            Role.CREEP_ACROSS: f22,
            Role.CREEP_SPIN: f23,
            Role.CREEP_TURN: f33,
            Role.ELLIPSE_ALONG: float(a),
            Role.ELLIPSE_ACROSS: float(b),
            Role.FRICTION: 0.0 if rolling.creep == UNBOUNDED else rolling.friction,
            Role.FLANGE_STIFFNESS: rolling.flange_stiffness,
            Role.FLANGE_CLEARANCE: rolling.flange_clearance,
            Role.FLANGE_DEPTH: rolling.flange_depth,
            Role.AXLE_INERTIA: self.inertia,
        }


def why_not_inside(train: Train) -> str:
    """Why FMUs cannot own the contacts of a train's wheels; empty if they can."""
    why = ""
    if len(_bounds(train)) > 1:
        why = "[rolling] creep: must be bounded alike of all vehicles for contacts inside FMUs"
    for rolling in (one.vehicle.rolling for one in train.vehicles):
        if rolling.gravity != train.vehicles[0].vehicle.rolling.gravity:
            why = "[rolling] gravity: must be the same of all vehicles for contacts inside FMUs"
    if len({_profiles_asked(one.vehicle) for one in train.vehicles}) > 1:
        why = "[rolling] profiles: must be the same of all vehicles for contacts inside FMUs"
    return why and f"{why}; VehicleWithContact and TrackWithContact are left out"


def _bounds(train: Train) -> set[str]:
    """Creep laws of a train that friction bounds."""
    return {one.vehicle.rolling.creep for one in train.vehicles} - {UNBOUNDED}


def _profiles_asked(vehicle: Vehicle) -> tuple[object, ...]:
    """What tables follow from, where a vehicle has profiles."""
    rolling = vehicle.rolling
    names = rolling.wheel_profile, rolling.rail_profile
    if not any(names):
        return ()
    folders = [getattr(name, "folder", None) for name in names]
    return (*names, *folders, rolling.profile_range, vehicle.contact, vehicle.wheelset.radius)


def rolling_wheels(train: Train, cars: Multibody, load: FloatArray) -> RollingWheels | None:
    """Of a train's wheelsets, or of as many others as there are loads; None if no FMU knows them.

    Raises
    ------
    ParameterError
        If they are others, and the train's wheels are not all alike; or profiles cannot be used.
    """
    if why_not_inside(train):
        return None
    own = [one.vehicle for one in train.vehicles for _ in range(one.wheelsets)]
    first = train.vehicles[0].vehicle
    geometry = geometry_of(first.rolling, first.contact, radius=cars.wheels[0].radius)
    profiles = geometry if isinstance(geometry, Profiled) else None
    wheels = [
        Wheel(
            Cone(**asdict(cone) | {"conicity": one.rolling.conicity}),
            one.rolling,
            one.wheelset.inertia_spin,
        ).numbers()
        for cone, one in zip(cars.wheels, own, strict=True)
    ]
    roles = [Role.FRICTION, Role.AXLE_INERTIA] if profiles else list(wheels[0])
    numbers = {role: in_common(np.array([one[role] for one in wheels])) for role in roles}
    if load.size != len(wheels):
        different = [role.name for role, values in numbers.items() if len(values) > 1]
        if different:
            raise ParameterError(
                f"{load.size} wheelsets, but the vehicle has {len(wheels)} whose wheels roll "
                f"differently ({different[0].lower()}): must be {len(wheels)}, or all alike"
            )
    gravity = GRAVITY[first.rolling.gravity]
    textbook = issubclass(gravity, TextbookCone)
    return RollingWheels(
        numbers=numbers, fastsim=FASTSIM in _bounds(train), textbook=textbook, profiles=profiles
    )
