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
        Of the polynomial; so many points of the past are needed before the present one.
    """

    degree: int

    def describe(self) -> str:
        """For people and for results."""

    def extrapolate(self, component: Component, past: History, t: float, h: float) -> None:
        """Step from `t` to `t + h` (s); ``past[-1]`` are the inputs at `t`, already written.

        Leaves in ``component.u``, unwritten, the inputs that the polynomial gives at the end.
        """

    def interpolate(
        self, component: Component, past: History, t: float, h: float, u: FloatArray
    ) -> None:
        """Likewise, to the inputs `u` at the end."""


class Held:
    """Inputs constant over the step."""

    degree = 0

    def describe(self) -> str:
        """For people and for results."""
        return NAMES[0]

    def extrapolate(self, component: Component, past: History, t: float, h: float) -> None:
        """Hold the inputs at the beginning; see `Continuation`."""
        component.do_step(t, h)

    def interpolate(
        self, component: Component, past: History, t: float, h: float, u: FloatArray
    ) -> None:
        """Hold the inputs at the end; see `Continuation`."""
        component.u[:] = u
        component.write_inputs()
        component.do_step(t, h)


class OwnHold:
    """A line that the component draws itself, through the inputs it is given."""

    degree = 1

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[1]}, by its own hold"

    def extrapolate(self, component: Component, past: History, t: float, h: float) -> None:
        """Let the component extrapolate; see `Continuation`."""
        component.do_step(t, h)
        component.u[:] = _taylor(past, t, 1)[0] if len(past) < 2 else _end(_taylor(past, t, 1), h)

    def interpolate(
        self, component: Component, past: History, t: float, h: float, u: FloatArray
    ) -> None:
        """Let the component interpolate; see `Continuation`."""
        component.u[:] = u
        component.write_inputs()
        component.do_step(t, h)


class Derivatives:
    """A polynomial given by its derivatives.

    Parameters
    ----------
    degree : int
        Of the polynomial; lower in the first steps, for want of a past.
    """

    def __init__(self, degree: int) -> None:
        self.degree = degree

    def describe(self) -> str:
        """For people and for results."""
        return f"{NAMES[self.degree]}, by derivatives"

    def extrapolate(self, component: Component, past: History, t: float, h: float) -> None:
        """Follow the polynomial through the past; see `Continuation`."""
        follow(component, _taylor(past, t, self.degree), t, h)

    def interpolate(
        self, component: Component, past: History, t: float, h: float, u: FloatArray
    ) -> None:
        """Follow the polynomial through the past and the end; see `Continuation`."""
        component.u[:] = past[-1][1]
        component.write_inputs()
        follow(component, _taylor((*past, (t + h, u)), t, self.degree), t, h)
        component.u[:] = u  # without the rounding of the polynomial


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
        return Derivatives(min(degree, component.max_input_derivative))
    hold = Hold.INTERPOLATE if at_end else Hold.EXTRAPOLATE
    if degree >= 1 and hold in component.holds:
        component.set_hold(hold)
        return OwnHold()
    component.set_hold(Hold.CONSTANT)
    return Held()


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
    value = taylor[-1]
    for k in range(len(taylor) - 2, -1, -1):
        value = taylor[k] + value * (h / (k + 1))
    return value
