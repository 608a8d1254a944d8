"""railcosim run SYSTEM.ssp: what it leaves behind, also when it fails."""

import numpy as np
import pytest

from railcosim.cli.keeping_options import KeepingOptions
from railcosim.cli.options import UsageError
from railcosim.cli.run_system_command import run_system as command
from railcosim.cli.scheme_options import CourseOptions, Inputs
from railcosim.master.cosimulation import Divergence
from railcosim.master.files import load

from ..master import mass
from ..master.plant import component, connection, make_fmu, pack, real, ssd, values


def run_system(path, out, plot=None, *, law=None, scheme="gauss-seidel", inputs=None, **course):
    command(
        system=path, out=out, plot=plot, law=law, keeping=KeepingOptions(), context=None,
        course=CourseOptions(scheme=scheme, inputs=inputs, **course),
    )  # fmt: skip


@pytest.fixture
def package(tmp_path):
    def make(rate):
        """x' = rate x, x(0) = 1, by Euler's rule."""
        a = component("a", more=values(real("x0", 1.0)), u="input", x="output")
        b = component("b", more=values(real("k", rate)), u="input", z="output")
        wires = connection("a.x", "b.u") + connection("b.z", "a.u")
        system = f"<ssd:Elements>{a}{b}</ssd:Elements><ssd:Connections>{wires}</ssd:Connections>"
        fmu = make_fmu(tmp_path / "P.fmu")
        return pack(tmp_path / "s.ssp", ssd(system), P__fmu=fmu)

    return make


def test_result_and_picture(package, tmp_path, capsys):
    out, plot = tmp_path / "s.nc", tmp_path / "s.png"
    run_system(package(-1.0), out, plot, inputs=Inputs.CONSTANT, step=0.25, time=1.0)
    np.testing.assert_array_equal(load(out)["a.x"], 0.75 ** np.arange(5))
    assert plot.read_bytes().startswith(b"\x89PNG")
    said = "".join(capsys.readouterr().out.split())  # rich breaks long paths
    assert "s.nc:5communicationpoints" in said


def test_a_failed_run_is_saved(package, tmp_path):
    out = tmp_path / "s.csv"
    with pytest.raises(Divergence, match="diverged at t = 11 s"):
        run_system(package(10.0), out, inputs=Inputs.CONSTANT, step=1.0, time=100.0)
    np.testing.assert_array_equal(load(out)["a.x"], 11.0 ** np.arange(11))


def test_options(package, tmp_path):
    path = package(-1.0)
    with pytest.raises(UsageError, match=r"--step 0: must be > 0 s"):
        run_system(path, tmp_path / "s.nc", step=0.0, time=1.0)
    with pytest.raises(UsageError, match=r"--time -1: must be > 0 s"):
        run_system(path, tmp_path / "t.nc", step=0.1, time=-1.0)
    with pytest.raises(UsageError, match=r"--out .*must end in"):
        run_system(path, tmp_path / "s.txt", step=0.1, time=1.0)


def test_a_law_in_the_master(tmp_path):
    """Springs that no FMU has: the uncut oscillator, by a scheme that solves the law."""
    path, law = mass.made(mass.compiled(tmp_path), tmp_path, "master")

    def error(step):
        out = tmp_path / f"{step}.nc"
        run_system(path, out, law=law, scheme="interface-jacobian", step=step, time=2.0)
        run = load(out)
        assert run.attrs["law"] == law.read_text()
        return np.abs(run["left.z"].values - mass.exact(run["time"].values)[:, 0]).max()

    coarse, fine = error(0.02), error(0.01)
    # Half a metre swings at w = 11 rad/s and dies down by 0.65/s; its phase is off by
    # w t (w h)^2 / 12, which does most after 1.5 s: 3.1 mm.
    assert fine < 3.1e-3
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
    with pytest.raises(UsageError, match="give it one by --law"):
        run_system(path, tmp_path / "none.nc", scheme="interface-jacobian")
