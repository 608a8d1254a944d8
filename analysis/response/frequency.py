"""Frequency responses of the pair: each FMU linearised, then coupled through the contacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path

import numpy as np
import xarray as xr

from railcosim.analysis.pair.contact import Stiffness, layout_of
from railcosim.analysis.pair.ring import check_ring_of
from railcosim.analysis.pair.several import (
    Vehicles,
    check_order,
    files_of,
    layouts_of,
    through,
)
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import FmuDescription, describe_file
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.linear_fmu import Pulses, Wanted, best_way
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.linearise import values_of
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.receptance import FrequencyResponse, Response, frequency_response, lag
from railcosim.master.linear.side_by_side import SideBySide
from railcosim.master.linear.substructuring import Joint, couple
from railcosim.master.memory import afford
from railcosim.mechanics.ports import FORCE, MOST_WHEELSETS, RAIL, Layout

from .standing import Position, each_position, standing

# For FMUs without Model Exchange. Both wheels of a wheelset together, then against each other: each
# shows half of the track's modes. The record lasts a third of the longest period of the vehicle,
# and until only the undamped modes of the track are left; one over the step is above the sum of the
# highest pole of the track (6 kHz) and of what is asked for. The FMUs are linear, so the size of
# the pulse (N) matters for rounding only.
WHATS = ("force_z", "rail_force_z", "irregularity_z")
EXCITATIONS = {
    "irregularity_z",
    *(f"{w}.{what}" for w in Layout(MOST_WHEELSETS).axles for what in WHATS),
}


def pulses(wheelsets: int) -> Pulses:
    """How FMUs of so many wheelsets without Model Exchange are linearised."""
    ways = np.kron([[1, 1], [1, -1]], np.eye(wheelsets))
    return Pulses(amplitude=1e4, step=1e-4, steps=13_500, directions=ways)


PULSES = pulses(4)
COPIES = (
    3  # of all responses at once: those of both parts, and at the joints while these are solved
)
VEHICLE_SHARE = 0.2  # of the time that both take
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Models:
    """Both FMUs as linear models, and where the wheelsets stand.

    Attributes
    ----------
    vehicle : LinearForm
        Contact forces to motion.
    track : LinearForm or None
        The same; None where a rigid track is all that is asked for.
    positions : array, shape (n_wheelsets,)
        Wheelsets, m.
    attributes : dict
        What was linearised, for the results.
    """

    vehicle: LinearForm
    track: LinearForm | None
    positions: FloatArray
    attributes: dict[str, str]

    @property
    def wheels(self) -> tuple[str, ...]:
        """Names of all wheels."""
        return Layout(len(self.positions)).wheels


def linear_models(
    vehicle: Vehicles, track: Path | None, progress: Progress, position: Position = None
) -> Models:
    """Linearise a vehicle FMU and a track FMU that take contact forces.

    Parameters
    ----------
    vehicle : Path or sequence of Path
        FMU file, or those of several vehicles from the front, without contact: with the contact
        inside, its stiffness would cancel digits at low frequency.
    track : Path or None
        The same; None leaves the track out.
    progress : callable
        Told what is done and the total.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.
    """
    share = 1.0 if track is None else VEHICLE_SHARE
    cars, sha256 = linear_vehicles(vehicle, lambda a, b: progress(share * a / b, 1.0), position)
    layout = layout_of((files_of(vehicle)[0], cars.inputs))
    positions = np.array([cars.standing[name] for name in layout.of_axles("position")])
    attributes = {"vehicle_fmu": sha256}
    if track is None:
        return Models(cars, None, positions, attributes)
    check_ring_of(track, positions)
    rails, attributes["track_fmu"] = linear_track(
        track, positions, lambda a, b: progress(share + (1 - share) * a / b, 1.0)
    )
    return Models(cars, rails, positions, attributes)


def wheelset_positions(vehicle: Path) -> FloatArray:
    """Where the wheelsets of a vehicle FMU stand at first, from the front, m."""
    with FmuComponent.load(vehicle, name="vehicle") as cars:
        cars.enter_initialization(0.0)
        cars.exit_initialization()
        layout = layout_of((vehicle, [*cars.inputs, *cars.outputs]))
        values = values_of(cars)
        return np.array([values[name] for name in layout.of_axles("position")])


def linear_vehicle(
    fmu: Path, progress: Progress, position: float | None = None
) -> tuple[LinearForm, str]:
    """Linear model of a vehicle FMU at rest, see `standing`; hash of the file."""
    about, layout = _taking_forces(fmu)
    still = set(layout.of_axles("position"))
    wanted = Wanted(
        inputs=layout.names(FORCE),
        outputs=[v.name for v in about.outputs if v.name not in still],
        parameters={
            **({"speed": 0.0} if "speed" in about.parameters else {}),
            **standing(fmu, position).get("parameters", {}),
        },
    )
    return best_way(fmu, pulses(layout.wheelsets))(fmu, "vehicle", wanted, progress), about.sha256


def linear_vehicles(
    vehicle: Vehicles, progress: Progress, position: Position = None
) -> tuple[LinearForm, str]:
    """The same of one vehicle or several, which only the track joins."""
    each = each_position(vehicle, position)
    made = [
        linear_vehicle(file, lambda a, b, k=k: progress(k + a / b, len(each)), x)  # type: ignore[misc]
        for k, (file, x) in enumerate(each)
    ]
    if len(made) == 1:
        return made[0]
    layouts = layouts_of([(f, m.inputs) for (f, _), (m, _) in zip(each, made, strict=True)])
    check_order(
        [file for file, _ in each],
        [
            np.array([m.standing[name] for name in layout.of_axles("position")])
            for layout, (m, _) in zip(layouts, made, strict=True)
        ],
    )
    ahead = [0, *accumulate(layout.wheelsets for layout in layouts)]
    names = [
        {
            name: through(name, number, ahead[number - 1])
            for name in (*(v.name for v in m.inputs), *m.standing)
        }
        for number, (m, _) in enumerate(made, start=1)
    ]
    together = SideBySide.of("vehicle", [m for m, _ in made], names)
    return together, " ".join(sha256 for _, sha256 in made)


def linear_track(fmu: Path, positions: FloatArray, progress: Progress) -> tuple[LinearForm, str]:
    """Linear model of a track FMU under wheelsets at positions in m, hash of the file.

    Raises
    ------
    CouplingError
        If it takes no contact forces, or is made for another number of wheelsets.
    """
    about, layout = _taking_forces(fmu)
    if layout.wheelsets != len(positions):
        raise CouplingError(
            f"{fmu}: is made for {layout.wheelsets} wheelsets, and there are {len(positions)}: "
            "export the track for that vehicle"
        )
    rails = set(layout.names(RAIL.motion))
    wanted = Wanted(
        inputs=layout.names(FORCE),
        outputs=[v.name for v in about.outputs if v.name in rails],
        at={
            name: float(x)
            for name, x in zip(layout.of_axles("position"), positions, strict=True)
            if name in {v.name for v in about.inputs}
        },
    )
    return best_way(fmu, pulses(layout.wheelsets))(fmu, "track", wanted, progress), about.sha256


def _taking_forces(fmu: Path) -> tuple[FmuDescription, Layout]:
    """What an FMU says of itself, and its wheels, if it takes contact forces."""
    about = describe_file(fmu)
    names = {v.name for v in about.inputs}
    layout = Layout.among(names) or Layout(1)
    missing = [name for name in layout.names(FORCE) if name not in names]
    if missing:
        raise CouplingError(
            f"{fmu}: has no input {missing[0]!r}; give an FMU that takes contact forces "
            "(Vehicle.fmu, Track.fmu), not one that owns the contact"
        )
    return about, layout


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


def check_excitation(excitation: str) -> None:
    """Raise CouplingError if no system of ours has an excitation of that name; see `response`."""
    if excitation not in EXCITATIONS:
        raise CouplingError(
            f"excitation {excitation}: must be irregularity_z, or a wheelset, wheelset[1] and so "
            "on, with .force_z, .rail_force_z or .irregularity_z"
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
