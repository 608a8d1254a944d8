"""A vehicle's parameters as bodies and springs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from railcosim.mechanics.contact.geometry import Cone
from railcosim.mechanics.law import hertz_coefficient

from .bodies import (
    ALONG_X,
    ALONG_Y,
    BOGIE,
    CARBODY,
    DOWN,
    WHEELSET,
    Body,
    Parts,
    Spring,
    in_order,
)
from .parameters import (
    AxlePlace,
    BogiePlace,
    Coupler,
    PrimarySuspension,
    SecondarySuspension,
    Vehicle,
)

SIDES = (-1.0, 1.0)  # left, right: y is to the right


def parts_of(vehicle: Vehicle) -> Parts:
    """Bodies and springs of a vehicle; x from its middle, z from its secondary suspension's plane.

    A car body that stands on axles stands on them in that plane.
    """
    vehicle = vehicle.placed
    cars = [_carbody(vehicle, k) for k in range(len(vehicle.carbodies))]
    made = [_bogie(vehicle, bogie, cars) for bogie in vehicle.bogies]
    made += [_axle(vehicle, axle, cars[axle.carbody - 1]) for axle in vehicle.axles]
    joints = []
    for place in vehicle.couplers:
        one, other = (cars[number - 1] for number in place.carbodies)
        joints.append(coupled(one, other, place.x, place.coupler or vehicle.coupler))
    return Parts(
        bodies=in_order([*cars, *(body for one in made for body in one.bodies)]),
        suspension=(
            *joints,
            *(spring for one in made for spring in one.secondary),
            *(spring for one in made for spring in one.primary),
        ),
    )


@dataclass(frozen=True)
class _RunningGear:
    """A bogie with its wheelsets, or an axle without one, and what springs stand on them."""

    bodies: list[Body]
    secondary: list[Spring]
    primary: list[Spring]


def coupled(a: Body, b: Body, x: float, coupler: Coupler) -> Spring:
    """A coupler as a spring."""
    return Spring(a=a, b=b, point=(x, 0.0, 0.0), axis=DOWN, k=coupler.stiffness, c=coupler.damping)


def _carbody(vehicle: Vehicle, k: int) -> Body:
    place = vehicle.carbodies[k]
    car = place.carbody or vehicle.carbody
    return Body(
        kind=CARBODY,
        mass=car.mass,
        inertia=(car.inertia_roll, car.inertia_pitch, car.inertia_yaw),
        place=(place.x, 0.0, -vehicle.geometry.carbody_height),
    )


def _wheelset(vehicle: Vehicle, place: BogiePlace | AxlePlace, x: float, z: float) -> Body:
    known, contact = place.wheelset or vehicle.wheelset, vehicle.contact
    return Body(
        kind=WHEELSET,
        mass=known.mass,
        inertia=(known.inertia_roll, known.inertia_spin, known.inertia_yaw),
        place=(x, 0.0, z),
        hertz_coefficient=hertz_coefficient(
            young_modulus=contact.young_modulus,
            poisson_ratio=contact.poisson_ratio,
            wheel_radius=known.radius,
            rail_radius=contact.rail_radius,
        ),
        wheels=Cone(
            radius=known.radius,
            half_distance=contact.half_distance,
            conicity=0.0,
            head_radius=contact.rail_radius,
            shear_modulus=contact.young_modulus / (2 * (1 + contact.poisson_ratio)),
            poisson_ratio=contact.poisson_ratio,
        ),
    )


def _bogie(vehicle: Vehicle, place: BogiePlace, cars: Sequence[Body]) -> _RunningGear:
    known = place.bogie or vehicle.bogie
    z = -vehicle.geometry.bogie_height
    frame = Body(
        kind=BOGIE,
        mass=known.mass,
        inertia=(known.inertia_roll, known.inertia_pitch, known.inertia_yaw),
        place=(place.x, 0.0, z),
    )
    secondary: list[Spring] = []
    pivots = place.pivots or (0.0,) * len(place.carbodies)
    above = place.secondary_suspension or vehicle.secondary_suspension
    for number, ahead in zip(place.carbodies, pivots, strict=True):
        secondary += _secondary(above, cars[number - 1], frame, place.x + ahead)
    bodies, primary = [frame], []
    below = place.primary_suspension or vehicle.primary_suspension
    for ahead in place.wheelsets:
        x = place.x + ahead
        axle = _wheelset(vehicle, place, x, z + vehicle.geometry.wheelset_height)
        primary += _primary(below, frame, axle, x, z + vehicle.geometry.primary_height)
        bodies.append(axle)
    return _RunningGear(bodies, secondary, primary)


def _axle(vehicle: Vehicle, place: AxlePlace, car: Body) -> _RunningGear:
    axle = _wheelset(vehicle, place, place.x, vehicle.geometry.wheelset_height)
    below = place.primary_suspension or vehicle.primary_suspension
    return _RunningGear([axle], [], _primary(below, car, axle, place.x, 0.0))


def _primary(known: PrimarySuspension, a: Body, axle: Body, x: float, z: float) -> list[Spring]:
    """Of both wheels of an axle."""
    return [
        Spring(a=a, b=axle, point=(x, side * known.half_span, z), axis=axis, k=k, c=c)
        for side in SIDES
        for axis, k, c in (
            (ALONG_X, known.stiffness_x, known.damping_x),
            (ALONG_Y, known.stiffness_y, known.damping_y),
            (DOWN, known.stiffness, known.damping),
        )
    ]


def _secondary(known: SecondarySuspension, car: Body, frame: Body, x: float) -> list[Spring]:
    """Of both sides of a bogie with yaw dampers, its roll bar and lateral stops."""
    near, out = known.half_span, known.yaw_damper_half_span
    springs = [
        Spring(a=car, b=frame, point=(x, side * y, 0.0), axis=axis, k=k, c=c)
        for side in SIDES
        for y, axis, k, c in (
            (near, ALONG_X, known.stiffness_x, known.damping_x),
            (near, ALONG_Y, known.stiffness_y, known.damping_y),
            (near, DOWN, known.stiffness, known.damping),
            (out, ALONG_X, 0.0, known.yaw_damper),
        )
    ]
    bar = Spring(a=car, b=frame, point=None, axis=ALONG_X, k=known.roll_stiffness, c=0.0)
    stops = Spring(
        a=car, b=frame, point=(x, 0.0, 0.0), axis=ALONG_Y, k=known.stop_stiffness, c=0.0,
        gap=known.stop_gap,
    )  # fmt: skip
    return [*springs, bar, stops]
