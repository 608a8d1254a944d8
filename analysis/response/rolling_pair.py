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
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.progress import Progress
from railcosim.mechanics.ports import FORCE, RAIL, Layout
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, infinite_receptance
from railcosim.vehicle.multibody import Multibody
from railcosim.vehicle.on_rails import SIDES

from .models import linear_vehicle
from .rolling import ON_RAIL


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
    if not isinstance(model, StateSpace):
        raise CouplingError(
            f"{fmu}: is for Co-Simulation only; poles take an FMU for Model Exchange as well"
        )
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
    x = places_of(fmu, model.standing, layout)
    one = loads.reshape(2, -1).mean(axis=0)
    return model, replace(body, wheel_load=one, wheelset_x=x - x.mean())


def places_on(track: Path, body: Multibody) -> FloatArray:
    """Where wheelsets stand on a track FMU, the last one where it says so, m."""
    starts = {v.name: v.start for v in describe_file(track).inputs}
    last = Layout(body.wheelset_x.size).of_axles("position")[-1]
    places: FloatArray = body.wheelset_x - body.wheelset_x[-1] + starts.get(last, 0.0)
    return places
