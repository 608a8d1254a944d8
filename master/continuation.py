"""How the inputs of a component continue over a communication step, by what the component can.

A scheme asks for a polynomial of some degree. It is told to the component by derivatives where it
takes them; else it is left to the component's own hold (degree 1); else the inputs are held.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from railcosim.master.component import Component, FloatArray, Hold
from railcosim.master.names import INPUTS

History = tuple[tuple[float, FloatArray], ...]
"""Time (s) and inputs at past communication points, latest last."""

NAMES = INPUTS
"""Of polynomials, by degree."""


class Continuation(Protocol):
    """Steps one component, with its inputs going on in one way.

    Attributes
    ----------
    degree : int
        Of the polynomial.
    past : History
        As many points as the next step needs; arrays in it are never written to.
    """

    degree: int
    past: History

    def describe(self) -> str:
        """For people and for results."""

    def begin(self, t: float) -> None:
        """Forget the past; the inputs at `t` are written."""

    def extrapolate(self, t: float, h: float) -> None:
        """Step from `t` to `t + h` (s); the inputs at `t` are written, and stay in `u`."""

    def go_on(self, h: float) -> None:
        """Leave in `u`, unwritten, what the polynomial gives at the end of a step extrapolated."""

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Likewise, to the inputs `u` at the end."""

    def path(self, t: float) -> FloatArray:
        """Value and derivatives at `t` of the inputs over the step just made from there."""


class Held:
    """Inputs constant over the step."""

    degree = 0

    def __init__(self, component: Component) -> None:
        self.past: History = ()
        self._component = component
        self.extrapolate = component.do_step  # the inputs at the beginning are held
        """See `Continuation`."""

    def describe(self) -> str:
        """For people and for results."""
        return NAMES[0]

    def begin(self, t: float) -> None:
        """There is no past; see `Continuation`."""

    def go_on(self, h: float) -> None:
        """Do nothing: they are held; see `Continuation`."""

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Hold the inputs at the end; see `Continuation`."""
        self._component.u[:] = u
        self._component.write_inputs()
        self._component.do_step(t, h)

    def path(self, t: float) -> FloatArray:
        """Give what the inputs still are; see `Continuation`."""
        return self._component.u[None].copy()


class _Polynomial:
    """Remembers the inputs of past communication points.

    All that a step needs is in arrays that are made once and written over, also the numbers by
    which others are divided: most of what a master costs would else be the making of small arrays.
    Whole ones are copied by ``[...]``, which takes half the time of ``[:]``.
    """

    def __init__(self, component: Component, degree: int) -> None:
        self.degree = degree
        self._component = component
        n, self._jumping = component.u.size, component.jumping
        self._jumps = bool(self._jumping.size)
        self._times: list[float] = []  # the latest first, as the points
        self._points: list[FloatArray] = [np.empty(n) for _ in range(degree + 1)]
        self._derivatives: FloatArray = np.zeros((degree, n))
        self._known = tuple(self._derivatives[:order] for order in range(degree + 1))
        self._first = self._derivatives[0]
        self._work: FloatArray = np.empty(n)
        self._span: FloatArray = np.empty(())
        self._beginning = 0
        """Which of the points is the beginning of the step last made."""

    @property
    def past(self) -> History:
        """Copies; see `Continuation`."""
        points = zip(self._times, self._points, strict=False)
        return tuple((t, u.copy()) for t, u in points)[::-1]

    @past.setter
    def past(self, past: History) -> None:
        latest_first = past[: -self.degree - 2 : -1]
        self._times = [t for t, _ in latest_first]
        for kept, (_, u) in zip(self._points, latest_first, strict=False):
            kept[:] = u

    def begin(self, t: float) -> None:
        """Begin the past; see `Continuation`."""
        self._times.clear()
        self._note(t, self._component.u)

    def go_on(self, h: float) -> None:
        """Follow the polynomial through the past; see `Continuation`."""
        _go_on(self._component.u, self._known[len(self._times) - 1], h)

    def path(self, t: float) -> FloatArray:
        """Give the polynomial through the past, which ends with the step; see `Continuation`."""
        return np.stack([self._points[self._beginning], *self._known[len(self._times) - 1]])

    def _note(self, t: float, u: FloatArray) -> None:
        """Remember the inputs at `t`."""
        times, points = self._times, self._points
        if not times or times[0] != t:
            times.insert(0, t)
            del times[self.degree + 1 :]
            points.insert(0, points.pop())
        points[0][...] = u

    def _fit(self, t: float) -> FloatArray:
        """Derivatives at `t` of the polynomial through the past, shape (degree, n_inputs).

        Of a lower degree in the first steps. What does not change has derivatives of exactly zero.
        """
        times, order = self._times, len(self._times) - 1
        if order:
            points, first, span = self._points, self._first, self._span
            np.subtract(points[0], points[1], first)
            span[()] = times[0] - times[1]
            np.divide(first, span, first)
            if order > 1:
                self._bend(t)
            if self._jumps:
                self._derivatives[:, self._jumping] = 0.0
        return self._known[order]

    def _bend(self, t: float) -> None:
        """Make the line that has been fitted a parabola, by Newton's divided differences."""
        (t0, t1, t2), (_, u1, u2) = self._times, self._points
        (first, second), work = self._derivatives, self._work
        np.subtract(u1, u2, work)
        np.divide(work, t1 - t2, work)
        np.subtract(first, work, second)
        np.divide(second, t0 - t2, second)
        np.multiply(second, 2 * t - t0 - t1, work)
        np.add(first, work, first)
        np.multiply(second, 2, second)


class OwnHold(_Polynomial):
    """A line that the component draws itself, through the inputs it is given."""

    def __init__(self, component: Component) -> None:
        super().__init__(component, 1)

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[1]}, by its own hold"

    def extrapolate(self, t: float, h: float) -> None:
        """Let the component extrapolate; see `Continuation`."""
        component, self._beginning = self._component, 0
        self._note(t, component.u)
        component.do_step(t, h)
        self._fit(t)

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Let the component interpolate; see `Continuation`."""
        component, self._beginning = self._component, 1
        component.u[:] = u
        component.write_inputs()
        component.do_step(t, h)
        self._note(t + h, u)
        self._fit(t)


class Derivatives(_Polynomial):
    """A polynomial given by its derivatives; of a lower degree in the first steps."""

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[self.degree]}, by derivatives"

    def extrapolate(self, t: float, h: float) -> None:
        """Follow the polynomial through the past; see `Continuation`."""
        component, self._beginning = self._component, 0
        self._note(t, component.u)
        derivatives = self._fit(t)
        if len(derivatives):
            component.set_input_derivatives(derivatives)
        component.do_step(t, h)

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Follow the polynomial through the past and the end; see `Continuation`."""
        component, self._beginning = self._component, 1
        component.u[...] = self._points[0]
        if self._jumps:
            component.u[self._jumping] = u[self._jumping]
        component.write_inputs()
        self._note(t + h, u)
        derivatives = self._fit(t)
        if len(derivatives):
            component.set_input_derivatives(derivatives)
        component.do_step(t, h)
        component.u[...] = u  # without the rounding of the polynomial


def continuation(component: Component, degree: int, *, at_end: bool) -> Continuation:
    """Find the best way to what a scheme asks for, and prepare the component for it.

    Parameters
    ----------
    component : Component
        Whose inputs are to continue.
    degree : int
        Of the polynomial asked for.
    at_end : bool
        Whether the inputs at the end of a step are known: interpolation, else extrapolation.

    Returns
    -------
    Continuation
        Of a lower degree than asked for, if the component cannot.
    """
    if component.max_input_derivative >= 1 and degree >= 1:
        component.set_hold(Hold.CONSTANT)
        return Derivatives(component, min(degree, component.max_input_derivative))
    hold = Hold.INTERPOLATE if at_end else Hold.EXTRAPOLATE
    if degree >= 1 and hold in component.holds:
        component.set_hold(hold)
        return OwnHold(component)
    component.set_hold(Hold.CONSTANT)
    return Held(component)


def follow(component: Component, derivatives: FloatArray, t: float, h: float) -> None:
    """Step a component along a polynomial whose value at `t` is in its `u`, and written.

    Parameters
    ----------
    component : Component
        To step from `t` to `t + h` (s).
    derivatives : array, shape (degree, n_inputs)
        Of the inputs at `t`.
    t, h : float
        Beginning and length of the step, s.
    """
    if len(derivatives):
        component.set_input_derivatives(derivatives)
    component.do_step(t, h)
    _go_on(component.u, derivatives, h)


def _go_on(u: FloatArray, derivatives: FloatArray, h: float) -> None:
    """Make the value of a polynomial that after `h` (s), in place."""
    order = len(derivatives)
    if not order:
        return
    change = derivatives[-1] * (h / order)
    for k in range(order - 1, 0, -1):
        change += derivatives[k - 1]
        change *= h / k
    u += change
