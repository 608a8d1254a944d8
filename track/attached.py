"""Waves that a rail with dampers moves in, beside its modes: how it bends where a damper pulls.

Complex modes below a frequency are not a track: some begin with a jump against the force, and above
that frequency they would give power. Real shapes are one, however many and of whatever kind: the
damping among them is what the dampers make of it (Galerkin). Modes alone would leave a damper blind
to the flexibility beyond them, which where rails twist is a quarter of the whole at 1.5 kHz. So
beside them stands what a damper's force bends at rest, less what modes have of it.
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
    return weight


def attached(cell: Cell, mu: float, highest: float) -> WavesOfCell:
    """Modes that fade out below a frequency (Hz), and shapes attached for the dampers.

    A mode that counts for w is one of two of its kind that share its forces as w to 1 - w; the
    second is left out, but for its share in the attached shapes. So these are orthogonal to the
    modes kept, in mass and in stiffness, and local: beyond the modes a force is not felt far.
    """
    T, top = bloch(cell, mu), 2 * np.pi * highest
    right, left = csr_array(T), csr_array(T.conj().T)
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
    frequencies, mixed = _apart(beyond, inertia, scale)
    basis = np.concatenate([modes * np.sqrt(weight), shapes @ mixed], axis=1)
    return WavesOfCell(
        mu=mu,
        turn=T,
        squared=np.concatenate([squared, frequencies]),
        basis=basis,
        damping=basis.conj().T @ C @ basis,
    )


def _apart(
    stiffness: ComplexArray, mass: ComplexArray, scale: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Mixtures of unit mass, apart in stiffness: its values and they, without what is rounding."""
    value, vector = eigh(stiffness / np.outer(scale, scale))
    kept = vector[:, value > TRIFLE] / scale[:, None]
    squared, mixed = eigh(kept.conj().T @ stiffness @ kept, kept.conj().T @ mass @ kept)
    return squared, kept @ mixed
