"""Sensors at fixed places of a track: where they are, and whether there is something."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from railcosim.parameters import ParameterError, ParameterSet, Usual, quantity, word, words

from .layers import CONTINUOUS, SLEEPER

if TYPE_CHECKING:
    from .parameters import Track

RAIL, SLAB, FASTENING = "rail", "slab", "fastening"
LEFT, MIDDLE, RIGHT = "left", "middle", "right"
NEAR = 1e-3  # m: a place this near to a railseat is there
FARTHEST = 1e6  # m; from there a place on the ring is known to 1e-10 m
MOST = 64
ASKED = "a file says where its sensors are"


@dataclass(frozen=True, kw_only=True)
class Sensor(ParameterSet):
    """A place of the track at which something is seen while a train passes.

    Raises
    ------
    ParameterError
        If the place is missing, or no place. Whether there is something is known with the track.
    """

    of: str = word(RAIL, f"{RAIL}, {SLAB}, {FASTENING}, or a layer by its name", source=ASKED)
    side: str = word(LEFT, f"{LEFT} or {RIGHT}; of a slab or a sleeper {MIDDLE}, too", source=ASKED)
    at: float = quantity(
        math.nan, "m", "along the track, as positions of wheelsets count", minimum=-FARTHEST,
        maximum=FARTHEST, usual=Usual(-1e5, 1e5, "hundreds of kilometres"), source=ASKED,
    )  # fmt: skip
    quantities: tuple[str, ...] = words("which of what it can tell; none named: all", source=ASKED)

    def __post_init__(self) -> None:
        if isinstance(self.at, float) and math.isnan(self.at):
            raise ParameterError("at: is missing; a sensor is somewhere, in m along the track")
        super().__post_init__()

    def __str__(self) -> str:
        return f"{self.of}.{self.side}@{self.at:g}"


@dataclass(frozen=True, kw_only=True)
class Place:
    """Where a sensor is on the ring.

    Attributes
    ----------
    cell : int
        From 0, round the ring.
    inside : float
        From where that cell begins, m.
    seat : int or None
        Which railseat of the cell it is at, from 0.
    """

    cell: int
    inside: float
    seat: int | None

    def on(self, track: Track) -> float:
        """Along the ring, m."""
        return self.cell * track.cell_length + self.inside


def place_on(track: Track, at: float) -> Place:
    """Where a place along the track, m, is on the ring."""
    length, spacing = track.cell_length, track.fastening.spacing
    cell = math.floor(at / length)
    inside = at - cell * length
    # A spacing that is rounded leaves no seat that is a multiple of it: by its number in its cell.
    seat = min(int(inside / spacing), track.bays - 1)
    there = abs((seat + 0.5) * spacing - inside) <= NEAR
    if there:
        inside = (seat + 0.5) * spacing
    elif min(inside, length - inside) <= NEAR:  # one node, whatever the rounding
        cell, inside = (cell if inside < length / 2 else cell + 1), 0.0
    return Place(cell=cell % track.mesh.cells, inside=inside, seat=seat if there else None)


def check_sensors(track: Track) -> None:
    """Raise ParameterError if there is nothing where a sensor is."""
    if len(track.sensor) > MOST:
        raise ParameterError(f"[[sensor]]: {len(track.sensor)} of them, at most {MOST}")
    for sensor in track.sensor:
        said = f"sensor {sensor}"
        known = [RAIL, FASTENING, *(layer.called for layer in track.layers)]
        known += [SLAB] * track.slab.present
        if sensor.of not in known:
            raise ParameterError(f"{said}: there is no {sensor.of}; must be one of {_or(known)}")
        if known.count(sensor.of) > 1:
            raise ParameterError(
                f"{said}: {known.count(sensor.of)} things are called so; give layers names"
            )
        sides = _sides(track, sensor)
        if sensor.side not in sides:
            raise ParameterError(
                f"{said}: there is no {sensor.side} of a {sensor.of}; must be one of {_or(sides)}"
            )
        _check_place(track, sensor, said)


def kind_of(track: Track, of: str) -> str:
    """Kind of a layer of that name; empty of what is none."""
    return next((layer.kind for layer in track.layers if layer.called == of), "")


def is_continuous(track: Track, of: str) -> bool:
    """Whether fastenings or a layer are all along the rail."""
    return track.fastening.continuous if of == FASTENING else kind_of(track, of) == CONTINUOUS


def _sides(track: Track, sensor: Sensor) -> Sequence[str]:
    across = sensor.of == SLAB or kind_of(track, sensor.of) == SLEEPER
    return (LEFT, MIDDLE, RIGHT) if across else (LEFT, RIGHT)


def _check_place(track: Track, sensor: Sensor, said: str) -> None:
    place, gap = place_on(track, sensor.at), track.slab.joint / 2
    if sensor.of == SLAB and not gap <= place.inside <= track.cell_length - gap:
        raise ParameterError(
            f"{said}: is in the joint between two slabs, {track.slab.joint:g} m wide around "
            f"multiples of {track.cell_length:g} m; must be on a slab"
        )
    at_seats = sensor.of not in (RAIL, SLAB) and not is_continuous(track, sensor.of)
    if at_seats and place.seat is None:
        spacing, length = track.fastening.spacing, track.cell_length
        cell = math.floor(sensor.at / length)
        inside = sensor.at - cell * length
        seats = [(k + 0.5) * spacing for k in range(-1, track.bays + 1)]
        near = sorted(cell * length + x for x in sorted(seats, key=lambda x: abs(x - inside))[:2])
        raise ParameterError(
            f"{said}: there is none; railseats beside it are at {near[0]:g} and {near[1]:g} m"
        )


def _or(words: Sequence[str]) -> str:
    return ", ".join(words)
