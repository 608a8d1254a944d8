"""Lists of calls made in C and in Python: the same to the bit, whatever FMUs do.

That either is right is held against closed forms elsewhere, by whichever runs there.
"""

import warnings
from contextlib import contextmanager

import numpy as np
import pytest

from railcosim.master.batch import batch
from railcosim.master.batch.library import in_c
from railcosim.master.component import Variable
from railcosim.master.connections import Connection
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.linear_component import LinearComponent
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .anybody import make_fmu
from .anybody3 import make_fmu3

EVENTS = 'hasEventMode="true" canHandleVariableCommunicationStepSize="true"'
U_X = {"variables": "u x"}
CASES = {
    **{f"2 {mode}": (make_fmu, mode, U_X) for mode in (
        "plain", "errs", "ends", "discards", "pends", "nan", "strict", "warns", "changes", "past")},
    **{f"3 {mode}": (make_fmu3, mode, U_X) for mode in (
        "plain", "errs", "ends", "ends early", "early", "stuck", "nan", "warns")},
    "2 with whole numbers": (make_fmu, "plain", {"variables": "u x n twice b not_b"}),
    "3 with whole numbers": (make_fmu3, "plain", {"variables": "u x int32 int32_out f f_out"}),
    "3 with events": (make_fmu3, "event", {"variables": "u x events countdown", "able": EVENTS}),
}  # fmt: skip
"""What makes an FMU, its mode, and what it says of itself."""


@pytest.fixture(params=["C", "Python"])
def made_by(request, monkeypatch):
    """Who makes the calls of a batch."""
    if request.param == "Python":
        monkeypatch.setattr(batch, "in_c", lambda: None)
    elif in_c() is None:
        pytest.skip("no C compiler: apt install gcc")
    return request.param


def told(folder, case, scheme, load=FmuComponent.load):
    """All there is to know of a run of a signal and two FMUs, the second of them one of a case."""
    make, mode, about = case
    if not (plain := folder / "plain.fmu").exists():
        make(plain, variables="u x")
        make(folder / "odd.fmu", mode, **about)
    signal = Signal("signal", [Variable(name="f")], lambda t: [1.0 + t * t])
    with (
        warnings.catch_warnings(record=True) as warned,
        load(plain, name="a") as a,
        load(folder / "odd.fmu", name="b") as b,
    ):
        warnings.simplefilter("always")
        wires = [("a", "x", "b", "u"), ("b", "x", "a", "u")]
        system = System([signal, a, b], [Connection(*wire) for wire in wires])
        for fmu in (a, b):
            fmu.enter_initialization(0.0)
        system.exchange()
        for fmu in (a, b):
            fmu.exit_initialization()
        in_use = cosimulate(system, scheme, 0.25, 1.0)
        recorder = Recorder(system)
        try:
            stopped = record(in_use, recorder)
        except Divergence as divergence:
            stopped = divergence
        messages = a.messages, b.messages
        ways = {found[0].run.__name__ for found in system._exchanges._made.values()}
    said = [str(w.message) for w in warned]
    return (recorder.rows().tobytes(), repr(stopped), in_use.ended, messages, said), ways


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("scheme", [jacobi(degree=0), gauss_seidel(first="b")], ids=str)
def test_c_and_python_give_the_same(tmp_path, monkeypatch, name, scheme):
    if in_c() is None:
        pytest.skip("no C compiler: apt install gcc")
    by_c, ways = told(tmp_path, CASES[name], scheme)
    assert "_by_c" in ways
    monkeypatch.setattr(batch, "in_c", lambda: None)
    by_python, ways = told(tmp_path, CASES[name], scheme)
    assert ways == {"_by_python"}
    assert by_c == by_python


def test_in_processes_of_their_own(tmp_path):
    """To the bit what is in this process, as long as it goes; Python makes these calls."""
    (tmp_path / "here").mkdir()
    here, ways = told(tmp_path / "here", CASES["2 errs"], jacobi(degree=0))
    isolated, others = told(tmp_path, CASES["2 errs"], jacobi(degree=0), IsolatedComponent.load)
    assert ("_by_c" in ways) == (in_c() is not None)
    assert others == {"_by_python"}
    assert isolated[0] == here[0]
    assert isolated[2:4] == here[2:4]


@contextmanager
def make_two(folder, make):
    """Context of two FMUs, running, the first feeding the second, and their system."""
    path = make(folder / f"{make.__name__}.fmu", variables="u x")
    with FmuComponent.load(path, name="a") as a, FmuComponent.load(path, name="b") as b:
        for fmu in (a, b):
            fmu.enter_initialization(0.0)
            fmu.exit_initialization()
        yield a, b, System([a, b], [Connection("a", "x", "b", "u")])


def test_where_fmus_are_is_known(tmp_path, made_by):
    """Errors quote it, and clocks of FMI 3 go by it: after steps made with others as well."""
    for make in (make_fmu, make_fmu3):
        with make_two(tmp_path, make) as (a, b, system):
            list(cosimulate(system, jacobi(degree=0), 0.25, 0.5))
            assert (a._calls.time, b._calls.time) == (0.5, 0.5)
            a.do_step(0.5, 0.125)
            assert (a._calls.time, b._calls.time) == (0.625, 0.5)


def test_what_is_closed_between_steps_is_not_called(tmp_path, made_by):
    with make_two(tmp_path, make_fmu3) as (_, b, system):
        points = cosimulate(system, jacobi(degree=0), 0.25, 1.0)
        next(points), next(points)
        b.close()
        with pytest.raises(FmuError, match="b: closed"):
            next(points)


def test_a_component_of_python_between_fmus(tmp_path, made_by):
    """C stops there and goes on behind it; an integrator of what is 0.5 all the time."""
    with make_two(tmp_path, make_fmu) as (a, b, _):
        inner = LinearComponent(
            "inner", inputs=[Variable(name="u")], outputs=[Variable(name="x")],
            A=[[0.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]], x0=[0.0],
        )  # fmt: skip
        wires = [("a", "x", "inner", "u"), ("inner", "x", "b", "u")]
        system = System([a, inner, b], [Connection(*wire) for wire in wires])
        points = list(cosimulate(system, jacobi(degree=0), 0.25, 1.0))
    found = np.array([point.outputs for point in points])
    # Sums of the values at the beginnings of steps: a_k = k/8, and so on; exact in binary.
    k = np.arange(5)
    expected = np.transpose([k / 8, k * (k - 1) / 64, k * (k - 1) * (k - 2) / 768])
    np.testing.assert_array_equal(found, expected)
