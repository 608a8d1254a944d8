"""The reduced track of several kinds: modes of the whole ring, in a table that goes round it.

As with single places that are different (`local_modes`): modes are found with nothing left out and
fade out as those of one kind do. What they leave out under a wheel is, at rest, all that the place
gives less what modes have of it; how it moves is taken from the kind the wheel is on, with a pole
that all kinds share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Z

from .along import Rows, rows_along
from .attached import fading
from .cell import EVEN, ODD, Cell, build_cell
from .closed_line import ClosedLine, tabulated
from .heads import head_shapes
from .parameters import Track
from .reduced import ReducedTrack
from .residual import LeftOut, residual
from .ring import RingModes, ring_modes
from .ring_of_kinds import KindsModes, modes_of_kinds

Kind = tuple[list[Cell], list[RingModes]]
"""Cells and all waves of its own ring, of either parity."""


def reduce_line(
    closed: ClosedLine, progress: Callable[[str], None] = lambda text: None
) -> ReducedTrack:
    """Reduce a line on a ring, vertical, to modes below the highest frequency and a residual.

    Parameters
    ----------
    closed : ClosedLine
        The ring.
    progress : callable
        Told what is being done.

    Raises
    ------
    ParameterError
        If kinds cannot be joined, or modes are not found.
    """
    tracks, top = closed.tracks, 2 * np.pi * closed.tracks[0].mesh.highest_frequency
    progress("waves of each kind")
    kinds = {track: _kind(track) for track in tracks}
    found = []
    for k, said in enumerate(("even", "odd")):

        def tell(text: str, said: str = said) -> None:
            progress(f"{said} {text}")

        cells = [kinds[track][0][k] for track in tracks]
        waves = [
            kinds[track][1][k] if n == track.mesh.cells else ring_modes(cell, np.inf, n)
            for track, cell, n in zip(tracks, cells, closed.counts, strict=True)
        ]
        found.append(modes_of_kinds(cells, closed.counts, waves, top, tell))
    progress("what modes leave out")
    rows = [rows_along(track) for track in tracks]
    left_out = {track: _left_out(track, kind, top) for track, kind in kinds.items()}
    pole, shapes = residual(tracks[0], list(left_out.values()))
    local = dict(zip(left_out, shapes, strict=True))
    whole = [its.with_slopes(local[track]) for its, track in zip(rows, tracks, strict=True)]
    own = [_faded(modes, top) for modes in found]
    poles = np.concatenate([poles for poles, _ in own])
    table = np.concatenate([heads for _, heads in own], axis=2)
    part = _part(closed, rows, whole, pole, table, poles, found)
    order, elements, stretches = tabulated(
        closed, [its.node.size - 1 for its in rows], [its.elements for its in rows]
    )
    table = table[order]
    residual_shapes = _round(closed, rows, whole, part)[order].reshape(-1, 2, 1, 1)
    return ReducedTrack(
        directions=(Z,),
        poles=poles,
        mu=np.zeros(poles.size),
        partner=np.arange(poles.size),
        parity=np.repeat([1.0, -1.0], [poles.size for poles, _ in own]),
        elements=elements,
        table=np.concatenate([table, table[:1]]).astype(np.complex64).astype(complex),
        parts=rows[0].parts,
        residual_poles=np.array([pole]),
        residual_shapes=np.concatenate([residual_shapes, residual_shapes[:1]]),
        cell_length=closed.length,
        length=closed.length,
        stretches=stretches,
    )


def _kind(track: Track) -> Kind:
    cells = [build_cell(track, parity) for parity in (EVEN, ODD)]
    return cells, [ring_modes(cell, np.inf) for cell in cells]


def _left_out(track: Track, kind: Kind, top: float) -> LeftOut:
    """What modes of a kind's own ring leave out."""
    modes = []
    for waves in kind[1]:
        below = waves.some(np.abs(waves.poles) < top)
        modes.append(below.weighted(fading(np.abs(below.poles) / top)))
    tables = [head_shapes(cell, its, (Z,)) for cell, its in zip(kind[0], modes, strict=True)]
    return LeftOut.of(track, rows_along(track), tables, modes)


def _faded(modes: KindsModes, top: float) -> tuple[ComplexArray, ComplexArray]:
    """Poles, and heads of all stretches, (rows, 2, n)."""
    weight = fading(np.abs(modes.poles) / top)
    heads = np.concatenate(modes.heads)[:, weight > 0] * np.sqrt(weight[weight > 0])
    return modes.poles[weight > 0], heads.reshape(len(heads) // 2, 2, -1)


def _part(
    closed: ClosedLine,
    rows: Sequence[Rows],
    whole: Sequence[ComplexArray],
    pole: complex,
    table: ComplexArray,
    poles: ComplexArray,
    found: Sequence[KindsModes],
) -> FloatArray:
    """How much of its kind's own each row leaves out at rest; of all stretches."""
    static = np.sum([np.concatenate(modes.static) for modes in found], axis=0)
    now = static + np.sum(table[:, 0] ** 2 / poles, axis=1).real
    usual = []
    for n, its, shape in zip(closed.counts, rows, whole, strict=True):
        of_row = -np.real(shape[:: its.parts, 0, 0, 0] ** 2 / pole)
        usual += [np.tile(of_row[:-1], n), of_row[-1:]]
    part: FloatArray = np.maximum(now / np.concatenate(usual), 0.0)
    return part


def _round(
    closed: ClosedLine, rows: Sequence[Rows], whole: Sequence[ComplexArray], part: FloatArray
) -> ComplexArray:
    """Shapes of what modes leave out, and slopes, of all rows, (rows, parts, 2)."""
    parts = rows[0].parts
    way = np.arange(parts) / parts
    factor = np.sqrt(part[:, None] * (1 - way) + np.roll(part, -1)[:, None] * way)
    own = []
    for n, shape in zip(closed.counts, whole, strict=True):
        cell = shape[:-1, :, 0, 0].reshape(-1, parts, 2)
        own += [np.tile(cell, (n, 1, 1)), np.repeat(shape[-1:, None, :, 0, 0], parts, axis=1)]
    found: ComplexArray = np.concatenate(own) * factor[:, :, None]
    # A wheel must not feel the joint: before it stands what stands behind it.
    last = np.cumsum(
        [n * (its.node.size - 1) + 1 for n, its in zip(closed.counts, rows, strict=True)]
    )
    found[last - 1, :, 0] = found[last % len(found), :1, 0]
    return found
