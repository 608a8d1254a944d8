"""Frequency responses of vehicle and track, linearised, and coupled through the contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import Stiffness
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.linear.joint import Joint, spring
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse, Response, frequency_response
from railcosim.master.linear.substructuring import couple
from railcosim.master.memory import afford

from .excitation import is_irregularity, loads_of
from .models import Models
from .rolling import RAIL_MOMENT, Running

COPIES = 3
"""Of all responses at once: those of both parts, and at the joints while these are solved."""


Contact: TypeAlias = Stiffness | Running
"""Springs between wheels and rails, of one stiffness or of one a wheelset (N/m); or wheels that
roll at a speed."""


def joints(contact: Contact, wheels: Sequence[str]) -> list[Joint]:
    """Contacts of wheels by their names."""
    if isinstance(contact, Running):
        return contact.joints()
    return [
        spring(
            f"{wheel}.force_z",
            f"{wheel}.irregularity_z",
            first=(f"{wheel}.force_z", f"{wheel}.wheel_z"),
            second=(f"{wheel}.force_z", f"{wheel}.rail_z"),
            stiffness=float(k),
        )
        for wheel, k in zip(wheels, np.resize(contact, len(wheels)), strict=True)
    ]


def coupled(models: Models, omega: FloatArray, contact: Contact) -> Response:
    """Vehicle on the track."""
    return couple(*responses(models, omega), joints(contact, models.wheels))


def on_rigid_track(models: Models, omega: FloatArray, contact: Contact) -> Response:
    """Vehicle on its contact springs alone."""
    return couple(frequency_response(models.vehicle, omega), None, joints(contact, models.wheels))


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
        unit force down on EACH rail under it, the paper's; ``wheelset[i].rail_force_y`` to the
        right. ``wheelset[i].`` with ``irregularity_z`` (``vertical``), ``cross_level``,
        ``alignment`` or ``gauge``: unit irregularity under it. One of these alone: every wheelset
        meets it later, by its distance behind the first over the speed.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    speed : float
        m/s, for the irregularity.

    Raises
    ------
    CouplingError
        If there is no such excitation.
    """
    return system.combined(*loads_of(system, excitation, positions, speed))


def told_of_force(name: str) -> tuple[str, str]:
    """Unit and description of a contact's force by its name."""
    if "moment" not in name:
        return "N", "contact force"
    datum = "rail" if name.endswith(RAIL_MOMENT) else "wheel"
    return "N.m", f"moment of the contact about the datum of the {datum}"


def dataset(
    system: Response,
    values: ComplexArray,
    models: Models,
    excitation: str,
    **attrs: object,
) -> xr.Dataset:
    """Responses under the FMUs' variable names, with units per unit of the excitation."""
    per = "m" if is_irregularity(excitation) else "N"
    rails = () if models.track is None else models.track.outputs
    known = {
        f"{part}.{v.name}": v
        for part, of in (("vehicle", models.vehicle.outputs), ("track", rails))
        for v in of
    }
    variables = {}
    for k, output in enumerate(system.outputs):
        if output in known:
            name, unit, text = known[output].name, known[output].unit, known[output].description
        else:
            name, unit, text = output, *told_of_force(output)
        units = {"units": f"({unit})/{per}" if "/" in unit else f"{unit}/{per}", "long_name": text}
        variables[name] = ("frequency", values[:, k], units)
    frequency = ("frequency", system.omega / (2 * np.pi), {"units": "Hz", "long_name": "frequency"})
    about = {"excitation": excitation, "system": system.name, **models.attributes, **attrs}
    return xr.Dataset(variables, {"frequency": frequency}, about)
