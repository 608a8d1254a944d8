"""What a vehicle is made of: rigid bodies and the springs between them, by place and axis.

x forward, y to the right, z down; roll, pitch and yaw about them, so a positive pitch lifts the
front.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TypeAlias

import numpy as np

from railcosim.mechanics.contact.geometry import Cone

Vector: TypeAlias = tuple[float, float, float]

ALONG_X: Vector = (1.0, 0.0, 0.0)
ALONG_Y: Vector = (0.0, 1.0, 0.0)
DOWN: Vector = (0.0, 0.0, 1.0)

MOVES = {"y": ALONG_Y, "z": DOWN}
TURNS = {"roll": ALONG_X, "pitch": ALONG_Y, "yaw": DOWN}
ODD = ("y", "roll", "yaw")
"""What the mirror between the rails turns round: a body that moves as its own mirror image has none
of it."""
SPIN = "spin"
"""An axle's turning about y. It turns in its boxes, so no spring knows of it."""

CARBODY, BOGIE, WHEELSET = "carbody", "bogie", "wheelset"


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body.

    Attributes
    ----------
    kind : str
        What it is: CARBODY, BOGIE or WHEELSET.
    mass : float
        kg.
    inertia : tuple of float
        About x, y and z through the centre of mass, kg m2.
    place : tuple of float
        The centre of mass, m.
    hertz_coefficient : float
        C of F = C delta^1.5 of each of its wheels, N/m^1.5; 0 of what has none.
    wheels : Cone or None
        Its wheels on their rails, as cylinders; None of what has none.
    """

    kind: str
    mass: float
    inertia: Vector
    place: Vector
    hertz_coefficient: float = 0.0
    wheels: Cone | None = None

    @property
    def directions(self) -> tuple[str, ...]:
        """Of its coordinates: two ways to move (none along the track) and three to turn."""
        about_y = SPIN if self.kind == WHEELSET else "pitch"
        return ("y", "z", "roll", about_y, "yaw")

    @property
    def inertias(self) -> tuple[float, ...]:
        """Mass or moment of inertia of each coordinate."""
        return (self.mass, self.mass, *self.inertia)


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A spring with a damper beside it, between a point of one body and the same of another.

    Attributes
    ----------
    a, b : Body
        What it is between.
    point : tuple of float or None
        Where it acts, m. None: it resists turning about its axis.
    axis : tuple of float
        Direction of unit length.
    k, c : float
        N/m and N s/m; with no point, N m/rad and N m s/rad.
    gap : float
        Travel to either side before it acts, m: a stop.
    """

    a: Body
    b: Body
    point: Vector | None
    axis: Vector
    k: float
    c: float
    gap: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether there is any stiffness or damping."""
        return self.k != 0.0 or self.c != 0.0

    def felt(self, body: Body, direction: str) -> float:
        """By how much a coordinate of a body moves that body's end along the axis (or about it)."""
        if direction == SPIN:
            return 0.0
        if direction in MOVES:
            return 0.0 if self.point is None else float(np.dot(self.axis, MOVES[direction]))
        if self.point is None:
            return float(np.dot(self.axis, TURNS[direction]))
        arm = np.subtract(self.point, body.place)
        return float(np.dot(TURNS[direction], np.cross(arm, self.axis)))


@dataclass(frozen=True, kw_only=True)
class Parts:
    """Bodies and springs, before anything is assembled.

    Attributes
    ----------
    bodies : tuple of Body
        Car bodies, then bogies, then wheelsets, each from the front.
    suspension : tuple of Spring
        What carries the weight.
    couplers : tuple of Spring
        Closed where everything stands loaded, so at rest they carry nothing.
    """

    bodies: tuple[Body, ...]
    suspension: tuple[Spring, ...]
    couplers: tuple[Spring, ...] = ()

    @property
    def springs(self) -> tuple[Spring, ...]:
        """All of them."""
        return self.suspension + self.couplers

    def reversed(self) -> Parts:
        """Turned round, the rear in front."""
        return self._everywhere(lambda p: (-p[0], -p[1], p[2]))

    def moved(self, distance: float) -> Parts:
        """Moved forward, m."""
        return self._everywhere(lambda p: (p[0] + distance, p[1], p[2]))

    def _everywhere(self, to: Callable[[Vector], Vector]) -> Parts:
        """With every place elsewhere; an axis turns as the difference of two places does."""
        body = {b: replace(b, place=to(b.place)) for b in self.bodies}
        still = np.array(to((0.0, 0.0, 0.0)))

        def elsewhere(spring: Spring) -> Spring:
            x, y, z = np.array(to(spring.axis)) - still
            return replace(
                spring,
                a=body[spring.a],
                b=body[spring.b],
                point=None if spring.point is None else to(spring.point),
                axis=(float(x), float(y), float(z)),
            )

        return Parts(
            bodies=in_order(body.values()),
            suspension=tuple(map(elsewhere, self.suspension)),
            couplers=tuple(map(elsewhere, self.couplers)),
        )


def in_order(bodies: Iterable[Body]) -> tuple[Body, ...]:
    """Car bodies, bogies, wheelsets; each from the front."""
    kinds = (CARBODY, BOGIE, WHEELSET)
    return tuple(sorted(bodies, key=lambda b: (kinds.index(b.kind), -b.place[0])))


def names_of(bodies: Sequence[Body]) -> tuple[str, ...]:
    """Names of bodies in order: numbered from the front, but for a single car body."""
    found: list[str] = []
    for kind, some in groupby(bodies, key=lambda b: b.kind):
        count = len(list(some))
        alone = kind == CARBODY and count == 1
        found += [kind] if alone else [f"{kind}[{i}]" for i in range(1, count + 1)]
    return tuple(found)
