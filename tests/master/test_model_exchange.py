"""Linear models by Model Exchange, of an FMU by somebody else: pendulum.c, strict and silent."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.flaws import FlawWarning
from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT, Pulses, best_way
from railcosim.master.linear.linear_form import error_estimate
from railcosim.master.linear.model_exchange import exact, linear_model

from ..c_compiler import c_compiler

G, LENGTH, DAMPING, INERTIA = 9.81, 0.5, 0.3, 2.0 * 0.25
PULSES = Pulses(amplitude=1.0, step=1e-3, steps=1000)

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Pendulum" guid="pendulum">
  <ModelExchange modelIdentifier="pendulum"/>
  <ModelVariables>
    <ScalarVariable name="phi" valueReference="0"><Real/></ScalarVariable>
    <ScalarVariable name="omega" valueReference="1"><Real/></ScalarVariable>
    <ScalarVariable name="der(phi)" valueReference="2"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="a" valueReference="3" causality="output">
      <Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="4" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="torque" valueReference="5" causality="input">
      <Real start="0" nominal="2"/></ScalarVariable>
    <ScalarVariable name="gear" valueReference="6" causality="input" variability="discrete">
      <Real start="1"/></ScalarVariable>
    <ScalarVariable name="phi0" valueReference="7" causality="parameter" variability="fixed">
      <Real start="0"/></ScalarVariable>
    <ScalarVariable name="rest" valueReference="0" causality="parameter" variability="fixed">
      <Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="4"/><Unknown index="5"/></Outputs>
    <Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives>
    <InitialUnknowns><Unknown index="4"/><Unknown index="5"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>"""


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("pendulum")
    library = folder / f"pendulum{fmpy.sharedLibraryExtension}"
    command = c_compiler()
    source = Path(__file__).with_name("pendulum.c")
    subprocess.run(
        [*command, "-shared", "-fPIC", "-Wall", "-Wextra", "-o", library, source, "-lm"], check=True
    )
    with zipfile.ZipFile(folder / "pendulum.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", XML)
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return folder / "pendulum.fmu"


def test_what_is_not_declared_is_found_and_told(pendulum, tmp_path) -> None:
    """A pendulum that says its acceleration depends on its speed alone: right all the same."""
    phi = 0.7
    held = {"parameters": {"phi0": phi}, "at": {"torque": INERTIA * G / LENGTH * np.sin(phi)}}
    wrong = tmp_path / "wrong.fmu"
    with zipfile.ZipFile(pendulum) as old, zipfile.ZipFile(wrong, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            if name == "modelDescription.xml":
                text = text.replace(
                    b'<Derivatives><Unknown index="3"/><Unknown index="4"/>',
                    b'<Derivatives><Unknown index="3" dependencies="2"/>'
                    b'<Unknown index="4" dependencies="2"/>',
                ).replace(
                    b'<Outputs><Unknown index="4"', b'<Outputs><Unknown index="4" dependencies="2"'
                )
            new.writestr(name, text)
    with pytest.warns(FlawWarning, match=r"does not say that a depends on phi, and 1 more like it"):
        found = linear_model(wrong, **held)
    true = linear_model(pendulum, **held)
    np.testing.assert_array_equal(found.A.toarray(), true.A.toarray())
    np.testing.assert_array_equal(found.B, true.B)


def test_pendulum_by_differences(pendulum) -> None:
    """Deflected and held by the motor: stiffness g/l cos phi. Nothing was declared."""
    phi = 0.7
    torque = INERTIA * G / LENGTH * np.sin(phi)
    model = linear_model(pendulum, parameters={"phi0": phi}, at={"torque": torque})
    assert [v.name for v in model.inputs] == ["torque"]  # the gear does not move continuously
    assert [v.name for v in model.outputs] == ["a", "x"]
    row = [-G / LENGTH * np.cos(phi), -DAMPING]
    # h^4 = 1e-12 of the fifth derivative of a sine, and rounding 1e-16 / 1e-3 of the rates' 10.
    near = {"rtol": 1e-11, "atol": 3e-12}
    np.testing.assert_allclose(model.A.toarray(), [[0.0, 1.0], row], **near)
    np.testing.assert_allclose(model.B, [[0.0], [1 / INERTIA]], **near)
    np.testing.assert_allclose(model.C, [row, [LENGTH * np.cos(phi), 0.0]], **near)
    np.testing.assert_allclose(model.D, [[1 / INERTIA], [0.0]], **near)


def test_error_of_differences(pendulum) -> None:
    """The estimate is not smaller than the error, and not much larger than rounding."""
    model = linear_model(pendulum, parameters={"phi0": 0.7})
    omega = np.linspace(0.1, 20.0, 100)
    stiffness = G / LENGTH * np.cos(0.7)
    x = LENGTH * np.cos(0.7) / INERTIA / (stiffness - omega**2 + 1j * DAMPING * omega)
    error = np.abs(model.frequency_response(omega)[:, 1, 0] / x - 1.0).max()
    estimate = error_estimate(model, omega)[1, 0]
    assert error < estimate < 1e-9


def test_best_way(pendulum) -> None:
    assert best_way(pendulum, PULSES) is DIFFERENCES


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"inputs": ["torqu"]}, "no continuous input torqu; did you mean torque"),
        ({"outputs": ["y"]}, "no output y"),
        ({"at": {"gear": 2.0}}, "no continuous input gear"),
        ({"parameters": {"length": 2.0}}, "no parameter 'length'"),
        ({"slope": exact}, "no directional derivatives"),
    ],
)
def test_refusals(pendulum, options, sentence) -> None:
    with pytest.raises(FmuError, match=sentence):
        linear_model(pendulum, **options)


@pytest.mark.parametrize(
    ("rest", "sentence"), [(1, "events at t = 0 s do not end"), (2, "ends at once, at t = 0 s")]
)
def test_fmus_that_do_not_come_to_rest(pendulum, rest, sentence) -> None:
    with pytest.raises(ComponentError, match=sentence):
        linear_model(pendulum, parameters={"rest": rest})


def test_an_fmu_for_co_simulation_only(pendulum, tmp_path) -> None:
    """Is named, and linearised by pulses."""
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("modelDescription.xml", XML.replace("<ModelExchange", "<CoSimulation"))
    with pytest.raises(FmuError, match=r"no Model Exchange in it; .*or linearise it by pulses"):
        linear_model(other)
    assert best_way(other, PULSES) is PULSES
    assert EXACT.description != DIFFERENCES.description != PULSES.description


def test_nothing_is_left_behind(pendulum, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    linear_model(pendulum)
    for options in ({"outputs": ["y"]}, {"parameters": {"rest": 1}}):
        with pytest.raises((FmuError, ComponentError)):
            linear_model(pendulum, **options)
    assert not list(tmp_path.glob("railcosim_*/fmu_*"))
