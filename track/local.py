"""What is different at one place of a track that is equal everywhere else.

A change of a few springs or masses has low rank: with the receptance H of the equal track between
the places changed (c), the loads (l) and what is observed (o), and the changes D of dynamic
stiffness there,

    H'_ol = H_ol - H_oc (1 + D H_cc)^-1 D H_cl,

exact, on a ring or without end, as far as may be from the load.

References
----------
Sherman, J. & Morrison, W. J. (1950), Ann. Math. Statist. 21(1), 124-127; Woodbury, M. A. (1950).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction, Z
from railcosim.parameters import ParameterError

from .below import NODE_TOLERANCE, Joint
from .cell import EVEN, Cell, build_cell
from .fastenings import Support
from .layers import MASS
from .parameters import Track
from .stack import railseats, stack_of

FASTENING = "fastening"
SIDES = (-1, 1)  # left, right
ROUNDING = 1e-9  # of sums of parts


@dataclass(frozen=True, kw_only=True)
class LocalChange:
    """One change.

    Attributes
    ----------
    what : str
        ``mass``: on the head of a rail; ``fastening``, or the name or kind of a layer: what it
        lies on, at one railseat.
    x : float
        Along the track, m, from where a cell begins; of a railseat but for a mass.
    value : float
        kg more (>= 0), or how much of stiffness and damping is left (>= 0): 0, it hangs. Changes
        of one spring add up.
    sides : tuple of int
        -1 left, 1 right.
    gap : float or None
        m, under which the spring hangs until it is closed; None: there is none. In time only.
    """

    what: str
    x: float
    value: float
    sides: tuple[int, ...] = SIDES
    gap: float | None = None

    @property
    def left(self) -> float:
        """How much of a spring's stiffness and damping is left while gaps are open."""
        return self.value if self.gap is None else 0.0

    def __str__(self) -> str:
        side = "" if self.sides == SIDES else {-1: ".left", 1: ".right"}[self.sides[0]]
        value = f"{self.value:g}" if self.gap is None else f"gap:{self.gap:g}"
        return f"{self.what}{side}@{self.x:g}={value}"


@dataclass(frozen=True, kw_only=True)
class SpringPlace:
    """A spring of the track, as a place where a load acts or a motion is seen.

    That is its stretch, times the root of its `weight` among those that hold one thing.
    """

    joint: int
    number: int
    x: float
    side: int
    direction: Direction = Z
    on_rail: bool = False
    weight: float = 1.0

    def row(self, cell: Cell) -> FloatArray:
        """Participation in the unknowns of its cell, shape (n,)."""
        row: FloatArray = _joints(cell)[self.joint].stretch(self.direction)[self.number]
        return row * (cell.left(self.direction) if self.side < 0 else 1)


def springs_at(track: Track, change: LocalChange) -> tuple[list[SpringPlace], Support]:
    """The springs that a change is of, and what one of them is.

    Raises
    ------
    ParameterError
        If there is nothing of that name, it is not at railseats, or there is no railseat.
    """
    names = [FASTENING, *(layer.called for layer in track.layers)]
    said = f"{change.what}@{change.x:g}"
    if change.what not in names:
        raise ParameterError(f"{said}: must be one of {', '.join([MASS, *names])}")
    if names.count(change.what) > 1:
        raise ParameterError(
            f"{said}: {names.count(change.what)} layers are called so; give it a name"
        )
    number = names.index(change.what)
    spacing, seats = track.fastening.spacing, railseats(track)
    # By its number in its cell: a spacing that is rounded leaves no seat that is a multiple of it.
    cell = np.floor(change.x / track.cell_length)
    own = min(int((change.x - cell * track.cell_length) / spacing), track.bays - 1)
    seat = cell * track.cell_length + seats[own]
    if abs(seat - change.x) > 1e-3:
        raise ParameterError(
            f"{said}: there is no railseat; the nearest is at {seat:g} m, all {spacing:g} m apart"
        )
    if change.value < 0:
        raise ParameterError(f"{said} = {change.value:g}: must be >= 0, the part that is left")
    joint = _joints(build_cell(track, EVEN))[number]
    if joint.points.all_along:
        raise ParameterError(f"{said}: is continuous; only what is at railseats changes at one")
    here = np.flatnonzero(np.abs(joint.points.x - seats[own]) < NODE_TOLERANCE)
    if not here.size:
        raise ParameterError(f"{said}: nothing is at that railseat")
    spring = joint.springs[0]
    loss = joint.loss_factor * spring.stiffness
    places = [
        SpringPlace(
            joint=number, number=int(k), x=float(seat), side=side,
            weight=float(joint.points.weight[k]),
        )
        for side in change.sides for k in here
    ]  # fmt: skip
    return places, Support(np.empty((0, 0)), spring.stiffness, spring.damping, loss)


def masses_at(change: LocalChange) -> float:
    """Of a change on a rail, kg.

    Raises
    ------
    ParameterError
        If it is negative: a rail that is lighter than nothing is no rail.
    """
    if change.value < 0:
        raise ParameterError(
            f"{change.what}@{change.x:g} = {change.value:g} kg: must be >= 0, what is added"
        )
    return change.value


def check_left(
    track: Track, changed: Sequence[tuple[LocalChange, SpringPlace]], cells: int | None
) -> None:
    """Raise ParameterError if changes of one spring add up to less than nothing.

    Parameters
    ----------
    track : Track
        Parameters.
    changed : sequence of (LocalChange, SpringPlace)
        Every spring of every change.
    cells : int or None
        Of the ring, where a place comes again; None: without end.
    """
    left: dict[tuple[int, int, int, int], float] = {}
    for change, place in changed:
        cell = int(place.x // track.cell_length)
        key = (place.joint, place.number, place.side, cell % cells if cells else cell)
        left[key] = left.get(key, 1.0) + change.left - 1
        if left[key] < -ROUNDING:
            raise ParameterError(
                f"{change}: changes of one railseat add up, and {left[key]:g} of it would be left; "
                "must be >= 0"
            )


def changed_by(H: ComplexArray, D: ComplexArray, n_observed: int, n_loads: int) -> ComplexArray:
    """Receptance with changes, from that of the equal track with their places behind the others.

    Parameters
    ----------
    H : array, shape (n_omega, n_observed + n, n_loads + n)
        Of the equal track.
    D : array, shape (n_omega, n)
        Dynamic stiffness that is added at each place.
    n_observed, n_loads : int
        Without the places.
    """
    o, l = slice(n_observed), slice(n_loads)  # noqa: E741 - as in the formula
    at, of = slice(n_observed, None), slice(n_loads, None)
    D = D[:, :, None]
    within = np.eye(D.shape[1]) + D * H[:, at, of]
    added: ComplexArray = H[:, o, of] @ np.linalg.solve(within, D * H[:, at, l])
    return H[:, o, l] - added


def _joints(cell: Cell) -> Sequence[Joint]:
    stack = stack_of(cell.track, cell.parity, cell.section, cell.nodes, cell.slab)
    return list(stack.joints((Z,)))
