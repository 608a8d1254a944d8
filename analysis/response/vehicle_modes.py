"""Eigenmodes of a vehicle on held wheels, on contact springs, or on a flexible track."""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr

from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.track.parameters import Track
from railcosim.vehicle.eigenmodes import Oscillations, oscillations, swings
from railcosim.vehicle.mode_names import names_of_modes
from railcosim.vehicle.multibody import SPATIAL, Multibody, build_multibody
from railcosim.vehicle.on_rails import check_cones, cones_of, rolling, standing
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train, train_of

from .choices import Gravity, Wheels
from .modes_on_track import on_track

WITHOUT_DAMPERS = "natural frequency without dampers"
SIZE_OF_POLE = "size of the pole: creep and a track have no motion without damping"


def vehicle_modes(
    stock: Vehicle | Train | None = None,
    *,
    wheels: Wheels = Wheels.FIXED,
    speed: float | None = None,
    conicity: float | None = None,
    gravity: Gravity = Gravity.NORMALS,
    track: Track | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Modes of a vehicle in space, with the names the field gives them.

    Parameters
    ----------
    stock : Vehicle or Train, optional
        Parameters; the paper's vehicle if not given.
    wheels : Wheels
        FIXED: wheelsets are held. CONTACT: wheels stand on their contact springs on rigid rails.
        RAILS: on rails that give way down, across and in roll as the track does at the mode's own
        frequency, the last wheelset at a railseat.
    speed, conicity : float, optional
        m/s and the tangent of the cone's angle: wheels creep, by Kalker's linear theory. Both or
        none; not for wheels that are held.
    gravity : Gravity
        With creep: springs along the contact normals, or vertical ones and the textbook's gravity
        stiffness.
    track : Track, optional
        For RAILS; the paper's if not given.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``name``: ``undamped_frequency``, ``damped_frequency`` (Hz), ``damping_ratio``; in the
        attributes what held the wheels, and how many motions nothing holds.

    Raises
    ------
    ArgumentError
        If speed or conicity cannot be, or do not go together with each other or with `wheels`, or
        if with them the vehicle says how its wheels roll.
    ArithmeticError
        If the vehicle topples over.

    Warns
    -----
    UnusualWarning
        If the vehicle says how its wheels roll, and they do not creep.
    """
    _check(wheels, speed, conicity)
    train = train_of(stock or Vehicle())
    if speed is not None:
        check_cones(train)
    elif train.tells_rolling:
        warnings.warn(
            "[rolling] is left out: without speed and conicity wheels do not creep",
            UnusualWarning,
            stacklevel=2,
        )
    body = build_multibody(train, SPATIAL)
    about: dict[str, object] = {"wheels": wheels.value, "toppling": str(train.toppling).lower()}
    if speed is not None and conicity is not None:
        about |= {"speed": speed, "conicity": conicity, "gravity": gravity.value}
    if wheels is Wheels.FIXED:
        above = body.above
        M, C, K = (A[above, above] for A in (body.M, body.C, body.K))
        found = oscillations(M, C, K, _places(train, body)[above])
        return _dataset(body, found, speed, WITHOUT_DAMPERS, about)
    contacts = (
        standing(body)
        if speed is None or conicity is None
        else rolling(body, cones_of(body, conicity, gravity.value))(speed)
    )
    if wheels is Wheels.RAILS:
        found = on_track(body, contacts, track or Track(), progress)
        return _dataset(body, found, speed, SIZE_OF_POLE, about)
    K, C = contacts.on_rigid_rails(body)
    M, C, K = body.M, body.C + C, body.K + K
    if speed is None:
        found = oscillations(M, C, K, _places(train, body))
        return _dataset(body, found, speed, WITHOUT_DAMPERS, about)
    return _dataset(body, swings(M, C, K), speed, SIZE_OF_POLE, about)


def _check(wheels: Wheels, speed: float | None, conicity: float | None) -> None:
    if (speed is None) != (conicity is None):
        given, other = ("speed", "conicity") if conicity is None else ("conicity", "speed")
        raise ArgumentError(given, None, f"wheels creep by both: give --{other} as well")
    if speed is not None and wheels is Wheels.FIXED:
        raise ArgumentError(
            "wheels", wheels.value,
            f"wheels that are held do not creep; take {Wheels.CONTACT} or {Wheels.RAILS}, or leave "
            "out --speed and --conicity",
        )  # fmt: skip
    if speed is not None and not 0 < speed < np.inf:
        raise ArgumentError("speed", float(speed), "must be above 0 m/s for creep")
    if conicity is not None and not 0 <= conicity <= 1:
        raise ArgumentError(
            "conicity", float(conicity), "must be from 0 to 1: of a cylinder, of a flange"
        )


def _places(train: Train, body: Multibody) -> np.ndarray:
    """Where the body of each coordinate is along the track, m."""
    place = dict(zip(body.names, (b.place[0] for b in train.parts().bodies), strict=True))
    return np.array([place[name.rpartition(".")[0]] for name in body.coordinates])


def _dataset(
    body: Multibody,
    found: Oscillations,
    speed: float | None,
    undamped: str,
    about: dict[str, object],
) -> xr.Dataset:
    modes = found.modes
    count = modes[0].shape.size if modes else 0
    names = names_of_modes(
        body.coordinates[:count],
        np.diag(body.M)[:count],
        [mode.shape for mode in modes],
        [mode.damped for mode in modes],
        speed,
    )
    hertz = 1 / (2 * np.pi)
    return xr.Dataset(
        {
            "undamped_frequency": (
                "name", [hertz * mode.undamped for mode in modes],
                {"units": "Hz", "long_name": undamped},
            ),
            "damped_frequency": (
                "name", [hertz * mode.damped for mode in modes],
                {"units": "Hz", "long_name": "frequency at which it swings; 0: it does not"},
            ),
            "damping_ratio": (
                "name", [mode.damping_ratio for mode in modes],
                {"units": "1", "long_name": "below 0: it grows"},
            ),
        },
        {"name": ("name", names)},
        {"title": "modes of the vehicle", "free_motions": found.free, **about},
    )  # fmt: skip
