"""What sensors see of the reduced track: modes, and what faded modes leave out near them.

A wheel near a sensor does to it what modes show, and more: the cusp of a bending moment under a
wheel takes all wavelengths. What is left out is local, and at rest known exactly: the finite
elements' influence line less that of the modes. It becomes two oscillators a row, driven by wheels
as they pass: exact at rest, and in phase with the force above. They take back what modes alone
would jump by under an impulse, so that rates are those of what is seen; and are well damped, for a
wheel that passes leaves a kink behind, at which one alone would ring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.observation import Observation
from railcosim.mechanics.ports import ROLL, Direction, Y, Z
from railcosim.mechanics.shapes import AlongRing

from .cell import EVEN, Cell, build_cell
from .layers import MASS
from .local import LocalChange
from .parameters import Track
from .receptance import ring_receptance
from .sensor_quantities import Told
from .sensor_rows import At, Row

REACH, SPACING = 3.0, 0.01  # m: how far what is left out reaches, and between places of its table
MOST_OF_RING = 0.45  # of its length: the table of a short ring ends before it meets itself
NATURAL, DAMPING = (1.0, 1.6), 0.4  # of the oscillators: in highest frequencies kept; ratio
INERTIA = 1.2
"""Where what is left out would swing by its inertia at low frequencies, in highest frequencies
kept: measured 1.1 to 1.3 for deflections, moments and forces in fastenings."""
BLOCK = 64  # places at which shapes are known at once: some 20 MB
SIDES = (-1, 1)


def rows_of(told: Sequence[Told]) -> list[Row]:
    """All rows, each once."""
    return list(dict.fromkeys(one.row for one in told))


@dataclass(frozen=True, kw_only=True)
class Modes:
    """The ring's modes, as wheels drive them and rows show them.

    Attributes
    ----------
    track : Track
        Parameters.
    groups : sequence of tuple of Direction
        Directions that know of each other.
    directions : tuple of Direction
        All of them, as shapes have them.
    shapes : AlongRing
        Under wheels.
    poles : array, shape (n,)
        rad/s.
    parity : array, shape (n,)
        1 or -1.
    shown : array, shape (n_rows, n)
        Rows.
    apart : bool
        See `ReducedTrack`.
    changes : sequence of LocalChange
        What is different at single places of the track.
    """

    track: Track
    groups: Sequence[tuple[Direction, ...]]
    directions: tuple[Direction, ...]
    shapes: AlongRing
    poles: ComplexArray
    parity: FloatArray
    shown: ComplexArray
    apart: bool = False
    changes: Sequence[LocalChange] = ()

    def by_forces(self, rows: slice, x: FloatArray, weights: ComplexArray) -> ComplexArray:
        """Sums over modes of shown x weight x driven, by forces on the left and the right.

        Parameters
        ----------
        rows : slice
            Of which rows.
        x : array, shape (n_places,)
            Of the forces, m.
        weights : array, shape (n_weights, n)
            Of modes.

        Returns
        -------
        array, shape (n_weights, n_rows, n_places, sides, directions)
        """
        found, k, sides = [], len(self.directions), len(SIDES) if self.apart else 1
        for some in np.split(x, range(BLOCK, x.size, BLOCK)):
            _, into, _ = self.shapes.at(some, sides * k * some.size)
            if self.apart:
                each = np.einsum("wn,rn,pn->wrp", weights, self.shown[rows], into, optimize=True)
                found.append(each.reshape(*each.shape[:2], some.size, sides, k))
                continue
            halves = [
                np.einsum("wn,rn,pn->wrp", weights[:, own], self.shown[rows, own], into[:, own],
                          optimize=True)
                for own in (self.parity > 0, self.parity < 0)
            ]  # fmt: skip
            even, odd = (half.reshape(*half.shape[:2], some.size, k) for half in halves)
            mirror = np.array([float(d.mirror) for d in self.directions])
            found.append(np.stack([even + odd, mirror * (even - odd)], axis=3))
        return np.concatenate(found, axis=2)

    def response(self, rows: slice, x: FloatArray, omega: FloatArray) -> ComplexArray:
        """At frequencies (rad/s), shape (n_omega, n_rows, n_places, sides, directions)."""
        s = 1j * omega[:, None]
        one = self.by_forces(rows, x, 0.5 / (s - self.poles))
        other = self.by_forces(rows, x, (0.5 / (s.conj() - self.poles)))
        both: ComplexArray = one + other.conj()
        return both

    def jump(self, rows: slice, x: FloatArray) -> FloatArray:
        """Of the rate under a unit force at once, (n_rows, n_places, sides, directions)."""
        return np.asarray(self.by_forces(rows, x, np.ones((1, self.poles.size), complex))[0].real)


@dataclass(frozen=True)
class _Unknown:
    """One of a rail's node."""

    cell: int
    cell_length: float
    node: int
    number: int
    side: int
    direction: Direction
    on_rail: bool = False

    @property
    def x(self) -> float:
        """In the middle of its cell, for a node at its end is of two."""
        return (self.cell + 0.5) * self.cell_length

    def row(self, cell: Cell) -> FloatArray:
        row = np.zeros(cell.K.shape[0])
        place = self.node * cell.section.size + self.number
        row[place] = cell.left(self.direction) if self.side < 0 else 1
        return row


def observation_of(modes: Modes, told: Sequence[Told]) -> Observation | None:
    """What is seen at all sensors; None if there are none."""
    rows = rows_of(told)
    if not rows:
        return None
    track = modes.track
    reach = min(REACH, MOST_OF_RING * track.length)
    count = int(reach / SPACING)
    steps: FloatArray = SPACING * np.arange(-count, count + 1, dtype=np.float64)
    top = 2 * np.pi * track.mesh.highest_frequency
    unit = complex(-DAMPING, np.sqrt(1 - DAMPING**2))
    pair: ComplexArray = (unit * top * np.array(NATURAL)).astype(np.complex128)
    into, begin = [], []
    for k, row in enumerate(rows):
        x = row.place.cell * track.cell_length + row.place.inside
        own = slice(k, k + 1)
        jump = -modes.jump(own, x + steps)[0]
        left_out = _left_out(modes, row, own, x + steps, np.zeros(1))[0].real
        into += _driven(pair, INERTIA * top, jump, left_out)
        begin += [(x + steps[0]) % track.length] * pair.size
    pole_of, table = np.tile(pair, len(rows)), np.array(into)
    # An oscillator's state is as large as those of modes: solvers know one size of all.
    usual = np.abs(modes.shapes.table[:, 0] / modes.poles).max()
    size = np.abs(table / pole_of[:, None, None, None]).max(axis=(1, 2, 3)) / usual
    size[size == 0] = 1.0
    return Observation(
        shown=modes.shown,
        poles=pole_of,
        size=size,
        into=table / size[:, None, None, None],
        begin=np.array(begin),
        spacing=SPACING,
        length=track.length,
        row=np.array([rows.index(one.row) for one in told]),
        weights=np.array([one.weights for one in told]),
    )


def _left_out(modes: Modes, row: Row, own: slice, x: FloatArray, omega: FloatArray) -> ComplexArray:
    """Of a row, by forces at places, (n_omega, n_places, sides, directions)."""
    middle = row.place.cell * modes.track.cell_length + row.place.inside
    found = -modes.response(own, x, omega)[:, 0]
    one, other = (
        _whole(modes, at, x[where], omega)
        for at, where in zip(
            row.behind_and_ahead(modes.track.cell_length),
            (x < middle, x >= middle), strict=True,
        )
    )  # fmt: skip
    found += np.concatenate([one, other], axis=1)
    return found


def _whole(modes: Modes, at: At, x: FloatArray, omega: FloatArray) -> ComplexArray:
    """The same of the finite elements, by Betti's law: what the row as a load does to heads."""
    k, track = len(modes.directions), modes.track
    found = np.zeros((omega.size, x.size, len(SIDES), k), dtype=complex)
    for group in modes.groups:
        if x.size and (at.direction in group or track.rails_tilt):
            own = [modes.directions.index(d) for d in group]
            found[..., own] = _heads(track, group, at, x, omega, modes.changes)
    return found


def _heads(
    track: Track,
    group: tuple[Direction, ...],
    at: At,
    x: FloatArray,
    omega: FloatArray,
    changes: Sequence[LocalChange],
) -> ComplexArray:
    """Motions of heads under a load, (n_omega, n_places, sides, directions).

    Between nodes as elements bend that nothing loads: exact at rest.
    """
    length = track.cell_length
    on_rail = [at.x] * at.on_rail + [change.x for change in changes if change.what == MASS]
    cell = build_cell(track, EVEN, np.array(on_rail) % length, group)
    section, nodes, d = cell.section, cell.nodes, cell.section.size
    of_cell = np.floor(x / length).astype(int)
    e = np.searchsorted(nodes, x - of_cell * length, side="right") - 1
    e = np.clip(e, 0, nodes.size - 2)
    elements, which = np.unique(np.stack([of_cell, e], axis=1), axis=0, return_inverse=True)
    mirrors = {"w": Z, "theta": Z, "v": Y, "psi": Y}
    unknowns = [
        _Unknown(int(c), length, int(first) + end, j, side, mirrors.get(name, ROLL))
        for c, first in elements for side in SIDES for end in (0, 1)
        for j, name in enumerate(section.unknowns)
    ]  # fmt: skip
    moved = ring_receptance(track, omega, [at], unknowns, changes)[:, :, 0]
    moved = moved.reshape(omega.size, len(elements), len(SIDES), 2 * d)
    L = (nodes[e + 1] - nodes[e])[:, None]
    xi = ((x - of_cell * length)[:, None] - nodes[e][:, None]) / L
    parts = [section.deflections(n, 0.0, -track.rail.head_height) for n in group]
    heads = np.zeros((x.size, len(group), 2 * d))
    for i, member in enumerate(section.members):
        shapes = member.shapes(xi[:, 0], L[:, 0])
        for n, part in enumerate(parts):
            heads[:, n, section.element_unknowns(i)] += part[i] * shapes
    summed: ComplexArray = np.einsum("wpsu,pnu->wpsn", moved[:, which.ravel()], heads)
    return summed


def _driven(
    poles: ComplexArray, natural: float, jump: FloatArray, left_out: FloatArray
) -> list[ComplexArray]:
    """How forces drive two oscillators like a flexibility that has inertia and no loss.

    Together they answer by left_out (1 - s^2 / natural^2 + ...), and jump as given.
    """
    # By real and imaginary parts of what drives each: Re(C / pole^n), of which the terms in s are.
    powers = 1 / poles ** np.arange(4)[:, None]
    matrix = np.stack([powers.real, -powers.imag], axis=2).reshape(4, -1)
    wanted = np.stack([jump, -left_out, 0 * left_out, left_out / natural**2])
    scale = natural ** np.arange(4.0)  # all in one size, for rounding
    parts = np.linalg.solve(scale[:, None] * matrix, scale[:, None] * wanted.reshape(4, -1))
    found = parts.reshape(poles.size, 2, *jump.shape)
    return list(found[:, 0] + 1j * found[:, 1])
