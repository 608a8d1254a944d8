"""Frequency responses of a vehicle FMU and a track FMU, coupled or not."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of, layouts_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.response.excitation import check_excitation, is_mirrored
from railcosim.analysis.response.frequency import (
    Contact,
    apart,
    coupled,
    dataset,
    on_rigid_track,
    response,
)
from railcosim.analysis.response.models import Models, linear_models
from railcosim.analysis.response.rolling import ON_WHEEL, LinearContacts
from railcosim.analysis.response.rolling_pair import (
    compliance_of,
    matrices_of,
    rolling_of,
)
from railcosim.analysis.response.running import SPEEDS, OnRails, Rolling
from railcosim.master.component import FloatArray
from railcosim.master.fmi.description import describe_file
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard
from railcosim.parameters import ArgumentError
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

SPEED = 250 / 3.6  # m/s
STIFFNESS = 1e9  # N/m


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
    stock: Vehicle | Train | None = None,
    speed: float = SPEED,
    believe: bool = False,
    assembly: Assembly = Assembly.COUPLED,
    position: Position = None,
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
    contact_stiffness : float, optional
        k_H, N/m, of FMUs that meet downwards only; `STIFFNESS` if not given. Those in space roll.
    stock : Vehicle or Train, optional
        In space: whose wheels roll, as its ``[rolling]`` says, and whose axles turn; as the vehicle
        FMU tells if not given. The static loads are always those that it tells.
    speed : float
        m/s, for the lag with which wheelsets meet an irregularity, and for creep.
    believe : bool
        Take a response as it is of a vehicle that hunts at the speed.
    assembly : Assembly
        What responds.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
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
    told = [(file, describe_file(file)) for file in files_of(vehicle)]
    wheels = layouts_of([(file, [*one.inputs, *one.outputs]) for file, one in told])
    in_space = wheels[0].directions == ON_WHEEL
    check_excitation(excitation, sum(layout.wheelsets for layout in wheels), in_space=in_space)
    if contact_stiffness is not None and in_space:
        raise ArgumentError(
            "contact_stiffness", contact_stiffness,
            "is of wheels that meet rails downwards only; these are in space, and roll",
        )  # fmt: skip
    omega = 2 * np.pi * frequency
    rigid = assembly is Assembly.RIGID_TRACK
    rails = Path(track)
    models = linear_models(files_of(vehicle), None if rigid else rails, progress, position)
    if not rigid:
        check_frequencies_of(rails, float(frequency.max()))
    contact: Contact = contact_stiffness or STIFFNESS
    about: dict[str, object] = {"contact_stiffness": contact}
    if in_space:
        rolling = rolling_of(stock, files_of(vehicle), models.vehicle)
        contact, about = rolling.at(speed), {"creep": "Kalker, linear; spins as gyroscopes"}
        if assembly is not Assembly.APART:
            check_stable(models, rolling, speed, believe=believe or is_mirrored(excitation))
    systems = {
        Assembly.COUPLED: lambda: coupled(models, omega, contact),
        Assembly.APART: lambda: apart(models, omega),
        Assembly.RIGID_TRACK: lambda: on_rigid_track(models, omega, contact),
    }
    system = systems[assembly]()
    values = response(system, excitation, models.positions, speed)
    check_finite(frequency, values)
    return dataset(
        system, values, models, excitation,
        **about, speed=speed, wheelset_positions=models.positions,
        title=f"{system.name}, response to {excitation}",
    )  # fmt: skip


def check_stable(models: Models, rolling: LinearContacts, speed: float, *, believe: bool) -> None:
    """Raise ArithmeticError if vehicle and track hunt at a speed in m/s; if believed, warn."""
    file = Path(models.vehicle.name)
    track = models.track
    pair = OnRails(
        Rolling(matrices_of(file, models.vehicle), rolling),
        None if track is None else partial(compliance_of, track),
    )
    pole = pair.growing(speed)
    if pole is None:
        return
    critical = pair.critical()
    found = (
        f"from {3.6 * critical.speed:.1f} km/h on"
        if critical.speed > 0
        else f"at {3.6 * SPEEDS[0]:g} km/h already"
    )
    text = (
        f"at {3.6 * speed:g} km/h the vehicle hunts, by {pole.real:.3g} 1/s at "
        f"{abs(pole.imag) / (2 * np.pi):.3g} Hz; it does {found}"
    )
    if not believe:
        raise ArithmeticError(
            f"{text}. No lateral motion stays small there, so a response to it means nothing; take "
            "a lower --speed, other parameters, or --believe"
        )
    warnings.warn(f"{text}; only motions that nothing moves aside are to be believed", stacklevel=3)


def check_finite(frequency: FloatArray, values: ComplexArray) -> None:
    """Raise ArithmeticError if a response, shape (n, ...), is no number at a frequency (Hz)."""
    wrong = ~np.isfinite(values).reshape(len(frequency), -1).all(axis=1)
    if wrong.any():
        raise ArithmeticError(
            f"the response at {frequency[wrong][0]:g} Hz is no finite number: nothing is written; "
            "take --frequencies nearer to those the model moves at"
        )
