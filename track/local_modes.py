"""The reduced track with single railseats that are different: modes of the whole ring, in a table.

They are no waves any more, so the table goes round the ring: as many times larger as it has cells.
Under a wheel as much of it counts as before, so a step costs the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from railcosim.mechanics.arrays import ComplexArray
from railcosim.mechanics.ports import Z
from railcosim.parameters import ParameterError

from .cell import EVEN, ODD, Cell, build_cell
from .changed_ring import Modes, changed
from .layers import MASS
from .local import SIDES, LocalChange, SpringPlace, check_left, springs_at
from .parameters import Track
from .reduced import ReducedTrack, fading
from .residual import head_shapes
from .ring import REAL_POLE, ring_modes

Added = tuple[SpringPlace, float, float]
"""A spring of the right rail, and what stiffness and damping it gets more."""


def with_changes(
    track: Track, reduced: ReducedTrack, changes: Sequence[LocalChange]
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
    top, cells = 2 * np.pi * track.mesh.highest_frequency, track.mesh.cells
    found = []
    for parity in (EVEN, ODD):
        modes = _of_ring(build_cell(track, parity), added)
        for k, (_, dk, dc) in enumerate(added):
            modes = changed(modes, modes.shapes.shape[0] - len(added) + k, dk, dc)
        weight = fading(modes.poles, top)
        found.append((modes.poles[weight > 0], (modes.shapes * np.sqrt(weight))[:, weight > 0]))
    poles = np.concatenate([own for own, _ in found])
    nodes = reduced.nodes.size - 1
    rows = cells * nodes * 2
    shapes = np.concatenate([own[:rows] for _, own in found], axis=1)
    table = np.sqrt(0.5) * shapes.reshape(cells * nodes, 2, -1)
    whole = np.concatenate([table, table[:1]])
    residual = np.tile(reduced.residual_shapes[:-1], (cells, 1, 1))
    starts = track.cell_length * np.arange(cells)[:, None]
    return replace(
        reduced,
        poles=poles,
        mu=np.zeros(poles.size),
        partner=np.arange(poles.size),
        parity=np.repeat([1.0, -1.0], [own.size for own, _ in found]),
        nodes=np.append((starts + reduced.nodes[:-1]).ravel(), track.length),
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


def _of_ring(cell: Cell, added: Sequence[Added]) -> Modes:
    """All modes: motion and slope of the left rail's head all round, and stretches of springs."""
    track, waves = cell.track, ring_modes(cell, np.inf)
    own = head_shapes(cell, waves, (Z,))[:-1].reshape(-1, waves.poles.size)
    turn = np.exp(1j * np.arange(track.mesh.cells)[:, None] * waves.mu)
    heads = (turn[:, None] * own).reshape(-1, waves.poles.size)
    rows = [
        (place.row(cell) @ waves.shapes) * turn[int(place.x // track.cell_length) % len(turn)]
        for place, _, _ in added
    ]
    U: ComplexArray = np.concatenate([heads, np.array(rows)])
    # Two waves that receive each other's forces are two modes that receive their own.
    index = np.arange(waves.poles.size)
    alone, first = waves.partner == index, waves.partner > index
    A, B = U[:, first], U[:, waves.partner[first]]
    poles = np.concatenate([waves.poles[alone], waves.poles[first], waves.poles[first]])
    shapes = [U[:, alone], np.sqrt(0.5) * (A + B), 1j * np.sqrt(0.5) * (A - B)]
    return Modes(
        poles=poles,
        real=np.abs(poles.imag) < REAL_POLE * np.abs(poles),
        shapes=np.concatenate(shapes, axis=1),
    )
