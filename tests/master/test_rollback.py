"""Rollback is tried before it is relied on."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.checkpoint import CheckpointError, Checkpoints
from railcosim.master.component import ComponentError, Variable
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.fmi.rollback import rollback_fault
from railcosim.master.linear.pulses import Bench
from railcosim.master.recording import Recorder
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal

from . import anybody
from .trouble import make_fmu, make_system

LOADERS = [FmuComponent.load, IsolatedComponent.load]


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    """Makes FMUs, each once."""
    folder = tmp_path_factory.mktemp("trouble")

    def find(trouble="NONE"):
        path = folder / f"{trouble}.fmu"
        return path if path.exists() else make_fmu(folder, trouble)

    return find


def fault_of(path):
    with FmuComponent.load(path, name="mass") as mass:
        return mass.can_rollback, mass.rollback_fault


def test_one_that_can(fmu):
    assert fault_of(fmu()) == (True, None)


def euler(x, s, u, steps, h=1e-3):
    """What trouble.c does: x after each step."""
    values = []
    for k in steps:
        # The inputs of the test: near the given ones, and other ones in each step.
        v = u + 1e-3 * np.sin(1.0 + k)
        x, s = x + h * (v + s - x), s + h * v
        values.append(x)
    return values, s


def test_one_that_forgets(fmu):
    """The sentence has the values: s goes on where the repeated steps left it."""
    able, fault = fault_of(fmu("FORGETS"))
    before, s = euler(1.0, 0.0, 0.5, range(2))
    right, later = euler(before[-1], s, 0.5, range(2, 5))
    wrong, _ = euler(before[-1], later, 0.5, range(2, 5))
    assert not able
    # Step 1 differs already; 17 digits show the bits, and the same operations give the same ones.
    assert fault == (
        f"after it went back to a saved state, step 1 gave x = {wrong[0]:.17g} and not "
        f"{right[0]:.17g}"
    )


def test_one_that_forgets_with_other_parameters(fmu):
    """What was found with some is not believed of the same file with others, either way."""
    path = fmu("FORGETS_FAR")
    for s, able in ((0.0, True), (1.0, False), (0.0, True)):
        with FmuComponent.load(path, name="mass") as mass:
            mass.set_parameters({"s": s})
            assert mass.can_rollback is able


def test_one_that_forgets_in_writing(fmu):
    able, fault = fault_of(fmu("FORGETS_WRITTEN"))
    assert not able
    assert fault.startswith("after its state was written and read, step 1 gave x = ")


def test_one_that_crashes(fmu):
    """It does so in the process of the test."""
    able, fault = fault_of(fmu("CRASHES_BACK"))
    assert not able
    assert "was ended by SIGABRT in restore_state, do_step from t = 0.002 s" in fault


def test_the_one_in_use_is_left_alone(fmu):
    with FmuComponent.load(fmu("FORGETS"), name="mass") as mass:
        mass.enter_initialization(0.0)
        mass.exit_initialization()
        for k in range(3):
            mass.set_inputs(np.array([1.0 + k]))
            mass.do_step(0.1 * k, 0.1)
        before = mass.get_outputs()
        assert not mass.can_rollback
        assert mass.get_outputs().tobytes() == before.tobytes()


def test_tried_once_for_each_file_and_its_parameters(fmu, monkeypatch):
    with FmuComponent.load(fmu(), name="mass") as mass:
        assert mass.can_rollback
        monkeypatch.setattr(IsolatedComponent, "load", None)
        assert rollback_fault(mass.description, {}, np.zeros(1), (0.0, None, None), None) is None


@pytest.mark.parametrize("load", LOADERS, ids=["here", "isolated"])
@pytest.mark.filterwarnings("ignore::railcosim.master.cosimulation.FallbackWarning")
def test_refused_where_needed_and_only_there(fmu, load, tmp_path):
    with load(fmu(), name="first") as first, load(fmu("FORGETS"), name="second") as second:
        system = make_system(first, second)
        with pytest.raises(ValueError, match=r"second.*cannot go back.*step 1 gave x = "):
            cosimulate(system, picard(), 0.1, 0.4)
        run = cosimulate(system, jacobi(), 0.1, 0.4)
        points = Checkpoints(tmp_path / "run", 0.1).watch(run, Recorder(system), {})
        with pytest.raises(CheckpointError, match=r"second cannot go back.*step 1 gave x = "):
            next(points)
        assert len(list(run)) == 5


def test_components_that_are_no_fmus():
    signal = Signal("s", [Variable(name="y")], lambda t: [t])
    assert signal.rollback_fault is None


@pytest.mark.parametrize(
    ("able", "words"),
    [
        ('canHandleVariableCommunicationStepSize="true"', None),
        ("", "ended the run after t = 0.25 s"),
    ],
)
def test_one_that_ends_within_the_test(tmp_path, able, words):
    """At 0.45 s: tried in shorter steps, if it takes them."""
    able += ' canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
    path = anybody.make_fmu(tmp_path / "A.fmu", "ends", variables="u x", able=able)
    with FmuComponent.load(path, name="a") as one:
        one.expect_step(0.25)
        one.enter_initialization(0.0)
        one.exit_initialization()
        fault = one.rollback_fault
    assert fault is None if words is None else words in fault


def test_one_that_ends_within_pulses(tmp_path):
    able = 'canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="true"'
    path = anybody.make_fmu(tmp_path / "A.fmu", "ends", variables="u x", able=able)
    with FmuComponent.load(path, name="a") as one:
        one.enter_initialization(0.0)
        one.exit_initialization()
        bench = Bench(one, one.u.copy(), [0], 0.0, one.save_state(), 0.25, 4, 1, None)
        with pytest.raises(ComponentError, match=r"ended the run .* pulse takes longer"):
            bench.whole(np.ones(1))
