"""All waves of a ring of equal cells, as single places feel them: where the changed ring begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray
from railcosim.mechanics.ports import Z

from .cell import Cell
from .changed_ring import Equal
from .heads import head_shapes
from .receptance import Place
from .ring import REAL_POLE, RingModes, ring_modes
from .sensor_rows import Row

ALIKE = 1e-9  # relative difference of poles that are one
Added = Sequence[tuple[Place, float, float, float]]
"""Places, and what stiffness, damping and mass they get more."""


@dataclass(frozen=True, kw_only=True)
class RingOfWaves:
    """All waves of the equal ring, the head's motion and slope in them, and stretches of springs.

    Attributes
    ----------
    waves : RingModes
        Of one parity, or of both. Shapes are motion and slope of the left head on the rows of a
        cell, (2 n_rows, n), for a force on it; or, of both, of either.
    seen : array, shape (r, n)
        Parts of what sensors see, see `Row.parts`; in the signs of shapes.
    stretches : array, shape (k, n)
        Of the springs.
    pole : array of int, shape (n,)
        Which of the ring's different poles a wave has.
    equal : Equal
        Those poles; none moves as yet.
    """

    waves: RingModes
    seen: ComplexArray
    stretches: ComplexArray
    pole: NDArray[np.intp]
    equal: Equal

    @classmethod
    def of(cls, cells: Sequence[Cell], added: Added, rows: Sequence[Row]) -> RingOfWaves:
        """Of cells of one parity, or of both: where something is added, and what is seen."""
        track, waves = cells[0].track, [ring_modes(cell, np.inf) for cell in cells]
        # Rails are sum and difference of both parities, each with half of the energy.
        part = np.sqrt(1 / len(cells))
        own, C, seen = [], [], []
        for cell, its in zip(cells, waves, strict=True):
            place = np.array([int(p.x // track.cell_length) % track.mesh.cells for p, *_ in added])
            pulled = part * np.array([p.row(cell) for p, *_ in added])
            C.append(np.exp(1j * place[:, None] * its.mu) * (pulled @ its.shapes))
            seen.append(_parts(rows, cell, its, both=len(cells) > 1))
            own.append(replace(its, shapes=heads_of(cell, its, both=len(cells) > 1)))
        joined, stretches = RingModes.joined(own), np.concatenate(C, axis=1)
        pole, equal = equal_of(joined, stretches)
        return cls(
            waves=joined, seen=np.concatenate(seen, axis=1), stretches=stretches,
            pole=pole, equal=equal,
        )  # fmt: skip

    def standing(self, below: float, cells: int) -> tuple[NDArray[np.intp], ComplexArray]:
        """Modes below that receive their own forces: poles; heads all round, seen, stretches."""
        low = np.abs(self.equal.poles[self.pole]) < below
        waves, own = self.waves.some(low), self.pole[low]
        index = np.arange(waves.poles.size)
        alone, first = waves.partner == index, waves.partner > index
        turn = np.exp(1j * np.arange(cells)[:, None] * waves.mu)
        heads = turn[:, None] * waves.shapes
        behind = np.concatenate([self.seen, self.stretches])[:, low]
        U = np.concatenate([heads.reshape(-1, index.size), behind])
        A, B = U[:, first], U[:, waves.partner[first]]
        shapes = [U[:, alone], np.sqrt(0.5) * (A + B), 1j * np.sqrt(0.5) * (A - B)]
        pole = np.concatenate([own[alone], own[first], own[first]])
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

    def told(self, z: ComplexArray, pull: ComplexArray) -> ComplexArray:
        """What is seen in new modes with forces z, (r, m)."""
        real = self.equal.mirror[self.pole] == self.pole
        felt = np.where(real, 1.0, 0.5) * self.stretches[:, self.waves.partner]
        mirrored = self.equal.mirror[self.pole[~real]]
        found: ComplexArray = self.seen @ ((z @ felt) * pull[:, self.pole]).T
        other = (z @ felt[:, ~real].conj()) * pull[:, mirrored]
        return found + self.seen[:, ~real].conj() @ other.T


def equal_of(waves: RingModes, C: ComplexArray) -> tuple[NDArray[np.intp], Equal]:
    """Different poles of waves with stretches C, (k, n), none of which moves as yet.

    And which of them each wave has.
    """
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
    equal = Equal(
        poles=np.concatenate([p, p[~real].conj()]),
        residues=np.concatenate([residues, residues[~real].conj()]),
        moving=np.zeros(2 * p.size - real.sum(), int),
        mirror=np.concatenate([mirror, np.flatnonzero(~real)]),
    )
    return pole, equal


def _parts(rows: Sequence[Row], cell: Cell, waves: RingModes, *, both: bool) -> ComplexArray:
    """Parts of rows by waves, (r, n), in the signs of `heads_of`."""
    sign = np.sqrt(0.5) * (1 if both else cell.parity)
    parts = [
        sign * (part @ waves.shapes) * np.exp(1j * waves.mu * row.place.cell)
        for row in rows for _, part in row.parts(cell)
    ]  # fmt: skip
    return np.array(parts, dtype=complex).reshape(-1, waves.poles.size)


def heads_of(cell: Cell, waves: RingModes, *, both: bool) -> ComplexArray:
    """Motion and slope of the left head on the rows of a cell, or of `both`; for a force on one."""
    right = np.sqrt(0.5) * head_shapes(cell, waves, (Z,))[:-1]  # of odd waves, the left one upwards
    sides = [cell.left(Z) * right, right] if both else [right]
    return np.concatenate(sides, axis=1).reshape(-1, waves.poles.size)
