"""How much a little more of each parameter moves the resonances: d f / d ln p."""

from __future__ import annotations

import numpy as np
import xarray as xr

from railcosim.master.progress import Progress, unheard
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

from .choices import Subject
from .free_motions import Slopes, Stock, of_pair, of_track, of_vehicle


def sensitivities(
    subject: Subject | str = Subject.PAIR,
    stock: Stock | None = None,
    track: Track | None = None,
    *,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Derivatives of resonances by the logarithms of all parameters.

    Parameters
    ----------
    subject : Subject or str
        ``vehicle``: in space, its wheels held. ``track``: where its waves begin and between
        railseats, without damping, as `railcosim.track_modes` has them. ``pair``: vertical, on
        Hertz's springs at the static loads on a track without end, the last wheelset at a railseat.
    stock, track : Vehicle or Train, Track, optional
        Parameters; the paper's if not given.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        Over ``name`` (of resonances): ``frequency`` (Hz), ``damping_ratio``; over ``parameter``
        and ``name``: ``frequency_slope``, d f / d ln p (Hz), and ``damping_slope``,
        d zeta / d ln p. Left out are parameters that are 0, whole numbers, and geometry that the
        mesh depends on.

    Raises
    ------
    ArithmeticError
        If the vehicle topples over, or no resonance of the pair is found.
    """
    stock, track = stock or Vehicle(), track or Track()
    parts = {
        Subject.VEHICLE: lambda: of_vehicle(stock, progress),
        Subject.TRACK: lambda: of_track(track, progress),
        Subject.PAIR: lambda: of_pair(stock, track, progress),
    }
    return _dataset(Subject(subject), parts[Subject(subject)]())


def _dataset(subject: Subject, parts: Slopes) -> xr.Dataset:
    resonances = [one for some, _ in parts for one in some]
    s = np.array([one.pole for one in resonances])
    keys = list(dict.fromkeys(key for _, by in parts for key in by))
    rows = np.concatenate(
        [np.array([by.get(key, np.zeros(len(some))) for key in keys]).reshape(len(keys), -1)
         for some, by in parts], axis=1,
    )  # fmt: skip
    order = np.argsort(np.abs(s))
    s, rows = s[order], rows[:, order]
    size = np.abs(s)
    by_size = (s.conj() * rows).real / size
    # zeta = -Re s / |s|.
    damping = -rows.real / size + s.real / size**2 * by_size
    over = ("parameter", "name")
    felt = np.abs(rows).max(axis=1, initial=0.0) > 0
    return xr.Dataset(
        {
            "frequency": ("name", s.imag / (2 * np.pi), {"units": "Hz"}),
            "damping_ratio": ("name", -s.real / size, {"units": "1"}),
            "frequency_slope": (
                over, rows[felt].imag / (2 * np.pi),
                {"units": "Hz", "long_name": "d f / d ln p"},
            ),
            "damping_slope": (
                over, damping[felt], {"units": "1", "long_name": "d zeta / d ln p"}
            ),
        },
        {
            "name": ("name", np.array([resonances[i].name for i in order])),
            "parameter": ("parameter", np.array(keys)[felt]),
        },
        {"title": f"sensitivities of the resonances of the {subject.value}"},
    )  # fmt: skip
