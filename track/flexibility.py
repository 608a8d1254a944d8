"""The local flexibility beside modes that take no power: masses on springs under every wheel.

In each direction one, all of one pole, and against them those that stand where `attached` shapes
do. Together they are an oscillator of that pole times what both are at rest, which is not negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .along import Rows
from .left_out import (
    FIT_FROM,
    TRIFLE,
    Directions,
    held_by,
    left_out_by,
    natural,
    static_flexibility,
)
from .parameters import Track
from .ring import RingModes

TOLD_TO = 0.3  # of the highest frequency kept: where inertia shows, and its like is promised
LEAST = 2e-6  # of the local flexibility, at railseats: above single precision
DAMPING = 0.12  # ratio: it rings off within 5 cm, and takes 1e-3 of a response at 1500 Hz


def local_pole(
    track: Track,
    rows: Rows,
    tables: list[ComplexArray],
    modes: list[RingModes],
    directions: Directions,
    top: float,
) -> complex:
    """Pole of what modes leave out, by least squares: as torsion has it, which is most of it.

    Parameters
    ----------
    track, rows, tables, modes, directions : Track, Rows, list of array, list of RingModes, tuple
        See `left_out_by`.
    top : float
        Highest frequency kept, rad/s.
    """
    omega = np.concatenate([[0.0], np.linspace(FIT_FROM, TOLD_TO, 8) * top])
    left_out, whole = left_out_by(track, rows, tables, modes, directions, omega)
    own = left_out[:, :, -1, -1]
    known = own[0].real > TRIFLE * whole[:, -1, -1]
    omega_r = natural(own, known, omega[1:, None], top)
    return omega_r * complex(-DAMPING, np.sqrt(1 - DAMPING**2))


def oscillator(pole: complex) -> complex:
    """Residue of H(s) = (1 + d s) / (1 + d s + s^2 / omega^2), as one of a conjugate pair has it.

    A mass hung on its spring by a damper: it is passive, rings off, and loses with the third power
    of the frequency.
    """
    jump = -2 * pole.real
    return jump - 1j * (abs(pole) ** 2 + jump * pole.real) / pole.imag


def against(elastic: RingModes, pole: complex) -> RingModes:
    """Oscillators of this pole that take off what these have at rest."""
    return replace(
        elastic,
        poles=pole * elastic.poles,
        shapes=elastic.shapes * np.sqrt(-oscillator(pole)),
    )


def local_flexibility(
    track: Track,
    rows: Rows,
    directions: Directions,
    moving: tuple[list[ComplexArray], list[RingModes]],
    taken: tuple[list[ComplexArray], list[RingModes]],
) -> ComplexArray:
    """Shapes of the oscillators under wheels, at all places of the rows, (.., k, k): exact at rest.

    Parameters
    ----------
    track, rows, directions : Track, Rows, tuple of Direction
        See `local_pole`.
    moving, taken : tuple of list
        Tables and modes of either parity, as in `local_pole`: of what moves, and `against` it.
    """
    notch = static_flexibility(track, rows, directions) - held_by(rows, *moving)
    against = -held_by(rows, *taken)
    mean = (notch + against).mean(axis=0)
    least = LEAST * mean
    root = _root(_at_least(notch, least, np.sqrt(np.diagonal(mean))) + against)
    shapes: ComplexArray = root * np.sqrt(oscillator(complex(taken[1][0].poles[0])))
    return shapes


def _at_least(J: FloatArray, least: FloatArray, size: FloatArray) -> FloatArray:
    """Symmetric matrices raised where they lie below others; `size` is that of coordinates."""
    unit = np.outer(size, size)
    value, vector = np.linalg.eigh((least - J) / unit)
    raised = (vector * np.maximum(value, 0)[:, None, :]) @ np.swapaxes(vector, 1, 2)
    above: FloatArray = J + raised * unit
    return above


def _root(static: FloatArray) -> FloatArray:
    """L with static = L L', whose last direction moves those before it; (.., k, k)."""
    root = np.linalg.cholesky(static[..., ::-1, ::-1])[..., ::-1, ::-1]
    return np.asarray(root, dtype=np.float64)
