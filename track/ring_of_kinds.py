"""A ring of stretches of several kinds of track, from the waves of each kind's own ring.

Each stretch, closed to a ring of its own, has its waves in closed form. Of all these rings one is
made by giving the ends to others: the last element of each then ends at the first node of the next
stretch, and no longer at its own. That is a change of stiffness, damping and mass between few
unknowns: the ends', and those they hold on to. So its modes are those of a changed ring
(`changed_ring`), with nothing left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .cell import Cell
from .changed_ring import MARGIN, Equal, Springs, forces, poles_below
from .local_modes import turned
from .local_ring import RingOfWaves, equal_of, heads_of
from .ring import RingModes
from .section import Beam

FEWEST_ELEMENTS = 6  # in a bay: then slopes beside a railseat know nothing of the joint
ARM = 0.1  # m, about an element: motions by rotations are of one size with others
APART = 2e4  # N s/m, at the joint that closes the ring: a mirror image of another is one no more
NODES = (0, 1, -3, -2)  # whose motion and rotation tell the slopes at a joint


@dataclass(frozen=True, kw_only=True)
class KindsModes:
    """Modes of the ring of one parity.

    Attributes
    ----------
    poles : array, shape (n,)
        Below the highest frequency, rad/s; one of each conjugate pair.
    heads : list of array, shape (2 rows, n)
        Of each stretch: motion and slope of the left head, row by row, for a force on it. At its
        end stands one more, before the joint.
    static : list of array, shape (rows,)
        What each row gives at rest, with all waves, m/N.
    """

    poles: ComplexArray
    heads: list[ComplexArray]
    static: list[FloatArray]


@dataclass(frozen=True, kw_only=True)
class _End:
    """The end of a cell, and what holds it: unknowns of its first node and of the others.

    Attributes
    ----------
    held : array of int, shape (m,)
        Unknowns of the open cell on which its last node holds.
    M, C, K : array, shape (d, d + m)
        Of the last node, by itself and by these.
    scale : array, shape (d + m,)
        By which unknowns are multiplied to be of one size: rotations by `ARM`.
    """

    held: NDArray[np.intp]
    M: FloatArray
    C: FloatArray
    K: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, cell: Cell) -> _End:
        d, n = cell.section.size, cell.rail_size
        parts, end = (cell.M, cell.viscous_damping(), cell.K), np.arange(n - d, n)
        holds = sum(np.abs(A[end]).sum(axis=0) for A in parts) > 0
        holds[end] = False
        held = np.flatnonzero(holds)
        if held.size > 2 * d:
            raise ParameterError(
                f"{cell.track.called}: rails that lie on a slab all along cannot change to another "
                "kind in time; [fastening] continuous = false, or track-receptance --then"
            )
        rotates = np.concatenate([
            [name != member.unknowns[0] for name in member.unknowns]
            for member in cell.section.members
        ])  # fmt: skip
        scale = np.where(np.concatenate([rotates, rotates[held % d]]), ARM, 1.0)
        own = np.concatenate([end, held])
        M, C, K = (A[end[:, None], own] / np.outer(scale[:d], scale) for A in parts)
        return cls(held=held, M=M, C=C, K=K, scale=scale)

    def rows(self, waves: RingModes, cells: int, d: int) -> ComplexArray:
        """The first node of the ring, where it is closed, and what holds it; (d + m, n)."""
        before = np.exp(1j * waves.mu * (cells - 1)) * waves.shapes[self.held]
        rows: ComplexArray = self.scale[:, None] * np.concatenate([waves.shapes[:d], before])
        return rows


def modes_of_kinds(
    cells: Sequence[Cell],
    counts: Sequence[int],
    waves: Sequence[RingModes],
    top: float,
    progress: Callable[[str], None] = lambda text: None,
) -> KindsModes:
    """Modes of a ring of stretches, of one parity.

    Parameters
    ----------
    cells : sequence of Cell
        One of each stretch, all of one parity.
    counts : sequence of int
        How many there are in each.
    waves : sequence of RingModes
        All those of a ring of so many of it.
    top : float
        Highest frequency, rad/s.
    progress : callable
        Told what is being done.

    Raises
    ------
    ParameterError
        If the kinds cannot be joined, or modes are not found.
    """
    _check(cells)
    rings, springs = _rings(cells, counts, waves)
    pole, U = _standing(rings, counts, MARGIN * top)
    k = len(springs.dk)
    moves = turned(pole, U, k)
    equal = rings[0].equal
    count = np.bincount(pole[moves], minlength=equal.poles.size)
    equal = replace(equal, moving=count + count[equal.mirror] * (count == 0))
    s = poles_below(equal, springs, top, progress)
    s = s.some(np.abs(s.of(equal)) < top)
    progress("shapes")
    still = ~moves & (np.abs(equal.poles[pole]) < top)
    new = [
        np.concatenate([
            *(ring.heads(z, pull, n) for ring, n in zip(rings, counts, strict=True)),
            np.sum([ring.told(z, pull) for ring in rings], axis=0),
        ])
        for z, _, pull in forces(equal, springs, s)
    ]  # fmt: skip
    shapes = np.concatenate([U[:-k, still], *new], axis=1)
    sizes = [n * len(ring.waves.shapes) for ring, n in zip(rings, counts, strict=True)]
    *heads, ends = np.split(shapes, np.cumsum(sizes))
    return KindsModes(
        poles=np.concatenate([equal.poles[pole[still]], s.of(equal)]),
        heads=_with_joints(cells, heads, ends),
        static=_at_rest(rings, springs, counts),
    )


def _check(cells: Sequence[Cell]) -> None:
    """Raise ParameterError if cells cannot be joined."""
    first = cells[0]
    for cell in cells:
        if cell.section.unknowns != first.section.unknowns:
            raise ParameterError(
                "layers that lie along the rail must be as many in every kind of track in time; "
                "see track-receptance --then for others"
            )
        if cell.track.mesh.elements_per_bay < FEWEST_ELEMENTS:
            raise ParameterError(
                f"[mesh] elements_per_bay = {cell.track.mesh.elements_per_bay}: must be at least "
                f"{FEWEST_ELEMENTS} where kinds of track change"
            )


def _rings(
    cells: Sequence[Cell], counts: Sequence[int], waves: Sequence[RingModes]
) -> tuple[list[RingOfWaves], Springs]:
    """Each kind's own ring, and what makes one of all."""
    ends, d = [_End.of(cell) for cell in cells], cells[0].section.size
    begins = np.cumsum([0, *(d + end.held.size for end in ends)])
    k, n = int(begins[-1]), [own.poles.size for own in waves]
    dk, dc, dm = np.zeros((3, k, k))
    C = np.zeros((k, sum(n)), complex)
    split = np.cumsum([0, *n])
    for i, (end, own) in enumerate(zip(ends, waves, strict=True)):
        at = slice(begins[i], begins[i + 1])
        C[at, split[i] : split[i + 1]] = end.rows(own, counts[i], d)
        holds = np.arange(begins[i] + d, begins[i + 1])
        for to, sign in ((i, -1.0), ((i + 1) % len(cells), 1.0)):
            node = begins[to] + np.arange(d)
            for total, A in ((dk, end.K), (dc, end.C), (dm, end.M)):
                total[node[:, None], node] += sign * A[:, :d]
                total[node[:, None], holds] += sign * A[:, d:]
                total[holds[:, None], node] += sign * A[:, d:].T
    dc[0, 0] += APART
    pole, equal = equal_of(RingModes.joined([_bare(own) for own in waves]), C)
    rings = []
    for i, (cell, own) in enumerate(zip(cells, waves, strict=True)):
        part = slice(split[i], split[i + 1])
        seen = np.zeros((2 * len(NODES) * len(cells), n[i]), complex)
        seen[2 * len(NODES) * i : 2 * len(NODES) * (i + 1)] = _nodes(cell, own, counts[i])
        rings.append(
            RingOfWaves(
                waves=replace(own, shapes=heads_of(cell, own, both=False)),
                seen=seen, stretches=C[:, part], pole=pole[part], equal=equal,
            )
        )  # fmt: skip
    return rings, Springs(dk=dk, dc=dc, dm=dm)


def _bare(waves: RingModes) -> RingModes:
    return replace(waves, shapes=waves.shapes[:0])


def _nodes(cell: Cell, waves: RingModes, count: int) -> ComplexArray:
    """Motion and rotation of the rail at `NODES` of the first and the last cell."""
    sign = np.sqrt(0.5) * Z.mirror
    d, last = cell.section.size, cell.nodes.size
    rows = []
    for node in NODES:
        own = d * (node % last)
        turn = np.exp(1j * waves.mu * (count - 1 if node < 0 else 0))
        rows.append(sign * turn * waves.shapes[own : own + 2])
    return np.concatenate(rows)


def _standing(
    rings: Sequence[RingOfWaves], counts: Sequence[int], below: float
) -> tuple[NDArray[np.intp], ComplexArray]:
    """Modes of all rings below a frequency: heads of one behind those of the other."""
    found = [ring.standing(below, n) for ring, n in zip(rings, counts, strict=True)]
    behind = len(rings[0].seen) + len(rings[0].stretches)
    sizes = [len(U) - behind for _, U in found]
    rows, columns = np.cumsum([0, *sizes]), np.cumsum([0, *(U.shape[1] for _, U in found)])
    whole = np.zeros((rows[-1] + behind, columns[-1]), complex)
    for i, (_, U) in enumerate(found):
        part = slice(columns[i], columns[i + 1])
        whole[rows[i] : rows[i + 1], part] = U[:-behind]
        whole[-behind:, part] = U[-behind:]
    return np.concatenate([pole for pole, _ in found]), whole


def _with_joints(
    cells: Sequence[Cell], heads: Sequence[ComplexArray], ends: ComplexArray
) -> list[ComplexArray]:
    """Heads with slopes at the joints, and rows before these.

    A slope is the rotation and the shear angle, which elements have constant each: at a node the
    mean of both sides, as in `heads`; at a joint that of the shear forces, if sections differ.
    """
    kinds, out = len(cells), [own.copy() for own in heads]
    node = ends.reshape(kinds, len(NODES), 2, -1)
    for i, behind in enumerate(node):
        ahead, j = node[(i + 1) % kinds], (i + 1) % kinds
        last = _shear(cells[i], behind[3], ahead[0], -1)
        before = _shear(cells[i], behind[2], behind[3], -2)
        first = _shear(cells[j], ahead[0], ahead[1], 0)
        GA, GA_ahead = (_rail(cells[n]).shear for n in (i, j))
        force = (GA * last + GA_ahead * first) / 2
        out[i][-1] = behind[3][1] + (before + last) / 2
        out[j][1] = ahead[0][1] + force / GA_ahead
        joint = np.stack([ahead[0][0], ahead[0][1] + force / GA])
        out[i] = np.concatenate([out[i], joint])
    return out


def _rail(cell: Cell) -> Beam:
    rail = cell.section.members[0]
    if not isinstance(rail, Beam):
        raise TypeError("a vertical model begins with a rail that bends")
    return rail


def _shear(cell: Cell, a: ComplexArray, b: ComplexArray, element: int) -> ComplexArray:
    """Shear angle in an element between nodes of motion and rotation, (2, n) each."""
    L = np.diff(cell.nodes)[element]
    phi = _rail(cell).softness(L)
    angle: ComplexArray = phi / (1 + phi) * ((b[0] - a[0]) / L - (a[1] + b[1]) / 2)
    return angle


def _at_rest(
    rings: Sequence[RingOfWaves], springs: Springs, counts: Sequence[int]
) -> list[FloatArray]:
    """What every row gives at rest, (rows,) of each stretch, and of the joint behind it."""
    equal: Equal = rings[0].equal
    one = np.eye(len(springs.dk), dtype=complex)
    within = one.real - springs.dk @ np.sum(equal.residues.T / equal.poles, axis=2).real
    taken = np.linalg.solve(within, springs.dk)
    static = []
    for ring, n in zip(rings, counts, strict=True):
        w, waves = ring.waves.shapes[::2], ring.waves
        own = -np.sum(w * w[:, waves.partner] / waves.poles, axis=1).real
        H = ring.heads(one, np.tile(-1 / equal.poles, (len(one), 1)), n)[::2].real
        static.append(np.tile(own, n) - np.sum(H * (H @ taken.T), axis=1))
    return [
        np.append(own, ahead[0])
        for own, ahead in zip(static, [*static[1:], static[0]], strict=True)
    ]
