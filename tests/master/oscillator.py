"""The two-mass oscillator of the co-simulation literature, each half stepped exactly.

Left: mass, spring and damper to the ground; a force in, the motion out (no feedthrough).
Right: likewise, and it owns the coupling spring and damper: motion in, force out (feedthrough).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from railcosim.master.component import FloatArray, Hold, Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.system import System

M, K, C = 1.0, 20.0, 0.3  # kg, N/m, N s/m: both masses and their supports
K_C, C_C = 50.0, 0.5  # N/m, N s/m: the coupling
X0 = np.array([1.0, 0.0, -0.4, 0.0])  # m, m/s: x1, v1, x2, v2


class LinearComponent:
    """x' = A x + B u, y = C x + D u, exact for constant and linear u."""

    can_rollback = True

    def __init__(self, name, *, A, B, C, D, x0, inputs, outputs, holds=frozenset(Hold)):
        self.name = name
        self.A, self.B, self.C, self.D = (np.atleast_2d(np.array(X, float)) for X in (A, B, C, D))
        self.inputs: tuple[Variable, ...] = tuple(inputs)
        self.outputs: tuple[Variable, ...] = tuple(outputs)
        self.holds: frozenset[Hold] = frozenset(holds)
        self.x = np.array(x0, float)
        self.u = np.array([v.start for v in inputs])
        self.before: tuple[FloatArray, float] | None = None  # inputs and length of the last step
        self.hold = Hold.CONSTANT
        self.calls: list[str] = []
        self._matrices: dict[float, NDArray[np.float64]] = {}

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        return self.D != 0.0

    def set_hold(self, hold: Hold) -> None:
        assert hold in self.holds
        self.hold = hold

    def set_inputs(self, u: FloatArray) -> None:
        self.calls.append("set")
        self.u = np.array(u)

    def get_outputs(self) -> FloatArray:
        self.calls.append("get")
        return self.C @ self.x + self.D @ self.u

    def do_step(self, t: float, h: float) -> None:
        self.calls.append("step")
        begin = end = self.u
        if self.before is not None and self.hold is Hold.EXTRAPOLATE:
            u, length = self.before
            end = self.u + (self.u - u) * (h / length)
        elif self.before is not None and self.hold is Hold.INTERPOLATE:
            begin = self.before[0]
        self.x = (self._matrix(h) @ np.concatenate([self.x, begin, end - begin]))[: len(self.x)]
        self.before = (self.u, h)

    def save_state(self) -> Any:
        return self.x.copy(), self.u.copy(), self.before

    def restore_state(self, state: Any) -> None:
        self.x, self.u, self.before = state[0].copy(), state[1].copy(), state[2]

    def _matrix(self, h: float) -> NDArray[np.float64]:
        if h not in self._matrices:
            n, m = self.B.shape
            G = np.zeros((n + 2 * m, n + 2 * m))
            G[:n, :n], G[:n, n : n + m] = self.A, self.B
            G[n : n + m, n + m :] = np.eye(m) / h
            self._matrices[h] = expm(h * G)
        return self._matrices[h]


def make_left(holds=frozenset(Hold)) -> LinearComponent:
    return LinearComponent(
        "left",
        A=[[0.0, 1.0], [-K / M, -C / M]],
        B=[[0.0], [1.0 / M]],
        C=np.eye(2),
        D=np.zeros((2, 1)),
        x0=X0[:2],
        inputs=[Variable(name="force", unit="N")],
        outputs=[Variable(name="z", unit="m"), Variable(name="vz", unit="m/s")],
        holds=holds,
    )


def make_right(holds=frozenset(Hold)) -> LinearComponent:
    return LinearComponent(
        "right",
        A=[[0.0, 1.0], [-(K + K_C) / M, -(C + C_C) / M]],
        B=[[0.0, 0.0], [K_C / M, C_C / M]],
        C=[[K_C, C_C], [1.0, 0.0]],
        D=[[-K_C, -C_C], [0.0, 0.0]],
        x0=X0[2:],
        inputs=[Variable(name="z", unit="m"), Variable(name="vz", unit="m/s")],
        outputs=[Variable(name="force", unit="N"), Variable(name="z2", unit="m")],
        holds=holds,
    )


def make_system(**options) -> System:
    components = [make_left(**options), make_right(**options)]
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
