"""The reduced track with single railseats that are different: modes of the whole ring, in a table.

They are no waves any more, so the table goes round the ring: as many times larger as it has cells.
Under a wheel as much of it counts as before, so a step costs the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.gaps import Gaps
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .attached import fading
from .cell import EVEN, ODD, Cell, build_cell, elements_per_bay, regular_nodes
from .changed_ring import MARGIN, Springs, forces, poles_below
from .layers import MASS
from .local import SIDES, LocalChange, check_left, masses_at, springs_at
from .local_ring import Added, RingOfWaves
from .observed import Modes, observation_of, rows_of
from .parameters import Track
from .receptance import Place, Point
from .reduced import ReducedTrack, reduce_track
from .sensor_quantities import told_by
from .sensor_rows import Row, weighed

STILL = 1e-10  # of the largest: a stretch that does not count
Closing = Sequence[tuple[int, float, float, float]]
"""Which of the places, stiffness and damping where a gap is closed, and the gap, m."""
NEAR = 0.1  # of an element: a mass nearer to a node gets none of its own, which would be too stiff


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
        Of the equal ring, vertical; nothing is asked of its observation.
    changes : sequence of LocalChange
        If they are not alike on both sides, no mode is its own mirror image.
    progress : callable
        Told what is being done.

    Raises
    ------
    ParameterError
        If there is nothing to change at a place, or rails are met aside.
    """
    if reduced.directions != (Z,) or track.rails_tilt:
        raise ParameterError("single places change in the vertical model only")
    apart = not _alike(changes)
    added, *closing = _added(track, changes, SIDES if apart else SIDES[1:])
    if not apart:
        closing.insert(0, _added(track, changes, SIDES[:1])[1])
    if not added:
        return reduce_track(track) if track.sensor else reduced
    if track.sensor and any(closing):
        gap = next(change for change in changes if change.gap is not None)
        raise ParameterError(
            f"{gap}: what a gap does near a sensor is not known; leave out sensor {track.sensor[0]}"
        )
    told = told_by(track, (Z,), changes)
    cells = [build_cell(track, parity, _of_masses(track, added)) for parity in (EVEN, ODD)]
    groups = {"": cells} if apart else {"even ": cells[:1], "odd ": cells[1:]}
    top, found = 2 * np.pi * track.mesh.highest_frequency, []
    for said, some in groups.items():
        progress(f"{said}modes of the equal ring")
        poles, *values, softer = _changed(some, added, rows_of(told), top, progress)
        weight = fading(np.abs(poles) / top)
        shapes, seen, stretch = ((own * np.sqrt(weight))[:, weight > 0] for own in values)
        found.append((poles[weight > 0], shapes, seen, stretch, softer))
    poles = np.concatenate([own for own, *_ in found])
    rows, ring = len(reduced.table) - 1, track.mesh.cells
    shapes, shown = (np.concatenate([own[k] for own in found], axis=1) for k in (1, 2))
    table = shapes.reshape(ring * rows, -1, poles.size)
    whole = np.concatenate([table, table[:1]])
    softer = sum((more for *_, more in found), np.zeros(1)).reshape(ring * rows, -1)
    residual = _residual(reduced, table[:, ::2], poles, softer)
    changed = replace(
        reduced,
        poles=poles,
        mu=np.zeros(poles.size),
        partner=np.arange(poles.size),
        parity=np.repeat([1.0, -1.0][: len(found)], [own.size for own, *_ in found]),
        apart=apart,
        gaps=_gaps(closing, [own[3] for own in found]) if any(closing) else None,
        elements=(rows * np.arange(ring)[:, None] + reduced.elements).ravel(),
        table=whole.astype(np.complex64).astype(complex),
        residual_shapes=np.concatenate([residual, residual[:1]]),
        cell_length=track.length,
    )
    modes = Modes(
        track=track, groups=[(Z,)], directions=(Z,), shapes=changed.shapes, poles=poles,
        parity=changed.parity, shown=shown, apart=apart, changes=changes,
    )  # fmt: skip
    return replace(changed, observation=observation_of(modes, told))


def _alike(changes: Sequence[LocalChange]) -> bool:
    """Whether both sides change alike, but for gaps, which the ring's modes do not know."""
    left, right = (
        sorted((c.what, c.x, c.left) for c in changes if side in c.sides) for side in SIDES
    )
    return left == right


def _gaps(closing: Sequence[Closing], stretches: Sequence[ComplexArray]) -> Gaps:
    """Springs that close, by what their places show of all modes.

    Of modes of either parity a place stands for two: what closes on the left, and on the right. Odd
    ones have the signs of the left rail in their table, and those of the right one at places.
    """
    which, k, c, gap = (
        np.array(values) for values in zip(*(one for own in closing for one in own), strict=True)
    )
    rows = [own[which] for own in stretches]
    if len(rows) > 1:
        even, odd = (np.sqrt(0.5) * own for own in rows)
        side = np.repeat([1.0, -1.0], [len(own) for own in closing])[:, None]
        rows = [np.hstack([even, side * odd])]
    return Gaps(shown=rows[0], stiffness=k, damping=c, gap=gap)


def _residual(
    reduced: ReducedTrack, motion: ComplexArray, poles: ComplexArray, softer: FloatArray
) -> ComplexArray:
    """What modes leave out all round, (places, 2, sides, 1): as on the equal ring, but how much.

    At rest it is all that a place gives on the changed ring, less what its modes have of it: beside
    a mass, which modes that are left out would not move, less than on the equal ring.

    Parameters
    ----------
    reduced : ReducedTrack
        Of the equal ring.
    motion, poles : array, shapes (rows, sides, n) and (n,)
        Of the changed ring's modes.
    softer : array, shape (rows, sides)
        By how much rows give more, at rest, m/N.
    """
    equal, pole, parts = reduced.residual_shapes[:-1], reduced.residual_poles[0], reduced.parts
    one = reduced.table[:-1, 0]
    left_out = -np.real(equal[::parts, 0, 0] ** 2 / pole)
    of_modes = -np.sum(one * one[:, reduced.partner] / reduced.poles, axis=1).real[:, None]
    ring = len(motion) // len(one)
    now = np.tile(left_out + of_modes, (ring, 1)) + softer + np.sum(motion**2 / poles, axis=2).real
    part = np.maximum(now / np.tile(left_out, (ring, 1)), 0.0)
    way = np.arange(parts)[:, None] / parts  # to the next row
    between = part[:, None] * (1 - way) + np.roll(part, -1, axis=0)[:, None] * way
    whole: ComplexArray = np.tile(equal, (ring, 1, 1, 1))
    found: ComplexArray = whole * np.sqrt(between.reshape(len(whole), 1, -1, 1))
    return found


def _added(
    track: Track, changes: Sequence[LocalChange], sides: tuple[int, ...]
) -> tuple[Added, Closing]:
    """What is added on these sides, and what closes; the other is the same, or its opposite."""
    added: list[tuple[Place, float, float, float]] = []
    springs, closing = [], []
    for change in sorted(changes, key=lambda c: (c.what, c.x, c.left)):  # alike on either side
        if change.what == MASS:
            more = (0.0, 0.0, masses_at(change))
            its = [side for side in change.sides if side in sides]
            here: list[Place] = [Point(x=change.x, side=side) for side in its]
        else:
            places, one = springs_at(track, change)
            one = one.made_viscous(2 * np.pi * track.mesh.loss_factor_frequency)
            part = change.left - 1
            more = (part * one.stiffness, part * one.damping, 0.0)
            here = [place for place in places if place.side in sides]
            springs += [(change, place) for place in places]
            if change.gap is not None:
                on = [place for place in places if place.side in sides]
                closing += [
                    (len(added) + i, one.stiffness, one.damping, change.gap * np.sqrt(place.weight))
                    for i, place in enumerate(on)
                ]
        added += [(place, *more) for place in here if any(more)]
    check_left(track, springs, track.mesh.cells)
    return added, closing


def _of_masses(track: Track, added: Added) -> FloatArray:
    """Where in a cell a rail carries one and has no node nearby, m."""
    regular = regular_nodes(track, elements_per_bay(track, (Z,)))
    at: FloatArray = np.array([place.x % track.cell_length for place, *_ in added if place.on_rail])
    apart = np.abs(regular - at[:, None]).min(axis=1, initial=np.inf)
    far: FloatArray = at[apart > NEAR * regular[1]]
    return far


def _changed(
    cells: Sequence[Cell],
    added: Added,
    rows: Sequence[Row],
    top: float,
    progress: Callable[[str], None],
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray, FloatArray]:
    """Poles below a frequency, motion and slope of the rail's heads all round, rows, and stretches.

    And by how much the heads give more at rest.
    """
    number, k = cells[0].track.mesh.cells, len(added)
    ring = RingOfWaves.of(cells, added, rows)
    pole, U = ring.standing(MARGIN * top, number)
    moves = turned(pole, U, k)
    count = np.bincount(pole[moves], minlength=ring.equal.poles.size)
    equal = replace(ring.equal, moving=count + count[ring.equal.mirror] * (count == 0))
    dk, dc, dm = np.array([more for _, *more in added]).T
    springs = Springs(dk=np.diag(dk), dc=np.diag(dc), dm=np.diag(dm))
    s = poles_below(equal, springs, top, progress)
    s = s.some(np.abs(s.of(equal)) < top)
    progress("shapes")
    still = ~moves & (np.abs(equal.poles[pole]) < top)
    new, stretches = [], [U[-k:, still]]
    for z, stretch, pull in forces(equal, springs, s):
        new.append(np.concatenate([ring.heads(z, pull, number), ring.told(z, pull)]))
        stretches.append(stretch.T)
    poles = np.concatenate([equal.poles[pole[still]], s.of(equal)])
    shapes = np.concatenate([U[:-k, still], *new], axis=1)
    heads = len(shapes) - len(ring.seen)
    weights = [weights for row in rows for weights, _ in row.parts(cells[0])]
    of_row = [j for j, row in enumerate(rows) for _ in row.parts(cells[0])]
    seen = np.zeros((len(rows), poles.size), complex)
    for j, of, part in zip(of_row, weights, shapes[heads:], strict=True):
        seen[j] += weighed(of, poles) * part
    stretch = np.concatenate(stretches, axis=1)
    return poles, shapes[:heads], seen, stretch, _softer(ring, springs, number)


def _softer(ring: RingOfWaves, springs: Springs, cells: int) -> FloatArray:
    """By how much every head gives more at rest, m/N; masses do not matter."""
    equal, one = ring.equal, np.eye(len(springs.dk), dtype=complex)
    H = ring.heads(one, np.tile(-1 / equal.poles, (len(one), 1)), cells)[::2].real
    within = one.real - springs.dk @ np.sum(equal.residues.T / equal.poles, axis=2).real
    taken = np.linalg.solve(within, springs.dk @ H.T)
    softer: FloatArray = -np.sum(H.T * taken, axis=0)
    return softer


def turned(pole: NDArray[np.intp], U: ComplexArray, k: int) -> NDArray[np.bool_]:
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
