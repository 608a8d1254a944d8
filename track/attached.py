"""Waves that a rail with dampers moves in, beside its modes: how it bends where a damper pulls.

Complex modes below a frequency are not a track: some begin with a jump against the force, and above
that frequency they would give power. Real shapes are one, however many and of whatever kind: the
damping among them is what the dampers make of it (Galerkin). Modes alone would leave a damper blind
to the flexibility beyond them, which where rails twist is a quarter of the whole at 1.5 kHz. So
beside them stands what a damper's force bends at rest, less what modes have of it.

A wheel beside a damper moves by these shapes too, within 2 cm. What is left for its own flexibility
would have a notch there, and a wheel that rolls would ring it, or mistake how fast the rail moves.
So what the attached shapes have of it at rest is taken off by masses on springs that stand there
too, of the pole that the wheel's own have (`flexibility`): these are much the same everywhere then.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .cell import Cell
from .waves_of_cell import WavesOfCell, bloch

FADE_FROM = 0.6  # of the highest frequency kept; modes below count in full
TRIFLE = 1e-6  # of the flexibility under dampers: nothing is left beyond the modes


def fading(share: FloatArray) -> FloatArray:
    """Weight of modes at a share of the highest frequency: cos^2, from 1 at `FADE_FROM` to 0."""
    part = np.clip((share - FADE_FROM) / (1 - FADE_FROM), 0, 1)
    weight: FloatArray = np.cos(0.5 * np.pi * part) ** 2
    return np.where(part < 1, weight, 0.0)


def attached(
    cell: Cell, mu: float, highest: float, *, standing: bool
) -> tuple[WavesOfCell, ComplexArray, ComplexArray]:
    """Modes that fade out below a frequency (Hz), and shapes attached for the dampers.

    A mode that counts for w is one of two of its kind that share its forces as w to 1 - w; the
    second is left out, but for its share in the attached shapes. So these are orthogonal to the
    modes kept, in mass and in stiffness, and local: beyond the modes a force is not felt far.

    Returns
    -------
    waves : WavesOfCell
        Both.
    pulled, beyond : array, shape (n_unknowns, m) and (m, m)
        What the dampers' forces bend beyond the modes, and by how much at the dampers.
    """
    T, top = bloch(cell, mu), 2 * np.pi * highest
    closed = T.real if standing else T  # real but for rounding
    right, left = csr_array(closed), csr_array(closed.conj().T)
    M, C, K = (left @ A @ right for A in (cell.M, cell.viscous_damping(), cell.K))
    squared, modes = eigh(K, M, subset_by_value=(-np.inf, top**2))
    weight = fading(np.sqrt(np.maximum(squared, 0)) / top)
    damped = [held.stretch for held in cell.supports if held.damping or held.loss]
    pulled = (np.concatenate([np.zeros((0, cell.K.shape[0])), *damped]) @ right).conj().T
    static = np.linalg.solve(K, pulled)
    own = modes.conj().T @ pulled
    flexibility = pulled.conj().T @ static
    scale = np.sqrt(np.diagonal(flexibility).real)
    beyond = flexibility - own.conj().T @ ((weight / squared)[:, None] * own)
    inertia = static.conj().T @ M @ static
    inertia -= own.conj().T @ ((weight / squared**2)[:, None] * own)
    shapes = static - modes @ ((weight / squared)[:, None] * own)
    value, vector = eigh(beyond / np.outer(scale, scale))
    kept = value > TRIFLE
    mixed, value = (vector / scale[:, None])[:, kept], value[kept]
    frequencies, apart = eigh(*(mixed.conj().T @ A @ mixed for A in (beyond, inertia)))
    basis = np.concatenate([modes * np.sqrt(weight), shapes @ mixed @ apart], axis=1)
    waves = WavesOfCell(
        mu=mu,
        turn=T,
        squared=np.concatenate([squared, frequencies]),
        basis=basis,
        damping=basis.conj().T @ C @ basis,
    )
    return waves, closed @ shapes, beyond


def against_attached(cell: Cell, pulled: FloatArray, beyond: FloatArray) -> FloatArray:
    """Shapes of unit stiffness, of each railseat by itself: most of what attached ones have.

    They end midway to the next railseats, so no two wheels feel the same one.
    """
    damped = [held.stretch for held in cell.supports if held.damping or held.loss]
    rows = np.concatenate([np.zeros((0, cell.K.shape[0])), *damped])[:, : cell.rail_size]
    held = np.abs(rows).reshape(len(rows), cell.nodes.size, -1).sum(axis=2).argmax(axis=1)
    shapes = [np.zeros((cell.K.shape[0], 0))]
    for node in np.unique(held):
        own = np.flatnonzero(held == node)
        flexibility = beyond[np.ix_(own, own)]
        scale = np.sqrt(np.diagonal(flexibility))
        value, vector = eigh(flexibility / np.outer(scale, scale))
        kept = value > TRIFLE
        away = (cell.nodes - cell.nodes[node]) / cell.track.fastening.spacing
        window = np.where(np.abs(away) < 0.5, np.cos(np.pi * away) ** 2, 0.0)
        ends = np.zeros(len(pulled))
        ends[: cell.rail_size] = np.repeat(window, cell.section.size)
        mixed = (vector / scale[:, None])[:, kept] / np.sqrt(value[kept])
        shapes.append(ends[:, None] * (pulled[:, own] @ mixed))
    return np.concatenate(shapes, axis=1)
