"""Frequencies of a track that have names: where waves begin, and where rails swing between seats.

Of all modes of one phase from bay to bay the one is taken that shares most of its mass with a
motion that has a name: all rails, or all blocks, up and down alike; a half wave from railseat to
railseat.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.ports import Direction

from .below import Crossing
from .cell import EVEN, Cell, build_cell, railseats
from .parameters import Track
from .receptance import shortest
from .stack import stack_of
from .waves_of_cell import bloch

MEMBERS = {"w": "vertical", "v": "lateral", "phi": "torsion"}
SHARED = 0.2  # of its mass that a mode has in common with a motion, to be called by its name


@dataclass(frozen=True, kw_only=True)
class NamedMode:
    """A mode of the endless track.

    Attributes
    ----------
    name : str
        What swings.
    frequency : float
        Without damping, Hz.
    damping_ratio : float
        Of the undamped shape: its dampers' work, and that of loss factors at its frequency.
    share : float
        Of its mass that moves as the name says, 0 to 1.
    shape : array, shape (n,)
        Undamped, in the unknowns of the cell, its ends a phase apart.
    """

    name: str
    frequency: float
    damping_ratio: float
    share: float
    shape: ComplexArray


def named_modes(track: Track, directions: Collection[Direction], parity: int) -> list[NamedMode]:
    """Find them, by frequency.

    Parameters
    ----------
    track : Track
        Parameters.
    directions : collection of Direction
        In which the track moves.
    parity : int
        EVEN or ODD, of the two rails.
    """
    cell = build_cell(shortest(track), parity, directions=directions)
    found = []
    for phase, motions in ((0.0, _uniform(cell)), (np.pi * cell.track.bays, _between_seats(cell))):
        found += _named(cell, phase, motions)
    return sorted(found, key=lambda mode: mode.frequency)


def _named(cell: Cell, phase: float, motions: dict[str, FloatArray]) -> list[NamedMode]:
    """Modes of one phase from cell to cell that are most like motions, each like one."""
    if not motions:
        return []
    T = bloch(cell, phase)
    M, C, K, K_loss = (T.conj().T @ A @ T for A in (cell.M, cell.C, cell.K, cell.K_loss))
    squared, shapes = eigh(K, M)
    omega = np.sqrt(np.maximum(squared, 0))
    closed = np.linalg.lstsq(T, np.stack(list(motions.values()), axis=1), rcond=None)[0]
    mass = np.einsum("ij,ij->j", closed.conj(), M @ closed).real
    share = np.abs(closed.conj().T @ M @ shapes) ** 2 / mass[:, None]
    which = linear_sum_assignment(-share)[1]
    modes = []
    for i, (name, r) in enumerate(zip(motions, which, strict=True)):
        u, w = shapes[:, r], omega[r]
        if share[i, r] < SHARED or w == 0:
            continue
        lost = (u.conj() @ (w * C + K_loss) @ u).real
        modes.append(NamedMode(
            name=name, frequency=float(w / (2 * np.pi)), damping_ratio=float(lost / (2 * w**2)),
            share=float(share[i, r]), shape=T @ u,
        ))  # fmt: skip
    return modes


def _uniform(cell: Cell) -> dict[str, FloatArray]:
    """Each body alone, all along the track alike."""
    track, section = cell.track, cell.section
    motions = {}
    for i, member in enumerate(section.members):
        name = MEMBERS.get(member.unknowns[0])
        if name is not None:
            motions[f"rail on fastenings, {name}"] = _of_member(cell, i, np.ones(cell.nodes.size))
    bodies = stack_of(track, cell.parity, section, cell.nodes, cell.slab).bodies[1:]
    at = sum(m.unknowns[0] in MEMBERS for m in section.members)
    for layer, body in zip(track.layers, bodies, strict=False):
        if not isinstance(body, Crossing):  # as continuous as the rail
            motion, at = _of_member(cell, at, np.ones(cell.nodes.size)), at + 1
        else:
            motion, n = np.zeros(len(cell.K)), body.degrees.size
            motion[body.first : body.first + n * body.seats.size : n] = 1.0
        motions[f"{layer.called} on what is below"] = motion
    if cell.slab is not None:
        motions |= _of_slab(cell)
    return motions


def _of_slab(cell: Cell) -> dict[str, FloatArray]:
    """The slab as a rigid body: up and down or rolling, and aside."""
    slab, first = cell.slab, len(cell.K)
    assert slab is not None
    first -= slab.size
    plate, motions = slab.plate, {}
    if plate.omega.size:
        side = 0.0 if cell.parity == EVEN else plate.width / 2
        rigid = np.where(plate.omega == 0, plate.at(np.zeros(1), np.array([side]))[0], 0.0)
        name = "slab on its foundation, " + ("vertical" if cell.parity == EVEN else "rolling")
        motions[name] = np.append(np.zeros(first), np.append(rigid, np.zeros(2 * slab.sideways)))
    if slab.sideways:
        motion = np.zeros(len(cell.K))
        motion[-2] = 1.0
        motions["slab on its foundation, lateral"] = motion
    return motions


def _between_seats(cell: Cell) -> dict[str, FloatArray]:
    """Half waves of each member of the rail, with nodes at railseats, if there are any."""
    if cell.track.fastening.continuous:
        return {}
    first, spacing = float(railseats(cell.track)[0]), cell.track.fastening.spacing
    wave = np.sin(np.pi * (cell.nodes - first) / spacing)
    names = {"w": "pinned-pinned, vertical", "v": "pinned-pinned, lateral",
             "phi": "torsion between railseats"}  # fmt: skip
    return {
        names[member.unknowns[0]]: _of_member(cell, i, wave)
        for i, member in enumerate(cell.section.members)
        if member.unknowns[0] in names
    }


def _of_member(cell: Cell, i: int, deflection: FloatArray) -> FloatArray:
    """A deflection of a member at the nodes, among the unknowns of the cell."""
    motion, d = np.zeros(len(cell.K)), cell.section.size
    motion[cell.section.element_unknowns(i)[0] : d * cell.nodes.size : d] = deflection
    return motion
