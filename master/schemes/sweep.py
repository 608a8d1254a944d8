"""All components but the law, taken over a step by given polynomials of the law's forces.

The components are taken one after the other, each through all its sub-steps. What they get from
each other beside the law's forces is a polynomial through samples: of this step where the feeder
has gone before, else of the sweep before, else the last step's continued.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.law import IndexArray, Law
from railcosim.master.polynomials import continued
from railcosim.master.schemes.drift import Drift
from railcosim.master.schemes.nodes import Nodes
from railcosim.master.schemes.rider import Rider
from railcosim.master.schemes.variants import Variant
from railcosim.master.system import System


class Sweep:
    """See the module.

    Parameters
    ----------
    system : System
        Whose components.
    law : int
        Index of the law among them.
    variant : Variant
        Where to stop, and what to sample.

    Attributes
    ----------
    samples : array, shape (n_points + 1, n_outputs)
        All outputs at the beginning and at the points of the last sweep.
    nodes : Nodes
        Of the law.
    drift : Drift
        Of what it is given.
    fallbacks : tuple of str
        A sentence for every component that has to do with less than a polynomial.
    stops : tuple of float
        Where in a step components without inputs are asked, in steps from its beginning.

    Raises
    ------
    ValueError
        If a component cannot do what the variant asks for.
    """

    def __init__(self, system: System, law: int, variant: Variant) -> None:
        self._system, self._variant = system, variant
        component = system.components[law]
        assert isinstance(component, Law)
        own, n = system.own_outputs(law), len(system.outputs)
        others = [k for k in range(len(system.components)) if k != law]
        self._riders = [
            Rider(system, k, own, variant) for k in others if system.components[k].inputs
        ]
        self.fallbacks = tuple(
            f"{system.components[rider.k].name} takes no derivatives of its inputs: those that are "
            "no forces of the law are held at their mean, and the coupling is of order 2 at most"
            for rider in self._riders
            if len(rider.fed) and not rider.degree
        )
        self._tau = (0.0, *variant.points)
        sources, S = system.sources(law), component.S
        ridden = np.zeros(n, dtype=bool)
        for rider in self._riders:
            ridden[rider.own] = True
        fed = np.flatnonzero([s < n and bool(ridden[s]) for s in sources])
        moving = np.setdiff1d(fed, component.rates)
        self._motions = sources[moving]
        self.nodes = Nodes.of(variant, component, fed)
        self._S = S[self.nodes.rows][:, moving]
        self._law, self._n_forces = law, len(component.outputs)
        self.drift = Drift(system, law, self._riders, self.nodes)
        self.samples: FloatArray = np.zeros((len(self._tau), n))
        self._stops, places = np.unique([*variant.nodes, *variant.points], return_inverse=True)
        self.stops = tuple(self._stops.tolist())
        self._at_nodes, self._at_points = np.split(places, [len(variant.nodes)])
        self._signals = [
            (k, system.own_outputs(k), _adds(component, sources, system.own_outputs(k)))
            for k in others
            if not system.components[k].inputs
        ]
        self._left = np.flatnonzero((sources >= own.start) & (sources < own.stop) | (sources >= n))
        self._leftover = S.T[self._left]

    def predict(self, before: FloatArray | None, ratio: float) -> None:
        """Fill the samples for a step: the last step's continued, or what is now.

        Parameters
        ----------
        before : array or None
            Samples of the last step.
        ratio : float
            Length of this step in last ones.
        """
        now = self._system.outputs
        for rider in self._riders:
            rider.begin()
        if before is None:
            self.samples = np.repeat(now[None], len(self._tau), axis=0)
        else:
            # Differences, so that what does not change stays the same to the bit.
            steps = continued(self._tau, ratio) @ (before - before[-1])
            self.samples = now + steps
            self.samples[0] = now

    def look_ahead(self, t: float, h: float) -> FloatArray:
        """Step the components without inputs, which nothing that happens can change.

        Returns
        -------
        array, shape (n_nodes, n_contacts, m)
            What they add to the motions of the law at the nodes.
        """
        left = self._system.gather(self._law)[self._left] @ self._leftover
        motions = np.repeat(left[None], len(self._at_nodes), axis=0)
        for k, own, adds in self._signals:
            found = self._system.components[k].through(t, t + self._stops * h)
            self.samples[1:, own] = found[self._at_points]
            motions += found[self._at_nodes] @ adds
        return motions.reshape(len(motions), self.nodes.contacts, -1)

    def save(self) -> Any:
        """Snapshot of the components at the beginning of a step."""
        return [self._system.components[rider.k].save_state() for rider in self._riders]

    def restore(self, states: Any) -> None:
        """Back to a snapshot."""
        for rider, state in zip(self._riders, states, strict=True):
            self._system.components[rider.k].restore_state(state)

    def beginning(self, h: float) -> FloatArray:
        """Displacements of the law by the components, and with `Variant.rates` rates times `h`.

        Returns
        -------
        array, shape (1 or 2, n_displacements)
            m.
        """
        return self._compress(self._system.outputs[None, self._motions], h)

    def run(self, t: float, h: float, force: FloatArray) -> FloatArray:
        """Take the components from `t` to `t + h` (s).

        Parameters
        ----------
        t, h : float
            s.
        force : array, shape (degree + 1, n_forces)
            Legendre coefficients of the law's forces over the step, N.

        Returns
        -------
        array, shape (n_answers, n_displacements)
            Displacements of the law by the components at the points, and with `Variant.rates` the
            rates at the end times `h`, m.
        """
        for rider in self._riders:
            rider.ride(t, h, force, self.samples, self.drift.carried)
        return self._compress(self.samples[1:].take(self._motions, axis=1), h)

    def derivative(self) -> FloatArray | None:
        """Compliance over the step just made, told by the components themselves.

        Returns
        -------
        array, shape (1, n_displacements, 1, n_forces), or None
            m/N; None if a component does not know it, or for another variant than a held force,
            which is all that FMI can tell.
        """
        if self._variant.degree or len(self._variant.points) > 1 or self._variant.rates:
            return None
        moved = np.zeros((len(self._system.outputs), self._n_forces))
        for rider in self._riders:
            told = self._system.components[rider.k].step_derivative()
            if told is None:
                return None
            moved[rider.own, rider.forces] = told[:, rider.forced]
        G: FloatArray = self._S @ moved[self._motions]
        return G[None, :, None, :]

    def _rates(self) -> FloatArray:
        """Rates of the motions that the law takes from the components, now."""
        rates: FloatArray = np.zeros(len(self._system.outputs))
        for rider in self._riders:
            known = self._system.components[rider.k].output_rates()
            rates[rider.own] = known
        motions: FloatArray = rates[self._motions]
        return motions

    def _compress(self, motions: FloatArray, h: float) -> FloatArray:
        """Displacements of the law by those motions, and where the variant asks by their rates."""
        if self._variant.rates:
            motions = np.concatenate([motions, h * self._rates()[None]])
        compressions: FloatArray = motions @ self._S.T
        return compressions


def _adds(law: Law, sources: IndexArray, own: slice) -> FloatArray:
    """What outputs `own` add to the motions of a law, shape (n_own, n_motions)."""
    given = (sources >= own.start) & (sources < own.stop)
    adds: FloatArray = np.zeros((own.stop - own.start, len(law.S)))
    np.add.at(adds, sources[given] - own.start, law.S.T[given])
    return adds
