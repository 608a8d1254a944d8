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

from railcosim.mechanics.arrays import ComplexArray
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .attached import fading
from .cell import EVEN, ODD, Cell, build_cell
from .changed_ring import MARGIN, Equal, Springs, forces, poles_below
from .layers import MASS
from .local import SIDES, LocalChange, SpringPlace, check_left, springs_at
from .parameters import Track
from .reduced import ReducedTrack
from .residual import head_shapes
from .ring import REAL_POLE, RingModes, ring_modes

STILL = 1e-10  # of the largest: a stretch that does not count
ALIKE = 1e-9  # relative difference of poles that are one

Added = tuple[SpringPlace, float, float]
"""A spring of the right rail, and what stiffness and damping it gets more."""


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
        Of fastenings and layers, on both sides alike.
    progress : callable
        Told what is being done.

    Raises
    ------
    ParameterError
        If one is of a mass, or of one side; or rails are met aside.
    """
    if reduced.directions != (Z,) or track.rails_tilt:
        raise ParameterError("single places change in the vertical model only")
    if track.sensor:
        raise ParameterError(
            f"sensor {track.sensor[0]}: sensors see a track that is equal everywhere; leave them "
            f"out, or {changes[0]}"
        )
    added = _added(track, changes)
    if not added:
        return reduced
    top, cells = 2 * np.pi * track.mesh.highest_frequency, track.mesh.cells
    found = []
    for parity, said in ((EVEN, "even"), (ODD, "odd")):
        progress(f"{said} modes of the equal ring")
        poles, shapes = _changed(build_cell(track, parity), added, top, progress)
        weight = fading(np.abs(poles) / top)
        found.append((poles[weight > 0], (shapes * np.sqrt(weight))[:, weight > 0]))
    poles = np.concatenate([own for own, _ in found])
    nodes = reduced.elements.size
    shapes = np.concatenate([own for _, own in found], axis=1)
    table = np.sqrt(0.5) * shapes.reshape(cells * nodes, 2, -1)
    whole = np.concatenate([table, table[:1]])
    residual = np.tile(reduced.residual_shapes[:-1], (cells, 1, 1))
    return replace(
        reduced,
        poles=poles,
        mu=np.zeros(poles.size),
        partner=np.arange(poles.size),
        parity=np.repeat([1.0, -1.0], [own.size for own, _ in found]),
        elements=np.arange(cells * nodes),
        table=whole.astype(np.complex64).astype(complex),
        residual_shapes=np.concatenate([residual, residual[:1]]),
        cell_length=track.length,
    )


def _added(track: Track, changes: Sequence[LocalChange]) -> list[Added]:
    added, springs = [], []
    for change in changes:
        if change.what == MASS or change.sides != SIDES:
            raise ParameterError(
                f"{change}: in time fastenings and layers change, on both sides alike"
            )
        places, one = springs_at(track, change)
        one = one.made_viscous(2 * np.pi * track.mesh.loss_factor_frequency)
        more = change.value - 1
        springs += [(change, place) for place in places]
        added += [
            (place, more * one.stiffness, more * one.damping)
            for place in places if place.side > 0 and more
        ]  # fmt: skip
    check_left(track, springs, track.mesh.cells)
    return added


@dataclass(frozen=True, kw_only=True)
class _Ring:
    """All waves of the equal ring, the head's motion and slope in them, and stretches of springs.

    Attributes
    ----------
    waves : RingModes
        Shapes are motion and slope of the left head at the nodes of a cell, (2 n_nodes, n).
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
    def of(cls, cell: Cell, added: Sequence[Added]) -> _Ring:
        track, waves = cell.track, ring_modes(cell, np.inf)
        cells = np.array([int(p.x // track.cell_length) % track.mesh.cells for p, _, _ in added])
        rows = np.array([place.row(cell) for place, _, _ in added])
        C: ComplexArray = np.exp(1j * cells[:, None] * waves.mu) * (rows @ waves.shapes)
        order = np.lexsort((waves.poles.real, waves.poles.imag))
        sorted_poles = waves.poles[order]
        new = np.abs(np.diff(sorted_poles, prepend=np.inf)) > ALIKE * np.abs(sorted_poles)
        pole = np.empty(order.size, int)
        pole[order] = np.cumsum(new) - 1
        p = sorted_poles[new]
        real = np.abs(p.imag) < REAL_POLE * np.abs(p)
        p[real] = p[real].real
        residues = np.zeros((p.size, len(added), len(added)), complex)
        half = np.where(real, 1.0, 0.5)[pole]
        each = half * C[:, None] * C[:, waves.partner]
        np.add.at(residues, pole, np.moveaxis(each, 2, 0))
        residues = (residues + np.swapaxes(residues, 1, 2)) / 2
        mirror = np.arange(p.size)
        mirror[~real] = p.size + np.arange(p.size - real.sum())
        own = head_shapes(cell, waves, (Z,))[:-1].reshape(-1, waves.poles.size)
        return cls(
            waves=replace(waves, shapes=own),
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


def _changed(
    cell: Cell, added: Sequence[Added], top: float, progress: Callable[[str], None]
) -> tuple[ComplexArray, ComplexArray]:
    """Poles below a frequency, and motion and slope of the left rail's head all round."""
    cells, k = cell.track.mesh.cells, len(added)
    ring = _Ring.of(cell, added)
    pole, U = ring.standing(MARGIN * top, cells)
    moves = _turned(pole, U, k)
    count = np.bincount(pole[moves], minlength=ring.equal.poles.size)
    equal = replace(ring.equal, moving=count + count[ring.equal.mirror] * (count == 0))
    springs = Springs(
        dk=np.array([dk for _, dk, _ in added]), dc=np.array([dc for *_, dc in added])
    )
    s = poles_below(equal, springs, top, progress)
    s = s.some(np.abs(s.of(equal)) < top)
    progress("shapes")
    new = [ring.heads(z, pull, cells) for _, z, pull in forces(equal, springs, s)]
    still = ~moves & (np.abs(equal.poles[pole]) < top)
    return (
        np.concatenate([equal.poles[pole[still]], s.of(equal)]),
        np.concatenate([U[:-k, still], *new], axis=1),
    )


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
