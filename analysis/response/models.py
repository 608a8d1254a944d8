"""Vehicle and track FMUs as linear models, and where their wheelsets stand."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from railcosim.analysis.pair.contact import layout_of
from railcosim.analysis.pair.numbering import Vehicles, files_of, names_through, places_of
from railcosim.analysis.pair.ring import check_ring_of
from railcosim.analysis.pair.sensors import check_seen, outputs_of_sensors
from railcosim.analysis.pair.several import load_vehicles
from railcosim.analysis.pair.standing import (
    Position,
    each_position,
    standing,
    start_positions,
    track_at,
)
from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import FmuDescription, describe_file
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.linear_fmu import Pulses, Wanted, Way, best_way
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.linearise import values_of
from railcosim.master.linear.operating_point import OURS
from railcosim.master.linear.side_by_side import SideBySide
from railcosim.master.progress import Progress
from railcosim.mechanics.ports import FORCE, RAIL, Layout

VEHICLE_SHARE = 0.2  # of the time that both take


def pulses(wheelsets: int) -> Pulses:
    """How FMUs of so many wheelsets without Model Exchange are linearised.

    Both wheels of a wheelset together, then against each other: each shows half of the track's
    modes. The record lasts a third of the longest period of the vehicle, and until only the
    undamped modes of the track are left; one over the step is above the sum of the highest pole of
    the track (6 kHz) and of what is asked for. The FMUs are linear, so the size of the pulse (N)
    matters for rounding only.
    """
    ways = np.kron([[1, 1], [1, -1]], np.eye(wheelsets))
    return Pulses(amplitude=1e4, step=1e-4, steps=13_500, directions=ways)


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
    first = files_of(vehicle)[0], cars.inputs
    layout = layout_of(first)
    positions = places_of(first[0], cars.standing, layout)
    attributes = {"vehicle_fmu": sha256}
    if track is None:
        return Models(cars, None, positions, attributes)
    layout_of(first, (track, describe_file(track).inputs))
    check_ring_of(track, positions)
    rails, attributes["track_fmu"] = linear_track(
        track, positions, lambda a, b: progress(share + (1 - share) * a / b, 1.0)
    )
    return Models(cars, rails, positions, attributes)


def wheelset_positions(vehicle: Vehicles, position: Position = None) -> FloatArray:
    """Where the wheelsets of a vehicle FMU, or of several, stand at first, from the front, m."""
    with load_vehicles(vehicle, FmuComponent.load) as cars:
        cars.set_parameters(start_positions(vehicle, position))
        cars.enter_initialization(0.0)
        cars.exit_initialization()
        layout = layout_of((cars.description.path, [*cars.inputs, *cars.outputs]))
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
    return way_to(fmu, layout)(fmu, "vehicle", wanted, progress), about.sha256


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
    names = names_through([(file, model) for (file, _), (model, _) in zip(each, made, strict=True)])
    together = SideBySide.of("vehicle", [model for model, _ in made], names)
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
    check_seen(fmu, positions)
    shown = {*layout.names(RAIL.motion), *outputs_of_sensors(fmu)}
    wanted = Wanted(
        inputs=layout.names(FORCE),
        outputs=[v.name for v in about.outputs if v.name in shown],
        at=track_at(positions, layout, about.inputs),
    )
    return way_to(fmu, layout)(fmu, "track", wanted, progress), about.sha256


def way_to(fmu: Path, layout: Layout) -> Way:
    """The best way an FMU allows, and a word on a better one.

    Warns
    -----
    UserWarning
        If it has no Model Exchange.
    """
    from_outside = pulses(layout.wheelsets)
    way = best_way(fmu, from_outside)
    if way is from_outside:
        warnings.warn(
            f"{fmu}: no Model Exchange in it, so it is linearised by pulses; with that ({OURS}) it "
            "is exact, and faster",
            stacklevel=2,
        )
    return way


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
