"""What anybody's FMU may do, and what becomes of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import xarray as xr

from railcosim.master.component import Variable
from railcosim.master.connections import Connection
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent, FmuError
from railcosim.master.fmi.fmu_log import FmuLog
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.fmi.loaded_fmu import FmuWarning
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.step_control import StepControl
from railcosim.master.system import System
from railcosim.master.system_run import run_ssp

from .anybody import description, make_fmu
from .plant import pack, ssd
from .test_types import component


def initialised(path, load=FmuComponent.load, **options):
    """One of them, ready to be stepped."""
    fmu = load(path, **options)
    fmu.enter_initialization(0.0)
    fmu.exit_initialization()
    return fmu


def test_threads_load_at_once(tmp_path):
    """No load changes the folder of the process, in which relative paths of the others begin."""
    path, before, wrong = make_fmu(tmp_path / "A.fmu"), Path.cwd(), []

    def load():
        for _ in range(5):
            with initialised(Path(os.path.relpath(path, before))) as fmu:
                fmu.do_step(0.0, 0.5)
                if Path.cwd() != before or fmu.get_outputs()[0] != 0.25:
                    wrong.append(Path.cwd())

    threads = [threading.Thread(target=load) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_once_per_process_but_each_has_its_own_library(tmp_path):
    path = make_fmu(tmp_path / "A.fmu", "once")
    with initialised(path, name="a") as a, initialised(path, name="b") as b:
        for fmu in (a, b):
            fmu.do_step(0.0, 0.5)
            assert fmu.get_outputs()[0] == 0.25


def test_a_library_of_another_name_is_named(tmp_path):
    text = description().replace('modelIdentifier="anybody"', 'modelIdentifier="somebody"')
    with pytest.raises(FmuError, match=r"calls the library somebody\.\w+, but in it .* anybody\."):
        FmuComponent.load(make_fmu(tmp_path / "A.fmu", text=text))


def test_functions_that_nobody_asks_for_may_be_missing(tmp_path):
    """The fixture has no fmi2GetDirectionalDerivative; asked for it is an error that says so."""
    text = description(able='providesDirectionalDerivative="true"')
    with initialised(make_fmu(tmp_path / "A.fmu", text=text), name="a") as a:
        a.do_step(0.0, 0.5)
        # Derivatives at the communication point, as of anybody's FMU, say nothing of a step.
        assert a.step_derivative() is None
    of_step = (
        '<ScalarVariable name="derivatives_of_step" valueReference="2" causality="parameter" '
        'variability="tunable"><Boolean start="false"/></ScalarVariable></ModelVariables>'
    )
    text = text.replace("</ModelVariables>", of_step)
    with initialised(make_fmu(tmp_path / "B.fmu", text=text), name="a") as a:
        a.do_step(0.0, 0.5)
        with pytest.raises(FmuError, match="a: its library has no fmi2GetDirectionalDerivative"):
            a.step_derivative()


LOADS = [FmuComponent.load, IsolatedComponent.load]
U_X = {"variables": "u x"}


def ran(fmu, scheme=None, step=0.25, stop=1.0):
    """Steps of one FMU by itself: times, its x, how the run ended."""
    system = System([fmu], [])
    run = cosimulate(system, jacobi(degree=0) if scheme is None else scheme, step, stop)
    recorder = Recorder(system)
    stopped = record(run, recorder)
    dataset = recorder.to_dataset()
    return dataset["time"].values.tolist(), dataset["x"].values.tolist(), stopped, run


@pytest.mark.parametrize("load", LOADS)
def test_one_that_ends_the_run(tmp_path, load):
    """In the step that ends behind 0.45 s: no error, and what was before is kept."""
    with initialised(make_fmu(tmp_path / "A.fmu", "ends", **U_X), load=load, name="a") as fmu:
        times, x, stopped, run = ran(fmu)
        assert (times, x, stopped) == ([0.0, 0.25], [0.0, 0.125], None)
        assert run.ended.startswith("a ended the run after t = 0.25 s")
        assert list(run) == []


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize(("mode", "status"), [("discards", "discard"), ("errs", "error")])
def test_refused_steps_are_errors(tmp_path, load, mode, status):
    with initialised(make_fmu(tmp_path / "A.fmu", mode, **U_X), load=load, name="a") as fmu:
        times, _, stopped, run = ran(fmu)
    assert times == [0.0, 0.25]
    assert f"a: fmi2DoStep at t = 0.25 s gave status {status}" in str(stopped)
    assert run.ended == ""


@pytest.mark.parametrize("load", LOADS)
def test_steps_that_go_on_by_themselves_are_waited_for(tmp_path, load):
    with initialised(make_fmu(tmp_path / "A.fmu", "pends", **U_X), load=load) as fmu:
        assert ran(fmu)[:3] == ([0, 0.25, 0.5, 0.75, 1], [0, 0.125, 0.25, 0.375, 0.5], None)


@pytest.mark.parametrize(("mode", "words"), [("errs", "gave status error"), ("exits", "status 3")])
def test_a_failure_of_one_without_outputs_is_seen_in_its_step(tmp_path, mode, words):
    path = make_fmu(tmp_path / "A.fmu", mode, variables="u")
    with initialised(path, load=IsolatedComponent.load, name="a") as fmu:
        source = Signal("signal", [Variable(name="f")], lambda t: [t])
        system = System([source, fmu], [Connection("signal", "f", "a", "u")])
        points = cosimulate(system, jacobi(degree=0), 0.25, 1.0)
        assert [next(points).time, next(points).time] == [0.0, 0.25]
        with pytest.raises(RuntimeError, match=words) as caught:
            next(points)
        assert len(str(caught.value)) < 300


@pytest.mark.parametrize("load", LOADS)
def test_warnings_are_told_once_with_a_count(tmp_path, load):
    path = make_fmu(tmp_path / "A.fmu", "warns", **U_X)
    with initialised(path, load=load, name="a") as fmu:
        assert ran(fmu)[2] is None
        with pytest.warns(FmuWarning) as caught:
            fmu.close()
    assert [str(w.message) for w in caught] == ["a warned 4 times: step of 0.25 s (4 times)"]


def test_many_warnings_are_not_all_told():
    log = FmuLog(is_format=True)
    for k in range(100):
        log.note("warning", f"at {k}")
    assert log.warned() == "warned 100 times: others (50 times) | at 0 | at 1 | and 48 other texts"


FIXED = 'canHandleVariableCommunicationStepSize="false" canGetAndSetFMUstate="true"'


def test_fixed_steps(tmp_path):
    """Of 0.125 s alone: no shorter last one, no test of going back with another, no tolerance."""
    path = make_fmu(tmp_path / "A.fmu", "fixed step", able=FIXED, **U_X)
    with initialised(path, name="a") as fmu:
        with pytest.warns(UserWarning, match=r"a takes steps of one length only, so the run ends"):
            times, _, stopped, _ = ran(fmu, step=0.125, stop=0.45)
        assert (times, stopped) == ([0.0, 0.125, 0.25, 0.375], None)
    with initialised(path, name="a") as fmu:
        times, _, stopped, _ = ran(fmu, picard(degree=0), step=0.125, stop=0.5)
        assert (len(times), stopped) == (5, None)
    with initialised(path, name="a") as fmu:
        control = StepControl(order=1, largest=0.125, smallest=1e-5)
        with pytest.raises(ValueError, match=r"a takes steps of one length only .* no tolerance"):
            ran(fmu, step=control)


def test_results_come_before_a_crash_at_the_end(tmp_path):
    """The process dies where the FMU is closed; the file is written, and whole."""
    fmu = make_fmu(tmp_path / "A.fmu", "crashes late", **U_X)
    system = f"<ssd:Elements>{component(kinds='x=output')}</ssd:Elements>"
    path = pack(tmp_path / "s.ssp", ssd(system), A__fmu=fmu)
    out = tmp_path / "r.nc"
    script = "from railcosim.cli.main import run; run()"
    options = ["--out", str(out), "--step", "0.25", "--time", "1"]
    command = [sys.executable, "-c", script, "run-system", str(path), *options]
    done = subprocess.run(command, check=False)
    assert done.returncode == -signal.SIGSEGV
    with xr.open_dataset(out, engine="h5netcdf", decode_times=False) as dataset:
        assert dataset["x"].values.tolist() == [0, 0.125, 0.25, 0.375, 0.5]


def test_a_run_that_is_ended_is_a_result(tmp_path):
    fmu = make_fmu(tmp_path / "A.fmu", "ends", **U_X)
    system = f"<ssd:Elements>{component(kinds='x=output')}</ssd:Elements>"
    path = pack(tmp_path / "s.ssp", ssd(system), A__fmu=fmu)
    with pytest.warns(UserWarning, match=r"a ended the run after t = 0\.25 s"):
        dataset, stopped = run_ssp(
            path, lambda usual: jacobi(degree=0), lambda t, end: None, step=0.25, time=1.0
        )
    assert stopped is None
    assert dataset.attrs["stopped"] == "no"
    assert dataset.attrs["ended"].startswith("a ended the run")
    assert dataset["time"].values.tolist() == [0.0, 0.25]
