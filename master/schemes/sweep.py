"""All components but the law, taken over a step by given polynomials of the law's forces.

The components are taken one after the other, each through all its sub-steps. What they get from
each other beside the law's forces is a polynomial through samples: of this step where the feeder
has gone before, else of the sweep before, else the last step's continued.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.law import Law
from railcosim.master.polynomials import continued, paths
from railcosim.master.schemes.drift import Drift
from railcosim.master.schemes.nodes import Nodes
from railcosim.master.schemes.variants import Variant
from railcosim.master.system import System

Slot = NDArray[np.intp]


@dataclass(frozen=True)
class _Rider:
    """A component that is taken over the step.

    Attributes
    ----------
    k : int
        Its index in the system.
    forced, forces : array of int
        Its inputs that are forces of the law, and which ones.
    fed, sources : array of int
        Its inputs that come from other components, and where they stand in the outputs.
    degree : int
        Of the polynomials of its inputs.
    jumping : array of int
        Its inputs that go along no polynomial.
    """

    k: int
    forced: Slot
    forces: Slot
    fed: Slot
    sources: Slot
    degree: int
    jumping: Slot


@dataclass(frozen=True)
class _Stop:
    """Where components without inputs are looked at on their way through a step.

    Attributes
    ----------
    begin, end : float
        Of the way there, in steps.
    sample : int
        Where in the samples it stands; 0 if nowhere.
    nodes : array of int, shape (n, 1)
        Where among the nodes.
    """

    begin: float
    end: float
    sample: int
    nodes: Slot


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

    Raises
    ------
    ValueError
        If a component cannot do what the variant asks for.
    """

    def __init__(self, system: System, law: int, variant: Variant) -> None:
        self._system, self._variant = system, variant
        component = system.components[law]
        assert isinstance(component, Law)
        others = [k for k in range(len(system.components)) if k != law]
        own, n = system.own_outputs(law), len(system.outputs)
        self._riders = [
            _rider(system, k, own, variant) for k in others if system.components[k].inputs
        ]
        self.fallbacks = tuple(
            f"{system.components[rider.k].name} takes no derivatives of its inputs: those that are "
            "no forces of the law are held at their mean, and the coupling is of order 2 at most"
            for rider in self._riders
            if len(rider.fed) and not rider.degree
        )
        self._tau = np.array([0.0, *variant.points])
        sources = system.sources(law)
        self._stops = _stops(variant)
        self._signals = []  # and which motions of the law they give
        for k in others:
            if not system.components[k].inputs:
                its = system.own_outputs(k)
                given = np.flatnonzero((sources >= its.start) & (sources < its.stop))
                self._signals.append((k, given, sources[given]))
        ridden = np.zeros(n, dtype=bool)
        for rider in self._riders:
            ridden[system.own_outputs(rider.k)] = True
        self._fed = np.flatnonzero([s < n and bool(ridden[s]) for s in sources])
        moving = np.setdiff1d(self._fed, component.rates)
        self._motions = sources[moving]
        self.nodes = Nodes.of(variant, component, self._fed)
        self._all, self._S = component.S, component.S[self.nodes.rows][:, moving]
        self._law, self._n_forces = law, len(component.outputs)
        self.drift = Drift(system, law, [rider.k for rider in self._riders], self.nodes)
        self.samples: FloatArray = np.zeros((len(self._tau), n))
        self._beginnings: dict[int, tuple[FloatArray, FloatArray]] = {}

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
        self._beginnings.clear()
        if before is None:
            self.samples = np.repeat(now[None], len(self._tau), axis=0)
        else:
            # Differences, so that what does not change stays the same to the bit.
            steps = continued((0.0, *self._variant.points), ratio) @ (before - before[-1])
            self.samples = now + steps
            self.samples[0] = now

    def look_ahead(self, t: float, h: float) -> FloatArray:
        """Step the components without inputs, which nothing that happens can change.

        Returns
        -------
        array, shape (n_nodes, n_contacts, m)
            What they add to the motions of the law at the nodes.
        """
        system, variant = self._system, self._variant
        u = np.repeat(system.gather(self._law)[None], len(variant.nodes), axis=0)
        u[:, self._fed] = 0.0
        ends = np.array([t + stop.begin * h + (stop.end - stop.begin) * h for stop in self._stops])
        for k, given, sources in self._signals:
            own = system.own_outputs(k)
            system.components[k].foresee(ends)
            for stop in self._stops:
                system.step((k,), t + stop.begin * h, (stop.end - stop.begin) * h)
                system.refresh(k)
                if stop.sample:
                    self.samples[stop.sample, own] = system.outputs[own]
                u[stop.nodes, given] = system.outputs[sources]
        motions: FloatArray = (u @ self._all.T).reshape(len(u), self.nodes.contacts, -1)
        return motions

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
        rows = [self._system.outputs[self._motions]]
        if self._variant.rates:
            rows.append(h * self._rates())
        return self._compress(rows)

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
            self._ride(rider, t, h, force)
        rows = [sample[self._motions] for sample in self.samples[1:]]
        if self._variant.rates:
            rows.append(h * self._rates())
        return self._compress(rows)

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
            moved[self._system.own_outputs(rider.k), rider.forces] = told[:, rider.forced]
        G: FloatArray = self._S @ moved[self._motions]
        return G[None, :, None, :]

    def _ride(self, rider: _Rider, t: float, h: float, force: FloatArray) -> None:
        """Take one component through its sub-steps."""
        system = self._system
        own = system.own_outputs(rider.k)
        u = system.components[rider.k].u
        u[:] = system.gather(rider.k)  # back from where the last sweep has led
        u = u.copy()
        found = paths((0.0, *self._variant.points), self._variant.degree, rider.degree)
        fed = self.samples[:, rider.sources]
        asked = self.drift.of(rider.k).any() and system.reacts(rider.k)
        moved = bool(asked and (fed != fed[0]).any())
        for j, (of_force, of_samples) in enumerate(found):
            begin, end = self._tau[j : j + 2]
            taylor = np.zeros((rider.degree + 1, len(u)))
            taylor[0] = u
            taylor[:, rider.forced] = of_force @ force[:, rider.forces]
            # Differences: what does not change has derivatives of exactly zero.
            taylor[:, rider.fed] = of_samples @ (fed - fed[0])
            taylor[0, rider.fed] += fed[0]
            taylor[0, rider.jumping], taylor[1:, rider.jumping] = u[rider.jumping], 0.0
            taylor[1:] /= h ** np.arange(1, rider.degree + 1)[:, None]
            ahead = self._ahead(rider, j, fed[j + 1]) if moved else None
            system.step_along(rider.k, t + begin * h, (end - begin) * h, taylor)
            if system.reacts(rider.k):
                system.write_inputs(rider.k)
            system.refresh(rider.k)
            self.samples[j + 1, own] = system.outputs[own]
            behind = self._met(rider, fed[j]) if moved else None
            self.drift.note(rider.k, j + 1, self.samples, ahead, behind)

    def _ahead(self, rider: _Rider, j: int, fed: FloatArray) -> FloatArray:
        """What is met before part `j` of a step where its end is; at the beginning asked once."""
        known = None if j else self._beginnings.get(rider.k)
        if known is None or (known[0] != fed).any():
            known = fed.copy(), self._met(rider, fed)
            if not j:
                self._beginnings[rider.k] = known
        return known[1]

    def _met(self, rider: _Rider, fed: FloatArray) -> FloatArray:
        """Displacements that a component shows in its present state, met elsewhere; then back."""
        system, own = self._system, self._system.own_outputs(rider.k)
        u, y = system.components[rider.k].u, system.outputs[own].copy()
        back, u[rider.fed] = u.copy(), fed
        system.write_inputs(rider.k)
        system.refresh(rider.k)
        shown = self.drift.shown(rider.k)
        u[:], system.outputs[own] = back, y
        system.write_inputs(rider.k)
        return shown

    def _rates(self) -> FloatArray:
        """Rates of the motions that the law takes from the components, now."""
        rates: FloatArray = np.zeros(len(self._system.outputs))
        for rider in self._riders:
            known = self._system.components[rider.k].output_rates()
            rates[self._system.own_outputs(rider.k)] = known
        motions: FloatArray = rates[self._motions]
        return motions

    def _compress(self, motions: Sequence[FloatArray]) -> FloatArray:
        compressions: FloatArray = np.array(motions) @ self._S.T
        return compressions


def _stops(variant: Variant) -> tuple[_Stop, ...]:
    """The nodes and points of a variant in order, each once."""
    ends = sorted({*variant.nodes.tolist(), *variant.points})
    sample = {point: 1 + i for i, point in enumerate(variant.points)}
    return tuple(
        _Stop(begin, end, sample.get(end, 0), np.flatnonzero(variant.nodes == end)[:, None])
        for begin, end in pairwise((0.0, *ends))
    )


def _rider(system: System, k: int, own: slice, variant: Variant) -> _Rider:
    """Sort the inputs of a component, and see that it can do what is asked."""
    component = system.components[k]
    sources = system.sources(k)
    is_force = (sources >= own.start) & (sources < own.stop)
    forced, fed = np.flatnonzero(is_force), np.flatnonzero(~is_force)
    fed = fed[sources[fed] < len(system.outputs)]
    able = component.max_input_derivative
    wanted = variant.degree if len(forced) else 0
    if able < wanted:
        raise ValueError(
            f"{component.name} takes {able or 'no'} derivatives of its inputs, but the variant "
            f"{variant.name} needs forces of degree {wanted}: use the variant average-hold, or an "
            "FMU with canInterpolateInputs"
        )
    if variant.rates and component.output_rates() is None:
        raise ValueError(
            f"{component.name} does not know the rates of its outputs, which the variant "
            f"{variant.name} needs: use another variant, or an FMU with maxOutputDerivativeOrder"
        )
    degree = max(wanted, min(able, len(variant.points), 2)) if len(fed) else wanted
    system.set_continuation(k, degree, at_end=True)
    return _Rider(
        k, forced, sources[forced] - own.start, fed, sources[fed], degree, component.jumping
    )
