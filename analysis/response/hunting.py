"""Critical speeds of a vehicle that hunts, and how its poles go there."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from railcosim.parameters import ArgumentError
from railcosim.vehicle.hunting import critical_speed as first_growth
from railcosim.vehicle.hunting import on_rigid_rails
from railcosim.vehicle.hunting import root_locus as followed
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .vehicle_modes import Gravity

CONICITIES = (0.05, 0.1, 0.15, 0.2)
KMH = 3.6
SPEEDS = np.arange(5.0, 1000.0, 2.5) / KMH
"""Where growth is looked for, m/s: a mode that grew between two of them only would be missed."""
BEYOND = 1.5  # of the critical speed: how far the poles are followed
POINTS = 120
HIGHEST = 15.0  # Hz: bodies on their suspensions, far below wheelsets on their contacts


def critical_speed(
    stock: Vehicle | Train | None = None,
    conicity: Sequence[float] = CONICITIES,
    *,
    gravity: Gravity = Gravity.NORMALS,
    rigid_track: bool,
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
    rigid_track : bool
        Rails that do not move; the only ones so far.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``conicity``: ``critical_speed`` (km/h) and ``frequency`` (Hz); nan where nothing grows
        up to 1000 km/h.

    Raises
    ------
    ArgumentError
        If the track is to be flexible, or a conicity is not between 0 and 1.
    ArithmeticError
        If something grows at 5 km/h already.
    """
    if not rigid_track:
        raise ArgumentError(
            "rigid_track", None, "is needed: rails that move are not built into critical speeds yet"
        )
    for one in conicity:
        if not 0 < one <= 1:
            raise ArgumentError(
                "conicity", float(one), "must be above 0 and at most 1: cylinders do not hunt"
            )
    body = build_multibody(stock or Vehicle(), SPATIAL)
    found = []
    for k, one in enumerate(conicity):
        progress(k, len(conicity))
        found.append(first_growth(on_rigid_rails(body, one, gravity.value), SPEEDS))
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
            "title": "critical speed on rigid rails, linear",
            "gravity": gravity.value,
            "creep": "Kalker, linear; spins as gyroscopes",
        },
    )  # fmt: skip


def root_locus(
    stock: Vehicle | Train | None,
    conicity: float,
    highest_speed: float,
    *,
    gravity: Gravity = Gravity.NORMALS,
) -> xr.Dataset:
    """Poles of a vehicle on rigid rails below 15 Hz, followed over the speed.

    Parameters
    ----------
    stock, conicity, gravity
        See `critical_speed`.
    highest_speed : float
        m/s.

    Returns
    -------
    Dataset
        Over ``speed`` (km/h) and ``mode``: ``growth`` (1/s) and ``frequency`` (Hz).
    """
    body = build_multibody(stock or Vehicle(), SPATIAL)
    speeds = np.linspace(SPEEDS[0], highest_speed, POINTS)
    poles = followed(on_rigid_rails(body, conicity, gravity.value), speeds.tolist(), HIGHEST)
    over = ("speed", "mode")
    return xr.Dataset(
        {
            "growth": (over, poles.real, {"units": "1/s"}),
            "frequency": (over, poles.imag / (2 * np.pi), {"units": "Hz"}),
        },
        {"speed": ("speed", KMH * speeds, {"units": "km/h"})},
        {"conicity": conicity, "gravity": gravity.value},
    )
