"""A vehicle and a track that roll on each other, as linear models: from FMUs or from parameters."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from railcosim.analysis.pair.contact import ROLLING, layout_of, told
from railcosim.analysis.pair.profiles import profiles_of, profiles_told
from railcosim.analysis.pair.rolling import at_ports
from railcosim.fmus.roles import Role
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import describe_file
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import frequency_response
from railcosim.master.linear.side_by_side import SideBySide
from railcosim.master.linear.state_space import StateSpace
from railcosim.mechanics.ports import FORCE, RAIL, Layout
from railcosim.parameters import UnusualWarning
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, infinite_receptance
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.on_rails import SIDES
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.rolling import geometry_of
from railcosim.vehicle.train import Train, train_of

from .rolling import ON_RAIL, ON_WHEEL, LinearContacts

ONE = Layout(1, directions=ON_WHEEL)
"""The wheels of a wheelset."""
STRAIGHT = {ROLLING[Role.FRICTION]: 0.0, ROLLING[Role.FLANGE_STIFFNESS]: 0.0}
"""About straight running what bounds creep is far away, and so are flanges."""
INERTIA = ROLLING[Role.AXLE_INERTIA]


def rails_of(track: Track, wheelset_x: FloatArray, frequency: float) -> ComplexArray:
    """Compliance of the rails at the ports of an endless track's contacts.

    The last wheelset stands at a railseat, half a bay from the end of a cell.
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


def loads_of(fmu: Path, model: LinearForm) -> FloatArray:
    """Static loads of one wheel of each wheelset that a vehicle FMU tells, by start values, N.

    Raises
    ------
    CouplingError
        If it does not.
    """
    starts = {v.name: v.start for v in model.inputs}
    layout = layout_of((fmu, model.inputs))
    loads = np.array([starts[f"{wheel}.force_z"] for wheel in layout.wheels])
    if not (loads > 0).all():
        raise CouplingError(
            f"{fmu}: does not tell its static loads as start values of wheelset[i].left.force_z"
        )
    mean: FloatArray = loads.reshape(2, -1).mean(axis=0)
    return mean


def loaded(body: Multibody, fmu: Path, model: LinearForm) -> Multibody:
    """A vehicle under the static loads that its FMU tells."""
    wheelsets = layout_of((fmu, model.inputs)).wheelsets
    if wheelsets != body.wheelset_x.size:
        raise CouplingError(
            f"{fmu}: has {wheelsets} wheelsets, and the vehicle whose wheels it is given "
            f"{body.wheelset_x.size}: give its parameters, --vehicle"
        )
    return replace(body, wheel_load=loads_of(fmu, model))


def rolling_of(
    stock: Vehicle | Train | None, files: Sequence[Path], model: LinearForm
) -> LinearContacts:
    """Contacts of a vehicle, or of several, whose wheels roll; their creep is linear.

    Parameters
    ----------
    stock : Vehicle or Train or None
        Whose wheels, as `[rolling]` of its parameters says; None: as the FMUs tell, `told_wheels`.
    files : sequence of Path
        FMUs of vehicles from the front.
    model : LinearForm
        All of them, linear.

    Warns
    -----
    UnusualWarning
        If the parameters have a law of creep or profiles, of which only what is linear about
        straight running acts.

    Notes
    -----
    About straight running what bounds creep is far away.
    """
    if stock is None:
        loads, profiles = loads_of(files[0], model), profiles_of(files)
        if profiles is not None:
            axles = [axle for file in files for axle in _told(file, (INERTIA,))]
            laws = [at_ports(axle | STRAIGHT, ONE, profiles) for axle in axles]
            return LinearContacts.under(laws, loads)
        return contacts_told([wheel for file in files for wheel in told_wheels(file)], loads)
    train = train_of(stock)
    body = loaded(build_multibody(train, SPATIAL), files[0], model)
    tell_of_linear(train)
    own = [one.vehicle for one in train.vehicles for _ in range(one.wheelsets)]
    geometries = [
        geometry_of(vehicle.rolling, vehicle.contact, radius=cylinder.radius)
        for vehicle, cylinder in zip(own, body.wheels, strict=True)
    ]
    return LinearContacts.of(body, geometries)


def tell_of_linear(train: Train) -> None:
    """Say what of ``[rolling]`` is linear here, where a vehicle has such a table."""
    if not train.tells_rolling:
        return
    own = [one.vehicle.rolling for one in train.vehicles]
    what = [f"creep = {name!r}" for name in dict.fromkeys(r.creep for r in own) if name != "linear"]
    what += ["the profiles"] if any(r.wheel_profile for r in own) else []
    if what:
        warnings.warn(
            f"[rolling] {' and '.join(what)} act here by what is linear about straight running: "
            "Kalker's creep without bound, and slopes and curvatures in the middle; flanges do not",
            UnusualWarning,
            stacklevel=4,
        )


def told_wheels(fmu: Path) -> list[dict[str, float]]:
    """Parameters ``contact.*`` of its wheels that a vehicle FMU tells, of each wheelset.

    Raises
    ------
    CouplingError
        If it does not tell one of them.
    """
    if profiles_told(fmu) is not None:
        raise CouplingError(
            f"{fmu}: its wheels have profiles, which have no conicity; limit-cycle takes them from "
            "the vehicle's parameters, and says from what speed on it hunts"
        )
    return _told(fmu, tuple(ROLLING.values()))


def _told(fmu: Path, names: Sequence[str]) -> list[dict[str, float]]:
    """Parameters of these names, of each wheelset."""
    about = describe_file(fmu)
    layout = layout_of((fmu, [*about.inputs, *about.outputs]))
    each: list[dict[str, float]] = [{} for _ in layout.axles]
    for name in names:
        found = told(about.parameters, name, layout.of_axles(name))
        if not found:
            raise CouplingError(
                f"{fmu}: does not tell {name}, so how its wheels roll is not known: give its "
                "parameters, --vehicle"
            )
        numbers = np.resize(list(found.values()), layout.wheelsets).tolist()
        for wheel, number in zip(each, numbers, strict=True):
            wheel[name] = number
    return each


def contacts_told(wheels: Sequence[Mapping[str, float]], loads: FloatArray) -> LinearContacts:
    """Contacts of wheels by their parameters, under static loads.

    Parameters
    ----------
    wheels : sequence of mapping, length n_wheelsets
        See `told_wheels`.
    loads : array, shape (n_wheelsets,)
        Of one wheel, N.
    """
    return LinearContacts.under([at_ports(dict(wheel) | STRAIGHT, ONE) for wheel in wheels], loads)


def places_on(track: Path, wheelset_x: FloatArray) -> FloatArray:
    """Where wheelsets stand on a track FMU, the last one where it says so, m."""
    starts = {v.name: v.start for v in describe_file(track).inputs}
    last = Layout(wheelset_x.size).of_axles("position")[-1]
    places: FloatArray = wheelset_x - wheelset_x[-1] + starts.get(last, 0.0)
    return places
