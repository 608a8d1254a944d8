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
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from railcosim.master.component import FloatArray
from railcosim.master.linear.state_space import ComplexArray, IndexArray
from railcosim.master.schemes import Scheme
from railcosim.master.stability.argument_principle import solve_triangular, windings
from railcosim.master.stability.observed_step import Column, ObservedStep
from railcosim.master.stability.open_component import TICK, Sampled, together
from railcosim.master.system import System


@dataclass(frozen=True)
class Amplification:
    """One step as a map of the memory m, the free motions f and what is fed w.

    m' = N m + R f, w = Q m + P f, and back from w to f by the open components; the signals g add
    W g to m' and V g to w.

    Attributes
    ----------
    h : float
        The step, s.
    N, R, Q, P, W, V : array
        The maps.
    open : Sampled
        The open components over the step: from w to f.
    signals : array, shape (n_g,)
        Times of the signals in the step, s.
    outputs : array of int
        Where in m the system's outputs are.
    """

    h: float
    N: FloatArray
    R: FloatArray
    Q: FloatArray
    P: FloatArray
    W: FloatArray
    V: FloatArray
    open: Sampled
    signals: FloatArray
    outputs: IndexArray

    def eigenvalues(self) -> ComplexArray:
        """Eigenvalues of the map with the open components closed: every motion's change a step."""
        A, B, C = self.open.real()
        NR = np.hstack([self.N, self.R @ C])
        QP = B @ np.hstack([self.Q, self.P @ C])
        QP[:, len(self.N) :] += A
        found: ComplexArray = np.linalg.eigvals(np.concatenate([NR, QP])).astype(complex)
        return found

    def growth(self) -> float:
        """Rate (1/s) at which the fastest-growing motion grows; negative if all die away."""
        radius = self.spectral_radius()
        return math.log(radius) / self.h if radius else -math.inf

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
        # Forces and motions differ by the stiffness: balanced, slow motions keep their digits.
        balanced, _, _, scale, _ = scipy.linalg.lapack.dgebal(self.N, scale=1, permute=0)
        T, U = scipy.linalg.schur(balanced, output="complex")
        own = np.diag(T)
        outside = int((np.abs(own) > radius).sum())
        if not self.Q.size or not self.open.E.size:
            return outside
        inputs, outputs = U.conj().T @ (self.R / scale[:, None]), (self.Q * scale) @ U

        def turn(phi: FloatArray) -> ComplexArray:
            z = radius * np.exp(1j * phi)
            H = outputs @ solve_triangular(T, inputs, z) + self.P
            matrix = np.eye(len(self.Q)) - H @ self.open.response(z)
            sign, size = np.linalg.slogdet(matrix)
            return np.asarray(size + 1j * np.angle(sign))

        # det(z - everything) = det(z - N) det(z - open modes) turn(z), and turn is 1 at infinity:
        # so it has as many more zeros than poles outside as it turns backwards around the circle.
        return outside - windings(turn, np.concatenate([own, self.open.E]))

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
        loop = self.open.response(z)
        w = np.linalg.solve(
            np.eye(len(self.Q)) - (self.Q @ free + self.P) @ loop,
            (driven @ self.Q.T + g @ self.V.T)[:, :, None],
        )
        m = (free @ (loop @ w))[:, :, 0] + driven
        asked: ComplexArray = m[:, self.outputs[list(outputs)]]
        return asked


class Amplifier:
    """Finds what a step does; made once for a scheme and a system, asked for many steps.

    Parameters
    ----------
    system : System
        Of linear components at rest: `LinearComponent`, `Law` of a linear law, `Open`.
    scheme : Scheme
        Which to observe.

    Attributes
    ----------
    system
        As given.
    evaluations : int
        How often each component was stepped in a step, at the most, so far.
    """

    def __init__(self, system: System, scheme: Scheme) -> None:
        self.system = system
        self.evaluations = 0
        self._scheme = scheme
        self._rest = system.save_state()
        self._used: IndexArray | None = None

    def at(self, h: float, *, driven: bool = False) -> Amplification:
        """Observe a step of length `h` (s).

        Parameters
        ----------
        h : float
            s.
        driven : bool, optional
            Whether what signals do is observed as well, for `Amplification.response`.

        Raises
        ------
        NotLinear
            If the scheme's memory changes its form.
        Exception
            Whatever the scheme raises if it cannot make the step.
        """
        self.system.restore_state(self._rest)
        step = ObservedStep(self.system, self._scheme, h)
        places = step.memory if self._used is None else self._used
        columns = [step.by_memory(k) for k in places]
        N, Q = _stacked(columns, step)
        # What is never seen in an output is no memory: it need not be tried at other steps.
        self._used = places[_seen(N, Q, places, step.outputs)]
        kept = np.union1d(self._used, step.outputs)
        N, Q = (_spread(part, places, kept) for part in (N, Q))
        models = [c for c in step.opened if c.model is not None]
        signals = [c for c in step.opened if driven and c.model is None]
        R, P = _stacked([column for c in models for column in step.by_free_motion(c)], step)
        W, V = _stacked([column for c in signals for column in step.by_free_motion(c)], step)
        heard = (Q != 0).any(1) | (P != 0).any(1) | (V != 0).any(1)
        self.evaluations = max(self.evaluations, step.evaluations)
        return Amplification(
            h=h, N=N[kept], R=R[kept], Q=Q[heard], P=P[heard], W=W[kept], V=V[heard],
            open=together([c.sampled(h, step.when[c.name]) for c in models]).of_inputs(heard),
            signals=TICK * np.array([tick for c in signals for tick, _ in c.free]),
            outputs=np.searchsorted(kept, step.outputs),
        )  # fmt: skip


def _stacked(columns: list[Column], step: ObservedStep) -> tuple[FloatArray, FloatArray]:
    """Columns side by side: what they do to the memory, and to what is fed."""
    one, two = np.zeros((step.size, len(columns))), np.zeros((step.n_fed, len(columns)))
    for k, (memory, fed) in enumerate(columns):
        one[:, k], two[:, k] = memory, fed
    return one, two


def _seen(N: FloatArray, Q: FloatArray, places: IndexArray, outputs: IndexArray) -> Any:
    """Which columns, numbers of the memory at `places`, show in outputs or in what is fed, ever."""
    influence = N != 0
    seen = influence[outputs].any(axis=0) | (Q != 0).any(axis=0)
    while True:
        more = seen | influence[places[seen]].any(axis=0)
        if (more == seen).all():
            return seen
        seen = more


def _spread(part: FloatArray, places: IndexArray, kept: IndexArray) -> FloatArray:
    """Columns for `kept`, zero where they are not among `places`."""
    wide = np.zeros((len(part), len(kept)))
    _, here, there = np.intersect1d(kept, places, return_indices=True)
    wide[:, here] = part[:, there]
    return wide
