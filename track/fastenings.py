"""What holds a rail on its slab: springs and dampers at the foot, at every railseat."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import ROLL, Direction, Y, Z

from .parameters import Fastening
from .section import moves_aside


@dataclass(frozen=True)
class Spring:
    """A spring and a damper between foot and slab, in one direction."""

    direction: Direction
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Support:
    """Equal springs and dampers in a cell, of one direction.

    Attributes
    ----------
    stretch : array, shape (n_springs, n)
        What each is stretched by, in the unknowns of the cell.
    stiffness, damping, loss : float
        N/m, N s/m, and the hysteretic part of the stiffness, N/m.
    """

    stretch: FloatArray
    stiffness: float
    damping: float
    loss: float

    def dynamic_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Of one, shape (n_omega,)."""
        z = self.stiffness + 1j * self.loss + 1j * omega * self.damping
        return z.astype(complex)

    def made_viscous(self, omega: float) -> Support:
        """With the loss as an equal damping at a frequency (rad/s)."""
        return replace(self, damping=self.damping + self.loss / omega, loss=0.0)


def springs_of(fastening: Fastening, directions: Collection[Direction]) -> list[Spring]:
    """The springs of a fastening that act on a rail that moves in directions."""
    down = [Spring(Z, fastening.stiffness, fastening.damping)]
    aside = [
        Spring(Y, fastening.stiffness_lateral, fastening.damping_lateral),
        Spring(ROLL, fastening.roll_stiffness, fastening.roll_damping),
    ]
    return (down if Z in directions else []) + (aside if moves_aside(directions) else [])
