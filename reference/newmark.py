"""Newmark's method for the monolithic system, with the contact law solved at every step."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.law import NormalLaw
from railcosim.mechanics.solve import solve_compression

from .monolithic import Monolithic

FloatArray = NDArray[np.float64]
BETA, GAMMA = 0.25, 0.5  # constant average acceleration: second order, no numerical damping


@dataclass(frozen=True, kw_only=True)
class Instant:
    """The system at one time: displacements x, velocities v, contact forces in N."""

    time: float
    x: FloatArray
    v: FloatArray
    force: FloatArray


def equilibrium(
    mono: Monolithic, law: NormalLaw, rails: sparse.csr_array, irregularity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Displacements and contact forces at rest, by Newton's method from a stiff start."""
    weight = mono.wheels.T @ mono.load
    across = mono.wheels - rails
    x, delta = np.zeros(mono.K.shape[0]), np.full(mono.load.size, 1e-4)
    for _ in range(30):
        k = law.stiffness(delta)
        force = law.force(delta)
        # Linearised law: force + k (across x - irregularity - delta).
        K = mono.K + across.T @ sparse.diags_array(k) @ across
        x = splu(K.tocsc()).solve(weight - across.T @ (force - k * (delta + irregularity)))
        change = across @ x - irregularity - delta
        delta = delta + change
        if np.abs(change).max() < 1e-15:
            break
    return x, law.force(delta)


def newmark(
    mono: Monolithic,
    law: NormalLaw,
    position: Callable[[float], FloatArray],
    irregularity: Callable[[float], FloatArray],
    step: float,
    steps: int,
) -> Iterator[Instant]:
    """March from rest; yields the start and every step.

    Parameters
    ----------
    mono : Monolithic
        The system; loss factors count as viscous damping, as in the FMUs.
    law : NormalLaw
        Of every contact.
    position, irregularity : callable
        Of time (s): positions of the wheelsets and rail surface under the wheels, m.
    step : float
        s.
    steps : int
        How many.

    References
    ----------
    Newmark, N. M. (1959), A method of computation for structural dynamics, J. Eng. Mech. 85(3).
    """
    omega = 2 * np.pi * mono.track.mesh.loss_factor_frequency
    C = mono.C + mono.K_loss / omega
    a0, a1 = 1 / (BETA * step**2), GAMMA / (BETA * step)
    factor = splu((mono.K + a0 * mono.M + a1 * C).tocsc())
    weight = mono.wheels.T @ mono.load
    where, rails = position(0.0), mono.rails(position(0.0))
    x, force = equilibrium(mono, law, rails, irregularity(0.0))
    v, a = np.zeros_like(x), np.zeros_like(x)
    yield Instant(time=0.0, x=x, v=v, force=force)
    response, delta = _contact_response(mono, rails, factor), None
    for n in range(1, steps + 1):
        t = n * step
        if not np.array_equal(position(t), where):
            where, rails = position(t), mono.rails(position(t))
            response = _contact_response(mono, rails, factor)
        across = mono.wheels - rails
        known = weight + mono.M @ (a0 * x + v / (BETA * step) + (0.5 / BETA - 1) * a)
        known += C @ (a1 * x + (GAMMA / BETA - 1) * v + step * (GAMMA / (2 * BETA) - 1) * a)
        free = factor.solve(known)
        gap = across @ free - irregularity(t)
        delta = solve_compression(law, across @ response, gap, gap if delta is None else delta)
        force = law.force(delta)
        new = free - response @ force
        a_new = a0 * (new - x) - v / (BETA * step) - (0.5 / BETA - 1) * a
        v = v + step * ((1 - GAMMA) * a + GAMMA * a_new)
        x, a = new, a_new
        yield Instant(time=t, x=x, v=v, force=force)


def _contact_response(mono: Monolithic, rails: sparse.csr_array, factor: object) -> FloatArray:
    """Displacements at the end of a step per contact force there, shape (n, n_contacts)."""
    across = (mono.wheels - rails).toarray().T
    solved: FloatArray = factor.solve(np.ascontiguousarray(across))  # type: ignore[attr-defined]
    return solved
