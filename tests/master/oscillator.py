"""The two-mass oscillator of the co-simulation literature, each half stepped exactly.

Left: mass, spring and damper to the ground; a force in, the motion out (no feedthrough).
Right: likewise, and it owns the coupling spring and damper: motion in, force out (feedthrough).
"""

from __future__ import annotations

import numpy as np

from railcosim.master.component import FloatArray, Hold, Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.linear_component import LinearComponent
from railcosim.master.system import System

M, K, C = 1.0, 20.0, 0.3  # kg, N/m, N s/m: both masses and their supports
K_C, C_C = 50.0, 0.5  # N/m, N s/m: the coupling
X0 = np.array([1.0, 0.0, -0.4, 0.0])  # m, m/s: x1, v1, x2, v2


class HoldingComponent(LinearComponent):
    """Takes no derivatives, but continues its inputs by itself; remembers what it was asked."""

    max_input_derivative = 0

    def __init__(self, name, *, holds=frozenset(Hold), **options):
        super().__init__(name, **options)
        self.holds = frozenset(holds)
        self.hold = Hold.CONSTANT
        self.before: tuple[FloatArray, float] | None = None  # inputs and length of the last step

    def set_hold(self, hold: Hold) -> None:
        super().set_hold(hold)
        self.hold = hold

    def do_step(self, t: float, h: float) -> None:
        now = self._inputs
        begin, slope = now, np.zeros_like(now)
        if self.before is not None and self.hold is Hold.EXTRAPOLATE:
            u, length = self.before
            slope = (now - u) / length
        elif self.before is not None and self.hold is Hold.INTERPOLATE:
            begin = self.before[0]
            slope = (now - begin) / h
        self._inputs, self._derivatives = begin, slope[None]
        super().do_step(t, h)
        self._inputs, self.before = now, (now, h)

    def save_state(self):
        return super().save_state(), self.before

    def restore_state(self, state):
        super().restore_state(state[0])
        self.before = state[1]


def make_left(kind=LinearComponent, **options) -> LinearComponent:
    return kind(
        "left",
        A=[[0.0, 1.0], [-K / M, -C / M]],
        B=[[0.0], [1.0 / M]],
        C=np.eye(2),
        D=np.zeros((2, 1)),
        x0=X0[:2],
        inputs=[Variable(name="force", unit="N")],
        outputs=[Variable(name="z", unit="m"), Variable(name="vz", unit="m/s")],
        **options,
    )


def make_right(kind=LinearComponent, **options) -> LinearComponent:
    return kind(
        "right",
        A=[[0.0, 1.0], [-(K + K_C) / M, -(C + C_C) / M]],
        B=[[0.0, 0.0], [K_C / M, C_C / M]],
        C=[[K_C, C_C], [1.0, 0.0]],
        D=[[-K_C, -C_C], [0.0, 0.0]],
        x0=X0[2:],
        inputs=[Variable(name="z", unit="m"), Variable(name="vz", unit="m/s")],
        outputs=[Variable(name="force", unit="N"), Variable(name="z2", unit="m")],
        **options,
    )


def make_system(kind=LinearComponent, **options) -> System:
    components = [make_left(kind, **options), make_right(kind, **options)]
    return System(components, connect_by_name(components))


def exact(times: FloatArray) -> FloatArray:
    """z, vz, force, z2 of the uncut system, shape (n_times, 4): the order of `make_system`."""
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-(K + K_C) / M, -(C + C_C) / M, K_C / M, C_C / M],
            [0.0, 0.0, 0.0, 1.0],
            [K_C / M, C_C / M, -(K + K_C) / M, -(C + C_C) / M],
        ]
    )
    outputs = np.array(
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-K_C, -C_C, K_C, C_C], [0.0, 0.0, 1.0, 0.0]]
    )
    values, vectors = np.linalg.eig(A)
    amplitudes = np.linalg.solve(vectors, X0.astype(complex))
    return (np.exp(np.outer(times, values)) * amplitudes @ (outputs @ vectors).T).real
