"""Responses to irregularity over the plane of its wavelength and the speed, and critical speeds."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.sensors import located, outputs_of_sensors
from railcosim.analysis.pair.standing import Position
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.receptance import Response
from railcosim.master.memory import afford
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.ports import Layout
from railcosim.track.irregularity.quantities import QUANTITIES
from railcosim.vehicle.bodies import TURNS

from .critical import Critical, critical_points
from .excitation import IRREGULARITIES, check_irregularity, is_mirrored
from .frequency import Contact, coupled, on_rigid_track
from .local_track import Local
from .meeting import Meeting, Stock, in_space, meeting_of, wheels_of
from .models import Models, linear_models
from .plane import BySpeed, Tabulated, over_plane, transfer
from .resonance import resonance

BODIES = ("carbody.z", "carbody.pitch", "bogie[1].z", "bogie[1].pitch", "bogie[2].z",
          "bogie[2].pitch")  # fmt: skip
ASIDE = (
    *(f"{body}.{d}" for body in ("carbody", "bogie[1]", "bogie[2]") for d in ("y", "roll", "yaw")),
)
LEFT = Layout().wheels[: Layout().wheelsets]


def outputs_of(*, in_space: bool) -> tuple[str, ...]:
    """What a map shows, by names in a coupled response."""
    ways = ("z", "y") if in_space else ("z",)
    return (
        *(f"vehicle.{name}" for name in BODIES + (ASIDE if in_space else ())),
        *(f"vehicle.{w}.wheel_{way}" for way in ways for w in LEFT),
        *(f"track.{w}.rail_{way}" for way in ways for w in LEFT),
    )


def names_of(*, in_space: bool) -> tuple[str, ...]:
    """The same in results; on rigid track, without the rails, with ``.rigid`` behind."""
    return tuple(name.partition(".")[2] for name in outputs_of(in_space=in_space))


FLEXIBLE = "flexible"
SYSTEMS: Mapping[str, Callable[[Models, FloatArray, Contact], Response]] = {
    FLEXIBLE: coupled,
    "rigid": on_rigid_track,
}
"""By the track."""
Plane: TypeAlias = Tabulated | BySpeed
CHECKED = 25
"""Speeds at which hunting is looked for."""
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
        Complex responses over ``wavelength`` (m) and ``speed`` (m/s); see `names_of`.
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
    irregularity: str = "vertical",
    contact_stiffness: float | None = None,
    stock: Stock = None,
    believe: bool = False,
    position: Position = None,
    local: Local | None = None,
    progress: Progress = unheard,
) -> ResponseMap:
    """Responses to irregularity which every wheelset meets with its lag, and critical speeds.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces.
    wavelength, speed : array
        Increasing, m and m/s.
    irregularity : str
        Which quantity of it, of `railcosim.track.irregularity.quantities.QUANTITIES`; FMUs that
        meet downwards only know the vertical one.
    contact_stiffness, stock
        What is between wheels and rails, see `railcosim.analysis.response.meeting.meeting_of`.
    believe : bool
        Take responses as they are of a vehicle that hunts at a speed.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    local : Local, optional
        What is different at single places of the track, of the vertical model.
    progress : callable
        Told what is done and the total.

    Raises
    ------
    TooLargeError
        If there is no memory for that many points; see `afford_map`.
    CouplingError
        If the vehicle is no car body on two bogies of two wheelsets, or there is no such quantity.
    ArithmeticError
        If the vehicle hunts at a speed, and what is asked goes aside.
    """
    rails, cars = Path(track), files_of(vehicle)
    wheels = wheels_of(cars, contact_stiffness)
    check_irregularity(irregularity, in_space=in_space(wheels))
    outputs = outputs_of(in_space=in_space(wheels))
    outputs += tuple(f"track.{name}" for name in outputs_of_sensors(rails))
    afford_map(wavelength.size, speed.size, in_space=in_space(wheels))
    models = linear_models(cars, rails, partial(_share, progress, 0.0), position)
    if local is not None:
        models = local.under(models)
    known = {v.name for v in models.vehicle.outputs}
    if not known.issuperset(BODIES) or len(models.positions) != len(LEFT):
        raise CouplingError(
            f"{', '.join(map(str, cars))}: a map shows one car body on two bogies of two wheelsets "
            f"each; this has {len(models.positions)} wheelsets, or other bodies"
        )
    check_frequencies_of(rails, float(speed[-1] / wavelength[0]))
    meeting = meeting_of(models, cars, contact_stiffness, stock)
    _check_speeds(meeting, speed, believe=believe or is_mirrored(irregularity))
    planes = {
        kind: _plane(models, meeting, kind, outputs, irregularity, wavelength, speed, progress)
        for kind in SYSTEMS
    }
    result = _dataset(
        planes, models, wavelength, speed, wheelset_positions=models.positions,
        irregularity=irregularity, **meeting.about,
    )  # fmt: skip
    critical = [
        CriticalSpeed(point, kind, _size(planes[kind], point, wavelength, speed))
        for kind in planes
        for point in _critical(models, kind, meeting.at(float(speed[-1])), irregularity)
    ]
    return ResponseMap(located(result, rails), critical)


def _plane(
    models: Models,
    meeting: Meeting,
    kind: str,
    outputs: tuple[str, ...],
    irregularity: str,
    wavelength: FloatArray,
    speed: FloatArray,
    progress: Progress,
) -> Plane:
    """Of a table, where contacts are the same at all speeds."""
    system = SYSTEMS[kind]
    wanted = tuple(o for o in outputs if kind == FLEXIBLE or o.startswith("vehicle."))
    if meeting.of_speed:
        part = list(SYSTEMS).index(kind) + 1
        return BySpeed(
            system=lambda omega, v: system(models, omega, meeting.at(v)), outputs=wanted,
            excitation=irregularity, positions=models.positions,
            progress=partial(_share, progress, part),
        )  # fmt: skip
    contact = meeting.at(float(speed[-1]))
    least, most = speed[0] / wavelength[-1], speed[-1] / wavelength[0]
    ends = least * (1 - MARGIN), most * (1 + MARGIN)
    table = transfer(lambda omega: system(models, omega, contact), wanted, *ends)
    return Tabulated(table=table, positions=models.positions)


def _share(progress: Progress, part: float, done: float, total: float) -> None:
    """Of the linear models, and of the planes."""
    progress(part + done / total, 1.0 + len(SYSTEMS))


def _check_speeds(meeting: Meeting, speed: FloatArray, *, believe: bool) -> None:
    """Some of all speeds, from the highest: hunting has no gaps so narrow."""
    chosen = np.unique(np.linspace(0, speed.size - 1, min(speed.size, CHECKED)).astype(int))
    any(meeting.check(float(v), believe=believe) for v in speed[chosen[::-1]])


def afford_map(wavelengths: int, speeds: int, *, in_space: bool = False) -> None:
    """Raise TooLargeError if there is no memory for that many wavelengths at that many speeds."""
    outputs = outputs_of(in_space=in_space)
    on_both = sum(1 + name.startswith("vehicle.") for name in outputs)
    afford(
        BYTES * on_both * wavelengths * speeds,
        f"{wavelengths} wavelengths at {speeds} speeds",
        "take fewer --wavelengths or --speeds",
    )


def _dataset(
    planes: dict[str, Plane],
    models: Models,
    wavelength: FloatArray,
    speed: FloatArray,
    **attributes: object,
) -> xr.Dataset:
    """Variables ``name`` on flexible track and ``name.rigid`` on rigid track."""
    rails = () if models.track is None else models.track.outputs
    seen = {f"track.{v.name}": v.unit for v in rails}
    parts: dict[str, xr.DataArray] = {}
    for kind, of in planes.items():
        units = [
            seen.get(o) or ("rad" if o.rpartition(".")[2] in TURNS else "m") for o in of.outputs
        ]
        part = over_plane(of.outputs, of.over(wavelength, speed), wavelength, speed, units)
        suffix = "" if kind == FLEXIBLE else ".rigid"
        parts |= {f"{name}{suffix}": part[name] for name in part}
    return xr.Dataset(parts, attrs={**models.attributes, **attributes})


def _critical(models: Models, kind: str, contact: Contact, irregularity: str) -> list[Critical]:
    """Critical points with the resonances of this track, from the response to a wheelset.

    They are those of what a vertical irregularity moves.
    """
    if IRREGULARITIES[irregularity] is not QUANTITIES["vertical"]:
        return []
    found = []
    frequency = np.geomspace(*RANGE)
    system = SYSTEMS[kind](models, 2 * np.pi * frequency, contact)
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


def _size(of: Plane, point: Critical, wavelength: FloatArray, speed: FloatArray) -> float:
    """The response at a critical point, per m; NaN outside the map's frequencies."""
    low, high = speed[0] / wavelength[-1], speed[-1] / wavelength[0]
    if not low * (1 - MARGIN) <= point.frequency <= high * (1 + MARGIN):
        return np.nan
    at = np.array([point.wavelength]), np.array([point.speed])
    row = of.outputs.index(f"vehicle.{MODES[point.mode]}")
    return float(abs(of.over(*at)[row, 0, 0]))
