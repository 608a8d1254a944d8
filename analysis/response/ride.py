"""Ride on a random track: densities of accelerations and contact forces, and what people feel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.standing import Position
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.receptance import FrequencyResponse, Response
from railcosim.master.linear.substructuring import couple
from railcosim.master.progress import Progress, unheard
from railcosim.mechanics.ports import FORCE, IRREGULARITY, SIDES, Layout, Port, Y, Z
from railcosim.track.irregularity import Quality
from railcosim.track.irregularity.synthesis import quality

from .comfort import LATERAL, VERTICAL, reaction, sperling, weighted_acceleration
from .critical import bogie_distance
from .frequency import Contact, joints, responses
from .frf import SPEED
from .local_track import Local
from .meeting import Stock, meeting_of, wheels_of
from .models import Models, linear_models
from .random import acceleration_psd, response_psd, standard_deviation

FLOOR = ("floor above front bogie", "floor above rear bogie")
NEEDED = ("carbody.z", "carbody.pitch", "bogie[1].z", "bogie[2].z")
BODY = {
    "carbody.az": "vehicle.carbody.z",
    **{name: f"vehicle.{name}" for name in FLOOR},
    "carbody.ay": "vehicle.carbody.y",
}
FELT = {"carbody.ay": LATERAL}
"""How what is not vertical is felt."""
OTHERS = {
    **{f"bogie[{i}].a{d}": f"vehicle.bogie[{i}].{d}" for d in "zy" for i in (1, 2)},
    **{f"wheelset[{i}].az": f"vehicle.wheelset[{i}].left.wheel_z" for i in (1, 2, 3, 4)},
}


def ride(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    frequency: FloatArray,
    *,
    irregularity: str = "german-low",
    contact_stiffness: float | None = None,
    stock: Stock = None,
    speed: float = SPEED,
    believe: bool = False,
    position: Position = None,
    local: Local | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Random response of a vehicle on a track of a class, by pseudo-excitation, and its comfort.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces.
    frequency : array, shape (n,)
        Hz; their ends bound what the standard deviations count.
    irregularity : str
        Class of the track.
    contact_stiffness, stock
        What is between wheels and rails, see `railcosim.analysis.response.meeting.meeting_of`. In
        space all quantities of the class act.
    speed : float
        m/s.
    believe : bool
        Take the response as it is of a vehicle that hunts at the speed.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    local : Local, optional
        What is different at single places of the track, of the vertical model.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        See `densities`.

    Raises
    ------
    ParameterError
        If there is no such class.
    CouplingError
        If an FMU cannot be what it is given as, or the vehicle is no car body on two bogies of two
        wheelsets.
    ArithmeticError
        If the vehicle hunts at the speed.
    """
    of, rails, cars = quality(irregularity), Path(track), files_of(vehicle)
    wheels_of(cars, contact_stiffness)
    models = linear_models(cars, rails, progress, position)
    if local is not None:
        models = local.under(models)
    check_frequencies_of(rails, float(frequency.max()))
    meeting = meeting_of(models, cars, contact_stiffness, stock)
    meeting.check(speed, believe=believe)
    found = densities(models, frequency, meeting.at(speed), speed, of)
    told = {"irregularity": irregularity, "speed": speed, **meeting.about}
    return found.assign_attrs({**told, **models.attributes})


def densities(
    models: Models, frequency: FloatArray, contact: Contact, speed: float, quality: Quality
) -> xr.Dataset:
    """One-sided densities over frequency, each with its standard deviation.

    Parameters
    ----------
    models : Models
        Vehicle and track.
    frequency : array, shape (n,)
        Hz; their ends bound what the standard deviations count.
    contact : float or Running
        Stiffness of contacts, N/m; or wheels that roll at the speed.
    speed : float
        m/s.
    quality : Quality
        Of the track. In space all quantities of it act. Else both rails are alike: the vehicle does
        not roll, and a wheelset that cannot would squeeze a cross-level out of its contact springs.

    Returns
    -------
    xarray.Dataset
        Accelerations in (m/s2)^2/Hz with the attributes ``standard_deviation``, and of the car body
        also ``iso_2631`` (m/s2, with the ``weighting`` W_k, or W_d of what is lateral),
        ``sperling`` (Wz); contact forces in N^2/Hz.

    Raises
    ------
    CouplingError
        If the vehicle is no car body on two bogies of two wheelsets.
    """
    known = {v.name for v in models.vehicle.outputs}
    if len(models.positions) != 4 or not known.issuperset(NEEDED):
        raise CouplingError(
            "ride is told of one car body on two bogies of two wheelsets each; this vehicle has "
            f"{len(models.positions)} wheelsets, or other bodies"
        )
    omega = 2 * np.pi * frequency
    vehicle, track = responses(models, omega)
    system = couple(
        _with_floor(vehicle, bogie_distance(models.positions) / 2),
        track,
        joints(contact, models.wheels),
    )
    return told(system, frequency, models.positions, speed, quality)


def told(
    system: Response, frequency: FloatArray, positions: FloatArray, speed: float, quality: Quality
) -> xr.Dataset:
    """What of a coupled response is shown; see `densities`."""
    omega, everything = system.omega, quality.spectra
    across = Port(1, SIDES[0], Y).name(IRREGULARITY) in system.inputs
    acting = everything if across else {"vertical": quality.vertical}
    sources = {name: spectrum.density for name, spectrum in acting.items()}
    psd = response_psd(system, positions, speed, sources)
    columns = dict(zip(system.outputs, psd.T, strict=True))
    hertz = {"units": "Hz", "long_name": "frequency"}
    out = xr.Dataset(coords={"frequency": ("frequency", frequency, hertz)})
    for name, output in (BODY | OTHERS).items():
        if output not in columns:
            continue
        density = acceleration_psd(omega, columns[output])
        about: dict[str, object] = {"units": "(m/s2)2/Hz", "long_name": f"density of {name}"}
        if name in BODY:
            felt = FELT.get(name, VERTICAL)
            weighted = weighted_acceleration(frequency, density, felt)
            about |= {"weighting": felt.name, "iso_2631": weighted, "reaction": reaction(weighted)}
            about["sperling"] = sperling(frequency, density, felt)
        out[name] = ("frequency", density, about)
    forces = [port.name(FORCE) for d in (Z, Y) for port in Layout(4, directions=(d,)).ports]
    for name in forces:
        if name in columns:
            about = {"units": "N2/Hz", "long_name": f"density of {name}"}
            out[name] = ("frequency", columns[name], about)
    for variable in out.data_vars.values():
        variable.attrs["standard_deviation"] = float(standard_deviation(frequency, variable.values))
    return out


def _with_floor(vehicle: FrequencyResponse, ahead: float) -> FrequencyResponse:
    """Add the car body's floor above the bogies; a positive pitch lifts the front."""
    z, pitch = (vehicle.values[:, vehicle.rows([name])] for name in ("carbody.z", "carbody.pitch"))
    floor = [z - ahead * pitch, z + ahead * pitch]
    return replace(
        vehicle,
        outputs=(*vehicle.outputs, *FLOOR),
        values=np.concatenate([vehicle.values, *floor], axis=1),
    )
