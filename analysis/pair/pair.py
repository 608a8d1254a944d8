"""A vehicle FMU and a track FMU as one system: loaded, connected, and brought to rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.course import ALL_TIME, Told
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, IRREGULARITY, Layout
from railcosim.track.irregularity.met import Wheels
from railcosim.track.travel import Steady

from .contact import (
    NONLINEAR,
    TANGENT,
    Parameters,
    at_load,
    completed,
    fitting,
    layout_of,
)
from .journey import Journey
from .law_in_master import kind_of
from .numbering import Vehicles, files_of, places_of, through
from .rest import columns, settled
from .ring import check_ring_of
from .rolling import SPEED
from .several import Load, load_vehicles
from .standing import start_positions
from .wheel_radii import wheel_radii
from .wiring import wired

__all__ = ["PLACES", "Journey", "Pair", "open_pair"]

PLACES = "places"
"""The component that says where wheels are that do not go by themselves."""


@dataclass(frozen=True)
class Pair:
    """The two FMUs, and their system with the irregularity, ready to run.

    Where neither FMU owns the contact springs, the system has a `Law` named ``contact`` that does.
    The parameters are those it was opened with and all that the contact law needs. The layout is
    that of the wheels of both. The wheels are where they are at first.
    """

    vehicle: LoadedFmu
    track: LoadedFmu
    system: System
    parameters: dict[str, float | bool]
    layout: Layout
    wheels: Wheels

    @property
    def static_loads(self) -> FloatArray:
        """Forces at rest (n_wheelsets,), N, of the more loaded wheel; before the pair has moved."""
        self.system.exchange()
        forces = self.system.outputs[columns(self.system, self.layout.down.names(FORCE))]
        largest: FloatArray = forces.reshape(-1, self.layout.wheelsets).max(axis=0)
        return largest


@contextmanager
def open_pair(
    vehicle: Vehicles,
    track: Path,
    parameters: Parameters,
    journey: Journey,
    load: Load = FmuComponent.load,
    told: Told = ALL_TIME,
) -> Iterator[Pair]:
    """Load both FMUs, connect them by name and find their static equilibrium.

    Parameters
    ----------
    vehicle : Path or sequence of Path
        FMU file of a vehicle or a train, or of several from the front.
    track : Path
        FMU file. If none owns the contact springs, the master does.
    parameters : mapping
        Of the contact, for whoever owns it, and others of the FMUs. ``contact.tangent`` asks for
        Hertz's law of that stiffness at the static load, which is found here.
    journey : Journey
        Speed, irregularity and where it begins.
    load : callable, optional
        Loads an FMU.
    told : Told, optional
        What the FMUs are told of the run.
    """
    with ExitStack() as stack:
        cars = stack.enter_context(load_vehicles(vehicle, load))
        rails = stack.enter_context(load(track, name="track"))
        layout = layout_of((cars.description.path, _variables(cars)), (track, _variables(rails)))
        journey.check_dimension(aside=layout.dimension != layout.down.dimension)
        kind = kind_of(layout, files_of(vehicle), track)
        wanted = {NONLINEAR: True, **parameters, **start_positions(vehicle, journey.position)}
        given = completed(wanted, (cars, rails), layout, kind.needed(wanted))
        first = kind.first(given, layout) if TANGENT in given else given
        _set(first, layout, cars, rails)
        _set_speed(journey, layout, cars, rails)
        for fmu in (cars, rails):
            fmu.enter_initialization(*told)
        forces = layout.names(FORCE)
        outputs = {v.name: y for v, y in zip(cars.outputs, cars.get_outputs(), strict=True)}
        place = places_of(cars.description.path, outputs, layout)
        check_ring_of(track, place)
        radii = wheel_radii(vehicle) if journey.defects else np.full(place.shape, np.nan)
        wheels = Wheels(place, radii)
        irregularity = _irregularity(journey, layout, wheels)
        owned = any(v.name == forces[0] for fmu in (cars, rails) for v in fmu.outputs)
        nominal = {v.name: v.nominal for v in (*cars.inputs, *rails.inputs)}
        law = [] if owned else [kind.law(first, layout, nominal, journey.speed)]
        components = [irregularity, cars, *law, rails]
        connections = wired(irregularity, cars, law, rails, layout)
        stands = _stands(journey, layout, cars)
        if journey.way.changes or (journey.held and not stands):
            places, connections = _by_command(journey, components, connections, layout, place)
            components.append(places)
        settle = partial(settled, components, connections, layout, cars, rails)
        rest = settle()
        complete = first
        if TANGENT in given:
            complete = at_load(given, _static_loads(cars, layout, rest), layout)
            _set(complete, layout, cars, rails)
            for one in law:
                one.law = kind.law(complete, layout, nominal, journey.speed).law
            rest = settle()
        system = System(components, connections)
        system.outputs[:] = rest.outputs[: system.outputs.size]
        for fmu in (cars, rails):
            fmu.set_inputs(system.gather(system.index(fmu.name)))
            fmu.exit_initialization()
        yield Pair(cars, rails, system, complete, layout, wheels)


def _set(parameters: Parameters, layout: Layout, *fmus: LoadedFmu) -> None:
    """Set the parameters that an FMU has."""
    for fmu in fmus:
        fmu.set_parameters(fitting(parameters, fmu, layout))


def _set_speed(journey: Journey, layout: Layout, cars: LoadedFmu, rails: LoadedFmu) -> None:
    """Let the vehicle roll, or hold it; whoever owns contacts that creep knows the speed."""
    for fmu in (cars, rails):
        fmu.keep(dict.fromkeys(_speeds(fmu), journey.speed))
    if SPEED not in cars.description.parameters:
        return
    told_to_stand = _stands(journey, layout, cars) or journey.way.changes
    cars.set_parameters({SPEED: 0.0 if told_to_stand else journey.speed})


def _speeds(component: Component) -> list[str]:
    """Inputs that are the speed, of a component whose contacts creep; one a vehicle."""
    numbers = range(1, len(component.inputs) + 1)
    known = {SPEED, *(through(SPEED, number, 0) for number in numbers)}
    return [v.name for v in component.inputs if v.name in known]


def _stands(journey: Journey, layout: Layout, cars: LoadedFmu) -> bool:
    """Whether a vehicle is told that it stands: its own wheels that roll creep all the same."""
    return journey.held and not _speeds(cars)


def _by_command(
    journey: Journey,
    components: Sequence[Component],
    connections: Sequence[Connection],
    layout: Layout,
    place: FloatArray,
) -> tuple[Signal, tuple[Connection, ...]]:
    """Where the wheels are on the track, whatever the vehicle says of them; and how fast they are.

    Held, they stay. At a speed that changes the places are exact at communication points; between
    them inputs are polynomials, and a line is off by h^2 / 8 times the acceleration: 1e-9 m.
    """
    names = layout.of_axles("position")
    way, stay = journey.way, Steady(0.0)
    variables = [Variable(name=name, unit="m") for name in names]
    if way.changes:
        variables.append(Variable(name=SPEED, unit="m/s", description="speed of the vehicle"))

    def going(t: ArrayLike) -> FloatArray:
        at = place + (stay if journey.held else way).gone(t)[..., None]
        return np.concatenate([at, way.speed(t)[..., None]], axis=-1) if way.changes else at

    places = Signal(PLACES, variables, going, vectorised=True)
    moved = [
        replace(c, source=PLACES) if c.output in names and c.input in names else c
        for c in connections
    ]
    fast = [
        Connection(PLACES, SPEED, one.name, name)
        for one in components
        for name in _speeds(one)
        if way.changes
    ]
    return places, (*moved, *fast)


def _variables(fmu: LoadedFmu) -> list[Variable]:
    return [*fmu.inputs, *fmu.outputs]


def _static_loads(vehicle: LoadedFmu, layout: Layout, rest: System) -> FloatArray:
    """The mean of the contact forces of each wheelset at rest, N."""
    forces = rest.outputs[columns(rest, layout.down.names(FORCE))]
    load: FloatArray = forces.reshape(-1, layout.wheelsets).mean(axis=0)
    if layout.of_axles("start_z")[0] in vehicle.description.parameters and load.min() > 0.0:
        return load
    raise CouplingError(
        f"{vehicle.description.path}: its static load was not found (it has no "
        f"{layout.axles[0]}.start_z, or nothing rests on some wheels), so no law has its tangent "
        "there; give --contact-stiffness hertz or N/m"
    )


def _irregularity(journey: Journey, layout: Layout, wheels: Wheels) -> Signal:
    surface = layout.surface
    lies = journey.under(wheels, surface.directions)
    variables = [
        Variable(
            name=port.name(IRREGULARITY),
            unit=port.direction.motion,
            description=f"rail surface under the wheel off its place, {port.direction.positive}",
            nominal=1e-3,
        )
        for port in surface.ports
    ]
    return Signal("irregularity", variables, lies, vectorised=True)
