"""What anybody's FMU may do, and what becomes of it."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from railcosim.master.fmi.fmu import FmuComponent, FmuError

from .anybody import description, make_fmu


def initialised(path, **options):
    """One of them, ready to be stepped."""
    fmu = FmuComponent.load(path, **options)
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
        with pytest.raises(FmuError, match="a: its library has no fmi2GetDirectionalDerivative"):
            a.step_derivative()
