"""A vehicle FMU and a track FMU as one system: loaded, connected, and brought to rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from scipy.optimize import root

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import CouplingError, connect_by_name
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law import Law
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.mechanics.ports import FORCE, IRREGULARITY, RAIL, Layout
from railcosim.track.irregularity import Profile

from .contact import (
    FORCES,
    NONLINEAR,
    STIFFNESS,
    TANGENT,
    WHEELS,
    WHEELSETS,
    Parameters,
    at_load,
    completed,
    contact_law,
    law_of,
    layout_of,
)
from .ring import check_ring_of

__all__ = ["FORCES", "WHEELS", "WHEELSETS", "Journey", "Pair", "open_pair"]

FIRST_COMPRESSION = 1e-4  # m, about the static one: where the search for equilibrium begins
STILL = 1e-6  # m/s2, and 0.1 N: a thousandth of what a bump of 1e-6 m does

Pool: TypeAlias = dict[str, float]  # values by variable name
Load: TypeAlias = Callable[..., LoadedFmu]
"""Loads an FMU from its path and, by keyword, a name."""


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
    def static_load(self) -> float:
        """Force at rest of the most loaded contact, N; of a pair that has not moved."""
        self.system.exchange()
        names = [name.partition(".")[2] for name in self.system.names]
        return float(
            max(self.system.outputs[names.index(force)] for force in self.layout.names(FORCE))
        )


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
    """

    speed: float
    held: bool
    profile: Profile


@contextmanager
def open_pair(
    vehicle: Path,
    track: Path,
    parameters: Parameters,
    journey: Journey,
    load: Load = FmuComponent.load,
) -> Iterator[Pair]:
    """Load both FMUs, connect them by name and find their static equilibrium.

    Parameters
    ----------
    vehicle, track : Path
        FMU files. If neither owns the contact springs, the master does.
    parameters : mapping
        Of the contact, for whoever owns it. ``contact.tangent`` asks for Hertz's law of that
        stiffness at the static load, which is found here.
    journey : Journey
        Speed and irregularity.
    load : callable, optional
        Loads an FMU.
    """
    with ExitStack() as stack:
        cars = stack.enter_context(load(vehicle, name="vehicle"))
        rails = stack.enter_context(load(track, name="track"))
        given = completed(parameters, (cars, rails))
        first = given
        if TANGENT in given:  # the static load does not depend on the law: any does to find it
            first = {**given, NONLINEAR: False, STIFFNESS: given[TANGENT]}
        _set(first, cars, rails)
        if "speed" in cars.description.parameters:
            cars.set_parameters({"speed": 0.0 if journey.held else journey.speed})
        for fmu in (cars, rails):
            fmu.enter_initialization(0.0)
        pool: Pool = {}
        _ask(cars, pool)
        layout = layout_of((vehicle, _variables(cars)), (track, _variables(rails)))
        forces = layout.names(FORCE)
        place = _positions(cars, layout, pool)
        check_ring_of(track, place)
        irregularity = _irregularity(journey, layout, place)
        owned = any(v.name == forces[0] for fmu in (cars, rails) for v in fmu.outputs)
        nominal = {v.name: v.nominal for v in (*cars.inputs, *rails.inputs)}
        law: list[Law] = [] if owned else [contact_law(law_of(first), layout, nominal)]
        components = [irregularity, cars, *law, rails]
        needed = [*layout.of_axles("position"), *forces]
        system = System(components, connect_by_name(components, required=needed))
        heights = irregularity.get_outputs()
        pool.update(zip((v.name for v in irregularity.outputs), heights, strict=True))
        settle = partial(_settle, layout, cars, rails, law, pool)
        settle()
        complete = first
        if TANGENT in given:
            complete = at_load(given, _static_load(cars, layout, pool))
            _set(complete, cars, rails)
            for spring in law:
                spring.law = law_of(complete)
            settle()
        for fmu in (cars, rails):
            _tell(fmu, pool)
            fmu.exit_initialization()
        yield Pair(cars, rails, system, complete, layout)


def _set(parameters: Parameters, *fmus: LoadedFmu) -> None:
    """Set the parameters that an FMU has."""
    for fmu in fmus:
        known = fmu.description.parameters
        fmu.set_parameters({k: v for k, v in parameters.items() if k in known})


def _variables(fmu: LoadedFmu) -> list[Variable]:
    return [*fmu.inputs, *fmu.outputs]


def _static_load(vehicle: LoadedFmu, layout: Layout, pool: Pool) -> float:
    """The mean of the contact forces at rest, N."""
    load = float(np.mean([pool.get(name, 0.0) for name in layout.names(FORCE)]))
    if load > 0.0:
        return load
    raise CouplingError(
        f"{vehicle.description.path}: its static load was not found (it has no "
        f"{layout.axles[0]}.start_z, or nothing rests on the wheels), so no law has its tangent "
        "there; give --contact-stiffness hertz or N/m"
    )


def _irregularity(journey: Journey, layout: Layout, place: FloatArray) -> Signal:
    heights = journey.profile.under(place, journey.speed)
    variables = [
        Variable(
            name=name,
            unit="m",
            description="rail surface under the wheel below its nominal height",
            nominal=1e-3,
        )
        for name in layout.names(IRREGULARITY)
    ]
    return Signal("irregularity", variables, heights, vectorised=True)


def _positions(vehicle: LoadedFmu, layout: Layout, pool: Pool) -> FloatArray:
    names = layout.of_axles("position")
    missing = [name for name in names if name not in pool]
    if missing:
        raise CouplingError(
            f"{vehicle.description.path}: has no output {missing[0]}; a vehicle needs it"
        )
    return np.array([pool[name] for name in names])


def _settle(
    layout: Layout, vehicle: LoadedFmu, track: LoadedFmu, law: Sequence[Component], pool: Pool
) -> None:
    """Find the heights (and forces) for which vehicle and track are at rest together.

    The vehicle is at rest on wheelsets held at `start_z`; it needs no holding where the wheelsets'
    accelerations vanish. A vehicle without `start_z` starts as its maker wants.
    """
    if layout.of_axles("start_z")[0] not in vehicle.description.parameters:
        return
    forces, count = layout.names(FORCE), layout.wheelsets
    residual: Callable[[FloatArray], FloatArray]
    if forces[0] in [v.name for v in track.inputs]:
        starts = {v.name: v.start for v in track.inputs}
        force = np.array([starts[name] for name in forces])
        _tell(track, {**pool, **dict(zip(forces, force, strict=True))})
        _ask(track, pool)
        rail = np.array([pool[name] for name in layout.names(RAIL.motion)[:count]])
        guess = np.concatenate([1e3 * (rail + FIRST_COMPRESSION), force / 1e5])
        residual = partial(_imbalance_at_forces, layout, vehicle, track, law, pool)
    else:
        guess = np.full(count, 2.0)
        residual = partial(_imbalance_at_heights, layout, vehicle, track, pool)
    rest = residual(root(residual, guess, tol=1e-13).x)
    if not np.abs(rest).max() < STILL:
        raise CouplingError(
            "no static equilibrium of vehicle and track was found (largest remaining acceleration "
            f"{np.abs(rest[:count]).max():g} m/s2): check contact stiffness and wheel loads"
        )


def _imbalance_at_heights(
    layout: Layout, vehicle: LoadedFmu, track: LoadedFmu, pool: Pool, heights: FloatArray
) -> FloatArray:
    """The track owns the contact: wheelset heights (mm) to wheelset accelerations (m/s2)."""
    _place(vehicle, layout, heights)
    _ask(vehicle, pool)
    _tell(track, pool)
    _ask(track, pool)
    _tell(vehicle, pool)
    _ask(vehicle, pool)
    return np.array([pool[name] for name in layout.of_axles("az")])


def _imbalance_at_forces(
    layout: Layout,
    vehicle: LoadedFmu,
    track: LoadedFmu,
    law: Sequence[Component],
    pool: Pool,
    unknown: FloatArray,
) -> FloatArray:
    """Someone else owns it: heights (mm), forces (100 kN) to what is out of balance."""
    forces, count = layout.names(FORCE), layout.wheelsets
    force = 1e5 * unknown[count:]
    pool.update(zip(forces, force, strict=True))
    _tell(track, pool)
    _ask(track, pool)
    _place(vehicle, layout, unknown[:count])
    for component in (vehicle, *law):
        _tell(component, pool)
        _ask(component, pool)
    unequal = np.array([pool[name] for name in forces]) - force
    return np.concatenate([[pool[name] for name in layout.of_axles("az")], unequal / 1e5])


def _place(vehicle: LoadedFmu, layout: Layout, heights: FloatArray) -> None:
    names = layout.of_axles("start_z")
    vehicle.set_parameters(dict(zip(names, (1e-3 * heights).tolist(), strict=True)))


def _tell(component: Component, pool: Pool) -> None:
    """Set the inputs that are known; the others keep their start values."""
    component.set_inputs(np.array([pool.get(v.name, v.start) for v in component.inputs]))


def _ask(component: Component, pool: Pool) -> None:
    """Take note of the outputs."""
    names = (v.name for v in component.outputs)
    pool.update(zip(names, component.get_outputs().tolist(), strict=True))
