"""Names and places of several vehicles one behind the other, wheelsets numbered through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np

from railcosim.master.component import FloatArray, Variable
from railcosim.master.connections import CouplingError
from railcosim.master.linear.linear_form import LinearForm
from railcosim.mechanics.ports import MOST_WHEELSETS, Layout, wheelset_name, wheelset_of

from .contact import layout_of

Vehicles: TypeAlias = Path | Sequence[Path]
"""The FMU of a vehicle or a train, or those of several from the front."""
START_POSITION = "start_position"
"""Parameter of a vehicle: where its last wheelset stands at first, m."""


def files_of(vehicle: str | Path | Sequence[str | Path]) -> tuple[Path, ...]:
    """The FMUs from the front."""
    return tuple(map(Path, [vehicle] if isinstance(vehicle, str | Path) else vehicle))


def vehicle_name(number: int) -> str:
    """Name of a vehicle, which are counted from 1, from the front."""
    return f"vehicle[{number}]"


def through(name: str, number: int, ahead: int) -> str:
    """Name among all of a variable of one vehicle, behind so many wheelsets."""
    found = wheelset_of(name)
    if found is None:
        return f"{vehicle_name(number)}.{name}"
    return f"{wheelset_name(found[0] + ahead)}.{found[1]}"


def renamed(variables: Sequence[Variable], number: int, ahead: int) -> list[Variable]:
    """Variables of one vehicle with their names among all."""
    return [replace(v, name=through(v.name, number, ahead)) for v in variables]


def places_of(file: Path, values: Mapping[str, float], layout: Layout) -> FloatArray:
    """Where the wheelsets of a vehicle FMU stand, by the values of its outputs, m.

    Raises
    ------
    CouplingError
        If it does not tell.
    """
    names = layout.of_axles("position")
    missing = [name for name in names if name not in values]
    if missing:
        raise CouplingError(f"{file}: has no output {missing[0]}; a vehicle needs it")
    return np.array([values[name] for name in names])


def check_order(files: Sequence[Path], places: Sequence[FloatArray]) -> None:
    """Raise CouplingError if vehicles do not stand one behind the other.

    Parameters
    ----------
    files : sequence of Path
        Their FMUs, from the front.
    places : sequence of array
        Where the wheelsets of each stand, m.
    """
    for (file, place), (behind, next_) in pairwise(zip(files, places, strict=True)):
        if next_.max() >= place.min():
            raise CouplingError(
                f"{behind}: its first wheelset stands at {next_.max():g} m, which is not behind "
                f"the last one of {file} at {place.min():g} m: give vehicles from the front, and "
                "say where the last wheelset of each stands (--position 25,0.3)"
            )


def layouts_of(vehicles: Sequence[tuple[Path, Sequence[Variable]]]) -> list[Layout]:
    """The wheels of each of several vehicles, by file and variables.

    Raises
    ------
    CouplingError
        If they do not fit on one track.
    """
    layouts = [layout_of(vehicle) for vehicle in vehicles]
    for (file, _), layout in zip(vehicles, layouts, strict=True):
        if layout.sides != layouts[0].sides:
            raise CouplingError(f"{file}: is on one rail, and another vehicle on two")
        if layout.directions != layouts[0].directions:
            raise CouplingError(f"{file}: meets rails in other directions than the first one")
    count = sum(layout.wheelsets for layout in layouts)
    if count > MOST_WHEELSETS:
        raise CouplingError(f"vehicles of {count} wheelsets: must be at most {MOST_WHEELSETS}")
    return layouts


def names_through(vehicles: Sequence[tuple[Path, LinearForm]]) -> list[Mapping[str, str]]:
    """Names among all of what the linear model of each vehicle takes and tells, from the front.

    Raises
    ------
    CouplingError
        If they do not fit on one track, or do not stand one behind the other.
    """
    layouts = layouts_of([(file, model.inputs) for file, model in vehicles])
    check_order(
        [file for file, _ in vehicles],
        [
            places_of(file, model.standing, layout)
            for layout, (file, model) in zip(layouts, vehicles, strict=True)
        ],
    )
    ahead = accumulate((layout.wheelsets for layout in layouts), initial=0)
    return [
        {
            name: through(name, number, before)
            for name in (*(v.name for v in model.inputs), *model.standing)
        }
        for number, ((_, model), before) in enumerate(zip(vehicles, ahead, strict=False), start=1)
    ]
