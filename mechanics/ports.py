"""What meets at a wheel: directions, ports and their order. The only place that knows these.

x forward, y to the right, z down, in one frame for both rails. Needs numpy only.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Numbers = TypeVar("Numbers", NDArray[np.float64], NDArray[np.complex128])

MOST_WHEELSETS = 64
"""In one layout: eight vehicles of eight."""


@dataclass(frozen=True)
class Direction:
    """Along what a wheel and a rail push each other.

    Attributes
    ----------
    name : str
        Last part of a motion's name.
    effort : str
        Last part of the name of the force that does work on it; about an axis, of the moment.
    motion, force : str
        Their units.
    mirror : int
        Sign that a motion takes in the mirror between the rails: a rail that moves as its mirror
        image does, moves by as much downwards, but by the opposite to the right.
    positive : str
        Where a positive motion goes, in words.
    """

    name: str
    effort: str
    motion: str
    force: str
    mirror: int
    positive: str


Z = Direction("z", "force_z", "m", "N", 1, "down")
Y = Direction("y", "force_y", "m", "N", -1, "to the right")
X = Direction("x", "force_x", "m", "N", 1, "forward")
ROLL = Direction(
    "roll", "moment_x", "rad", "N.m", -1, "about the forward axis, the right side down"
)
YAW = Direction(
    "yaw", "moment_z", "rad", "N.m", -1, "about the downward axis, the front to the right"
)
DIRECTIONS = (Z, Y, ROLL, X, YAW)
"""All that have a name, the vertical one first."""

DIMENSIONS = {"vertical": (Z,), "spatial": (Z, Y, ROLL)}
"""In what directions rails are met, by the name of the choice."""
OF_WHEELS = DIMENSIONS | {"spatial": (*DIMENSIONS["spatial"], X, YAW)}
"""Likewise wheels, which are pushed and turned along the track as well: a rail gives no way there.
The directions of the rail come first."""
ROUGH = (Z, Y)
"""In what directions the surface of a rail can lie off its place."""


@dataclass(frozen=True)
class Face:
    """One of the two that meet: its words in names, and which way a compression pushes it.

    Attributes
    ----------
    name : str
        wheel or rail.
    push : int
        1: a positive contact force pushes it along the direction, as a rail goes down; -1: against
        it, as a wheel is lifted.
    """

    name: str
    push: int

    @property
    def motion(self) -> str:
        """Its displacement as a quantity."""
        return self.name + "_{}"

    @property
    def rate(self) -> str:
        """Its velocity as a quantity."""
        return self.name + "_v{}"

    @property
    def effort(self) -> str:
        """The force on it as a quantity, where that on the other is not the same number."""
        return self.name + "_{effort}"

    @property
    def other(self) -> Face:
        """What it meets."""
        return RAIL if self.push < 0 else WHEEL


WHEEL, RAIL = Face("wheel", -1), Face("rail", 1)
FORCE, IRREGULARITY = "{effort}", "irregularity_{}"
QUANTITIES = (FORCE, IRREGULARITY, WHEEL.motion, WHEEL.rate, RAIL.motion, RAIL.rate)
"""Of a port: patterns of the last part of a name, to be filled by the direction's names."""
MOTIONS = {WHEEL.motion: -WHEEL.push, RAIL.motion: -RAIL.push, IRREGULARITY: -1}
"""With what sign a motion adds to a compression. Where the rail's surface is low, by the
irregularity, it is farther from the wheel."""

SIDES = ("left", "right")


def wheelset_name(wheelset: int) -> str:
    """Name of a wheelset, which are counted from 1, from the front."""
    return f"wheelset[{wheelset}]"


def wheelset_of(name: str) -> tuple[int, str] | None:
    """Of which wheelset a variable is, and what of it, by its name; None if of none."""
    owner, _, rest = name.partition(".")
    return (_NUMBERS[owner], rest) if owner in _NUMBERS else None


_NUMBERS = {wheelset_name(i): i for i in range(1, MOST_WHEELSETS + 1)}


@dataclass(frozen=True)
class Port:
    """One direction of one contact.

    Attributes
    ----------
    wheelset : int
        From 1, from the front.
    side : str
        left or right.
    direction : Direction
        Of force and motion.
    """

    wheelset: int
    side: str
    direction: Direction = Z

    @property
    def wheel(self) -> str:
        """Name of the wheel, and of its contact."""
        return f"{wheelset_name(self.wheelset)}.{self.side}"

    def name(self, quantity: str) -> str:
        """Name of a variable; `quantity` is one of `QUANTITIES`."""
        known = self.direction
        return f"{self.wheel}.{quantity.format(known.name, effort=known.effort)}"


@dataclass(frozen=True)
class Layout:
    """The ports of a vehicle or a track, in their order: left wheels first, each from the front.

    All directions of a contact stand together, so an array over ports is one of shape
    (sides, wheelsets, directions), and of shape (contacts, directions).

    Attributes
    ----------
    wheelsets : int
        How many, counted from 1.
    sides : tuple of str
        Rails that are loaded: both, or the left one.
    directions : tuple of Direction
        Of every contact.

    Raises
    ------
    ValueError
        If there are no or too many wheelsets, or unknown sides.
    """

    wheelsets: int = 4
    sides: tuple[str, ...] = SIDES
    directions: tuple[Direction, ...] = (Z,)

    def __post_init__(self) -> None:
        if not 1 <= self.wheelsets <= MOST_WHEELSETS:
            raise ValueError(f"{self.wheelsets} wheelsets: must be 1 to {MOST_WHEELSETS}")
        if self.sides not in (SIDES, SIDES[:1]) or not self.directions:
            raise ValueError(f"sides {self.sides}: must be {SIDES} or {SIDES[:1]}")

    @classmethod
    def among(cls, names: Collection[str]) -> Layout | None:
        """The layout whose names are among others'; None if there is no port.

        Parameters
        ----------
        names : collection of str
            Of the variables of an FMU, whoever made it.
        """
        known = set(names)

        def found(port: Port) -> bool:
            return any(port.name(quantity) in known for quantity in QUANTITIES)

        def ports(i: int) -> list[Port]:
            return [Port(i, side, d) for d in DIRECTIONS for side in SIDES]

        count = next(
            (i for i in range(MOST_WHEELSETS) if not any(map(found, ports(i + 1)))), MOST_WHEELSETS
        )
        if not count:
            return None
        there = [port for port in ports(1) if found(port)]
        sides = tuple(side for side in SIDES if any(p.side == side for p in there))
        directions = tuple(d for d in DIRECTIONS if any(p.direction is d for p in there))
        return cls(count, sides, directions)

    @cached_property
    def ports(self) -> tuple[Port, ...]:
        """All ports, in order."""
        return tuple(
            Port(i, side, direction)
            for side in self.sides
            for i in self.numbers
            for direction in self.directions
        )

    @property
    def dimension(self) -> str:
        """What users call such directions; their names where they call them nothing."""
        known = (DIMENSIONS, OF_WHEELS)
        named = {directions: name for of in known for name, directions in of.items()}
        return named.get(self.directions, ", ".join(d.name for d in self.directions))

    @property
    def surface(self) -> Layout:
        """The same wheels, in the directions in which there is irregularity."""
        return replace(self, directions=tuple(d for d in self.directions if d in ROUGH))

    @property
    def rails(self) -> Layout:
        """Ports of the rails under wheels that have these: the same, less what no rail gives."""
        return Layout(self.wheelsets, self.sides, DIMENSIONS.get(self.dimension, self.directions))

    @property
    def down(self) -> Layout:
        """The same wheels, downwards alone."""
        return replace(self, directions=(Z,))

    @property
    def numbers(self) -> range:
        """Of the wheelsets."""
        return range(1, self.wheelsets + 1)

    @property
    def contacts(self) -> int:
        """How many wheels meet a rail."""
        return len(self.sides) * self.wheelsets

    @cached_property
    def wheels(self) -> tuple[str, ...]:
        """Names of the wheels, in order."""
        return tuple(dict.fromkeys(port.wheel for port in self.ports))

    @cached_property
    def axles(self) -> tuple[str, ...]:
        """Names of the wheelsets, from the front."""
        return tuple(wheelset_name(i) for i in self.numbers)

    def names(self, quantity: str) -> tuple[str, ...]:
        """Names of a quantity at all ports, in order."""
        return tuple(port.name(quantity) for port in self.ports)

    def of_axles(self, quantity: str) -> tuple[str, ...]:
        """Names of a quantity of the wheelsets, such as ``position``."""
        return tuple(f"{axle}.{quantity}" for axle in self.axles)

    def ports_of(self, wheelset: int) -> tuple[Port, ...]:
        """Ports of one wheelset."""
        return tuple(port for port in self.ports if port.wheelset == wheelset)

    # --- what the order means for arrays -------------------------------------------------------

    @cached_property
    def compression(self) -> FloatArray:
        """S, shape (ports, 3 ports): compressions by the motions named by `motions`."""
        S: FloatArray = np.zeros((len(self.ports), len(self.motions)))
        for row, signs in enumerate(S.reshape(len(S), len(S), -1)):
            signs[row] = list(MOTIONS.values())
        return S

    @cached_property
    def motions(self) -> tuple[str, ...]:
        """Names of what makes a compression, three a port, as columns of `compression`."""
        return tuple(port.name(quantity) for port in self.ports for quantity in MOTIONS)

    @cached_property
    def mirror(self) -> FloatArray:
        """Signs of the ports of one side in the mirror, shape (wheelsets x directions,)."""
        return np.tile([float(d.mirror) for d in self.directions], self.wheelsets)

    def halves(self, at_ports: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Part the last axis, of ports, into what is its own mirror image and its opposite.

        Of forces: loads that drive even and odd modes, each of shape
        (..., wheelsets x directions). On one rail alone a force is both.
        """
        left, *right = np.split(at_ports, len(self.sides), axis=-1)
        if not right:
            return left, left
        image = self.mirror * right[0]
        return left + image, left - image

    def joined(self, even: Numbers, odd: Numbers) -> Numbers:
        """Motions of all ports from those of even and of odd modes, on the last axis."""
        if len(self.sides) == 1:
            return even + odd
        return np.concatenate([even + odd, self.mirror * (even - odd)], axis=-1)

    def both_sides(self, left: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Repeat what moves the left contacts, (wheelsets, directions, ...), for the right ones.

        There all is as in the mirror between the rails.
        """
        signs = np.array([float(d.mirror) for d in self.directions]).reshape(-1, 1)
        return np.concatenate([left, signs * left][: len(self.sides)])

    def at_wheelsets(
        self, of_wheelsets: Iterable[float], along: Direction | None = None
    ) -> FloatArray:
        """Repeat values of wheelsets for their ports, in order; 0 but `along` a given direction."""
        values = np.array(list(of_wheelsets), dtype=np.float64)
        there = [float(along in (None, direction)) for direction in self.directions]
        return np.tile(np.kron(values, there), len(self.sides))
