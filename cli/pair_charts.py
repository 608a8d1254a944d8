"""What is shown of a run and of a frequency response of the pair."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr

from railcosim.analysis.response.excitation import is_irregularity, is_mirrored
from railcosim.mechanics.ports import (
    FORCE,
    IRREGULARITY,
    RAIL,
    SIDES,
    WHEEL,
    Direction,
    Port,
    Y,
    Z,
    wheelset_of,
)
from railcosim.plots.chart import Chart
from railcosim.plots.names import place, words_of
from railcosim.plots.results import Group, size_chart, time_chart
from railcosim.plots.sensors import sensor_groups

MOST = 8
"""Curves in one picture that are told apart."""


def run_chart(run: xr.Dataset) -> Chart:
    """Contact forces, wheel and rail motion, and accelerations over time; aside where they are.

    Where a track has sensors, contact forces and what these see.
    """
    first, aside = _left(run)[0], FORCE.format(effort=Y.effort)
    met = {
        d: [f"{first}.{what.format(d.name)}" for what in (WHEEL.motion, RAIL.motion, IRREGULARITY)]
        for d in (Z, Y)
    }
    (cars, others), (cars_aside, _) = _bodies(run, "az"), _bodies(run, "ay")
    groups = (
        Group("contact force (kN)", _placed(f"{w}.force_z" for w in _left(run)), 1e-3),
        Group(
            "wheel on rail, to the right (kN)", _placed(f"{w}.{aside}" for w in _left(run)), 1e-3
        ),
        Group("down (mm)", _placed(met[Z]), 1e3),
        Group("to the right (mm)", _placed(met[Y]), 1e3),
        Group("bogie acceleration (m/s²)", others),
        Group("car body acceleration (m/s²)", _told_apart(cars | cars_aside)),
    )
    seen = tuple(sensor_groups(run))  # what passes is seen from there
    return time_chart(run, (groups[0], *seen) if seen else groups)


def response_chart(frf: xr.Dataset) -> Chart:
    """Magnitude of displacements and of contact forces over frequency, aside where they are."""
    excitation = str(frf.attrs["excitation"])
    per = "m" if is_irregularity(excitation) else "N"
    seen = sensor_groups(frf, per)
    if is_mirrored(excitation):
        return size_chart(frf, (*_responses(frf, Z, per, ""), *seen))
    groups = (*_responses(frf, Y, per, " aside"), *_responses(frf, Z, per, " down"), *seen)
    return size_chart(frf, groups)


def _responses(frf: xr.Dataset, direction: Direction, per: str, where: str) -> tuple[Group, Group]:
    """Displacements, and contact forces, in a direction."""
    excited = wheelset_of(str(frf.attrs["excitation"]))
    shown = Port(excited[0], SIDES[0]).wheel if excited else _left(frf)[-1]
    moved = [f"{shown}.{what.format(direction.name)}" for what in (WHEEL.motion, RAIL.motion)]
    cars, others = _bodies(frf, direction.name)
    forces = _placed(f"{w}.{FORCE.format(effort=direction.effort)}" for w in _left(frf))
    return (
        Group(f"|displacement{where}| (m/{per})", {**cars, **others, **_placed(moved)}),
        Group(f"|contact force{where}| (N/{per})", forces),
    )


def _left(shown: xr.Dataset) -> list[str]:
    """The left wheels from the front; of many, some from the first to the last."""
    found = [wheelset_of(str(name)) for name in shown.data_vars]
    numbers = sorted({of[0] for of in found if of is not None}) or [1]
    return _some([Port(i, SIDES[0]).wheel for i in numbers])


def _told_apart(words: dict[str, str]) -> dict[str, str]:
    """Say what of a body as well, where there is more than one of it."""
    if len(set(words.values())) == len(words):
        return words
    return {name: ", ".join(words_of(name) or (name,)) for name in words}


def _placed(names: Iterable[str]) -> dict[str, str]:
    """Whose they are, by the variables' names."""
    return {name: place(name) for name in names}


def _bodies(shown: xr.Dataset, quantity: str) -> tuple[dict[str, str], dict[str, str]]:
    """A quantity of the car bodies, and of the other bodies above the wheelsets."""
    names = [
        name
        for name in map(str, shown.data_vars)
        if name.rpartition(".")[2] == quantity
        and wheelset_of(name) is None
        and "at" not in shown[name].attrs  # of a sensor, which has panels of its own
    ]
    cars = [name for name in names if "carbody" in name]
    others = [name for name in names if name not in cars]
    return _placed(_some(cars)), _placed(_some(others))


def _some(names: list[str]) -> list[str]:
    """Not more than are told apart, the first and the last among them."""
    if len(names) <= MOST:
        return names
    return [names[k] for k in np.linspace(0, len(names) - 1, MOST).round().astype(int)]
