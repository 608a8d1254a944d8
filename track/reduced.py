"""The reduced model of the track: modes of the ring below a frequency, and what they leave out.

It is all arrays, so that an FMU can carry it and step it without the finite elements.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.observation import Observation
from railcosim.mechanics.ports import RAIL, Direction, Layout, Z
from railcosim.mechanics.shapes import AlongRing
from railcosim.parameters import ParameterError

from .cell import EVEN, ODD, build_cell
from .observed import Modes, observation_of, rows_of
from .parameters import Track
from .residual import head_shapes, residual
from .ring import RingModes, ring_modes
from .section import VERTICAL, moves_aside
from .sensor_quantities import told_by
from .sensor_rows import Row, shown_by
from .stack import check_directions

SHORTEST_WAVES = 0.8  # of the highest frequency kept: what a mesh must have, if at its least
FADE_FROM = 0.6  # of the highest frequency kept; modes below count in full


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
    nodes : array, shape (n_nodes,)
        Along the cell, both ends included, m.
    table : array, shape (n_nodes, 2 k, n)
        Motion of the LEFT rail's head at the nodes and its slope along the rail, direction by
        direction, for a unit force on one rail; numbers of single precision. Between nodes a motion
        is Hermite's cubic.
    residual_poles : array, shape (k,)
        Poles of the local flexibility of the modes left out, rad/s.
    residual_shapes : array, shape (n_nodes, k, k)
        U at the nodes: ds/dt = pole s + U' f, motion Re(U s), for the forces f on the same rail at
        the same place.
    cell_length, length : float
        Of a cell and of the ring, m.
    observation : Observation or None
        What its sensors see; None: there are none.
    """

    directions: tuple[Direction, ...]
    poles: ComplexArray
    mu: FloatArray
    partner: NDArray[np.intp]
    parity: FloatArray
    nodes: FloatArray
    table: ComplexArray
    residual_poles: ComplexArray
    residual_shapes: ComplexArray
    cell_length: float
    length: float
    observation: Observation | None = None

    @property
    def shapes(self) -> AlongRing:
        """As wheels meet them."""
        return AlongRing(
            table=self.table[:-1].astype(np.complex64),
            mu=self.mu,
            partner=self.partner,
            local_table=self.residual_shapes[:-1],
            cell_length=self.cell_length,
            cells=round(self.length / self.cell_length),
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
        return ModalBody(
            layout=layout,
            face=RAIL,
            poles=np.concatenate([self.poles, local, *own]),
            even=int((self.parity > 0).sum()),
            shapes=self.shapes,
            rigid_out=np.zeros((layout.wheelsets * len(layout.directions), 0)),
            rigid_into=np.zeros((layout.wheelsets * len(layout.directions), 0)),
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
    that costs accuracy: 3 % of the little that a railseat gives. Rails that move aside are passive
    with up to 8 elements a bay; with 16, wheels over railseats draw power near 4.6 kHz.

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
    parts = [_group(track, group, rows_of(told)) for group in groups]
    nodes, k = parts[0].nodes, len(directions)
    poles, shapes = np.empty(k, complex), np.zeros((nodes.size, k, k), complex)
    tables: list[list[ComplexArray]] = [[], []]
    for group, part in zip(groups, parts, strict=True):
        own = np.array([directions.index(d) for d in group])
        poles[own], shapes[:, own[:, None], own] = part.pole, part.shape
        rows = np.stack([2 * own, 2 * own + 1], axis=1).ravel()
        for parity, table in zip(tables, part.tables, strict=True):
            whole = np.zeros((nodes.size, 2 * k, table.shape[2]), complex)
            whole[:, rows] = table
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
        nodes=nodes,
        table=table.astype(np.complex64).astype(complex),
        residual_poles=poles,
        residual_shapes=shapes,
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

    nodes: FloatArray
    modes: list[RingModes]
    tables: list[ComplexArray]
    shown: list[ComplexArray]
    pole: ComplexArray
    shape: ComplexArray


def _group(track: Track, directions: tuple[Direction, ...], rows: Sequence[Row]) -> _Group:
    top = track.mesh.highest_frequency
    cells = [build_cell(track, parity, directions=directions) for parity in (EVEN, ODD)]
    modes = [_faded(ring_modes(cell, top), 2 * np.pi * top) for cell in cells]
    pole, shape = residual(track, cells, modes, directions)
    pairs = list(zip(cells, modes, strict=True))
    return _Group(
        nodes=cells[0].nodes,
        modes=[replace(ring, shapes=ring.shapes[:0]) for ring in modes],
        tables=[head_shapes(cell, ring, directions) for cell, ring in pairs],
        shown=[shown_by(rows, cell, ring) for cell, ring in pairs],
        pole=pole,
        shape=shape,
    )


def check_mesh(track: Track, directions: Collection[Direction]) -> None:
    """Raise ParameterError if elements are too long for the waves that are to be kept."""
    rail, mesh = track.rail, track.mesh
    speed = np.sqrt(rail.torsional_rigidity / rail.polar_inertia)
    shortest = np.sqrt(6) * speed / (2 * np.pi * track.fastening.spacing)  # of a bay as one element
    ends = shortest * mesh.elements_per_bay
    if moves_aside(directions) and ends < SHORTEST_WAVES * mesh.highest_frequency:
        needed = 2 * int(np.ceil(SHORTEST_WAVES * mesh.highest_frequency / shortest / 2))
        raise ParameterError(
            f"[mesh] elements_per_bay = {mesh.elements_per_bay}: torsion of this mesh ends at "
            f"{ends:.0f} Hz, too far below highest_frequency = {mesh.highest_frequency:g} Hz; take "
            f"elements_per_bay = {needed}"
        )


def independent(track: Track, directions: Collection[Direction]) -> list[tuple[Direction, ...]]:
    """Directions in groups that know nothing of each other: upright rails go down by themselves."""
    down = tuple(d for d in directions if d is Z)
    aside = tuple(d for d in directions if d is not Z)
    groups = [tuple(directions)] if track.rails_tilt else [down, aside]
    return [group for group in groups if group]


def _faded(modes: RingModes, top: float) -> RingModes:
    """Weigh modes by cos^2 falling from 1 at `FADE_FROM * top` (rad/s) to 0 at `top`."""
    return modes.weighted(fading(modes.poles, top))


def fading(poles: ComplexArray, top: float) -> FloatArray:
    """Weights of modes: cos^2, from 1 at `FADE_FROM * top` (rad/s) to 0 at `top`."""
    part = np.clip((np.abs(poles) / top - FADE_FROM) / (1 - FADE_FROM), 0, 1)
    weight: FloatArray = np.cos(0.5 * np.pi * part) ** 2
    return np.where(part < 1, weight, 0.0)
