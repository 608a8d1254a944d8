"""The reduced track with single railseats that are different: modes of the whole ring, in a table.

They are no waves any more, so the table goes round the ring: as many times larger as it has cells.
Under a wheel as much of it counts as before, so a step costs the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .attached import fading
from .cell import EVEN, ODD, Cell, build_cell, elements_per_bay, regular_nodes
from .changed_ring import MARGIN, Equal, Springs, forces, poles_below
from .layers import MASS
from .local import SIDES, LocalChange, check_left, masses_at, springs_at
from .parameters import Track
from .receptance import Place, Point
from .reduced import ReducedTrack
from .residual import head_shapes
from .ring import REAL_POLE, RingModes, ring_modes

STILL = 1e-10  # of the largest: a stretch that does not count
ALIKE = 1e-9  # relative difference of poles that are one

NEAR = 0.1  # of an element: a mass nearer to a node gets none of its own, which would be too stiff
Added = Sequence[tuple[Place, float, float, float]]
"""Places, and what stiffness, damping and mass they get more."""


def with_changes(
    track: Track,
    reduced: ReducedTrack,
    changes: Sequence[LocalChange],
    progress: Callable[[str], None] = lambda text: None,
) -> ReducedTrack:
    """A reduced track with changes.

    Exact as far as modes go: those of the changed ring are found with nothing left out, and then
    fade out as those of the equal one. What these leave out under a wheel is taken for what it is
    on the equal ring.

    Parameters
    ----------
    track : Track
        Parameters.
    reduced : ReducedTrack
        Of the equal ring, vertical.
    changes : sequence of LocalChange
        If not all are of both sides, no mode is its own mirror image.
    progress : callable
        Told what is being done.

    Raises
    ------
    ParameterError
        If there is nothing to change at a place, or rails are met aside.
    """
    if reduced.directions != (Z,) or track.rails_tilt:
        raise ParameterError("single places change in the vertical model only")
    if track.sensor:
        raise ParameterError(
            f"sensor {track.sensor[0]}: sensors see a track that is equal everywhere; leave them "
            f"out, or {changes[0]}"
        )
    apart = any(change.sides != SIDES for change in changes)
    added = _added(track, changes, SIDES if apart else SIDES[1:])
    if not added:
        return reduced
    cells = [build_cell(track, parity, _of_masses(track, added)) for parity in (EVEN, ODD)]
    groups = {"": cells} if apart else {"even ": cells[:1], "odd ": cells[1:]}
    top, found = 2 * np.pi * track.mesh.highest_frequency, []
    for said, some in groups.items():
        progress(f"{said}modes of the equal ring")
        poles, shapes, softer = _changed(some, added, top, progress)
        weight = fading(np.abs(poles) / top)
        found.append((poles[weight > 0], (shapes * np.sqrt(weight))[:, weight > 0], softer))
    poles = np.concatenate([own for own, *_ in found])
    nodes, ring = reduced.elements.size, track.mesh.cells
    shapes = np.concatenate([own for _, own, _ in found], axis=1)
    table = shapes.reshape(ring * nodes, -1, poles.size)
    whole = np.concatenate([table, table[:1]])
    softer = sum((more for *_, more in found), np.zeros(1)).reshape(ring * nodes, -1)
    residual = _residual(reduced, table[:, ::2], poles, softer)
    return replace(
        reduced,
        poles=poles,
        mu=np.zeros(poles.size),
        partner=np.arange(poles.size),
        parity=np.repeat([1.0, -1.0][: len(found)], [own.size for own, *_ in found]),
        apart=apart,
        elements=np.arange(ring * nodes),
        table=whole.astype(np.complex64).astype(complex),
        residual_shapes=np.concatenate([residual, residual[:1]]),
        cell_length=track.length,
    )


def _residual(
    reduced: ReducedTrack, motion: ComplexArray, poles: ComplexArray, softer: FloatArray
) -> ComplexArray:
    """What modes leave out all round, (places, sides, 1): as on the equal ring, but for how much.

    At rest it is all that a place gives on the changed ring, less what its modes have of it: beside
    a mass, which modes that are left out would not move, less than on the equal ring.

    Parameters
    ----------
    reduced : ReducedTrack
        Of the equal ring.
    motion, poles : array, shapes (places, sides, n) and (n,)
        Of the changed ring's modes.
    softer : array, shape (places, sides)
        By how much places give more, at rest, m/N.
    """
    equal, pole = reduced.residual_shapes[:-1], reduced.residual_poles[0]
    one = reduced.table[:-1, 0]
    left_out = -np.real(equal[:, 0] ** 2 / pole)
    of_modes = -np.sum(one * one[:, reduced.partner] / reduced.poles, axis=1).real[:, None]
    ring = len(motion) // len(one)
    now = np.tile(left_out + of_modes, (ring, 1)) + softer + np.sum(motion**2 / poles, axis=2).real
    part = np.maximum(now / np.tile(left_out, (ring, 1)), 0.0)
    whole: ComplexArray = np.tile(equal, (ring, 1, 1))
    found: ComplexArray = whole * np.sqrt(part)[:, :, None]
    return found


def _added(track: Track, changes: Sequence[LocalChange], sides: tuple[int, ...]) -> Added:
    """What is added on these sides; the other is the same, or its opposite."""
    added, springs = [], []
    for change in changes:
        if change.what == MASS:
            more = (0.0, 0.0, masses_at(change))
            its = [side for side in change.sides if side in sides]
            here: list[Place] = [Point(x=change.x, side=side) for side in its]
        else:
            places, one = springs_at(track, change)
            one = one.made_viscous(2 * np.pi * track.mesh.loss_factor_frequency)
            part = change.value - 1
            more = (part * one.stiffness, part * one.damping, 0.0)
            here = [place for place in places if place.side in sides]
            springs += [(change, place) for place in places]
        added += [(place, *more) for place in here if any(more)]
    check_left(track, springs, track.mesh.cells)
    return added


def _of_masses(track: Track, added: Added) -> FloatArray:
    """Where in a cell a rail carries one and has no node nearby, m."""
    regular = regular_nodes(track, elements_per_bay(track, (Z,)))
    at: FloatArray = np.array([place.x % track.cell_length for place, *_ in added if place.on_rail])
    apart = np.abs(regular - at[:, None]).min(axis=1, initial=np.inf)
    far: FloatArray = at[apart > NEAR * regular[1]]
    return far


@dataclass(frozen=True, kw_only=True)
class _Ring:
    """All waves of the equal ring, the head's motion and slope in them, and stretches of springs.

    Attributes
    ----------
    waves : RingModes
        Of one parity, or of both. Shapes are motion and slope of the left head at the regular nodes
        of a cell, (2 n_nodes, n), for a force on it; or, of both, of either.
    stretches : array, shape (k, n)
        Of the springs.
    pole : array of int, shape (n,)
        Which of the ring's different poles a wave has.
    equal : Equal
        Those poles; none moves as yet.
    """

    waves: RingModes
    stretches: ComplexArray
    pole: NDArray[np.intp]
    equal: Equal

    @classmethod
    def of(cls, cells: Sequence[Cell], added: Added) -> _Ring:
        track, waves = cells[0].track, [ring_modes(cell, np.inf) for cell in cells]
        # Rails are sum and difference of both parities, each with half of the energy.
        part = np.sqrt(1 / len(cells))
        own, C = [], []
        for cell, its in zip(cells, waves, strict=True):
            place = np.array([int(p.x // track.cell_length) % track.mesh.cells for p, *_ in added])
            rows = part * np.array([p.row(cell) for p, *_ in added])
            C.append(np.exp(1j * place[:, None] * its.mu) * (rows @ its.shapes))
            own.append(replace(its, shapes=_heads(cell, its, both=len(cells) > 1)))
        return cls._with(RingModes.joined(own), np.concatenate(C, axis=1))

    @classmethod
    def _with(cls, waves: RingModes, C: ComplexArray) -> _Ring:
        order = np.lexsort((waves.poles.real, waves.poles.imag))
        sorted_poles = waves.poles[order]
        new = np.abs(np.diff(sorted_poles, prepend=np.inf)) > ALIKE * np.abs(sorted_poles)
        pole = np.empty(order.size, int)
        pole[order] = np.cumsum(new) - 1
        p = sorted_poles[new]
        real = np.abs(p.imag) < REAL_POLE * np.abs(p)
        p[real] = p[real].real
        residues = np.zeros((p.size, len(C), len(C)), complex)
        half = np.where(real, 1.0, 0.5)[pole]
        each = half * C[:, None] * C[:, waves.partner]
        np.add.at(residues, pole, np.moveaxis(each, 2, 0))
        residues = (residues + np.swapaxes(residues, 1, 2)) / 2
        mirror = np.arange(p.size)
        mirror[~real] = p.size + np.arange(p.size - real.sum())
        return cls(
            waves=waves,
            stretches=C,
            pole=pole,
            equal=Equal(
                poles=np.concatenate([p, p[~real].conj()]),
                residues=np.concatenate([residues, residues[~real].conj()]),
                moving=np.zeros(2 * p.size - real.sum(), int),
                mirror=np.concatenate([mirror, np.flatnonzero(~real)]),
            ),
        )

    def standing(self, below: float, cells: int) -> tuple[NDArray[np.intp], ComplexArray]:
        """Modes that receive their own forces: their poles, and heads all round and stretches."""
        waves, low = self.waves, np.abs(self.equal.poles[self.pole]) < below
        index = np.arange(waves.poles.size)
        alone, first = (waves.partner == index) & low, (waves.partner > index) & low
        turn = np.exp(1j * np.arange(cells)[:, None] * waves.mu[low])
        heads = turn[:, None] * waves.shapes[:, low]
        U = np.zeros((heads.shape[0] * heads.shape[1] + len(self.stretches), index.size), complex)
        U[: -len(self.stretches), low] = heads.reshape(-1, low.sum())
        U[-len(self.stretches) :] = self.stretches
        A, B = U[:, first], U[:, waves.partner[first]]
        shapes = [U[:, alone], np.sqrt(0.5) * (A + B), 1j * np.sqrt(0.5) * (A - B)]
        pole = np.concatenate([self.pole[alone], self.pole[first], self.pole[first]])
        return pole, np.concatenate(shapes, axis=1)

    def heads(self, z: ComplexArray, pull: ComplexArray, cells: int) -> ComplexArray:
        """Heads all round in new modes with forces z, (m, k): cell by cell, (cells * rows, m)."""
        waves, real = self.waves, self.equal.mirror[self.pole] == self.pole
        felt = np.where(real, 1.0, 0.5) * self.stretches[:, waves.partner]
        number = np.rint(waves.mu * cells / (2 * np.pi)).astype(int) % cells
        parts = np.zeros((cells, waves.shapes.shape[0], len(z)), complex)
        for q in range(cells):
            here, mirrored = number == q, (-number % cells == q) & ~real
            for U, c, p in (
                (waves.shapes[:, here], felt[:, here], self.pole[here]),
                (waves.shapes[:, mirrored].conj(), felt[:, mirrored].conj(),
                 self.equal.mirror[self.pole[mirrored]]),
            ):  # fmt: skip
                parts[q] += U @ ((z @ c) * pull[:, p]).T
        turn = np.exp(2j * np.pi / cells * np.outer(np.arange(cells), np.arange(cells)))
        return np.tensordot(turn, parts, axes=1).reshape(-1, len(z))


def _heads(cell: Cell, waves: RingModes, *, both: bool) -> ComplexArray:
    """Motion and slope of the left head at regular nodes, or of `both`; for a force on one."""
    regular = regular_nodes(cell.track, elements_per_bay(cell.track, (Z,)))[:-1]
    at = np.abs(cell.nodes - regular[:, None]).argmin(axis=1)
    right = np.sqrt(0.5) * head_shapes(cell, waves, (Z,))[at]  # of odd waves, the left one upwards
    sides = [cell.left(Z) * right, right] if both else [right]
    return np.concatenate(sides, axis=1).reshape(-1, waves.poles.size)


def _changed(
    cells: Sequence[Cell], added: Added, top: float, progress: Callable[[str], None]
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Poles below a frequency, and motion and slope of the rail's heads all round.

    And by how much the heads give more at rest.
    """
    number, k = cells[0].track.mesh.cells, len(added)
    ring = _Ring.of(cells, added)
    pole, U = ring.standing(MARGIN * top, number)
    moves = _turned(pole, U, k)
    count = np.bincount(pole[moves], minlength=ring.equal.poles.size)
    equal = replace(ring.equal, moving=count + count[ring.equal.mirror] * (count == 0))
    dk, dc, dm = np.array([more for _, *more in added]).T
    springs = Springs(dk=dk, dc=dc, dm=dm)
    s = poles_below(equal, springs, top, progress)
    s = s.some(np.abs(s.of(equal)) < top)
    progress("shapes")
    new = [ring.heads(z, pull, number) for _, z, pull in forces(equal, springs, s)]
    still = ~moves & (np.abs(equal.poles[pole]) < top)
    return (
        np.concatenate([equal.poles[pole[still]], s.of(equal)]),
        np.concatenate([U[:-k, still], *new], axis=1),
        _softer(ring, springs, number),
    )


def _softer(ring: _Ring, springs: Springs, cells: int) -> FloatArray:
    """By how much every head gives more at rest, m/N; masses do not matter."""
    equal, one = ring.equal, np.eye(springs.dk.size, dtype=complex)
    H = ring.heads(one, np.tile(-1 / equal.poles, (len(one), 1)), cells)[::2].real
    within = one.real - springs.dk[:, None] * np.sum(equal.residues.T / equal.poles, axis=2).real
    taken = np.linalg.solve(within, springs.dk[:, None] * H.T)
    softer: FloatArray = -np.sum(H.T * taken, axis=0)
    return softer


def _turned(pole: NDArray[np.intp], U: ComplexArray, k: int) -> NDArray[np.bool_]:
    """Turn modes of one pole, in place, until as few as can be have stretches: which these are."""
    moves = np.zeros(pole.size, bool)
    C = U[-k:]
    largest = np.abs(C).max(axis=1)
    order = np.argsort(pole, kind="stable")
    for some in np.split(order, np.flatnonzero(np.diff(pole[order])) + 1):
        rest = some
        for row, size in zip(C, STILL * largest, strict=True):
            for a, b in pairwise(rest):
                to_a, to_b = row[a], row[b]
                norm = np.sqrt(to_a**2 + to_b**2)
                if np.abs(norm) <= size:
                    continue
                # The later one takes all, so that a third of the same pole meets it.
                first, second = U[:, a].copy(), U[:, b].copy()
                U[:, b] = (to_a * first + to_b * second) / norm
                U[:, a] = (to_b * first - to_a * second) / norm
                row[a] = 0.0
            if rest.size and np.abs(row[rest[-1]]) > size:
                moves[rest[-1]] = True
                rest = rest[:-1]
        moves[rest[(np.abs(C[:, rest]) > STILL * largest[:, None]).any(axis=0)]] = True
    return moves
