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

from collections.abc import Sequence

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.law import IndexArray, Law
from railcosim.master.polynomials import end_slopes
from railcosim.master.schemes.nodes import Nodes
from railcosim.master.schemes.rider import Rider
from railcosim.master.system import System


class Drift:
    """See the module.

    Parameters
    ----------
    system : System
        Whose components.
    law : int
        Index of the law among them.
    riders : sequence of Rider
        The components that are stepped under forces.
    nodes : Nodes
        Of the law.

    Attributes
    ----------
    inputs : array of int, shape (n,)
        Inputs of the law that are rates told by those components.
    carried : array, shape (n_points + 1, n)
        By how much more their displacements have changed since the beginning of a step, there and
        at its points; riders write it.
    """

    def __init__(self, system: System, law: int, riders: Sequence[Rider], nodes: Nodes) -> None:
        component = system.components[law]
        assert isinstance(component, Law)
        sources, n = system.sources(law), len(system.outputs)
        feeders = np.full(n, -1)
        for j, rider in enumerate(riders):
            feeders[rider.own] = j
        fed_by = np.where(sources < n, feeders[np.minimum(sources, n - 1)], -1)
        known = fed_by[component.rates] >= 0
        self.inputs: IndexArray = component.rates[known]
        self._moved: IndexArray = sources[component.displacements[known]]
        for j, rider in enumerate(riders):
            if j in fed_by[self.inputs]:
                rider.show()
        of_known = component.displacements[known]
        self._adds: FloatArray = component.S[nodes.rows][:, of_known].T.copy()
        self._tau = (0.0, *nodes.variant.points)
        self.carried: FloatArray = np.zeros((len(self._tau), n))

    def at_points(self) -> FloatArray | None:
        """By how much displacements of the law have changed so, shape (n_points, n_displacements).

        None where the law does not ask.
        """
        if not self.inputs.size:
            return None
        added: FloatArray = self.carried[1:].take(self._moved, axis=1) @ self._adds
        return added

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
            All outputs at the beginning of the last step, and what was carried over it, each of
            shape (n_outputs,).
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
        tau, values = self._tau, now - self.carried
        if past is not None:
            outputs, carried = past
            tau = (-ratio, *tau)
            values = np.concatenate([(outputs + carried)[None], values])
        values = values[:, self._moved]
        rates: FloatArray = end_slopes(tau) / h @ (values - values[-1])
        return rates
