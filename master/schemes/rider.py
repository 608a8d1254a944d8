"""One component, taken over a step by given polynomials of a law's forces."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.polynomials import paths
from railcosim.master.schemes.variants import Variant
from railcosim.master.system import System

Slot = NDArray[np.intp]


class Rider:
    """A component that is taken over a step, through all its parts.

    Its inputs are forces of the law, polynomials by their Legendre coefficients; what comes from
    other components, the polynomial through samples of that; and what goes along no polynomial, or
    comes from nobody: that stays as it is. Arrays that a step needs are made once.

    Parameters
    ----------
    system : System
        Whose component.
    k : int
        Its index.
    law : slice
        The outputs of the law.
    variant : Variant
        Where to stop.

    Attributes
    ----------
    k : int
        As given.
    own : slice
        Its outputs among all.
    forced, forces : array of int
        Its inputs that are forces of the law, and which ones.
    fed : array of int
        Its inputs that come from other components.
    degree : int
        Of the polynomials of its inputs.

    Raises
    ------
    ValueError
        If it cannot do what the variant asks for.
    """

    def __init__(self, system: System, k: int, law: slice, variant: Variant) -> None:
        self.k, self.own = k, system.own_outputs(k)
        self._system, self._component = system, system.components[k]
        sources = system.sources(k)
        is_force = (sources >= law.start) & (sources < law.stop)
        self.forced, fed = np.flatnonzero(is_force), np.flatnonzero(~is_force)
        self.fed: Slot = fed[sources[fed] < len(system.outputs)]
        self.forces: Slot = sources[self.forced] - law.start
        self._sources: Slot = sources[self.fed]
        self._jumping = self._component.jumping
        wanted = variant.degree if self.forced.size else 0
        self._check(variant, wanted)
        able = min(self._component.max_input_derivative, len(variant.points), 2)
        self.degree = max(wanted, able) if self.fed.size else wanted
        system.set_continuation(k, self.degree, at_end=True)
        self._reacts = system.reacts(k)
        tau = (0.0, *variant.points)
        self._parts = list(pairwise(tau))
        self._paths = paths(tau, variant.degree, self.degree)
        self._orders = np.arange(self.degree + 1)[:, None]
        self._taylor: FloatArray = np.zeros((self.degree + 1, len(sources)))
        self._taylor[0] = system.gather(k)  # which stays of those that nobody feeds
        self._shown = False
        self._beginning: tuple[FloatArray, FloatArray] | None = None

    def _check(self, variant: Variant, wanted: int) -> None:
        """See that the component can do what is asked."""
        component = self._component
        able = component.max_input_derivative
        if able < wanted:
            raise ValueError(
                f"{component.name} takes {able or 'no'} derivatives of its inputs, but the variant "
                f"{variant.name} needs forces of degree {wanted}: use the variant average-hold, or "
                "an FMU with canInterpolateInputs"
            )
        if variant.rates and component.output_rates() is None:
            raise ValueError(
                f"{component.name} does not know the rates of its outputs, which the variant "
                f"{variant.name} needs: use another variant, or an FMU with "
                "maxOutputDerivativeOrder"
            )

    def show(self) -> None:
        """Be told that it is asked what it shows elsewhere: it moves along what it is fed."""
        self._shown = self._reacts

    def begin(self) -> None:
        """Begin a step, which may be made more than once."""
        self._beginning = None

    def ride(
        self, t: float, h: float, force: FloatArray, samples: FloatArray, carried: FloatArray
    ) -> None:
        """Take the component from `t` to `t + h` (s).

        Parameters
        ----------
        t, h : float
            s.
        force : array, shape (degree + 1, n_forces)
            Legendre coefficients of the law's forces, N.
        samples : array, shape (n_points + 1, n_outputs)
            All outputs, at the beginning and at the points; its own are written.
        carried : array, shape (n_points + 1, n_outputs)
            See `Drift`; its own are written.
        """
        system, k, own = self._system, self.k, self.own
        fed = samples.take(self._sources, axis=1)
        changes = fed - fed[0]  # so what does not change has derivatives of exactly zero
        moves = self._shown and bool(changes.any())
        if self._shown:
            carried[:, own] = 0.0
        held = system.gather(k)[self._jumping] if self._jumping.size else None
        for j, (begin, end) in enumerate(self._parts):
            ahead = self._ahead(j, fed[j + 1]) if moves else None
            taylor = self._path(j, h, force, fed[0], changes)
            if held is not None:
                taylor[0, self._jumping], taylor[1:, self._jumping] = held, 0.0
            system.step_along(k, t + begin * h, (end - begin) * h, taylor)
            if self._reacts:
                system.write_inputs(k)
            system.refresh(k)
            last, now = samples[j : j + 2, own]
            now[...] = system.outputs[own]
            if ahead is not None:
                more = (ahead - last + now - self._met(fed[j])) / 2
                carried[j + 1, own] = carried[j, own] + more
                system.outputs[own] = now

    def _path(
        self, j: int, h: float, force: FloatArray, fed: FloatArray, changes: FloatArray
    ) -> FloatArray:
        """Value and derivatives of the inputs where a part of a step begins."""
        taylor, (of_force, of_samples) = self._taylor, self._paths[j]
        taylor[:, self.forced] = of_force @ force.take(self.forces, axis=1)
        if self.fed.size:
            taylor[:, self.fed] = of_samples @ changes
            taylor[0, self.fed] += fed
        if self.degree:
            taylor /= h**self._orders
        return taylor

    def _ahead(self, j: int, fed: FloatArray) -> FloatArray:
        """What is met before part `j` of a step where its end is; at the beginning asked once."""
        known = None if j else self._beginning
        if known is None or (known[0] != fed).any():
            known = fed.copy(), self._met(fed)
            if not j:
                self._beginning = known
        return known[1]

    def _met(self, fed: FloatArray) -> FloatArray:
        """What is shown in the present state, met elsewhere.

        Then inputs and outputs are those of there, until the next step or exchange.
        """
        component = self._component
        component.u[self.fed] = fed
        component.write_inputs()
        component.read_outputs()
        return component.y.copy()
