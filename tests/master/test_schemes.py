"""Orders of convergence, holds, order of stepping, rollback."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Hold, Variable
from railcosim.master.connections import CouplingError, connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import C_C, K_C, HoldingComponent, exact, make_left, make_right, make_system

SCHEMES = [
    scheme
    for degree in (0, 1)
    for scheme in (
        jacobi(degree=degree),
        gauss_seidel(first="left", degree=degree),
        # Of this order only because `right` reads its force for the extrapolated motion.
        gauss_seidel(first="right", degree=degree),
    )
]
KINDS = [LinearComponent, HoldingComponent]  # inputs by derivatives, by the component's own hold


def rms_error(system, scheme, step, reference, stop=1.0):
    points = list(cosimulate(system, scheme, step, stop))
    times = np.array([p.time for p in points])
    values = np.array([p.outputs for p in points])
    expected = reference(times)
    scale = np.abs(expected).max(axis=0)
    return np.sqrt(np.mean(((values - expected) / scale) ** 2))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_order_of_convergence(scheme, kind):
    coarse, fine = (rms_error(make_system(kind), scheme, h, exact) for h in (1 / 200, 1 / 400))
    # 0.2: the next term of the error's expansion at these steps (omega h = 0.05).
    assert np.log2(coarse / fine) == pytest.approx(scheme.order, abs=0.2)
    # And it is small, not merely shrinking: 10 % for the first order ones at omega h = 0.03.
    assert fine < 0.1


def driven(kind=LinearComponent, signal=np.sin):
    """x' = -x + u, u given as a signal, with the system's order the wrong way round."""
    lag = kind(
        "lag", A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]], x0=[0.0],
        inputs=[Variable(name="u")], outputs=[Variable(name="y")],
    )  # fmt: skip
    source = Signal("source", [Variable(name="u")], lambda t: [signal(t)])
    return System([lag, source], connect_by_name([lag, source]))


def driven_exact(times):
    y = 0.5 * (np.exp(-times) + np.sin(times) - np.cos(times))
    return np.column_stack([y, np.sin(times)])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scheme", [jacobi(degree=0), jacobi(), gauss_seidel(first="lag")], ids=str)
def test_order_with_signal(scheme, kind):
    coarse, fine = (rms_error(driven(kind), scheme, h, driven_exact, 2.0) for h in (0.1, 0.05))
    # 0.2: as above; the time scales are 1 s here.
    assert np.log2(coarse / fine) == pytest.approx(scheme.order, abs=0.2)


@pytest.mark.parametrize("scheme", [jacobi(degree=2), gauss_seidel(first="lag", degree=2)], ids=str)
def test_third_order(scheme):
    """A signal that begins with zero slope: the polynomial has no past from which to know one."""

    def make():
        return driven(signal=lambda t: 1.0 - np.cos(t))

    def reference(times):
        y = 1.0 - 0.5 * (np.cos(times) + np.sin(times) + np.exp(-times))
        return np.column_stack([y, 1.0 - np.cos(times)])

    coarse, fine = (rms_error(make(), scheme, h, reference, 2.0) for h in (0.02, 0.01))
    # 0.1: the next term of the error's expansion is of the relative size of h.
    assert np.log2(coarse / fine) == pytest.approx(3, abs=0.1)


def test_gauss_seidel_interpolates_signals():
    system = driven(HoldingComponent)
    gauss_seidel(first="lag").start(system)
    assert system.components[0].hold is Hold.INTERPOLATE


def test_gauss_seidel_holds_follow_the_order():
    system = make_system(HoldingComponent)
    assert gauss_seidel(first="right").start(system).fallbacks == ()
    assert [c.hold for c in system.components] == [Hold.INTERPOLATE, Hold.EXTRAPOLATE]
    gauss_seidel(first="left").start(system)
    assert [c.hold for c in system.components] == [Hold.EXTRAPOLATE, Hold.INTERPOLATE]


class Spy(LinearComponent):
    """Remembers the inputs each step was made with."""

    def do_step(self, t, h):
        self.__dict__.setdefault("used", []).append(self._inputs.copy())
        super().do_step(t, h)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_all_inputs_of_a_component_are_of_one_instant(degree):
    """Fed by a signal (known at the end) and a later component (not): both at the beginning."""
    inputs = [Variable(name="clock"), Variable(name="late")]
    spy = Spy("spy", A=[[0.0]], B=[[1.0, 0.0]], C=[[1.0]], D=[[0.0, 0.0]], x0=[0.0],
              inputs=inputs, outputs=[Variable(name="y")])  # fmt: skip
    late = LinearComponent("late", A=[[0.0]], B=[[0.0]], C=[[1.0]], D=[[0.0]], x0=[7.0],
                           inputs=[Variable(name="y")],
                           outputs=[Variable(name="late")])  # fmt: skip
    clock = Signal("clock", [Variable(name="clock")], lambda t: [t])
    components = [spy, late, clock]
    system = System(components, connect_by_name(components))
    scheme = gauss_seidel(first=("spy", "late"), degree=degree)
    list(cosimulate(system, scheme, 0.5, 1.5))
    np.testing.assert_array_equal(spy.used, [[0.0, 7.0], [0.5, 7.0], [1.0, 7.0]])


def test_fallback_is_reported_for_each_component():
    system = make_system(HoldingComponent, holds={Hold.CONSTANT})
    sentences = jacobi().start(system).fallbacks
    assert [s.split()[0] for s in sentences] == ["left", "right"]
    assert all("of order 1" in s for s in sentences)
    assert jacobi(degree=0).start(system).fallbacks == ()
    sentences = jacobi(degree=2).start(make_system(HoldingComponent)).fallbacks
    assert ["of order 2" in s for s in sentences] == [True, True]


def test_fallback_still_couples_first_order():
    system = make_system(HoldingComponent, holds={Hold.CONSTANT})
    with pytest.warns(UserWarning, match="they are constant"):
        error = rms_error(system, jacobi(), 1 / 400, exact)
    assert error == rms_error(make_system(), jacobi(degree=0), 1 / 400, exact)


def test_descriptions():
    assert str(jacobi(degree=0)) == "Jacobi, constant inputs"
    assert str(gauss_seidel(first="left")) == "Gauss-Seidel, left first, linear inputs"


@pytest.mark.parametrize("make", [jacobi, lambda **k: gauss_seidel(first="left", **k)])
@pytest.mark.parametrize("degree", [-1, 3, 0.5])
def test_degree_is_checked(make, degree):
    with pytest.raises(ValueError, match="must be 0"):
        make(degree=degree)


def test_gauss_seidel_names_are_checked():
    with pytest.raises(ValueError, match="one or several different"):
        gauss_seidel(first=("left", "left"))
    with pytest.raises(CouplingError, match="did you mean left"):
        gauss_seidel(first="lfet").start(make_system())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scheme", [*SCHEMES, jacobi(degree=2)], ids=str)
@pytest.mark.filterwarnings("ignore::railcosim.master.cosimulation.FallbackWarning")
def test_rollback_is_bit_exact(scheme, kind):
    system, h = make_system(kind), 0.01
    points = cosimulate(system, scheme, h, 1.0)
    for _ in range(4):
        next(points)
    state = system.save_state()
    runs = []
    for _ in range(2):
        for i in range(5):
            points.stepper.step((3 + i) * h, h)
        runs.append(system.outputs.copy())
        system.restore_state(state)
    np.testing.assert_array_equal(runs[0], runs[1])  # the same operations: the same bits
    assert not np.array_equal(runs[0], system.outputs)  # and going back did change something


@pytest.mark.parametrize("scheme", [*SCHEMES, nepce()], ids=str)
def test_values_of_a_point_belong_together(scheme):
    """The force is that of the motions beside it, not of those it was stepped with."""
    system = make_system()
    right = system.components[1]
    for point in cosimulate(system, scheme, 0.05, 0.5):
        z, vz, force, z2 = point.outputs
        assert z2 == right.x[0]
        # To rounding of terms of K_C times 1 m.
        assert force == pytest.approx(K_C * (z2 - z) + C_C * (right.x[1] - vz), abs=1e-12)


def test_components_can_come_in_any_order():
    """The scheme decides who goes first, not the list."""
    components = [make_right(), make_left()]
    swapped = System(components, connect_by_name(components))
    scheme = gauss_seidel(first="left")
    a = list(cosimulate(make_system(), scheme, 0.01, 0.2))[-1].outputs
    b = list(cosimulate(swapped, scheme, 0.01, 0.2))[-1].outputs
    np.testing.assert_array_equal(a, b[[2, 3, 0, 1]])
