"""Direct receptance: one cell condensed to its ends, then joined to a ring or to an endless track.

Nothing is truncated: at every frequency the finite elements are solved as they stand.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress
from typing import Protocol, TypeVar

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Z
from railcosim.parameters import ParameterError

from .cell import EVEN, ODD, Cell, build_cell, independent
from .condensation import CondensedCell, condense
from .layers import MASS
from .local import LocalChange, SpringPlace, changed_by, check_left, masses_at, springs_at
from .parameters import MOST_CELLS, Track
from .section import directions_for
from .waves import waves

Progress = Callable[[int, int], None]

BLOCK = 128  # frequencies solved at once: some 10 MB of matrices
BOTH = 0  # sides


@dataclass(frozen=True, kw_only=True)
class Point:
    """A point of the track where it is loaded or observed.

    Attributes
    ----------
    x : float
        Along the track, m; on a ring it wraps. Cells begin at multiples of the cell length.
    side : int
        -1 left, 1 right; `BOTH`: the same on each, at mirrored offsets. As much of a load acts on
        either, and what is observed of both is their sum.
    slab_y : float or None
        None: at the head of the rail of that side. Else on the slab, this far from the centre line
        (m, >= 0).
    direction : Direction
        Of load and motion.
    offset : float
        On the rail, to the right of the middle of the head, m; of `BOTH` on the right one.
    """

    x: float
    side: int = -1
    slab_y: float | None = None
    direction: Direction = Z
    offset: float = 0.0

    @property
    def on_rail(self) -> bool:
        """Whether a rail is loaded there, and so gets a node."""
        return self.slab_y is None

    def row(self, cell: Cell) -> FloatArray:
        """Participation in the unknowns of its cell, shape (n,)."""
        x = self.x % cell.track.cell_length
        if self.slab_y is None:
            row = cell.rail_row(x, self.direction, (self.side or 1) * self.offset)
        else:
            row = cell.slab_row(x, self.slab_y, self.direction)
        left = cell.left(self.direction)
        return row * {-1: left, 1: 1, BOTH: 1 + left}[self.side]


class Place(Protocol):
    """Where a load acts, or a motion is seen."""

    @property
    def x(self) -> float:
        """Along the track, m."""

    @property
    def direction(self) -> Direction:
        """Of load and motion."""

    @property
    def on_rail(self) -> bool:
        """Whether a rail is loaded there, and so gets a node."""

    def row(self, cell: Cell) -> FloatArray:
        """Participation in the unknowns of its cell, shape (n,)."""


P = TypeVar("P", bound=Place)


class Joined(Protocol):
    """Ends of cells that are joined: what a force at one does to another."""

    def away(self, cells: int) -> ComplexArray:
        """Motion of an end for unit loads that many cells behind, (n_omega, d, d)."""

    def is_same(self, cells: int) -> bool:
        """Whether that many cells further is the same cell."""


Join = Callable[[CondensedCell], Joined]


@dataclass(frozen=True, kw_only=True)
class Ring:
    """Ends of a ring of cells.

    Attributes
    ----------
    between : array, shape (n_omega, n_cells, d, d)
        Motion of every end for unit loads at the first.
    """

    between: ComplexArray

    def away(self, cells: int) -> ComplexArray:
        """See `Joined`."""
        return self.between[:, cells % self.between.shape[1]]

    def is_same(self, cells: int) -> bool:
        """See `Joined`."""
        return not cells % self.between.shape[1]


def ring(cell: CondensedCell, cells: int) -> Ring:
    """Close equal cells by Bloch waves: the end of a cell is its beginning, e^{i mu} further on."""
    S, d = cell.stiffness[:, None], cell.stiffness.shape[1] // 2
    turn = np.exp(2j * np.pi * np.arange(cells) / cells)[:, None, None]
    forward, backward = S[..., :d, d:] * turn, S[..., d:, :d] / turn
    waves_of_all = np.linalg.inv(S[..., :d, :d] + S[..., d:, d:] + forward + backward)
    return Ring(between=np.fft.ifft(waves_of_all, axis=1))


def direct_receptance(
    track: Track,
    omega: FloatArray,
    loads: list[Point],
    observed: list[Point],
    progress: Progress | None = None,
    *,
    viscous: bool = False,
    changes: Sequence[LocalChange] = (),
) -> ComplexArray:
    """Receptance between points of the ring, solved directly from the finite elements.

    Parameters
    ----------
    track : Track
        Parameters.
    omega : array, shape (n_omega,)
        Frequencies, rad/s; zero is the static flexibility.
    loads, observed : list of Point
        Where a unit load acts, and where the motion is wanted, in the points' directions. All down:
        the vertical model; else the spatial one.
    progress : callable, optional
        Called with (done, total).
    viscous : bool
        Loss factors as viscous damping, as the time domain has them.
    changes : sequence of LocalChange
        What is different at single places; of the vertical model.

    Returns
    -------
    array, shape (n_omega, n_observed, n_loads)
        m/N; rad for m where a roll is observed, N m for N where a moment acts.

    References
    ----------
    Mead, D. J. (1973), A general theory of harmonic wave propagation in linear periodic systems
    with multiple coupling, J. Sound Vib. 27(2), 235-260.
    """

    def join(cell: CondensedCell) -> Joined:
        return ring(cell, track.mesh.cells)

    return _receptance(
        track, omega, loads, observed, join, progress, viscous=viscous, changes=changes,
        cells=track.mesh.cells,
    )  # fmt: skip


def ring_receptance(
    track: Track,
    omega: FloatArray,
    loads: Sequence[Place],
    observed: Sequence[Place],
    changes: Sequence[LocalChange] = (),
) -> ComplexArray:
    """The same between places of any kind; loss factors as viscous damping."""

    def join(cell: CondensedCell) -> Joined:
        return ring(cell, track.mesh.cells)

    return _receptance(
        track, omega, loads, observed, join, None, viscous=True, changes=changes,
        cells=track.mesh.cells,
    )  # fmt: skip


def infinite_receptance(
    track: Track,
    omega: FloatArray,
    loads: list[Point],
    observed: list[Point],
    progress: Progress | None = None,
    *,
    viscous: bool = False,
    changes: Sequence[LocalChange] = (),
) -> ComplexArray:
    """Receptance between points of an endless track, by the waves that decay away from a load.

    The same finite elements as the ring's, without its other side: exact but for rounding, so the
    difference to `direct_receptance` is the error of the ring. Nothing is asked of
    `track.mesh.cells`. See `direct_receptance` for parameters and result.
    """
    return _receptance(
        shortest(track), omega, loads, observed, waves, progress, viscous=viscous, changes=changes
    )


def shortest(track: Track) -> Track:
    """The endless track with the shortest cell: on rigid ground no slab makes it longer than a bay.

    Cells of both begin midway between two railseats, so places along the track stay what they are.
    """
    if track.slab.present:
        return track
    cells = min(track.bays * track.mesh.cells, MOST_CELLS)  # as long a ring
    slab = replace(track.slab, length=track.fastening.spacing, joint=0.0)
    return replace(track, slab=slab, mesh=replace(track.mesh, cells=cells))


def _receptance(
    track: Track,
    omega: FloatArray,
    loads: Sequence[Place],
    observed: Sequence[Place],
    join: Join,
    progress: Progress | None,
    *,
    viscous: bool,
    changes: Sequence[LocalChange],
    cells: int | None = None,
) -> ComplexArray:
    omega = np.atleast_1d(np.asarray(omega, dtype=float))
    places: list[Place] = []
    added: list[ComplexArray] = []
    changed: list[tuple[LocalChange, SpringPlace]] = []
    for change in changes:
        if change.gap is not None:
            raise ParameterError(
                f"{change}: a gap that closes has no frequency response; say {change.what}@"
                f"{change.x:g}=0 for one that stays open, nothing for one that stays closed"
            )
        if change.what == MASS:
            here: list[Place] = [Point(x=change.x, side=side) for side in change.sides]
            D: ComplexArray = (-masses_at(change) * omega**2).astype(complex)
        else:
            springs, one = springs_at(track, change)
            here = list(springs)
            changed += [(change, spring) for spring in springs]
            if viscous:
                one = one.made_viscous(2 * np.pi * track.mesh.loss_factor_frequency)
            D = (change.value - 1) * one.dynamic_stiffness(omega)
        places += here
        added += [D] * len(here)
    check_left(track, changed, cells)
    of, at = [*loads, *places], [*observed, *places]
    if places and (track.rails_tilt or any(p.direction is not Z for p in (*of, *at))):
        raise ParameterError(
            f"{changes[0].what}@{changes[0].x:g}: single places change in the vertical model only, "
            "for loads and motions down, with [slab] tilts_rails = false"
        )
    found = periodic(track, omega, of, at, join, progress, viscous=viscous)
    if not places:
        return found
    return changed_by(found, np.stack(added, axis=1), len(observed), len(loads))


def periodic(
    track: Track,
    omega: FloatArray,
    loads: Sequence[Place],
    observed: Sequence[Place],
    join: Join,
    progress: Progress | None,
    *,
    viscous: bool,
) -> ComplexArray:
    """Of equal cells, joined in some way; see `direct_receptance`."""
    on_rail = [p.x % track.cell_length for p in (*loads, *observed) if p.on_rail]
    directions = directions_for(
        (p.direction for p in (*loads, *observed)), coupled=track.rails_tilt
    )

    def solver(parity: int, group: tuple[Direction, ...]) -> Callable[..., ComplexArray]:
        cell = build_cell(track, parity, np.array(on_rail), group)
        return partial(_one_parity, cell.made_viscous() if viscous else cell, join)

    return of_parities(independent(track, directions), solver, omega, loads, observed, progress)


def of_parities(
    groups: Sequence[tuple[Direction, ...]],
    solver_of: Callable[[int, tuple[Direction, ...]], Callable[..., ComplexArray]],
    omega: FloatArray,
    loads: Sequence[P],
    observed: Sequence[P],
    progress: Progress | None,
) -> ComplexArray:
    """Of both parities and all groups of directions, each by its own solver.

    Parameters
    ----------
    groups : sequence of tuple of Direction
        Which know nothing of each other.
    solver_of : callable
        Of a parity and a group: frequencies, loads and places observed to a receptance of a unit
        load of that parity on one rail, (n_omega, n_observed, n_loads).
    omega, loads, observed, progress
        See `direct_receptance`.
    """
    out = np.zeros((omega.size, len(observed), len(loads)), dtype=complex)
    solvers = [(solver_of(parity, g), g) for g in groups for parity in (EVEN, ODD)]
    for start in range(0, omega.size, BLOCK):
        part = slice(start, start + BLOCK)
        for solve, group in solvers:
            rows = np.array([_concerns(p, group) for p in observed])
            columns = np.array([_concerns(p, group) for p in loads])
            if any(rows) and any(columns):
                some = list(compress(loads, columns)), list(compress(observed, rows))
                # A load on one rail is half an even and half an odd one.
                half = 0.5 * solve(omega[part], *some)
                out[np.ix_(np.arange(omega.size)[part], rows, columns)] += half
        if progress:
            progress(min(start + BLOCK, omega.size), omega.size)
    return out


def _concerns(place: Place, group: tuple[Direction, ...]) -> bool:
    """Whether a group of directions has a part in it: beside the head's middle all have."""
    return place.direction in group or (isinstance(place, Point) and bool(place.offset))


def _one_parity(
    cell: Cell, join: Join, omega: FloatArray, loads: Sequence[Place], observed: Sequence[Place]
) -> ComplexArray:
    F = np.stack([p.row(cell) for p in loads], axis=1)
    W = np.stack([p.row(cell) for p in observed], axis=1)
    if not (np.any(F) and np.any(W)):  # loads on both rails leave one parity at rest
        return np.zeros((omega.size, len(observed), len(loads)), dtype=complex)
    condensed = condense(cell, omega, F, W)
    joined = join(condensed)
    length = cell.track.cell_length
    at, of = (np.array([int(p.x // length) for p in ps]) for ps in (observed, loads))
    apart = at[:, None] - of[None, :]
    out = np.empty((omega.size, *apart.shape), dtype=complex)
    for d in map(int, np.unique(apart)):
        near, far = joined.away(d), (joined.away(d - 1), joined.away(d + 1))
        ends = np.block([[near, far[0]], [far[1], near]])  # (n_omega, 2 d, 2 d)
        rows, columns = np.nonzero(apart == d)
        moved = np.einsum(
            "wpe,wef,wfp->wp",
            condensed.motions[:, rows], ends, condensed.forces[:, :, columns], optimize=True,
        )  # fmt: skip
        if joined.is_same(d):
            moved += condensed.within[:, rows, columns]
        out[:, rows, columns] = moved
    return out
