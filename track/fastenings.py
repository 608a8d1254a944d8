"""What holds a rail on its slab: springs and dampers at the foot, at every railseat."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from railcosim.mechanics.ports import ROLL, Direction, Y, Z

from .parameters import Fastening
from .section import moves_aside


@dataclass(frozen=True)
class Spring:
    """A spring and a damper between foot and slab, in one direction."""

    direction: Direction
    stiffness: float
    damping: float


def springs_of(fastening: Fastening, directions: Collection[Direction]) -> list[Spring]:
    """The springs of a fastening that act on a rail that moves in directions."""
    down = [Spring(Z, fastening.stiffness, fastening.damping)]
    aside = [
        Spring(Y, fastening.stiffness_lateral, fastening.damping_lateral),
        Spring(ROLL, fastening.roll_stiffness, fastening.roll_damping),
    ]
    return (down if Z in directions else []) + (aside if moves_aside(directions) else [])
