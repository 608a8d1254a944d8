"""A vehicle and a track that roll on each other, as linear models: from FMUs or from parameters."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from railcosim.analysis.pair.contact import layout_of
from railcosim.analysis.pair.numbering import places_of
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import describe_file
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import frequency_response
from railcosim.master.linear.side_by_side import SideBySide
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.progress import Progress
from railcosim.mechanics.ports import FORCE, RAIL, Layout
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, infinite_receptance
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.on_rails import SIDES
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.rolling import geometry_of
from railcosim.vehicle.train import Train, train_of

from .models import linear_vehicle
from .rolling import ON_RAIL, LinearContacts


def rails_of(track: Track, wheelset_x: FloatArray, frequency: float) -> ComplexArray:
    """Compliance of the rails at the ports of an endless track's contacts.

    The last wheelset stands in the middle between two railseats.
    """
    x = wheelset_x - wheelset_x[-1] + track.fastening.spacing / 2
    points = [
        Point(x=float(x[port.wheelset - 1]), side=int(SIDES[port.side]), direction=port.direction)
        for port in Layout(x.size, directions=ON_RAIL).ports
    ]
    omega = np.array([2 * np.pi * frequency])
    compliance: ComplexArray = infinite_receptance(track, omega, points, points)[0]
    return compliance


def compliance_of(track: LinearForm, frequency: float) -> ComplexArray:
    """Of rails at their ports, of a linear model of a track, at a frequency in Hz.

    Raises
    ------
    CouplingError
        If the track is not one in space.
    """
    response = frequency_response(track, [2 * np.pi * frequency])
    wheelsets = (Layout.among(response.inputs) or Layout()).wheelsets
    layout = Layout(wheelsets, directions=ON_RAIL)
    if missing := set(layout.names(FORCE)) - set(response.inputs):
        raise CouplingError(
            f"{track.name}: has no {min(missing)}; hunting takes a track in space, export "
            "--dimension spatial"
        )
    found: ComplexArray = response.values[0][
        np.ix_(response.rows(layout.names(RAIL.motion)), response.columns(layout.names(FORCE)))
    ]
    return found


def vehicle_of(fmu: Path, body: Multibody, progress: Progress) -> tuple[StateSpace, Multibody]:
    """Linear model of a vehicle FMU, and whose wheels, under the loads that it says it has."""
    model, _ = linear_vehicle(fmu, progress)
    own = loaded(body, fmu, model)
    x = places_of(fmu, model.standing, layout_of((fmu, model.inputs)))
    return matrices_of(fmu, model), replace(own, wheelset_x=x - x.mean())


def matrices_of(fmu: Path, model: LinearForm) -> StateSpace:
    """A model of a vehicle, or of several, as matrices; CouplingError if it has none."""
    try:
        found = model.matrices if isinstance(model, SideBySide) else model
    except TypeError:
        found = model
    if not isinstance(found, StateSpace):
        raise CouplingError(
            f"{fmu}: is for Co-Simulation only; poles take an FMU for Model Exchange as well"
        )
    return found


def loaded(body: Multibody, fmu: Path, model: LinearForm) -> Multibody:
    """Under the static loads that a vehicle FMU tells, as start values of its forces."""
    starts = {v.name: v.start for v in model.inputs}
    layout = layout_of((fmu, model.inputs))
    if layout.wheelsets != body.wheelset_x.size:
        raise CouplingError(
            f"{fmu}: has {layout.wheelsets} wheelsets, and the vehicle whose wheels it is given "
            f"{body.wheelset_x.size}: give its parameters, --vehicle"
        )
    loads = np.array([starts[f"{wheel}.force_z"] for wheel in layout.wheels])
    if not (loads > 0).all():
        raise CouplingError(
            f"{fmu}: does not tell its static loads as start values of wheelset[i].left.force_z"
        )
    return replace(body, wheel_load=loads.reshape(2, -1).mean(axis=0))


def rolling_of(stock: Vehicle | Train, fmu: Path, model: LinearForm) -> LinearContacts:
    """Contacts of a vehicle FMU whose wheels roll as parameters say, see `[rolling]`.

    Creep is linear: about straight running what bounds it is far away.
    """
    train = train_of(stock)
    body = loaded(build_multibody(train, SPATIAL), fmu, model)
    own = [one.vehicle for one in train.vehicles for _ in range(one.wheelsets)]
    wheels = [
        geometry_of(vehicle.rolling, vehicle.contact, radius=cylinder.radius)
        for vehicle, cylinder in zip(own, body.wheels, strict=True)
    ]
    return LinearContacts.of(body, wheels)


def check_wheels(fmu: Path, stock: Vehicle | Train) -> None:
    """Refuse wheels that are not those that a vehicle FMU tells of itself.

    Raises
    ------
    CouplingError
        If radius, distance or conicity differ.
    """
    told = describe_file(fmu).parameters
    first = train_of(stock).vehicles[0].vehicle
    wheel = geometry_of(first.rolling, first.contact, radius=first.wheelset.radius)
    for name, ours in (
        ("contact.wheel_radius", wheel.radius),
        ("contact.half_distance", first.contact.half_distance),
        ("contact.conicity", first.rolling.conicity),
    ):
        if name in told and float(told[name].start) != ours:
            raise CouplingError(
                f"{fmu}: its {name} is {told[name].start}, and that of the paper's vehicle, whose "
                f"wheels are taken where none are given, {ours:g}: give its parameters, --vehicle"
            )


def places_on(track: Path, body: Multibody) -> FloatArray:
    """Where wheelsets stand on a track FMU, the last one where it says so, m."""
    starts = {v.name: v.start for v in describe_file(track).inputs}
    last = Layout(body.wheelset_x.size).of_axles("position")[-1]
    places: FloatArray = body.wheelset_x - body.wheelset_x[-1] + starts.get(last, 0.0)
    return places
