"""A component seen through other units is stepped as the component itself."""

from __future__ import annotations

import numpy as np

from railcosim.master.component import Hold, Variable
from railcosim.master.linear_component import LinearComponent
from railcosim.master.mapped_inputs import MappedInputs
from railcosim.master.units import IDENTITY, Linear

# Powers of two: products and sums are exact, and so are the comparisons.
MAPS = (Linear(0.5, 2.0), IDENTITY, Linear(-4.0, -1.0))
FACTOR, OFFSET = np.array([0.5, 1.0, -4.0]), np.array([2.0, 0.0, -1.0])


def make():
    return LinearComponent(
        "plant",
        A=[[-1.0, 2.0], [-2.0, -0.5]],
        B=[[1.0, 0.0, 3.0], [0.5, -1.0, 0.0]],
        C=[[1.0, 1.0]],
        D=[[0.0, 2.0, 0.0]],
        inputs=[Variable(name=name, unit="m") for name in "abc"],
        outputs=[Variable(name="y")],
        x0=[1.0, -1.0],
    )


def make_both():
    inner = make()
    seen = [Variable(name=name, unit="mm", start=8.0) for name in "abc"]
    return make(), MappedInputs(inner, seen, MAPS)


def test_interface():
    plain, mapped = make_both()
    assert [(v.name, v.unit) for v in mapped.inputs] == [("a", "mm"), ("b", "mm"), ("c", "mm")]
    assert mapped.outputs == plain.outputs
    np.testing.assert_array_equal(mapped.u, 8.0)
    np.testing.assert_array_equal(mapped.feedthrough, plain.feedthrough)
    assert mapped.max_input_derivative == plain.max_input_derivative == 2
    assert mapped.can_rollback
    mapped.set_hold(Hold.CONSTANT)


def go(component, factor, offset, seed):
    """Outputs over some steps along polynomials that are random to the master."""
    rng = np.random.default_rng(seed)
    found = []
    for k in range(4):
        u, derivatives = rng.integers(-8, 8, size=3) / 4, rng.integers(-8, 8, size=(2, 3)) / 4
        component.set_inputs(factor * u + offset)
        found.append(component.get_outputs())
        component.set_input_derivatives(factor * derivatives)
        component.do_step(0.25 * k, 0.25)
        found.append(component.get_outputs())
    return np.array(found)


def test_polynomials_pass_through():
    plain, mapped = make_both()
    u, y = np.zeros(3), np.zeros(1)
    mapped.bind(u, y)  # as a system does
    np.testing.assert_array_equal(go(mapped, 1.0, 0.0, 1), go(plain, FACTOR, OFFSET, 1))
    assert y.any()


def test_step_derivative_is_of_what_is_seen():
    plain, mapped = make_both()
    for component in (plain, mapped):
        component.do_step(0.0, 0.25)
    of_plain = plain.step_derivative()
    assert of_plain is not None
    np.testing.assert_array_equal(mapped.step_derivative(), of_plain * FACTOR)


def test_rollback():
    _, mapped = make_both()
    go(mapped, 1.0, 0.0, 1)
    state = mapped.save_state()
    first = go(mapped, 1.0, 0.0, 2)
    mapped.restore_state(state)
    np.testing.assert_array_equal(go(mapped, 1.0, 0.0, 2), first)
    assert (go(mapped, 1.0, 0.0, 2) != first).any()
