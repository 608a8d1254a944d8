"""The FMU adapter on a real FMU, made with pythonfmu here.

Everything that runs an FMU does so in a process of its own: a Python FMU shares modules with its
host, and one that fails can take the process with it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
import zipfile

import pytest

# The script's name is in sys.modules of every process that loads the FMU: used nowhere else.
NAME = "RailcosimMasterTestMass"
SLAVE = f'''
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability
from pythonfmu import Boolean, Integer, Real
from pythonfmu.enums import Fmi2Status

class {NAME}(Fmi2Slave):
    """x' = gain u with trapezoidal holds; y = x + u; hidden state not among the variables."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.u, self.gain, self.input_hold, self.quiet = 0.0, 0.25, 1.0, 0, False
        self.before = None
        at = dict(causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        fixed = dict(causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output, getter=self.y))
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        self.register_variable(Real("gain", **fixed))
        self.register_variable(Integer("input_hold", **at))
        self.register_variable(Boolean("quiet", **at))

    def y(self):
        return self.x + self.u

    def exit_initialization_mode(self):
        self.before = self.u

    def do_step(self, t, h):
        if self.u == 1e3:
            raise RuntimeError("100 %s of nothing")
        if self.u == 1e2:
            self.log("u is 100 % too much, %s %n", Fmi2Status.error)
            return False
        u, before = self.u, self.before
        begin, end = [(u, u), (u, 2 * u - before), (before, u)][self.input_hold]
        self.x += h * self.gain * (begin + end) / 2
        self.before = self.u
        return True

    def _get_fmu_state(self):
        return dict(x=self.x, u=self.u, before=self.before, input_hold=self.input_hold)

    def _set_fmu_state(self, state):
        self.__dict__.update(state)
'''


def run(script, *arguments, **environment):
    """Run a script in a fresh process; what it prints last is JSON."""
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=1800,
        env=os.environ | environment,
        check=False,
    )
    assert result.returncode == 0, f"{result.returncode}\n{result.stdout}\n{result.stderr}"
    return json.loads(result.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu")
    script = folder / f"{NAME.lower()}_script.py"
    script.write_text(SLAVE)
    run(
        """
        import sys
        from pythonfmu.builder import FmuBuilder
        FmuBuilder.build_FMU(
            sys.argv[1], dest=sys.argv[2], canGetAndSetFMUstate="true", canSerializeFMUstate="true"
        )
        print("null")
        """,
        script,
        folder,
    )
    return folder / f"{NAME}.fmu"


COUPLED = """
import json, sys
import numpy as np
from railcosim.master.component import Hold, Variable
from railcosim.master.connections import connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.signals import Signal
from railcosim.master.system import System

with FmuComponent.load(sys.argv[1], name="mass") as mass:
    mass.set_parameters({"gain": 3.0, "quiet": True})
    signal = Signal("signal", [Variable(name="u")], lambda t: [t])
    system = System([mass, signal], connect_by_name([mass, signal]))
    mass.enter_initialization(0.0, 1.0)
    system.exchange()
    mass.exit_initialization()
    points = list(cosimulate(system, gauss_seidel(first="mass"), 0.25, 1.0))
    names = system.names
    holds = sorted(mass.holds)
    folder = mass._calls._remove_folder.peek()[2][0]
    there = folder.exists()
    mass.close()
print(json.dumps([names, [list(p.outputs) for p in points], holds, there, folder.exists()]))
"""


def test_coupled_with_a_signal(fmu):
    names, values, holds, there, left = run(COUPLED, fmu)
    assert names == ["mass.y", "mass.x", "signal.u"]
    # x = 3/2 t^2, and the slave's trapezium rule is exact for u = t; all numbers are binary.
    t = [0.0, 0.25, 0.5, 0.75, 1.0]
    assert values == [[1.5 * a * a + a, 1.5 * a * a, a] for a in t]
    assert holds == [0, 1, 2]
    assert (there, left) == (True, False)


def test_rollback(fmu):
    result = run(
        """
        import gc, json, sys
        import numpy as np
        from railcosim.master.component import Hold
        from railcosim.master.fmi.fmu import FmuComponent, FmuError

        a, b = (FmuComponent.load(sys.argv[1], name=n) for n in "ab")
        for fmu in (a, b):
            fmu.enter_initialization(0.0)
            fmu.exit_initialization()
        rng = np.random.default_rng(1)

        def go(fmu, seed):
            rng = np.random.default_rng(seed)
            values = []
            fmu.set_hold(Hold.EXTRAPOLATE)
            for i in range(3):
                fmu.set_inputs(rng.normal(size=1))
                fmu.do_step(0.1 * i, 0.1)
                values.append(fmu.get_outputs().tobytes().hex())
            return values

        go(a, 1)
        state = a.save_state()
        first = go(a, 2)
        a.restore_state(state)
        second = go(a, 2)
        without = go(a, 2)
        b.restore_state(b.deserialize_state(a.serialize_state(state)))
        elsewhere = go(b, 2)
        refused = []
        try:
            b.restore_state(state)
        except FmuError as error:
            refused.append(str(error))
        # Snapshots dropped, freed with the FMU, and outliving it: none may crash.
        for _ in range(100):
            a.save_state()
        gc.collect()
        a.close()
        alive = state.free.alive
        try:
            a.restore_state(state)
        except FmuError as error:
            refused.append(str(error))
        del state
        gc.collect()
        a.close()
        b.close()
        print(json.dumps([first, second, without, elsewhere, refused, alive]))
        """,
        fmu,
    )
    first, second, without, elsewhere, refused, alive = result
    assert first == second == elsewhere
    assert first != without
    assert "belongs to another FMU" in refused[0]
    assert "closed" in refused[1]
    assert not alive


def test_misuse_and_refusals(fmu):
    messages, left = run(
        """
        import json, sys
        import numpy as np
        from railcosim.master.component import ComponentError
        from railcosim.master.fmi.fmu import FmuComponent, FmuError

        messages = []

        def expect(error, function, *arguments):
            try:
                function(*arguments)
            except error as caught:
                messages.append(str(caught))
            else:
                messages.append("nothing was raised")

        fmu = FmuComponent.load(sys.argv[1], name="mass")
        expect(FmuError, fmu.do_step, 0.0, 0.1)
        expect(FmuError, fmu.exit_initialization)
        expect(FmuError, fmu.set_parameters, {"quiet": True, "gian": 1.0})
        fmu.enter_initialization(0.0, None)
        expect(FmuError, fmu.enter_initialization, 0.0)
        fmu.exit_initialization()
        expect(FmuError, fmu.set_parameters, {"gain": 1.0})
        expect(ValueError, fmu.set_inputs, np.zeros(3))
        fmu.set_inputs(np.array([1e2]))
        expect(ComponentError, fmu.do_step, 0.5, 0.1)
        fmu.set_inputs(np.array([1e3]))
        state = fmu.save_state()
        expect(ComponentError, fmu.do_step, 0.7, 0.1)
        expect(FmuError, fmu.do_step, 0.7, 0.1)
        del state
        fmu.close()
        print(json.dumps([messages, fmu._calls._remove_folder.alive]))
        """,
        fmu,
    )
    early, exit_, unknown, twice, fixed, shape, discard, fatal, after = messages
    assert "is instantiated, but for this call it must be initialised" in early
    assert "must be in initialisation mode" in exit_
    assert "did you mean gain" in unknown
    assert "must be instantiated" in twice
    assert "gain is fixed" in fixed
    assert "3 values given for 1 inputs" in shape
    assert discard == (
        "mass: fmi2DoStep at t = 0.5 s gave status discard. "
        "The FMU said: u is 100 % too much, %s %n"
    )
    assert "mass: fmi2DoStep at t = 0.7 s gave status fatal" in fatal
    assert "100 %s of nothing" in fatal
    assert "closed, or given up after a fatal error" in after
    assert not left


def test_without_state_there_is_no_rollback(fmu, tmp_path):
    plain = tmp_path / "plain.fmu"
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(plain, "w") as target:
        for name in source.namelist():
            text = source.read(name)
            if name == "modelDescription.xml":
                text = text.replace(b'canGetAndSetFMUstate="true"', b'canGetAndSetFMUstate="false"')
            target.writestr(name, text)
    able, message = run(
        """
        import json, sys
        from railcosim.master.fmi.fmu import FmuComponent
        with FmuComponent.load(sys.argv[1]) as fmu:
            try:
                fmu.save_state()
            except ValueError as error:
                print(json.dumps([fmu.can_rollback, str(error)]))
        """,
        plain,
    )
    assert not able
    assert "canGetAndSetFMUstate is false" in message
