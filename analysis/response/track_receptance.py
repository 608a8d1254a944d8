"""Receptance of the rail from the finite elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from railcosim.analysis.pair.standing import FARTHEST
from railcosim.master.component import FloatArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, direct_receptance, infinite_receptance
from railcosim.track.transition import Line, line_receptance

from .frf import check_finite
from .receptance import receptance_dataset
from .track_words import direction_of, place_of


def track_receptance(
    track: Track,
    frequency: FloatArray,
    *,
    direction: str = "z",
    response: str = "z",
    position: str | float = "railseat",
    offset: float = 0.0,
    both_rails: bool = True,
    ring: bool = False,
    changes: Sequence[LocalChange] = (),
    progress: Progress = unheard,
) -> xr.Dataset:
    """Receptance of the left rail at the place of the load, from the finite elements.

    Parameters
    ----------
    track : Track
        Parameters.
    frequency : array, shape (n,)
        Hz.
    direction, response : str
        Of the load and of the motion, at the head: ``z`` (down), ``y`` (to the right), ``roll``
        (about the forward axis: the right side down). z for z is the vertical model's, all others
        are of the spatial one.
    position : str or float
        ``railseat``, ``midspan``, or m along the track from where a cell begins.
    offset : float
        Of load and response from the middle of the head towards the track's centre, m.
    both_rails : bool
        The same unit load on each rail, or on the left one.
    ring : bool
        Of the ring of cells that the FMUs have, or of a track without end.
    changes : sequence of LocalChange
        What is different at single places.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        ``receptance``, complex. The attributes ``ring_error`` and ``ring_error_at`` say by how much
        the ring differs from the track without end, at most, and at what frequency (Hz).

    Raises
    ------
    ArgumentError
        If there is no such direction or place.
    """
    x = place_of(track, position)
    loaded, seen = direction_of("direction", direction), direction_of("response", response)
    side, right = (BOTH, -offset) if both_rails else (-1, offset)
    loads = [Point(x=x, side=side, direction=loaded, offset=right)]
    here = Point(x=x, direction=seen, offset=offset)
    solved = []
    for k, receptance_of in enumerate((infinite_receptance, direct_receptance)):

        def half(done: float, total: float, k: int = k) -> None:
            progress(k + done / total, 2)

        found = receptance_of(track, 2 * np.pi * frequency, loads, [here], half, changes=changes)
        solved.append(found[:, 0, 0])
    endless, round_ = solved
    off = np.abs(round_ - endless)
    error = np.divide(off, np.abs(endless), out=np.zeros_like(off), where=off > 0)
    worst = int(np.argmax(error))
    about = {
        "motion": f"{seen.name} for {loaded.name}",
        "at": f"{x:g} m along the track, from where a cell begins ({position})",
        "load": "both" if both_rails else "single",
        "track": f"{ring_of(track)}" if ring else "endless",
        **({"changed": ", ".join(map(str, changes))} if changes else {}),
    }
    unit = f"{seen.motion}/{f'({loaded.force})' if '.' in loaded.force else loaded.force}"
    worst_of_ring = {"ring_error": float(error[worst]), "ring_error_at": float(frequency[worst])}
    where = f"{position} ({x:g} m)" if str(position).isalpha() else f"{x:g} m"
    title = [
        f"rail {seen.positive.partition(',')[0]}",
        f"load {loaded.positive.partition(',')[0]} at {where}",
        "both rails" if both_rails else "one rail",
        about["track"],
        *([about["changed"]] if changes else []),
    ]
    about = {"title": ", ".join(title), **about}
    asked = {
        "direction": loaded.name, "response": seen.name, "offset": offset, "position": position,
    }  # fmt: skip
    values = round_ if ring else endless
    return receptance_dataset(frequency, values, unit, {**about, **asked, **worst_of_ring})


def transition_receptance(
    line: Line,
    frequency: FloatArray,
    *,
    position: float | Sequence[float],
    both_rails: bool = True,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Receptance of the left rail where it is loaded, on tracks of several kinds that are joined.

    Parameters
    ----------
    line : Line
        The tracks.
    frequency : array, shape (n,)
        Hz; 0 is the static flexibility.
    position : float or sequence of float
        m along the line.
    both_rails : bool
        The same unit load on each rail, or on the left one.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        ``receptance``, complex, over frequency; over position and frequency of several positions.
    """
    along = np.atleast_1d(np.asarray(position, dtype=float))
    if not (np.abs(along) <= FARTHEST).all():
        raise ArgumentError("position", position, f"must be from -{FARTHEST:g} to {FARTHEST:g} m")
    found = np.empty((along.size, frequency.size), complex)
    for k, x in enumerate(along):

        def part(done: float, total: float, k: int = k) -> None:
            progress(k + done / total, along.size)

        load = Point(x=float(x), side=BOTH if both_rails else -1)
        here = [Point(x=float(x))]
        found[k] = line_receptance(line, 2 * np.pi * frequency, [load], here, part)[:, 0, 0]
    first, *others = line.names
    told = ", ".join(f"{name} from {x:g} m" for name, x in zip(others, line.joints, strict=True))
    about = {"load": "both" if both_rails else "single", "track": f"{first}, then {told}"}
    if np.ndim(position):
        check_finite(frequency, found)
        return xr.Dataset(
            {"receptance": (("position", "frequency"), found,
                            {"units": "m/N", "long_name": "receptance"})},
            {"position": ("position", along, {"units": "m", "long_name": "along the track"}),
             "frequency": ("frequency", frequency, {"units": "Hz", "long_name": "frequency"})},
            about,
        )  # fmt: skip
    where = f"{along[0]:g} m along the track"
    rails = "both rails" if both_rails else "one rail"
    title = f"rail down, load down at {where}, {rails}, {about['track']}"
    about |= {"title": title, "at": where}
    return receptance_dataset(frequency, found[0], "m/N", {**about, "position": float(along[0])})


def ring_of(track: Track) -> str:
    """The ring of the FMUs, in words."""
    return f"ring of {track.mesh.cells} cells, {track.length:g} m"
