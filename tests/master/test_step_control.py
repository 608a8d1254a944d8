"""Step-size control: the accuracy delivered, jumps, failure, resuming."""

from __future__ import annotations

import math
from dataclasses import astuple
from itertools import pairwise

import numpy as np
import pytest

from railcosim.master.bonds import find_bonds
from railcosim.master.component import Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.energy import EnergyMeter
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes import ConvergenceError
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.iteration import Until
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.step_control import StepControl, StepTooSmall
from railcosim.master.system import System

from .oscillator import exact, make_left, make_right, make_system


def control(scheme, tolerance, **settings):
    settings = {"largest": 0.5, "smallest": 1e-7, **settings}
    return StepControl(order=scheme.order, relative=tolerance, absolute=tolerance, **settings)


def run(system, scheme, pace, stop=1.0):
    points = list(cosimulate(system, scheme, pace, stop))
    return np.array([p.time for p in points]), np.array([p.outputs for p in points]), points


def worst(system, scheme, tolerance, reference, **settings):
    """Largest error in tolerances."""
    times, values, _ = run(system, scheme, control(scheme, tolerance, **settings))
    expected = reference(times)
    return (np.abs(values - expected) / (tolerance * (1.0 + np.abs(expected)))).max()


@pytest.mark.parametrize(
    ("scheme", "tolerances"),
    [
        (jacobi(degree=0), (1e-2, 1e-3)),
        (jacobi(degree=1), (1e-2, 1e-3, 1e-4, 1e-5)),
        (jacobi(degree=2), (1e-3, 1e-4, 1e-5, 1e-6)),
        (gauss_seidel(first="left"), (1e-2, 1e-3, 1e-4, 1e-5)),
        (iqn_ils(degree=1), (1e-2, 1e-3, 1e-4)),
        (iqn_ils(degree=2), (1e-3, 1e-4, 1e-5, 1e-6)),
    ],
    ids=str,
)
@pytest.mark.slow  # many adaptive runs
def test_accuracy_is_what_is_asked_for(scheme, tolerances):
    """The error follows the tolerance over decades, and is about as large."""
    errors = [worst(make_system(), scheme, tolerance, exact) for tolerance in tolerances]
    # The run is 11 of the faster mode's time constants long; 2: errors of both halves, and those of
    # polynomials through halves, which the estimate takes for shorter than they are.
    assert max(errors) < 2 * 11
    # Proportional: within a factor of 3 where the tolerance changes by 10 to 1000.
    assert max(errors) < 3 * min(errors)


def test_nepce_delivers_more_than_asked():
    """What the last step missed is made up for by the next; the estimate takes it for an error."""
    assert worst(make_system(), nepce(), 1e-3, exact) < 1.0


def test_steps_follow_the_tolerance():
    """As its root of the order, and so does the cost."""
    scheme = jacobi(degree=1)
    counts = [len(run(make_system(), scheme, control(scheme, tol))[0]) for tol in (1e-3, 1e-5)]
    # 10 for two decades at order 2; 20 %: the start, and the ladder of steps.
    assert counts[1] / counts[0] == pytest.approx(10, rel=0.2)


@pytest.mark.parametrize("degree", [0, 1])
def test_estimate_is_the_error(degree):
    """Of the first step, which begins exactly: the largest error."""
    scheme, tolerance = iqn_ils(degree=degree), 1e-3
    times, values, points = run(make_system(), scheme, control(scheme, tolerance), 0.02)
    true = np.abs(values - exact(times))[1]
    allowed = tolerance * (1.0 + np.abs(values[1])) * tolerance ** (1 / scheme.order)
    # What is left is the next term of the error's expansion, of omega h: steps are 0.2 and 7 ms.
    assert points[1].report.error == pytest.approx((true / allowed).max(), rel=0.01)


def make_kicked(jump):
    """x' = -x + u, u = 0 and then 1."""
    lag = LinearComponent("lag", A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]],
                          inputs=[Variable(name="u")], outputs=[Variable(name="y")])  # fmt: skip
    kick = Signal("kick", [Variable(name="u")], lambda t: [float(t >= jump)])
    return System([lag, kick], connect_by_name([lag, kick]))


@pytest.mark.parametrize("scheme", [gauss_seidel(first="lag"), picard()], ids=str)
@pytest.mark.parametrize("jump", [0.3333, 0.55, 0.71])
def test_jump(scheme, jump):
    """Long steps, short ones across the jump, and long ones again; no less accurate for it."""

    def reference(times):
        after = np.maximum(times - jump, 0.0)
        return np.column_stack([1.0 - np.exp(-after), (times >= jump).astype(float)])

    errors = []
    for tolerance in (1e-2, 1e-4):
        pace = control(scheme, tolerance)
        times, values, points = run(make_kicked(jump), scheme, pace, 2.0)
        errors.append(np.abs(values - reference(times)).max() / tolerance)
        steps = np.diff(times)
        across = steps[np.searchsorted(times, jump) - 1]
        # A step that misses half of the jump's first half: an error of about a quarter of it.
        assert across < 10 * tolerance
        assert steps[:2].max() > 10 * across
        assert sum(p.report.rejections for p in points[1:]) > 0
    # The jump is one step's error, the rest two time constants'.
    assert max(errors) < 3


def test_too_small_a_step_is_an_error_that_helps():
    scheme = gauss_seidel(first="lag")
    pace = control(scheme, 1e-6, smallest=1e-3)
    points = []
    with pytest.raises(StepTooSmall) as caught:
        points.extend(cosimulate(make_kicked(0.55), scheme, pace, 2.0))
    for part in ("0.001 s, the smallest", "lag.y", "t = 0.5", "times what is allowed", "jumps",
                 "interface-jacobian", "Gauss-Seidel, lag first"):  # fmt: skip
        assert part in str(caught.value)


def test_step_stays_within_its_limits():
    scheme = jacobi(degree=1)
    times, _, points = run(make_system(), scheme, control(scheme, 0.1, largest=0.03), 0.5)
    assert np.diff(times).max() <= 0.03 * (1 + 1e-14)
    assert times[-1] == 0.5
    # Always three evaluations a trial.
    for point in points[1:]:
        assert point.report.evaluations == 3 * (1 + point.report.rejections)
        assert point.report.error <= 1.0


def test_steps_are_of_a_ladder():
    """Few lengths, so that those who keep matrices for them profit; all full but the last."""
    scheme = jacobi(degree=1)
    steps = []

    class Watched(Signal):
        def do_step(self, t, h):
            steps.append(h)
            super().do_step(t, h)

    watched = Watched("watched", [Variable(name="clock")], lambda t: [t])
    components = [make_left(), make_right(), watched]
    system = System(components, connect_by_name(components))
    times, _, _ = run(system, scheme, control(scheme, 1e-3), 1.0)
    last = times[-1] - times[-2]
    rungs = np.array([4 * math.log2(0.5 / h) for h in steps if h not in {last, last / 2}])
    np.testing.assert_allclose(rungs, np.round(rungs), atol=1e-9)  # rounding
    assert len(set(steps)) < len(times) / 4


def test_no_convergence_shortens_the_step():
    """A long step that an iteration cannot manage is tried shorter; the shortest is an error."""
    scheme = picard(until=Until(max_evaluations=12))
    with pytest.raises(ConvergenceError):
        run(make_system(), scheme, 0.25)
    _, _, points = run(make_system(), scheme, control(scheme, 0.5))
    assert points[1].report.rejections > 0
    with pytest.raises(ConvergenceError):
        run(make_system(), scheme, control(scheme, 0.5, smallest=0.25))


@pytest.mark.parametrize(
    "scheme", [jacobi(), gauss_seidel(first="left", degree=2), nepce(), aitken(), iqn_ils(reuse=2)],
    ids=str,
)  # fmt: skip
def test_memory_is_all_that_counts(scheme):
    """A new walk and stepper with the memories of others go on with the same bits."""
    pace = control(scheme, 1e-2)
    system = make_system()
    points = cosimulate(system, scheme, pace, 1.0)
    for _ in range(8):
        next(points)
    state, time = system.save_state(), points.time
    memories = points.stepper.memory, points.walk.memory
    rest = list(points)
    system.restore_state(state)
    stepper = scheme.start(system)
    walk = pace.walk(system, stepper, 0.0, 1.0)
    system.restore_state(state)  # a scheme that starts may begin a new past
    stepper.memory, walk.memory = memories
    for point in rest:
        time, report = walk.advance(time)
        assert time == point.time
        np.testing.assert_array_equal(astuple(report), astuple(point.report))
        np.testing.assert_array_equal(system.outputs, point.outputs)


def test_energy_is_measured_over_halves():
    """Rejected trials leave nothing behind: the pieces of inputs between two points just fit."""
    scheme = jacobi(degree=0)
    system = make_system()
    meter = EnergyMeter(system, find_bonds(system))
    points = meter.watch(cosimulate(system, scheme, control(scheme, 1e-2), 0.5))
    before = next(points)
    for point in points:
        for paths in meter._paths:
            assert [p.t for p in paths] == pytest.approx(
                [before.time, (before.time + point.time) / 2], abs=1e-15
            )
            for a, b in pairwise(paths):
                assert a.t + a.h == pytest.approx(b.t, abs=1e-15)
        before = point


class NoWayBack(LinearComponent):
    can_rollback = False


def test_refuses_those_who_cannot_go_back():
    components = [make_left(NoWayBack), make_right()]
    system = System(components, connect_by_name(components))
    with pytest.raises(ValueError, match="left cannot go back"):
        cosimulate(system, jacobi(), control(jacobi(), 1e-3), 1.0)


@pytest.mark.parametrize(
    "settings",
    [{"order": 0}, {"relative": -1.0}, {"absolute": math.nan}, {"relative": 0.0, "absolute": 0.0},
     {"smallest": 0.0}, {"smallest": 2.0}, {"largest": math.inf}],
)  # fmt: skip
def test_settings_are_checked(settings):
    with pytest.raises(ValueError, match=r"must be|both 0"):
        StepControl(**{"order": 2, "largest": 1.0, "smallest": 1e-6, **settings})


def test_description():
    pace = StepControl(order=2, largest=1e-3, smallest=1e-7)
    assert pace.describe() == "steps of 1e-07 to 0.001 s for relative 0.0001, absolute 0.0001"
