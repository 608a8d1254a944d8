"""Critical speeds of a vehicle that hunts, and how its poles go there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

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
from .models import linear_track
from .rolling import LinearContacts
from .rolling_pair import compliance_of, places_on, rails_of, vehicle_of
from .running import BEYOND, FIRST, SPEEDS, OnRails, Rolling

KMH = 3.6
POINTS = 120
HIGHEST = 15.0  # Hz: bodies on their suspensions, far below wheelsets on their contacts


@dataclass(frozen=True, kw_only=True)
class Way:
    """A vehicle on its rails, for any conicity.

    Attributes
    ----------
    body : Multibody
        Whose wheels, static loads and axles.
    vehicle : StateSpace
        How it moves.
    gravity : Gravity
        See `critical_speed`.
    rails : callable or None
        Compliance of the rails under the wheels at a frequency in Hz, in the order of the ports.
        None: rails that do not move.
    """

    body: Multibody
    vehicle: StateSpace
    gravity: Gravity
    rails: Callable[[float], ComplexArray] | None

    @property
    def track(self) -> str:
        """In words."""
        return "rigid rails" if self.rails is None else "a flexible track"

    def on(self, conicity: float) -> OnRails:
        """With wheels of a conicity."""
        cones = cones_of(self.body, conicity, self.gravity.value)
        return OnRails(Rolling(self.vehicle, LinearContacts.of(self.body, cones)), self.rails)


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
        Parameters; the paper's vehicle if not given.
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
        Anybody's, linearised, instead: a vehicle in space for Model Exchange, whose wheels and
        axles are those of `stock`, and whose loads are its own; a track in space.
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
    train = train_of(stock or Vehicle())
    check_cones(train)
    body = build_multibody(train, SPATIAL)
    if vehicle_fmu is None:
        x = body.wheelset_x - body.wheelset_x[-1]
        vehicle = linear_of(vehicle_body(body).at(x), "vehicle")
    else:
        vehicle, body = vehicle_of(Path(vehicle_fmu), body, progress)
    rails: Callable[[float], ComplexArray] | None = None
    if track_fmu is not None:
        under, _ = linear_track(Path(track_fmu), places_on(Path(track_fmu), body), progress)
        rails = partial(compliance_of, under)
    elif not rigid_track:
        rails = partial(rails_of, track or Track(), body.wheelset_x)
    return Way(body=body, vehicle=vehicle, gravity=gravity, rails=rails)


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
