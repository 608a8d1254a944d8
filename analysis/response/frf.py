"""Frequency responses of a vehicle FMU and a track FMU, coupled or not."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.numbering import files_of, layouts_of
from railcosim.analysis.pair.ring import check_frequencies_of
from railcosim.analysis.pair.standing import Position
from railcosim.analysis.response.excitation import check_excitation
from railcosim.analysis.response.frequency import (
    apart,
    coupled,
    dataset,
    on_rigid_track,
    response,
)
from railcosim.analysis.response.models import linear_models
from railcosim.master.component import FloatArray
from railcosim.master.fmi.description import describe_file
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress, unheard

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
    contact_stiffness: float = 1e9,
    speed: float = SPEED,
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
    contact_stiffness : float
        k_H, N/m.
    speed : float
        m/s, for the lag with which wheelsets meet an irregularity.
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
    CouplingError
        If an FMU cannot be what it is given as, or there is no such excitation.
    ArithmeticError
        If a response is no finite number.
    """
    about = [(file, describe_file(file)) for file in files_of(vehicle)]
    wheels = layouts_of([(file, [*told.inputs, *told.outputs]) for file, told in about])
    check_excitation(excitation, sum(layout.wheelsets for layout in wheels))
    omega, k_H = 2 * np.pi * frequency, contact_stiffness
    rigid = assembly is Assembly.RIGID_TRACK
    rails = Path(track)
    models = linear_models(files_of(vehicle), None if rigid else rails, progress, position)
    if not rigid:
        check_frequencies_of(rails, float(frequency.max()))
    systems = {
        Assembly.COUPLED: lambda: coupled(models, omega, k_H),
        Assembly.APART: lambda: apart(models, omega),
        Assembly.RIGID_TRACK: lambda: on_rigid_track(models, omega, k_H),
    }
    system = systems[assembly]()
    values = response(system, excitation, models.positions, speed)
    check_finite(frequency, values)
    return dataset(
        system, values, models, excitation,
        contact_stiffness=k_H, speed=speed, wheelset_positions=models.positions,
        title=f"{system.name}, response to {excitation}",
    )  # fmt: skip


def check_finite(frequency: FloatArray, values: ComplexArray) -> None:
    """Raise ArithmeticError if a response, shape (n, ...), is no number at a frequency (Hz)."""
    wrong = ~np.isfinite(values).reshape(len(frequency), -1).all(axis=1)
    if wrong.any():
        raise ArithmeticError(
            f"the response at {frequency[wrong][0]:g} Hz is no finite number: nothing is written; "
            "take --frequencies nearer to those the model moves at"
        )
