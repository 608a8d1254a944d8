"""Decay rates of a track by EN 15461, in third octaves, from receptances and from waves."""

from __future__ import annotations

import numpy as np
import xarray as xr

from railcosim.master.component import FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.ports import Direction, Y, Z
from railcosim.parameters import ArgumentError, ParameterError
from railcosim.track.decay_rate import OF_SUM, distances, rate, responses, slowest
from railcosim.track.parameters import Track
from railcosim.track.stack import check_directions

LINES = 24  # in a third octave, evenly
FIRST, LAST = 10, 40  # bands: 10^(n / 10) Hz, of which 20 is 100 Hz and 37 is 5 kHz
LIMITS = {
    "vertical": (2.0, 2.0, 6.0, 6.0, 6.0, 2.19, *[0.8] * 8),
    "lateral": (2.04, 1.38, 0.94, 0.64, 0.43, 0.29, 0.2, 0.2, 0.32, *[0.5] * 5),
}
"""Least rates of a track for pass-by tests, dB/m, from 250 Hz on: ISO 3095:2013, Figure 3."""
FIRST_LIMIT = 24  # 250 Hz


def track_decay_rate(
    track: Track,
    lowest: float = 100.0,
    highest: float = 5000.0,
    *,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Decay rates of the rail of a track without end, as a hammer test would give them.

    Parameters
    ----------
    track : Track
        Parameters. Its elements are made as fine as the highest frequency asks for.
    lowest, highest : float
        Hz, in the first and in the last third octave.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``frequency``, centres of third octaves (Hz), in dB/m, for ``vertical`` and, of a track
        that moves aside, ``lateral``: the rate by the standard's grid, ``.wave`` of the slowest
        wave, ``.drop`` (dB)
        from the accelerometer to the farthest place (10 dB are asked for), ``.limit`` of ISO 3095.
        The attribute ``least_measurable`` is 4.343 / x_max: a rate of less than twice as much is
        an upper bound (clause 7).

    Raises
    ------
    ArgumentError
        If there is no such band, or the last is below the first.

    References
    ----------
    EN 15461:2008+A1:2010. ISO 3095:2013, Figure 3.
    """
    band = bands_of(lowest, highest, FIRST)
    centre = 10 ** (band / 10)
    omega, x = 2 * np.pi * lines_of(centre), distances(track)
    axis = ("frequency", centre, {"units": "Hz", "long_name": "centre of the third octave"})
    result = xr.Dataset(coords={"frequency": axis})
    names = _names(track)
    for k, (name, direction) in enumerate(names.items()):

        def share(done: float, total: float, k: int = k) -> None:
            progress(k + 0.7 * done / total, len(names))

        mobility = omega[:, None] * responses(track, omega, direction, share)
        squared = (np.abs(mobility) ** 2).reshape(band.size, LINES, x.size).mean(axis=1)
        wave = slowest(track, omega, direction).reshape(band.size, LINES).mean(axis=1)
        rates = {"units": "dB/m", "long_name": f"{name} decay rate, EN 15461"}
        drop = 10 * np.log10(squared[:, 0] / squared[:, -1])
        result[name] = "frequency", rate(squared, x), rates
        result[f"{name}.wave"] = "frequency", wave, {**rates, "long_name": f"{name}, slowest wave"}
        result[f"{name}.drop"] = "frequency", drop, {"units": "dB", "long_name": "to the farthest"}
        limit = {**rates, "long_name": f"{name}, least for pass-by tests, ISO 3095"}
        result[f"{name}.limit"] = "frequency", _limits(name, band), limit
        progress(k + 1, len(names))
    result.attrs = {
        "title": "decay rates of the track (EN 15461)",
        "least_measurable": OF_SUM / float(x[-1]),
        "farthest": float(x[-1]),
    }
    return result


def lines_of(centre: FloatArray, count: int = LINES) -> FloatArray:
    """Frequencies of so many lines in each third octave, evenly, Hz; of centres, also nominal."""
    band = np.round(10 * np.log10(centre))
    low, high = 10 ** ((band - 0.5) / 10), 10 ** ((band + 0.5) / 10)
    within = (np.arange(count) + 0.5) / count
    return np.asarray(low[:, None] + (high - low)[:, None] * within).ravel()


def _names(track: Track) -> dict[str, Direction]:
    """Directions in which it moves."""
    try:
        check_directions(track, [Y])
    except ParameterError:  # layers without lateral stiffness
        return {"vertical": Z}
    return {"vertical": Z, "lateral": Y}


def bands_of(lowest: float, highest: float, first: int) -> FloatArray:
    """Numbers n of the bands 10^(n / 10) Hz from one frequency to another, `first` to `LAST`."""
    ends = [round(10 * np.log10(f)) if 0 < f < np.inf else -99 for f in (lowest, highest)]
    if not first <= ends[0] <= ends[1] <= LAST:
        raise ArgumentError(
            "bands", f"{lowest:g}:{highest:g}",
            f"needs {10 ** (first / 10):g} <= lowest <= highest <= {10 ** (LAST / 10):g} Hz",
        )  # fmt: skip
    return np.arange(ends[0], ends[1] + 1, dtype=np.float64)


def _limits(name: str, band: FloatArray) -> FloatArray:
    known = dict(enumerate(LIMITS[name], FIRST_LIMIT))
    return np.array([known.get(int(n), np.nan) for n in band])
