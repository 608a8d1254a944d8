"""What the master asks of components, counted; and its checks, which must cost little.

The counting is done by the FMU of benchmarks/overhead: a refused or superfluous call shows there.
"""

from __future__ import annotations

import importlib.util
import sys
from collections import Counter
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from railcosim.master.component import Variable
from railcosim.master.connections import Connection
from railcosim.master.cosimulation import Divergence, cosimulate
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from ..c_compiler import c_compiler
from .oscillator import make_right

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "overhead.py"
INPUTS, OUTPUTS, STEPS = 3, 5, 120


@pytest.fixture(scope="module")
def overhead():
    spec = importlib.util.spec_from_file_location("overhead_benchmark", SCRIPT)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)  # dataclasses look
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def mixer(overhead, tmp_path_factory):
    c_compiler()
    return overhead.make_fmu(tmp_path_factory.mktemp("mixer") / "fmu", INPUTS, OUTPUTS)


@pytest.fixture
def pair(mixer, tmp_path, monkeypatch):
    monkeypatch.setenv("MIXER_COUNTS", str(tmp_path / "counts"))
    with FmuComponent.load(mixer, name="a") as a, FmuComponent.load(mixer, name="b") as b:
        for fmu in (a, b):
            fmu.enter_initialization(0.0)
            fmu.exit_initialization()
        yield a, b


def crossed(a, b):
    """Each one's first outputs feed the other one."""
    return System(
        (a, b),
        [
            Connection(source, f"y[{i}]", target, f"u[{i}]")
            for source, target in ("ab", "ba")
            for i in range(INPUTS)
        ],
    )


def counts(tmp_path):
    rows = sorted((tmp_path / "counts").read_text().splitlines())
    table = np.array([[float(word) for word in row.split()[1:]] for row in rows])
    return table[table[:, 0] == STEPS]  # the master may try another instance first


@pytest.mark.parametrize("scheme", [jacobi(degree=0), gauss_seidel(first="b", degree=0)])
def test_every_value_is_passed_once_a_step(scheme, pair, tmp_path):
    """One set and one get; Gauss-Seidel sets the inputs of the second one once more at the end."""
    points = cosimulate(crossed(*pair), scheme, 0.25, 0.25 * STEPS)
    assert len(list(points)) == STEPS + 1
    for fmu in pair:
        fmu.close()
    _, values_set, values_got = counts(tmp_path)[:, :3].T
    again = np.array([0.0, 0.0]) if scheme == jacobi(degree=0) else np.array([STEPS, 0.0])
    np.testing.assert_array_equal(values_set, INPUTS * (STEPS + 1 + again))
    np.testing.assert_array_equal(values_got, OUTPUTS * (STEPS + 1))


def test_jacobi_gives_the_recursion(overhead, pair):
    points = list(cosimulate(crossed(*pair), jacobi(degree=0), 0.25, 0.25 * STEPS))
    job = overhead.Job(fmu="", inputs=INPUTS, outputs=OUTPUTS, steps=STEPS)
    # All are sums of halves: what rounding leaves is forgotten by a factor of two each step.
    np.testing.assert_allclose(
        points[-1].outputs.reshape(2, -1), overhead.expected(job), rtol=1e-15, atol=0
    )


def test_a_second_system_takes_the_components_over(pair):
    """Calls into an FMU are bound to a system's arrays: the newest one's."""
    first = crossed(*pair)
    list(cosimulate(first, jacobi(degree=0), 0.25, 1.0))
    before = first.outputs.copy()
    second = crossed(*pair)
    list(cosimulate(second, jacobi(degree=0), 0.25, 1.25))
    np.testing.assert_array_equal(first.outputs, before)
    assert not np.array_equal(second.outputs, before)


def test_a_closed_fmu_is_not_called(pair):
    a, b = pair
    points = cosimulate(crossed(a, b), jacobi(degree=0), 0.25, 10.0)
    list(islice(points, 3))
    b.close()
    with pytest.raises(FmuError, match="b: closed"):
        next(points)
    for call in (b.write_inputs, b.read_outputs, lambda: b.do_step(0.75, 0.25)):
        with pytest.raises(FmuError, match="b: closed"):
            call()
    with pytest.raises(FmuError, match="b: closed"):
        crossed(a, b)


def signals(function):
    force = Variable(name="force", nominal=1e5)
    crack = Variable(name="crack", nominal=1e-6)
    return System([Signal("s", [force, crack], function)], [])


def test_small_variable_is_not_hidden_by_large_ones():
    """Each is held against its own limit: 1e3 for the force, 1e-8 for the crack."""
    system = signals(lambda t: [800.0, 0.9e-8 * (1 + (t > 0.6))])
    points = cosimulate(system, jacobi(), 0.25, 2.0, limit=1e-2)
    assert [point.time for point in islice(points, 3)] == [0.0, 0.25, 0.5]
    with pytest.raises(Divergence, match=r"t = 0\.75 s: s\.crack"):
        next(points)


def test_values_near_their_own_limits_pass():
    """Together they are beyond a norm of one, each by itself is inside."""
    system = signals(lambda t: [999.0, 0.999e-8])
    assert len(list(cosimulate(system, jacobi(), 0.25, 1.0, limit=1e-2))) == 5


def test_a_system_without_outputs_runs():
    system = System([Signal("s", [], lambda t: [])], [])
    assert len(list(cosimulate(system, jacobi(), 0.25, 1.0))) == 5


class Mass(LinearComponent):
    """Of 2 kg, a force in, motion and acceleration out; it notes what it is asked."""

    def __init__(self):
        names = (("z", "m"), ("vz", "m/s"), ("az", "m/s2"))
        self.asked = Counter()
        super().__init__(
            "mass", inputs=[Variable(name="force", unit="N")],
            outputs=[Variable(name=name, unit=unit) for name, unit in names],
            A=[[0.0, 1.0], [0.0, 0.0]], B=[[0.0], [0.5]], C=[[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
            D=[[0.0], [0.0], [0.5]], x0=[1.0, 0.0],
        )  # fmt: skip

    def write_inputs(self):
        self.asked["write"] += 1
        super().write_inputs()

    def read_outputs(self):
        self.asked["read"] += 1
        super().read_outputs()


def test_what_only_a_reader_wants_is_found_once_a_step():
    """The acceleration depends on the force at once, but feeds nobody: no call on the way to it."""
    mass, right = Mass(), make_right()
    wires = [Connection("mass", name, "right", name) for name in ("z", "vz")]
    wires.append(Connection("right", "force", "mass", "force"))
    system = System([mass, right], wires)
    points = cosimulate(system, gauss_seidel(first="mass"), 0.01, 0.01 * STEPS)
    next(points)
    before = mass.asked.copy()
    force, acceleration = (system.names.index(name) for name in ("right.force", "mass.az"))
    for point in points:
        assert point.outputs[acceleration] == 0.5 * point.outputs[force]
    # Motions after the step, and all once the force at its end is known and set.
    assert mass.asked - before == Counter(read=2 * STEPS, write=STEPS)
