"""What a track hands on to the ground below: vertical forces on its foundation, all along.

The force on a cell is that of the springs there, a row of the cell's unknowns. On an endless track
the forces on all cells together are what the same load does on a ring of a single cell: the sum
over cells of a motion is its part without phase from cell to cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Z

from .below import Ground
from .cell import EVEN, Cell, build_cell
from .condensation import CondensedCell
from .parameters import Track
from .receptance import Join, Joined, Place, Point, Progress, periodic, ring, shortest
from .stack import stack_of
from .waves import waves


@dataclass(frozen=True, kw_only=True)
class Spread:
    """What a cell stands on, of one stiffness: the sum of what its springs are pressed by.

    Attributes
    ----------
    x : float
        In which cell, m.
    number : int
        Which, of those in `on_ground`.
    """

    x: float
    number: int
    side: int = 0  # both
    direction: Direction = Z
    on_rail: bool = False

    def row(self, cell: Cell) -> FloatArray:
        """Participation in the unknowns of its cell, shape (n,); of opposite rails' it is none."""
        return (1 + cell.left(Z)) * _on_ground(cell)[self.number][0]


def _on_ground(cell: Cell) -> list[tuple[FloatArray, complex, float]]:
    """Of all springs and dampers on the ground: row of one side, stiffness with loss, damping."""
    stack = stack_of(cell.track, cell.parity, cell.section, cell.nodes, cell.slab)
    found = []
    for joint in stack.joints((Z,)):
        if isinstance(joint.lower, Ground):
            weighted = np.sqrt(joint.points.weight) @ joint.stretch(Z)
            spring = joint.springs[0]
            stiffness = spring.stiffness * (1 + 1j * joint.loss_factor)
            found.append((weighted, stiffness, spring.damping))
    ground, slab = cell.track.foundation, cell.slab
    if slab is not None and (ground.stiffness or ground.damping):
        row = np.zeros(len(cell.K))
        first = row.size - slab.size
        # Half a slab; of Legendre's polynomials only that of degree 0 has an integral.
        flat = slab.plate.coefficients[:, 0, 0] * slab.slab.length * slab.slab.width / 2
        row[first : first + flat.size] = flat
        found.append((row, complex(ground.series_stiffness), ground.damping))
    return found


def _springs(track: Track, omega: FloatArray) -> ComplexArray:
    """Dynamic stiffness of each kind, shape (n_omega, kinds)."""
    kinds = _on_ground(build_cell(track, EVEN))
    each = [stiffness + 1j * omega * damping for _, stiffness, damping in kinds]
    return np.stack(each, axis=1)


def _alone(cell: CondensedCell) -> Joined:
    """A ring of one cell."""
    return ring(cell, 1)


def force_on_ground(
    track: Track, omega: FloatArray, loads: Sequence[Point], progress: Progress | None = None
) -> ComplexArray:
    """Force on all of the foundation of an endless track for unit loads, (n_omega, n_loads).

    Parameters
    ----------
    track : Track
        Parameters; nothing is asked of the number of cells.
    omega : array, shape (n_omega,)
        rad/s.
    loads : sequence of Point
        Where they act; on both rails 1 N each.
    progress : callable, optional
        Called with (done, total).
    """
    return _forces(track, omega, loads, [0], _alone, progress)[:, 0]


def force_along(
    track: Track,
    omega: FloatArray,
    loads: Sequence[Point],
    cells: Sequence[int],
    progress: Progress | None = None,
) -> ComplexArray:
    """Force on the foundation of single cells of an endless track, (n_omega, n_cells, n_loads).

    See `force_on_ground`; cell 0 begins at 0 m. Over the cell's length it is a force per length.
    """
    return _forces(track, omega, loads, cells, waves, progress)


def _forces(
    track: Track,
    omega: FloatArray,
    loads: Sequence[Point],
    cells: Sequence[int],
    join: Join,
    progress: Progress | None,
) -> ComplexArray:
    track = shortest(track)
    z = _springs(track, omega)
    length, kinds = track.cell_length, z.shape[1]
    middle = [(cell + 0.5) * length for cell in cells]
    places: list[Place] = [Spread(x=x, number=k) for x in middle for k in range(kinds)]
    found = periodic(track, omega, loads, places, join, progress, viscous=False)
    by_kind = found.reshape(omega.size, len(cells), kinds, len(loads))
    total: ComplexArray = np.einsum("wckl,wk->wcl", by_kind, z)
    return total
