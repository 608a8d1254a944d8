"""Frequency responses of vehicle and track, linearised, and coupled through the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import Stiffness
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse, Response, frequency_response, lag
from railcosim.master.linear.substructuring import Joint, couple
from railcosim.master.memory import afford
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout

from .models import Models

WHATS = ("force_z", "rail_force_z", "irregularity_z")
COPIES = 3
"""Of all responses at once: those of both parts, and at the joints while these are solved."""


def joints(k_H: Stiffness, wheels: Sequence[str]) -> list[Joint]:
    """Contacts of wheels by their names, all of one stiffness or those of each wheelset."""
    return [
        Joint(
            name=wheel,
            first_input=f"{wheel}.force_z",
            first_output=f"{wheel}.wheel_z",
            second_input=f"{wheel}.force_z",
            second_output=f"{wheel}.rail_z",
            stiffness=float(k),
        )
        for wheel, k in zip(wheels, np.resize(k_H, len(wheels)), strict=True)
    ]


def coupled(models: Models, omega: FloatArray, k_H: Stiffness) -> Response:
    """Vehicle on the track."""
    return couple(*responses(models, omega), joints(k_H, models.wheels))


def on_rigid_track(models: Models, omega: FloatArray, k_H: Stiffness) -> Response:
    """Vehicle on its contact springs alone."""
    return couple(frequency_response(models.vehicle, omega), None, joints(k_H, models.wheels))


def apart(models: Models, omega: FloatArray) -> Response:
    """Vehicle and track without each other, under the names of the coupled response."""
    return replace(couple(*responses(models, omega), []), name="vehicle and track apart")


def responses(models: Models, omega: FloatArray) -> tuple[FrequencyResponse, FrequencyResponse]:
    """Of vehicle and track, each by itself."""
    if models.track is None:
        raise CouplingError("the track was left out when the FMUs were linearised")
    wheels = len(models.wheels)
    outputs = len(models.vehicle.outputs) + len(models.track.outputs) + wheels
    afford(
        COPIES * 16.0 * len(omega) * outputs * wheels,
        f"{outputs} responses to {wheels} inputs at {len(omega)} frequencies",
        "take fewer frequencies",
    )
    return frequency_response(models.vehicle, omega), frequency_response(models.track, omega)


def check_excitation(excitation: str, wheelsets: int = MOST_WHEELSETS) -> None:
    """Raise CouplingError if nothing on so many wheelsets is excited so; see `response`."""
    axles = Layout(wheelsets).axles
    if excitation not in {"irregularity_z", *(f"{w}.{what}" for w in axles for what in WHATS)}:
        raise CouplingError(
            f"excitation {excitation}: must be irregularity_z, or one of {axles[0]} to {axles[-1]} "
            "with .force_z, .rail_force_z or .irregularity_z"
        )


def response(
    system: Response, excitation: str, positions: FloatArray, speed: float
) -> ComplexArray:
    """All outputs to one excitation, shape (n_omega, n_outputs).

    Parameters
    ----------
    system : Response
        Coupled, on rigid track, or apart.
    excitation : str
        ``wheelset[i].force_z``: a unit force down on a wheelset. ``wheelset[i].rail_force_z``: a
        unit force down on EACH rail under it, the paper's. ``irregularity_z``: unit irregularity,
        which every wheelset meets later by its distance behind the first over the speed.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    speed : float
        m/s, for the irregularity.
    """
    check_excitation(excitation)
    inputs = set(system.inputs)
    wanted: dict[str, complex | ComplexArray] = {}
    layout = Layout(len(positions))
    for w in layout.axles:
        both = [f"{w}.left", f"{w}.right"]
        if excitation == f"{w}.force_z":
            # The FMU's contact forces lift; half of a force down goes to each wheel.
            wanted = {f"vehicle.{s}.force_z": -0.5 for s in both}
        elif excitation == f"{w}.rail_force_z":
            wanted = {f"track.{s}.force_z": 1.0 for s in both}
        elif excitation == f"{w}.irregularity_z":
            wanted = {f"{s}.gap": 1.0 for s in both}
    if excitation == "irregularity_z":
        delays = (positions.max() - positions) / speed
        phases = lag(system.omega, np.tile(delays, 2))
        wanted = {f"{wheel}.gap": phases[:, k] for k, wheel in enumerate(layout.wheels)}
    if not wanted or not set(wanted) <= inputs:
        raise CouplingError(f"excitation {excitation}: there is no such input in {system.name}")
    amplitudes = [np.broadcast_to(v, system.omega.shape) for v in wanted.values()]
    return system.combined(list(wanted), np.stack(amplitudes, axis=1))


def dataset(
    system: Response,
    values: ComplexArray,
    models: Models,
    excitation: str,
    **attrs: object,
) -> xr.Dataset:
    """Responses under the FMUs' variable names, with units per unit of the excitation."""
    per = "m" if excitation.endswith("irregularity_z") else "N"
    rails = () if models.track is None else models.track.outputs
    known = {v.name: v for v in (*models.vehicle.outputs, *rails)}
    variables = {}
    for k, output in enumerate(system.outputs):
        if output.endswith(".force"):
            name, unit, text = output.removesuffix(".force") + ".force_z", "N", "contact force"
        else:
            name = output.partition(".")[2]
            unit, text = known[name].unit, known[name].description
        units = {"units": f"({unit})/{per}" if "/" in unit else f"{unit}/{per}", "long_name": text}
        variables[name] = ("frequency", values[:, k], units)
    frequency = ("frequency", system.omega / (2 * np.pi), {"units": "Hz", "long_name": "frequency"})
    about = {"excitation": excitation, "system": system.name, **models.attributes, **attrs}
    return xr.Dataset(variables, {"frequency": frequency}, about)
