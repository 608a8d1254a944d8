"""The reduced model of the track: modes of the ring below a frequency, and what they leave out.

It is all arrays, so that an FMU can carry it and step it without the finite elements.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.gaps import Gaps
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.observation import Observation
from railcosim.mechanics.ports import RAIL, Direction, Layout
from railcosim.mechanics.shapes import AlongRing, one_stretch
from railcosim.parameters import ParameterError

from .along import Rows, rows_along
from .attached import fading
from .cell import EVEN, FINER, ODD, Cell, build_cell, independent
from .flexibility import against, local_flexibility, local_pole
from .heads import head_shapes, kinked_shapes
from .observed import Modes, observation_of, rows_of
from .parameters import Track
from .residual import LeftOut, residual
from .ring import RingModes, passive_modes, ring_modes
from .section import VERTICAL, moves_aside
from .sensor_quantities import told_by
from .sensor_rows import Row, shown_by
from .stack import check_directions

SHORTEST_WAVES = 0.8  # of the highest frequency kept: what a mesh must have, if at its least
TWISTS_TO = 0.85  # of it: where modes end of rails that twist, which attached shapes go beyond


@dataclass(frozen=True, kw_only=True)
class ReducedTrack:
    """Modes of both parities, tabulated along the rail of one cell, and residuals.

    Attributes
    ----------
    directions : tuple of Direction
        In which wheels meet the rail, k of them.
    poles : array, shape (n,)
        rad/s, one of each conjugate pair.
    mu : array, shape (n,)
        Phase of a mode from cell to cell, rad.
    partner : array of int, shape (n,)
        Mode whose shape receives the force, see `RingModes`.
    parity : array, shape (n,)
        1 where both rails are mirror images of each other, -1 where opposite to that.
    apart : bool
        Whether no mode is either: then all are counted as even, and the table has the right rail's
        motions behind the left one's.
    elements : array of int, shape (n_elements,)
        Row of the table at which each element of a cell begins; it ends at the next one.
    table : array, shape (n_rows, 2 k, n)
        Motion of the LEFT rail's head at nodes along the cell and its slope along the rail,
        direction by direction, for a unit force on one rail; numbers of single precision. Both ends
        are included, and a node where shapes have a kink is two rows. Between nodes a motion is
        Hermite's cubic.
    residual_poles : array, shape (k,)
        Poles of the local flexibility of the modes left out, rad/s.
    parts : int
        p of an element: at their ends the shapes of the residual are told.
    residual_shapes : array, shape ((n_rows - 1) p + 1, 2, k, k)
        U there, and its slope along the rail: ds/dt = pole s + U' f, motion Re(U s), for the forces
        f on the same rail at the same place, Hermite's cubics between them; if `apart`, of the left
        rail, then of the right one, (..., 2 k, k).
    cell_length, length : float
        Of a cell and of the ring, m.
    observation : Observation or None
        What its sensors see; None: there are none.
    gaps : Gaps or None
        Springs that close; None: there are none.
    stretches : array, shape (s, 2)
        See `AlongRing`.
    """

    directions: tuple[Direction, ...]
    poles: ComplexArray
    mu: FloatArray
    partner: NDArray[np.intp]
    parity: FloatArray
    elements: NDArray[np.intp]
    table: ComplexArray
    parts: int
    residual_poles: ComplexArray
    residual_shapes: ComplexArray
    cell_length: float
    length: float
    observation: Observation | None = None
    apart: bool = False
    gaps: Gaps | None = None
    stretches: FloatArray = field(default_factory=one_stretch)

    @property
    def shapes(self) -> AlongRing:
        """As wheels meet them."""
        return AlongRing(
            table=self.table[:-1].astype(np.complex64),
            mu=self.mu,
            partner=self.partner,
            local_table=self.residual_shapes[:-1],
            elements=self.elements,
            parts=self.parts,
            cell_length=self.cell_length,
            cells=round(self.length / self.cell_length),
            stretches=self.stretches,
        )

    def under(self, layout: Layout) -> ModalBody:
        """The body that wheels meet at these ports: modes in a table, and oscillators at each.

        Raises
        ------
        ValueError
            If it was reduced for other directions.
        """
        if layout.directions != self.directions:
            raise ValueError(
                f"ports along {[d.name for d in layout.directions]} on a track reduced for "
                f"{[d.name for d in self.directions]}"
            )
        local = np.tile(self.residual_poles, layout.contacts)
        seen = self.observation and self.observation.of_sides(len(layout.sides))
        own = [] if seen is None else [seen.poles]
        apart, shapes = self.apart and len(layout.sides) > 1, self.shapes
        if self.apart:  # of the sides that are met
            rows = len(layout.sides) * len(self.directions)
            shapes = replace(
                shapes,
                table=np.ascontiguousarray(shapes.table[:, : 2 * rows]),
                local_table=np.ascontiguousarray(shapes.local_table[:, :, :rows]),
            )
        none = np.zeros((layout.wheelsets * len(layout.directions) * (1 + apart), 0))
        return ModalBody(
            layout=layout,
            face=RAIL,
            poles=np.concatenate([self.poles, local, *own]),
            even=int((self.parity > 0).sum()),
            apart=apart,
            gaps=self.gaps,
            shapes=shapes,
            rigid_out=none,
            rigid_into=none,
            even_rigid=0,
            preload=np.zeros(len(layout.ports)),
            observation=seen,
        )


def reduce_track(track: Track, directions: tuple[Direction, ...] = VERTICAL) -> ReducedTrack:
    """Reduce a track to its modes below `track.mesh.highest_frequency` and a residual.

    Modes fade out over a band of frequencies. Cut off at once, what is left out would reach along
    the rail as slowly fading ripples that outweigh the true response 10 m away; faded out, it is
    local: the flexibility of short waves of the rail, hardly dependent on the place. It becomes an
    oscillator for each direction under every wheel, which keeps the rail's motion a state: no force
    passes straight through, and no algebraic loop closes over a stiff contact. With it the model is
    passive: at no frequency do wheels draw power from the track, however stiff their contacts.
    Where fastenings all but clamp the rail, with dampers of 2.5e6 N s/m, 100 times the default,
    that costs accuracy: 3 % of the little that a railseat gives.

    Rails that move aside are passive whatever they lie on: see `attached` and `local_flexibility`.

    Parameters
    ----------
    track : Track
        Parameters; loss factors count as viscous damping at `loss_factor_frequency`.
    directions : tuple of Direction
        In which wheels meet the rail.

    Returns
    -------
    ReducedTrack

    Raises
    ------
    ParameterError
        If rails are to roll and their elements are too long for it, or nothing is known of how the
        track moves aside.
    """
    check_directions(track, directions)
    check_mesh(track, directions)
    groups, told = independent(track, directions), told_by(track, directions)
    rows = rows_along(track)
    parts, k = [_group(track, group, rows, rows_of(told)) for group in groups], len(directions)
    poles, shapes = np.empty(k, complex), np.zeros((rows.places[0].size, k, k), complex)
    tables: list[list[ComplexArray]] = [[], []]
    for group, part in zip(groups, parts, strict=True):
        own = np.array([directions.index(d) for d in group])
        poles[own], shapes[:, own[:, None], own] = part.pole, part.shape
        values = np.stack([2 * own, 2 * own + 1], axis=1).ravel()
        for parity, table in zip(tables, part.tables, strict=True):
            whole = np.zeros((rows.node.size, 2 * k, table.shape[2]), complex)
            whole[:, values] = table
            parity.append(whole)
    modes = [part.modes[parity] for parity in (0, 1) for part in parts]
    joined, count = RingModes.joined(modes), [sum(t.shape[2] for t in some) for some in tables]
    # A force on one rail is half an even and half an odd one: sqrt(1/2) into shapes that are
    # used twice, receiving the force and giving the deflection.
    # Half as much to store, and to read in every step, for 1e-7 of the receptance.
    table = np.sqrt(0.5) * np.concatenate([*tables[0], *tables[1]], axis=2)
    reduced = ReducedTrack(
        directions=directions,
        poles=joined.poles,
        mu=joined.mu,
        partner=joined.partner,
        parity=np.repeat([1.0, -1.0], count),
        elements=rows.elements,
        table=table.astype(np.complex64).astype(complex),
        parts=rows.parts,
        residual_poles=poles,
        residual_shapes=rows.with_slopes(shapes),
        cell_length=track.cell_length,
        length=track.length,
    )
    if not told:
        return reduced
    seen = [part.shown[parity] for parity in (0, 1) for part in parts]
    modes_seen = Modes(
        track=track, groups=groups, directions=directions, shapes=reduced.shapes,
        poles=reduced.poles, parity=reduced.parity,
        shown=np.sqrt(0.5) * np.concatenate(seen, axis=1),
    )  # fmt: skip
    return replace(reduced, observation=observation_of(modes_seen, told))


@dataclass(frozen=True)
class _Group:
    """What is reduced by itself: modes (without shapes) and tables, even and odd; a residual.

    And what of them sensors see.
    """

    modes: list[RingModes]
    tables: list[ComplexArray]
    shown: list[ComplexArray]
    pole: ComplexArray
    shape: ComplexArray


def _group(
    track: Track, directions: tuple[Direction, ...], rows: Rows, seen: Sequence[Row]
) -> _Group:
    top = track.mesh.highest_frequency
    cells = [build_cell(track, parity, directions=directions) for parity in (EVEN, ODD)]
    if moves_aside(directions):
        return _kinked_group(track, cells, directions, rows, seen)
    modes = [_faded(ring_modes(cell, top), 2 * np.pi * top) for cell in cells]
    pairs = list(zip(cells, modes, strict=True))
    tables = [head_shapes(cell, ring, directions) for cell, ring in pairs]
    pole, (shape,) = residual(track, [LeftOut.of(track, rows, tables, modes)])
    return _Group(
        modes=[replace(ring, shapes=ring.shapes[:0]) for ring in modes],
        tables=tables,
        shown=[shown_by(seen, cell, ring) for cell, ring in pairs],
        pole=np.array([pole]),
        shape=shape,
    )


def _kinked_group(
    track: Track,
    cells: list[Cell],
    directions: tuple[Direction, ...],
    rows: Rows,
    seen: Sequence[Row],
) -> _Group:
    top = 2 * np.pi * track.mesh.highest_frequency * TWISTS_TO
    both = [passive_modes(cell, top / (2 * np.pi)) for cell in cells]

    def tables(rings: list[RingModes]) -> list[ComplexArray]:
        pairs = zip(cells, rings, strict=True)
        return [kinked_shapes(cell, ring, directions) for cell, ring in pairs]

    moving = [modes for modes, _ in both]
    shown = tables(moving)
    pole = local_pole(track, rows, shown, moving, directions, top)
    taken = [against(elastic, pole) for _, elastic in both]
    hidden = tables(taken)
    return _Group(
        modes=[
            RingModes.joined([replace(ring, shapes=ring.shapes[:0]) for ring in pair])
            for pair in zip(moving, taken, strict=True)
        ],
        tables=[np.concatenate(pair, axis=2) for pair in zip(shown, hidden, strict=True)],
        # Sensors stand still: no notch of theirs goes with a wheel.
        shown=[
            np.concatenate([shown_by(seen, cell, ring), np.zeros((len(seen), ends.poles.size))], 1)
            for cell, ring, ends in zip(cells, moving, taken, strict=True)
        ],
        pole=np.full(len(directions), pole),
        shape=local_flexibility(track, rows, directions, (shown, moving), (hidden, taken)),
    )


def check_mesh(track: Track, directions: Collection[Direction]) -> None:
    """Raise ParameterError if elements are too long for the waves that are to be kept."""
    rail, mesh = track.rail, track.mesh
    speed = np.sqrt(rail.torsional_rigidity / rail.polar_inertia)
    shortest = np.sqrt(6) * speed / (2 * np.pi * track.fastening.spacing)  # of a bay as one element
    ends = shortest * mesh.elements_per_bay * FINER
    if moves_aside(directions) and ends < SHORTEST_WAVES * mesh.highest_frequency:
        highest = SHORTEST_WAVES * mesh.highest_frequency
        needed = 2 * int(np.ceil(highest / FINER / shortest / 2))
        raise ParameterError(
            f"[mesh] elements_per_bay = {mesh.elements_per_bay}: torsion of this mesh ends at "
            f"{ends:.0f} Hz, too far below highest_frequency = {mesh.highest_frequency:g} Hz; take "
            f"elements_per_bay = {needed}"
        )


def _faded(modes: RingModes, top: float) -> RingModes:
    """Weigh modes by how near they are to the highest frequency, rad/s."""
    return modes.weighted(fading(np.abs(modes.poles) / top))
