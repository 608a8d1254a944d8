"""Sensors of a track FMU of ours: which there are, and when they can be believed.

A ring is periodic: a sensor sees every wheel again a ring's length further on. As long as each
wheel is nearer to it than half a ring, all its images are farther away than that, and have died
away on the way as far as the ring promises.
"""

from __future__ import annotations

import json
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from railcosim.fmus.sensor_variables import ANNOTATION
from railcosim.master.component import FloatArray
from railcosim.master.fmi.archive import FmuError, read_annotations
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout
from railcosim.parameters import ArgumentError

from .ring import RING, TOOL

POSITIONS = Layout(MOST_WHEELSETS).of_axles("position")


@dataclass(frozen=True, kw_only=True)
class SensorOfFmu:
    """A sensor of a track FMU.

    Attributes
    ----------
    outputs : tuple of str
        Its variables.
    of, side, what : str
        What it is on; in words.
    at : float
        Along the track, m.
    ring : float
        Length of the ring, m.
    """

    outputs: tuple[str, ...]
    of: str
    side: str
    what: str
    at: float
    ring: float

    def is_far(self, position: FloatArray) -> NDArray[np.bool_]:
        """Whether a wheelset of those at positions, (..., n), m, is too far away."""
        return np.asarray((np.abs(position - self.at) > 0.5 * self.ring).any(axis=-1))


def sensors_of(track: Path) -> list[SensorOfFmu]:
    """The sensors of a track FMU; those of others have none.

    Raises
    ------
    FmuError
        If what it says of them makes no sense.
    """
    ring = read_annotations(track, TOOL).get(RING, {})
    if ANNOTATION not in ring:
        return []
    try:
        return [
            SensorOfFmu(
                outputs=tuple(f"{one['name']}.{name}" for name in one["quantities"]),
                of=str(one["of"]), side=str(one["side"]), what=str(one["what"]),
                at=float(one["at"]), ring=float(ring["length"]),
            )
            for one in json.loads(ring[ANNOTATION])
        ]  # fmt: skip
    except (KeyError, TypeError, ValueError) as error:
        raise FmuError(f"{track}: what it says of its sensors makes no sense: export it") from error


def outputs_of_sensors(track: Path) -> tuple[str, ...]:
    """Their names."""
    return tuple(name for sensor in sensors_of(track) for name in sensor.outputs)


def check_seen(track: Path, positions: FloatArray) -> None:
    """Refuse sensors that are too far from wheelsets that stand at positions, m.

    Raises
    ------
    ArgumentError
        With the places that can be seen.
    """
    for sensor in sensors_of(track):
        if sensor.is_far(positions):
            least, most = positions.max() - sensor.ring / 2, positions.min() + sensor.ring / 2
            raise ArgumentError(
                "sensor", f"{sensor.of}.{sensor.side}@{sensor.at:g}",
                f"is over half of the ring ({sensor.ring:g} m) away from a wheelset, nearer to its "
                f"image; must be from {least:g} to {most:g} m, or give --position",
            )  # fmt: skip


def located(shown: xr.Dataset, track: Path) -> xr.Dataset:
    """Results with what their sensors are on, and where (m), among the attributes of variables."""
    for sensor in sensors_of(track):
        for name in set(sensor.outputs) & set(map(str, shown.data_vars)):
            shown[name].attrs.update(of=sensor.of, side=sensor.side, at=sensor.at)
    return shown


def marked(run: xr.Dataset, track: Path) -> xr.Dataset:
    """A run in time with NaN where sensors cannot be believed, and where they are.

    Parameters
    ----------
    run : Dataset
        Over ``time``, with the positions of wheelsets.
    track : Path
        The FMU.

    Warns
    -----
    UserWarning
        If nothing of a sensor can.
    """
    places = [np.asarray(run[name]) for name in POSITIONS if name in run]
    if not places:
        return run
    position = np.stack(places, axis=-1)
    for number, sensor in enumerate(sensors_of(track), start=1):
        far = sensor.is_far(position)
        for name in sensor.outputs if far.any() else ():
            values = np.where(far, np.nan, np.asarray(run[name]))
            said = {"missing": "NaN where a wheelset is over half a ring away"}
            run[name] = ("time", values, run[name].attrs | said)
        if far.all():
            warnings.warn(
                f"sensor {number}, {sensor.what}: no moment of this run has all wheelsets within "
                f"half of the ring, {sensor.ring / 2:g} m; all of it is NaN",
                stacklevel=2,
            )
    return located(run, track)
