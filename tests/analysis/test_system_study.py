"""Studies of any system of FMUs: schemes held against what the system does by itself."""

import numpy as np
import pytest

from railcosim.analysis.schemes.extrapolated import extrapolated
from railcosim.analysis.schemes.grid_run import study_system
from railcosim.analysis.schemes.study import StudyError
from railcosim.master.component import ComponentError
from railcosim.master.fmi.archive import FmuError
from railcosim.parameters import ArgumentError

from ..master import mass

TIME, STEPS = 2.0, (0.02, 0.01)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return mass.compiled(tmp_path_factory.mktemp("mass"))


@pytest.mark.slow  # runs in processes of their own: 15 s
@pytest.mark.parametrize("owner", ["right", "master"])
def test_errors_are_those_to_the_uncut_oscillator(library, tmp_path, owner) -> None:
    """Which no run knows of: both masses as one."""
    path, law = mass.made(library, tmp_path, owner)
    names = ["nepce", "interface-jacobian"]
    found = study_system(path, tmp_path / "out", names, STEPS, law=law, time=TIME)
    assert not found.failed
    table = found.table.isel(owner=0, contact=0)
    believed = float(table["reference_error"].max())
    assert believed < 5e-4  # runs of first order, inputs being held, by steps of 0.6 ms at least
    assert set(table["scheme"].values) == {*names[: 1 if law is None else 2]}
    # Of the reference itself: the error of a run, found again by hand.
    wanted = of_a_run(path, law, "nepce", STEPS[1])
    assert float(table["error"].sel(scheme="nepce", step=STEPS[1])) == pytest.approx(
        wanted, abs=2 * believed
    )
    # As claimed; the spring turns by 0.1 to 0.2 a step, which is not quite small.
    assert float(table["observed_order"].sel(scheme="nepce")) == pytest.approx(2.0, abs=0.1)


def of_a_run(path, law, name, step):
    """Error of a run of the FMUs to the uncut oscillator, of all that they exchange."""
    from railcosim.analysis.schemes.catalogue import members  # noqa: PLC0415
    from railcosim.analysis.schemes.system_study import exchanged  # noqa: PLC0415
    from railcosim.master.cosimulation import cosimulate  # noqa: PLC0415
    from railcosim.master.ssp import initialise, open_ssp  # noqa: PLC0415
    from railcosim.master.system import System  # noqa: PLC0415

    with open_ssp(path, law=law) as loaded:
        system = System(loaded.components, loaded.connections)
        initialise(system, loaded.fmus, 0.0)
        columns = exchanged(system, loaded)
        scheme = members(("left", "right"))[name].scheme
        points = list(cosimulate(system, scheme, step, TIME))
        ours = np.array([p.outputs[columns] for p in points])
        names = [system.names[k] for k in columns]

    def right(times):
        x1, v1, x2, v2 = mass.exact(times).T
        force = mass.K_C * (x1 - x2) + mass.C_C * (v1 - v2)
        known = {"left.z": x1, "left.vz": v1, "right.z": x2, "right.vz": v2}
        # With the law its force is on the right; without, the right mass gives what is on the left.
        rest = {"right.f": -force, "law.left.f": -force, "law.right.f": force}
        return np.stack([(known | rest)[n] for n in names], axis=1)

    fine = right(np.linspace(0.0, TIME, 2001))
    scale = np.sqrt(np.mean((fine - fine[0]) ** 2, axis=0))
    exact = right([p.time for p in points])
    off = np.mean(((ours - exact) / scale) ** 2)
    return np.sqrt(off / np.mean(((exact - exact[0]) / scale) ** 2))


def test_extrapolation_of_known_errors() -> None:
    """Second order and a little third: what is left is of the third, and is told."""
    t = np.linspace(0.0, 1.0, 101)[:, None]

    def runs(scheme, part):
        h = 1.0 / part
        return np.sin(3 * t) + scheme * h**2 * t + 0.1 * h**3 * t**2

    found = extrapolated(runs, [1.0, -1.0], np.array([0]), 0.0, 0.01)
    error = np.sqrt(np.mean((found.values * found.scale - np.sin(3 * t)) ** 2)) / found.scale[0]
    assert error < found.error < 1e-3
    between = found.at([0.123, 0.5])[:, 0] * found.scale[0]
    # Of the extrapolation's error, and of a polynomial of degree 5 over 0.05 s: 1e-9.
    assert between == pytest.approx(np.sin([0.369, 1.5]), abs=2 * found.error * found.scale[0])


def test_references_that_cannot_be_believed() -> None:
    def noise(scheme, part):
        return np.random.default_rng(part).standard_normal((50, 1))

    def fails(scheme, part):
        raise ComponentError("left: refuses")

    with pytest.raises(ComponentError, match=r"known to .* of what moves; take shorter steps"):
        extrapolated(noise, [1], np.array([0]), 0.0, 0.1)
    with pytest.raises(ComponentError, match=r"do not end \(left: refuses\)"):
        extrapolated(fails, [1, 2], np.array([0]), 0.0, 0.1)
    with pytest.raises(ComponentError, match="nothing that is exchanged moves"):
        extrapolated(lambda s, p: np.ones((9, 1)), [1], np.array([0]), 0.0, 0.1)


def test_what_is_refused(library, tmp_path) -> None:
    path, _ = mass.made(library, tmp_path, "right")
    with pytest.raises(FmuError, match="give --time"):
        study_system(path, tmp_path / "out", ["nepce"], STEPS)
    with pytest.raises(FmuError, match="give --steps"):
        study_system(path, tmp_path / "out", ["nepce"], time=1.0)
    with pytest.raises(ArgumentError, match="no such scheme"):
        study_system(path, tmp_path / "out", ["nepze"], STEPS, time=1.0)
    (tmp_path / "out").mkdir(exist_ok=True)
    (tmp_path / "out" / "study.json").write_text('{"time": 2.0}')
    with pytest.raises(StudyError, match="another study"):
        study_system(path, tmp_path / "out", ["nepce"], STEPS, time=1.0)
