"""Black boxes by their linear models, coupled as they would be run, for schemes to be held to."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from railcosim.master.component import Component, Hold
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.law import Law
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.stability.open_component import Open
from railcosim.master.system import System

SLOW, FAST = 1e-4, 1e-2
"""Growth that counts, and that is fast, over the rate (1/s) of the system's slowest motion."""
SHORT, LONG = 1e-3, 1.0
"""Steps that are searched: parts of a period of the fastest motion, and of the slowest."""


class Box(Open):
    """A component left open that declares, and can do, what another does."""

    def __init__(self, model: StateSpace, like: Component) -> None:
        super().__init__(model.name, model.inputs, model.outputs, model)
        columns, rows = (
            [[v.name for v in known].index(v.name) for v in own]
            for known, own in ((like.inputs, self.inputs), (like.outputs, self.outputs))
        )
        able = like.max_input_derivative
        self.max_input_derivative = min(able, 2) or int(Hold.EXTRAPOLATE in like.holds)
        self.can_rollback = like.can_rollback
        self._declared = like.feedthrough[np.ix_(rows, columns)]
        self._stated = like.states_dependence[rows]

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """By which a run would sort its exchange, see `Component`."""
        return self._declared

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """Likewise."""
        return self._stated


class Boxes:
    """Black boxes as linear components left open, coupled as they would be run; see `Coupling`.

    Parameters
    ----------
    models : sequence of StateSpace
        Of each component.
    like : sequence of Component
        The components themselves.
    connections : sequence of Connection
        Between them and the law.
    law : Law, optional
        In the master.
    still : float
        Rate (1/s) of motions that the models do not tell from none.

    Attributes
    ----------
    poles : array of complex, shape (n_states,)
        Of all coupled exactly, 1/s.
    exact : float
        Rate (1/s) at which something grows if all is coupled exactly; zero if nothing does.
    rate, fast : float
        What grows slower counts as stable, and as slow, 1/s.
    shortest, resonant, longest : float
        Steps that are searched, and that at which the fastest mode turns by half, s.
    """

    parts, width = (), 4

    def __init__(
        self,
        models: Sequence[StateSpace],
        like: Sequence[Component],
        connections: Sequence[Connection],
        law: Law | None = None,
        still: float = 0.0,
    ) -> None:
        boxes: list[Component] = [Box(m, c) for m, c in zip(models, like, strict=True)]
        system = System([*boxes, *([law] if law else [])], connections)
        self.systems, self.rests = [system], [system.save_state()]
        own = np.concatenate([np.zeros(0), *(np.linalg.eigvals(m.A.toarray()) for m in models)])
        coupled = _coupled(models, law, connections)
        moving = np.abs(np.concatenate([own, coupled]))
        moving = moving[moving > max(1e-9 * moving.max(initial=0.0), still)]
        if not moving.size:
            raise CouplingError("nothing in it moves by itself: no rate depends on a state")
        slowest, fastest = float(moving.min()), float(moving.max())
        self.poles = coupled
        self.exact = max(0.0, float(coupled.real.max(initial=-math.inf)))
        self.rate, self.fast = self.exact + SLOW * slowest, self.exact + FAST * slowest
        self.resonant = math.pi / float(np.abs(own).max(initial=fastest / 1e3))
        self.shortest = SHORT * 2.0 * math.pi / fastest
        self.longest = LONG * 2.0 * math.pi / slowest


def _coupled(
    models: Sequence[StateSpace], law: Law | None, connections: Sequence[Connection]
) -> NDArray[np.complex128]:
    """Poles (1/s) of all coupled exactly."""
    ins = [(m.name, v.name) for m in models for v in m.inputs]
    outs = [(m.name, v.name) for m in models for v in m.outputs]
    D = block_diag(*(m.D for m in models))
    if law is not None:
        ins += [(law.name, v.name) for v in law.inputs]
        outs += [(law.name, v.name) for v in law.outputs]
        tangent = law.law.tangent(np.zeros((law.contacts, len(law.S) // law.contacts)))
        D = block_diag(D, block_diag(*tangent) @ law.S)
    A = block_diag(*(m.A.toarray() for m in models))
    B, C = np.zeros((len(A), len(ins))), np.zeros((len(outs), len(A)))
    B[:, : sum(len(m.inputs) for m in models)] = block_diag(*(m.B for m in models))
    C[: sum(len(m.outputs) for m in models)] = block_diag(*(m.C for m in models))
    K = np.zeros((len(ins), len(outs)))
    for c in connections:
        K[ins.index((c.target, c.input)), outs.index((c.source, c.output))] = 1.0
    closed = A + B @ K @ np.linalg.solve(np.eye(len(outs)) - D @ K, C)
    return np.asarray(np.linalg.eigvals(closed), dtype=np.complex128)
