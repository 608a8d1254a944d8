"""Critical speeds of a vehicle that hunts, and how its poles go there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import ROLLING, layout_of
from railcosim.analysis.pair.numbering import places_of
from railcosim.fmus.roles import Role
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError
from railcosim.track.parameters import Track
from railcosim.vehicle.hunting import Critical
from railcosim.vehicle.hunting import root_locus as followed
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.on_rails import check_cones, cones_of
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .bodies import linear_of
from .choices import CONICITIES, Gravity
from .models import linear_track, linear_vehicle
from .rolling import LinearContacts
from .rolling_pair import (
    compliance_of,
    contacts_told,
    loaded,
    loads_of,
    matrices_of,
    places_on,
    rails_of,
    told_wheels,
)
from .running import BEYOND, FIRST, SPEEDS, OnRails, Rolling

ByConicity: TypeAlias = Callable[[float], LinearContacts]
KMH = 3.6
POINTS = 120
HIGHEST = 15.0  # Hz: bodies on their suspensions, far below wheelsets on their contacts


@dataclass(frozen=True, kw_only=True)
class Way:
    """A vehicle on its rails, for any conicity.

    Attributes
    ----------
    vehicle : StateSpace
        How it moves.
    contacts : callable
        Its wheels on their rails, by their conicity.
    gravity : Gravity
        See `critical_speed`.
    rails : callable or None
        Compliance of the rails under the wheels at a frequency in Hz, in the order of the ports.
        None: rails that do not move.
    """

    vehicle: StateSpace
    contacts: ByConicity
    gravity: Gravity
    rails: Callable[[float], ComplexArray] | None

    @property
    def track(self) -> str:
        """In words."""
        return "rigid rails" if self.rails is None else "a flexible track"

    def on(self, conicity: float) -> OnRails:
        """With wheels of a conicity."""
        return OnRails(Rolling(self.vehicle, self.contacts(conicity)), self.rails)


def critical_speed(
    stock: Vehicle | Train | None = None,
    conicity: Sequence[float] = CONICITIES,
    *,
    gravity: Gravity = Gravity.NORMALS,
    track: Track | None = None,
    rigid_track: bool = False,
    vehicle_fmu: str | Path | None = None,
    track_fmu: str | Path | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """The speed from which on a vehicle hunts, linear, for each conicity of its wheels.

    Parameters
    ----------
    stock : Vehicle or Train, optional
        Parameters; the paper's vehicle if neither they nor an FMU are given.
    conicity : sequence of float
        Tangents of the angle of conical wheels, above 0.
    gravity : Gravity
        Springs along the contact normals, or vertical ones and the textbook's gravity stiffness.
    track : Track, optional
        Parameters of an endless track, as its finite elements give way down, across and in roll at
        the frequency of hunting; the paper's if not given. Wheels stand where they are: what the
        rail's deflection along the track does to a wheel that moves on is left out.
    rigid_track : bool
        Rails that do not move instead.
    vehicle_fmu, track_fmu : str or Path, optional
        Anybody's, linearised, instead: a vehicle in space for Model Exchange, under the loads that
        it tells, on wheels as it tells, or as `stock` says if that is given; a track in space.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``conicity``: ``critical_speed`` (km/h) and ``frequency`` (Hz); nan where nothing grows
        up to 1000 km/h, and 0 where something does at 5 km/h already.

    Raises
    ------
    ArgumentError
        If a conicity is not between 0 and 1, a track is given that is to be rigid, or the vehicle
        says how its wheels roll.
    CouplingError
        If an FMU cannot be what it is given as.
    ArithmeticError
        If no frequency is found at which vehicle and track hunt.
    """
    check_conicities(conicity)
    way = way_of(
        stock, gravity, track, rigid_track=rigid_track, vehicle_fmu=vehicle_fmu,
        track_fmu=track_fmu, progress=progress,
    )  # fmt: skip
    return critical_speeds(way, conicity, progress)


def check_conicities(conicity: Sequence[float]) -> None:
    """Raise ArgumentError if one is not between 0 and 1."""
    for one in conicity:
        if not 0 < one <= 1:
            raise ArgumentError(
                "conicity", float(one), "must be above 0, as cylinders do not hunt, and at most 1"
            )


def critical_speeds(
    way: Way, conicity: Sequence[float], progress: Progress = unheard
) -> xr.Dataset:
    """The same of a vehicle on its rails."""
    check_conicities(conicity)
    found = []
    for k, one in enumerate(conicity):
        progress(k, len(conicity))
        try:
            found.append(way.on(one).critical())
        except ArithmeticError as error:
            raise ArithmeticError(f"conicity {one:g}: {error}") from error
    return xr.Dataset(
        {
            "critical_speed": (
                "conicity", [KMH * one.speed for one in found],
                {"units": "km/h", "long_name": "from which on something grows"},
            ),
            "frequency": (
                "conicity", [one.frequency for one in found],
                {"units": "Hz", "long_name": "at which it swings there"},
            ),
        },
        {"conicity": ("conicity", np.asarray(conicity, float), {"units": "1"})},
        {
            "title": f"critical speed on {way.track}, linear",
            "gravity": way.gravity.value,
            "creep": "Kalker, linear; spins as gyroscopes",
        },
    )  # fmt: skip


def way_of(
    stock: Vehicle | Train | None,
    gravity: Gravity,
    track: Track | None,
    *,
    rigid_track: bool,
    vehicle_fmu: str | Path | None = None,
    track_fmu: str | Path | None = None,
    progress: Progress = unheard,
) -> Way:
    """A vehicle on its rails; see `critical_speed`."""
    if rigid_track + (track is not None) + (track_fmu is not None) > 1:
        raise ArgumentError(
            "rigid_track", None,
            "rails that do not move have no track, and one FMU is one: give one of them",
        )  # fmt: skip
    if vehicle_fmu is None:
        vehicle, contacts, x = _of_parameters(stock or Vehicle(), gravity)
    else:
        vehicle, contacts, x = _of_fmu(Path(vehicle_fmu), stock, gravity, progress)
    rails: Callable[[float], ComplexArray] | None = None
    if track_fmu is not None:
        under, _ = linear_track(Path(track_fmu), places_on(Path(track_fmu), x), progress)
        rails = partial(compliance_of, under)
    elif not rigid_track:
        rails = partial(rails_of, track or Track(), x)
    return Way(vehicle=vehicle, contacts=contacts, gravity=gravity, rails=rails)


def _of_parameters(
    stock: Vehicle | Train, gravity: Gravity
) -> tuple[StateSpace, ByConicity, FloatArray]:
    """A vehicle, its contacts, and where its wheelsets stand, m."""
    body = _body_of(stock)
    x = body.wheelset_x
    vehicle = linear_of(vehicle_body(body).at(x - x[-1]), "vehicle")
    return vehicle, partial(_on_cones, body, gravity), x


def _of_fmu(
    fmu: Path, stock: Vehicle | Train | None, gravity: Gravity, progress: Progress
) -> tuple[StateSpace, ByConicity, FloatArray]:
    """The same of an FMU, on its own wheels or on those of parameters."""
    model, _ = linear_vehicle(fmu, progress)
    vehicle = matrices_of(fmu, model)
    x = places_of(fmu, model.standing, layout_of((fmu, model.inputs)))
    if stock is not None:
        return vehicle, partial(_on_cones, loaded(_body_of(stock), fmu, model), gravity), x
    wheels, loads = told_wheels(fmu), loads_of(fmu, model)
    by_gravity = {ROLLING[Role.TEXTBOOK]: float(gravity is Gravity.TEXTBOOK)}

    def on_told(conicity: float) -> LinearContacts:
        other = by_gravity | {ROLLING[Role.CONICITY]: conicity}
        return contacts_told([wheel | other for wheel in wheels], loads)

    return vehicle, on_told, x


def _body_of(stock: Vehicle | Train) -> Multibody:
    train = train_of(stock)
    check_cones(train)
    return build_multibody(train, SPATIAL)


def _on_cones(body: Multibody, gravity: Gravity, conicity: float) -> LinearContacts:
    return LinearContacts.of(body, cones_of(body, conicity, gravity.value))


def root_locus(way: Way, conicity: float, critical: Critical) -> xr.Dataset:
    """Poles below 15 Hz, followed over the speed to beyond the critical one.

    On a track they are those on rails as they give way at the critical frequency, so exact there.

    Parameters
    ----------
    way : Way
        Vehicle and rails.
    conicity : float
        Tangent of the angle of its wheels.
    critical : Critical
        What `OnRails.critical` found.

    Returns
    -------
    Dataset
        Over ``speed`` (km/h) and ``mode``: ``growth`` (1/s) and ``frequency`` (Hz).
    """
    known = critical.speed > 0
    to = min(BEYOND * critical.speed, SPEEDS[-1]) if known else SPEEDS[-1]
    speeds = np.linspace(SPEEDS[0], to, POINTS)
    poles_at = way.on(conicity).poles(critical.frequency if known else FIRST)
    poles = followed(poles_at, speeds.tolist(), HIGHEST)
    over = ("speed", "mode")
    return xr.Dataset(
        {
            "growth": (over, poles.real, {"units": "1/s"}),
            "frequency": (over, poles.imag / (2 * np.pi), {"units": "Hz"}),
        },
        {"speed": ("speed", KMH * speeds, {"units": "km/h"})},
        {"conicity": conicity, "gravity": way.gravity.value},
    )
