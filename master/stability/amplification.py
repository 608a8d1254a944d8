"""What one step of a scheme does to a linear system: its growth, before anything is run.

On linear components a step of any scheme is a linear map of everything that decides the future:
states, past inputs, the scheme's memory. It is found by making the step, from rest with one of
those numbers at a time not zero. The coupling is stable if no eigenvalue is outside the unit
circle.

A component with hundreds of modes is left open: its free motion is given from outside, and what
it is fed is taken note of. The rest is a small map, closed again at any z on a circle by the
component's own sampled transfer function; the eigenvalues outside are counted by the argument
principle, so no resonance is too sharp and no matrix too large.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.linear.low_rank import factors
from railcosim.master.linear.modal import real_form
from railcosim.master.linear.partial_fractions import PartialFractions, of_modes
from railcosim.master.linear.state_space import ComplexArray, IndexArray
from railcosim.master.stability.argument_principle import TurningLostError
from railcosim.master.stability.determinant import Determinant

SAME = 1e-6
"""Of a rate: one that is faster by less is that of the same motion."""


@dataclass(frozen=True, kw_only=True)
class Amplification:
    """One step as a map of the memory m, the free motions f of modes, and what they are fed w.

    m' = N m + R f, w = Q m + P f, and back from w to f by the modes: q' = E q + G w, f = 2 Re(C q).
    The signals g add W g to m' and V g to w.

    Attributes
    ----------
    h : float or array
        The step, s. Of several steps, the maps have their shape before their own, and only
        `real_ends` can be asked.
    N, R, Q, P, W, V : array
        The maps.
    E, G, C : array of complex, shapes (n,), (n, n_w) and (n_f, n)
        The modes, one of each conjugate pair; a real factor counts half in C.
    signals : array, shape (n_g,)
        Times of the signals in the step, s.
    outputs : array of int
        Where in m the system's outputs are.
    within : array, shape (..., n_w, n_w)
        What is fed in a step, through what is seen of it in the same step, makes of itself; what
        agrees is taken as agreed on, however a scheme comes to it.
    """

    h: Any
    N: FloatArray
    R: FloatArray
    Q: FloatArray
    P: FloatArray
    W: FloatArray
    V: FloatArray
    E: ComplexArray
    G: ComplexArray
    C: ComplexArray
    signals: FloatArray
    outputs: IndexArray
    within: FloatArray

    @cached_property
    def contraction(self) -> float:
        """What an iteration within the step that gives back what it gets leaves of an error.

        One where it does not converge.
        """
        return float(np.abs(np.linalg.eigvals(self.within)).max(initial=0.0))

    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues of the whole map: every motion's change a step."""
        A, B, C = real_form(self.E, self.G, self.C)
        memory = np.hstack([self.N, self.R @ C])
        modes = B @ np.hstack([self.Q, self.P @ C])
        modes[:, len(self.N) :] += A
        found: ComplexArray = np.linalg.eigvals(np.concatenate([memory, modes])).astype(complex)
        return found

    def growth(self) -> float:
        """Rate (1/s) at which the fastest-growing motion grows; negative if all die away."""
        radius = self.spectral_radius()
        return math.log(radius) / self.h if radius else -math.inf

    def growth_above(self, rate: float) -> float:
        """The same, or `rate` (1/s) if that is more: without all eigenvalues."""
        found, beyond = rate, rate
        while self.growing(beyond):
            try:
                zero = self.determinant.zero_outside(math.exp(beyond * self.h))
            except TurningLostError:
                zero = 0.0j
            if not zero:
                return self.growth()
            found = math.log(abs(zero)) / self.h
            beyond = found + SAME * abs(found)
        return found

    def spectral_radius(self) -> float:
        """Largest eigenvalue of the map: growth a step."""
        return float(np.abs(self.eigenvalues()).max(initial=0.0))

    def growing(self, rate: float = 0.0) -> int:
        """Count the motions that grow faster than exp(rate t).

        Parameters
        ----------
        rate : float
            In 1/s.
        """
        radius = math.exp(rate * self.h)
        try:
            return self.determinant.outside(radius)
        except TurningLostError:  # the map is so large that its determinant is rounding
            return int((np.abs(self.eigenvalues()) > radius).sum())

    @cached_property
    def determinant(self) -> Determinant:
        """That of z - everything."""
        one = self._least()
        return Determinant(one.N, one.R, one.Q, one.P, one.E, one.G, one.C)

    def real_ends(self) -> FloatArray:
        """Numbers that change sign when a motion starts to grow that turns by whole or half turns.

        Returns
        -------
        array, shape (..., 2) for steps of shape (...)
            The determinant at z = 1 and at z = -1, but for factors that are never zero.
        """
        found = []
        for z in (1.0, -1.0):
            L = 2.0 * ((self.C / (z - self.E)[..., None, :]) @ self.G).real
            zN = z * np.eye(self.N.shape[-1]) - self.N
            H = self.Q @ np.linalg.solve(zN, self.R) + self.P
            found.append(np.linalg.det(zN) * np.linalg.det(np.eye(L.shape[-2]) - L @ H))
        return np.stack(found, axis=-1)

    def _least(self) -> Amplification:
        """The same growth with as few numbers as it takes: what is fed and seen is often alike."""
        N, R, Q = self.N, self.R, self.Q
        n = -1
        while n != len(N):
            n = len(N)
            # What decides nothing, or is gone after a step, does not grow.
            alive = (N.any(axis=0) | Q.any(axis=0)) & (N.any(axis=1) | R.any(axis=1))
            N, R, Q, _ = merged(N[alive][:, alive], R[alive], Q[:, alive])
        fed, by = factors(np.hstack([Q, self.P]))
        Q, P = by[:, :n], by[:, n:]
        to, seen = factors(np.concatenate([R, P]))
        return replace(
            self, N=N, R=to[:n], Q=Q, P=to[n:], G=self.G @ fed, C=seen @ self.C,
            W=self.W[:0], V=self.V[:0], outputs=self.outputs[:0],
        )  # fmt: skip

    def response(
        self, omega: FloatArray, signal: ComplexArray, outputs: Sequence[int]
    ) -> ComplexArray:
        """Outputs at communication points while the signals are exp(i omega t) times `signal`.

        Parameters
        ----------
        omega : array, shape (n_omega,)
            rad/s.
        signal : array of complex, shape (n_omega, n_signal)
            Amplitudes.
        outputs : sequence of int
            Which of the system's outputs.

        Returns
        -------
        array of complex, shape (n_omega, len(outputs))
        """
        z = np.exp(1j * omega * self.h)
        shifted = np.exp(1j * omega[:, None] * self.signals)
        g = (shifted[:, :, None] * signal[:, None, :]).reshape(len(z), -1)
        zN = z[:, None, None] * np.eye(len(self.N)) - self.N
        inner = np.linalg.solve(
            zN, np.concatenate([np.broadcast_to(self.R, (len(z), *self.R.shape)),
                                (g @ self.W.T)[:, :, None]], axis=2)
        )  # fmt: skip
        free, driven = inner[:, :, :-1], inner[:, :, -1]
        loop = self._loop(z)
        w = np.linalg.solve(
            np.eye(len(self.Q)) - (self.Q @ free + self.P) @ loop,
            (driven @ self.Q.T + g @ self.V.T)[:, :, None],
        )
        m = (free @ (loop @ w))[:, :, 0] + driven
        asked: ComplexArray = m[:, self.outputs[list(outputs)]]
        return asked

    def _loop(self, z: ComplexArray) -> ComplexArray:
        """What w brings back as f, shape (n_z, n_f, n_w)."""
        return self._fractions.at(z)

    @cached_property
    def _fractions(self) -> PartialFractions:
        return of_modes(self.E, self.G, self.C)


def merged(
    N: FloatArray, R: FloatArray, Q: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, IndexArray]:
    """The same map with those numbers of the memory as one that are equal after any step.

    Growth stays: it is motions that are gone after a step that go.

    Returns
    -------
    N, R, Q : array
        The maps.
    place : array of int
        Where each number is now.
    """
    place = np.arange(len(N))
    while True:
        _, first, which = np.unique(
            np.hstack([N, R]), axis=0, return_index=True, return_inverse=True
        )
        if len(first) == len(N):
            return N, R, Q, place
        which = which.ravel()  # numpy 2.0 gives it another shape
        onto = np.zeros((len(N), len(first)))
        onto[np.arange(len(N)), which] = 1.0
        N, R, Q, place = (N @ onto)[first], R[first], Q @ onto, which[place]
