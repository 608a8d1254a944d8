"""What sensors tell: each quantity as a multiple of a row, its rate and its acceleration."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from railcosim.mechanics.ports import ROLL, Direction, Y, Z
from railcosim.parameters import ParameterError

from .fastenings import Spring, springs_of
from .local import LocalChange
from .parameters import Track
from .sensor_rows import VALUE, Motion, RailMoment, Row, SlabMoment, Weights
from .sensors import FASTENING, LEFT, MIDDLE, RAIL, RIGHT, SLAB, Sensor, is_continuous, place_on

MOVES: Mapping[str, tuple[str, Weights]] = {
    "{}": ("", VALUE), "v{}": ("/s", (0.0, 1.0, 0.0)), "a{}": ("/s2", (0.0, 0.0, 1.0)),
}  # fmt: skip
"""Names and units, of a motion and its derivatives."""
STRAIGHT = ("displacement", "velocity", "acceleration")
MOTIONS = {Z: STRAIGHT, Y: STRAIGHT, ROLL: ("roll", "rate of roll", "angular acceleration in roll")}
"""The same in words."""
TENSION = "positive with tension {}"


@dataclass(frozen=True, kw_only=True)
class Told:
    """One quantity of one sensor.

    Attributes
    ----------
    sensor : int
        Which, from 1.
    name, unit, text : str
        Text says what it is and where.
    moves : bool
        Whether it changes at once with a force on the rail: of rates and accelerations.
    at_rest : bool
        Whether it is there at rest.
    row : Row
        What is seen.
    weights : tuple of float
        Of the row, its rate and its acceleration.
    """

    sensor: int
    name: str
    unit: str
    text: str
    row: Row
    weights: Weights

    @property
    def moves(self) -> bool:
        """See above."""
        return any(self.weights[1:])

    @property
    def at_rest(self) -> bool:
        """See above."""
        return bool(self.weights[0])


Made = tuple[str, str, str, Row, Weights]


def told_by(
    track: Track, directions: Collection[Direction], changes: Sequence[LocalChange] = ()
) -> list[Told]:
    """All that the sensors of a track tell, where it moves in directions.

    A force that a changed spring has is of what is left of it.

    Raises
    ------
    ParameterError
        If a sensor is to tell what it cannot.
    """
    found = []
    for number, sensor in enumerate(track.sensor, start=1):
        made = {one[0]: one for one in _of(track, sensor, directions)}
        for name in sensor.quantities:
            if name not in made:
                raise ParameterError(_cannot(track, sensor, name, directions, list(made)))
        for name, unit, text, row, weights in made.values():
            if sensor.quantities and name not in sensor.quantities:
                continue
            pressed = isinstance(row, Motion) and row.stretch
            left = _left(track, sensor, changes) if pressed else 1.0
            found.append(
                Told(
                    sensor=number, name=name, unit=unit, row=row,
                    weights=(left * weights[0], left * weights[1], left * weights[2]),
                    text=f"{described(sensor)}: {text}",
                )
            )  # fmt: skip
    return found


def described(sensor: Sensor) -> str:
    """What a sensor is on, in words."""
    return f"{sensor.side} {sensor.of} at {sensor.at:g} m"


def _left(track: Track, sensor: Sensor, changes: Sequence[LocalChange]) -> float:
    """What changes leave of the spring that a sensor is at; they add up."""
    here, side = place_on(track, sensor.at), {LEFT: -1, RIGHT: 1}.get(sensor.side)
    return 1.0 + sum(
        change.value - 1
        for change in changes
        if change.what == sensor.of and side in change.sides and place_on(track, change.x) == here
    )


def _cannot(
    track: Track, sensor: Sensor, name: str, directions: Collection[Direction], known: list[str]
) -> str:
    """Why a sensor does not tell something."""
    said = f"sensor {sensor}: quantity {name!r}: must be one of {', '.join(known)}"
    more = [one[0] for one in _of(track, sensor, (Z, Y, ROLL))]
    if name in more and name not in known:
        said += "; a track in space tells it, too (--dimension spatial)"
    if sensor.of == SLAB and name == "pressure" and name not in known:
        said += "; [foundation] stiffness = 0: it lies on mounts"
    return said


def _of(track: Track, sensor: Sensor, directions: Collection[Direction]) -> Iterator[Made]:
    kinds: Mapping[str, Callable[[Track, Sensor, Collection[Direction]], Iterator[Made]]] = {
        RAIL: _of_rail, SLAB: _of_slab, FASTENING: _of_fastening,
    }  # fmt: skip
    yield from kinds.get(sensor.of, _of_layer)(track, sensor, directions)


def _moved(motion: Callable[[Direction], Motion], d: Direction) -> Iterator[Made]:
    """A motion in a direction, its rate and its acceleration."""
    for (name, (per, weights)), words in zip(MOVES.items(), MOTIONS[d], strict=True):
        text = f"{words}, {d.positive}"
        yield name.format(d.name), d.motion + per, text, motion(d), weights


def _of_rail(track: Track, sensor: Sensor, directions: Collection[Direction]) -> Iterator[Made]:
    place, rail = place_on(track, sensor.at), track.rail
    for d in directions:
        yield from _moved(lambda d: Motion(place=place, side=sensor.side, direction=d), d)
    bends = partial(RailMoment, place=place, side=sensor.side)
    if Z in directions:
        below = TENSION.format("below")
        yield "bending_moment", "N.m", f"bending moment, {below}", bends(direction=Z), VALUE
        per = (1 / rail.section_modulus_foot, 0.0, 0.0)
        text = "stress by bending, in the middle of the foot's underside, tension positive"
        yield "stress", "N/m2", text, bends(direction=Z), per
    if Y in directions:
        text = f"lateral bending moment, {TENSION.format('on the right')}"
        yield "bending_moment_lateral", "N.m", text, bends(direction=Y), VALUE


def _of_slab(track: Track, sensor: Sensor, directions: Collection[Direction]) -> Iterator[Made]:
    place, ground, slab = place_on(track, sensor.at), track.foundation, track.slab
    body, y = len(track.layers) + 1, _across(track, sensor)
    on = partial(Motion, place=place, side=sensor.side, body=body, y=y)
    for d in (d for d in (Z, Y) if d in directions):
        yield from _moved(lambda d: on(direction=d), d)
    if Z not in directions:
        return
    if ground.series_stiffness:
        weights = (ground.series_stiffness, ground.damping, 0.0)
        text = "pressure on the foundation, beyond that of its own weight"
        yield "pressure", "N/m2", text, on(direction=Z), weights
    bends = SlabMoment(place=place, side=sensor.side, y=y)
    below = TENSION.format("below")
    text = f"bending moment along the track, of a metre of its width, {below}"
    yield "bending_moment", "N.m/m", text, bends, VALUE
    text = "stress along the track at the underside, tension positive"
    yield "stress", "N/m2", text, bends, (6 / slab.thickness**2, 0.0, 0.0)


def _of_fastening(
    track: Track, sensor: Sensor, directions: Collection[Direction]
) -> Iterator[Made]:
    springs = springs_of(track.fastening, directions)
    yield from _pressed(track, sensor, 0, springs, track.fastening.loss_factor)


def _of_layer(track: Track, sensor: Sensor, directions: Collection[Direction]) -> Iterator[Made]:
    body = next(k for k, one in enumerate(track.layers, start=1) if one.called == sensor.of)
    layer, place, y = track.layers[body - 1], place_on(track, sensor.at), _across(track, sensor)
    yield from _moved(
        lambda d: Motion(place=place, side=sensor.side, direction=d, body=body, y=y), Z
    )
    if sensor.side != MIDDLE:
        springs = [Spring(Z, layer.stiffness, layer.damping)]
        yield from _pressed(track, sensor, body, springs, layer.loss_factor)


def _pressed(
    track: Track, sensor: Sensor, joint: int, springs: list[Spring], loss_factor: float
) -> Iterator[Made]:
    """Force on what is below, of one railseat; per metre of what is continuous."""
    smeared = is_continuous(track, sensor.of)
    per = 1 / track.fastening.spacing if smeared else 1.0
    of_loss = loss_factor / (2 * math.pi * track.mesh.loss_factor_frequency)
    whose = "on what it lies on" if joint else "of the rail on what is below"
    for spring in springs:
        d = spring.direction
        row = Motion(
            place=place_on(track, sensor.at), side=sensor.side, direction=d, body=joint,
            y=_across(track, sensor), stretch=True,
        )  # fmt: skip
        weights = (per * spring.stiffness, per * (spring.damping + of_loss * spring.stiffness), 0.0)
        what = "moment" if d is ROLL else "force"
        where = "compression positive" if d is Z else f"{d.positive} positive"
        if smeared:
            yield "line_force", "N/m", f"force {whose}, of a metre, {where}", row, weights
        else:
            yield d.effort, d.force, f"{what} {whose}, {where}", row, weights


def _across(track: Track, sensor: Sensor) -> float:
    """From the middle of the track, on the right, m."""
    return 0.0 if sensor.side == MIDDLE else track.rail.lateral_distance / 2
