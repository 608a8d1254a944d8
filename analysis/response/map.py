"""Responses to irregularity over the plane of its wavelength and the speed, and critical speeds."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.response.critical import Critical, critical_points
from railcosim.analysis.response.frequency import coupled, on_rigid_track
from railcosim.analysis.response.models import Models, linear_models
from railcosim.analysis.response.plane import Transfer, plane, plane_dataset, transfer
from railcosim.analysis.response.resonance import resonance
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.memory import afford
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.ports import Layout

BODIES = ("carbody.z", "carbody.pitch", "bogie[1].z", "bogie[1].pitch", "bogie[2].z",
          "bogie[2].pitch")  # fmt: skip
LEFT = Layout().wheels[: Layout().wheelsets]
OUTPUTS = (
    *(f"vehicle.{name}" for name in BODIES),
    *(f"vehicle.{w}.wheel_z" for w in LEFT),
    *(f"track.{w}.rail_z" for w in LEFT),
)
NAMES = tuple(name.partition(".")[2] for name in OUTPUTS)
"""What a map shows; on rigid track, without the rails, with ``.rigid`` behind."""
MODES = {"car body bounce": "carbody.z", "car body pitch": "carbody.pitch"}
# Hz and points: where a car body may stand on its springs. What it does is largest at its own
# resonance, whatever the vehicle; those of the bogies below it are a fraction of that.
RANGE = (0.05, 20.0, 800)
ORDERS = (1, 2, 3)
MARGIN = 1e-3  # of the ends of the table, which may be one frequency
BYTES = 48  # for each value: complex, and both its parts as they are written


@dataclass(frozen=True)
class CriticalSpeed:
    """A critical point, and the response there.

    Attributes
    ----------
    point : Critical
        Mode, wavelength, frequency, speed.
    track : str
        ``flexible`` or ``rigid``.
    response : float
        Of the mode, per m of irregularity; NaN outside the map.
    """

    point: Critical
    track: str
    response: float


@dataclass(frozen=True)
class ResponseMap:
    """A map.

    Attributes
    ----------
    dataset : Dataset
        Complex responses over ``wavelength`` (m) and ``speed`` (m/s); see `NAMES`.
    critical : list of CriticalSpeed
        Critical speeds of the car body, on flexible track first.
    """

    dataset: xr.Dataset
    critical: list[CriticalSpeed]

    def critical_on(self, track: str) -> list[Critical]:
        """Critical points on ``flexible`` or on ``rigid`` track."""
        return [speed.point for speed in self.critical if speed.track == track]


def response_map(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    wavelength: FloatArray,
    speed: FloatArray,
    *,
    contact_stiffness: float = 1e9,
    position: Position = None,
    progress: Progress = unheard,
) -> ResponseMap:
    """Responses to irregularity which every wheelset meets with its lag, and critical speeds.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces.
    wavelength, speed : array
        Increasing, m and m/s.
    contact_stiffness : float
        k_H, N/m.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    progress : callable
        Told what is done and the total.

    Raises
    ------
    TooLargeError
        If there is no memory for that many points; see `afford_map`.
    CouplingError
        If the vehicle is no car body on two bogies of two wheelsets.
    """
    afford_map(wavelength.size, speed.size)
    rails = Path(track)
    cars = files_of(vehicle)
    models = linear_models(cars, rails, progress, position)
    known = {v.name for v in models.vehicle.outputs}
    if not known.issuperset(BODIES) or len(models.positions) != len(LEFT):
        raise CouplingError(
            f"{', '.join(map(str, cars))}: a map shows one car body on two bogies of two wheelsets "
            f"each; this has {len(models.positions)} wheelsets, or other bodies"
        )
    k_H, least, most = contact_stiffness, speed[0] / wavelength[-1], speed[-1] / wavelength[0]
    check_frequencies_of(rails, float(most))
    ends = least * (1 - MARGIN), most * (1 + MARGIN)
    on_track = [o for o in OUTPUTS if o.startswith("vehicle.")]
    tables = {
        "flexible": transfer(lambda w: coupled(models, w, k_H), OUTPUTS, *ends),
        "rigid": transfer(lambda w: on_rigid_track(models, w, k_H), on_track, *ends),
    }
    result = _dataset(
        tables,
        models,
        wavelength,
        speed,
        contact_stiffness=k_H,
        wheelset_positions=models.positions,
    )
    critical = [
        CriticalSpeed(point, kind, _size(table, models, point))
        for kind, table in tables.items()
        for point in _critical(models, kind, k_H)
    ]
    return ResponseMap(result, critical)


def afford_map(wavelengths: int, speeds: int) -> None:
    """Raise TooLargeError if there is no memory for that many wavelengths at that many speeds."""
    afford(
        BYTES * (len(OUTPUTS) + len(BODIES) + len(LEFT)) * wavelengths * speeds,
        f"{wavelengths} wavelengths at {speeds} speeds",
        "take fewer --wavelengths or --speeds",
    )


def _dataset(
    tables: dict[str, Transfer],
    models: Models,
    wavelength: FloatArray,
    speed: FloatArray,
    **attributes: object,
) -> xr.Dataset:
    """Variables ``name`` on flexible track and ``name.rigid`` on rigid track."""
    parts: dict[str, xr.DataArray] = {}
    for kind, table in tables.items():
        units = ["rad" if o.endswith("pitch") else "m" for o in table.outputs]
        part = plane_dataset(table, models.positions, wavelength, speed, units)
        suffix = "" if kind == "flexible" else ".rigid"
        parts |= {f"{name}{suffix}": part[name] for name in part}
    return xr.Dataset(parts, attrs={**models.attributes, **attributes})


def _critical(models: Models, kind: str, k_H: float) -> list[Critical]:
    """Critical points with the resonances of this track, from the response to a wheelset."""
    found = []
    frequency = np.geomspace(*RANGE)
    omega = 2 * np.pi * frequency
    rigid = kind == "rigid"
    system = on_rigid_track(models, omega, k_H) if rigid else coupled(models, omega, k_H)
    values = system.combined([f"{LEFT[-1]}.irregularity_z"], [1.0])
    for name in MODES.values():
        found.append(resonance(frequency, np.abs(values[:, system.rows([f"vehicle.{name}"])[0]])))
        if found[-1] in frequency[[0, -1]]:
            warnings.warn(
                f"{name} on {kind} track has no resonance between {RANGE[0]:g} and {RANGE[1]:g} Hz,"
                " so no critical speed is known of it", stacklevel=2,
            )  # fmt: skip
            found[-1] = np.nan
    bounce, pitch = found
    return critical_points(models.positions, bounce, pitch, ORDERS)


def _size(table: Transfer, models: Models, point: Critical) -> float:
    """The response at a critical point, per m; NaN outside the map's frequencies."""
    one = table.only(f"vehicle.{MODES[point.mode]}")
    low, high = np.exp(one.spline.x[[0, -1]])
    if not low <= point.frequency <= high:
        return np.nan
    at = np.array([point.wavelength]), np.array([point.speed])
    return float(abs(plane(one, models.positions, *at)[0, 0, 0]))
