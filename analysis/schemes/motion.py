"""The motion that a coupling makes grow fastest: how it is driven from the rail, and seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.analysis.pair.linear_pair import Part
from railcosim.master.linear.state_space import ComplexArray
from railcosim.master.stability.amplification import Amplification
from railcosim.master.system import System

from .disturbed import pushed
from .stability import Coupling

NEAR = 1e-6, 1e-8, 1e-10
"""Distances to an eigenvalue, of itself, at one of which nothing is seen but its own motion. What
grows is looked for at all, however little heights do to it; what dies away at the first: driven
hard enough to be seen, it would drown in others. ..."""
POLE = 1.9
"""... and at twice of it half as much."""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A motion of vehicle and track at communication points, exp(rate t) times its shape.

    Attributes
    ----------
    rate : complex
        Growth (1/s) and angular frequency (rad/s), the latter not above half a turn a step.
    heights : array of complex, shape (n_surfaces,)
        Of the rails' surfaces, m, of size 1: times exp(i omega t) they drive it most.
    receptance : float
        Size of the forces (N) after one step of such heights.
    """

    rate: complex
    heights: ComplexArray
    receptance: float


def fastest_motion(coupling: Coupling, h: float) -> Motion:
    """Find the motion that grows fastest, or dies away most slowly, with steps of `h` (s).

    Raises
    ------
    Exception
        Whatever the scheme raises if it cannot make the step.
    """
    found = []
    for amplifier, part in zip(coupling.amplifiers, coupling.parts, strict=True):
        step = amplifier.at(h)
        values = step.eigenvalues()
        upper = values[values.imag >= 0.0]
        # Some states of a part may be nobody's: no force reaches them.
        for z in upper[np.argsort(-np.abs(upper))].tolist():
            motion = _motion(step, part, amplifier.system, z)
            if motion is not None:
                found.append(motion)
                break
    return max(found, key=lambda motion: motion.rate.real)


def _motion(step: Amplification, part: Part, system: System, z: complex) -> Motion | None:
    """What heights do next to an eigenvalue is its motion, and nothing else; None if nothing."""
    forces = pushed(part.layout, [name.partition(".")[2] for name in system.names])
    one = np.eye(len(part.layout.surface.ports), dtype=complex)

    def receptance(beside: complex) -> ComplexArray:
        omega = np.full(len(one), np.log(beside) / (1j * step.h))
        return step.response(omega, one, forces).T

    for distance in NEAR if abs(z) > 1.0 else NEAR[:1]:
        near, far = (receptance((1.0 + n * distance) * z) for n in (1, 2))
        if np.linalg.norm(near) > POLE * np.linalg.norm(far):
            break
    else:
        return None
    _, s, Vh = np.linalg.svd(near)
    size = np.linalg.norm(part.mix[:, 0])
    return Motion(
        rate=complex(np.log(z)) / step.h,
        heights=part.mix @ Vh[0].conj() / size,
        receptance=float(s[0] * distance * abs(z)),
    )
