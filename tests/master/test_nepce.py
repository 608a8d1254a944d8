"""NEPCE: order, what it preserves, memory."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Hold, Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import HoldingComponent, exact, make_system


def error(system, scheme, step, stop=1.0):
    points = list(cosimulate(system, scheme, step, stop))
    expected = exact(np.array([p.time for p in points]))
    values = np.array([p.outputs for p in points])
    return np.sqrt(np.mean(((values - expected) / np.abs(expected).max(axis=0)) ** 2))


def test_second_order_with_constant_inputs():
    """Also of components that can only hold their inputs, for which Jacobi is of first order."""
    constant_only = {"kind": HoldingComponent, "holds": {Hold.CONSTANT}}
    errors = [error(make_system(**constant_only), nepce(), h) for h in (1 / 400, 1 / 800)]
    # 0.1: the next term, of the relative size omega h = 0.03, in part.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)
    held = error(make_system(), jacobi(degree=0), 1 / 800)
    assert errors[1] < held / 30  # 1 / (omega h)
    assert nepce().start(make_system(**constant_only)).fallbacks == ()
    assert nepce().order == 2


def make_driven(signal):
    """An integrator: its state is the area under the input it was given."""
    integrator = LinearComponent("integrator", A=[[0.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]],
                                 inputs=[Variable(name="u")],
                                 outputs=[Variable(name="y")])  # fmt: skip
    source = Signal("source", [Variable(name="u")], lambda t: [signal(t)])
    return System([integrator, source], connect_by_name([integrator, source]))


@pytest.mark.parametrize("steps", [(0.1,) * 10, (0.1, 0.05, 0.2, 0.15, 0.1)])
def test_nothing_is_missed_but_by_the_last_step(steps):
    """The area under the input, by trapezia, is complete but for what the last hold missed."""

    def signal(t):
        return np.sin(3 * t)

    system = make_driven(signal)
    stepper = nepce().start(system)
    system.begin(0.0)
    times = np.cumsum([0.0, *steps])
    for t, h in zip(times, steps, strict=False):
        stepper.step(t, h)
    y = signal(times)
    area = np.sum(np.diff(times) * (y[1:] + y[:-1]) / 2)
    missed = (y[-1] - y[-2]) * steps[-1] / 2
    # To rounding.
    assert system.outputs[0] == pytest.approx(area - missed, abs=1e-14)
    last, halves = stepper.memory
    assert last * halves[0] == pytest.approx(missed, abs=1e-14)


def test_constant_input_stays_constant():
    points = list(cosimulate(make_driven(lambda t: 2.0), nepce(), 0.125, 1.0))
    assert points[-1].outputs[0] == 2.0  # powers of two: no rounding


def test_memory_is_all_that_counts():
    system, h = make_system(), 0.01
    points = cosimulate(system, nepce(), h, 1.0)
    for _ in range(4):
        next(points)
    state, memory = system.save_state(), points.stepper.memory
    results = []
    for stepper in (points.stepper, points.stepper, nepce().start(system)):
        system.restore_state(state)
        stepper.memory = memory
        for i in range(5):
            stepper.step((3 + i) * h, h)
        results.append(system.outputs.copy())
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])
    system.restore_state(state)
    points.stepper.memory = None
    for i in range(5):
        points.stepper.step((3 + i) * h, h)
    assert not np.array_equal(results[0], system.outputs)  # the memory does count
