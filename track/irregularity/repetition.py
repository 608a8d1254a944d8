"""A profile that is shorter than the run, again and again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .profile import MAX_ROWS, Profile
from .usual import BLEND

SHARE = 0.25  # of a profile that is blended, at most
ROUNDING = 1e-9  # of a profile: a sample so near the end of the blend is there
MEETS = 1e-3  # of the range: ends no farther apart meet


def repeated(profile: Profile, length: float) -> Profile:
    """A profile repeated until it is at least `length` (m) long.

    Where its ends meet, without a jump and with no sharper a bend than it has elsewhere, it is
    repeated as it is. Otherwise its end is blended into its beginning, over 10 m or a quarter of
    it: there the weight of the one falls and that of the other rises as half a cosine, and the
    period is shorter by that length. The first time the beginning is met as it is.

    Parameters
    ----------
    profile : Profile
        Of any length.
    length : float
        m.

    Raises
    ------
    ParameterError
        If there would be too many samples.
    """
    if profile.length >= length:
        return profile
    blend = 0.0 if _closed(profile) else min(BLEND, SHARE * profile.length)
    period = profile.length - blend
    times = math.ceil((length - blend) / period)
    if times * profile.x.size > MAX_ROWS:
        raise ParameterError(
            f"irregularity {profile.name}: {times} times {profile.x.size} rows to cover "
            f"{length:g} m; at most {MAX_ROWS} rows"
        )
    at = profile.x - profile.x[0]
    z = np.stack(list(profile.rails.values()))
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - heavy

    begin = CubicSpline(at, z, axis=1)(np.maximum(at - period, 0))
    turn = z + _weight(at - period, blend) * (begin - z)
    # One turn from the end of the blend in the beginning to the sample before that in the end.
    first = at < blend - ROUNDING * profile.length
    once = ~first
    once[-1] = False
    shifts = period * np.arange(times)
    places = (at[once] + shifts[:, None]).ravel()
    x = np.concatenate([at[first], places, [blend + times * period]])
    ends = np.concatenate([z[:, first], np.tile(turn[:, once], times), turn[:, -1:]], axis=1)
    note = f"repeated every {period:g} m" + (f", blended over {blend:g} m" if blend else "")
    longer = profile.with_rails(x, dict(zip(profile.rails, ends, strict=True)))
    return replace(longer, name=f"{profile.name}, {note}", recipe=f"{profile.digest}, {note}")


def _closed(profile: Profile) -> bool:
    """Whether the end is where the beginning is, and no bend there is the sharpest."""
    z = np.stack(list(profile.rails.values()))
    if np.abs(z[:, -1] - z[:, 0]).max() > MEETS * np.ptp(z):
        return False
    slope = np.diff(z) / np.diff(profile.x)
    bends, seam = np.abs(np.diff(slope)), np.abs(slope[:, 0] - slope[:, -1])
    return bool((seam <= bends.max(axis=1)).all())


def _weight(into: FloatArray, blend: float) -> FloatArray:
    """Of the beginning, at distances into the blend."""
    if blend == 0:
        return np.zeros_like(into)
    weight: FloatArray = 0.5 - 0.5 * np.cos(np.pi * np.clip(into / blend, 0, 1))
    return weight
