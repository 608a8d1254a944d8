"""A vehicle FMU and a track FMU as one system: loaded, connected, and brought to rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import root

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import Connection, CouplingError, connect_by_name
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law import Law
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, IRREGULARITY, RAIL, Layout
from railcosim.track.irregularity import Profile

from .contact import (
    NONLINEAR,
    STIFFNESS,
    TANGENT,
    Parameters,
    at_load,
    completed,
    contact_law,
    fitting,
    law_of,
    layout_of,
)
from .numbering import Vehicles, places_of
from .ring import check_ring_of
from .several import Load, load_vehicles
from .standing import Position, start_positions

FIRST_COMPRESSION = 1e-4  # m, about the static one: where the search for equilibrium begins
STILL = 1e-6  # m/s2, and 0.1 N: a thousandth of what a bump of 1e-6 m does


@dataclass(frozen=True)
class Pair:
    """The two FMUs, and their system with the irregularity, ready to run.

    Where neither FMU owns the contact springs, the system has a `Law` named ``contact`` that does.
    The parameters are those it was opened with and all that the contact law needs. The layout is
    that of the wheels of both.
    """

    vehicle: LoadedFmu
    track: LoadedFmu
    system: System
    parameters: dict[str, float | bool]
    layout: Layout

    @property
    def static_loads(self) -> FloatArray:
        """Forces at rest (n_wheelsets,), N, of the more loaded wheel; before the pair has moved."""
        self.system.exchange()
        forces = self.system.outputs[_columns(self.system, self.layout.names(FORCE))]
        largest: FloatArray = forces.reshape(-1, self.layout.wheelsets).max(axis=0)
        return largest


@dataclass(frozen=True, kw_only=True)
class Journey:
    """How the vehicle meets the track.

    Attributes
    ----------
    speed : float
        m/s.
    held : bool
        True: wheels stay where they are and the irregularity moves; False: wheels roll.
    profile : Profile
        Irregularity.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands at first, m; as the FMU has it if None.
    """

    speed: float
    held: bool
    profile: Profile
    position: Position = None


@contextmanager
def open_pair(
    vehicle: Vehicles,
    track: Path,
    parameters: Parameters,
    journey: Journey,
    load: Load = FmuComponent.load,
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
    """
    with ExitStack() as stack:
        cars = stack.enter_context(load_vehicles(vehicle, load))
        rails = stack.enter_context(load(track, name="track"))
        layout = layout_of((cars.description.path, _variables(cars)), (track, _variables(rails)))
        told = {**parameters, **start_positions(vehicle, journey.position)}
        given = completed(told, (cars, rails), layout)
        first = given
        if TANGENT in given:  # the static load does not depend on the law: any does to find it
            first = {**given, NONLINEAR: False, STIFFNESS: given[TANGENT]}
        _set(first, layout, cars, rails)
        if "speed" in cars.description.parameters:
            cars.set_parameters({"speed": 0.0 if journey.held else journey.speed})
        for fmu in (cars, rails):
            fmu.enter_initialization(0.0)
        forces = layout.names(FORCE)
        outputs = {v.name: y for v, y in zip(cars.outputs, cars.get_outputs(), strict=True)}
        place = places_of(cars.description.path, outputs, layout)
        check_ring_of(track, place)
        irregularity = _irregularity(journey, layout, place)
        owned = any(v.name == forces[0] for fmu in (cars, rails) for v in fmu.outputs)
        nominal = {v.name: v.nominal for v in (*cars.inputs, *rails.inputs)}
        law: list[Law] = [] if owned else [contact_law(law_of(first, layout), layout, nominal)]
        components = [irregularity, cars, *law, rails]
        needed = [*layout.of_axles("position"), *forces]
        connections = connect_by_name(components, required=needed)
        settle = partial(_settle, components, connections, layout, cars, rails)
        rest = settle()
        complete = first
        if TANGENT in given:
            complete = at_load(given, _static_loads(cars, layout, rest), layout)
            _set(complete, layout, cars, rails)
            for spring in law:
                spring.law = law_of(complete, layout)
            rest = settle()
        system = System(components, connections)
        system.outputs[:] = rest.outputs[: system.outputs.size]
        for fmu in (cars, rails):
            fmu.set_inputs(system.gather(system.index(fmu.name)))
            fmu.exit_initialization()
        yield Pair(cars, rails, system, complete, layout)


def _set(parameters: Parameters, layout: Layout, *fmus: LoadedFmu) -> None:
    """Set the parameters that an FMU has."""
    for fmu in fmus:
        fmu.set_parameters(fitting(parameters, fmu, layout))


def _variables(fmu: LoadedFmu) -> list[Variable]:
    return [*fmu.inputs, *fmu.outputs]


def _columns(system: System, names: Sequence[str]) -> list[int]:
    """Where outputs of these names, whoever's, stand in the system."""
    known = [name.partition(".")[2] for name in system.names]
    return [known.index(name) for name in names]


def _static_loads(vehicle: LoadedFmu, layout: Layout, rest: System) -> FloatArray:
    """The mean of the contact forces of each wheelset at rest, N."""
    forces = rest.outputs[_columns(rest, layout.names(FORCE))]
    load: FloatArray = forces.reshape(-1, layout.wheelsets).mean(axis=0)
    if layout.of_axles("start_z")[0] in vehicle.description.parameters and load.min() > 0.0:
        return load
    raise CouplingError(
        f"{vehicle.description.path}: its static load was not found (it has no "
        f"{layout.axles[0]}.start_z, or nothing rests on some wheels), so no law has its tangent "
        "there; give --contact-stiffness hertz or N/m"
    )


def _irregularity(journey: Journey, layout: Layout, place: FloatArray) -> Signal:
    surface = layout.surface
    lies = journey.profile.under(place, journey.speed, surface.directions)
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


def _settle(
    components: Sequence[Component],
    connections: Sequence[Connection],
    layout: Layout,
    vehicle: LoadedFmu,
    track: LoadedFmu,
) -> System:
    """Find the heights (and forces) for which vehicle and track are at rest together, as a system.

    The vehicle is at rest on wheelsets held at `start_z`; it needs no holding where the wheelsets'
    accelerations vanish. A track that is given forces sinks under them at once, in initialisation:
    the forces are then unknown, too, and cut from where they come. Wheelsets without `start_z`
    start as their maker wants.
    """
    able = [
        k
        for k, name in enumerate(layout.of_axles("start_z"))
        if name in vehicle.description.parameters
    ]
    starts, count = [layout.of_axles("start_z")[k] for k in able], len(able)
    known = {v.name: v for v in track.inputs}
    cut = [known[name] for name in layout.names(FORCE) if name in known]
    held = np.array([v.start for v in cut])
    pressing = Signal("forces at rest", cut, lambda t: held)
    wires = [
        replace(c, source=pressing.name) if c.input in {v.name for v in cut} else c
        for c in connections
    ]
    system = System([*components, pressing], wires)
    system.begin(0.0)
    if not able:
        return system
    forces, accelerations = (
        _columns(system, names)
        for names in (layout.names(FORCE), [layout.of_axles("az")[k] for k in able])
    )

    def imbalance(unknown: FloatArray) -> FloatArray:
        """Heights (mm), forces (100 kN) to accelerations (m/s2) and what is wrong of the forces."""
        heights, held[:] = 1e-3 * unknown[:count], 1e5 * unknown[count:]
        vehicle.set_parameters(dict(zip(starts, heights.tolist(), strict=True)))
        system.begin(0.0)
        unequal = system.outputs[forces[: held.size]] - held
        return np.concatenate([system.outputs[accelerations], unequal / 1e5])

    guess = np.full(count, 2.0)
    if cut:
        rail = system.outputs[_columns(system, [layout.names(RAIL.motion)[k] for k in able])]
        guess = np.concatenate([1e3 * (rail + FIRST_COMPRESSION), held / 1e5])
    rest = imbalance(root(imbalance, guess, tol=1e-13).x)
    if not np.abs(rest).max() < STILL:
        raise CouplingError(
            "no static equilibrium of vehicle and track was found (largest remaining acceleration "
            f"{np.abs(rest[:count]).max():g} m/s2): check contact stiffness and wheel loads"
        )
    return system
