"""railcosim run SYSTEM.ssp: our pair as documented, foreign systems, and what is said."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.analysis.pair.ring import check_rings_of
from railcosim.master.connections import CouplingError
from railcosim.master.cosimulation import Divergence
from railcosim.master.fmi.archive import FmuError
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.system_run import run_ssp
from railcosim.plots.outputs import MOST, outputs_chart
from railcosim.track.decay import RingWarning

from ..importers.documented import Documented
from ..importers.job import make_job
from .plant import component, connection, make_fmu, pack, real, ssd, values

DEGREE = 0


def held(first):
    return jacobi(degree=DEGREE)


def sequential(first):
    return gauss_seidel(first=first, degree=DEGREE)


def quiet(time, stop):
    """No progress bar."""


@pytest.fixture(scope="module")
def pair(exported):
    return exported["Vehicle"].with_name("Pair.ssp")


@pytest.mark.parametrize(
    ("make", "scheme"),
    [(held, jacobi(degree=0)), (sequential, gauss_seidel(first="vehicle", degree=0))],
)
def test_pair_as_documented(exported, pair, make, scheme):
    """The bits of what the importers are held against, with the feedthrough they do not resolve.

    There FMUs, parameters and connections are given one by one, and values are exchanged once.
    """
    job = make_job(exported, (0.0, 0.0, 0.0, 0.0))
    expected = Documented(scheme=scheme, feedthrough=True, exchanges=1).rows(job)
    with pytest.warns(RingWarning, match=r"ring of 30 m .*these are 18\.2 m apart"):
        dataset, stopped = run_ssp(
            pair, make, quiet, time=job.steps * job.step, check=check_rings_of
        )
    assert stopped is None
    found = np.array([dataset[name].values for name in dataset.data_vars]).T[1:]
    np.testing.assert_array_equal(found, expected)
    assert dataset.attrs["communication_step"] == job.step
    assert dataset.attrs["start vehicle.wheelset[1].start_z"] > 1e-3
    # Something happens in it: 75 kN and 83 kN between railseats, at least.
    force = dataset["wheelset[1].left.force_z"].values
    assert np.ptp(force) > 1e3


@pytest.fixture
def plant(tmp_path):
    return make_fmu(tmp_path / "P.fmu", x="m")


@pytest.fixture
def package(tmp_path, plant):
    def make(rate, after=""):
        """x' = rate x, x(0) = 1."""
        a = component("a", more=values(real("x0", 1.0, "m")), u="input", x="output")
        b = component("b", more=values(real("k", rate)), u="input", z="output")
        wires = connection("a.x", "b.u") + connection("b.z", "a.u")
        system = f"<ssd:Elements>{a}{b}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>"
        return pack(tmp_path / "s.ssp", ssd(system, after), P__fmu=plant)

    return make


def test_foreign_system_from_a_start(package):
    experiment = '<ssd:DefaultExperiment startTime="3" stopTime="4"/>'
    dataset, stopped = run_ssp(
        package(-1.0, experiment), lambda usual: sequential("b"), quiet, step=0.25
    )
    assert stopped is None
    np.testing.assert_array_equal(dataset["time"], [3.0, 3.25, 3.5, 3.75, 4.0])
    # Euler's rule; powers of 0.75 are exact in binary numbers.
    np.testing.assert_array_equal(dataset["a.x"], 0.75 ** np.arange(5))
    assert dataset["a.x"].attrs["units"] == "m"
    assert dataset.attrs["title"] == "by hand"
    assert dataset.attrs["a file"] == "P.fmu"


def test_a_last_step_that_ends_a_rounding_behind(package):
    """9 steps of 1 ms and one more end behind 10 ms; an FMU that knew the stop would refuse."""
    assert 9 * 0.001 + 0.001 > 0.01
    dataset, stopped = run_ssp(package(-1.0), held, quiet, step=0.001, time=0.01)
    assert stopped is None
    assert dataset.sizes["time"] == 11


def test_a_run_that_diverges_keeps_what_it_has(package):
    """x = 11^n and z = 10 x: z passes 1e12, what an output without nominal value may be, at 11."""
    dataset, stopped = run_ssp(package(10.0), held, quiet, step=1.0, time=100.0)
    assert isinstance(stopped, Divergence)
    assert "diverged at t = 11 s" in str(stopped)
    np.testing.assert_array_equal(dataset["a.x"], 11.0 ** np.arange(11))
    assert dataset.attrs["stopped"] == str(stopped)


def test_what_counts_as_divergence_can_be_said(package):
    """z = 10 * 11^n passes 1e12 at n = 11, and 1e15, which a limit of 1e9 allows, at 14."""
    dataset, stopped = run_ssp(package(10.0), held, quiet, step=1.0, time=12.0, limit=1e9)
    assert stopped is None
    assert dataset["b.z"].values[-1] == 10.0 * 11.0**12
    _, stopped = run_ssp(package(10.0), held, quiet, step=1.0, time=12.0, limit=1e-3)
    assert "diverged at t = 2 s: a.z = 1210 " in str(stopped)


def test_what_is_missing(package):
    path = package(-1.0)
    with pytest.raises(FmuError, match=r"s\.ssp: does not say when to stop; give --time"):
        run_ssp(path, held, quiet, step=0.1)
    with pytest.raises(FmuError, match=r"does not say a communication step .*; give --step"):
        run_ssp(path, held, quiet, time=1.0)
    with pytest.raises(FmuError, match=r"stops at 0 s, with a step of 0\.1 s; it must"):
        run_ssp(path, held, quiet, time=0.0, step=0.1)
    with pytest.raises(CouplingError, match="no component 'c'; there are a, b"):
        run_ssp(path, lambda usual: sequential("c"), quiet, time=1.0, step=0.1)


def test_no_component(tmp_path):
    path = pack(tmp_path / "s.ssp", ssd(""))
    with pytest.raises(FmuError, match="has no component in it"):
        run_ssp(path, held, quiet, time=1.0, step=0.1)


def test_notes_are_said(tmp_path, plant):
    system = f"<ssd:Elements>{component('a', x='output')}</ssd:Elements>"
    path = pack(tmp_path / "s.ssp", ssd(values(real("nobody", 1.0)) + system), P__fmu=plant)
    with pytest.warns(UserWarning, match="nobody has a value, and nothing is called so"):
        run_ssp(path, held, quiet, time=1.0, step=0.5)


def test_chart(package, pair):
    """A panel for each unit and size, with no more curves than there are colours."""
    dataset, _ = run_ssp(package(-1.0), held, quiet, time=1.0, step=0.5)
    labels = [row[0].y_label for row in outputs_chart(dataset).rows]
    assert labels == ["outputs (m)", "outputs (no unit)"]
    dataset, _ = run_ssp(pair, held, quiet, time=2e-4)
    chart = outputs_chart(dataset)
    assert max(len(row[0].curves) for row in chart.rows) == MOST
    # 23 in m: positions of four wheelsets, 30 m, have a panel of their own.
    assert {"outputs (m)", f"first {MOST} of 19 outputs (m)"} <= {
        row[0].y_label for row in chart.rows
    }
