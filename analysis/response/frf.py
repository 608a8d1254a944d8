"""Frequency responses of a vehicle FMU and a track FMU, coupled or not."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.sensors import located
from railcosim.analysis.pair.standing import Position
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard

from .excitation import check_excitation, is_mirrored
from .frequency import apart, coupled, dataset, on_rigid_track, response
from .local_track import Local
from .meeting import Stock, in_space, meeting_of, wheels_of
from .models import linear_models

SPEED = 250 / 3.6  # m/s


class Assembly(StrEnum):
    """What of vehicle and track responds."""

    COUPLED = "coupled"
    APART = "apart"
    RIGID_TRACK = "rigid track"


def frequency_response(
    vehicle: str | Path | Sequence[str | Path],
    track: str | Path,
    frequency: FloatArray,
    *,
    excitation: str = "wheelset[4].force_z",
    contact_stiffness: float | None = None,
    stock: Stock = None,
    speed: float = SPEED,
    believe: bool = False,
    assembly: Assembly = Assembly.COUPLED,
    position: Position = None,
    local: Local | None = None,
    progress: Progress = unheard,
) -> xr.Dataset:
    """Linearise both FMUs and couple them in the frequency domain.

    Parameters
    ----------
    vehicle, track : str or Path
        FMUs that take contact forces; of vehicles also several, from the front.
    frequency : array, shape (n,)
        Hz.
    excitation : str
        See `railcosim.analysis.response.frequency.response`.
    contact_stiffness, stock
        What is between wheels and rails, see `railcosim.analysis.response.meeting.meeting_of`.
    speed : float
        m/s, for the lag with which wheelsets meet an irregularity, and for creep.
    believe : bool
        Take a response as it is of a vehicle that hunts at the speed.
    assembly : Assembly
        What responds.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    local : Local, optional
        What is different at single places of the track, of the vertical model.
    progress : callable
        Told what is done and the total.

    Returns
    -------
    Dataset
        All outputs, complex, per unit of the excitation.

    Raises
    ------
    ArgumentError
        If a contact stiffness is given of wheels that roll.
    CouplingError
        If an FMU cannot be what it is given as, or there is no such excitation.
    ArithmeticError
        If a response is no finite number; or if the vehicle hunts at the speed, so that no lateral
        motion stays small: the message has its critical speed.

    Warns
    -----
    RuntimeWarning
        If it hunts, and the excitation moves nothing aside, or the response is believed.
    """
    cars, rails = files_of(vehicle), Path(track)
    wheels = wheels_of(cars, contact_stiffness)
    check_excitation(
        excitation, sum(layout.wheelsets for layout in wheels), in_space=in_space(wheels)
    )
    omega = 2 * np.pi * frequency
    rigid = assembly is Assembly.RIGID_TRACK
    models = linear_models(cars, None if rigid else rails, progress, position)
    if local is not None:
        models = local.under(models)
    if not rigid:
        check_frequencies_of(rails, float(frequency.max()))
    meeting = meeting_of(models, cars, contact_stiffness, stock)
    if assembly is not Assembly.APART:
        meeting.check(speed, believe=believe or is_mirrored(excitation))
    contact = meeting.at(speed)
    systems = {
        Assembly.COUPLED: lambda: coupled(models, omega, contact),
        Assembly.APART: lambda: apart(models, omega),
        Assembly.RIGID_TRACK: lambda: on_rigid_track(models, omega, contact),
    }
    system = systems[assembly]()
    values = response(system, excitation, models.positions, speed)
    check_finite(frequency, values)
    result = dataset(
        system, values, models, excitation,
        **meeting.about, speed=speed, wheelset_positions=models.positions,
        title=f"{system.name}, response to {excitation}",
    )  # fmt: skip
    return result if rigid else located(result, rails)


def check_finite(frequency: FloatArray, values: ComplexArray) -> None:
    """Raise ArithmeticError if a response, shape (n, ...), is no number at a frequency (Hz)."""
    wrong = ~np.isfinite(values).reshape(len(frequency), -1).all(axis=1)
    if wrong.any():
        raise ArithmeticError(
            f"the response at {frequency[wrong][0]:g} Hz is no finite number: nothing is written; "
            "take --frequencies nearer to those the model moves at"
        )
