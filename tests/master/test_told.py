"""What FMUs are told of a run: its span, the tolerance, whether steps are taken back."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.cli.options import UsageError
from railcosim.cli.scheme_options import CourseOptions
from railcosim.master.checkpoint import Checkpoints
from railcosim.master.cosimulation import cosimulate
from railcosim.master.course import Keeping
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.pace import FixedStep
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.picard import picard
from railcosim.master.step_control import StepControl
from railcosim.master.system import System
from railcosim.master.system_run import run_ssp

from .anybody import make_fmu
from .plant import pack, ssd
from .test_types import STATES, component

EXPERIMENT = '<DefaultExperiment tolerance="1e-5" stopTime="9"/>'


def quiet(time, stop):
    """No progress bar."""


def ran(tmp_path, mode="plain", *, scheme=None, load=FmuComponent.load, experiment="", **how):
    """A run of one FMU by itself: the last values of what it was told, and all."""
    about = {name: how.pop(name) for name in ("before", "variables") if name in how}
    fmu = make_fmu(tmp_path / f"{mode}.fmu", mode, able=STATES, **about)
    text = ssd(f"<ssd:Elements>{component()}</ssd:Elements>", experiment)
    path = pack(tmp_path / "s.ssp", text, A__fmu=fmu)
    chosen = jacobi(degree=0) if scheme is None else scheme
    dataset, stopped = run_ssp(
        path, lambda usual: chosen, quiet, load=load, **({"step": 0.25, "time": 0.5} | how)
    )
    assert stopped is None
    return {name: values.values[-1] for name, values in dataset.data_vars.items()}, dataset


START = '<ssd:DefaultExperiment startTime="1"/>'


@pytest.mark.parametrize("load", [FmuComponent.load, IsolatedComponent.load])
def test_span_and_tolerance(tmp_path, load):
    told, _ = ran(tmp_path, load=load, experiment=START, tolerance_fmu=1e-3)
    assert (told["start"], told["tolerance"]) == (1.0, 1e-3)
    assert told["stop"] == pytest.approx(1.5, rel=1e-15)
    assert told["stop"] >= 1.5


def test_tolerance_is_its_own_unless_given(tmp_path):
    told, dataset = ran(tmp_path, before=EXPERIMENT)
    assert told["tolerance"] == 1e-5
    assert "tolerance of FMUs" not in dataset.attrs
    told, dataset = ran(tmp_path, before=EXPERIMENT, tolerance_fmu=1e-3)
    assert told["tolerance"] == dataset.attrs["tolerance of FMUs"] == 1e-3
    told, _ = ran(tmp_path)
    assert told["tolerance"] == -1.0


@pytest.mark.parametrize("mode", ["needs stop", "needs tolerance"])
def test_those_that_need_it(tmp_path, mode):
    ran(tmp_path, mode, tolerance_fmu=1e-4)


@pytest.mark.parametrize(
    ("step", "time"), [(0.001, 0.01), (0.1, 0.3), (1 / 3, 1.0), (0.07, 0.49), (0.3, 1.0)]
)
@pytest.mark.parametrize("start", [0.0, 1.0, 1e4])
def test_no_step_ends_behind_the_stop(tmp_path, step, time, start):
    """The fixture refuses one that does by a rounding; 9 steps of 1 ms and one do behind 10 ms."""
    experiment = f'<ssd:DefaultExperiment startTime="{start}"/>'
    for tolerance in (None, 1e-3):
        told, dataset = ran(
            tmp_path,
            variables="u x",
            experiment=experiment,
            step=step,
            time=time,
            tolerance=tolerance,
        )
        assert dataset["time"].values[-1] == start + time
        assert told["x"] == pytest.approx(0.5 * time, rel=1e-9)  # sums of rounded times


def test_reach_is_the_stop_but_for_rounding():
    for pace in (FixedStep(0.1), StepControl(order=1, largest=0.1, smallest=1e-5)):
        reach = pace.reach(0.0, 0.3)
        assert 0.3 <= reach <= 0.3 * (1 + 2e-15)
    # What counts as a whole step is one: three of them end behind 0.29999999.
    assert FixedStep(0.1).reach(0.0, 0.29999999) >= 0.2 + 0.1


@pytest.mark.parametrize("load", [FmuComponent.load, IsolatedComponent.load])
@pytest.mark.parametrize(
    ("scheme", "tolerance", "final"),
    [
        (jacobi(degree=0), None, 1.0),
        (gauss_seidel(first="a", degree=0), None, 1.0),
        (jacobi(degree=0), 1e-3, 0.0),
        (picard(degree=0), None, 0.0),
    ],
)
def test_whether_steps_are_taken_back(tmp_path, scheme, tolerance, final, load):
    how = {"scheme": scheme, "tolerance": tolerance, "load": load}
    told, _ = ran(tmp_path, variables="u x final", **how)
    assert told["final"] == final


def test_who_trusts_that_nobody_goes_back(tmp_path):
    """One that keeps its past if somebody may lags behind here; a checkpoint takes nothing back."""
    told, _ = ran(tmp_path, "past")
    assert told["x"] == 0.25
    keeping = Keeping(checkpoints=Checkpoints(tmp_path / "c.chk", 0.1, {}))
    told, _ = ran(tmp_path, "past", keeping=keeping)
    assert (told["x"], told["final"]) == (0.25, 1.0)


def test_tolerance_of_fmus_is_checked():
    with pytest.raises(UsageError, match=r"--tolerance-fmu 2: must be between 0 and 1"):
        CourseOptions(tolerance_fmu=2.0).check()


def test_in_python(tmp_path):
    with FmuComponent.load(make_fmu(tmp_path / "A.fmu"), name="a") as a:
        a.enter_initialization(2.0, 3.0, 1e-6)
        a.exit_initialization()
        system = System([a], [])
        points = list(cosimulate(system, jacobi(degree=0), 0.5, 3.0, 2.0))
        told = dict(zip(system.names, points[-1].outputs, strict=True))
    expected = [2.0, 3.0, 1e-6]
    np.testing.assert_array_equal(
        [told[f"a.{k}"] for k in ("start", "stop", "tolerance")], expected
    )
