"""The pair linearised from inside, by differences and as black boxes, and coupled."""

import re
import runpy
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from railcosim.analysis.response.models import Models, pulses, wheelset_positions
from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT
from railcosim.master.linear.linear_form import error_estimate
from railcosim.master.linear.model_exchange import linear_model

SCRIPT = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "linearise.py"))
)
NAMES = ("Vehicle", "Track")
pytestmark = pytest.mark.slow  # some 100 000 steps of black boxes


@pytest.fixture(scope="module")
def forms(exported):
    """Each FMU linearised in a way, by name and way."""

    def linearised(name, way):
        path = exported.folder / f"{name}.fmu"
        return way(path, name, SCRIPT.wanted(name, exported.folder), lambda done, total: None)

    return {
        (name, way.description): linearised(name, way)
        for name in NAMES
        for way in (EXACT, DIFFERENCES, pulses(4))
    }


@pytest.mark.parametrize("name", NAMES)
def test_black_box(forms, name) -> None:
    """0.1-2000 Hz within 1e-6 of the exact one, at most 15 000 steps an input: both asked for.

    Of the displacements relative to the largest for the same force at the same frequency, and of
    the driving points relative to themselves. Measured on the whole track: 5e-8; vehicle: 3e-8.
    """
    model = forms[name, pulses(4).description]
    true = forms[name, EXACT.description].frequency_response(SCRIPT.OMEGA)
    errors = SCRIPT.errors(model, true)
    assert model.steps <= (8 + 1) * 15_000  # one record more, of all inputs at once
    assert errors["m"].max() < 1e-6
    assert errors["driving points"].max() < 1e-6
    assert model.advice == ()


@pytest.mark.parametrize("name", NAMES)
def test_differences(forms, name) -> None:
    """Our FMUs are linear, so only rounding is left: 1e-16 over the step of 1e-3, and some more."""
    model = forms[name, DIFFERENCES.description]
    errors = SCRIPT.errors(model, forms[name, EXACT.description].frequency_response(SCRIPT.OMEGA))
    assert errors["m"].max() < 1e-9
    assert error_estimate(model, SCRIPT.OMEGA[::8]).max() < 1e-8


def test_coupled_black_boxes_against_monolithic(exported, forms) -> None:
    """Both state spaces and the contact springs in one matrix, solved directly: 1e-6, asked for."""
    positions = wheelset_positions(exported.folder / "Vehicle.fmu")
    boxes, true = (
        Models(forms["Vehicle", way.description], forms["Track", way.description], positions, {})
        for way in (pulses(4), EXACT)
    )
    for k_H in SCRIPT.STIFFNESSES:
        # The exact forms, coupled by substructuring, show what that alone costs: rounding.
        for models, limit in ((true, 1e-9), (boxes, 1e-6)):
            for what, errors in SCRIPT.coupled_errors(models, true, k_H).items():
                assert errors.max() < limit, (k_H, what)


def test_fmu_that_declares_no_dependencies(exported, tmp_path) -> None:
    """FMI: then everything may depend on everything; the same matrices, found column by column."""
    silent = tmp_path / "silent.fmu"
    with (
        zipfile.ZipFile(exported.folder / "Vehicle.fmu") as old,
        zipfile.ZipFile(silent, "w") as new,
    ):
        for entry in old.infolist():
            content = old.read(entry)
            if entry.filename == "modelDescription.xml":
                content, n = re.subn(rb' dependencies(Kind)?="[^"]*"', b"", content)
                assert n > 50
            new.writestr(entry, content)
    told = linear_model(exported.folder / "Vehicle.fmu")
    found = linear_model(silent)
    assert found.A.nnz == found.A.shape[0] ** 2 > told.A.nnz
    np.testing.assert_array_equal(found.A.toarray(), told.A.toarray())
    np.testing.assert_array_equal(found.C, told.C)
    omega = SCRIPT.OMEGA[::40]
    size = np.abs(told.frequency_response(omega)).max()
    np.testing.assert_allclose(
        found.frequency_response(omega),
        told.frequency_response(omega),
        rtol=1e-9,
        atol=1e-12 * size,
    )
