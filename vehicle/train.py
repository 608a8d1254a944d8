"""Several vehicles one behind the other, coupled, in any order and either way round."""

from __future__ import annotations

from dataclasses import dataclass, field

from railcosim.mechanics.ports import MOST_WHEELSETS
from railcosim.parameters import ParameterError

from .bodies import CARBODY, WHEELSET, Body, Parts, in_order
from .parameters import Coupler, Vehicle
from .parts import coupled, parts_of
from .properties import Rolling


@dataclass(frozen=True, kw_only=True)
class TrainVehicle:
    """A vehicle of a train.

    Attributes
    ----------
    vehicle : Vehicle
        Its parameters.
    reversed : bool
        Whether it runs with its rear in front.
    """

    vehicle: Vehicle
    reversed: bool = False

    @property
    def wheelsets(self) -> int:
        """How many it has."""
        return sum(body.kind == WHEELSET for body in self.parts().bodies)

    def parts(self) -> Parts:
        """Bodies and springs, x from its middle."""
        own = parts_of(self.vehicle)
        return own.reversed() if self.reversed else own


@dataclass(frozen=True, kw_only=True)
class Train:
    """Vehicles from the front.

    Attributes
    ----------
    vehicles : tuple of TrainVehicle
        From the front.
    coupler : Coupler
        Between every two.

    Raises
    ------
    ParameterError
        If there is none, there are more wheelsets than `MOST_WHEELSETS`, or gravity or toppling
        differ.
    """

    vehicles: tuple[TrainVehicle, ...]
    coupler: Coupler = field(default_factory=Coupler)

    def __post_init__(self) -> None:
        if not self.vehicles:
            raise ParameterError("a train needs at least one vehicle, [[vehicle]]")
        count = sum(one.wheelsets for one in self.vehicles)
        if count > MOST_WHEELSETS:
            raise ParameterError(f"a train of {count} wheelsets: must be at most {MOST_WHEELSETS}")
        first = self.vehicles[0].vehicle
        for number, one in enumerate(self.vehicles, start=1):
            if one.vehicle.geometry.toppling != first.geometry.toppling:
                raise ParameterError(
                    f"vehicle {number}: [geometry] toppling: must be as vehicle 1 has it"
                )
            if one.vehicle.geometry.gravity != first.geometry.gravity:
                raise ParameterError(
                    f"vehicle {number}: [geometry] gravity = {one.vehicle.geometry.gravity:g} m/s2:"
                    f" must be that of vehicle 1, {first.geometry.gravity:g} m/s2"
                )

    @property
    def gravity(self) -> float:
        """Acceleration of gravity, m/s2."""
        return self.vehicles[0].vehicle.geometry.gravity

    @property
    def toppling(self) -> bool:
        """Whether weights topple what tilts on its suspension."""
        return self.vehicles[0].vehicle.geometry.toppling

    @property
    def tells_rolling(self) -> bool:
        """Whether a vehicle has a table ``[rolling]`` of its own."""
        return any(one.vehicle.rolling != Rolling() for one in self.vehicles)

    def parts(self) -> Parts:
        """Bodies and springs of all; x forward of the first vehicle's middle."""
        made: list[Parts] = []
        couplers = []
        rear = self.vehicles[0].vehicle.geometry.length / 2  # the first one's front, to begin with
        for one in self.vehicles:
            length = one.vehicle.geometry.length
            middle = rear - length / 2
            here = one.parts().moved(middle) if made else one.parts()
            if made:
                couplers.append(coupled(_last_car(made[-1]), _first_car(here), rear, self.coupler))
            made.append(here)
            rear = middle - length / 2
        return Parts(
            bodies=in_order(body for parts in made for body in parts.bodies),
            suspension=tuple(spring for parts in made for spring in parts.suspension),
            couplers=tuple(couplers),
        )


def train_of(stock: Vehicle | Train) -> Train:
    """A vehicle as a train of one."""
    return stock if isinstance(stock, Train) else Train(vehicles=(TrainVehicle(vehicle=stock),))


def _last_car(parts: Parts) -> Body:
    return min(_cars(parts), key=lambda b: b.place[0])


def _first_car(parts: Parts) -> Body:
    return max(_cars(parts), key=lambda b: b.place[0])


def _cars(parts: Parts) -> list[Body]:
    return [body for body in parts.bodies if body.kind == CARBODY]
