"""Iterated coupling: order, convergence, what is guessed, failure, memory."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Component, Hold, Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.law import Law
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes import ConvergenceError
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.iteration import Until
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import (
    C_C,
    K_C,
    X0,
    C,
    HoldingComponent,
    K,
    M,
    exact,
    make_left,
    make_right,
    make_system,
)

METHODS = [picard, aitken, iqn_ils]


def run(system, scheme, step, stop=1.0):
    points = list(cosimulate(system, scheme, step, stop))
    return np.array([p.time for p in points]), np.array([p.outputs for p in points]), points


def error(system, scheme, step, reference=exact):
    times, values, _ = run(system, scheme, step)
    expected = reference(times)
    return np.sqrt(np.mean(((values - expected) / np.abs(expected).max(axis=0)) ** 2))


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("method", METHODS)
def test_order_of_convergence(method, degree):
    scheme = method(degree=degree)
    coarse, fine = (error(make_system(), scheme, h) for h in (1 / 200, 1 / 400))
    # 0.1: the next term of the error's expansion, of the relative size omega h = 0.05, in part.
    assert np.log2(coarse / fine) == pytest.approx(scheme.order, abs=0.1)
    # And it is small, not merely shrinking: of omega h = 0.03, to the power of the order.
    assert fine < 0.03**scheme.order


def test_methods_find_the_same_values():
    """They differ in the way there only: by no more than the tolerance lets them."""
    reference = run(make_system(), picard(), 0.02)[1]
    for method in METHODS[1:]:
        # 1e-6: the tolerance of 1e-8 of values of 10 N, over 50 steps, each with its own rest.
        np.testing.assert_allclose(run(make_system(), method(), 0.02)[1], reference, atol=1e-6)


def test_own_holds():
    """Components that interpolate by themselves, also while they are stepped again and again."""
    coarse, fine = (error(make_system(HoldingComponent), picard(), h) for h in (1 / 200, 1 / 400))
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.1)  # as above


def test_held_inputs_are_those_at_the_end():
    """Of a chain x' = -x + u with u = t: implicit Euler's input."""
    lag = LinearComponent("lag", A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]],
                          inputs=[Variable(name="u")], outputs=[Variable(name="y")])  # fmt: skip
    source = Signal("source", [Variable(name="u")], lambda t: [t])
    system = System([lag, source], connect_by_name([lag, source]))
    _, values, points = run(system, picard(degree=0), 0.5, 0.5)
    # x(0.5) for u = 0.5 held; to rounding.
    assert values[-1, 0] == pytest.approx(0.5 * (1 - np.exp(-0.5)), rel=1e-14)
    # A signal is known: nothing is guessed, nothing is repeated.
    assert points[-1].report.evaluations == 1
    assert points[-1].report.residual == 0.0


def test_only_a_loop_is_guessed_and_the_fewest_of_it():
    """Guessed: the force (1), not the two motions; in whatever order components are given."""
    for components in ([make_left(), make_right()], [make_right(), make_left()]):
        system = System(components, connect_by_name(components))
        stepper = picard().start(system)
        system.begin(0.0)
        stepper.step(0.0, 0.01)
        ((_, guessed),) = stepper.memory[0]
        force = K_C * (X0[0] - X0[2]) + C_C * (X0[1] - X0[3])
        # The force at the start; one rounding apart.
        np.testing.assert_allclose(guessed, [-force], rtol=1e-14)


class Spring:
    """The law of one spring that also pulls."""

    def __init__(self, k):
        self.k = k

    def force(self, compression):
        return self.k * compression

    def tangent(self, compression):
        return np.full((*compression.shape, 1), self.k)


def make_with_law(k=K_C):
    """The oscillator without coupling damper, its spring in the master."""
    halves = [
        LinearComponent(
            name,
            A=[[0.0, 1.0], [-K / M, -C / M]],
            B=[[0.0], [sign / M]],
            C=[[1.0, 0.0]], D=[[0.0]], x0=x0,
            inputs=[Variable(name="force", unit="N")],
            outputs=[Variable(name=f"z_{name}", unit="m")],
        )
        for name, sign, x0 in (("left", -1.0, X0[:2]), ("right", 1.0, X0[2:]))
    ]  # fmt: skip
    motions = [Variable(name="z_left", unit="m"), Variable(name="z_right", unit="m")]
    forces = [Variable(name="force", unit="N")]
    law = Law("spring", Spring(k), motions, forces, [[1.0, -1.0]])
    components = [halves[0], law, halves[1]]
    return System(components, connect_by_name(components))


def exact_with_law(times):
    """z_left, force, z_right."""
    A = np.array([[0, 1, 0, 0], [-(K + K_C) / M, -C / M, K_C / M, 0],
                  [0, 0, 0, 1], [K_C / M, 0, -(K + K_C) / M, -C / M]])  # fmt: skip
    values, vectors = np.linalg.eig(A)
    amplitudes = np.linalg.solve(vectors, X0.astype(complex))
    z1, _, z2, _ = (np.exp(np.outer(times, values)) * amplitudes @ vectors.T).real.T
    return np.column_stack([z1, K_C * (z1 - z2), z2])


@pytest.mark.parametrize("degree", [1, 2])
def test_law_in_the_master(degree):
    """An algebraic component in the loop: only its force is guessed, and the order is kept."""
    scheme = iqn_ils(degree=degree)
    errors = [error(make_with_law(), scheme, h, exact_with_law) for h in (1 / 200, 1 / 400)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.1)  # as above
    stepper = scheme.start(make_with_law())
    assert len(stepper._guessed) == 1


STIFF = 2e3  # N/m


def picard_factor(step):
    """What a change of the guessed force comes back as: the spring times both compliances.

    Of the motion at the end of the step under a force that grows from 0 to 1 over it.
    """
    half = make_with_law().components[0]
    half.x[:] = 0.0
    half.set_inputs(np.zeros(1))
    half.set_input_derivatives(np.array([[1.0 / step]]))
    half.do_step(0.0, step)
    return STIFF * 2 * half.x[0]


@pytest.mark.parametrize(("step", "converges"), [(0.03, True), (0.045, False)])
def test_picard_converges_where_its_factor_is_below_one(step, converges):
    assert bool(abs(picard_factor(step)) < 1.0) is converges
    scheme = picard(until=Until(max_evaluations=1000))
    if converges:
        points = run(make_with_law(STIFF), scheme, step)[2]
        # How many it takes: from a first guess that is wrong by less than 1e4 N to 1e-8 N.
        most = np.log(1e-12) / np.log(abs(picard_factor(step)))
        assert max(p.report.evaluations for p in points[1:]) < most + 2
    else:
        with pytest.raises(ConvergenceError):
            run(make_with_law(STIFF), scheme, step)
    for method in METHODS[1:]:
        points = run(make_with_law(STIFF), method(), step)[2]
        assert all(p.report.converged and p.report.residual <= 1.0 for p in points[1:])
        assert max(p.report.evaluations for p in points[1:]) <= 4  # 3, and one for rounding


def test_one_guessed_value_of_a_linear_system_takes_three_evaluations():
    """Two tell the line, the third is on its root; with what was learnt before, two."""
    for reuse, most in ((0, 3), (1, 2)):
        points = run(make_system(), iqn_ils(reuse=reuse), 0.5, 5.0)[2]
        assert max(p.report.evaluations for p in points[2:]) <= most


@pytest.mark.parametrize(("factor", "forgotten"), [(0.4, True), (2.5, True), (1 + 1e-12, False)])
def test_what_was_learnt_holds_for_its_step_length(factor, forgotten):
    """A step of another length is made as if nothing had been learnt, or it would lead astray."""
    system, scheme = make_system(), iqn_ils(reuse=3)
    points = cosimulate(system, scheme, 0.5, 3.0)
    for _ in range(5):
        next(points)
    state, (past, learnt) = system.save_state(), points.stepper.memory
    counts = []
    for kept in (learnt, (0.0, ())):
        system.restore_state(state)
        points.stepper.memory = past, kept
        report = points.stepper.step(2.0, factor * 0.5)
        counts.append((report.evaluations, system.outputs.tobytes()))
    assert (counts[0] == counts[1]) is forgotten
    assert counts[1][0] == 3  # as above
    assert counts[0][0] == (3 if forgotten else 2)


def test_failure_names_all_that_helps():
    scheme = picard(until=Until(max_evaluations=7))
    with pytest.raises(ConvergenceError) as caught:
        run(make_system(), scheme, 0.5, 5.0)
    for part in ("t = 0.5 s", "7 evaluations", "right.force", " N (allowed", "times that",
                 "accept=True", "iqn-ils", "Picard, linear inputs", "step 0.5 s"):  # fmt: skip
        assert part in str(caught.value)


def test_overflow_is_a_failure_also_if_accepted():
    scheme = picard(until=Until(max_evaluations=100_000, accept=True))
    with pytest.raises(ConvergenceError, match=r"spring\.force"), np.errstate(all="ignore"):
        run(make_with_law(STIFF), scheme, 0.1)


def test_accepting_is_reported():
    scheme = picard(until=Until(max_evaluations=2, accept=True))
    reports = [p.report for p in run(make_system(), scheme, 0.02)[2][1:]]
    assert {r.evaluations for r in reports} == {2}
    assert not any(r.converged for r in reports)
    assert all(1.0 < r.residual < np.inf for r in reports)


@pytest.mark.parametrize(
    "until", [Until(relative=1e-4, absolute=0.0), Until(relative=0.0, absolute=1e-4)]
)
def test_tolerances_mean_what_they_say(until):
    """The values given differ from those the step was made with by the residual reported."""
    system = make_system()
    nominal = 1.0  # N: of the force, which alone is guessed
    points = cosimulate(system, picard(until=until), 0.1, 3.0)
    next(points)
    for point in points:
        force = point.outputs[2]
        _, (used,) = system._ports[0].continuation.past[-1]
        difference = abs(force - used)
        allowed = until.absolute * nominal + until.relative * abs(force)
        assert difference <= allowed
        assert difference / allowed == pytest.approx(point.report.residual, rel=1e-6)  # rounding


def test_units_do_not_matter():
    """In other units, with nominal values to match, the same evaluations."""

    def scaled(factor):
        left, right = make_left(), make_right()
        left.B, right.C, right.D = left.B / factor, right.C.copy(), right.D.copy()
        right.C[0] *= factor
        right.D[0] *= factor
        right.outputs = (Variable(name="force", unit="N", nominal=factor), right.outputs[1])
        return System([left, right], connect_by_name([left, right]))

    counts = [
        [p.report.evaluations for p in run(scaled(factor), iqn_ils(), 0.1, 2.0)[2][1:]]
        for factor in (1.0, 2.0**20)  # a power of two: the same digits
    ]
    assert counts[0] == counts[1]


class NoWayBack(LinearComponent):
    can_rollback = False


@pytest.mark.parametrize("method", METHODS)
def test_refuses_those_who_cannot_go_back(method):
    components: list[Component] = [make_left(), make_right(NoWayBack)]
    with pytest.raises(ValueError, match="right cannot go back"):
        method().start(System(components, connect_by_name(components)))


@pytest.mark.parametrize(
    "settings",
    [{"relative": -1.0}, {"absolute": float("nan")}, {"relative": 0.0, "absolute": 0.0},
     {"max_evaluations": 0}],
)  # fmt: skip
def test_settings_are_checked(settings):
    with pytest.raises(ValueError, match=r"must be|both 0"):
        Until(**settings)


def test_other_settings_are_checked():
    for bad in (lambda: picard(degree=3), lambda: aitken(relaxation=0.0),
                lambda: iqn_ils(relaxation=-1.0), lambda: iqn_ils(reuse=-1)):  # fmt: skip
        with pytest.raises(ValueError, match="must"):
            bad()


def test_fallback_is_told():
    system = make_system(HoldingComponent, holds={Hold.CONSTANT})
    sentences = picard(degree=1).start(system).fallbacks
    assert [s.split()[0] for s in sentences] == ["left", "right"]
    assert all("of order 1" in s for s in sentences)


@pytest.mark.parametrize("scheme", [picard(), aitken(), iqn_ils(), iqn_ils(reuse=3)], ids=str)
def test_memory_is_all_that_counts(scheme):
    """Back to a snapshot, or in a new stepper with its memory: the same bits."""
    h = 0.05
    system = make_system()
    points = cosimulate(system, scheme, h, 1.0)
    for _ in range(6):
        next(points)
    stepper = points.stepper
    state, memory = system.save_state(), stepper.memory
    results = []
    for again in (stepper, stepper, scheme.start(system)):
        system.restore_state(state)
        again.memory = memory
        for i in range(5):
            again.step((5 + i) * h, h)
        results.append(system.outputs.copy())
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])


def test_better_than_gauss_seidel_where_that_is_unstable():
    """What iterating buys: steps at which one pass grows without bound."""
    with pytest.raises(Divergence):
        run(make_system(), gauss_seidel(first="left"), 0.2, 50.0)
    values = run(make_system(), iqn_ils(), 0.2, 50.0)[1]
    # The slower mode decays as exp(-0.15 t): to 1e-3 of the 70 N that it starts with.
    assert np.abs(values[-20:]).max() < 0.1
