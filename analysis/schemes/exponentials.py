"""Exponentials in a series of numbers: how fast the fastest grows."""

from __future__ import annotations

import numpy as np

from railcosim.master.linear.state_space import ComplexArray

CLEAR = 1e-4
"""Of the largest singular value of the amplitudes in order: smaller ones are not told apart."""
THERE = 0.03
"""Of the amplitudes in the end: weaker motions are not measured."""


def fastest(values: ComplexArray) -> float:
    """Logarithm of the growth per row of the fastest of few motions that a series consists of.

    Parameters
    ----------
    values : array of complex, shape (n, n_channels)
        The series, a sum of exponentials.
    """
    depth = len(values) // 2
    rows = np.stack([values[i : len(values) - depth + i] for i in range(depth)])
    hankel = rows.transpose(0, 2, 1).reshape(depth * values.shape[1], -1)
    U, s, _ = np.linalg.svd(hankel, full_matrices=False)
    U = U[:, s > CLEAR * s[0]]
    channels = values.shape[1]
    change = np.linalg.lstsq(U[:-channels], U[channels:], rcond=None)[0]
    factors = np.linalg.eigvals(change)
    powers = factors[None, :] ** np.arange(len(values))[:, None]
    shapes = np.linalg.lstsq(powers, values, rcond=None)[0]
    strength = np.linalg.norm(shapes * powers[-1][:, None], axis=1)
    return float(np.log(np.abs(factors[strength > THERE * strength.max()]).max()))
