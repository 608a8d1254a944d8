"""Stability of any two FMUs: predicted from outside, held against runs of them."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from railcosim.analysis.pair import roles
from railcosim.analysis.schemes import linear_system
from railcosim.analysis.schemes.black_boxes import system_stability
from railcosim.analysis.schemes.boxes import Boxes
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.linear_system import DoubtWarning
from railcosim.analysis.schemes.system_advice import MotionError, advise_system
from railcosim.master.component import ComponentError
from railcosim.master.connections import CouplingError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.archive import FmuError
from railcosim.master.law_file import read_law
from railcosim.master.linear import linear_fmu
from railcosim.master.ssp import initialise, open_ssp
from railcosim.master.system import System
from railcosim.parameters import ArgumentError

from ..master import mass
from ..master.mass import LAW, TOGETHER


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return mass.compiled(tmp_path_factory.mktemp("mass"))


@pytest.fixture
def made(library, tmp_path):
    """Function: SSP and law, where one of the masses owns the spring or the master does."""
    return lambda owner, **more: mass.made(library, tmp_path, owner, **more)


def growth(path, law, scheme, h, steps=3000):
    """Rate at which a run of the FMUs grows: of its largest swing in the last quarter, 1/s."""
    with open_ssp(path, law=law) as loaded:
        running = System(loaded.components, loaded.connections)
        initialise(running, loaded.fmus, 0.0)
        stepper = scheme.start(running)
        running.begin(0.0)
        size = np.empty(steps)
        for n in range(steps):
            stepper.step(n * h, h)
            size[n] = np.abs(running.outputs).max()
    ends = size[steps // 2 : 3 * steps // 4].max(), size[3 * steps // 4 :].max()
    return np.log(ends[1] / ends[0]) / (steps / 4 * h)


@pytest.mark.parametrize("owner", ["right", "master"])
@pytest.mark.parametrize("name", ["jacobi-constant", "gauss-seidel-constant-left-first", "nepce"])
def test_limits_are_those_of_runs(made, owner, name) -> None:
    path, law = made(owner)
    found = system_stability(path, [name], law=law)
    assert set(found.ways.values()) == {"Model Exchange, finite differences"}
    step = found.limits[name].step
    assert 0.0 < step < 1.0, found
    scheme = members(("left", "right"))[name].scheme
    assert growth(path, law, scheme, 0.99 * step) < 0.0
    assert growth(path, law, scheme, 1.01 * step) > 0.0


@pytest.mark.slow  # records of pulses: 5 s each
@pytest.mark.parametrize("back", [True, False])
def test_pulses_predict_what_model_exchange_does(made, back) -> None:
    """From outside: the same limits, to the 0.05 % that edges are known to.

    Also of FMUs that cannot go back to a state, which begin anew.
    """
    path, _ = made("right")
    inside = system_stability(path, ["jacobi", "gauss-seidel"])
    path, _ = made("right", exchange=False, back=back)
    outside = system_stability(path, ["jacobi", "gauss-seidel"], step=2e-2)
    assert set(outside.ways.values()) == {"Co-Simulation, pulses"}
    assert list(outside.limits) == list(inside.limits)
    for name, limit in inside.limits.items():
        assert outside.limits[name].step == pytest.approx(limit.step, rel=1e-3), name


def test_a_search_tells_how_far_it_is(made) -> None:
    """Within a scheme, not only between them: at least every tenth of it."""
    path, _ = made("right")
    told = []
    system_stability(path, ["nepce"], progress=lambda a, b: told.append(a / b))
    assert told == sorted(told)
    assert np.diff(told).max() < 0.15
    assert told[-1] == 1.0


@pytest.mark.parametrize("owner", ["right", "master"])
def test_advice_is_what_runs_are_like(made, owner) -> None:
    """At the step advised, from the displaced mass: both motions are in it, half a metre each.

    Named is the error of the worse motion, so that of both is as much at the most, but for how a
    run begins. That is the faster one, whose RMS is half of all: dampings are 0.65 and 0.15 /s.
    """
    path, law = made(owner)
    duration = 4.0
    found = advise_system(path, 2e-2, law=law, time=duration, schemes=["nepce"])
    (option,) = found.options
    assert option.error <= 2e-2
    with open_ssp(path, law=law) as loaded:
        running = System(loaded.components, loaded.connections)
        initialise(running, loaded.fmus, 0.0)
        scheme = members(("left", "right"))[option.scheme].scheme
        points = list(cosimulate(running, scheme, option.step, duration))
        z = np.array([p.outputs[running.names.index("left.z")] for p in points])
    exact = mass.exact([p.time for p in points])[:, 0]
    measured = np.linalg.norm(z - exact) / np.linalg.norm(exact)
    assert 0.45 * option.error < measured < 1.2 * option.error


def test_error_of_a_motion_is_that_of_its_numbers() -> None:
    """Of Euler's rule for x' = -a x, by hand: (1 - a h)^k for exp(-a h k), over five times 1/a."""
    a, h = 2.0, 0.1
    k = np.arange(26)
    exact, euler = np.exp(-a * h * k), (1 - a * h) ** k
    step = SimpleNamespace(eigenvalues=lambda: np.array([1 - a * h + 0j, 0.0]))
    coupling = SimpleNamespace(amplifiers=[SimpleNamespace(at=lambda h: step)])
    error = MotionError(np.array([-a + 0j]), 100.0).of(coupling, h)
    assert error == pytest.approx(np.linalg.norm(euler - exact) / np.linalg.norm(exact), rel=1e-12)


def test_inputs_that_nobody_feeds_are_as_the_file_says(library, tmp_path, monkeypatch) -> None:
    """An FMU is linear about where it runs: place from the other one, speed from the file."""
    ends = "alone", "owner"
    path = mass.system(library, tmp_path, ends, [*mass.WIRES[::2]], right={"vz": 0.25})
    asked = {}

    def way(path, name, wanted, progress):
        asked[name] = wanted
        return linear_fmu.DIFFERENCES(path, name, wanted, progress)

    way.description = "told"
    monkeypatch.setattr(linear_system, "best_way", lambda path, pulses: way)
    system_stability(path, ["jacobi-constant"])
    assert asked["right"].at == {"z": 1.0, "vz": 0.25}
    assert list(asked["right"].inputs) == ["z"]


def euler_by_hand(owner, h):
    """Both masses by a step of Euler's rule each: together, or the left one first."""
    together = np.eye(4) + h * TOGETHER
    if owner == "master":
        return together
    first, second = np.eye(4), np.eye(4)
    first[:2], second[2:] = together[:2], together[2:]
    return second @ first


@pytest.mark.parametrize(
    ("owner", "name"),
    [
        ("right", "gauss-seidel-constant-left-first"),
        pytest.param("master", "jacobi-constant", marks=pytest.mark.slow),  # the same once more
    ],
)
def test_limits_of_fmus_that_step_by_eulers_rule_are_those_by_hand(tmp_path, owner, name) -> None:
    """Those of OpenModelica do; how their Model Exchange moves says nothing of their steps.

    To the 0.05 % that edges are known to.
    """
    path, law = mass.made(mass.compiled(tmp_path, "-DEULER"), tmp_path, owner)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DoubtWarning)
        found = system_stability(path, [name], law=law)
    said = "Model Exchange, finite differences; one step of Euler's rule a communication step"
    assert set(found.ways.values()) == {said}
    slow = 1e-4 * np.abs(np.linalg.eigvals(TOGETHER)).min()

    def grows(h):
        return np.log(np.abs(np.linalg.eigvals(euler_by_hand(owner, h))).max()) - slow * h

    assert found.limits[name].step == pytest.approx(brentq(grows, 1e-4, 0.1), rel=1e-3)


def test_eulers_rule_is_not_what_several_steps_of_it_are(tmp_path) -> None:
    """Two internal steps are no step of it, and told as what the model does not foresee.

    The left mass gets half its way in such a step: half of it is missing.
    """
    library = mass.compiled(tmp_path, "-DEULER", "-DPARTS_OF_EULER=2")
    path, _ = mass.made(library, tmp_path, "right")
    with pytest.warns(DoubtWarning, match="left: its Co-Simulation does not step as") as told:
        advice = advise_system(path, 2e-2, time=4.0, schemes=["nepce"])
    left, right = (str(one.message) for one in told)
    fastest = np.abs(np.linalg.eigvals([[0.0, 1.0], [-mass.K, -mass.C]])).max()
    assert f"z after a step of {1 / fastest:.3g} s with f changed is off by 0.4" in left
    assert right.startswith("right: its Co-Simulation does not step as")
    assert f"left: {advice.to_dataset().attrs['doubt of left']}" == left


@pytest.mark.parametrize(
    ("sign", "told"), [("z", "leave --system out, and give both by"), ("y", "amplitude=, step=")]
)
def test_what_to_do_if_pulses_tell_nothing(made, monkeypatch, sign, told) -> None:
    """A vehicle or a track, known by an output, is linear where it rests, and not by pulses."""

    def refused(*args):
        raise ComponentError("it is not linear")

    path, _ = made("right", exchange=False)
    monkeypatch.setattr(linear_fmu, "linearise", lambda *a, **b: refused())
    monkeypatch.setitem(roles.SIGNS, "track", sign)
    with pytest.raises(ComponentError, match=f"it is not linear .*{told}"):
        system_stability(path, ["jacobi-constant"], step=1e-2)


def test_advice_that_cannot_be(made) -> None:
    path, _ = made("right")
    with pytest.raises(FmuError, match="does not say when to stop; give --time"):
        advise_system(path, schemes=["nepce"])
    with pytest.raises(ArgumentError, match="no scheme reaches it with steps of"):
        advise_system(path, 1e-9, schemes=["jacobi-constant"], time=1.0)


def test_a_system_without_a_loop_is_refused(library, tmp_path) -> None:
    """One mass drives the other, and nothing comes back."""
    path = mass.system(library, tmp_path, ("alone", "owner"), mass.WIRES[:2])
    with pytest.raises(CouplingError, match="no value comes back to the FMU"):
        system_stability(path, ["nepce"])


def test_growth_if_coupled_exactly_is_that_of_both_masses_together(made) -> None:
    """Poles of the uncut oscillator, M x'' = ..., however it is cut."""
    slowest = np.abs(np.linalg.eigvals(TOGETHER)).min()
    for owner in ("right", "master"):
        path, law = made(owner)
        found = system_stability(path, ["nepce"], law=law)
        assert found.growth == 0.0
        assert found.longest == pytest.approx(2 * np.pi / slowest, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("stiffness = 50.0", "stiffness = inf"), "contact 1: stiffness = inf: must be a finite"),
        (("stiffness = 50.0\ndamping = 0.5", ""), "needs a stiffness or a damping"),
        (('"left.f" = -1', '"left.f" = 0'), "force, left.f = 0: must be another number"),
        (('"left.z"', '"left.y"'), "no Real output 'left.y'"),
        (('"left.f" = -1, ', '"left.f" = -1, "left.z" = 1, '), "no Real input 'left.z'"),
        (("[[contact]]", "[contact]"), "must hold tables"),
        (("rate =", "rates ="), "no key 'rates'; did you mean rate?"),
        (("motion = {", "motion = 3 #"), "motion must be a table of factors"),
    ],
)
def test_a_wrong_law_is_refused(made, change, told) -> None:
    path, law = made("master")
    law.write_text(LAW.replace(*change))
    with open_ssp(path) as loaded, pytest.raises(CouplingError, match=told):
        read_law(law, loaded.components)


def test_boxes_without_motion_are_refused() -> None:
    with pytest.raises((CouplingError, ValueError)):
        Boxes([], [], [])
