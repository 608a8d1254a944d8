"""Critical speeds of a vehicle that hunts, and how its poles go there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.mechanics.ports import ROLL, Y, Z
from railcosim.parameters import ArgumentError
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, infinite_receptance
from railcosim.vehicle.hunting import Critical, Matrices, on_rails, on_rigid_rails
from railcosim.vehicle.hunting import critical_speed as first_growth
from railcosim.vehicle.hunting import root_locus as followed
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.on_rails import check_cones
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .choices import CONICITIES, Gravity

KMH = 3.6
SPEEDS = np.arange(5.0, 1001.0, 2.5) / KMH
"""Where growth is looked for, m/s: a mode that grew between two of them only would be missed."""
BEYOND = 1.5  # of the critical speed: how far the poles are followed
POINTS = 120
FIRST = 3.0  # Hz: where hunting is looked for if there is none on rigid rails
NEAR = np.array([0.8, 0.9, 1.0, 1.1, 1.2])  # of a speed that is almost the critical one
ALIKE = 1e-3  # of the frequency: a tenth of it changes the speed by 1e-4
MOST_ROUNDS = 8
HIGHEST = 15.0  # Hz: bodies on their suspensions, far below wheelsets on their contacts


@dataclass(frozen=True, kw_only=True)
class Way:
    """A vehicle on its rails, for any conicity.

    Attributes
    ----------
    body : Multibody
        The vehicle.
    gravity : Gravity
        See `critical_speed`.
    track : Track or None
        None: rails that do not move.
    """

    body: Multibody
    gravity: Gravity
    track: Track | None

    @property
    def rails(self) -> str:
        """In words."""
        return "rigid rails" if self.track is None else "a flexible track"

    def critical(self, conicity: float) -> Critical:
        """Where growth begins."""
        found = first_growth(self.matrices(conicity, None), SPEEDS)
        if self.track is None:
            return found
        frequency = found.frequency if found.frequency > 0 else FIRST
        speeds = SPEEDS[BEYOND * found.speed > SPEEDS]
        for _ in range(MOST_ROUNDS):
            matrices = self.matrices(conicity, frequency)
            found = first_growth(matrices, speeds)
            if not found.speed > 0:  # then it is not where it was looked for
                found = first_growth(matrices, SPEEDS)
            if not found.speed > 0 or abs(found.frequency - frequency) <= ALIKE * frequency:
                return found
            # The track at another frequency is almost the same.
            frequency, speeds = found.frequency, found.speed * NEAR
        raise ArithmeticError(
            "the frequency at which the vehicle hunts does not settle in "
            f"{MOST_ROUNDS} rounds, last {found.frequency:g} Hz at {KMH * found.speed:g} km/h; see "
            "what it does on rigid rails"
        )

    def matrices(self, conicity: float, frequency: float | None) -> Callable[[float], Matrices]:
        """M, C and K by the speed, on rails as they give way at a frequency, Hz; None: rigid."""
        if self.track is None or frequency is None:
            return on_rigid_rails(self.body, conicity, self.gravity.value)
        compliance = rails_of(self.track, self.body.wheelset_x, frequency)
        return on_rails(self.body, conicity, self.gravity.value, compliance)


def rails_of(track: Track, wheelset_x: FloatArray, frequency: float) -> ComplexArray:
    """Compliance of the rails under each wheelset, `Contacts.with_rails`, of an endless track.

    The last wheelset stands in the middle between two railseats.
    """
    x = wheelset_x - wheelset_x[-1] + track.fastening.spacing / 2
    points = [
        Point(x=float(place), side=side, direction=direction)
        for place in x
        for side in (-1, 1)
        for direction in (Y, Z, ROLL)
    ]
    omega = np.array([2 * np.pi * frequency])
    compliance: ComplexArray = infinite_receptance(track, omega, points, points)[0]
    return compliance


def critical_speed(
    stock: Vehicle | Train | None = None,
    conicity: Sequence[float] = CONICITIES,
    *,
    gravity: Gravity = Gravity.NORMALS,
    track: Track | None = None,
    rigid_track: bool = False,
    progress: Callable[[float, float], None] = lambda done, total: None,
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
    ArithmeticError
        If no frequency is found at which vehicle and track hunt.
    """
    if rigid_track and track is not None:
        raise ArgumentError("rigid_track", None, "rails that do not move have no track; give one")
    for one in conicity:
        if not 0 < one <= 1:
            raise ArgumentError(
                "conicity", float(one), "must be above 0, as cylinders do not hunt, and at most 1"
            )
    way = way_of(stock, gravity, track, rigid_track=rigid_track)
    found = []
    for k, one in enumerate(conicity):
        progress(k, len(conicity))
        try:
            found.append(way.critical(one))
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
            "title": f"critical speed on {way.rails}, linear",
            "gravity": gravity.value,
            "creep": "Kalker, linear; spins as gyroscopes",
        },
    )  # fmt: skip


def way_of(
    stock: Vehicle | Train | None, gravity: Gravity, track: Track | None, *, rigid_track: bool
) -> Way:
    """A vehicle on its rails; see `critical_speed`."""
    train = train_of(stock or Vehicle())
    check_cones(train)
    body = build_multibody(train, SPATIAL)
    return Way(body=body, gravity=gravity, track=None if rigid_track else track or Track())


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
        What `Way.critical` found.

    Returns
    -------
    Dataset
        Over ``speed`` (km/h) and ``mode``: ``growth`` (1/s) and ``frequency`` (Hz).
    """
    known = critical.speed > 0
    to = min(BEYOND * critical.speed, SPEEDS[-1]) if known else SPEEDS[-1]
    speeds = np.linspace(SPEEDS[0], to, POINTS)
    matrices = way.matrices(conicity, critical.frequency if known else FIRST)
    poles = followed(matrices, speeds.tolist(), HIGHEST)
    over = ("speed", "mode")
    return xr.Dataset(
        {
            "growth": (over, poles.real, {"units": "1/s"}),
            "frequency": (over, poles.imag / (2 * np.pi), {"units": "Hz"}),
        },
        {"speed": ("speed", KMH * speeds, {"units": "km/h"})},
        {"conicity": conicity, "gravity": way.gravity.value},
    )
