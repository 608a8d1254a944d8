"""The loop: times, checks, failures."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from railcosim.master.component import ComponentError, Hold, Variable
from railcosim.master.cosimulation import Divergence, FallbackWarning, cosimulate
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import HoldingComponent, make_system


def signal_system(function, **variable):
    return System([Signal("s", [Variable(name="y", **variable)], lambda t: [function(t)])], [])


def times(step, stop, start=0.0):
    system = signal_system(lambda t: t)
    return [p.time for p in cosimulate(system, jacobi(), step, stop, start)]


def test_times_do_not_accumulate_error():
    assert times(0.1, 1.0) == [*(i * 0.1 for i in range(10)), 1.0]
    assert times(1e-4, 1.0)[-1] == 1.0
    assert len(times(1e-4, 1.0)) == 10_001


def test_last_step_is_shortened():
    assert times(0.4, 3.0, start=2.0) == [2.0, 2.4, 2.8, 3.0]
    assert times(5.0, 1.0) == [0.0, 1.0]


def test_remainder_of_rounding_is_no_step():
    assert len(times(0.1, 0.3)) == 4  # 0.3 / 0.1 is 2.9999999999999996
    assert len(times(1e-3, 1.1)) == 1101  # 1.1 / 1e-3 is 1100.0000000000002


@pytest.mark.parametrize("stop", [0.9, 100.0, 100.05])  # less than is foreseen at once, and more
def test_a_signal_is_asked_for_many_times_at_once(stop):
    """Foreseen to the bit: it is asked by itself for the start only, and gives the same bits."""
    asked = []

    def wave(t):
        asked.append(np.ndim(t))
        return np.sin(t)[..., None]

    results = []
    for vectorised in (False, True):
        asked.clear()
        signal = Signal("s", [Variable(name="y")], wave, vectorised=vectorised)
        run = cosimulate(System([signal], []), jacobi(), 0.07, stop, start=0.1)
        results.append([(p.time, *p.outputs) for p in run])
        assert sum(ndim == 0 for ndim in asked) == (2 if vectorised else len(results[0]) + 1)
    assert results[0] == results[1]


@pytest.mark.parametrize("vectorised", [False, True])
def test_a_signal_is_taken_through_many_times_at_once(vectorised):
    """To the values of one after the other, and is then at the last."""
    signal = Signal(
        "s", [Variable(name="y")], lambda t: np.sin(t)[..., None], vectorised=vectorised
    )
    ends = np.array([0.1, 0.25, 0.7])
    np.testing.assert_array_equal(signal.through(0.0, ends), np.sin(ends)[:, None])
    assert signal.y[0] == signal.get_outputs()[0] == np.sin(0.7)


def test_what_a_signal_cannot_foresee_ends_the_run_when_it_comes():
    def until_one(t):
        if np.max(t) > 1.0:
            raise ValueError("nothing is known after 1 s")
        return np.asarray(t)[..., None]

    signal = Signal("s", [Variable(name="y")], until_one, vectorised=True)
    run = cosimulate(System([signal], []), jacobi(), 0.25, 2.0)
    assert [next(run).time for _ in range(5)] == [0.0, 0.25, 0.5, 0.75, 1.0]
    with pytest.raises(ValueError, match="nothing is known after 1 s"):
        next(run)


def test_full_steps_have_the_same_length():
    """An FMU that keeps matrices for its step must not have to make them anew."""
    steps = []

    class Watched(Signal):
        def do_step(self, t, h):
            steps.append(h)
            super().do_step(t, h)

    system = System([Watched("s", [Variable(name="y")], lambda t: [t])], [])
    list(cosimulate(system, jacobi(), 0.1, 0.9))
    assert set(steps) == {0.1}  # also the last, though 0.9 - 8 * 0.1 is not 0.1
    steps.clear()
    list(cosimulate(system, jacobi(), 0.1, 0.95))
    assert set(steps[:-1]) == {0.1}
    # The difference of two numbers near 1 is exact to their rounding, 2e-16.
    assert steps[-1] == pytest.approx(0.05, abs=1e-15)


@pytest.mark.parametrize("step", [0.0, -1e-3, float("nan"), float("inf")])
def test_step_is_checked_at_once(step):
    with pytest.raises(ValueError, match="step must be positive"):
        cosimulate(signal_system(lambda t: t), jacobi(), step, 1.0)


@pytest.mark.parametrize(("start", "stop"), [(0.0, 0.0), (1.0, 0.5), (0.0, float("nan"))])
def test_span_is_checked_at_once(start, stop):
    with pytest.raises(ValueError, match="stop must be finite and after"):
        cosimulate(signal_system(lambda t: t), jacobi(), 0.1, stop, start)


def test_points_are_yours_to_keep():
    points = list(cosimulate(make_system(), jacobi(), 0.01, 0.1))
    assert len({p.outputs.tobytes() for p in points}) == len(points) == 11
    assert points[0].report is None
    assert all(p.report.converged and p.report.evaluations == 1 for p in points[1:])


def test_a_run_goes_on_where_it_was_left_however_it_is_asked():
    """All at once, one by one, and in two loops: the run knows where it is, not who asks it."""
    expected = [
        (p.time, p.outputs.tobytes()) for p in cosimulate(make_system(), jacobi(), 0.01, 0.1)
    ]
    run = cosimulate(make_system(), jacobi(), 0.01, 0.1)
    points = [next(run), next(run)]
    for point in run:
        points.append(point)
        if len(points) == 5:
            break
    points += [next(run), *run]
    assert [(p.time, p.outputs.tobytes()) for p in points] == expected
    assert next(run, None) is None


def test_fallback_warns():
    with pytest.warns(FallbackWarning) as caught:
        cosimulate(make_system(HoldingComponent, holds={Hold.CONSTANT}), jacobi(), 0.01, 0.1)
    assert [" ".join(str(w.message).split()[:3]) for w in caught] == [
        "left cannot extrapolate",
        "right cannot extrapolate",
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cosimulate(make_system(), jacobi(), 0.01, 0.1)
        cosimulate(make_system(HoldingComponent), jacobi(), 0.01, 0.1)


def test_divergence_keeps_what_was_recorded():
    # Jacobi with a step of about the coupled period: grows by orders of magnitude each step.
    system = make_system()
    recorder = Recorder(system)
    stopped = record(cosimulate(system, jacobi(), 0.7, 100.0), recorder)
    assert isinstance(stopped, Divergence)
    data = recorder.to_dataset()
    assert 3 <= data.sizes["time"] < 140
    largest = max(float(np.abs(v).max()) for v in data.data_vars.values())
    assert 1.0 < largest <= 1e6
    time = data.time.values[-1] + 0.7
    assert f"t = {time:.9g} s" in str(stopped)
    for part in ("Jacobi, linear inputs", "step 0.7 s", "Try a shorter step"):
        assert part in str(stopped)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf"), 2.1e6])
def test_bad_values_are_named(bad):
    system = signal_system(lambda t: bad if t > 0.45 else 1.0, unit="kN", nominal=2.0)
    points = cosimulate(system, jacobi(), 0.1, 1.0)
    assert [next(points).time for _ in range(5)][-1] == pytest.approx(0.4)
    with pytest.raises(Divergence, match=r"t = 0\.5 s: s\.y = .* kN .*allowed: 2e\+06"):
        next(points)


def test_limit_can_be_moved():
    system = signal_system(lambda t: 2.1e6)
    assert len(list(cosimulate(system, jacobi(), 0.5, 1.0, limit=1e7))) == 3


def test_refusal_of_a_component_has_context():
    class Refusing(Signal):
        def do_step(self, t, h):
            if t > 0.25:
                raise ComponentError("s: no more")
            super().do_step(t, h)

    system = System([Refusing("s", [Variable(name="y")], lambda t: [t])], [])
    recorder = Recorder(system)
    stopped = record(cosimulate(system, gauss_seidel(first="s"), 0.1, 1.0), recorder)
    assert isinstance(stopped, ComponentError)
    assert "s: no more (step from t = 0.3 s, scheme Gauss-Seidel, s first" in str(stopped)
    assert len(recorder) == 4


def test_a_second_run_starts_from_the_components_not_from_memory():
    system = make_system()
    states = [c.save_state() for c in system.components]
    runs = []
    for _ in range(2):
        runs.append([p.outputs for p in cosimulate(system, jacobi(), 0.01, 0.1)])
        for component, state in zip(system.components, states, strict=True):
            component.restore_state(state)
    np.testing.assert_array_equal(runs[0], runs[1])  # the same operations: the same bits
