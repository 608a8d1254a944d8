"""How the inputs of a component continue over a communication step, by what the component can.

A scheme asks for a polynomial of some degree. It is told to the component by derivatives where it
takes them; else it is left to the component's own hold (degree 1); else the inputs are held.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from railcosim.master.component import Component, FloatArray, Hold

History = tuple[tuple[float, FloatArray], ...]
"""Time (s) and inputs at past communication points, latest last."""

NAMES = ("constant", "linear", "quadratic")
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
        """Step from `t` to `t + h` (s); the inputs at `t` are written.

        Leaves in the component's `u`, unwritten, the inputs that the polynomial gives at the end.
        """

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

    def describe(self) -> str:
        """For people and for results."""
        return NAMES[0]

    def begin(self, t: float) -> None:
        """There is no past; see `Continuation`."""

    def extrapolate(self, t: float, h: float) -> None:
        """Hold the inputs at the beginning; see `Continuation`."""
        self._component.do_step(t, h)

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Hold the inputs at the end; see `Continuation`."""
        self._component.u[:] = u
        self._component.write_inputs()
        self._component.do_step(t, h)

    def path(self, t: float) -> FloatArray:
        """Give what the inputs still are; see `Continuation`."""
        return self._component.u[None].copy()


class _Polynomial:
    """Remembers the inputs of past communication points."""

    def __init__(self, component: Component, degree: int) -> None:
        self.degree = degree
        self.past: History = ()
        self._component = component

    def begin(self, t: float) -> None:
        """Begin the past; see `Continuation`."""
        self.past = ()
        self._note(t, self._component.u)

    def path(self, t: float) -> FloatArray:
        """Give the polynomial through the past, which ends with the step; see `Continuation`."""
        return _taylor(self.past, t, self.degree)

    def _note(self, t: float, u: FloatArray) -> None:
        """Remember the inputs at `t`."""
        past = self.past[:-1] if self.past and self.past[-1][0] == t else self.past
        self.past = (*past[-self.degree :], (t, u.copy()))


class OwnHold(_Polynomial):
    """A line that the component draws itself, through the inputs it is given."""

    def __init__(self, component: Component) -> None:
        super().__init__(component, 1)

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[1]}, by its own hold"

    def extrapolate(self, t: float, h: float) -> None:
        """Let the component extrapolate; see `Continuation`."""
        self._note(t, self._component.u)
        self._component.do_step(t, h)
        self._component.u[:] = _end(_taylor(self.past, t, 1), h)

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Let the component interpolate; see `Continuation`."""
        self._component.u[:] = u
        self._component.write_inputs()
        self._component.do_step(t, h)
        self._note(t + h, u)


class Derivatives(_Polynomial):
    """A polynomial given by its derivatives; of a lower degree in the first steps."""

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[self.degree]}, by derivatives"

    def extrapolate(self, t: float, h: float) -> None:
        """Follow the polynomial through the past; see `Continuation`."""
        self._note(t, self._component.u)
        follow(self._component, _taylor(self.past, t, self.degree), t, h)

    def interpolate(self, t: float, h: float, u: FloatArray) -> None:
        """Follow the polynomial through the past and the end; see `Continuation`."""
        component = self._component
        component.u[:] = self.past[-1][1]
        component.write_inputs()
        follow(component, _taylor((*self.past, (t + h, u)), t, self.degree), t, h)
        component.u[:] = u  # without the rounding of the polynomial
        self._note(t + h, u)


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


def follow(component: Component, taylor: FloatArray, t: float, h: float) -> None:
    """Step a component along a polynomial whose value at `t` is already written.

    Parameters
    ----------
    component : Component
        To step from `t` to `t + h` (s).
    taylor : array, shape (degree + 1, n_inputs)
        Value and derivatives of the inputs at `t`.
    t, h : float
        Beginning and length of the step, s.
    """
    if len(taylor) > 1:
        component.set_input_derivatives(taylor[1:])
    component.do_step(t, h)
    component.u[:] = _end(taylor, h)


def _taylor(points: History, t: float, degree: int) -> FloatArray:
    """Value and derivatives at `t` of the polynomial through the last points."""
    points = points[-degree - 1 :]
    (t0, u0), *earlier = points[::-1]
    if not earlier:
        return u0[None]
    (t1, u1), *earliest = earlier
    first = (u0 - u1) / (t0 - t1)
    if not earliest:
        return np.stack([u0 + first * (t - t0), first])
    t2, u2 = earliest[0]
    second = (first - (u1 - u2) / (t1 - t2)) / (t0 - t2)  # Newton's divided differences
    value = u0 + first * (t - t0) + second * (t - t0) * (t - t1)
    return np.stack([value, first + second * (2 * t - t0 - t1), 2 * second])


def _end(taylor: FloatArray, h: float) -> FloatArray:
    """Value of the polynomial after `h` (s)."""
    value: FloatArray = taylor[-1]
    for k in range(len(taylor) - 2, -1, -1):
        value = taylor[k] + value * (h / (k + 1))
    return value
