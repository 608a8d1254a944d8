"""How displacements change beyond what their material moves by.

A component may be met at a place that its inputs move along it: a rail under a rolling wheel. Its
displacement there then changes by more than its material moves. The law wants the material's rate.

By how much more is asked of the component itself: what it shows where it is met at the end of a
step less what it shows where it was met at the beginning, in the state before the step and in that
behind it; the mean of both. In each state that is exact along the way, also over a kink: under a
wheel that passes a support the displacement's rate steps, and the mean of its values at both ends
of a step is off by up to half of that, which stiff creep makes a force of.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.law import IndexArray, Law
from railcosim.master.polynomials import lagrange
from railcosim.master.schemes.nodes import Nodes
from railcosim.master.system import System


class Drift:
    """See the module.

    Parameters
    ----------
    system : System
        Whose components.
    law : int
        Index of the law among them.
    stepped : sequence of int
        Indices of the components that are stepped under forces.
    nodes : Nodes
        Of the law.

    Attributes
    ----------
    inputs : array of int, shape (n,)
        Inputs of the law that are rates told by those components.
    carried : array, shape (n_points + 1, n)
        By how much more their displacements have changed since the beginning of a step, there and
        at its points.
    """

    def __init__(self, system: System, law: int, stepped: list[int], nodes: Nodes) -> None:
        self._system, self._nodes = system, nodes
        component = system.components[law]
        assert isinstance(component, Law)
        sources, n = system.sources(law), len(system.outputs)
        feeders = [-1] * n
        for k in stepped:
            feeders[system.own_outputs(k)] = [k] * len(system.components[k].outputs)
        fed_by = np.array([feeders[s] if s < n else -1 for s in sources])
        known = fed_by[component.rates] >= 0
        self.inputs: IndexArray = component.rates[known]
        self._feeders = fed_by[self.inputs]
        self._moved = sources[component.displacements[known]]
        self._adds: FloatArray = component.S[:, self.inputs]
        self._tau = np.array([0.0, *nodes.variant.points])
        self._slopes = lagrange(self._tau, nodes.variant.nodes, 1)
        self.carried: FloatArray = np.zeros((len(self._tau), len(self.inputs)))

    def of(self, k: int) -> NDArray[np.bool_]:
        """Which of the inputs component `k` tells."""
        told: NDArray[np.bool_] = self._feeders == k
        return told

    def shown(self, k: int) -> FloatArray:
        """Displacements that component `k` shows now."""
        displaced: FloatArray = self._system.outputs[self._moved[self.of(k)]]
        return displaced

    def note(
        self,
        k: int,
        point: int,
        samples: FloatArray,
        ahead: FloatArray | None,
        behind: FloatArray | None,
    ) -> None:
        """Take note of component `k` where it has got to.

        Parameters
        ----------
        k : int
            The component.
        point : int
            Of the step, from 1; 0 is its beginning.
        samples : array, shape (n_points + 1, n_outputs)
            All outputs, there and at the points.
        ahead, behind : array or None
            Displacements in the state at the last point, met where it is met at this one; and in
            that at this point, met where it was at the last one. None: it is met where it was.
        """
        own = self.of(k)
        if ahead is None or behind is None:
            self.carried[point, own] = 0.0
            return
        last, now = samples[point - 1 : point + 1, self._moved[own]]
        more = (ahead - last + now - behind) / 2
        self.carried[point, own] = self.carried[point - 1, own] + more

    def at_nodes(self, h: float) -> FloatArray | float:
        """What it adds to the motions of the law, shape (n_nodes, n_contacts, m)."""
        if not self.inputs.size or not self.carried.any():
            return 0.0
        added: FloatArray = self._slopes @ self.carried @ self._adds.T / h
        return -added.reshape(len(added), self._nodes.contacts, -1)

    def end_rates(
        self,
        past: tuple[FloatArray, FloatArray] | None,
        ratio: float,
        h: float,
        now: FloatArray,
    ) -> FloatArray:
        """Rates at the end of a step, of the polynomial that the material follows.

        Parameters
        ----------
        past : (array, array) or None
            All outputs at the beginning of the last step, shape (n_outputs,); and what was carried
            over it, shape (n,).
        ratio : float
            Length of the last step in these.
        h : float
            Length of this step, s.
        now : array, shape (n_points + 1, n_outputs)
            All outputs, at the beginning and at the points.

        Returns
        -------
        array, shape (n,)
            Of the inputs, with one order more than the step alone would give.
        """
        tau, values = self._tau, now[:, self._moved] - self.carried
        if past is not None:
            outputs, carried = past
            tau = np.array([-ratio, *tau])
            values = np.concatenate([(outputs[self._moved] + carried)[None], values])
        weights = lagrange(tau, np.ones(1), 1)[0] / h
        rates: FloatArray = weights @ (values - values[-1])
        return rates
