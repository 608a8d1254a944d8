"""A vehicle in numbers: properties of its parts, and where these stand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

from railcosim.mechanics.ports import MOST_WHEELSETS
from railcosim.parameters import ParameterError

from .places import AxlePlace, BogiePlace, CarBodyPlace, CouplerPlace
from .properties import (
    Bogie,
    CarBody,
    Contact,
    Coupler,
    Geometry,
    PrimarySuspension,
    Rolling,
    SecondarySuspension,
    Wheelset,
)

__all__ = [
    "AxlePlace",
    "Bogie",
    "BogiePlace",
    "CarBody",
    "CarBodyPlace",
    "Contact",
    "Coupler",
    "CouplerPlace",
    "Geometry",
    "PrimarySuspension",
    "Rolling",
    "SecondarySuspension",
    "Vehicle",
    "Wheelset",
]


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """Everything about a vehicle.

    Without places: one car body on two bogies of two wheelsets each.

    Attributes
    ----------
    carbody, bogie, wheelset, primary_suspension, secondary_suspension, geometry, contact,
    rolling, coupler
        Properties of all such parts.
    carbodies, bogies, axles, couplers : tuple
        Places of any number of them, from the front, and what is other there.

    Raises
    ------
    ParameterError
        If the places do not fit together.

    References
    ----------
    Xu, L. & Lu, T. (2021), Int. J. Rail Transportation 9(4), 342-367,
    doi 10.1080/23248378.2020.1811170.
    """

    carbody: CarBody = field(default_factory=CarBody)
    bogie: Bogie = field(default_factory=Bogie)
    wheelset: Wheelset = field(default_factory=Wheelset)
    primary_suspension: PrimarySuspension = field(default_factory=PrimarySuspension)
    secondary_suspension: SecondarySuspension = field(default_factory=SecondarySuspension)
    geometry: Geometry = field(default_factory=Geometry)
    contact: Contact = field(default_factory=Contact)
    rolling: Rolling = field(default_factory=Rolling)
    coupler: Coupler = field(default_factory=Coupler)
    carbodies: tuple[CarBodyPlace, ...] = ()
    bogies: tuple[BogiePlace, ...] = ()
    axles: tuple[AxlePlace, ...] = ()
    couplers: tuple[CouplerPlace, ...] = ()

    def __post_init__(self) -> None:
        if self.carbodies or self.bogies or self.axles or self.couplers:
            check_places(self)

    @property
    def placed(self) -> Vehicle:
        """The same with its places written out."""
        if self.carbodies:
            return self
        L_c, L_t = self.geometry.bogie_half_distance, self.geometry.axle_half_distance
        bogies = tuple(BogiePlace(x=x, wheelsets=(L_t, -L_t)) for x in (L_c, -L_c))
        whole = replace(self.geometry, **WITHOUT_PLACES)
        return replace(self, carbodies=(CarBodyPlace(),), bogies=bogies, geometry=whole)

    @property
    def wheel_load(self) -> float:
        """Mean static load of its wheels, N."""
        whole = self.placed
        cars = [place.carbody or self.carbody for place in whole.carbodies]
        bogies = [place.bogie or self.bogie for place in whole.bogies]
        axles = [p.wheelset or self.wheelset for p in whole.bogies for _ in p.wheelsets]
        axles += [place.wheelset or self.wheelset for place in whole.axles]
        mass = sum(part.mass for some in (cars, bogies, axles) for part in some)
        return mass * self.geometry.gravity / (2 * len(axles))


WITHOUT_PLACES = {
    name: getattr(Geometry(), name) for name in ("bogie_half_distance", "axle_half_distance")
}
"""Distances that a vehicle with places must leave as they are."""


def check_places(vehicle: Vehicle) -> None:
    """Raise ParameterError if a vehicle's places do not fit together."""
    for name in ("carbodies", "bogies"):
        x = [place.x for place in getattr(vehicle, name)]
        for before, behind in pairwise(x):
            if behind >= before:
                raise ParameterError(
                    f"[[{name}]] x = {behind:g} m behind x = {before:g} m: list them from the front"
                )
    if not vehicle.carbodies:
        raise ParameterError("[[carbodies]] are missing: say where each car body is, x = ...")
    for name, default in WITHOUT_PLACES.items():
        if getattr(vehicle.geometry, name) != default:
            raise ParameterError(
                f"[geometry] {name}: [[bogies]] say where bogies and wheelsets are"
            )
    count = len(vehicle.axles) + sum(len(bogie.wheelsets) for bogie in vehicle.bogies)
    if not 1 <= count <= MOST_WHEELSETS:
        raise ParameterError(
            f"{count} wheelsets in [[bogies]] and [[axles]]: must be 1 to {MOST_WHEELSETS}"
        )
    _check_standing(vehicle)


def _check_standing(vehicle: Vehicle) -> None:
    for bogie in vehicle.bogies:
        _check_numbers("bogies", bogie.x, bogie.carbodies, vehicle)
        if not bogie.wheelsets or not bogie.carbodies:
            raise ParameterError(f"[[bogies]] x = {bogie.x:g} m: needs wheelsets and carbodies")
        if len(bogie.pivots) not in {0, len(bogie.carbodies)}:
            raise ParameterError(
                f"[[bogies]] x = {bogie.x:g} m: {len(bogie.pivots)} pivots for "
                f"{len(bogie.carbodies)} carbodies: must be one for each, or none"
            )
    for axle in vehicle.axles:
        _check_numbers("axles", axle.x, (axle.carbody,), vehicle)
    for coupler in vehicle.couplers:
        _check_numbers("couplers", coupler.x, coupler.carbodies, vehicle)
        if len(set(coupler.carbodies)) != 2 or len(coupler.carbodies) != 2:
            raise ParameterError(
                f"[[couplers]] x = {coupler.x:g} m: carbodies = {list(coupler.carbodies)}: must be "
                "the numbers of two"
            )


def _check_numbers(table: str, x: float, numbers: tuple[int, ...], vehicle: Vehicle) -> None:
    count = len(vehicle.carbodies)
    for number in numbers:
        if number > count:
            raise ParameterError(
                f"[[{table}]] x = {x:g} m: there is no car body {number}; [[carbodies]] has {count}"
            )
