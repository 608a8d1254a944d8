"""Single defects of rail and wheel, as profiles; down is positive."""

from __future__ import annotations

import math

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .profile import Profile

SAMPLES = 200  # over a defect: a spline is then within 1e-5 of a cosine
LEVEL = 5.0  # m of level track behind it at least


def dip(length: float, depth: float, at: float) -> Profile:
    """A dip of both rails, depth/2 (1 - cos(2 pi s / length)).

    Parameters
    ----------
    length, depth : float
        m; a negative depth is a bump.
    at : float
        Its middle, from the beginning of the profile, m.
    """
    x = _around(at, length)
    s = np.clip((x - at) / length + 0.5, 0, 1)
    z = depth / 2 * (1 - np.cos(2 * np.pi * s))
    return _profile(f"dip of {1e3 * depth:g} mm over {length:g} m", x, z)


def joint(length: float, depth: float, at: float) -> Profile:
    """A dipped joint: both rail ends bend down parabolically and meet in a kink.

    Parameters
    ----------
    length, depth : float
        Of the whole dip and at the kink, m. The angle of the kink is 8 depth / length.
    at : float
        The kink, from the beginning of the profile, m.

    References
    ----------
    Jenkins, H. H. et al. (1974), The effect of track and vehicle parameters on wheel/rail vertical
    dynamic forces, Railway Eng. J. 3(1), 2-16.
    """
    x = _around(at, length)
    z = depth * np.clip(1 - 2 * np.abs(x - at) / length, 0, 1) ** 2
    return _profile(f"joint of {1e3 * depth:g} mm over {length:g} m", x, z)


def wheel_flat(flat_length: float, wheel_radius: float, at: float, turns: int) -> Profile:
    """A rounded flat on every wheel, as the dip that the wheels' centres would follow.

    Parameters
    ----------
    flat_length, wheel_radius : float
        l and R, m. The flat is d = l^2 / (16 R) deep, and z = d/2 (1 - cos(2 pi s / l)).
    at : float
        The first time it meets the rail, from the beginning of the profile, m.
    turns : int
        How often, once every 2 pi R.

    References
    ----------
    Wu, T. X. & Thompson, D. J. (2002), A hybrid model for the noise generation due to railway wheel
    flats, J. Sound Vib. 251(1), 115-139: the rounded flat is as deep as a fresh one half as long.
    """
    depth = flat_length**2 / (16 * wheel_radius)
    places = at + 2 * np.pi * wheel_radius * np.arange(turns)
    x = np.unique(np.concatenate([_around(float(place), flat_length) for place in places]))
    s = (x[:, None] - places) / flat_length + 0.5
    z = (depth / 2 * (1 - np.cos(2 * np.pi * np.clip(s, 0, 1)))).sum(axis=1)
    return _profile(f"wheel flat of {1e3 * flat_length:g} mm", x, z)


def _profile(name: str, x: FloatArray, z: FloatArray) -> Profile:
    """Both rails alike, level beyond."""
    return Profile(name=name, x=x, left=z, right=z, level_beyond=True)


def _around(at: float, length: float) -> FloatArray:
    """Places from 0: fine over the defect and as much again on each side, coarse to both ends."""
    if not 0 < length <= 2 * at < math.inf:
        raise ParameterError(
            f"a defect of {length:g} m at {at:g} m: must be longer than 0 and begin at 0 or behind"
        )
    fine = at + np.linspace(-length, length, 2 * SAMPLES + 1)
    level = np.linspace(0.0, at + length + LEVEL, 20)
    outside = level[(level < fine[0]) | (level > fine[-1])]
    return np.unique(np.concatenate([[0.0], outside, fine[fine > 0]]))
