"""How displacements change beyond the rates that are told of them.

A component may be met at a place that its inputs move along it: a rail under a rolling wheel. Its
displacement there then changes by more than its material moves. The law wants the material's rate.

What moves along is taken to go at one speed over a step: while it speeds up, its part of a rate is
half a step late.
"""

from __future__ import annotations

import numpy as np

from railcosim.master.component import ComponentError, FloatArray
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
    samples : array, shape (n_points + 1, n)
        By how much more their displacements change, at the beginning of a step and at its points,
        per s.
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
        self._told, self._moved = sources[self.inputs], sources[component.displacements[known]]
        self._adds: FloatArray = component.S[:, self.inputs]
        self._tau = np.array([0.0, *nodes.variant.points])
        self._between = lagrange(self._tau, nodes.variant.nodes)
        self.samples: FloatArray = np.zeros((len(self._tau), len(self.inputs)))
        self._begun = False

    def begin(self, before: FloatArray | None) -> None:
        """Go on from the end of the last step, if there was one."""
        self._begun = before is not None
        self.samples[:] = 0.0 if before is None else before

    def note(self, k: int, point: int, *, moved: bool) -> None:
        """Take note of component `k` where it has got to.

        Parameters
        ----------
        k : int
            The component.
        point : int
            Of the step, from 1; 0 is its beginning.
        moved : bool
            Whether its inputs, beside the forces of the law, change at all.
        """
        own = self._feeders == k
        if not own.any():
            return
        drift = 0.0
        if moved:
            component, its = self._system.components[k], self._system.own_outputs(k).start
            rates = component.output_rates(self._moved[own] - its)
            if rates is None:
                raise ComponentError(
                    f"{component.name} does not know the rates of its outputs, of which the law "
                    "needs how fast what moves along it changes: use an FMU with "
                    "maxOutputDerivativeOrder, one that owns the contact, or hold the wheels"
                )
            drift = rates[self._moved[own] - its] - self._system.outputs[self._told[own]]
        self.samples[point, own] = drift
        if point == 1 and not self._begun:
            self.samples[0, own] = drift  # of the first step: the best that is known

    def at_nodes(self) -> FloatArray | float:
        """What it adds to the motions of the law, shape (n_nodes, n_contacts, m)."""
        if not self.inputs.size or not self.samples.any():
            return 0.0
        added: FloatArray = self._between @ self.samples @ self._adds.T
        return -added.reshape(len(added), self._nodes.contacts, -1)

    def end_rates(
        self, past: FloatArray | None, ratio: float, h: float, now: FloatArray
    ) -> FloatArray:
        """Rates at the end of a step, of the polynomial through the displacements.

        Parameters
        ----------
        past : array or None, shape (n_outputs,)
            All outputs at the beginning of the last step.
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
        tau, values = self._tau, now[:, self._moved]
        if past is not None:
            tau = np.array([-ratio, *tau])
            values = np.concatenate([past[None, self._moved], values])
        weights = lagrange(tau, np.ones(1), 1)[0] / h
        rates: FloatArray = weights @ (values - values[-1]) - self.samples[-1]
        return rates
