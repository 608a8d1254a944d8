"""A run from Python: what is not said is chosen, and what is wrong is not returned as right."""

import numpy as np
import pytest

import railcosim
from railcosim.analysis.pair.verdict import NotBelievedError
from railcosim.master.schemes.jacobi import jacobi
from railcosim.parameters import ArgumentError

FORCE = "wheelset[1].left.force_z"


def test_what_is_not_said_is_what_the_command_takes(exported):
    pair = exported["Vehicle"], exported["TrackWithContact"]
    run = railcosim.run(*pair, time=0.005)
    assert run.attrs["verdict"] == "no sign of an unstable coupling"
    assert run.attrs["communication_step"] == 1e-4
    assert "Gauss-Seidel" in run.attrs["scheme"]
    assert float(run[FORCE][0]) == pytest.approx(79265, abs=1)
    again = railcosim.run(*pair, time=0.005, scheme="gauss-seidel", step=1e-4)
    assert np.array_equal(run[FORCE], again[FORCE])


def test_a_scheme_of_ones_own_and_a_linear_contact(exported):
    run = railcosim.run(
        exported["Vehicle"], exported["TrackWithContact"],
        scheme=jacobi(degree=0), held=True, contact=2e9, irregularity="none", step=1e-4, time=0.002,
    )  # fmt: skip
    assert "Jacobi" in run.attrs["scheme"]
    assert run.attrs["parameter contact.stiffness"] == 2e9
    assert np.allclose(run[FORCE], run[FORCE][0], rtol=1e-6)  # at rest it stays at rest


def test_an_unstable_run_is_not_returned(exported):
    """The largest stable step at 8 GN/m with the contact in the vehicle is below 0.06 ms."""
    with pytest.raises(Exception) as failed:  # noqa: PT011 - diverges, or is not believed
        railcosim.run(
            exported["VehicleWithContact"], exported["Track"], contact=8e9, step=2e-4, time=0.05
        )
    assert failed.type is NotBelievedError or "diverged" in str(failed.value)
    assert failed.value.dataset.sizes["time"] > 1


def test_no_such_scheme(exported):
    with pytest.raises(ArgumentError, match="did you mean jacobi"):
        railcosim.run(exported["Vehicle"], exported["Track"], scheme="jakobi", time=0.01)
